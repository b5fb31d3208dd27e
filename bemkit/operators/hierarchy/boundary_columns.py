"""Columns of the boundary equations (1/2 + T) u - U t of collocation, at any points and for any unknowns.

A column is numbered 4 * element + 2 * kind + component, kind 0 for the traction and 1 for the displacement of an
element; its entries are the displacement that a unit of it causes. Displacements may have slopes
(`bemkit.operators.collocation.gradient_reconstruction`): that of an element then acts on its two neighbours, too.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bemkit.arrays import ComplexArray, FloatArray, IntArray
from bemkit.geometry.mesh import BoundaryMesh
from bemkit.operators.collocation.gradient_reconstruction import GradientReconstruction
from bemkit.operators.hierarchy import compiled
from bemkit.operators.hierarchy.curved_elements import CurvedElements
from bemkit.operators.hierarchy.element_fields import Constants, double_layer_fields, single_layer_fields
from bemkit.operators.integrals.panels import Panels
from bemkit.operators.material import Material

_PAIRS = 16384
"""Pairs of points and elements that are evaluated at a time, so that they stay in the cache."""
NOWHERE = -1
"""Element of a point that is the middle of none."""


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
            slopes = np.stack([of.before, of.own, of.after])[:, order]
            means = np.stack([of.mean_before, of.mean_own, of.mean_after])[:, order]
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
        points, place = np.unique(rows // 2, return_inverse=True)
        fields = self.fields(self.centre[points], points, columns)
        parts = np.stack([fields.real, fields.imag])
        block: FloatArray = parts[rows % 2, place]
        return block

    def fields(self, x: ComplexArray, places: IntArray, columns: IntArray) -> ComplexArray:
        """Return what each column causes at points: (n_points, n_columns), complex displacements.

        Parameters
        ----------
        x : (n_points,) complex array
        places : (n_points,) array
            The element in whose middle the point is, or `NOWHERE`.
        columns : (n_columns,) array
        """
        element, kind, component = columns // 4, (columns // 2) % 2, columns % 2
        result = np.empty((x.size, columns.size), complex)
        for of_kind, factors in ((0, self._of_tractions), (1, self._of_displacements)):
            chosen = np.flatnonzero(kind == of_kind)
            if chosen.size:
                elements, number = np.unique(element[chosen], return_inverse=True)
                on, on_conjugate = factors(x, places, elements)
                along_x = component[chosen] == 0
                result[:, chosen[along_x]] = (on + on_conjugate)[:, number[along_x]]
                result[:, chosen[~along_x]] = (1j * (on - on_conjugate))[:, number[~along_x]]
        return result

    def applied(self, places: IntArray, traction: FloatArray, displacement: FloatArray) -> FloatArray:
        """Return (1/2 + T) u - U t, (n, 2), in the middle of some elements.

        Parameters
        ----------
        places : (n,) array
        traction, displacement : (n_elements, 2) arrays
            By place.
        """
        t, u = (each @ np.array([1.0, 1j]) for each in (traction, displacement))
        s = np.zeros_like(u)
        result = 0.5 * u[places]
        if self.slopes is not None and self.means is not None:
            around = u[self.neighbours]
            s, u = np.sum(self.slopes * around, axis=0), u + np.sum(self.means * around, axis=0)
        step = max(1, _PAIRS // max(places.size, 1))
        for begin in range(0, t.size, step):
            some = np.arange(begin, min(begin + step, t.size))
            on, on_conjugate = self._single_layer(self.centre[places], places, some)
            result -= on @ t[some] + on_conjugate @ t[some].conj()
            fields = self._double_layer(self.centre[places], places, some)
            result += fields[0] @ u[some] + fields[1] @ u[some].conj()
            result += fields[2] @ s[some] + fields[3] @ s[some].conj()
        return np.stack([result.real, result.imag], axis=1)

    def _of_tractions(self, x: ComplexArray, places: IntArray, elements: IntArray) -> tuple[ComplexArray, ComplexArray]:
        on, on_conjugate = -self._single_layer(x, places, elements)
        return on, on_conjugate

    def _single_layer(self, x: ComplexArray, places: IntArray, elements: IntArray) -> ComplexArray:
        if self.curved is not None:
            return self.curved.fields(x, places, elements)[:2]
        is_own = places[:, None] == elements
        return single_layer_fields(self.constants, x, self.start[elements], self.end[elements], is_own)

    def _double_layer(self, x: ComplexArray, places: IntArray, elements: IntArray) -> ComplexArray:
        if self.curved is not None:
            return self.curved.fields(x, places, elements)[2:]
        is_own = places[:, None] == elements
        return double_layer_fields(self.constants, x, self.start[elements], self.end[elements], is_own)

    def _of_displacements(
        self, x: ComplexArray, places: IntArray, elements: IntArray
    ) -> tuple[ComplexArray, ComplexArray]:
        if self.slopes is None or self.means is None:
            touched = elements
        else:
            touched = np.unique(self.neighbours[:, elements])
        is_own, fields = places[:, None] == touched, self._double_layer(x, places, touched)
        fields[0] += 0.5 * is_own
        if self.slopes is None or self.means is None:
            return fields[0], fields[1]
        # an element is the one after its predecessor, itself, and the one before its successor
        at = np.searchsorted(touched, self.neighbours[:, elements])
        slopes, means = (
            np.stack([of[k, touched[each]] for k, each in zip((2, 1, 0), at, strict=True)])
            for of in (self.slopes, self.means)
        )
        if (fast := compiled.functions()) is not None:
            on, on_conjugate = fast.with_slopes(fields, is_own, at, slopes, means)
            return on, on_conjugate
        total, total_conjugate = fields[0][:, at[1]], fields[1][:, at[1]]
        for k in range(3):
            free = fields[0][:, at[k]] - 0.5 * is_own[:, at[k]]
            total += fields[2][:, at[k]] * slopes[k] + free * means[k]
            total_conjugate += fields[3][:, at[k]] * slopes[k].conj() + fields[1][:, at[k]] * means[k].conj()
        return total, total_conjugate
