"""Two sides of a contact, measured on each other: distance, relative displacement and overlap, by points of their own.

Where both sides are straight, the mean relative displacement is integrated without error, by pieces on which both
fields are polynomials. Where they are curved, points are only looked up among many on the other side.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from bemkit.arrays import FloatArray, IntArray
from bemkit.geometry.local_values import values_on_elements
from bemkit.scene.contacts import ContactPair
from bemkit.testing.independent_check.bodies import MeasuredBody

_PARALLEL = 1e-9
_SLIVER = 1e-9
"""Piece of the common length of two sides that is round-off, relative to it."""
_STEP = 1e-4
"""Difference of local coordinates by which slopes are taken."""
_N_SAMPLES = 33
"""Points on an element of a curved side."""
_N_NEAREST = 3
"""Number of nearest points from which the search for the closest point begins."""
_BESIDE = 1e-6
"""Largest distance of that point from the direction, relative to an element."""


@dataclass(frozen=True, eq=False)
class Side:
    """A part of one body in a contact."""

    body: MeasuredBody
    part: str

    @property
    def elements(self) -> IntArray:
        """Its elements (k,)."""
        return self.body.solved.mesh.part(self.part)

    @property
    def is_flat(self) -> bool:
        """Whether the elements lie on one line."""
        mesh, normals = self.body.solved.mesh, self._normals
        return bool(mesh.is_straight[self.elements].all()) and float(np.abs(normals - normals[0]).max()) < _PARALLEL

    @property
    def _normals(self) -> FloatArray:
        return self.body.boundary.normals[self.elements].reshape(-1, 2)

    @property
    def normal(self) -> FloatArray:
        """(2,) array: of a flat side."""
        return np.asarray(self._normals.mean(axis=0))

    @property
    def turn(self) -> float:
        """Largest angle [rad] by which an element turns."""
        first, last = np.moveaxis(self.body.solved.mesh.normals_at(self.elements, np.array([-1.0, 1.0])), 1, 0)
        return float(np.arccos(np.clip(np.sum(first * last, axis=1), -1.0, 1.0)).max())

    def displacement(self, row: IntArray, xi: FloatArray) -> FloatArray:
        """Return displacements (n, 2) at xi (n,) of the elements at the positions `row` (n,)."""
        solved = self.body.solved
        space = solved.scene.discretisation.displacement_space(solved.mesh)
        nodal = values_on_elements(space, solved.boundary.displacement, self.elements[row])
        return np.asarray(np.einsum("ln,nlc->nc", space.basis(xi), nodal))


@dataclass(frozen=True)
class Relative:
    """Measures of two flat sides.

    Parameters
    ----------
    length : float [m]
        That both share.
    distance : float [m]
    means : (2,) array [m^2]
        Integral of the displacement of the first side relative to the second one along its normal and tangent.
    overlap : float [m]
        The deepest at any point.
    """

    length: float
    distance: float
    means: FloatArray
    overlap: float


def measure_flat(one: Side, two: Side, pair: ContactPair) -> Relative | None:
    """Measure two flat sides that face each other; None of others.

    Parameters
    ----------
    one, two : Side
    pair : ContactPair
        Its gap is added to their distance.
    """
    if not (one.is_flat and two.is_flat) or one.normal @ two.normal > -1.0 + _PARALLEL:
        return None
    # coordinates along and across the first side
    normal = one.normal / np.hypot(*one.normal)
    tangent = np.array([-normal[1], normal[0]])
    meshes = one.body.solved.mesh, two.body.solved.mesh
    origin = meshes[0].start[one.elements[0]]
    ends = [
        (mesh.start[side.elements] - origin, mesh.end[side.elements] - origin)
        for mesh, side in zip(meshes, (one, two), strict=True)
    ]
    places = [(start @ tangent, end @ tangent) for start, end in ends]
    distance = float((ends[1][0] @ normal).mean())
    # the common interval, and the nodes of both sides in it
    low = max(float(np.min(place)) for place in places)
    high = min(float(np.max(place)) for place in places)
    knots = np.unique(np.concatenate([np.concatenate(p) for p in places]))
    if not high > low:
        return None
    # ends of both sides that differ by round-off are one
    beside = _SLIVER * (high - low)
    knots = knots[(knots > low + beside) & (knots < high - beside)]
    knots = knots[np.diff(knots, prepend=low) > beside]
    knots = np.concatenate([[low], knots, [high]])
    # a Gauss rule between these nodes, where both displacements are polynomials
    xi, weights = np.polynomial.legendre.leggauss(12)
    half = 0.5 * np.diff(knots)[:, None]
    at = (knots[:-1, None] + half * (1.0 + xi)).ravel()
    shares = (half * weights).ravel()
    values = []
    for side, (start, end) in zip((one, two), places, strict=True):
        first, last = np.minimum(start, end), np.maximum(start, end)
        order = np.argsort(first)
        row = order[np.clip(np.searchsorted(first[order], at, side="right") - 1, 0, order.size - 1)]
        inside = (at >= first[row]) & (at <= last[row] + 1e-9 * (last[row] - first[row]))
        if not inside.all():
            return None  # the side has a hole
        local = 2.0 * (at - start[row]) / (end[row] - start[row]) - 1.0
        values.append(side.displacement(row, np.clip(local, -1.0, 1.0)))
    relative = values[0] - values[1]
    along = np.stack([relative @ normal, relative @ tangent], axis=1)
    overlap = float(np.max(along[:, 0] - distance - pair.gap_at(origin + at[:, None] * tangent), initial=0.0))
    return Relative(high - low, distance, shares @ along, overlap)


def sampled_overlap(one: Side, two: Side, pair: ContactPair, reach: float) -> float:
    """Return the largest depth [m] of points of one side in the other one, measured at their closest points there.

    A point x of one side faces the point y of the other side where the sum of both directions, n(x) - n(y), passes
    through x and y. The depth is the relative displacement along this direction, less the distance of x and y.

    Parameters
    ----------
    one, two : Side
    pair : ContactPair
        Its gap is added to their distance.
    reach : float [m]
        Points farther apart than this do not face each other.
    """
    mesh, boundary = two.body.solved.mesh, one.body.boundary
    # many samples of the second side, and the quadrature points of the first
    xi = np.linspace(-1.0, 1.0, _N_SAMPLES)
    rows = np.repeat(np.arange(two.elements.size), _N_SAMPLES)
    samples = mesh.points(two.elements, xi).reshape(-1, 2)
    every = boundary.points[one.elements].reshape(-1, 2)
    # start values: the nearest samples of each point, several because an end belongs to two elements
    distance, nearest = (np.ravel(found) for found in cKDTree(samples).query(every, k=_N_NEAREST))
    points = np.repeat(every, _N_NEAREST, axis=0)
    normals = np.repeat(boundary.normals[one.elements].reshape(-1, 2), _N_NEAREST, axis=0)
    displacement = boundary.interpolated(one.body.solved.boundary.displacement)[one.elements]
    motion = np.repeat(displacement.reshape(-1, 2), _N_NEAREST, axis=0)
    row, place = rows[nearest], np.tile(xi, two.elements.size)[nearest]
    element = two.elements[row]

    def facing(at: FloatArray) -> FloatArray:
        return np.asarray(normals - mesh.normals_at(element, at[:, None])[:, 0])

    def beside(at: FloatArray, along: FloatArray) -> FloatArray:
        offset = mesh.points(element, at[:, None])[:, 0] - points
        return np.asarray(along[:, 0] * offset[:, 1] - along[:, 1] * offset[:, 0])

    # only sides whose normals are opposite to 60 degrees face each other
    faces = (np.hypot(*facing(place).T) > 1.7) & (distance < reach)
    # Newton's method for the local coordinate at which the distance across the direction vanishes
    for _ in range(8):
        direction = facing(place)
        direction /= np.maximum(np.hypot(*direction.T), 0.1)[:, None]
        slope = (beside(place + _STEP, direction) - beside(place - _STEP, direction)) / (2.0 * _STEP)
        place = np.clip(place - beside(place, direction) / np.where(slope == 0.0, 1.0, slope), -1.0, 1.0)
    direction = facing(place)
    direction /= np.maximum(np.hypot(*direction.T), 0.1)[:, None]
    # exclude points whose closest point lies beyond the end of the element
    offset = mesh.points(element, place[:, None])[:, 0] - points
    faces &= np.abs(beside(place, direction)) < _BESIDE * np.maximum(mesh.lengths[element], distance)
    # the relative displacement of both points along the direction, less their distance
    overlap = np.sum((motion - two.displacement(row, place) - offset) * direction, axis=1) - pair.gap_at(points)
    return float(np.max(overlap[faces], initial=0.0))
