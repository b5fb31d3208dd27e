"""Columns of the boundary equations (1/2 + T) u - U t of collocation, at any points and for any unknowns.

A column is numbered 4 * element + 2 * kind + component, kind 0 for the traction and 1 for the displacement of an
element; its entries are the displacement that a unit of it causes. Displacements may have slopes
(`bemkit.operators.collocation.gradient_reconstruction`): that of an element then acts on its two neighbours, too.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from bemkit.arrays import ComplexArray, FloatArray, IntArray
from bemkit.geometry.mesh import BoundaryMesh
from bemkit.operators.collocation.gradient_reconstruction import GradientReconstruction
from bemkit.operators.hierarchy import compiled
from bemkit.operators.hierarchy.curved_elements import CurvedElements
from bemkit.operators.hierarchy.element_fields import Constants, element_fields
from bemkit.operators.integrals.panels import Panels
from bemkit.operators.material import Material

_PAIRS = 16384
"""Pairs of points and elements that are evaluated at a time, so that they stay in the cache."""
NOWHERE = -1
"""Element of a point that is the middle of none."""
_NOTHING = np.zeros((0, 0), complex)
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
    curved : CurvedElements or None
        What evaluates the fields where elements are curved; closed forms do if all are straight.
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
        if self.curved is None and (fast := compiled.functions()) is not None:
            slopes, means = (_NOTHING if of is None else of for of in (self.slopes, self.means))
            about = self.constants.numbers, x, places, self.start, self.end, self.neighbours, slopes, means
            values: FloatArray = fast.columns(*about, columns)
            return values.T
        result = np.empty((columns.size, x.size), complex)
        step = max(1, 4 * _PAIRS // max(columns.size, 1))  # about four columns an element
        for begin in range(0, x.size, step):
            some = slice(begin, begin + step)
            result[:, some] = self._some_fields(x[some], places[some], columns).T
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
        if self.curved is None and (fast := compiled.functions()) is not None:
            result: ComplexArray = fast.applied(self.constants.numbers, x, places, self.start, self.end, *densities)
        else:
            result = np.zeros(x.size, complex)
            every, step = np.arange(self.start.size), max(1, _PAIRS // max(places.size, 1))
            for elements in (every[begin : begin + step] for begin in range(0, every.size, step)):
                fields = self._element_fields(x, places, elements)
                result += caused(fields, *(each[elements] for each in densities))
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

    def _some_fields(self, x: ComplexArray, places: IntArray, columns: IntArray) -> ComplexArray:
        """Return complex displacements (n_points, n_columns)."""
        elements, number = np.unique(columns // 4, return_inverse=True)
        touched = elements if self.slopes is None else np.unique(self.neighbours[:, elements])
        fields = self._element_fields(x, places, touched)
        own, about = np.searchsorted(touched, elements), (elements, touched)
        kind, is_along_x = (columns // 2) % 2, columns % 2 == 0
        result = np.empty((x.size, columns.size), complex)
        for of_kind in (0, 1):
            if not np.any(kind == of_kind):
                continue
            if of_kind == 0:
                on, on_conjugate = -fields[0][:, own], -fields[1][:, own]
            else:
                on = self.of_displacements(*about, fields[2], fields[4], is_conjugate=False)
                on += 0.5 * (places[:, None] == elements)
                on_conjugate = self.of_displacements(*about, fields[3], fields[5], is_conjugate=True)
            for along_x, field in ((True, on + on_conjugate), (False, 1j * (on - on_conjugate))):
                chosen = (kind == of_kind) & (is_along_x == along_x)
                result[:, chosen] = field[:, number[chosen]]
        return result

    def _element_fields(self, x: ComplexArray, places: IntArray, elements: IntArray) -> ComplexArray:
        """Return what some elements, ascending, cause; see `element_fields.element_fields`."""
        if self.curved is not None:
            return self.curved.fields(x, places, elements)
        return element_fields(self.constants, x, counted(places, elements), self.start[elements], self.end[elements])

    def of_displacements(
        self, elements: IntArray, touched: IntArray, on: ComplexArray, on_slope: ComplexArray, *, is_conjugate: bool
    ) -> ComplexArray:
        """Return the factors (..., n) of the displacements of elements, or of their conjugates, with slopes.

        From those of the constant parts and slopes, (..., m), on all elements on which these act, `touched`, ascending.
        """
        total: ComplexArray = on[..., np.searchsorted(touched, elements)]
        if self.slopes is None or self.means is None:
            return total
        # an element is the one after its predecessor, itself, and the one before its successor
        for k, acted_on in zip((2, 1, 0), self.neighbours[:, elements], strict=True):
            at, slopes, means = np.searchsorted(touched, acted_on), self.slopes[k, acted_on], self.means[k, acted_on]
            if is_conjugate:
                slopes, means = slopes.conj(), means.conj()
            total += on_slope[..., at] * slopes + on[..., at] * means
        return total


def caused(fields: ComplexArray, t: ComplexArray, u: ComplexArray, s: ComplexArray) -> ComplexArray:
    """Return T (u + s t) - U t, complex (n_points,), from the fields (6, n_points, n_elements) of `element_fields`."""
    return np.asarray(
        sum(field @ of for field, of in zip(fields, (-t, -t.conj(), u, u.conj(), s, s.conj()), strict=True))
    )


def counted(places: IntArray, elements: IntArray) -> IntArray:
    """Return where places stand among some elements, ascending; `NOWHERE` if they do not."""
    if not elements.size:
        return np.full_like(places, NOWHERE)
    counted = np.searchsorted(elements, places)
    return np.where(elements[np.minimum(counted, elements.size - 1)] == places, counted, NOWHERE)
