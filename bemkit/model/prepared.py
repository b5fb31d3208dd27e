"""A scene on meshes, ready to plan and to solve: units, conditions at nodes, forces and contact rows.

Inside, lengths are measured by the diameter of the largest body, stresses of the material by E' of the most compliant
contact, loads by their largest value p and displacements by p L / E'.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from bemkit.arrays import AnyArray, BoolArray, FloatArray
from bemkit.contact.contact_nodes import ContactNodes
from bemkit.contact.laws import FrictionLaw
from bemkit.errors import ResultWarning
from bemkit.geometry.spaces import dof_points
from bemkit.model.contact_data import ContactData
from bemkit.model.contacts import ContactInterface, candidates_of, law_of_rows, may_overlap, obstacle_rows, retained_for
from bemkit.model.fields import TractionRecovery
from bemkit.model.given import far_motion_of, given_data, held_nodes, nodal_forces, with_far_motion
from bemkit.model.placed import Meshes, PlacedBody, bodies_under, check_step, find_units, place, with_found_contacts
from bemkit.model.units import Units
from bemkit.operators.linear_solvers import DenseCholesky, LinearSolver, Tag
from bemkit.operators.material import Material
from bemkit.operators.steklov_poincare import SteklovPoincare
from bemkit.operators.steklov_poincare.nodal_conditions import GivenData, NodalConditions, free_modes, turning
from bemkit.plan.costs import BodyCase, ChosenLinearSolver, choose
from bemkit.scene.discretisation import thinness_warnings
from bemkit.scene.scene import Scene

if TYPE_CHECKING:
    from bemkit.operators.half_plane.far_motion import FarMotion
    from bemkit.operators.steklov_poincare.forces_inside import ForcesInside
    from bemkit.scene.contacts import ContactPair

_LARGEST_BLOCK = 1000
"""Typical order of the largest dense block of equations over a tree."""


@dataclass(frozen=True, eq=False)
class PreparedBody(PlacedBody):
    """A placed body with what is given of it, in the axes of its own mesh.

    Parameters
    ----------
    conditions : NodalConditions
        Supports; the nodes in contact are retained.
    force : (n_nodes, 2) array [-]
        Given nodal forces.
    inside : ForcesInside or None
        Body forces; None without any.
    far_motion : FarMotion or None
        How a half-plane moves far away; None at rest.
    candidates : ContactData
        The nodes that may touch an obstacle or a rigid body, held by supports or not.
    """

    conditions: NodalConditions
    force: FloatArray
    inside: ForcesInside | None
    far_motion: FarMotion | None
    candidates: ContactData

    @property
    def map_data(self) -> GivenData:
        """The forces and displacements under which the elastic map is solved; see `given_data`."""
        return given_data(self.conditions, self.force, self.inside)

    @cached_property
    def free_modes(self) -> FloatArray:
        """(n_motions, n_nodes, 2) array: rigid body modes that no support resists."""
        return free_modes(self.own_space, self.conditions)


@dataclass(frozen=True, eq=False)
class Prepared:
    """A scene on meshes: bodies with their conditions and forces, and contact rows.

    Parameters
    ----------
    scene : Scene
        With a single load and all contacts listed.
    bodies : tuple of PreparedBody
    units : Units
        Common to all bodies: the largest body's length, the modulus of the most compliant contact, the largest load.
    rows : tuple of ContactInterface
    unresolved : tuple of str
        Contacts between touching bodies that are too short for the mesh, which are skipped.
    """

    scene: Scene
    bodies: tuple[PreparedBody, ...]
    units: Units
    rows: tuple[ContactInterface, ...]
    unresolved: tuple[str, ...] = ()

    @property
    def only(self) -> PreparedBody:
        """The only body."""
        (body,) = self.bodies
        return body

    @property
    def force_unit(self) -> float:
        """The unit of nodal forces [N/m]."""
        return self.units.stress * self.units.length

    @property
    def n_contact(self) -> int:
        """Number of contact nodes."""
        return sum(rows.n_contact for rows in self.rows)

    @cached_property
    def is_condensed(self) -> bool:
        """Whether the contact problem uses condensed stiffnesses even if the equations of bodies are compressed.

        Several bodies are joined by their stiffness. That of one body is needed to see whether the energy of elements
        that are too long can be negative, for rotations that no support holds and displacements do not contain, and for
        nodes between two obstacles (two rows each).
        """
        if not self.scene.has_obstacles_only:
            return True
        body, nodes = self.only, np.concatenate([np.zeros(0, np.intp), *(rows.nodes for rows in self.rows)])
        if np.unique(nodes).size < nodes.size:
            return True
        tags = self._map_of(body, DenseCholesky()).tags
        if Tag.SYMMETRIC in tags:
            return False
        if Tag.KILLS_TRANSLATIONS in tags and turning(body.free_modes).any():
            return True
        return bool(self.thinness_warnings(body))

    def material_of(self, body: PlacedBody) -> Material:
        """Return the material of a body, its modulus in dimensionless units."""
        return body.material.scaled(self.units.modulus)

    def linear_solver(self, body: PreparedBody) -> ChosenLinearSolver:
        """Return the linear solver of the map of a body, and the reason."""
        case = BodyCase(self._map_of(body, DenseCholesky()), body.conditions, (body.map_data,), self.is_condensed)
        return choose(self.scene.linear_solver, case, body.scene.discretisation.method)

    def _map_of(self, body: PreparedBody, linear_solver: LinearSolver) -> SteklovPoincare:
        return body.scene.discretisation.elastic_map(body.own_mesh.unit, self.material_of(body), linear_solver)

    def elastic_map(self, body: PreparedBody) -> SteklovPoincare:
        """Return the map of a body without forces inside, by its linear solver; nothing is assembled yet."""
        chosen = self.linear_solver(body)
        elastic = with_far_motion(self._map_of(body, chosen.solver), body.far_motion)
        if body.conditions.connected:
            from bemkit.operators.steklov_poincare.rigid_connection import RigidlyConnected

            return RigidlyConnected.of(elastic, body.scene.discretisation.method)
        if chosen.hierarchical is None:
            return elastic
        from bemkit.operators.steklov_poincare.collocation import CollocationElasticity
        from bemkit.operators.steklov_poincare.hierarchical import HierarchicalCollocation

        assert isinstance(elastic, CollocationElasticity)
        return HierarchicalCollocation.of(elastic, chosen.hierarchical)

    def thinness_warnings(self, body: PreparedBody) -> tuple[ResultWarning, ...]:
        """Warn if elements of a body whose map is not symmetric are too long for its thickness."""
        if Tag.SYMMETRIC in self._map_of(body, DenseCholesky()).tags:
            return ()
        return thinness_warnings(body.own_mesh.unit, body.scene.discretisation.method)

    @cached_property
    def largest_matrix(self) -> int:
        """Order of the largest matrix that is factored, roughly."""
        body = max(self.bodies, key=lambda body: body.space.n_dofs)
        if self.linear_solver(body).hierarchical is None:
            return body.space.n_dofs
        return min(_LARGEST_BLOCK, body.space.n_dofs)

    def column(self, name: str) -> FloatArray:
        """Return a column of `ContactInterface` for all contact nodes."""
        shape = (0, 2) if name == "points" else (0,)
        return np.concatenate([np.zeros(shape), *(getattr(rows, name) for rows in self.rows)])

    def by_contact(self, values: AnyArray) -> list[tuple[ContactInterface, AnyArray]]:
        """Return each contact with the values (n, ...) of its nodes, of values (n_contact, ...) at all."""
        begins = np.cumsum([0, *(rows.n_contact for rows in self.rows)]).tolist()
        return [(rows, values[begin : begin + rows.n_contact]) for rows, begin in zip(self.rows, begins, strict=False)]

    @cached_property
    def frame(self) -> FloatArray:
        """(n_contact, 2, 2) array: direction of contact and tangent of all contact nodes."""
        return np.concatenate([np.zeros((0, 2, 2)), *(rows.frame for rows in self.rows)])

    @cached_property
    def recovery(self) -> TractionRecovery:
        """The map from forces of contact nodes to tractions of elements."""
        return TractionRecovery.of(self.bodies, self.rows)

    @cached_property
    def names(self) -> tuple[str, ...]:
        """The contact of each contact node."""
        return tuple(rows.name for rows in self.rows for _ in range(rows.n_contact))

    @property
    def contact_nodes(self) -> ContactNodes:
        """The contact nodes of the only body, dimensionless."""
        nodes = np.concatenate([np.zeros(0, np.intp), *(rows.nodes for rows in self.rows)])
        return ContactNodes(
            nodes,
            dof_points(self.only.own_space)[nodes],
            self.frame,
            self.column("weights") / self.units.length,
        )

    @cached_property
    def law(self) -> FrictionLaw:
        """The friction law of the contact nodes, in physical units; see `law_of_rows`."""
        return law_of_rows(self.rows)

    @property
    def tangent_follows(self) -> BoolArray:
        """(n_contact,) bool array: nodes whose tangential displacement a support or a second obstacle gives."""
        return np.concatenate([np.zeros(0, bool), *(rows.tangent_follows for rows in self.rows)])

    @property
    def is_on_line(self) -> BoolArray:
        """(n_contact,) bool array: nodes of contacts between bodies that lie on a symmetry line."""
        return np.concatenate([np.zeros(0, bool), *(rows.is_on_line for rows in self.rows)])

    def under(self, scene: Scene, units: Units | None = None) -> Prepared:
        """Return the same bodies under the loads, gaps and laws of another scene.

        Loads on a body are integrated again only if its parts or body forces are other objects than before.

        Parameters
        ----------
        scene : Scene
            Differs only in numbers of conditions and contacts, its law and its solver.
        units : Units, optional
            By default the same.

        Raises
        ------
        InputError
            If its bodies have other names, shapes or kinds of conditions, a rigid body becomes another one, or a load
            drives another of its motions.
        """
        check_step(self.scene, scene)
        before = self if units is None else None
        following = _prepared(scene, bodies_under(scene, self.bodies), units or self.units, before)
        if self.is_coupled_like(following) and "recovery" in self.__dict__:
            following.__dict__["recovery"] = self.recovery
        return following

    def with_loads_of(self, other: Prepared) -> Prepared:
        """Return the same bodies and contacts under the loads, supports and body forces of another step."""
        pairs = zip(self.bodies, other.bodies, strict=True)
        bodies = (
            replace(
                body,
                conditions=replace(body.conditions, displacement=loaded.conditions.displacement),
                force=loaded.force,
                inside=loaded.inside,
                far_motion=loaded.far_motion,
            )
            for body, loaded in pairs
        )
        return replace(self, bodies=tuple(bodies))

    def has_same_unknowns(self, other: Prepared) -> bool:
        """Whether bodies are condensed onto the same displacements as in another step."""
        pairs = zip(self.bodies, other.bodies, strict=True)
        return all(np.array_equal(one.conditions.is_retained, two.conditions.is_retained) for one, two in pairs)

    def is_coupled_like(self, other: Prepared) -> bool:
        """Whether the same nodes touch the same sides in the same directions as in another step."""
        pairs = zip(self.rows, other.rows, strict=False)
        return len(self.rows) == len(other.rows) and all(one.is_coupled_like(two) for one, two in pairs)

    def rows_under(self, scene: Scene) -> tuple[ContactInterface, ...] | None:
        """Return the contacts of elastic bodies with the gaps and laws of another scene, None if they are others."""
        before, after = self.scene.elastic_contacts, scene.elastic_contacts
        if len(before) != len(after) or any(
            replace(one, gap=0.0, law=None) != replace(two, gap=0.0, law=None)
            for one, two in zip(before, after, strict=True)
        ):
            return None
        return tuple(
            replace(
                rows,
                gap=rows.gap + (two.gap_at(rows.points) - one.gap_at(rows.points)),
                law=scene.law_of(two),
            )
            for rows, one, two in zip(self.rows, before, after, strict=False)
        )


def prepare(scene: Scene, meshes: Meshes = None) -> Prepared:
    """Prepare a scene with a single load; see `prepare_steps`."""
    (prepared,) = prepare_steps((scene,), meshes)
    return prepared


def prepare_steps(scenes: Sequence[Scene], meshes: Meshes = None) -> tuple[Prepared, ...]:
    """Prepare scenes that follow each other in time, in the units of the largest load.

    All have the contacts that are found in the first one.

    Parameters
    ----------
    scenes : sequence of Scene
        Each with a single load; see `bemkit.scene.load_history.load_steps`.
    meshes : BoundaryMesh or mapping of str to BoundaryMesh, optional
        Meshes of bodies by name, in the coordinates of their shapes, or that of the only body.

    Raises
    ------
    GeometryError
        If a body cannot be divided, or sides in contact face away from each other.
    OverlapError
        If bodies overlap by more than the interference given.
    ConflictingSupportsError
        If supports contradict each other at a node.
    TooFarError
        If a body lies so far from the origin that its coordinates no longer hold its shape.
    ValueError
        If a scene lacks its symmetry, or an expression is not finite somewhere.
    """
    bodies = place(scenes[0], meshes)
    found: Sequence[tuple[ContactPair, bool]] = ()
    if scenes[0].touching is not None:
        from bemkit.model.body_contacts import touching_pairs  # mortars, which single bodies lack

        found = touching_pairs(scenes[0], bodies)
    steps = [with_found_contacts(step, [pair for pair, is_resolved in found if is_resolved]) for step in scenes]
    for step in steps[1:]:
        check_step(steps[0], step)
    first = _prepared(steps[0], bodies, find_units(steps, bodies))
    first = replace(first, unresolved=tuple(pair.name for pair, is_resolved in found if not is_resolved))
    if may_overlap(scenes[0], [body.scene for body in bodies]):
        from bemkit.model.overlaps import check_apart

        check_apart(scenes[0], bodies)
    later = tuple(first.under(step) for step in steps[1:])
    if later:  # what later steps give decides how much of the compressed equations is kept
        pairs = [(body, tuple(step.bodies[k].map_data for step in later)) for k, body in enumerate(first.bodies)]
        informed = (replace(body, conditions=replace(body.conditions, later=data)) for body, data in pairs)
        first = replace(first, bodies=tuple(informed))
    return (first, *later)


def _prepared(scene: Scene, bodies: Sequence[PlacedBody], units: Units, before: Prepared | None = None) -> Prepared:
    """Prepare placed bodies; bodies whose loads have not changed keep their conditions and forces."""
    supports: list[NodalConditions] = []
    forces: list[FloatArray] = []
    force_unit = units.stress * units.length
    for number, body in enumerate(bodies):
        if before is not None and body.is_loaded_like(before.bodies[number]):
            supports.append(before.bodies[number].conditions)
            forces.append(before.bodies[number].force)
            continue
        own_units = body.units(units.modulus, force_unit)
        held = held_nodes(body.scene, body.own_mesh, own_units, body.own_space)
        far_motion = far_motion_of(body.scene, own_units)
        supports.append(held if far_motion is None else replace(held, load_controlled=far_motion.load_controlled))
        in_place = body.units(units.modulus, force_unit, body.mesh)
        forces.append(body.turn.turned_back(nodal_forces(body.scene, body.mesh, body.space_in_place, in_place)))
    candidates = candidates_of(scene, bodies)
    with_obstacles = tuple(obstacle_rows(scene, bodies, candidates, supports))
    between = None if before is None else before.rows_under(scene)
    if between is None:
        between = ()
        if scene.elastic_contacts:
            from bemkit.model.body_contacts import body_rows  # mortars, which single bodies lack

            between = tuple(body_rows(scene, bodies, supports, with_obstacles))
    rows = (*between, *with_obstacles)
    retained, insides = retained_for(bodies, supports, rows), _insides(bodies, units, before)
    prepared = []
    for number, body in enumerate(bodies):
        far_motion = far_motion_of(body.scene, body.units(units.modulus, force_unit))
        given = (retained[number], forces[number], insides[number], far_motion, candidates[number])
        placed = body.body, body.scene, body.mesh, body.own_mesh, body.space, body.own_space, body.space_in_place
        prepared.append(PreparedBody(*placed, *given))
    return Prepared(scene, tuple(prepared), units, rows)


def _insides(bodies: Sequence[PlacedBody], units: Units, before: Prepared | None) -> list[ForcesInside | None]:
    """Return the body forces of each body."""
    if not any(body.body.body_forces for body in bodies):
        return [None] * len(bodies)
    from bemkit.model.inside import forces_inside_of

    pairs = () if before is None else zip(bodies, before.bodies, strict=True)
    kept = {number: old.inside for number, (body, old) in enumerate(pairs) if body.is_loaded_like(old)}
    return forces_inside_of(bodies, units, kept)
