r"""Fields inside a body from its boundary data, by the representation formula u = V t - K u [Somigliana1885].

With complex displacements u = u_x + i u_y and z = x + i y, the formula is differentiated under the integral sign:

    2 mu du/dz     = kappa Phi - conj(Phi)      (dilatation and rotation)
    2 mu du/dzbar  = D                          (shears)
    sigma_xx + sigma_yy = 4 Re Phi,    sigma_xx - sigma_yy + 2 i sigma_xy = 2 D

[Muskhelishvili1953], where Phi and D are boundary integrals of the tractions and displacements. There is no division by
1 - 2 nu, so stresses hold for incompressible materials.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property, partial
from math import comb
from typing import NamedTuple

import numpy as np

from bemkit.arrays import BoolArray, ComplexArray, FloatArray, IntArray
from bemkit.errors import GeometryError, InputError
from bemkit.geometry.curves import scaled_curve
from bemkit.geometry.local_values import values_on_elements
from bemkit.geometry.mesh import BoundaryMesh
from bemkit.geometry.proximity.cluster_tree import Pairs
from bemkit.geometry.proximity.location import Location, Locator, PointNotInsideError
from bemkit.geometry.quadrature import gauss_legendre
from bemkit.geometry.spaces import BoundarySpace, local_coefficients
from bemkit.operators.element_geometry import ElementGeometry
from bemkit.operators.integrals.splitting import SEPARATION, split_until
from bemkit.operators.kernels import legendre_values
from bemkit.operators.material import Material
from bemkit.operators.somigliana.far_fields import FarFields
from bemkit.operators.somigliana.point_sources import N_POINTS, BoundaryData, GaussData, Sources, layer_sources
from bemkit.operators.somigliana.potentials import Background, PotentialFields, as_points
from bemkit.operators.somigliana.straight_fields import CENTRE, END, START, StraightFields
from bemkit.threads import for_each_chunk

CHUNK_PAIRS = 8192
"""Pairs of points and near elements that are integrated at a time."""
CHUNK_POINTS = 8192
"""Points that are evaluated at a time with series."""
_INTEGRALS = 400
"""Number of integrals that take as long as a point."""
MOST_ELEMENTS, FEW_POINTS = 300, 30
"""Largest number of elements, or of points, for which all pairs are integrated without series."""


class _Kind(NamedTuple):
    """Fields (n_fields, n) of straight elements, point sources and far clusters."""

    n_fields: int
    of_straight: Callable[[ComplexArray, IntArray, ComplexArray], ComplexArray]
    of_sources: Callable[[Sources, ComplexArray], ComplexArray]
    of_clusters: Callable[[FarFields, ComplexArray, ComplexArray, list[Pairs]], ComplexArray]


class InteriorFields(PotentialFields):
    """Displacement, its gradient, strain and stress at points inside a body.

    Parameters
    ----------
    mesh : BoundaryMesh
    material : Material
    displacement_space : BoundarySpace
        Any space, continuous or not.
    displacement_dofs : (n_scalar, 2) array [m]
        Boundary displacements.
    traction_space : BoundarySpace
    traction_dofs : (n_scalar, 2) array [Pa]
        Boundary tractions, stress @ n with the outward normal n.
    background : Background, optional
        Field to be added; the boundary data exclude it.

    Raises
    ------
    GeometryError
        If a space is defined on another mesh.
    ValueError
        If the dofs have the wrong shape or are not finite.

    Notes
    -----
    Points must lie strictly inside the body, see `is_inside`; any other point raises `PointNotInsideError`. Fields
    outside of a closed boundary vanish at infinity, up to the logarithm of a resultant force.

    Integrals are exact to round-off: straight elements are integrated in closed form, curved elements by a rule that
    depends on the distance d of the point, and the displacement of the nearest boundary point is subtracted before
    strongly singular kernels act. On straight sides this holds at any distance; near curved elements stresses have
    round-off of eps L / d, with the diameter L of the body.

    The result is the exact field of the given piecewise polynomials; the boundary data limit the accuracy. At a node
    between elements where the data jump or kink, stresses grow like log(d) (jumps of tractions, kinks of displacements)
    or 1 / d (jumps of displacements). Within about one element length of the boundary, evaluate stresses of discrete
    solutions opposite the midpoints of elements.
    """

    def __init__(
        self,
        mesh: BoundaryMesh,
        material: Material,
        displacement_space: BoundarySpace,
        displacement_dofs: FloatArray,
        traction_space: BoundarySpace,
        traction_dofs: FloatArray,
        background: Background | None = None,
    ) -> None:
        self.mesh = mesh
        self.background = background
        self.material = material
        self._displacement = _element_polynomials(mesh, displacement_space, displacement_dofs, "displacement")
        self._traction = _element_polynomials(mesh, traction_space, traction_dofs, "traction")
        self._locator = Locator(mesh)
        centre = (float(mesh.centre[0]), float(mesh.centre[1]))
        curves = tuple(scaled_curve(curve, centre, (1.0, 1.0)) for curve in mesh.curves)
        about_centre = mesh.unchecked_copy(mesh.nodes - mesh.centre, curves)
        self.geometry = ElementGeometry(about_centre)
        self._straight = StraightFields(self.geometry, material, self._displacement, self._traction, mesh.diameter)
        self._data = BoundaryData(about_centre, self._displacement[CENTRE], self._traction[CENTRE])

    def is_inside(self, points: FloatArray) -> BoolArray:
        """Return the (n,) mask of the (n, 2) points [m] that lie strictly inside the body."""
        return self._locator.locate(as_points(points)).is_inside

    def displacement(self, points: FloatArray) -> FloatArray:
        """Evaluate the displacement (n, 2) [m] at points (n, 2) [m]."""
        points, reference = self._located(points)
        kappa, two_mu, length = self.material.kappa, 2.0 * self.material.shear_modulus, self.mesh.diameter
        kind = _Kind(
            1,
            self._straight.displacements,
            lambda sources, z: sources.displacements(z, kappa, length)[None] / two_mu,
            FarFields.displacements,
        )
        # the representation of a constant displacement c is c in a bounded body, and zero in an exterior
        result = self._summed(points, reference, kind)[0]
        if not self.mesh.is_exterior:
            result += reference
        displacement = np.column_stack([result.real, result.imag])
        return displacement if self.background is None else displacement + self.background.displacement(points)

    def potentials(self, points: FloatArray) -> tuple[ComplexArray, ComplexArray]:
        """Return Phi and D (n,) [Pa]."""
        points, reference = self._located(points)
        kappa = self.material.kappa
        kind = _Kind(
            2,
            self._straight.gradients,
            lambda sources, z: np.stack(sources.gradients(z, kappa)),
            FarFields.gradients,
        )
        potential, shear = self._summed(points, reference, kind)
        return potential, shear

    def _located(self, points: FloatArray) -> tuple[FloatArray, ComplexArray]:
        """Return points inside the body, and the displacements (n,) of their nearest boundary points."""
        points = as_points(points)
        location = self._locator.locate(points)
        _require_inside(location, points)
        polynomials = legendre_values(self._displacement.shape[2] - 1, location.xi)
        return points, np.asarray(np.einsum("nk,kn->n", self._displacement[CENTRE, location.element], polynomials))

    @cached_property
    def _far(self) -> FarFields:
        return FarFields(self._locator.clusters, self._data, self.material, self.mesh.diameter)

    def _summed(self, points: FloatArray, reference: ComplexArray, kind: _Kind) -> ComplexArray:
        """Return the fields of all elements at points, (n_fields, n_points)."""
        relative = points - self.mesh.centre
        x = relative[:, 0] + 1j * relative[:, 1]
        n = self.mesh.n_elements
        is_dense = n <= MOST_ELEMENTS or x.size <= FEW_POINTS
        far = None if is_dense else self._far

        def of_points(rows: slice) -> ComplexArray:
            chunk, subtracted = x[rows], reference[rows]
            if far is None:
                pairs = np.repeat(np.arange(chunk.size), n), np.tile(np.arange(n), chunk.size)
                return self._of_pairs(chunk, subtracted, pairs, kind)
            far_pairs, pairs = far.divided(chunk)
            near_fields = self._of_pairs(chunk, subtracted, pairs, kind)
            return near_fields + kind.of_clusters(far, chunk, subtracted, far_pairs)

        step = max(1, CHUNK_PAIRS // n) if is_dense else CHUNK_POINTS
        chunks = [slice(first, first + step) for first in range(0, max(1, x.size), step)]
        return np.concatenate(for_each_chunk(of_points, chunks, n_integrals=_INTEGRALS * x.size), axis=1)

    def _of_pairs(self, x: ComplexArray, reference: ComplexArray, pairs: Pairs, kind: _Kind) -> ComplexArray:
        """Return the fields of elements at near points, from pairs of points (ascending) and elements."""
        points, elements = pairs
        is_straight = self.mesh.is_straight[elements]
        result: ComplexArray = np.zeros((kind.n_fields, x.size), complex)
        on_arcs = partial(self._on_arcs, kind)
        for chosen, terms in ((np.flatnonzero(is_straight), kind.of_straight), (np.flatnonzero(~is_straight), on_arcs)):
            for begin in range(0, chosen.size, CHUNK_PAIRS):
                chunk = chosen[begin : begin + CHUNK_PAIRS]
                point, element = points[chunk], elements[chunk]
                result = result + _at_points(terms(x[point], element, reference[point]), point, x.size)
        return result

    def _on_arcs(self, kind: _Kind, x: ComplexArray, element: IntArray, reference: ComplexArray) -> ComplexArray:
        """Return the contribution of curved elements, bisected until each piece is away from its point."""
        data = self._data

        def is_away(pair: IntArray, low: FloatArray, high: FloatArray) -> BoolArray:
            y, slope = data.points(element[near[pair]], 0.5 * (low + high)[:, None])
            away: BoolArray = np.abs(x[near[pair]] - y[:, 0]) >= 0.5 * SEPARATION * (high - low) * np.abs(slope[:, 0])
            return away

        is_far = np.abs(x - self.geometry.centre[element]) >= SEPARATION * self.geometry.half[element]
        far, near = np.flatnonzero(is_far), np.flatnonzero(~is_far)
        piece, low, high = split_until(is_away, near.size, -1.0, 1.0)
        xi, weights = gauss_legendre(N_POINTS + data.highest // 2)
        middle, half = 0.5 * (low + high)[:, None], 0.5 * (high - low)[:, None]
        on_pieces = data.at(element[near[piece]], middle + half * xi, half * weights)
        on_wholes = (values[element[far]] for values in self._on_all_elements)
        result: ComplexArray = np.zeros((kind.n_fields, x.size), complex)
        for pair, (y, dy, traction, displacement) in ((far, on_wholes), (near[piece], on_pieces)):
            sources = layer_sources(y, dy, traction, displacement - reference[pair, None], self.material)
            result = result + _at_points(kind.of_sources(sources, x[pair, None]).sum(axis=-1), pair, x.size)
        return result

    @cached_property
    def _on_all_elements(self) -> GaussData:
        """The data at the Gauss points of all elements."""
        rule = gauss_legendre(N_POINTS + self._data.highest // 2)
        return self._data.at(np.arange(self.mesh.n_elements), *rule)


def _at_points(terms: ComplexArray, point: IntArray, n_points: int) -> ComplexArray:
    """Sum the terms (n_fields, n_pairs) of each point."""
    result = np.empty((len(terms), n_points), complex)
    for total, field in zip(result, terms, strict=True):
        total.real, total.imag = (np.bincount(point, part, n_points) for part in (field.real, field.imag))
    return result


def _require_inside(location: Location, points: FloatArray) -> None:
    outside = np.flatnonzero(~location.is_inside)
    if outside.size:
        first = int(outside[0])
        relation = "on the boundary of" if location.is_on_boundary[first] else "outside of"
        raise PointNotInsideError(
            f"point {first} at ({points[first, 0]:.9g}, {points[first, 1]:.9g}) lies {relation} the body "
            f"({outside.size} of {len(points)} points do not lie inside): select points with is_inside(points)"
        )


def _element_polynomials(mesh: BoundaryMesh, space: BoundarySpace, dofs: FloatArray, name: str) -> ComplexArray:
    """Return the complex coefficients (3, n_elements, degree + 1) of a boundary field.

    The first axis is Legendre polynomials, powers about the start, powers about the end.
    """
    if space.mesh is not mesh:
        raise GeometryError(
            f"{name}_space is defined on another mesh: build it on the BoundaryMesh object given as mesh"
        )
    dofs = np.asarray(dofs, dtype=np.float64)
    shape = (space.n_dofs // 2, 2)
    if dofs.shape != shape or not np.isfinite(dofs).all():
        raise InputError(
            f"{name}_dofs has the shape {dofs.shape}{'' if dofs.shape != shape else ' and is not finite'}: "
            f"give {shape} finite numbers, one row for each scalar dof"
        )
    on_elements = values_on_elements(space, dofs) @ np.array([1.0, 1j])
    coefficients: ComplexArray = on_elements @ local_coefficients(space)
    result = np.zeros((3, *coefficients.shape), complex)
    result[CENTRE] = coefficients
    n = range(space.degree + 1)
    for origin, e in ((START, -1.0), (END, 1.0)):  # P_k about an end [DLMF, 18.5.7]
        result[origin] = coefficients @ [[e ** (k + j) * comb(k, j) * comb(k + j, j) / 2.0**j for j in n] for k in n]
    # the exact value at the node, so that two elements have the same value there
    result[[START, END], :, 0] = (on_elements @ space.basis(np.array([-1.0, 1.0]))).T
    return result
