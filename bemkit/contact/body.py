"""The interface of elastic bodies: conditions of contact nodes in each status, their state and slip, and responses.

Components are (n, t): index 0 along the outward normal, index 1 along the tangent. The first condition of a node is the
normal one, the second the tangential one.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from bemkit.arrays import BoolArray, FloatArray, IntArray
from bemkit.contact.equilibrium import Imbalance
from bemkit.errors import BemkitError, InputError
from bemkit.operators.boundary_equations import LinearConditions
from bemkit.operators.rigid_modes import RigidMotions, as_rows, largest_components


class SingularResponse(BemkitError, ArithmeticError):  # noqa: N818 - a response, not a mistake of the caller
    """The conditions at the contact nodes do not hold the body, or contradict each other."""


class ClosedVolume(SingularResponse):
    """Supports and the conditions at the contact nodes hold the whole boundary of an incompressible body."""

    def __init__(self) -> None:
        super().__init__("displacements at the contact nodes cannot keep the volume of a body of poisson_ratio 0.5")


class FreeMotion(SingularResponse):
    """Under the conditions at the contact nodes something can move as a rigid body."""

    def __init__(self, who: str = "the body") -> None:
        super().__init__(
            f"the contact conditions leave a rigid motion free: hold {who} by a support, or start with more nodes in "
            "contact"
        )


@dataclass(frozen=True, eq=False)
class ContactState:
    """Displacements and tractions at the contact nodes, in (n, t) components.

    Parameters
    ----------
    displacement : (n_contact, 2) array [m]
    traction : (n_contact, 2) array [Pa]
        Tractions of the obstacle on the body; the normal component of pressed nodes is negative.

    Raises
    ------
    ValueError
        If the shapes are not ``(n_contact, 2)``.
    """

    displacement: FloatArray
    traction: FloatArray

    def __post_init__(self) -> None:
        for name in ("displacement", "traction"):
            array = getattr(self, name)
            if array.ndim != 2 or array.shape != (len(self.displacement), 2):
                raise InputError(f"{name} has the shape {array.shape}; give ({len(self.displacement)}, 2)")

    @property
    def u_n(self) -> FloatArray:
        """(n_contact,) array [m], normal displacement."""
        return self.displacement[:, 0]

    @property
    def u_t(self) -> FloatArray:
        """(n_contact,) array [m], tangential displacement."""
        return self.displacement[:, 1]

    @property
    def sigma_n(self) -> FloatArray:
        """(n_contact,) array [Pa], normal traction."""
        return self.traction[:, 0]

    @property
    def sigma_t(self) -> FloatArray:
        """(n_contact,) array [Pa], tangential traction."""
        return self.traction[:, 1]

    @property
    def is_finite(self) -> bool:
        """Whether all entries are finite numbers."""
        return bool(np.isfinite(self.displacement).all() and np.isfinite(self.traction).all())

    def blended(self, other: ContactState, fraction: float) -> ContactState:
        """Return the interpolation (1 - fraction) self + fraction other.

        An interpolation of two responses is again a response, because the body is linear.
        """
        if fraction == 1.0:
            return other
        return ContactState(
            self.displacement + fraction * (other.displacement - self.displacement),
            self.traction + fraction * (other.traction - self.traction),
        )


@dataclass(frozen=True, eq=False)
class SlipHistory:
    """Time and slip at the end of an increment, in user units.

    Parameters
    ----------
    time, time_step : float [s]
        Time at the end of the increment, and its duration.
    slip : (n_contact,) array [m]
        Accumulated slip of each node while it was closed, including this increment; non-decreasing.
    last_slip : (n_contact,) array [m]
        Slip in this increment, not negative.
    """

    time: float
    time_step: float
    slip: FloatArray
    last_slip: FloatArray

    @classmethod
    def at_rest(cls, n_contact: int) -> SlipHistory:
        """Return the history before loading: time zero and no slip."""
        return cls(0.0, 0.0, np.zeros(n_contact), np.zeros(n_contact))

    @property
    def rate(self) -> FloatArray:
        """(n_contact,) array [m/s]: slip rate in this increment."""
        return self.last_slip / self.time_step if self.time_step > 0.0 else np.zeros_like(self.last_slip)

    def followed(self, time: float, slip: FloatArray, is_closed: BoolArray) -> SlipHistory:
        """Return the history after one more increment.

        Parameters
        ----------
        time : float [s]
            Time at the end of that increment.
        slip : (n_contact,) array [m]
            Slip of each node in that increment, of either sign; slip of open nodes does not count.
        is_closed : (n_contact,) bool array
        """
        added = np.where(is_closed, np.abs(slip), 0.0)
        return SlipHistory(time, time - self.time, self.slip + added, added)

    def towards(self, other: SlipHistory, share: float) -> SlipHistory:
        """Return the history at a share of the way to another slip in the same increment."""
        added = (1.0 - share) * self.last_slip + share * other.last_slip
        return SlipHistory(self.time, self.time_step, self.slip + (added - self.last_slip), added)

    def of(self, nodes: IntArray) -> SlipHistory:
        """Return the history of some nodes."""
        return SlipHistory(self.time, self.time_step, self.slip[nodes], self.last_slip[nodes])


def separated(n_contact: int) -> LinearConditions:
    """Return the conditions of open nodes: ``t = 0``."""
    return LinearConditions(np.zeros((n_contact, 2, 2)), _unit_blocks(n_contact), np.zeros((n_contact, 2)))


def stick(gap: FloatArray, reference_slip: FloatArray) -> LinearConditions:
    """Return the conditions of sticking nodes: ``u_n = g``, ``u_t = reference_slip``.

    Parameters
    ----------
    gap : (n_contact,) array [m]
    reference_slip : (n_contact,) array [m]
        Tangential displacement without slip (zero for the static law).
    """
    n_contact = len(gap)
    value = np.stack([gap, reference_slip], axis=1)
    return LinearConditions(_unit_blocks(n_contact), np.zeros((n_contact, 2, 2)), value)


def slip(
    gap: FloatArray, direction: FloatArray, bound_slope: FloatArray, bound_intercept: FloatArray
) -> LinearConditions:
    """Return the conditions of slipping nodes: ``u_n = g``, ``t_t = -direction * bound(t_n)``.

    Parameters
    ----------
    gap : (n_contact,) array [m]
    direction : (n_contact,) array
        +1 for slip along the tangent (``u_t > 0``), -1 against it.
    bound_slope : (n_contact,) array [-]
        Derivative of the friction bound, ``-s`` for Coulomb's law.
    bound_intercept : (n_contact,) array [Pa]
        The linearised bound is ``bound_slope * t_n + bound_intercept``.

    Notes
    -----
    Algorithm 2 of the paper prints the slip traction with the opposite sign; the sign here follows from equation (16).
    """
    n_contact = len(gap)
    on_displacement = np.zeros((n_contact, 2, 2))
    on_displacement[:, 0, 0] = 1.0
    on_traction = np.zeros((n_contact, 2, 2))
    on_traction[:, 1, 0] = direction * bound_slope
    on_traction[:, 1, 1] = 1.0
    return LinearConditions(on_displacement, on_traction, np.stack([gap, -direction * bound_intercept], axis=1))


def of_statuses(
    is_closed: BoolArray, slips: BoolArray, sticking: LinearConditions, sliding: LinearConditions
) -> LinearConditions:
    """Return the conditions of nodes in different statuses.

    Parameters
    ----------
    is_closed, slips : (n_contact,) bool arrays
        Closed nodes have the normal condition of `sticking`, open nodes ``t_n = 0``. Slipping nodes have the tangential
        condition of `sliding`, the others that of `sticking`.
    sticking, sliding : LinearConditions
    """
    conditions = separated(len(is_closed)).replaced(np.stack([is_closed, ~slips], axis=1), sticking)
    return conditions.replaced(np.stack([np.zeros_like(slips), slips], axis=1), sliding)


def augmented(
    gap: FloatArray, reference_slip: FloatArray, multiplier: FloatArray, rho_n: float, rho_t: float
) -> LinearConditions:
    """Return the augmented conditions of closed, sticking nodes: ``t + rho (u - u_0) = multiplier``.

    Parameters
    ----------
    gap : (n_contact,) array [m]
        Normal part of u_0.
    reference_slip : (n_contact,) array [m]
        Tangential part of u_0.
    multiplier : (n_contact, 2) array [Pa]
        sigma^(k) of Algorithm 1, constant in an inner loop.
    rho_n, rho_t : float [Pa/m]
    """
    n_contact = len(gap)
    rho = np.array([rho_n, rho_t])
    on_displacement = np.zeros((n_contact, 2, 2))
    on_displacement[:, [0, 1], [0, 1]] = rho
    value = multiplier + rho * np.stack([gap, reference_slip], axis=1)
    return LinearConditions(on_displacement, _unit_blocks(n_contact), value)


def _unit_blocks(n_contact: int) -> FloatArray:
    return np.full((n_contact, 2, 2), np.eye(2))


class LinearBody(Protocol):
    """One or several elastic bodies under their loads, reduced to the contact nodes.

    All nonlinear code in bemkit uses bodies through this protocol: a body does not depend on friction, and solvers do
    not depend on how it computes responses. Derive from this class and implement `weights`, `stiffness_scale` and
    `respond`; a body that only contact can hold also implements `rigid_motions` and `rigid_load`.
    `bemkit.testing.check_body` tests this contract.

    Attributes
    ----------
    weights : (n_contact,) array [m]
        Positive weights; nodal force = weight times traction.
    accuracy : float
        Relative error of the displacements and tractions of a response: 1e-14 (the default) for a direct solver, the
        tolerance at which it stops for an iterative one. Solvers take their tolerances from it.
    responses_are_expensive : bool
        Whether solvers should take at most tens of responses instead of several for each contact node. False by
        default.
    """

    weights: FloatArray
    accuracy: float = 1e-14
    responses_are_expensive: bool = False

    @property
    def n_contact(self) -> int:
        """Number of contact nodes."""
        return len(self.weights)

    @property
    def stiffness_scale(self) -> float:
        """Typical traction per displacement of a single contact node [Pa/m], positive; the unit of automatic rho.

        For a material of plane modulus E' it is E' divided by the weight of a node; it does not depend on supports.
        """
        ...

    @property
    def tangent_follows(self) -> BoolArray:
        """(n_contact,) bool array: nodes whose tangential displacement follows from normal ones; none by default.

        A support or two obstacles hold these nodes. Their tangential condition must be on tractions;
        `ContactProblem.respond` replaces other conditions.
        """
        return np.zeros(self.n_contact, bool)

    def respond(self, conditions: LinearConditions) -> ContactState:
        """Return displacement and traction of the loaded body under two conditions per contact node.

        Parameters
        ----------
        conditions : LinearConditions
            The second condition of nodes whose tangent follows is on tractions.

        Raises
        ------
        SingularResponse
            If the conditions do not determine the response.
        InputError
            If a node whose tangent follows has a condition on its tangential displacement.
        """
        ...

    def rigid_motions(self) -> RigidMotions:
        """Return the rigid motions that only contact can hold; by default there are none.

        Returns
        -------
        (n_motions, n_contact, 2) array, or sparse (n_motions, 2 n_contact) array
            Normal and tangential components at the contact nodes; linearly independent. Bodies of many members use the
            sparse form with index ``2 node + component``.
        """
        return np.zeros((0, self.n_contact, 2))

    def rigid_load(self) -> FloatArray:
        """Return the work of the given load on each of these motions.

        Returns
        -------
        (n_motions,) array [N]
            Work per unit of thickness and of motion.
        """
        return np.zeros(self.rigid_motions().shape[0])

    def moving_bodies(self, coefficients: FloatArray) -> str:
        """Name the bodies that a combination (n_motions,) of the rigid motions moves, as subject of a message."""
        return "the body"

    def partners_of(self, coefficients: FloatArray) -> str:
        """Name the bodies or obstacles that these bodies may touch, for messages."""
        return "the obstacle"

    def lacks_room(self, gap: FloatArray) -> bool:
        """Whether displacements within gaps (n_contact,) [m] cannot keep the volume of a body; by default never."""
        return False

    def shares(self, forces: FloatArray) -> FloatArray:
        """Return the share of the largest force that scales each node in the certificate; by default 1.

        With several bodies the scale of a node is the contact force between its two partners.

        Parameters
        ----------
        forces : (n_contact,) array [N/m]
            Magnitudes of the nodal forces, not all zero.

        Returns
        -------
        (n_contact,) array [-]
            Positive, at most one.
        """
        return np.ones(self.n_contact)

    def imbalance(self, state: ContactState) -> Imbalance:
        """Return the relative residual of the equilibrium of all forces on the body, including body forces.

        Parameters
        ----------
        state : ContactState
            Any state; one that is no response of this body is out of balance.

        Returns
        -------
        Imbalance
            By default `force` is the largest difference of nodal forces between the state and a response with the same
            displacements, and `moment` the work of load and tractions on the rigid motions of largest component one.
            Both are relative to the largest nodal force of the state and of that response.
        """
        follows = self.tangent_follows
        held = np.stack([np.ones_like(follows), ~follows], axis=1)
        given = separated(self.n_contact)
        given.value[follows, 1] = state.sigma_t[follows]
        conditions = given.replaced(held, stick(state.u_n, state.u_t))
        response = self.respond(conditions)
        forces = self.weights[:, None] * np.stack([state.traction, response.traction])
        largest = float(np.abs(forces).max())
        if largest == 0.0:
            return Imbalance(0.0, 0.0)
        # differences of displacements count as the tractions that would cause them
        misfit = self.stiffness_scale * np.abs(response.displacement - state.displacement).max(axis=1)
        missing = max(float(np.abs(forces[0] - forces[1]).max()), float((self.weights * misfit).max()))
        motions = as_rows(self.rigid_motions())
        largest_component = float(largest_components(motions).max(initial=0.0)) or 1.0
        work = float(np.max(np.abs(self.rigid_load() + motions @ forces[0].ravel()) / largest_component, initial=0.0))
        # errors of the displacements cause tractions, too
        by_displacement = self.stiffness_scale * float((self.weights[:, None] * np.abs(state.displacement)).max())
        round_off = self.accuracy * max(largest, by_displacement) / largest
        return Imbalance(missing / largest, work / largest, round_off)
