"""Columns of the boundary equations (1/2 + T) u - U t of collocation, at any points and for any unknowns.

A column is numbered 4 * element + 2 * kind + component, kind 0 for the traction and 1 for the displacement of an
element; its entries are the displacement that a unit of it causes. Displacements may have slopes
(`bemkit.operators.collocation.gradient_reconstruction`): that of an element then acts on its two neighbours, too.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TypeAlias

import numpy as np

from bemkit.arrays import ComplexArray, FloatArray, IntArray
from bemkit.geometry.mesh import BoundaryMesh
from bemkit.operators.collocation.compiled import layer_for
from bemkit.operators.collocation.gradient_reconstruction import GradientReconstruction
from bemkit.operators.collocation.layers import Constants, Layer, Unknowns, combined
from bemkit.operators.hierarchy.curved_elements import CurvedElements
from bemkit.operators.integrals.panels import Panels
from bemkit.operators.material import Material

_ELEMENTS = 512
"""Elements whose sums are evaluated at a time, so that they stay in the cache."""
NOWHERE = -1
"""Element of a point that is the middle of none."""
Densities: TypeAlias = tuple[ComplexArray, ComplexArray, ComplexArray]


@dataclass(frozen=True, eq=False)
class BoundaryColumns:
    """Elements in the order of a tree, and what they cause.

    Parameters
    ----------
    constants : Constants
    order : (n_elements,) array
        The element of the mesh at each place; everything else is by place.
    start, end, centre : (n_elements,) complex arrays [m]
    lengths : (n_elements,) array [m]
    neighbours : (3, n_elements) array
        Places of the element before, of the element itself and of the one after it along the boundary.
    slopes, means : (3, n_elements) complex arrays or None
        Weights of the displacements of these three in the slope and in the mean of each element.
    layer : Layer
        What evaluates both layers of straight elements.
    curved : CurvedElements or None
        What evaluates them where elements are curved; closed forms do if all are straight.
    """

    constants: Constants
    order: IntArray
    start: ComplexArray
    end: ComplexArray
    centre: ComplexArray
    lengths: FloatArray
    neighbours: IntArray
    slopes: ComplexArray | None
    means: ComplexArray | None
    layer: Layer
    curved: CurvedElements | None = None

    @classmethod
    def of(
        cls,
        mesh: BoundaryMesh,
        material: Material,
        order: IntArray,
        *,
        takes_slopes: bool,
        log_length: float | None = None,
    ) -> BoundaryColumns:
        """Return the columns of a mesh without symmetry.

        Parameters
        ----------
        mesh : BoundaryMesh
        material : Material
        order : (n_elements,) array
            The element at each place.
        takes_slopes : bool
        log_length : float, optional [m]
            Unit of length of the logarithm; by default the diameter of the mesh.
        """
        log_length = mesh.diameter if log_length is None else log_length
        panels = Panels(mesh)
        place = np.empty_like(order)
        place[order] = np.arange(order.size)
        before, after = np.empty_like(order), np.empty_like(order)
        for loop in mesh.loops:
            before[loop], after[loop] = np.roll(loop, 1), np.roll(loop, -1)
        neighbours = np.stack([place[before[order]], np.arange(order.size), place[after[order]]])
        slopes = means = None
        if takes_slopes:
            of = GradientReconstruction.of(mesh, panels)
            slopes, means = np.take(of.slopes, order, axis=1), np.take(of.means, order, axis=1)
        return cls(
            Constants.of(material, log_length),
            order,
            panels.start[order],
            panels.end[order],
            panels.centre[order],
            2.0 * panels.half[order],
            neighbours,
            slopes,
            means,
            layer_for(mesh.n_elements),
            None if panels.curved is None else CurvedElements.of(panels, material, order, log_length),
        )

    @property
    def n_elements(self) -> int:
        """Number of elements."""
        return self.order.size

    @property
    def reach(self) -> IntArray:
        """(k, n_elements) places on which each element acts: itself, and with slopes its neighbours."""
        return self.neighbours[1:2] if self.slopes is None else self.neighbours

    def entries(self, rows: IntArray, columns: IntArray) -> FloatArray:
        """Return entries (n_rows, n_columns) of the equations; rows are 2 * place + component; both are ascending."""
        points, number = distinct(rows // 2)
        by_column = self.fields(self.centre[points], points, columns).T
        chosen = 2 * number + rows % 2
        if chosen.size < by_column.shape[1] or np.any(np.diff(chosen) != 1):
            by_column = by_column.take(chosen, axis=1)
        return by_column.T

    def fields(self, x: ComplexArray, places: IntArray, columns: IntArray) -> FloatArray:
        """Return displacements (2 n_points, n_columns) that columns cause at points; rows are 2 * point + component.

        Parameters
        ----------
        x : (n_points,) complex array
        places : (n_points,) array
            The element in whose middle the point is, or `NOWHERE`.
        columns : (n_columns,) array
            Ascending.
        """
        is_double = (columns // 2) % 2 == 1
        if is_double.any() == is_double.all():
            return self._of_kind(x, places, columns, bool(is_double.any())).view(float).T
        result = np.empty((columns.size, x.size), complex)
        for of_kind, chosen in ((False, ~is_double), (True, is_double)):
            result[chosen] = self._of_kind(x, places, columns[chosen], of_kind)
        return result.view(float).T

    def _of_kind(self, x: ComplexArray, places: IntArray, columns: IntArray, is_double: bool) -> ComplexArray:
        """Return displacements (n_columns, n_points) that columns of tractions, or of displacements, cause."""
        elements, number = distinct(columns // 4)
        numbered = 2 * number + columns % 2
        touched, unknowns = self._unknowns(elements, numbered, is_double)
        result = self._layer(is_double, x, places, touched, unknowns)
        own = counted(places, elements) if is_double else np.zeros(0, np.intp)
        points = np.flatnonzero(own >= 0)
        for component, jump in enumerate((0.5, 0.5j)):
            column = counted(2 * own[points] + component, numbered)
            result[column[column >= 0], points[column >= 0]] += jump
        return result

    def of_forces(self, felt: FloatArray, places: IntArray, forces: ComplexArray) -> FloatArray:
        """Return what the equations in the middle of elements feel of point forces.

        Parameters
        ----------
        felt : (2 n_forces, 2 n_places) array
            The displacements there, by 8 pi mu (1 - nu).
        places : (n_places,) array
        forces : (n_forces,) complex array
            Where they act.
        """
        return felt

    def applied(self, places: IntArray, traction: FloatArray, displacement: FloatArray) -> FloatArray:
        """Return (1/2 + T) u - U t, (n, 2), in the middle of some elements.

        Parameters
        ----------
        places : (n,) array
        traction, displacement : (n_elements, 2) arrays
            By place.
        """
        x, densities = self.centre[places], self.densities(traction, displacement)
        result = np.zeros(x.size, complex)
        every = np.arange(self.start.size)
        for elements in (every[begin : begin + _ELEMENTS] for begin in range(0, every.size, _ELEMENTS)):
            t, u, s = (each[elements] for each in densities)
            itself, one = np.arange(elements.size)[None], np.zeros(1, np.intp)
            weights = -t[None, :, None], np.stack([u, s], axis=1)[None]
            for is_double, weight in enumerate(weights):
                unknowns = Unknowns(itself, weight, one)
                result += self._layer(bool(is_double), x, places, elements, unknowns)[0]
        return np.stack([result.real, result.imag], axis=1) + 0.5 * displacement[places]

    def densities(self, traction: FloatArray, displacement: FloatArray) -> Densities:
        """Return complex tractions, constant parts and slopes of displacements, each (n,), from (n, 2) arrays."""
        t, u = (each[:, 0] + 1j * each[:, 1] for each in (traction, displacement))
        if self.slopes is None or self.means is None:
            return t, u, np.zeros_like(u)
        mean, slope = u.copy(), np.zeros_like(u)
        for k, places in enumerate(self.neighbours):
            mean += self.means[k] * u[places]
            slope += self.slopes[k] * u[places]
        return t, mean, slope

    def _layer(
        self, is_double: bool, x: ComplexArray, places: IntArray, elements: IntArray, unknowns: Unknowns
    ) -> ComplexArray:
        """Return what unknowns on some elements, ascending, cause, (n_columns, n_points); see `layers.Layer`."""
        curved = self.curved
        if curved is not None:
            return combined(
                lambda some: curved.factors(is_double, x[some], places[some], elements),
                (elements.size, x.size),
                unknowns,
            )
        ends = self.start[elements], self.end[elements]
        return self.layer(self.constants, is_double, x, counted(places, elements), ends, unknowns)

    @property
    def acted_on(self) -> IntArray:
        """(k, n) places on which the displacement of each element acts: itself, and with slopes its neighbours."""
        return self.neighbours[1:2] if self.slopes is None else self.neighbours

    @cached_property
    def reconstruction(self) -> ComplexArray:
        """(n, k, 2) array: constant part and slope that a unit displacement makes on each element it acts on."""
        if self.slopes is None or self.means is None:
            return np.broadcast_to(np.array([1.0 + 0j, 0.0]), (self.order.size, 1, 2))
        # an element is the one after its predecessor, itself, and the one before its successor
        roles = np.array([[2], [1], [0]])
        means, slopes = self.means[roles, self.neighbours], self.slopes[roles, self.neighbours]
        means[1] += 1.0
        return np.ascontiguousarray(np.stack([means, slopes], axis=2).transpose(1, 0, 2))

    def _unknowns(self, elements: IntArray, columns: IntArray, is_double: bool) -> tuple[IntArray, Unknowns]:
        """Return the elements that unknowns of one kind act on, ascending, and the unknowns on these.

        Parameters
        ----------
        elements : (n,) array
            Those of the unknowns.
        columns : (n_columns,) array
            As of `Unknowns`.
        is_double : bool
        """
        if not is_double:
            return elements, Unknowns(
                np.arange(elements.size)[:, None], np.full((elements.size, 1, 1), -1.0 + 0j), columns
            )
        touched, at = np.unique(self.acted_on[:, elements].T, return_inverse=True)
        return touched, Unknowns(at.reshape(elements.size, -1), self.reconstruction[elements], columns)


def distinct(numbers: IntArray) -> tuple[IntArray, IntArray]:
    """Return the distinct ones of some numbers, ascending, and which of them each number is."""
    is_first = np.append(True, numbers[1:] != numbers[:-1])[: numbers.size]
    return numbers[is_first], np.cumsum(is_first) - 1


def counted(places: IntArray, elements: IntArray) -> IntArray:
    """Return the positions of places in some elements, ascending; `NOWHERE` for others."""
    if not elements.size:
        return np.full_like(places, NOWHERE)
    found = np.searchsorted(elements, places)
    return np.where(elements[np.minimum(found, elements.size - 1)] == places, found, NOWHERE)
