"""Friction at nodes whose tangential displacement follows from the normal one.

Where a support holds a node in one direction, one displacement moves it along the normal and along the tangent of
contact at once: ``u_t = slope u_n + constant``. Normal traction and friction act on that displacement together, as the
effective pressure ``P = sigma_n + slope sigma_t``. A body that knows one traction at such a node solves for P; given
friction, ``sigma_t = q sigma_n + r``, then gives both tractions.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bemkit.arrays import BoolArray, FloatArray, IntArray
from bemkit.contact.body import ContactState, SingularResponse
from bemkit.errors import InputError
from bemkit.operators.boundary_equations import LinearConditions

_JAMS = 1e-9
"""Effective pressure by normal traction that friction cancels, relative to its two terms."""


@dataclass(frozen=True, eq=False)
class HeldFriction:
    """Which tangents follow, and how friction there acts on the displacement that remains.

    Parameters
    ----------
    follows : (n_contact,) bool array
    slope : (n_contact,) array [-]
        du_t / du_n at these nodes; NaN where the tangent follows from other nodes, too, and friction cannot act.
    """

    follows: BoolArray
    slope: FloatArray

    def substituted(self, conditions: LinearConditions) -> LinearConditions:
        """Return conditions in which P takes the place of sigma_n, and sigma_t is zero.

        Raises
        ------
        InputError
            If the tangential condition at such a node involves displacements.
        SingularResponse
            If friction there cancels the pressure that causes it.
        """
        nodes = np.flatnonzero(self.follows)
        if not nodes.size:
            return conditions
        share, rest = self._friction(conditions, nodes)
        factor, slope = self._factor(share, nodes), np.nan_to_num(self.slope[nodes])
        on_displacement, on_traction, value = (
            array.copy() for array in (conditions.on_displacement, conditions.on_traction, conditions.value)
        )
        # a condition on sigma_n and sigma_t, both of which follow from P
        by_normal = on_traction[nodes, 0, 0] + on_traction[nodes, 0, 1] * share
        value[nodes, 0] += by_normal * slope * rest / factor - on_traction[nodes, 0, 1] * rest
        on_traction[nodes] = [[0.0, 0.0], [0.0, 1.0]]
        on_traction[nodes, 0, 0] = by_normal / factor
        on_displacement[nodes, 1], value[nodes, 1] = 0.0, 0.0
        return LinearConditions(on_displacement, on_traction, value)

    def check(self, conditions: LinearConditions) -> None:
        """Raise InputError if a tangential condition at such a node involves displacements."""
        self._friction(conditions, np.flatnonzero(self.follows))

    def restored(self, conditions: LinearConditions, state: ContactState) -> ContactState:
        """Return a response to substituted conditions with both tractions of each node."""
        nodes = np.flatnonzero(self.follows)
        if not nodes.size:
            return state
        share, rest = self._friction(conditions, nodes)
        traction = state.traction.copy()
        normal = (traction[nodes, 0] - np.nan_to_num(self.slope[nodes]) * rest) / self._factor(share, nodes)
        traction[nodes] = np.stack([normal, share * normal + rest], axis=1)
        return ContactState(state.displacement, conditions.with_given_tractions(traction))

    def effective(self, traction: FloatArray) -> FloatArray:
        """Return tractions (n_contact, 2) with P in place of sigma_n, and without friction at these nodes."""
        nodes = np.flatnonzero(self.follows)
        result = traction.copy()
        result[nodes, 0] += np.nan_to_num(self.slope[nodes]) * traction[nodes, 1]
        result[nodes, 1] = 0.0
        return result

    def _friction(self, conditions: LinearConditions, nodes: IntArray) -> tuple[FloatArray, FloatArray]:
        """Return q and r of the given friction ``sigma_t = q sigma_n + r`` at nodes (k,)."""
        on_displacement, on_traction = conditions.on_displacement[nodes], conditions.on_traction[nodes]
        is_wrong = np.any(on_displacement[:, 1] != 0.0, axis=1) | (on_displacement[:, 0, 1] != 0.0)
        is_wrong |= on_traction[:, 1, 1] == 0.0
        factor = np.where(is_wrong, 1.0, on_traction[:, 1, 1])
        share, rest = -on_traction[:, 1, 0] / factor, conditions.value[nodes, 1] / factor
        is_wrong |= np.isnan(self.slope[nodes]) & ((share != 0.0) | (rest != 0.0))
        if is_wrong.any():
            raise InputError(
                f"the tangential displacement of contact node {nodes[np.argmax(is_wrong)]} follows from a support or "
                "from two obstacles: give sigma_t there, by a condition on tractions, or ask ContactProblem.respond"
            )
        return share, rest

    def _factor(self, share: FloatArray, nodes: IntArray) -> FloatArray:
        """Return the effective pressure (k,) by the normal traction that causes it and its friction."""
        by_friction = np.nan_to_num(self.slope[nodes]) * share
        factor = 1.0 + by_friction
        jams = np.abs(factor) < _JAMS * (1.0 + np.abs(by_friction))
        if jams.any():
            raise SingularResponse(f"friction at contact node {nodes[np.argmax(jams)]} jams the support that holds it")
        return np.asarray(factor)
