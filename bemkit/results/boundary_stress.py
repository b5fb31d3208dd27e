"""Stress on the boundary of a solved body, from the traction and the strain along the boundary by Hooke's law."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt
from numpy.polynomial import legendre

from bemkit.arrays import BoolArray, FloatArray, IntArray
from bemkit.geometry.local_values import mean_tractions, values_on_elements
from bemkit.geometry.mesh import BoundaryMesh
from bemkit.geometry.neighbours import corner_nodes
from bemkit.geometry.proximity.location import Location, Locator, PointNotInsideError
from bemkit.geometry.spaces import BoundarySpace, ElementwiseSpace, local_coefficients
from bemkit.geometry.symmetry.images import reflected_to_whole
from bemkit.geometry.vectors import turned_right
from bemkit.operators.material import Material
from bemkit.operators.somigliana.fields import InteriorFields
from bemkit.operators.somigliana.potentials import PotentialFields, as_points
from bemkit.scene.discretisation import on_whole_body

if TYPE_CHECKING:
    from bemkit.model.particular import ParticularFields
    from bemkit.scene.body_scene import BodyScene


@dataclass(frozen=True, eq=False)
class BoundaryStress:
    """Stress at points of elements.

    Parameters
    ----------
    mesh : BoundaryMesh
        The whole boundary, with its images by symmetry.
    material : Material
    space : BoundarySpace
        Of the displacement.
    displacement : (n_scalar, 2) array [m]
    traction_space : BoundarySpace
    traction : (n_scalar, 2) array [Pa]
        Both less the particular solution.
    particular : ParticularFields, optional
        Particular solution of the body forces.
    far_strain : float [-]
        Along the surface of a half-plane, far below it.

    Notes
    -----
    In the local frame the traction gives sigma_nn and sigma_nt, and the strain e along the boundary gives

        sigma_tt = E' e + nu / (1 - nu) sigma_nn    (nu the effective Poisson ratio, E' the plane modulus),

    exactly for the displacements and tractions of the discrete solution.
    """

    mesh: BoundaryMesh
    material: Material
    space: BoundarySpace
    displacement: FloatArray
    traction_space: BoundarySpace
    traction: FloatArray
    particular: ParticularFields | None = None
    far_strain: float = 0.0

    @classmethod
    def from_half(
        cls,
        mesh: BoundaryMesh,
        scene: BodyScene,
        displacement: FloatArray,
        traction_dofs: FloatArray,
        particular: ParticularFields | None,
    ) -> BoundaryStress:
        """Return the stress on the whole boundary from the fields on one side of symmetry lines."""
        discretisation, of_whole = scene.discretisation, on_whole_body(scene.discretisation, mesh)
        space, half_space = of_whole.displacement_space(mesh.whole), discretisation.displacement_space(mesh)
        tractions = ElementwiseSpace(of_whole.traction_space(mesh.whole))
        half_tractions = ElementwiseSpace(discretisation.traction_space(mesh))
        fields = (
            *(space, reflected_to_whole(half_space, space, displacement)),
            *(tractions, reflected_to_whole(half_tractions, tractions, traction_dofs)),
        )
        far_strain = 0.0 if scene.far is None else scene.far.strain
        return cls(mesh.whole, scene.material, *fields, particular, far_strain)

    @cached_property
    def interior(self) -> PotentialFields:
        """The fields inside the body, or below the surface of a half-plane."""
        if self.mesh.surface is not None:
            return self._below_surface
        boundary_data = (self.space, self.displacement, self.traction_space, self.traction)
        return InteriorFields(self.mesh, self.material, *boundary_data, self.particular)

    @property
    def _below_surface(self) -> PotentialFields:
        from bemkit.operators.half_plane.fields import HalfPlaneFields

        tractions = self.traction[self.traction_space.element_dofs]
        displacements = values_on_elements(self.space, self.displacement)
        means = mean_tractions(self.traction_space, tractions), mean_tractions(self.space, displacements)
        return HalfPlaneFields(self.mesh, self.material, *means, self.far_strain)

    def at(self, elements: IntArray, xi: FloatArray) -> FloatArray:
        """Return the stress (m, q, 2, 2) [Pa] on (m,) elements at (q,) or (m, q) local coordinates."""
        xi = np.broadcast_to(xi, (elements.size, np.shape(xi)[-1]))
        normals = self.mesh.normals_at(elements, xi)
        tangents = -turned_right(normals)
        basis = self.traction_space.basis(xi.ravel()).reshape(-1, *xi.shape)
        t = np.einsum("lmq,mlc->mqc", basis, self.traction[self.traction_space.element_dofs[elements]])
        strain = np.sum(self._derivative(elements, xi) * tangents, axis=2)
        normal, shear = np.sum(t * normals, axis=2), np.sum(t * tangents, axis=2)
        ratio = self.material.effective_poisson_ratio
        along = self.material.plane_modulus * strain + ratio / (1.0 - ratio) * normal
        frame = np.stack([normals, tangents], axis=2)
        local = np.stack([np.stack([normal, shear], axis=2), np.stack([shear, along], axis=2)], axis=3)
        stress = np.asarray(np.einsum("eqki,eqkl,eqlj->eqij", frame, local, frame))
        if self.particular is not None:
            points = self.mesh.points(elements, xi).reshape(-1, 2)
            stress = stress + self.particular.stress(points).reshape(stress.shape)
        return stress

    def displacement_at(self, elements: IntArray, xi: FloatArray) -> FloatArray:
        """Return the displacement (m, q, 2) [m] on (m,) elements at (q,) or (m, q) local coordinates."""
        xi = np.broadcast_to(xi, (elements.size, np.shape(xi)[-1]))
        at_nodes = values_on_elements(self.space, self.displacement, elements)
        basis = self.space.basis(xi.ravel()).reshape(-1, *xi.shape)
        result = np.asarray(np.einsum("pmq,mpc->mqc", basis, at_nodes))
        if self.particular is not None:
            points = self.mesh.points(elements, xi).reshape(-1, 2)
            result = result + self.particular.displacement(points).reshape(result.shape)
        return result

    def _derivative(self, elements: IntArray, xi: FloatArray) -> FloatArray:
        """Return the derivative (m, q, 2) of the displacement along the boundary."""
        if not self.space.is_continuous:
            return self._derivative_between_centres(elements, xi)
        highest = self.space.degree
        slopes = legendre.legder(local_coefficients(self.space), axis=1) @ np.moveaxis(
            legendre.legvander(xi, highest - 1), -1, 0
        ).reshape(highest, -1)
        at_nodes = values_on_elements(self.space, self.displacement, elements)
        derivative = np.einsum("pmq,mpc->mqc", slopes.reshape(-1, *xi.shape), at_nodes)
        return np.asarray(derivative / self.mesh.jacobian(elements, xi)[..., None])

    def _derivative_between_centres(self, elements: IntArray, xi: FloatArray) -> FloatArray:
        """Differentiate the parabola in the arc length through the centre of an element and two others beside it."""
        mesh = self.mesh
        (first, s_first), (second, s_second) = _stencils(mesh, elements)
        u = self.displacement[self.space.element_dofs[:, 0]]
        slope_first, slope_second = (
            (u[other] - u[elements]) / np.where(s == 0.0, 1.0, s)[:, None]
            for other, s in ((first, s_first), (second, s_second))
        )
        # Newton's divided differences; with one neighbour the chord to it, with none zero
        has_two = (s_second != 0.0) & (s_first != s_second)
        bend = (slope_first - slope_second) / np.where(has_two, s_first - s_second, 1.0)[:, None]
        bend = np.where(has_two[:, None], bend, 0.0)
        s = 0.5 * xi * mesh.lengths[elements, None]
        return np.asarray((slope_first - bend * s_first[:, None])[:, None] + 2.0 * s[..., None] * bend[:, None])


def _stencils(mesh: BoundaryMesh, elements: IntArray) -> list[tuple[IntArray, FloatArray]]:
    """Return two elements (m,) beside each, and the arc lengths (m,) [m] from its centre to theirs, negative before it.

    They do not lie beyond corners; where there is none, it is the element itself.
    """
    before, to_before = _beside(mesh, elements, 0)
    after, to_after = _beside(mesh, elements, 1)
    (far_before, to_far_before), (far_after, to_far_after) = _beside(mesh, before, 0), _beside(mesh, after, 1)
    has_before, has_both = before != elements, (before != elements) & (after != elements)
    first = np.where(has_before, before, after), np.where(has_before, to_before, to_after)
    second = np.where(has_before, far_before, far_after)
    to_second = np.where(has_before, to_before + to_far_before, to_after + to_far_after)
    return [first, (np.where(has_both, after, second), np.where(has_both, to_after, to_second))]


def _beside(mesh: BoundaryMesh, elements: IntArray, way: int) -> tuple[IntArray, FloatArray]:
    """Return the elements (m,) before or after others, and the arc lengths [m] to their centres; see `_stencils`."""
    nodes = mesh.elements[elements, way]
    others = np.where(corner_nodes(mesh)[nodes], elements, mesh.node_elements[nodes, way])
    distance = (-0.5, 0.5)[way] * (mesh.lengths[elements] + mesh.lengths[others])
    return others, np.where(others == elements, 0.0, distance)


_END = 1e-9
"""Distance from the end of an element, in its local coordinate, within which a point counts as the node."""


def stress_at(boundary: BoundaryStress, points: npt.ArrayLike, part: str | None = None) -> FloatArray:
    """Evaluate the stress inside a body and on its boundary; see `SolvedBody.stress`."""
    points = as_points(np.atleast_2d(np.asarray(points, float)))
    mesh = boundary.mesh
    location = Locator(mesh).locate(points)
    is_known = location.is_on_boundary | (boundary.interior.is_inside(points) & (part is None))
    if part is not None:
        mesh.part(part)  # unknown names are refused
    _require(is_known, points, "outside of the body" if part is None else "off the boundary", part)
    stress = np.zeros((len(points), 2, 2))
    inside = np.flatnonzero(~location.is_on_boundary)
    if inside.size:
        stress[inside] = boundary.interior.stress(points[inside])
    at, element, xi = _places(mesh, location)
    if part is not None:
        is_of_part = np.isin(element, mesh.part(part))
        at, element, xi = at[is_of_part], element[is_of_part], xi[is_of_part]
    counts = np.bincount(at, minlength=len(points))
    _require(~location.is_on_boundary | (counts > 0), points, f"on the boundary, off part {part!r}", part)
    if at.size:  # at a node the mean of the elements that meet there
        np.add.at(stress, at, boundary.at(element, xi[:, None])[:, 0] / counts[at, None, None])
    return stress


def displacement_at(boundary: BoundaryStress, points: npt.ArrayLike) -> FloatArray:
    """Evaluate the displacement inside a body and on its boundary; see `SolvedBody.displacement`."""
    points = as_points(np.atleast_2d(np.asarray(points, float)))
    location = Locator(boundary.mesh).locate(points)
    is_known = location.is_on_boundary | boundary.interior.is_inside(points)
    _require(is_known, points, "outside of the body", None)
    displacement = np.zeros((len(points), 2))
    inside, on_it = np.flatnonzero(~location.is_on_boundary), np.flatnonzero(location.is_on_boundary)
    if inside.size:
        displacement[inside] = boundary.interior.displacement(points[inside])
    if on_it.size:
        places = location.element[on_it], location.xi[on_it, None]
        displacement[on_it] = boundary.displacement_at(*places)[:, 0]
    return displacement


def _places(mesh: BoundaryMesh, location: Location) -> tuple[IntArray, IntArray, FloatArray]:
    """Return number, element and local coordinate of points on the boundary: two elements for each node."""
    at = np.flatnonzero(location.is_on_boundary)
    element, xi = location.element[at], location.xi[at]
    is_end, column = np.abs(xi) > 1.0 - _END, (xi > 0.0).astype(np.intp)
    # the element on the other side of the node: the one before the start, or after the end
    other = mesh.node_elements[mesh.elements[element, column], column]
    is_double = np.flatnonzero(is_end & (other != element))
    both = (np.concatenate([each, each[is_double]]) for each in (at, element, xi))
    at, element, xi = both
    element[at.size - is_double.size :] = other[is_double]
    xi[at.size - is_double.size :] *= -1.0
    return at, element, xi


def _require(is_known: BoolArray, points: FloatArray, place: str, part: str | None) -> None:
    wrong = np.flatnonzero(~is_known)
    if wrong.size:
        x, y = points[wrong[0]].tolist()
        allowed = "inside the body or on its boundary" if part is None else f"on part {part!r}"
        raise PointNotInsideError(
            f"point {wrong[0]} at ({x:.9g}, {y:.9g}) lies {place} ({wrong.size} of {len(points)} points): "
            f"give points {allowed}"
        )
