"""Ends of zones of one contact status: elements and points on them, and the errors that they cause."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from bemkit.arrays import FloatArray, IntArray
from bemkit.geometry.mesh import BoundaryMesh
from bemkit.geometry.neighbours import along_boundary
from bemkit.geometry.vectors import norms
from bemkit.results.contact_table import ContactTable
from bemkit.results.transitions import Transition

LYING_ON = 1e-2
"""Distance within which one side lies on another, relative to the shorter of both."""
NEIGHBOURHOOD = 1e-3
"""Distance from a singular point within which elements belong to it, relative to the length of the part."""
LYING_AT = 1e-9
"""Distance within which an element ends at a point, relative to the side."""
_MOST_STEPS = 20
"""Steps of Newton's method for the point on a curved element: two or three are enough."""
REVERSAL_CALIBRATION = 0.4
"""1.6 squared over 2 pi, see `reversal_error`."""
TRANSITION_CALIBRATION = 0.09
"""The square of the 0.3 in the error of elements inside which the status changes."""


class ZoneEnd(NamedTuple):
    """The end of a zone of one status: the element, and the fraction of its length.

    `zone_length` [m] is the length to which that of the element is compared.
    """

    mesh: BoundaryMesh
    zone_length: float
    element: int
    fraction: float
    body: str = ""

    @property
    def distance(self) -> float:
        """Distance from the nearer end of the element [m]."""
        return float(min(self.fraction, 1.0 - self.fraction) * self.mesh.lengths[self.element])

    def spacing(self, degree: int) -> float:
        """Return the distance [m] of zeros of a Legendre polynomial of a degree at the place, but for a factor."""
        length = float(self.mesh.lengths[self.element])
        return 2.0 * length * float(np.sqrt(self.fraction * (1.0 - self.fraction))) / degree


@dataclass(frozen=True, eq=False)
class Side:
    """A side of a body that meets another: a part of its mesh.

    Parameters
    ----------
    body : str
    mesh : BoundaryMesh
    part : str
    zone_length : float, optional [m]
        Length to which elements at ends of zones are compared; by default that of the side.
    """

    body: str
    mesh: BoundaryMesh
    part: str
    zone_length: float | None = None

    @cached_property
    def length(self) -> float:
        """Length of boundary [m]."""
        return float(self.mesh.lengths[self.mesh.part(self.part)].sum())

    @property
    def whole_length(self) -> float:
        """Length of boundary [m], with the images of a side that symmetry lines halve."""
        symmetry, elements = self.mesh.symmetry, self.mesh.part(self.part)
        lines = () if symmetry is None else (symmetry.x, symmetry.y)
        points = np.concatenate([self.mesh.start[elements], self.mesh.end[elements]])
        n_crossed = sum(line is not None and line in points[:, axis] for axis, line in enumerate(lines))
        return 2.0**n_crossed * self.length

    def near(self, point: FloatArray) -> ZoneEnd:
        """Return the nearest place on the side, as the end of a zone."""
        zone_length = self.length if self.zone_length is None else self.zone_length
        return ZoneEnd(self.mesh, zone_length, *_nearest(self.mesh, self.mesh.part(self.part), point), self.body)

    @cached_property
    def elements(self) -> IntArray:
        """The elements, in order along the boundary."""
        return along_boundary(self.mesh, self.mesh.part(self.part))

    @cached_property
    def ends(self) -> list[FloatArray]:
        """The points (2,) where the side ends; none of a closed one."""
        start, end = self.mesh.start[self.elements[0]], self.mesh.end[self.elements[-1]]
        return [] if np.array_equal(start, end) else [start, end]

    def edges(self, other: Side) -> Iterator[tuple[FloatArray, ZoneEnd]]:
        """Yield the points where another side that lies on this one ends inside it, and where they are on this one."""
        for point in other.ends:
            place = self.near(point)
            foot = self.mesh.points(np.array([place.element]), np.array([2.0 * place.fraction - 1.0]))[0, 0]
            near = LYING_ON * min(self.length, other.length)
            is_inside = all(np.linalg.norm(end - foot) > near for end in self.ends)
            if is_inside and np.linalg.norm(point - foot) <= near:
                yield point, place

    def elements_at(self, point: FloatArray) -> IntArray:
        """Return the element nearest to a point, or those that end there, and all within `NEIGHBOURHOOD`."""
        elements = self.mesh.part(self.part)
        distances = [norms(end[elements] - point) for end in (self.mesh.start, self.mesh.end)]
        is_end = np.min(distances, axis=0) <= LYING_AT * self.length
        is_close = np.max(distances, axis=0) <= NEIGHBOURHOOD * self.length
        return np.union1d(elements[is_end | is_close], [self.near(point).element])


def _nearest(mesh: BoundaryMesh, elements: IntArray, point: FloatArray) -> tuple[int, float]:
    """Return the element nearest to a point, and the fraction of its parameter there."""
    start, end = mesh.start[elements], mesh.end[elements]
    chord = end - start
    along = np.clip(np.sum((point - start) * chord, axis=1) / np.sum(chord**2, axis=1), 0.0, 1.0)
    k = int(np.argmin(norms(start + along[:, None] * chord - point)))
    element, fraction = elements[k : k + 1], float(along[k])
    if not mesh.is_straight[element[0]]:
        for _ in range(_MOST_STEPS):
            xi = np.array([2.0 * fraction - 1.0])
            tangent = mesh.derivatives(element, xi)[0, 0]
            step = 0.5 * float((point - mesh.points(element, xi)[0, 0]) @ tangent / (tangent @ tangent))
            fraction = min(max(fraction + step, 0.0), 1.0)
            if abs(step) <= np.finfo(float).eps:
                break
    return int(element[0]), fraction


def reversal_error(jump: float, end: ZoneEnd, degree: int) -> tuple[float, float]:
    """Estimate the error of friction that jumps, by `jump` [Pa], inside an element, as `transition_error` does.

    The best polynomials of degree p miss a jump J by J sqrt(l / (2 pi)) with the length l given there,
    computed tractions by 1.6 times that.
    """
    spacing = end.spacing(degree)
    return REVERSAL_CALIBRATION * jump**2 * spacing, spacing


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
        Tractions that vanish at the transition and are not smooth there.
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
                at_reach = float(np.interp(transition.s + sign * reach, contact.s[rows], traction[rows]))
                steepest = max(steepest, at_reach**2 / reach)
        squared += steepest
    spacing = end.spacing(degree)
    return TRANSITION_CALIBRATION * squared * spacing**2, spacing
