"""The boundary equations of collocation, (1/2 + T) u = U t at the midpoints of elements, in the order of a tree.

Column 4 * element + 2 * kind + component belongs to the traction (kind 0) or displacement (kind 1) of an element; its
entries are the displacements that a unit of it causes. Displacements may have slopes; the displacement of an element
then also acts on its two neighbours.

The border sets the resultants of the tractions to zero and adds a reciprocity for each closed curve. Each of these
equations adds an unknown error of the displacement equations. See `bemkit.operators.collocation.corrections`.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, TypeAlias

import numpy as np

from bemkit.arrays import ComplexArray, FloatArray, IntArray
from bemkit.geometry.mesh import BoundaryMesh
from bemkit.operators.boundary_equations import Border
from bemkit.operators.collocation.corrections import GradientReconstruction, Reciprocity
from bemkit.operators.collocation.layers import Constants, Layer, Unknowns, combined
from bemkit.operators.element_geometry import ElementGeometry
from bemkit.operators.material import Material
from bemkit.operators.rigid_modes import traction_free_modes

if TYPE_CHECKING:
    from bemkit.operators.collocation.curved_elements import CurvedElements
    from bemkit.operators.collocation.images import FoldedEquations

_ELEMENTS = 512
"""Elements whose sums are evaluated at a time, to stay in the cache."""
NOWHERE = -1
"""Marks a point that is no midpoint."""
Densities: TypeAlias = tuple[ComplexArray, ComplexArray, ComplexArray]
"""Complex tractions, constant parts of displacements and slopes, each (n_elements,)."""


class CollocationEquations:
    """The equations of a body without symmetry; see `bemkit.operators.boundary_equations.BoundaryEquations`.

    Parameters
    ----------
    mesh : BoundaryMesh
    material : Material
    order : (n_elements,) array
        The element of the mesh at each position of the tree.
    border : Border
    takes_slopes : bool
    layer : Layer, optional
        Evaluates both layers of straight elements; by default the compiled layer if there are many elements.
    log_length : float, optional [m]
        Unit of length in the logarithm; by default the diameter of the mesh.

    Attributes
    ----------
    acted_on : (n_elements, k) array
        Elements on which the displacement of each element acts: itself, and with slopes its neighbours.
    reconstruction : (n_elements, k, 2) complex array
        Constant part and slope of a unit displacement on these.
    curved : CurvedElements or None
        Evaluates both layers if some elements are curved.
    """

    def __init__(
        self,
        mesh: BoundaryMesh,
        material: Material,
        order: IntArray,
        border: Border,
        *,
        takes_slopes: bool,
        layer: Layer | None = None,
        log_length: float | None = None,
    ) -> None:
        if layer is None:
            from bemkit.operators.collocation.compiled import layer_for

            layer = layer_for(mesh.n_elements)
        log_length = mesh.diameter if log_length is None else log_length
        geometry = ElementGeometry(mesh)
        self.constants, self.border, self.layer = Constants.of(material, log_length), border, layer
        self.start, self.end = geometry.start[order], geometry.end[order]
        self.points, self.lengths = geometry.centre[order], 2.0 * geometry.half[order]
        self.acted_on, self.reconstruction = _reconstruction(mesh, geometry, order, takes_slopes=takes_slopes)
        self.curved = _curved(geometry, material, order, log_length)

    @property
    def supports(self) -> ComplexArray:
        """(m, n_elements) array [m]: ends and midpoints of the elements on which each element acts."""
        ends = np.stack([self.start, self.points, self.end])
        return np.asarray(ends[:, self.acted_on.T].reshape(-1, self.points.size))

    def block(self, rows: IntArray, columns: IntArray) -> FloatArray:
        """Return entries (n_rows, n_columns) of the equations; rows are 2 * element + component."""
        elements, index = distinct(rows // 2)
        by_column = self._fields(self.points[elements], elements, columns).T
        chosen = 2 * index + rows % 2
        if chosen.size < by_column.shape[1] or np.any(np.diff(chosen) != 1):
            by_column = by_column.take(chosen, axis=1)
        return by_column.T

    def fields(self, x: ComplexArray, columns: IntArray) -> FloatArray:
        """Return the displacements (2 n_points, n_columns) of columns at points that are no midpoints."""
        return self._fields(x, np.full(x.size, NOWHERE), columns)

    def under_forces(self, x: ComplexArray, rows: IntArray) -> FloatArray:
        """Return the displacements (2 n_points, n_rows) at rows under forces 8 pi mu (1 - nu) along x and y.

        The unit of length in the logarithm is the mean distance of the forces from their centre.
        """
        elements, index = distinct(rows // 2)
        nu, log_length = self.constants.poisson_ratio, float(np.abs(x - x.mean()).mean())
        return point_forces(self.points[elements], x, nu, log_length)[:, 2 * index + rows % 2]

    def residual(self, elements: IntArray, traction: FloatArray, displacement: FloatArray) -> FloatArray:
        """Return (1/2 + T) u - U t, (n, 2), at the midpoints of some elements, for fields (n_elements, 2)."""
        densities = self.densities(traction, displacement)
        result = np.zeros(elements.size, complex)
        sources = np.arange(self.start.size)
        for begin in range(0, sources.size, _ELEMENTS):
            result += self.potential(elements, sources[begin : begin + _ELEMENTS], densities)
        return np.stack([result.real, result.imag], axis=1) + 0.5 * displacement[elements]

    def potential(self, nodes: IntArray, elements: IntArray, densities: Densities) -> ComplexArray:
        """Return the complex T u - U t (n_nodes,) at some midpoints from densities on some elements, ascending.

        On the element of a midpoint, T is a principal value.
        """
        t, u, s = (density[elements] for density in densities)
        all_elements, one_column = np.arange(elements.size)[None], np.zeros(1, np.intp)
        weights, x = (-t[None, :, None], np.stack([u, s], axis=1)[None]), self.points[nodes]
        single, double = (
            self._layer(is_double, x, nodes, elements, Unknowns(all_elements, weight, one_column))[0]
            for is_double, weight in zip((False, True), weights, strict=True)
        )
        return np.asarray(single + double)

    def densities(self, traction: FloatArray, displacement: FloatArray) -> Densities:
        """Return the densities (n,) of tractions and displacements (n, 2)."""
        t, u = (field[:, 0] + 1j * field[:, 1] for field in (traction, displacement))
        mean, slope = np.zeros((2, u.size), complex)
        for elements, weights in zip(self.acted_on.T, self.reconstruction.transpose(1, 2, 0), strict=True):
            # no index occurs twice: different elements have different neighbours
            mean[elements] += weights[0] * u
            slope[elements] += weights[1] * u
        return t, mean, slope

    def _fields(self, x: ComplexArray, centred_on: IntArray, columns: IntArray) -> FloatArray:
        """Return the displacements of columns at points, (2 n_points, n_columns), by 2 * point + component.

        Each point is the midpoint of the element in `centred_on`, or of none (`NOWHERE`).
        """
        is_double = (columns // 2) % 2 == 1
        if is_double.any() == is_double.all():
            return self._of_kind(x, centred_on, columns, bool(is_double.any())).view(float).T
        result = np.empty((columns.size, x.size), complex)
        for of_kind, chosen in ((False, ~is_double), (True, is_double)):
            result[chosen] = self._of_kind(x, centred_on, columns[chosen], of_kind)
        return result.view(float).T

    def _of_kind(self, x: ComplexArray, centred_on: IntArray, columns: IntArray, is_double: bool) -> ComplexArray:
        """Return the displacements (n_columns, n_points) of columns that are all tractions or all displacements."""
        elements, index = distinct(columns // 4)
        components = 2 * index + columns % 2
        sources, unknowns = self._unknowns(elements, components, is_double)
        result = self._layer(is_double, x, centred_on, sources, unknowns)
        # the jump 1/2 of the double layer
        index_at = positions_of(centred_on, elements) if is_double else np.zeros(0, np.intp)
        points = np.flatnonzero(index_at >= 0)
        for component, jump in enumerate((0.5, 0.5j)):
            column = positions_of(2 * index_at[points] + component, components)
            result[column[column >= 0], points[column >= 0]] += jump
        return result

    def _layer(
        self, is_double: bool, x: ComplexArray, centred_on: IntArray, elements: IntArray, unknowns: Unknowns
    ) -> ComplexArray:
        """Return the displacements (n_columns, n_points) of unknowns on some elements, ascending; see `Layer`."""
        curved, centred_on = self.curved, positions_of(centred_on, elements)
        if curved is not None:
            return combined(
                lambda points: curved.factors(is_double, x[points], centred_on[points], elements),
                (elements.size, x.size),
                unknowns,
            )
        ends = self.start[elements], self.end[elements]
        return self.layer(self.constants, is_double, x, centred_on, ends, unknowns)

    def _unknowns(self, elements: IntArray, columns: IntArray, is_double: bool) -> tuple[IntArray, Unknowns]:
        """Return the elements on which unknowns (n,) of one kind act, ascending, and the unknowns on these."""
        if not is_double:
            return elements, Unknowns(
                np.arange(elements.size)[:, None], np.full((elements.size, 1, 1), -1.0 + 0j), columns
            )
        sources, index = np.unique(self.acted_on[elements], return_inverse=True)
        return sources, Unknowns(index.reshape(self.acted_on[elements].shape), self.reconstruction[elements], columns)


def collocation_equations(
    mesh: BoundaryMesh, material: Material, order: IntArray, *, takes_slopes: bool, layer: Layer | None = None
) -> CollocationEquations | FoldedEquations:
    """Return the equations of a body with or without lines of symmetry; see `CollocationEquations`."""
    border = collocation_border(mesh, material, order, takes_slopes=takes_slopes)
    if mesh.symmetry is None:
        return CollocationEquations(mesh, material, order, border, takes_slopes=takes_slopes, layer=layer)
    from bemkit.operators.collocation.images import FoldedEquations

    images = mesh.symmetry.images
    with_images = (np.arange(len(images))[:, None] * mesh.n_elements + order).ravel()
    whole = CollocationEquations(
        mesh.whole, material, with_images, border, takes_slopes=takes_slopes, layer=layer, log_length=mesh.diameter
    )
    return FoldedEquations(whole, border, images)


def displacement_rows(
    equations: CollocationEquations | FoldedEquations, nodes: IntArray, value_of_one: float
) -> FloatArray:
    """Return all displacement columns (2 n_rows, 2 n) at some nodes, with exact values for translations.

    The midpoint of an element of length h has a relative round-off of eps / h, which the tractions there divide by h
    again. So the diagonal block of a node is chosen such that a translation has its exact value.

    Parameters
    ----------
    equations : CollocationEquations or FoldedEquations
    nodes : (n_rows,) array
        Ascending.
    value_of_one : float
        Value of a unit translation: 0 for a body, 1 for an exterior.
    """
    n, rows = equations.points.size, (2 * nodes[:, None] + np.arange(2)).ravel()
    columns = (4 * np.arange(n)[:, None] + np.array([2, 3])).ravel()
    # transposed, as blocks are stored: (2 n, 2 n_rows)
    if isinstance(equations, CollocationEquations):
        parts = [equations.block(rows, columns).T]
        by_column = parts[0]
    else:
        parts = [block.T for block in equations.image_blocks(rows, columns)]
        by_column = np.sum(
            [part * signs[columns % 2, None] for part, signs in zip(parts, equations.images, strict=True)], axis=0
        )
    sums = np.sum([part.reshape(n, 2, -1).sum(axis=0) for part in parts], axis=0).reshape(2, -1, 2)
    blocks = by_column.reshape(n, 2, nodes.size, 2)
    blocks[nodes, :, np.arange(nodes.size)] += value_of_one * np.eye(2) - sums.transpose(1, 0, 2)
    return np.asarray(by_column.T)


def distinct(values: IntArray) -> tuple[IntArray, IntArray]:
    """Return the distinct values of an ascending array, and the index of each value among them."""
    is_first = np.append(True, values[1:] != values[:-1])[: values.size]
    return values[is_first], np.cumsum(is_first) - 1


def positions_of(values: IntArray, ascending: IntArray) -> IntArray:
    """Return the positions of values in an ascending array; `NOWHERE` for values that it does not contain."""
    if not ascending.size:
        return np.full_like(values, NOWHERE)
    position = np.searchsorted(ascending, values)
    return np.where(ascending[np.minimum(position, ascending.size - 1)] == values, position, NOWHERE)


def _curved(geometry: ElementGeometry, material: Material, order: IntArray, log_length: float) -> CurvedElements | None:
    if geometry.curved is None:
        return None
    from bemkit.operators.collocation.curved_elements import CurvedElements

    return CurvedElements(geometry, material, order, log_length)


def collocation_border(mesh: BoundaryMesh, material: Material, order: IntArray, *, takes_slopes: bool) -> Border:
    """Return the equations of resultants and reciprocities, and their errors, for elements in an order.

    Resultants are scaled to displacements, so that all equations have one size and are solved to round-off.
    """
    n = mesh.n_elements
    motions = traction_free_modes(mesh, mesh.centres)
    reciprocity = Reciprocity(mesh, material, takes_slopes=takes_slopes)
    compliance = 1.0 / (8.0 * np.pi * material.shear_modulus * (1.0 - material.effective_poisson_ratio))
    on_traction = np.concatenate([motions.T * (compliance * np.repeat(mesh.lengths, 2)), reciprocity.on_traction])
    on_displacement = np.concatenate([np.zeros(motions.T.shape), reciprocity.on_displacement])
    errors = np.column_stack([motions, reciprocity.fields])
    k = errors.shape[1]
    balances = np.concatenate([on_traction.reshape(k, n, 2), -on_displacement.reshape(k, n, 2)], axis=2)[:, order]
    return Border(errors.reshape(n, 2, k)[order].reshape(2 * n, k), balances.reshape(k, 4 * n))


def _reconstruction(
    mesh: BoundaryMesh, geometry: ElementGeometry, order: IntArray, *, takes_slopes: bool
) -> tuple[IntArray, ComplexArray]:
    """Return the elements on which each element acts, (n, k), with constant parts and slopes there, (n, k, 2)."""
    n = order.size
    if not takes_slopes:
        return np.arange(n)[:, None], np.tile(np.array([1.0 + 0j, 0.0]), (n, 1, 1))
    position, gradients = np.empty(n, np.intp), GradientReconstruction(mesh, geometry)
    position[order] = np.arange(n)
    return position[gradients.acted_on[order]], gradients.weights[order]


def point_forces(x: ComplexArray, sources: ComplexArray, poisson_ratio: float, log_length: float) -> FloatArray:
    """Return the displacements of forces 8 pi mu (1 - nu) along x and y.

    Parameters
    ----------
    x : (n_points,) complex array
    sources : (n_sources,) complex array
    poisson_ratio, log_length : float

    Returns
    -------
    (2 n_sources, 2 n_points) array
        Indices are 2 * source + component of the force and 2 * point + component of the displacement.
    """
    kappa = 3.0 - 4.0 * poisson_ratio
    arm = x - sources[:, None]
    squared = np.square(arm.real) + np.square(arm.imag)
    log = (-0.5 * kappa) * np.log(squared / log_length**2)
    inverse = arm / squared
    result = np.stack([log + arm.real * inverse, 1j * log + arm.imag * inverse], axis=1)
    return result.reshape(2 * sources.size, x.size).view(float)
