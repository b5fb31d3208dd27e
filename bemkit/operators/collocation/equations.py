"""The boundary equations of collocation, (1/2 + T) u = U t at the middles of elements, numbered along a tree.

A column is numbered 4 * element + 2 * kind + component, kind 0 for the traction and 1 for the displacement of an
element; its entries are the displacement that a unit of it causes. Displacements may have slopes
(`bemkit.operators.collocation.gradient_reconstruction`): that of an element then acts on its two neighbours, too.

The border makes resultants of the tractions zero, and adds a reciprocity for each closed curve
(`bemkit.operators.collocation.reciprocity`); for each of these there is an error of the displacement equations.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, TypeAlias

import numpy as np

from bemkit.arrays import ComplexArray, FloatArray, IntArray
from bemkit.geometry.mesh import BoundaryMesh
from bemkit.operators.collocation.compiled import layer_for
from bemkit.operators.collocation.gradient_reconstruction import GradientReconstruction
from bemkit.operators.collocation.layers import Constants, Layer, Unknowns, combined
from bemkit.operators.collocation.reciprocity import Reciprocity
from bemkit.operators.hierarchy.equations import Border
from bemkit.operators.integrals.panels import Panels
from bemkit.operators.material import Material
from bemkit.operators.rigid_modes import traction_free_modes

if TYPE_CHECKING:
    from bemkit.operators.collocation.curved_elements import CurvedElements

_ELEMENTS = 512
"""Elements whose sums are evaluated at a time, so that they stay in the cache."""
NOWHERE = -1
"""Element of a point that is the middle of none."""
Densities: TypeAlias = tuple[ComplexArray, ComplexArray, ComplexArray]


@dataclass(frozen=True, eq=False)
class CollocationEquations:
    """The equations of a body without symmetry; see `bemkit.operators.hierarchy.equations.BoundaryEquations`.

    Parameters
    ----------
    constants : Constants
    start, end, points : (n_elements,) complex arrays [m]
        Where elements start and end, and their middles.
    lengths : (n_elements,) array [m]
    acted_on : (n_elements, k) array
        The elements on which the displacement of each element acts: itself, and with slopes its neighbours.
    reconstruction : (n_elements, k, 2) complex array
        Constant part and slope that a unit displacement makes on these.
    border : Border
    layer : Layer
        What evaluates both layers of straight elements.
    curved : CurvedElements or None
        What evaluates them where elements are curved; closed forms do if all are straight.
    """

    constants: Constants
    start: ComplexArray
    end: ComplexArray
    points: ComplexArray
    lengths: FloatArray
    acted_on: IntArray
    reconstruction: ComplexArray
    border: Border
    layer: Layer
    curved: CurvedElements | None = None

    @classmethod
    def of(
        cls,
        mesh: BoundaryMesh,
        material: Material,
        order: IntArray,
        border: Border,
        *,
        takes_slopes: bool,
        layer: Layer | None = None,
        log_length: float | None = None,
    ) -> CollocationEquations:
        """Return the equations of a mesh without symmetry.

        Parameters
        ----------
        mesh : BoundaryMesh
        material : Material
        order : (n_elements,) array
            The element of the mesh at each position; everything else is by position.
        border : Border
        takes_slopes : bool
        layer : Layer, optional
            By default the compiled one for many elements.
        log_length : float, optional [m]
            Unit of length of the logarithm; by default the diameter of the mesh.
        """
        log_length = mesh.diameter if log_length is None else log_length
        panels = Panels(mesh)
        return cls(
            Constants.of(material, log_length),
            panels.start[order],
            panels.end[order],
            panels.centre[order],
            2.0 * panels.half[order],
            *_reconstruction(mesh, panels, order, takes_slopes=takes_slopes),
            border,
            layer or layer_for(mesh.n_elements),
            _curved(panels, material, order, log_length),
        )

    @property
    def supports(self) -> ComplexArray:
        """(m, n_elements) array [m]: ends and middles of the elements on which each one acts."""
        ends = np.stack([self.start, self.points, self.end])
        return np.asarray(ends[:, self.acted_on.T].reshape(-1, self.points.size))

    def block(self, rows: IntArray, columns: IntArray) -> FloatArray:
        """Return entries (n_rows, n_columns) of the equations; rows are 2 * element + component."""
        elements, number = distinct(rows // 2)
        by_column = self._fields(self.points[elements], elements, columns).T
        chosen = 2 * number + rows % 2
        if chosen.size < by_column.shape[1] or np.any(np.diff(chosen) != 1):
            by_column = by_column.take(chosen, axis=1)
        return by_column.T

    def fields(self, x: ComplexArray, columns: IntArray) -> FloatArray:
        """Return displacements (2 n_points, n_columns) that columns cause at points that are middles of no elements."""
        return self._fields(x, np.full(x.size, NOWHERE), columns)

    def under_forces(self, x: ComplexArray, rows: IntArray) -> FloatArray:
        """Return displacements of rows under unit forces along x and y, (2 n_points, n_rows), by 8 pi mu (1 - nu).

        The unit of length of the logarithm is the mean distance of the forces from their middle.
        """
        elements, number = distinct(rows // 2)
        nu, size = self.constants.poisson_ratio, float(np.abs(x - x.mean()).mean())
        return point_forces(self.points[elements], x, nu, size)[:, 2 * number + rows % 2]

    def residual(self, elements: IntArray, traction: FloatArray, displacement: FloatArray) -> FloatArray:
        """Return (1/2 + T) u - U t, (n, 2), in the middle of some elements, from (n_elements, 2) arrays."""
        densities = self.densities(traction, displacement)
        result = np.zeros(elements.size, complex)
        every = np.arange(self.start.size)
        for begin in range(0, every.size, _ELEMENTS):
            result += self.potential(elements, every[begin : begin + _ELEMENTS], densities)
        return np.stack([result.real, result.imag], axis=1) + 0.5 * displacement[elements]

    def potential(self, nodes: IntArray, elements: IntArray, densities: Densities) -> ComplexArray:
        """Return T u - U t, complex (n_nodes,), in the middle of some nodes from densities on some elements, ascending.

        On the element of a node T is a principal value.
        """
        t, u, s = (each[elements] for each in densities)
        itself, one = np.arange(elements.size)[None], np.zeros(1, np.intp)
        weights, x = (-t[None, :, None], np.stack([u, s], axis=1)[None]), self.points[nodes]
        single, double = (
            self._layer(is_double, x, nodes, elements, Unknowns(itself, weight, one))[0]
            for is_double, weight in zip((False, True), weights, strict=True)
        )
        return np.asarray(single + double)

    def densities(self, traction: FloatArray, displacement: FloatArray) -> Densities:
        """Return complex tractions, constant parts and slopes of displacements, each (n,), from (n, 2) arrays."""
        t, u = (each[:, 0] + 1j * each[:, 1] for each in (traction, displacement))
        mean, slope = np.zeros((2, u.size), complex)
        for elements, weights in zip(self.acted_on.T, self.reconstruction.transpose(1, 2, 0), strict=True):
            # neighbours of different elements are different
            mean[elements] += weights[0] * u
            slope[elements] += weights[1] * u
        return t, mean, slope

    def _fields(self, x: ComplexArray, own: IntArray, columns: IntArray) -> FloatArray:
        """Return displacements (2 n_points, n_columns) that columns cause at points; rows are 2 * point + component.

        Parameters
        ----------
        x : (n_points,) complex array
        own : (n_points,) array
            The element in whose middle the point is, or `NOWHERE`.
        columns : (n_columns,) array
        """
        is_double = (columns // 2) % 2 == 1
        if is_double.any() == is_double.all():
            return self._of_kind(x, own, columns, bool(is_double.any())).view(float).T
        result = np.empty((columns.size, x.size), complex)
        for of_kind, chosen in ((False, ~is_double), (True, is_double)):
            result[chosen] = self._of_kind(x, own, columns[chosen], of_kind)
        return result.view(float).T

    def _of_kind(self, x: ComplexArray, own: IntArray, columns: IntArray, is_double: bool) -> ComplexArray:
        """Return displacements (n_columns, n_points) that columns of tractions, or of displacements, cause."""
        elements, number = distinct(columns // 4)
        numbered = 2 * number + columns % 2
        touched, unknowns = self._unknowns(elements, numbered, is_double)
        result = self._layer(is_double, x, own, touched, unknowns)
        number_at = counted(own, elements) if is_double else np.zeros(0, np.intp)
        points = np.flatnonzero(number_at >= 0)
        for component, jump in enumerate((0.5, 0.5j)):
            column = counted(2 * number_at[points] + component, numbered)
            result[column[column >= 0], points[column >= 0]] += jump
        return result

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
        touched, at = np.unique(self.acted_on[elements], return_inverse=True)
        return touched, Unknowns(at.reshape(self.acted_on[elements].shape), self.reconstruction[elements], columns)


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


def _curved(panels: Panels, material: Material, order: IntArray, log_length: float) -> CurvedElements | None:
    if panels.curved is None:
        return None
    from bemkit.operators.collocation.curved_elements import CurvedElements

    return CurvedElements.of(panels, material, order, log_length)


def collocation_border(mesh: BoundaryMesh, material: Material, order: IntArray, *, takes_slopes: bool) -> Border:
    """Return resultants and reciprocities with their errors, for elements in an order, by position.

    Resultants are of the size of the displacements that they cause: equations of one size are all solved to round-off.
    """
    n = mesh.n_elements
    motions = traction_free_modes(mesh, mesh.centres)
    reciprocity = Reciprocity.of(mesh, material, takes_slopes=takes_slopes)
    compliance = 1.0 / (8.0 * np.pi * material.shear_modulus * (1.0 - material.effective_poisson_ratio))
    on_traction = np.concatenate([motions.T * (compliance * np.repeat(mesh.lengths, 2)), reciprocity.on_traction])
    on_displacement = np.concatenate([np.zeros(motions.T.shape), reciprocity.on_displacement])
    errors = np.column_stack([motions, reciprocity.fields])
    k = errors.shape[1]
    balances = np.concatenate([on_traction.reshape(k, n, 2), -on_displacement.reshape(k, n, 2)], axis=2)[:, order]
    return Border(errors.reshape(n, 2, k)[order].reshape(2 * n, k), balances.reshape(k, 4 * n), np.zeros((k, k)))


def _reconstruction(
    mesh: BoundaryMesh, panels: Panels, order: IntArray, *, takes_slopes: bool
) -> tuple[IntArray, ComplexArray]:
    """Return the elements on which each one acts, (n, k), with constant parts and slopes there, (n, k, 2)."""
    n = order.size
    if not takes_slopes:
        return np.arange(n)[:, None], np.tile(np.array([1.0 + 0j, 0.0]), (n, 1, 1))
    position, before, after = np.empty((3, n), np.intp)
    position[order] = np.arange(n)
    for loop in mesh.loops:
        before[loop], after[loop] = np.roll(loop, 1), np.roll(loop, -1)
    acted_on = np.stack([before, np.arange(n), after], axis=1)
    of = GradientReconstruction.of(mesh, panels)
    # an element is the one after its predecessor, itself, and the one before its successor
    roles = np.array([2, 1, 0])
    means, slopes = of.means[roles, acted_on], of.slopes[roles, acted_on]
    means[:, 1] += 1.0
    return position[acted_on[order]], np.stack([means, slopes], axis=2)[order]


def point_forces(x: ComplexArray, sources: ComplexArray, poisson_ratio: float, log_length: float) -> FloatArray:
    """Return displacements that unit forces along x and y cause, by 8 pi mu (1 - nu).

    Parameters
    ----------
    x : (n_points,) complex array
    sources : (n_sources,) complex array
    poisson_ratio, log_length : float

    Returns
    -------
    (2 n_sources, 2 n_points) array
        By 2 * source + component of the force and 2 * point + component of the displacement.
    """
    kappa = 3.0 - 4.0 * poisson_ratio
    arm = x - sources[:, None]
    squared = np.square(arm.real) + np.square(arm.imag)
    log = (-0.5 * kappa) * np.log(squared / log_length**2)
    turned = arm / squared
    result = np.stack([log + arm.real * turned, 1j * log + arm.imag * turned], axis=1)
    return result.reshape(2 * sources.size, x.size).view(float)
