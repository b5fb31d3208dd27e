"""Points inside a body: found by the winding number, with the boundary point nearest to each."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bemkit.arrays import BoolArray, ComplexArray, FloatArray, IntArray
from bemkit.geometry.errors import GeometryError
from bemkit.geometry.mesh import BoundaryMesh
from bemkit.geometry.pieces import RESOLUTION
from bemkit.operators.inner_moments import CurvedElements

CHUNK_PAIRS = 65536
N_CHORDS = 8
"""Chords in place of a curved element while the nearest element is looked for."""
N_REFINEMENTS = 20


class PointNotInsideError(GeometryError):
    """A point at which fields were asked for is outside of the body or on its boundary."""


@dataclass(frozen=True, eq=False)
class Location:
    """Where points are.

    Parameters
    ----------
    is_inside, is_on_boundary : (n,) bool arrays
    element : (n,) int array
        The nearest element.
    xi : (n,) array
        Local coordinate of the point of that element that is nearest.
    """

    is_inside: BoolArray
    is_on_boundary: BoolArray
    element: IntArray
    xi: FloatArray


class Locator:
    """Tells where points are with respect to a body.

    Parameters
    ----------
    mesh : BoundaryMesh
    """

    def __init__(self, mesh: BoundaryMesh) -> None:
        self._mesh = mesh
        self._curved = CurvedElements(mesh, mesh.centre)
        self._centre = complex(*mesh.centre)
        n_chords = np.where(mesh.is_straight, 1, N_CHORDS)
        self._owner: IntArray = np.repeat(np.arange(mesh.n_elements), n_chords)
        number = np.arange(self._owner.size) - np.repeat(np.cumsum(n_chords) - n_chords, n_chords)
        self._low: FloatArray = -1.0 + 2.0 * number / n_chords[self._owner]
        self._high: FloatArray = -1.0 + 2.0 * (number + 1) / n_chords[self._owner]
        self._start, self._end = self._on_elements(self._low), self._on_elements(self._high)

    def _on_elements(self, xi: FloatArray) -> ComplexArray:
        start, end = ((ends[:, 0] + 1j * ends[:, 1] - self._centre)[self._owner] for ends in (self._mesh.start, self._mesh.end))
        points: ComplexArray = (0.5 - 0.5 * xi) * start + (0.5 + 0.5 * xi) * end
        curved = np.flatnonzero(~self._mesh.is_straight[self._owner])
        points[curved] = self._curved.place(self._owner[curved], xi[curved, None])[0][:, 0]
        return points

    def locate(self, points: FloatArray) -> Location:
        """Find where the (n, 2) points [m] are."""
        x = points[:, 0] + 1j * points[:, 1] - self._centre
        step = max(1, CHUNK_PAIRS // self._owner.size)
        chunks = [self._chunk(x[first : first + step]) for first in range(0, x.size, step)]
        winding, distance, element, xi = (np.concatenate([chunk[i] for chunk in chunks]) for i in range(4))
        size = max(float(np.abs(self._mesh.nodes).max()), float(np.abs(points).max(initial=0.0)))
        is_on_boundary = distance <= RESOLUTION * size
        inside_number = 0 if self._mesh.is_exterior else 1
        is_inside = (np.rint(winding) == inside_number) & ~is_on_boundary
        return Location(is_inside, is_on_boundary, element.astype(np.intp), xi)

    def _chunk(self, x: ComplexArray) -> tuple[FloatArray, FloatArray, IntArray, FloatArray]:
        """Return winding number, distance to the boundary, nearest element and local coordinate of some points."""
        to_start, to_end = self._start - x[:, None], self._end - x[:, None]
        chord = self._end - self._start
        fraction = np.clip(-(to_start * chord.conj()).real / np.abs(chord) ** 2, 0.0, 1.0)
        distance = np.abs(to_start + fraction * chord)
        best = np.argmin(distance, axis=1)
        row = np.arange(x.size)
        element = self._owner[best]
        xi = self._low[best] + fraction[row, best] * (self._high - self._low)[best]
        # measured from the nearer end of the chord, so that a point close to a node keeps its digits
        cross = np.abs((to_start * chord.conj()).imag) / np.abs(chord)
        distance = np.where((fraction > 0.0) & (fraction < 1.0), cross, distance)[row, best]
        curved = np.flatnonzero(~self._mesh.is_straight[element])
        if curved.size:
            xi[curved], distance[curved] = self._refine(x[curved], element[curved], xi[curved])
        ratio = to_end * to_start.conj()
        angle = np.arctan2(ratio.imag, ratio.real)
        # a point between an arc and its chord sees them under different angles
        close = np.argwhere(~self._mesh.is_straight[self._owner] & (np.abs(to_start) < np.abs(chord)))
        winding = angle.sum(axis=1)
        if close.size:
            winding += self._difference(x, close, angle)
        return winding / (2.0 * np.pi), distance, element, xi
