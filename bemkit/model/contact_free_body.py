"""A body without contact nodes: all of it is solved for at once, and the equilibrium of all forces certifies it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from bemkit.arrays import FloatArray
from bemkit.contact.body import ContactState, LinearBody
from bemkit.contact.certificate import Certificate
from bemkit.contact.direct_body import WholeBody
from bemkit.contact.equilibrium import NOISE_FACTOR, Imbalance, resultant_imbalance, round_off_of
from bemkit.operators.boundary_equations import LinearConditions
from bemkit.operators.counts import OperationCounts
from bemkit.operators.steklov_poincare import CondensedMap
from bemkit.operators.steklov_poincare.forces_inside import ForcesInside
from bemkit.solvers.base import ContactSolution, Status, StepRecord

_TOLERANCE = 1e-9
"""Tolerance of the certificate, as for contact."""


@dataclass(frozen=True, eq=False)
class ContactFreeBody(LinearBody):
    """An elastic body held only by its supports; fulfils `LinearBody` with no contact node.

    Parameters
    ----------
    whole : WholeBody
        Without retained directions: all that is unknown has been solved for.
    """

    whole: WholeBody

    weights: FloatArray = field(default_factory=lambda: np.zeros(0), init=False)
    stiffness_scale = 1.0

    @property
    def condensed(self) -> CondensedMap:
        """The condensed map of the body."""
        return self.whole.condensed

    @property
    def work(self) -> OperationCounts:
        """Operation counts, from the operators on."""
        return self.condensed.work

    def respond(self, conditions: LinearConditions) -> ContactState:
        """Return the state without nodes."""
        return contact_free_state()

    def recover(self, state: ContactState) -> tuple[FloatArray, FloatArray]:
        """Return displacement (n_nodes, 2) and total force (n_nodes, 2) of all boundary nodes, in x and y."""
        return self.whole.fields(np.zeros(0))

    def under(self, force: FloatArray, displacement: FloatArray, inside: ForcesInside | None = None) -> ContactFreeBody:
        """Return the same body under other forces and displacements; see `WholeBody.under`."""
        return ContactFreeBody(self.whole.under(force, displacement, inside))

    def imbalance(self, state: ContactState) -> Imbalance:
        """Return how far the forces are from those given on free directions, and all together from equilibrium.

        Not a number if the displacements are none. If no force is given and all reactions are round-off, the body has
        only been moved, and they are relative to the terms of which they are sums.
        """
        displacement, force = self.recover(state)
        if not np.isfinite(displacement).all():
            return Imbalance(np.nan, np.nan)
        whole = self.whole
        round_off = round_off_of(displacement, self.condensed.sensitivity)
        resultant, inner = self.condensed.volume_force, self.condensed.inner_force
        total = float(np.abs(force).sum()) + inner or 1.0
        if inner == 0.0 < round_off and total <= NOISE_FACTOR * round_off and not whole.force.any():
            return Imbalance(total / (round_off / np.finfo(float).eps), 0.0)
        missing = whole.conditions.in_frames(force - whole.force)[whole.conditions.is_free]
        residual = Imbalance(float(np.abs(missing).max(initial=0.0)) / total, 0.0, round_off / total)
        of_all = resultant_imbalance(whole.points, force, whole.balanced, round_off, resultant, inner)
        return residual.joined(of_all)


def contact_free_state() -> ContactState:
    """Return the contact state without nodes."""
    return ContactState(np.zeros((0, 2)), np.zeros((0, 2)))


def certified(body: LinearBody, callback: Callable[[StepRecord], None] | None = None) -> ContactSolution:
    """Return the verdict on a body without contact nodes, where there is nothing to iterate.

    Parameters
    ----------
    body : LinearBody
    callback : callable, optional
        Receives the only record.

    Returns
    -------
    ContactSolution
        CONVERGED if all forces are in equilibrium.
    """
    state = contact_free_state()
    off = body.imbalance(state)
    certificate = Certificate(0.0, 0.0, 0.0, 0.0, 0.0, off.force, off.moment, off.round_off)
    if np.isnan(certificate.worst):
        status, message = Status.NOT_FINITE, Status.NOT_FINITE.value
    elif certificate.is_below(_TOLERANCE):
        status, message = Status.CONVERGED, "All forces are in equilibrium to the tolerance."
    else:
        status = Status.STALLED
        message = "Round-off leaves the forces out of equilibrium; use fewer or less unequal elements."
    message += f" [worst certificate entry {certificate.worst:.1e}]"
    record = StepRecord(0, 1, certificate, float("inf"), 0, 0, 0, 0, "")
    if callback is not None:
        callback(record)
    return ContactSolution(state, status, certificate, np.zeros(0, np.intp), 0, 1, message, (record,))
