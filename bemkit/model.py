"""From a scene to a dimensionless contact problem, and back to physical fields.

Inside, lengths are measured by the diameter of the body, stresses of the material by E', loads by their largest value
p and displacements by p L / E', so that nothing depends on the user's units, on where the body sits, or on how stiff
it is.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from bemkit.arrays import FloatArray, IntArray
from bemkit.contact.body import ContactState
from bemkit.contact.condensation import CondensedBody, ContactNodes, condense
from bemkit.contact.problem import ContactProblem
from bemkit.geometry.mesh import BoundaryMesh
from bemkit.geometry.order import along_boundary
from bemkit.geometry.quadrature import gauss_legendre
from bemkit.operators.nodal import Support
from bemkit.operators.steklov_poincare import CollocationMap, GalerkinMap, SteklovPoincare
from bemkit.scene import (
    Clamped,
    ConstantCollocation,
    Contact,
    Part,
    PrescribedDisplacement,
    Pressure,
    Roller,
    Scene,
    Traction,
)


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
        for part, elements, normals in _parts(self.scene, self.mesh):
            if isinstance(part.condition, Traction | Pressure):
                traction[elements] = _mean_load(part.condition, self.mesh, elements, normals)
        is_loose = np.ones(self.mesh.n_elements, bool)
        for _, elements, _ in _parts(self.scene, self.mesh):
            is_loose[elements] = False
        traction[is_loose] = 0.0
        energy = (
            0.5 * float(np.sum(displacement * force)) * self.units.stress * self.units.displacement * self.units.length
        )
        return displacement * self.units.displacement, traction, energy

    def _insert_contact(self, traction: FloatArray, state: ContactState) -> None:
        """Give each contact element the mean of the tractions at its nodes."""
        space = self.elastic.displacement_space
        at_nodes = np.zeros((space.n_dofs // 2, 2))
        at_nodes[self.nodes.nodes] = np.einsum("nk,nkc->nc", state.traction, self.nodes.frame)
        elements = contact_elements(self.scene, self.mesh)
        traction[elements] = at_nodes[space.element_dofs[elements]].mean(axis=1)


def build_model(scene: Scene, mesh: BoundaryMesh) -> Model:
    """Assemble the operators of a scene and condense the body onto its contact boundary.

    Parameters
    ----------
    scene : Scene
    mesh : BoundaryMesh
        As made by `Scene.build_mesh`, or a refinement of it.

    Returns
    -------
    Model

    Raises
    ------
    ConflictingSupportsError, SingularMatrixError, ValueError
        If the supports contradict each other or do not hold the body even with glued contact, or an expression is not
        finite somewhere.
    """
    units = _units(scene, mesh)
    unit_mesh = mesh.transformed(shift=(float(mesh.centre[0]), float(mesh.centre[1])), factor=1.0 / units.length)
    elastic = _elastic_map(scene, unit_mesh, units)
    force = np.zeros((elastic.displacement_space.n_dofs // 2, 2))
    for part, elements, normals in _parts(scene, mesh):
        if isinstance(part.condition, Traction | Pressure):
            for chosen, normal in _by_direction(elements, normals):
                force += elastic.nodal_forces(chosen, _dimensionless_load(part.condition, normal, units))
    body, nodes = condense(elastic, _supports(scene, mesh, units), contact_elements(scene, mesh), force)
    gap = _gap(scene, mesh, nodes, elastic, units)
    problem = ContactProblem(body, gap, scene.law.scaled(units.stress))
    return Model(scene, mesh, units, elastic, body, nodes, problem)


def contact_elements(scene: Scene, mesh: BoundaryMesh) -> IntArray:
    """Return the elements of all contact parts, in order along each."""
    return np.concatenate([along_boundary(mesh, mesh.part(part.name)) for part in scene.contact_parts])


def _elastic_map(scene: Scene, mesh: BoundaryMesh, units: Units) -> SteklovPoincare:
    material = scene.material.scaled(units.modulus)
    if isinstance(scene.discretisation, ConstantCollocation):
        return CollocationMap(mesh, material)
    return GalerkinMap(mesh, material)


def _parts(scene: Scene, mesh: BoundaryMesh) -> list[tuple[Part, IntArray, FloatArray]]:
    """List the parts with their elements and the outward normals of these."""
    return [(part, mesh.part(part.name), mesh.normals[mesh.part(part.name)]) for part in scene.parts]


def _units(scene: Scene, mesh: BoundaryMesh) -> Units:
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
                stresses.append(float(np.maximum(-gap, 0.0).max()) / length * modulus)
                gaps.append(float(np.abs(gap[np.isfinite(gap)]).max(initial=0.0)))
    stress = max(stresses) or max(gaps) / length * modulus or modulus
    return Units(mesh.centre, length, modulus, stress)


def _by_direction(elements: IntArray, normals: FloatArray) -> list[tuple[IntArray, FloatArray]]:
    """Group elements by their normal, so that a pressure field is evaluated once for each straight side."""
    unique, group = np.unique(normals, axis=0, return_inverse=True)
    return [(elements[group.ravel() == k], normal) for k, normal in enumerate(unique)]


def _dimensionless_load(
    load: Traction | Pressure, normal: FloatArray, units: Units
) -> Callable[[FloatArray], FloatArray]:
    def field(points: FloatArray) -> FloatArray:
        normals = np.broadcast_to(normal, points.shape)
        return load.at(units.to_physical(points), normals) / units.stress

    return field


def _mean_load(load: Traction | Pressure, mesh: BoundaryMesh, elements: IntArray, normals: FloatArray) -> FloatArray:
    xi, weights = gauss_legendre(5)
    points = mesh.points(elements, xi)
    values = [0.5 * weight * load.at(points[:, k], normals) for k, weight in enumerate(weights)]
    return np.sum(values, axis=0)  # type: ignore[no-any-return]


def _supports(scene: Scene, mesh: BoundaryMesh, units: Units) -> list[Support]:
    result = []
    for part, elements, normals in _parts(scene, mesh):
        condition = part.condition
        axes = np.broadcast_to(np.eye(2), (elements.size, 2, 2))
        if isinstance(condition, Roller):
            result.append(Support(part.name, elements, normals[:, None, :]))
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


def _gap(scene: Scene, mesh: BoundaryMesh, nodes: ContactNodes, elastic: SteklovPoincare, units: Units) -> FloatArray:
    """Measure the gap of each contact node to the nearest obstacle among the parts it belongs to."""
    gap = np.full(elastic.displacement_space.n_dofs // 2, np.inf)
    points = units.to_physical(nodes.points)
    for part in scene.contact_parts:
        if isinstance(part.condition, Contact):
            own = np.isin(nodes.nodes, elastic.displacement_space.element_dofs[mesh.part(part.name)])
            measured = part.condition.obstacle.gap(points[own], nodes.normals[own])
            gap[nodes.nodes[own]] = np.minimum(gap[nodes.nodes[own]], measured)
    return gap[nodes.nodes] / units.displacement
