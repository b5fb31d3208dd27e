"""From a prepared scene to a dimensionless contact problem, and back to physical fields.

Inside, lengths are measured by the diameter of the body, stresses of the material by E', loads by their largest value
p and displacements by p L / E', so that nothing depends on the user's units, on where the body sits, or on how stiff
it is. A scene without contact is a contact problem without nodes.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, TypeAlias

import numpy as np

from bemkit.arrays import FloatArray, IntArray, blended
from bemkit.contact.body import ContactState
from bemkit.contact.condensation.direct_body import DirectBody, condensed_body
from bemkit.contact.condensation.nodes import ContactNodes
from bemkit.contact.laws import FrictionLaw
from bemkit.contact.problem import ContactProblem
from bemkit.geometry.local_values import element_degrees, from_own_nodes, projector
from bemkit.geometry.mesh import BoundaryMesh
from bemkit.geometry.quadrature import gauss_legendre
from bemkit.geometry.spaces import BoundarySpace, dof_points
from bemkit.model.contact_data import SMOOTH_SIDE_COSINE, ContactData
from bemkit.model.prepared import Prepared
from bemkit.model.units import Units
from bemkit.operators.counts import OperationCounts
from bemkit.operators.half_plane.far_drive import FarDrive
from bemkit.operators.half_plane.surface import SurfaceElasticity
from bemkit.operators.rigid_modes import without_motion
from bemkit.operators.steklov_poincare import SteklovPoincare
from bemkit.operators.steklov_poincare.forces_inside import HeavyElasticity
from bemkit.operators.steklov_poincare.nodal_conditions import supporting_forces
from bemkit.scene.conditions import Contact, Free, Pressure, Traction
from bemkit.scene.scene import Scene
from bemkit.solvers.base import ContactSolver

if TYPE_CHECKING:
    from bemkit.contact.condensation.hierarchical_body import HierarchicalBody
    from bemkit.contact.half_plane.surface_body import SurfaceBody
    from bemkit.model.untouched_body import UntouchedBody

_MORE_POINTS = 4
"""Gauss points of an element at which given loads are evaluated, beyond the degree of the tractions."""

ContactBody: TypeAlias = "DirectBody | HierarchicalBody | SurfaceBody | UntouchedBody"


@dataclass(frozen=True, eq=False)
class Model:
    """A prepared scene with its elastic map, its condensed body and its contact problem.

    Parameters
    ----------
    prepared : Prepared
    elastic : SteklovPoincare
        Dimensionless.
    body : DirectBody, HierarchicalBody, SurfaceBody or UntouchedBody
    problem : ContactProblem
    """

    prepared: Prepared
    elastic: SteklovPoincare
    body: ContactBody
    problem: ContactProblem

    @property
    def solver(self) -> ContactSolver:
        """The driver."""
        return self.scene.solver

    @property
    def scene(self) -> Scene:
        """The scene, with a single load."""
        return self.prepared.scene

    @property
    def mesh(self) -> BoundaryMesh:
        """The mesh, in physical units."""
        return self.prepared.mesh

    @property
    def units(self) -> Units:
        """The physical size of one dimensionless unit."""
        return self.prepared.units

    @property
    def contact(self) -> ContactData:
        """The contact nodes with their parts, gaps and places."""
        return self.prepared.contact

    @property
    def nodes(self) -> ContactNodes:
        """The contact nodes of the body."""
        return self.prepared.contact.nodes

    def under(self, prepared: Prepared) -> Model:
        """Return the same body under the loads, obstacles and law of another scene; nothing is factored again.

        The body is condensed again only if directions of contact change, or the drive of a half-plane does.

        Parameters
        ----------
        prepared : Prepared
            From `Prepared.under` of this model's.
        """
        contact = prepared.candidates.of(self.nodes)
        elastic = self.elastic
        if isinstance(elastic, HeavyElasticity) and prepared.inside is not None:
            elastic = replace(elastic, inside=prepared.inside)
        is_driven_alike = prepared.drive == self.prepared.drive
        if not is_driven_alike:
            elastic = _driven_by(elastic, prepared.drive)
        if is_driven_alike and contact.has_same_directions(self.contact):
            body = self.body.under(prepared.conditions.displacement, prepared.force, prepared.inside)
            prepared = replace(prepared, conditions=body.conditions, contact=replace(contact, nodes=self.nodes))
        else:
            body = contact_body(elastic, prepared)
        return Model(prepared, elastic, body, _problem(prepared, body))

    def between(self, before: Model, share: float) -> ContactProblem:
        """Return the problem at a share of the way from the loads and gaps of a step before to those of this model."""
        if share == 1.0:
            return self.problem
        one, two = before.prepared, self.prepared
        displacement = blended(one.conditions.displacement, two.conditions.displacement, share)
        force = blended(one.force, two.force, share)
        inside = two.inside if one.inside is None or two.inside is None else one.inside.blended(two.inside, share)
        if one.drive != two.drive:
            drive, conditions = one.drive.blended(two.drive, share), replace(two.conditions, displacement=displacement)
            prepared = replace(two, drive=drive, conditions=conditions, force=force)
            body = contact_body(_driven_by(self.elastic, drive), prepared)
        else:
            body = self.body.under(displacement, force, inside)
        return replace(self.problem, body=body, gap=blended(before.problem.gap, self.problem.gap, share))

    def acting(self, state: ContactState) -> tuple[FloatArray, FloatArray]:
        """Return the forces [N/m] of loads and supports on all nodes, and the displacements [m] on which they work.

        On a half-plane also the forces that balance all others from far away, on its motion there.
        """
        displacement, force = self.body.recover(state)
        of_contact = self.nodes.forces(state.traction, len(force))
        acting = supporting_forces(self.prepared.conditions, self.prepared.force, force - of_contact)
        if isinstance(self.elastic, SurfaceElasticity):
            motion = displacement - self.elastic.strain_displacement(force)
            acting = np.concatenate([acting, -force.ravel()])
            displacement = np.concatenate([displacement, motion])
        units = self.units
        return acting * (units.stress * units.length), displacement.ravel() * units.displacement

    def reactions(self, state: ContactState) -> FloatArray:
        """Return the forces (n_nodes, 2) [N/m] of supports on all nodes, zero where nothing holds the body."""
        _, force = self.body.recover(state)
        total = force - self.nodes.forces(state.traction, len(force)) - self.prepared.force
        held = supporting_forces(self.prepared.conditions, np.zeros_like(force), total)
        return held.reshape(-1, 2) * (self.units.stress * self.units.length)

    @property
    def has_body_forces(self) -> bool:
        """Whether something acts inside the body."""
        return self.prepared.inside is not None

    def with_law(self, scene: Scene) -> Model:
        """Return the same body under the same loads; the scene differs only in its solver and the numbers of its law.

        Where this model's law has friction that of the scene has some, too, and nowhere else.
        """
        prepared = replace(self.prepared, scene=scene)
        _ = self.problem.sticking_state  # common to all laws
        return Model(prepared, self.elastic, self.body, self.problem.with_law(_law(prepared)))

    @property
    def work(self) -> OperationCounts:
        """Operations counted so far: integrals, factorisations and solves."""
        return self.body.work

    @property
    def law(self) -> FrictionLaw:
        """The friction law of the contact nodes, dimensionless."""
        return _law(self.prepared)

    def boundary_fields(self, state: ContactState) -> tuple[FloatArray, FloatArray, float]:
        """Return the physical fields of a contact state on the whole boundary.

        Returns
        -------
        displacement : (n_nodes, 2) array [m]
        traction : (n_elements, n_local, 2) array [Pa]
            Values at the local nodes of the traction space, element by element: given loads and contact tractions
            projected onto its functions, reactions of supports, and zero on the free boundary.
        energy : float [J/m]
            Elastic energy of the stresses in the plane; without heat 1/2 a(u, u).
        """
        units = self.units
        displacement, force = self.body.recover(state)
        traction = self.elastic.element_tractions(displacement, force)
        self._insert_contact(traction, state)
        traction *= units.stress
        insert_loads(traction, self.scene, self.mesh, self.elastic.traction_space)
        energy = elastic_energy(self.elastic, self.prepared.space, displacement, force)
        return displacement * units.displacement, traction, energy * units.stress * units.displacement * units.length

    def _insert_contact(self, traction: FloatArray, state: ContactState) -> None:
        """Replace the tractions of contact elements by the projection of those that their nodes interpolate."""
        space = self.prepared.space
        at_rest = np.zeros((1, 2))  # at nodes that contact does not reach
        tractions = np.concatenate([np.einsum("nk,nkc->nc", state.traction, self.nodes.frame), at_rest])
        xi, weights = gauss_legendre(space.degree + 1)
        projection = space.basis(xi) @ projector(self.elastic.traction_space, xi, weights).T
        for part, elements in self.scene.parts_on(self.mesh):
            if isinstance(part.condition, Contact):
                at_nodes = tractions[self._rows_of(part.name, elements)]
                at_nodes = from_own_nodes(space, at_nodes, elements)
                traction[elements] = np.einsum("pl,epc->elc", projection, at_nodes)

    def _rows_of(self, part: str, elements: IntArray) -> IntArray:
        """Return the contact nodes (n_elements, n_local) whose tractions the elements of a part have; -1 without one.

        In a corner that is the row of the part's own obstacle. Where the node there belongs only to another part, the
        next node represents it.
        """
        is_of_part, directions = np.equal(self.contact.parts, part), self.nodes.directions
        row_of_dof = np.full(self.prepared.space.n_dofs // 2, -1)
        for rows in (np.flatnonzero(~is_of_part), np.flatnonzero(is_of_part)):  # rows of the part come last, and win
            row_of_dof[self.nodes.nodes[rows]] = rows
        result = row_of_dof[self.prepared.space.element_dofs[elements]]
        all_elements, last = np.arange(elements.size), element_degrees(self.prepared.space)[elements] - 1
        for end, next_node in ((0, 1), (-1, last)) if self.prepared.space.degree else ():
            at_end, beside = result[:, end], result[all_elements, next_node]
            turns = np.sum(directions[at_end] * directions[beside], axis=1) <= SMOOTH_SIDE_COSINE
            result[:, end] = np.where((at_end >= 0) & ~is_of_part[at_end] & turns, beside, at_end)
        return result


def map_fields(elastic: SteklovPoincare, displacement: FloatArray, force: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return nodal displacements and forces (n_nodes, 2) less those of what acts inside the body or far away."""
    if isinstance(elastic, SurfaceElasticity):
        return elastic.strain_displacement(force), force
    if isinstance(elastic, HeavyElasticity):
        return displacement - elastic.inside.displacement, force - elastic.inside.force
    return displacement, force


def elastic_energy(
    elastic: SteklovPoincare, space: BoundarySpace, displacement: FloatArray, force: FloatArray
) -> float:
    """Return the elastic energy of the stresses in the plane, dimensionless, from nodal fields (n_nodes, 2)."""
    of_map, map_force = map_fields(elastic, displacement, force)
    # the forces are in equilibrium: on a rigid motion, which may be huge, they would only do the work of round-off
    strained = without_motion(space.mesh, dof_points(space), of_map)
    return 0.5 * float(np.sum(strained * map_force)) + float(energy_beyond(elastic, of_map, map_force).sum())


def energy_beyond(elastic: SteklovPoincare, displacement: FloatArray, force: FloatArray) -> FloatArray:
    """Return the parts of the energy that what acts inside adds to that of `map_fields`; see `HeavyElasticity`."""
    return elastic.energy_beyond(displacement, force) if isinstance(elastic, HeavyElasticity) else np.zeros(0)


def build_model(prepared: Prepared) -> Model:
    """Assemble the operators of a scene and condense the body onto its contact boundary.

    Raises
    ------
    FreeBodyError
        If no part is in contact and the supports leave a rigid motion free, which the message names.
    NoContactNodesError
        If supports leave no node of the contact boundary free to move towards the obstacle.
    SingularMatrixError
        If the supports do not hold the body even with all contact nodes sticking.
    """
    discretisation, mesh = prepared.scene.discretisation, prepared.mesh.unit
    elastic = discretisation.chosen_map(mesh, prepared.material, prepared.linear_solver)
    elastic = _driven_by(elastic, prepared.drive)
    if prepared.inside is not None:
        elastic = HeavyElasticity(elastic, prepared.inside)
    body = contact_body(elastic, prepared)
    return Model(prepared, elastic, body, _problem(prepared, body))


def contact_body(elastic: SteklovPoincare, prepared: Prepared) -> ContactBody:
    """Return a body as contact sees it: condensed onto its contact nodes or compressed, if there are any."""
    if isinstance(elastic, SurfaceElasticity):
        if not prepared.scene.contact_parts:
            from bemkit.model.free_motion import check_held

            check_held(prepared)
        from bemkit.contact.half_plane.bodies import surface_body

        return surface_body(elastic, prepared.conditions, prepared.contact.nodes, prepared.force)
    if prepared.scene.contact_parts:
        data = prepared.conditions, prepared.contact.nodes, prepared.force
        if prepared.linear_solver.hierarchical is not None and not prepared.is_condensed:
            from bemkit.contact.condensation.hierarchical_body import hierarchical_body
            from bemkit.operators.steklov_poincare.hierarchical import HierarchicalCollocation

            weightless = elastic.weightless if isinstance(elastic, HeavyElasticity) else elastic
            assert isinstance(weightless, HierarchicalCollocation)
            return hierarchical_body(weightless, *data, prepared.inside)
        return condensed_body(elastic, *data, prepared.free_modes)
    from bemkit.model.free_motion import check_held
    from bemkit.model.untouched_body import UntouchedBody

    check_held(prepared)
    condensed = elastic.condense(prepared.conditions, prepared.force)
    return UntouchedBody(prepared.space, prepared.conditions, prepared.force, condensed)


def _driven_by(elastic: SteklovPoincare, drive: FarDrive) -> SteklovPoincare:
    """Return a half-plane that moves otherwise far away; a body that ends somewhere stays as it is."""
    return elastic.driven_by(drive) if isinstance(elastic, SurfaceElasticity) else elastic


def _problem(prepared: Prepared, body: ContactBody) -> ContactProblem:
    return ContactProblem(body, prepared.contact.gap / prepared.units.displacement, _law(prepared))


def _law(prepared: Prepared) -> FrictionLaw:
    contact = prepared.contact
    return prepared.scene.law_at(contact.parts, contact.points).scaled(prepared.units.stress)


def insert_loads(
    traction: FloatArray, scene: Scene, mesh: BoundaryMesh, space: BoundarySpace, touching: Collection[str] = ()
) -> None:
    """Replace the tractions of loaded elements by the projection of the loads, of free elements by zero.

    Parameters
    ----------
    traction : (n_elements, n_local, 2) array [Pa]
        At the local nodes of their space; changed in place, but for elements in contact and those that supports hold.
    scene : Scene
    mesh : BoundaryMesh
        In physical units.
    space : BoundarySpace
        Of the tractions.
    touching : collection of str
        Free parts that other bodies touch: they are left as they are.
    """
    xi, weights = gauss_legendre(space.degree + 1 + _MORE_POINTS)
    projection = projector(space, xi, weights)
    is_free = np.ones(mesh.n_elements, bool)
    for part, elements in scene.parts_on(mesh):
        is_free[elements] = isinstance(part.condition, Free) and part.name not in touching
        if isinstance(part.condition, Traction | Pressure):
            points, normals = mesh.points(elements, xi), mesh.normals_at(elements, xi)
            values = part.condition.at(points.reshape(-1, 2), normals.reshape(-1, 2)).reshape(points.shape)
            traction[elements] = np.einsum("lq,eqc->elc", projection, values)
    traction[is_free] = 0.0
