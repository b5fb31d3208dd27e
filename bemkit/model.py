"""From a scene to a dimensionless contact problem, and back to physical fields.

Inside, lengths are measured by the diameter of the body, stresses of the material by E', loads by their largest value
p and displacements by p L / E', so that nothing depends on the user's units, on where the body sits, or on how stiff
it is.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from itertools import zip_longest

import numpy as np

from bemkit.arrays import FloatArray, IntArray
from bemkit.contact.body import ContactState
from bemkit.contact.condensation import CondensedBody, ContactNodes, condense
from bemkit.contact.problem import ContactProblem
from bemkit.geometry.mesh import BoundaryMesh
from bemkit.geometry.order import along_boundary
from bemkit.geometry.quadrature import gauss_legendre
from bemkit.geometry.space import BoundarySpace, LinearSpace, QuadraticSpace, break_nodes, dof_points
from bemkit.operators.nodal import Support, supported
from bemkit.operators.steklov_poincare import CollocationMap, GalerkinMap, SteklovPoincare, TractionField
from bemkit.scene import (
    Clamped,
    ConstantCollocation,
    Contact,
    Part,
    PrescribedDisplacement,
    Pressure,
    QuadraticGalerkin,
    Roller,
    Scene,
    Traction,
)

_FARTHEST = 1e7
"""Distance from the origin in diameters up to which coordinates hold nine digits of the shape."""


class TooFarError(ValueError):
    """A body whose coordinates are so large that they no longer hold its shape."""


@dataclass(frozen=True)
class Units:
    """The physical size of one dimensionless unit.

    Parameters
    ----------
    centre : (2,) array [m]
        Where the dimensionless origin sits.
    length : float [m]
        Diameter of the body.
    modulus : float [Pa]
        E' of the material.
    stress : float [Pa]
        The largest load, or the stress that the largest prescribed displacement or interference suggests.
    """

    centre: FloatArray
    length: float
    modulus: float
    stress: float

    @property
    def displacement(self) -> float:
        """Unit of displacements and gaps [m]."""
        return self.stress / self.modulus * self.length

    def to_physical(self, points: FloatArray) -> FloatArray:
        """Return dimensionless points [-] in metres."""
        return self.centre + self.length * points


@dataclass(frozen=True, eq=False)
class Model:
    """A scene made ready to solve.

    Parameters
    ----------
    scene : Scene
    mesh : BoundaryMesh
        In physical units.
    units : Units
    elastic : SteklovPoincare
        Dimensionless.
    body : CondensedBody
    nodes : ContactNodes
    problem : ContactProblem
    """

    scene: Scene
    mesh: BoundaryMesh
    units: Units
    elastic: SteklovPoincare
    body: CondensedBody
    nodes: ContactNodes
    problem: ContactProblem

    def under(self, scene: Scene) -> Model:
        """Return the same body under the loads, obstacles and law of another scene; nothing is factored again.

        Parameters
        ----------
        scene : Scene
            Differs from this model's in numbers of its conditions, its law and its solver alone.

        Raises
        ------
        ValueError
            If the scene has another body, other parts, or other kinds of conditions.
        """
        _check_same_body(self.scene, scene)
        space = self.elastic.displacement_space
        prescribed = supported(space, _supports(scene, self.mesh, self.units, space)).displacement
        body = self.body.under(prescribed, _nodal_forces(scene, self.mesh, self.elastic, self.units))
        problem = _problem(scene, self.mesh, self.units, body, space)
        return replace(self, scene=scene, body=body, problem=problem)

    @property
    def places(self) -> tuple[tuple[str, ...], FloatArray]:
        """The part of each contact node and its arc length along it [m]; see `contact_places`."""
        return contact_places(self.scene, self.mesh, self.elastic.displacement_space, self.nodes)

    def boundary_fields(self, state: ContactState) -> tuple[FloatArray, FloatArray, float]:
        """Return the physical fields of a contact state on the whole boundary.

        Returns
        -------
        displacement : (n_nodes, 2) array [m]
        traction : (n_elements, 2) array [Pa]
            Mean of each element: given loads where they are given, contact tractions on the contact boundary,
            reactions elsewhere.
        energy : float [J/m]
            Elastic energy 1/2 a(u, u).
        """
        displacement, force = self.body.recover(state)
        traction = self.elastic.element_tractions(displacement, force)
        self._insert_contact(traction, state)
        traction *= self.units.stress
        for part, elements, _ in _parts(self.scene, self.mesh):
            if isinstance(part.condition, Traction | Pressure):
                traction[elements] = _mean_load(part.condition, self.mesh, elements)
        is_loose = np.ones(self.mesh.n_elements, bool)
        for _, elements, _ in _parts(self.scene, self.mesh):
            is_loose[elements] = False
        traction[is_loose] = 0.0
        energy = (
            0.5 * float(np.sum(displacement * force)) * self.units.stress * self.units.displacement * self.units.length
        )
        return displacement * self.units.displacement, traction, energy

    def _insert_contact(self, traction: FloatArray, state: ContactState) -> None:
        """Give each contact element the mean of the tractions that its nodes interpolate."""
        space = self.elastic.displacement_space
        at_nodes = np.zeros((space.n_dofs // 2, 2))
        at_nodes[self.nodes.nodes] = np.einsum("nk,nkc->nc", state.traction, self.nodes.frame)
        elements = contact_elements(self.scene, self.mesh)
        xi, weights = gauss_legendre(space.degree + 1)
        traction[elements] = np.einsum(
            "p,epc->ec", space.basis(xi) @ weights / 2.0, at_nodes[space.element_dofs[elements]]
        )


def build_model(scene: Scene, mesh: BoundaryMesh, units: Units | None = None) -> Model:
    """Assemble the operators of a scene and condense the body onto its contact boundary.

    Parameters
    ----------
    scene : Scene
    mesh : BoundaryMesh
        As made by `Scene.build_mesh`, or a refinement of it.
    units : Units, optional
        By default `find_units` of the scene.

    Returns
    -------
    Model

    Raises
    ------
    TooFarError
        If the body lies so far from the origin that its coordinates no longer hold its shape.
    ConflictingSupportsError, SingularMatrixError, ValueError
        If the supports contradict each other or do not hold the body even with glued contact, or an expression is not
        finite somewhere.
    """
    _check_position(mesh)
    units = find_units(scene, mesh) if units is None else units
    unit_mesh = mesh.transformed(shift=(float(mesh.centre[0]), float(mesh.centre[1])), factor=1.0 / units.length)
    elastic = _elastic_map(scene, unit_mesh, units)
    force = _nodal_forces(scene, mesh, elastic, units)
    supports = _supports(scene, mesh, units, elastic.displacement_space)
    body, nodes = condense(elastic, supports, contact_elements(scene, mesh), force)
    problem = _problem(scene, mesh, units, body, elastic.displacement_space)
    return Model(scene, mesh, units, elastic, body, nodes, problem)


def _check_position(mesh: BoundaryMesh) -> None:
    """Refuse a body so far from the origin that its coordinates hold too few digits of its shape."""
    distance = float(np.abs(mesh.nodes).max()) / mesh.diameter
    if distance > _FARTHEST:
        x, y = mesh.centre.tolist()
        raise TooFarError(
            f"the body lies {distance:.1e} times its size from the origin, where numbers hold fewer than nine digits "
            f"of its shape: subtract about ({x:.6g}, {y:.6g}) from all coordinates of body and obstacles"
        )


def _problem(
    scene: Scene, mesh: BoundaryMesh, units: Units, body: CondensedBody, space: BoundarySpace
) -> ContactProblem:
    parts, _ = contact_places(scene, mesh, space, body.nodes)
    law = scene.law_at(parts, dof_points(space, mesh)[body.nodes.nodes])
    return ContactProblem(body, _gap(scene, mesh, body.nodes, space, units), law.scaled(units.stress))


def _nodal_forces(scene: Scene, mesh: BoundaryMesh, elastic: SteklovPoincare, units: Units) -> FloatArray:
    force = np.zeros((elastic.displacement_space.n_dofs // 2, 2))
    for part, elements, _ in _parts(scene, mesh):
        if isinstance(part.condition, Traction | Pressure):
            force += elastic.nodal_forces(elements, _dimensionless_load(part.condition, units))
    return force


def contact_elements(scene: Scene, mesh: BoundaryMesh) -> IntArray:
    """Return the elements of all contact parts, in order along each."""
    return np.concatenate([along_boundary(mesh, mesh.part(part.name)) for part in scene.contact_parts])


def contact_places(
    scene: Scene, mesh: BoundaryMesh, space: BoundarySpace, nodes: ContactNodes
) -> tuple[tuple[str, ...], FloatArray]:
    """Return the part of each contact node and its arc length along it; a node of two parts belongs to the first.

    Returns
    -------
    parts : tuple of n_contact str
    arc_length : (n_contact,) array [m]
    """
    n_scalar = space.n_dofs // 2
    names: list[str] = [""] * n_scalar
    arc_length = np.full(n_scalar, np.nan)
    for part in scene.contact_parts:
        elements = along_boundary(mesh, mesh.part(part.name))
        lengths = mesh.lengths[elements]
        begin = np.concatenate([[0.0], np.cumsum(lengths)[:-1]])
        dofs = space.element_dofs[elements]
        s = begin[:, None] + 0.5 * lengths[:, None] * (space.local_nodes + 1.0)
        for dof, place in zip(dofs.ravel().tolist(), s.ravel().tolist(), strict=True):
            if not names[dof]:
                names[dof], arc_length[dof] = part.name, place
    return tuple(names[dof] for dof in nodes.nodes.tolist()), arc_length[nodes.nodes]


def _elastic_map(scene: Scene, mesh: BoundaryMesh, units: Units) -> SteklovPoincare:
    material = scene.material.scaled(units.modulus)
    if isinstance(scene.discretisation, ConstantCollocation):
        return CollocationMap(mesh, material)
    if isinstance(scene.discretisation, QuadraticGalerkin):
        return GalerkinMap(mesh, material, QuadraticSpace(mesh), LinearSpace(mesh, break_nodes(mesh)))
    return GalerkinMap(mesh, material)


def _check_same_body(scene: Scene, other: Scene) -> None:
    for name in ("shape", "material", "discretisation"):
        if getattr(scene, name) != getattr(other, name):
            raise ValueError(f"{name} is {getattr(other, name)}: keep {getattr(scene, name)}, or build a new model")
    for part, changed in zip_longest(scene.parts, other.parts):
        if part is None or changed is None or _layout(part) != _layout(changed):
            name = (part or changed).name
            raise ValueError(f"part {name!r} changes its place or its kind: change numbers only, or build a new model")


def _layout(part: Part) -> tuple[object, ...]:
    condition = part.condition
    components = condition.is_prescribed if isinstance(condition, PrescribedDisplacement) else ()
    return part.name, part.sides, part.where, type(condition), components


def _parts(scene: Scene, mesh: BoundaryMesh) -> list[tuple[Part, IntArray, FloatArray]]:
    """List the parts with their elements and the outward normals of these."""
    return [(part, mesh.part(part.name), mesh.normals[mesh.part(part.name)]) for part in scene.parts]


def find_units(scene: Scene, mesh: BoundaryMesh) -> Units:
    """Choose the units by the largest load, prescribed displacement or interference."""
    modulus, length = scene.material.plane_modulus, mesh.diameter
    stresses = [0.0]
    gaps = [0.0]
    for part, elements, normals in _parts(scene, mesh):
        points = mesh.points(elements, np.array([-1.0, 0.0, 1.0]))
        for k in range(points.shape[1]):
            if isinstance(part.condition, Traction | Pressure):
                stresses.append(float(np.abs(part.condition.at(points[:, k], normals)).max()))
            elif isinstance(part.condition, PrescribedDisplacement):
                stresses.append(float(np.abs(part.condition.at(points[:, k])).max()) / length * modulus)
            elif isinstance(part.condition, Contact):
                gap = part.condition.obstacle.gap(points[:, k], normals)
                # an overlap or gap below the round-off of the coordinates is no measure of anything
                gap = np.where(np.abs(gap) > 1e-18 * length, gap, 0.0)
                stresses.append(float(np.maximum(-gap, 0.0).max()) / length * modulus)
                gaps.append(float(np.abs(gap[np.isfinite(gap)]).max(initial=0.0)))
    stress = max(stresses) or max(gaps) / length * modulus or modulus
    return Units(mesh.centre, length, modulus, stress)


def _dimensionless_load(load: Traction | Pressure, units: Units) -> TractionField:
    def field(points: FloatArray, normals: FloatArray) -> FloatArray:
        return load.at(units.to_physical(points), normals) / units.stress

    return field


def _mean_load(load: Traction | Pressure, mesh: BoundaryMesh, elements: IntArray) -> FloatArray:
    xi, weights = gauss_legendre(5)
    points, normals = mesh.points(elements, xi), mesh.normals_at(elements, xi)
    values = [0.5 * weight * load.at(points[:, k], normals[:, k]) for k, weight in enumerate(weights)]
    mean: FloatArray = np.sum(values, axis=0)
    return mean


def _supports(scene: Scene, mesh: BoundaryMesh, units: Units, space: BoundarySpace) -> list[Support]:
    result = []
    for part, elements, _ in _parts(scene, mesh):
        condition = part.condition
        axes = np.broadcast_to(np.eye(2), (elements.size, 2, 2))
        if isinstance(condition, Roller):
            normals = mesh.normals_at(elements, space.local_nodes)
            result.append(Support(part.name, elements, normals[:, :, None, :]))
        elif isinstance(condition, Clamped):
            result.append(Support(part.name, elements, axes))
        elif isinstance(condition, PrescribedDisplacement):
            result.append(
                Support(
                    part.name, elements, axes[:, list(condition.is_prescribed)], _dimensionless_motion(condition, units)
                )
            )
    return result


def _dimensionless_motion(condition: PrescribedDisplacement, units: Units) -> Callable[[FloatArray], FloatArray]:
    def field(points: FloatArray) -> FloatArray:
        return condition.at(units.to_physical(points)) / units.displacement

    return field


def _gap(scene: Scene, mesh: BoundaryMesh, nodes: ContactNodes, space: BoundarySpace, units: Units) -> FloatArray:
    """Measure the gap of each contact node to the nearest obstacle among the parts it belongs to."""
    gap = np.full(space.n_dofs // 2, np.inf)
    # not by way of the dimensionless points: a node on the obstacle shall have the gap zero, also far from the origin
    points = dof_points(space, mesh)[nodes.nodes]
    for part in scene.contact_parts:
        if isinstance(part.condition, Contact):
            own = np.isin(nodes.nodes, space.element_dofs[mesh.part(part.name)])
            measured = part.condition.obstacle.gap(points[own], nodes.normals[own])
            gap[nodes.nodes[own]] = np.minimum(gap[nodes.nodes[own]], measured)
    return gap[nodes.nodes] / units.displacement
