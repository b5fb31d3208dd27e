"""From a scene to a dimensionless contact problem, and back to physical fields.

Inside, lengths are measured by the diameter of the body, stresses of the material by E', loads by their largest value
p and displacements by p L / E', so that nothing depends on the user's units, on where the body sits, or on how stiff
it is.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from itertools import zip_longest

import numpy as np

from bemkit.arrays import FloatArray, IntArray
from bemkit.boundary_data import Units, find_units, nodal_forces, parts_on, supports_on
from bemkit.contact.body import ContactState
from bemkit.contact.condensation import CondensedBody, ContactNodes, condense
from bemkit.contact.laws import FrictionLaw
from bemkit.contact.problem import ContactProblem
from bemkit.contact_data import ContactData, find_contact
from bemkit.errors import InputError
from bemkit.geometry.mesh import BoundaryMesh
from bemkit.geometry.quadrature import gauss_legendre
from bemkit.geometry.space import dof_points
from bemkit.operators.material import Material
from bemkit.operators.nodal import supported
from bemkit.operators.rigid import without_motion
from bemkit.operators.steklov_poincare import CollocationMap, GalerkinMap, SteklovPoincare
from bemkit.operators.work import Work
from bemkit.plan import Decisions, Formulation, Plan, make_plan
from bemkit.scene import Part, PrescribedDisplacement, Pressure, Scene, Traction
from bemkit.scene_symmetry import check_symmetry

_FARTHEST = 1e7
"""Distance from the origin in diameters up to which coordinates hold nine digits of the shape."""


class TooFarError(InputError):
    """A body whose coordinates are so large that they no longer hold its shape."""


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
    candidates : ContactData
        Of all nodes that may touch, whatever supports hold them.
    problem : ContactProblem
        Where supports hold contact nodes along the tangent its law is frictionless; see
        `bemkit.held_friction.with_held_friction`.
    """

    scene: Scene
    mesh: BoundaryMesh
    units: Units
    elastic: SteklovPoincare
    body: CondensedBody
    candidates: ContactData
    problem: ContactProblem

    @property
    def nodes(self) -> ContactNodes:
        """The contact nodes of the body."""
        return self.body.nodes

    @cached_property
    def contact(self) -> ContactData:
        """What the scene says of these nodes."""
        return self.candidates.of(self.nodes)

    def under(self, scene: Scene) -> Model:
        """Return the same body under the loads, obstacles and law of another scene; nothing is factored again.

        Only a law with friction where this model's has none makes it condense the body anew.

        Parameters
        ----------
        scene : Scene
            Differs from this model's in numbers of its conditions, its law and its solver alone.

        Raises
        ------
        ValueError
            If the scene has another body, other parts, or other kinds of conditions.
        """
        check_same_body(self.scene, scene)
        check_symmetry(scene, self.mesh)
        space = self.elastic.displacement_space
        supports = supports_on(scene, self.mesh, self.units, space)
        force = nodal_forces(scene, self.mesh, space, self.units)
        candidates = find_contact(scene, self.mesh, space)
        stays = candidates.of(self.nodes)
        is_new_friction = self.nodes.is_frictionless & ~stays.nodes.is_frictionless
        if stays.has_same_directions(self.contact) and not is_new_friction.any():
            body = self.body.under(supported(space, supports).displacement, force)
        else:
            body = condense(self.elastic, supports, candidates.nodes, force)
        problem = _problem(scene, self.units, body, candidates.of(body.nodes))
        return replace(self, scene=scene, body=body, candidates=candidates, problem=problem)

    @property
    def work(self) -> Work:
        """What it took to come here, from the operators on."""
        return self.body.work

    @property
    def law(self) -> FrictionLaw:
        """The friction law of the contact nodes, dimensionless, also where supports hold them."""
        return self.scene.law_at(self.contact.parts, self.contact.points).scaled(self.units.stress)

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
        return physical_fields(self.scene, self.mesh, self.units, displacement, force, traction)

    def _insert_contact(self, traction: FloatArray, state: ContactState) -> None:
        """Give each contact element the mean of the tractions that its nodes interpolate."""
        space = self.elastic.displacement_space
        at_nodes = np.zeros((space.n_dofs // 2, 2))
        at_nodes[self.nodes.nodes] = np.einsum("nk,nkc->nc", state.traction, self.nodes.frame)
        elements = np.concatenate([self.mesh.part(part.name) for part in self.scene.contact_parts])
        xi, weights = gauss_legendre(space.degree + 1)
        traction[elements] = np.einsum(
            "p,epc->ec", space.basis(xi) @ weights / 2.0, at_nodes[space.element_dofs[elements]]
        )


def build_model(scene: Scene, mesh: BoundaryMesh, units: Units | None = None, plan: Plan | None = None) -> Model:
    """Assemble the operators of a scene and condense the body onto its contact boundary.

    Parameters
    ----------
    scene : Scene
    mesh : BoundaryMesh
        As made by `Scene.build_mesh`, or a refinement of it.
    units : Units, optional
        By default `find_units` of the scene.
    plan : Plan, optional
        Whose decisions are followed; by default `make_plan` of the scene.

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
    check_position(mesh)
    check_symmetry(scene, mesh)
    units = find_units(scene, mesh) if units is None else units
    plan = make_plan(scene, mesh) if plan is None else plan
    elastic = elastic_map(plan.decisions, mesh.unit, scene.material.scaled(units.modulus))
    force = nodal_forces(scene, mesh, elastic.displacement_space, units)
    supports = supports_on(scene, mesh, units, elastic.displacement_space)
    candidates = find_contact(scene, mesh, elastic.displacement_space)
    body = condense(elastic, supports, candidates.nodes, force)
    problem = _problem(scene, units, body, candidates.of(body.nodes))
    return Model(scene, mesh, units, elastic, body, candidates, problem)


def check_position(mesh: BoundaryMesh) -> None:
    """Refuse a body so far from the origin that its coordinates hold too few digits of its shape."""
    distance = float(np.abs(mesh.nodes).max()) / mesh.diameter
    if distance > _FARTHEST:
        x, y = mesh.centre.tolist()
        raise TooFarError(
            f"the body lies {distance:.1e} times its size from the origin, where numbers hold fewer than nine digits "
            f"of its shape: subtract about ({x:.6g}, {y:.6g}) from all coordinates of body and obstacles"
        )


def _problem(scene: Scene, units: Units, body: CondensedBody, contact: ContactData) -> ContactProblem:
    law = scene.law_at(contact.parts, contact.points, body.is_held)
    return ContactProblem(body, contact.gap / units.displacement, law.scaled(units.stress))


def physical_fields(
    scene: Scene,
    mesh: BoundaryMesh,
    units: Units,
    displacement: FloatArray,
    force: FloatArray,
    traction: FloatArray,
) -> tuple[FloatArray, FloatArray, float]:
    """Return the physical fields on the whole boundary that belong to dimensionless ones.

    Parameters
    ----------
    scene : Scene
    mesh : BoundaryMesh
    units : Units
    displacement, force : (n_nodes, 2) arrays [-]
        Of the nodes of the displacement space.
    traction : (n_elements, 2) array [-]
        Its reactions and contact tractions are kept, loads come from the scene.

    Returns
    -------
    displacement : (n_nodes, 2) array [m]
    traction : (n_elements, 2) array [Pa]
    energy : float [J/m]
    """
    traction = traction * units.stress
    is_loose = np.ones(mesh.n_elements, bool)
    for part, elements, _ in parts_on(scene, mesh):
        is_loose[elements] = False
        if isinstance(part.condition, Traction | Pressure):
            traction[elements] = _mean_load(part.condition, mesh, elements)
    traction[is_loose] = 0.0
    points = dof_points(scene.discretisation.displacement_space(mesh.unit))
    # the forces are in equilibrium: on a rigid motion, which may be huge, they would only do the work of round-off
    strained = without_motion(mesh.unit, points, displacement)
    energy = 0.5 * float(np.sum(strained * force)) * units.stress * units.displacement * units.length
    return displacement * units.displacement, traction, energy


def elastic_map(decisions: Decisions, mesh: BoundaryMesh, material: Material) -> SteklovPoincare:
    """Return the map from displacements to forces that was chosen for a scene."""
    if decisions.formulation is Formulation.COLLOCATION:
        return CollocationMap(mesh, material, slopes=decisions.takes_slopes)
    displacements, tractions = decisions.displacement_space(mesh), decisions.traction_space(mesh)
    return GalerkinMap(mesh, material, displacements, tractions, decisions.linear_solver)


def check_same_body(scene: Scene, other: Scene) -> None:
    """Refuse another scene whose matrices would be others."""
    for name in ("shape", "material", "symmetry", "discretisation"):
        if getattr(scene, name) != getattr(other, name):
            raise InputError(f"{name} is {getattr(other, name)}: keep {getattr(scene, name)}, or build a new model")
    for part, changed in zip_longest(scene.parts, other.parts):
        if part is None or changed is None or _layout(part) != _layout(changed):
            name = (part or changed).name
            raise InputError(f"part {name!r} changes its place or its kind: change numbers only, or build a new model")


def _layout(part: Part) -> tuple[object, ...]:
    condition = part.condition
    components = condition.is_prescribed if isinstance(condition, PrescribedDisplacement) else ()
    return part.name, part.sides, part.where, type(condition), components


def _mean_load(load: Traction | Pressure, mesh: BoundaryMesh, elements: IntArray) -> FloatArray:
    xi, weights = gauss_legendre(5)
    points, normals = mesh.points(elements, xi), mesh.normals_at(elements, xi)
    values = load.at(points.reshape(-1, 2), normals.reshape(-1, 2)).reshape(points.shape)
    mean: FloatArray = np.einsum("q,eqc->ec", 0.5 * weights, values)
    return mean
