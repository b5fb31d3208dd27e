"""Points inside a body: found by the winding number, with the boundary point nearest to each."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bemkit.arrays import BoolArray, ComplexArray, FloatArray, IntArray
from bemkit.geometry.errors import GeometryError
from bemkit.geometry.mesh import BoundaryMesh
from bemkit.geometry.validity.chords import RESOLUTION
from bemkit.operators.somigliana.moments import CurvedElements

CHUNK_PAIRS = 65536
N_CHORDS = 8
"""Chords in place of a curved element while the nearest element is looked for."""
N_REFINEMENTS = 20
_STANDS = 4.0 * np.finfo(float).eps
"""Step of a local coordinate that is round-off."""


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
        self._first: IntArray = np.cumsum(n_chords) - n_chords
        number = np.arange(self._owner.size) - self._first[self._owner]
        self._low: FloatArray = -1.0 + 2.0 * number / n_chords[self._owner]
        self._high: FloatArray = -1.0 + 2.0 * (number + 1) / n_chords[self._owner]
        self._start, self._end = self._on_elements(self._low), self._on_elements(self._high)

    def _on_elements(self, xi: FloatArray) -> ComplexArray:
        start, end = (
            (ends[:, 0] + 1j * ends[:, 1] - self._centre)[self._owner] for ends in (self._mesh.start, self._mesh.end)
        )
        points: ComplexArray = (0.5 - 0.5 * xi) * start + (0.5 + 0.5 * xi) * end
        curved = np.flatnonzero(~self._mesh.is_straight[self._owner])
        points[curved] = self._curved.place(self._owner[curved], xi[curved, None])[0][:, 0]
        return points

    def locate(self, points: FloatArray) -> Location:
        """Find where the (n, 2) points [m] are."""
        x = points[:, 0] + 1j * points[:, 1] - self._centre
        step = max(1, CHUNK_PAIRS // self._owner.size)
        size = max(float(np.abs(self._mesh.nodes).max()), float(np.abs(points).max(initial=0.0)))
        resolution = RESOLUTION * size
        chunks = [self._chunk(x[first : first + step], resolution) for first in range(0, max(1, x.size), step)]
        winding, distance, element, xi = (np.concatenate([chunk[i] for chunk in chunks]) for i in range(4))
        is_on_boundary = distance <= resolution
        inside_number = 0 if self._mesh.is_exterior else 1
        is_inside = (np.rint(winding) == inside_number) & ~is_on_boundary
        return Location(is_inside, is_on_boundary, element.astype(np.intp), xi)

    def _chunk(self, x: ComplexArray, resolution: float) -> tuple[FloatArray, FloatArray, IntArray, FloatArray]:
        """Return winding number, distance to the boundary, nearest element and local coordinate of some points."""
        chord = self._end - self._start
        to_start, to_end = self._start - x[:, None], self._end - x[:, None]
        fraction = np.clip(-(to_start * chord.conj()).real / np.abs(chord) ** 2, 0.0, 1.0)
        across = np.abs((to_start * chord.conj()).imag) / np.abs(chord)
        to_ends = np.minimum(np.abs(to_start), np.abs(to_end))
        distances = np.where((fraction > 0.0) & (fraction < 1.0), across, to_ends)
        row, best = np.arange(x.size), np.argmin(distances, axis=1)
        element, distance = self._owner[best], distances[row, best]
        xi = self._low[best] + fraction[row, best] * (self._high - self._low)[best]
        curved = np.flatnonzero(~self._mesh.is_straight[element])
        if curved.size:
            xi[curved], distance[curved] = self._refine(x[curved], element[curved], xi[curved])
        ratio = to_end * to_start.conj()
        angles = np.add.reduceat(np.arctan2(ratio.imag, ratio.real), self._first, axis=1)
        # a point between an arc and its chord sees the two under different angles
        is_close = np.minimum.reduceat(distances / np.abs(chord), self._first, axis=1) < 1.0
        point, close = np.nonzero(is_close & ~self._mesh.is_straight & (distance > resolution)[:, None])
        if point.size:
            angles[point, close] = self._curved.angles(x[point], close)
        return angles.sum(axis=1) / (2.0 * np.pi), distance, element, xi

    def _refine(self, x: ComplexArray, element: IntArray, xi: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Move to the nearest point of a curved element by Gauss-Newton steps; return it with its distance."""
        for _ in range(N_REFINEMENTS):
            y, slope = self._curved.place(element, xi[:, None])
            step = ((x - y[:, 0]) * slope[:, 0].conj()).real / np.abs(slope[:, 0]) ** 2
            before, xi = xi, np.clip(xi + step, -1.0, 1.0)
            if np.abs(xi - before).max() <= _STANDS:
                break
        y, _ = self._curved.place(element, xi[:, None])
        return xi, np.abs(x - y[:, 0])
