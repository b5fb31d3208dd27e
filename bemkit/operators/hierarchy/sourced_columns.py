"""Columns of the boundary equations of a body with holes: each hole is one more element, with an equation of its own.

The displacement equation hardly fixes a uniform pressure in a hole; the reciprocity with a source of volume there does
(`bemkit.operators.collocation.reciprocity`), and that source makes room for it as an error of the equation. Both are
elastic fields and so belong to a place like everything else: the element of a hole lies at the source. Its first
unknown is the strength of the source, its first equation the reciprocity; the second ones say that nothing is zero.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from bemkit.arrays import ComplexArray, FloatArray, IntArray
from bemkit.geometry.mesh import BoundaryMesh
from bemkit.operators.collocation.reciprocity import Arcs, HoleSource
from bemkit.operators.hierarchy.boundary_columns import NOWHERE, BoundaryColumns
from bemkit.operators.material import Material


@dataclass(frozen=True, eq=False)
class SourcedColumns(BoundaryColumns):
    """Elements and holes by place; those of holes have numbers behind those of elements.

    Parameters
    ----------
    inner : BoundaryColumns
        Only the elements.
    inner_place : (n_places,) array
        Where each place is among these; `NOWHERE` for holes.
    sources : dict
        The source at each place of a hole.
    arcs : Arcs
        The elements in the order of `inner`.
    material : Material
    """

    inner: BoundaryColumns = field(kw_only=True)
    inner_place: IntArray = field(kw_only=True)
    sources: dict[int, HoleSource] = field(kw_only=True)
    arcs: Arcs = field(kw_only=True)
    material: Material = field(kw_only=True)

    @classmethod
    def around(
        cls, inner: BoundaryColumns, mesh: BoundaryMesh, material: Material, order: IntArray, holes: list[IntArray]
    ) -> SourcedColumns:
        """Return elements and holes in an order of both, from the elements in the same order."""
        n = mesh.n_elements
        is_element = order < n
        inner_place = np.where(is_element, np.cumsum(is_element) - 1, NOWHERE)
        sources = {
            int(place): HoleSource.of(mesh, holes[number - n])
            for place, number in zip(np.flatnonzero(~is_element), order[~is_element], strict=True)
        }
        place_of = np.flatnonzero(is_element)
        of_holes = np.array([mesh.lengths[holes[number - n]].mean() for number in order[~is_element].tolist()])
        lengths = np.empty(order.size)
        lengths[is_element], lengths[~is_element] = inner.lengths, of_holes
        start, centre, end = np.empty((3, order.size), complex)
        at = np.array([source.centre for source in sources.values()], complex)
        for of, known, away in ((start, inner.start, -0.5), (centre, inner.centre, 0.0), (end, inner.end, 0.5)):
            of[is_element], of[~is_element] = known, at + away * of_holes
        neighbours = np.tile(np.arange(order.size), (3, 1))
        neighbours[:, is_element] = place_of[inner.neighbours]
        return cls(
            inner.constants, order, start, end, centre, lengths, neighbours, inner.slopes, inner.means, inner.layer,
            inner=inner, inner_place=inner_place, sources=sources, material=material,
            arcs=Arcs.of(mesh).take(inner.order),
        )  # fmt: skip

    def fields(self, x: ComplexArray, places: IntArray, columns: IntArray) -> FloatArray:
        """Return what each column causes at points; see `BoundaryColumns.fields`."""
        result = np.zeros((2 * x.size, columns.size), order="F")
        inner_columns, inner_place = self.inner_place[columns // 4], self._inner(places)
        at_holes = (inner_place == NOWHERE) & (places != NOWHERE)
        elsewhere, of_elements = np.flatnonzero(~at_holes), np.flatnonzero(inner_columns != NOWHERE)
        known = 4 * inner_columns[of_elements] + columns[of_elements] % 4
        rows = (2 * elsewhere[:, None] + np.arange(2)).ravel()
        result[np.ix_(rows, of_elements)] = self.inner.fields(x[elsewhere], inner_place[elsewhere], known)
        for column in np.flatnonzero((inner_columns == NOWHERE) & (columns % 4 == 0)):
            w = self._caused(int(columns[column] // 4), x[elsewhere])
            result[rows[::2], column], result[rows[1::2], column] = w.real, w.imag
        for row in np.flatnonzero(at_holes):
            result[2 * row, of_elements] = self._felt(int(places[row]), known)
            result[2 * row + 1, columns == 4 * places[row] + 1] = self._unit(int(places[row]))
        return result

    def applied(self, places: IntArray, traction: FloatArray, displacement: FloatArray) -> FloatArray:
        """Return (1/2 + T) u - U t, (n, 2), in the middle of some elements, errors at holes included."""
        is_element = self.inner_place != NOWHERE
        result = self.inner.applied(self._inner(places), traction[is_element], displacement[is_element])
        for place in self.sources:
            w = self._caused(place, self.centre[places]) * traction[place, 0]
            result += np.stack([w.real, w.imag], axis=1)
        return result

    def of_forces(self, felt: FloatArray, places: IntArray, forces: ComplexArray) -> FloatArray:
        """Return what rows feel of point forces; the reciprocity of a hole feels them by the field of its source."""
        factor = -4.0 * np.pi * (1.0 - self.constants.poisson_ratio)
        for number in np.flatnonzero(self._inner(places) == NOWHERE):
            w = factor * self.sources[int(places[number])].value(forces)
            felt[0::2, 2 * number], felt[1::2, 2 * number] = w.real, w.imag
            felt[:, 2 * number + 1] = 0.0
        return felt

    def _inner(self, places: IntArray) -> IntArray:
        """Return the places among the elements, `NOWHERE` for holes and points of no element."""
        return np.where(places == NOWHERE, NOWHERE, self.inner_place[places])

    def _unit(self, place: int) -> float:
        """Return the size of the unknowns of a hole: that of what tractions on one of its elements cause."""
        return float(self.constants.single * self.lengths[place])

    def _caused(self, place: int, x: ComplexArray) -> ComplexArray:
        return self._unit(place) * self.sources[place].value(x)

    def _felt(self, place: int, columns: IntArray) -> FloatArray:
        """Return the work (n_columns,) of the tractions and displacements of elements on the field of a source."""
        inner = self.inner
        elements, number = np.unique(columns // 4, return_inverse=True)
        acted_on = inner.acted_on[:, elements]
        touched, at = np.unique(acted_on, return_inverse=True)
        at = at.reshape(acted_on.shape)
        arcs = self.arcs.take(touched)
        traction, displacement, gradient = self.sources[place].work(arcs, self.material)
        on_slope = gradient / (0.5 * inner.lengths * _tangents(inner))[touched]
        means, slopes = inner.reconstruction[elements].T
        on_displacement = np.sum(means * displacement[at] + slopes * on_slope[at], axis=0)
        own = np.searchsorted(touched, elements)
        # Re(factor v) of v = 1 and v = i
        factor = np.where((columns // 2) % 2 == 0, traction[own][number], -on_displacement[number])
        return np.where(columns % 2 == 0, factor.real, -factor.imag)


def _tangents(columns: BoundaryColumns) -> ComplexArray:
    span = columns.end - columns.start
    return np.asarray(span / np.abs(span))
