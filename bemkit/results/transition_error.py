"""Estimated errors of elements inside which the contact status changes."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from bemkit.arrays import FloatArray
from bemkit.results.contact_table import ContactTable
from bemkit.results.transitions import Transition
from bemkit.results.zone_ends import ZoneEnd

TRANSITION_CALIBRATION = 0.09
"""The square of the 0.3 in the error of elements inside which the status changes."""


def transition_error(
    contact: ContactTable,
    fields: Sequence[FloatArray],
    transition: Transition,
    transitions: Sequence[Transition],
    end: ZoneEnd,
    degree: int,
) -> tuple[float, float]:
    """Estimate the error that a transition inside an element of a degree causes.

    Parameters
    ----------
    contact : ContactTable
    fields : sequence of (n_contact,) arrays [Pa]
        Tractions that are not smooth at the transition.
    transition : Transition
    transitions : sequence of Transition
        All of the table.
    end : ZoneEnd
        The place on the side of a body.
    degree : int
        Of the displacements on that element.

    Returns
    -------
    squared : float [Pa^2 m]
        Squared error of the contact tractions in L2.
    length : float [m]
        On which it changes its sign.

    Notes
    -----
    The best polynomials of degree p miss tractions that grow like K sqrt(d) with the distance d from the transition by
    0.15 K l, computed ones by twice as much. The length l = h sqrt(1 - xi^2) / p is that between zeros of Legendre
    polynomials at the place xi of an element of length h. K is fitted on the steeper side to the tractions an element's
    length away, or halfway to the next transition, and half an element away if that is steeper.
    """
    rows, length = contact.rows(transition.part), float(end.mesh.lengths[end.element])
    others = [other.s for other in transitions if other.part == transition.part and other.s != transition.s]
    ends = np.array([contact.s[rows].min(), contact.s[rows].max()]) - transition.s
    halfway = 0.5 * (np.array(others) - transition.s)
    squared = 0.0
    for traction in fields:
        steepest = 0.0
        for sign in (-1.0, 1.0):
            far = min([length, *(sign * ends[sign * ends > 0.0])])
            near = min([far, *(sign * halfway[sign * halfway > 0.0])])
            for reach in (near, max(near, min(far, 0.5 * length))):
                places = transition.s + np.array([0.0, sign * reach])
                at_transition, at_reach = np.interp(places, contact.s[rows], traction[rows])
                steepest = max(steepest, (at_reach - at_transition) ** 2 / reach)
        squared += steepest
    spacing = 2.0 * length * float(np.sqrt(end.fraction * (1.0 - end.fraction))) / degree
    return TRANSITION_CALIBRATION * squared * spacing**2, spacing
