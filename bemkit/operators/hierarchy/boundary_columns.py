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
from scipy.sparse import csr_array

from bemkit.arrays import ComplexArray, FloatArray, IntArray
from bemkit.geometry.mesh import BoundaryMesh
from bemkit.operators.collocation.compiled import layer_for
from bemkit.operators.collocation.gradient_reconstruction import GradientReconstruction
from bemkit.operators.collocation.layers import Constants, Layer, sums
from bemkit.operators.hierarchy.curved_elements import CurvedElements
from bemkit.operators.integrals.panels import Panels
from bemkit.operators.material import Material

_PAIRS = 16384
"""Pairs of points and elements that are evaluated at a time, so that they stay in the cache."""
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
        """Return entries (n_rows, n_columns) of the equations; rows are 2 * place + component."""
        points, number = np.unique(rows // 2, return_inverse=True)
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
            Those of an element that follow each other are evaluated at once.
        """
        result = np.empty((columns.size, x.size), complex)
        for is_double in (False, True):
            chosen = np.flatnonzero((columns // 2) % 2 == is_double)
            if not chosen.size:
                continue
            touched, weights = self._weights(columns[chosen], is_double)
            step = max(1, _PAIRS // touched.size)
            for begin in range(0, x.size, step):
                some = slice(begin, begin + step)
                factors = self._layer(is_double, x[some], places[some], touched)
                result[chosen, some] = weights @ factors.reshape(weights.shape[1], -1)
            if is_double:
                column, point = np.nonzero(columns[chosen, None] // 4 == places)
                result[chosen[column], point] += np.where(columns[chosen[column]] % 2 == 0, 0.5, 0.5j)
        return result.view(float).T

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
        every, step = np.arange(self.start.size), max(1, _PAIRS // max(places.size, 1))
        for elements in (every[begin : begin + step] for begin in range(0, every.size, step)):
            layers = (self._layer(is_double, x, places, elements) for is_double in (False, True))
            result += sums(*layers, *(each[elements] for each in densities))
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

    def _layer(self, is_double: bool, x: ComplexArray, places: IntArray, elements: IntArray) -> ComplexArray:
        """Return the factors of the densities on some elements, ascending; see `layers.straight_layer`."""
        if self.curved is not None:
            return self.curved.layer(is_double, x, places, elements)
        return self.layer(
            self.constants, is_double, x, counted(places, elements), self.start[elements], self.end[elements]
        )

    @property
    def acted_on(self) -> IntArray:
        """(k, n) places on which the displacement of each element acts: itself, and with slopes its neighbours."""
        return self.neighbours[1:2] if self.slopes is None else self.neighbours

    @cached_property
    def reconstruction(self) -> tuple[ComplexArray, ComplexArray]:
        """(k, n) constant parts, and slopes, that a unit displacement of each element makes on those it acts on."""
        if self.slopes is None or self.means is None:
            return np.ones((1, self.order.size), complex), np.zeros((1, self.order.size), complex)
        # an element is the one after its predecessor, itself, and the one before its successor
        roles = np.array([[2], [1], [0]])
        means, slopes = self.means[roles, self.neighbours], self.slopes[roles, self.neighbours]
        means[1] += 1.0
        return means, slopes

    def _weights(self, columns: IntArray, is_double: bool) -> tuple[IntArray, csr_array]:
        """Return the elements that some columns of one kind act on, and the weights of their factors in each column.

        The weights are (n_columns, n_touched n_factors), the factors of an element side by side. A unit along y is the
        number i: i times the factor of a density, and -i times that of its conjugate.
        """
        elements, turn = columns // 4, np.where(columns % 2 == 0, 1.0, 1j)
        if is_double:
            acted_on = self.acted_on[:, elements]
            values = np.stack([of[:, elements] * turn for of in self.reconstruction])
        else:
            acted_on, values = elements[None], -turn[None, None]
        _, k, n = values.shape
        values = np.concatenate([values, values.conj()])
        touched, at = np.unique(acted_on, return_inverse=True)
        indices = len(values) * at.reshape(k, n) + np.arange(len(values))[:, None, None]
        by_column = values.transpose(2, 0, 1).ravel(), indices.transpose(2, 0, 1).ravel()
        starts = np.arange(0, values.size + 1, len(values) * k)
        return touched, csr_array((*by_column, starts), shape=(n, len(values) * touched.size))


def counted(places: IntArray, elements: IntArray) -> IntArray:
    """Return the positions of places in some elements, ascending; `NOWHERE` for others."""
    if not elements.size:
        return np.full_like(places, NOWHERE)
    counted = np.searchsorted(elements, places)
    return np.where(elements[np.minimum(counted, elements.size - 1)] == places, counted, NOWHERE)
