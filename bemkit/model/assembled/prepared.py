"""An assembly made ready to solve: units, conditions at nodes, forces and contact rows of all bodies, once."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import zip_longest

import numpy as np
from scipy import sparse

from bemkit.arrays import BoolArray, FloatArray, IntArray
from bemkit.contact.further_laws import PiecewiseLaw
from bemkit.contact.laws import FrictionLaw, Frictionless, LawOfCoefficients
from bemkit.contact.problem import LawError
from bemkit.errors import InputError
from bemkit.geometry.mesh import BoundaryMesh
from bemkit.geometry.spaces import dof_points
from bemkit.model.assembled.contact_tractions import ContactSpread
from bemkit.model.assembled.contacts import ContactRows, body_rows, listed_contacts, obstacle_rows
from bemkit.model.assembled.placed import PlacedBody, groups, place
from bemkit.model.particular import particular_solution
from bemkit.model.prepared import given_data, linear_solver_of, nodal_forces, supports_on
from bemkit.model.units import Units, largest_sizes
from bemkit.operators.linear.solvers import ChosenLinearSolver
from bemkit.operators.steklov_poincare.forces_inside import ForcesInside
from bemkit.operators.steklov_poincare.needs import BodyCase
from bemkit.operators.steklov_poincare.nodal_conditions import GivenData, NodalConditions, supported
from bemkit.scene.assembly import Assembly, ContactPair
from bemkit.scene.body_forces import BodyForce, seen_from
from bemkit.scene.plane_motion import RigidBody


@dataclass(frozen=True, eq=False)
class PreparedAssembly:
    """An assembly on meshes: placed bodies, conditions at nodes, forces and contact rows.

    Parameters
    ----------
    assembly : Assembly
        With all contacts listed.
    bodies : tuple of PlacedBody
    units : Units
        Common to all bodies: the largest body's length, the modulus of the most compliant contact, the largest load.
    conditions : tuple of NodalConditions
        Of each body on its own mesh; the nodes in contact are retained.
    forces : tuple of (n_nodes, 2) array [-]
        Given nodal forces of each body, in the axes of its own mesh.
    rows : tuple of ContactRows
    insides : tuple of ForcesInside or None
        Body forces of each body, in the axes of its own mesh; None where there are none.
    """

    assembly: Assembly
    bodies: tuple[PlacedBody, ...]
    units: Units
    conditions: tuple[NodalConditions, ...]
    forces: tuple[FloatArray, ...]
    rows: tuple[ContactRows, ...]
    insides: tuple[ForcesInside | None, ...]

    @property
    def force_unit(self) -> float:
        """The unit of nodal forces [N/m]."""
        return self.units.stress * self.units.length

    @property
    def n_contact(self) -> int:
        """Number of contact nodes."""
        return sum(rows.n_contact for rows in self.rows)

    @property
    def largest_matrix(self) -> int:
        """Order of the largest matrix that is factored, roughly."""
        return max(body.space.n_dofs for body in self.bodies)

    def column(self, name: str) -> FloatArray:
        """Return a column of `ContactRows` for all contact nodes."""
        shape = (0, 2) if name == "points" else (0,)
        return np.concatenate([np.zeros(shape), *(getattr(rows, name) for rows in self.rows)])

    @cached_property
    def frame(self) -> FloatArray:
        """(n_contact, 2, 2) array: direction of contact and tangent of all contact nodes."""
        return np.concatenate([np.zeros((0, 2, 2)), *(rows.frame for rows in self.rows)])

    @cached_property
    def spread(self) -> ContactSpread:
        """The map from forces of contact nodes to tractions of elements."""
        return ContactSpread.of(self.bodies, self.rows)

    @cached_property
    def names(self) -> tuple[str, ...]:
        """The contact of each contact node."""
        return tuple(rows.name for rows in self.rows for _ in range(rows.n_contact))

    @property
    def acting_at(self) -> FloatArray:
        """(n_contact, 2) array [m]: where the force of each contact node acts on the body that it belongs to."""
        points = (rows.on_body @ dof_points(self.bodies[rows.body].space) for rows in self.rows)
        return np.concatenate([np.zeros((0, 2)), *points])

    @property
    def law(self) -> FrictionLaw:
        """The friction law of the contact nodes, in physical units.

        Raises
        ------
        LawError
            If a coefficient is not finite or negative somewhere; the message names the contact.
        """
        laws: dict[object, tuple[FrictionLaw, list[IntArray]]] = {}
        first = 0
        for rows in self.rows:
            numbers = first + np.arange(rows.n_contact)
            first += rows.n_contact
            for law, chosen in ((rows.law, ~rows.is_frictionless), (Frictionless(), rows.is_frictionless)):
                if not chosen.any():
                    continue
                is_uniform = isinstance(law, LawOfCoefficients) and law.is_uniform
                try:
                    evaluated = law if is_uniform else law.at(rows.points[chosen])
                except ValueError as error:
                    raise LawError(f"contact {rows.name!r}: friction law: {error}") from error
                laws.setdefault(law if is_uniform else first, (evaluated, []))[1].append(numbers[chosen])
        if len(laws) < 2:
            return next((law for law, _ in laws.values()), Frictionless())
        return PiecewiseLaw(*zip(*((law, np.concatenate(nodes)) for law, nodes in laws.values()), strict=True))

    @property
    def tangent_follows(self) -> BoolArray:
        """(n_contact,) bool array: nodes whose tangential displacement a support or a second obstacle gives."""
        return np.concatenate([np.zeros(0, bool), *(rows.tangent_follows for rows in self.rows)])

    @property
    def is_on_line(self) -> BoolArray:
        """(n_contact,) bool array: nodes of contacts between bodies that lie on a symmetry line."""
        return np.concatenate([np.zeros(0, bool), *(rows.is_on_line for rows in self.rows)])

    def map_data(self, number: int) -> GivenData:
        """Return the forces and displacements under which the map of a body is solved; see `given_data`."""
        return given_data(self.conditions[number], self.forces[number], self.insides[number])

    def under(self, assembly: Assembly) -> PreparedAssembly:
        """Return the same bodies under the loads, gaps and laws of another assembly, in the same units.

        Loads on a body are integrated again only if its parts or body forces are other objects than before.

        Parameters
        ----------
        assembly : Assembly
            Differs only in numbers of conditions and contacts.

        Raises
        ------
        InputError
            If its bodies have other names, a rigid body becomes another one, or a load drives another of its motions.
        """
        _check_rigid(self.assembly, assembly)
        following = _prepared(assembly, _under(assembly, self.bodies), self.units, self)
        pairs = zip(self.rows, following.rows, strict=False)
        if len(self.rows) == len(following.rows) and all(one.is_coupled_like(two) for one, two in pairs):
            following.__dict__["spread"] = self.spread
        return following

    def rows_under(self, assembly: Assembly) -> tuple[ContactRows, ...] | None:
        """Return the contacts of elastic bodies with the gaps and laws of another assembly, None if they are others."""
        before, after = self.assembly.elastic_contacts, assembly.elastic_contacts
        if len(before) != len(after) or any(
            replace(one, gap=0.0, law=None) != replace(two, gap=0.0, law=None)
            for one, two in zip(before, after, strict=True)
        ):
            return None
        return tuple(
            replace(rows, gap=rows.gap + (two.gap - one.gap), law=assembly.law_of(two))
            for rows, one, two in zip(self.rows, before, after, strict=False)
        )


def _first_of(names: Sequence[str]) -> str:
    return ", ".join(repr(name) for name in names[:6]) + (", ..." if len(names) > 6 else "")


def prepare_assembly_steps(
    assemblies: Sequence[Assembly], meshes: Mapping[str, BoundaryMesh] | None = None
) -> tuple[PreparedAssembly, ...]:
    """Prepare assemblies that follow each other in time, in the units of the largest load.

    All have the contacts that are found in the first one.

    Parameters
    ----------
    assemblies : sequence of Assembly
        Each with a single load.
    meshes : mapping of str to BoundaryMesh, optional
        Meshes of bodies by name, in the coordinates of their shapes.

    Raises
    ------
    GeometryError
        If a body cannot be divided, or sides in contact face away from each other.
    OverlapError
        If bodies overlap by more than the interference given.
    ConflictingSupportsError
        If supports contradict each other at a node.
    """
    bodies = place(assemblies[0], meshes)
    contacts = listed_contacts(assemblies[0], bodies)
    found = contacts[len(assemblies[0].contacts) :] if assemblies[0].touching else ()
    steps = [_with_found(step, found) for step in assemblies]
    for step in steps[1:]:
        _check_rigid(steps[0], step)
    units = max((find_common_units(step, _under(step, bodies)) for step in steps), key=lambda units: units.stress)
    first = _prepared(steps[0], _under(steps[0], bodies), units)
    return (first, *(first.under(step) for step in steps[1:]))


def _with_found(assembly: Assembly, found: Sequence[ContactPair]) -> Assembly:
    """Return an assembly that lists the contacts found in the first step, under its own law for touching bodies."""
    if assembly.touching is None:
        return assembly
    pairs = (replace(pair, law=assembly.touching.law) for pair in found)
    return assembly.with_contacts((*assembly.contacts, *pairs))


def find_common_units(assembly: Assembly, bodies: Sequence[PlacedBody]) -> Units:
    """Choose units by the largest load, the size of the largest body and the most compliant contact."""
    numbers = {body.name: body for body in bodies}
    length = max(body.mesh.diameter for body in bodies)
    moduli = [
        1.0 / sum(1.0 / numbers[body].material.plane_modulus for body, _ in pair.elastic_parts)
        for pair in assembly.contacts
    ]
    modulus = min(moduli, default=max(body.material.plane_modulus for body in bodies))
    sizes = [largest_sizes(body.scene, body.mesh, length) for body in bodies]
    motions = [motion for _, motion, _ in sizes]
    motions += [max(-pair.gap, pair.interference) for pair in assembly.contacts]
    motions += [float(np.abs(body.motion / [1.0, 1.0, 1.0 / length]).max()) for body in assembly.rigid]
    loads = [load for load, _, _ in sizes]
    loads += [float(np.abs(body.load / [length, length, length**2]).max()) for body in assembly.rigid]
    stress = max(*loads, max(motions) / length * modulus)
    stress = stress or max(gap for _, _, gap in sizes) / length * modulus or modulus
    units = Units(np.mean([body.mesh.centre for body in bodies], axis=0), length, modulus, stress)
    units.check_range()
    return units


def _under(assembly: Assembly, bodies: Sequence[PlacedBody]) -> tuple[PlacedBody, ...]:
    """Return placed bodies under the conditions of another assembly; InputError if it has bodies of other names."""
    names, others = ([body.name for body in some] for some in (bodies, assembly.placed_bodies))
    if names != others:
        raise InputError(
            f"the bodies are {_first_of(others)}, and those of the step before {_first_of(names)}: change numbers of "
            "conditions and contacts only"
        )
    pairs = zip(bodies, assembly.placed_bodies, strict=True)
    return tuple(body.under(other, assembly.scene_of(other)) for body, other in pairs)


def _prepared(
    assembly: Assembly, bodies: tuple[PlacedBody, ...], units: Units, before: PreparedAssembly | None = None
) -> PreparedAssembly:
    """Prepare placed bodies; bodies whose loads have not changed keep their conditions and forces."""
    force_unit = units.stress * units.length
    conditions: list[NodalConditions] = []
    forces: list[FloatArray] = []
    for number, body in enumerate(bodies):
        if before is not None and body.is_loaded_like(before.bodies[number]):
            conditions.append(before.conditions[number])
            forces.append(before.forces[number])
            continue
        own_units = body.units(units.modulus, force_unit)
        supports = supports_on(body.scene, body.own_mesh, own_units, body.own_space)
        conditions.append(supported(body.own_space, supports))
        in_place = body.units(units.modulus, force_unit, body.mesh)
        forces.append(body.turn.turned_back(nodal_forces(body.scene, body.mesh, body.space_in_place, in_place)))
    with_obstacles = tuple(obstacle_rows(assembly, bodies, conditions))
    between = None if before is None else before.rows_under(assembly)
    if between is None:
        between = tuple(body_rows(assembly, bodies, conditions, with_obstacles))
    rows = (*between, *with_obstacles)
    retained, insides = _retained(bodies, conditions, rows), _insides(bodies, units, before)
    return PreparedAssembly(assembly, bodies, units, retained, tuple(forces), rows, insides)


def _check_rigid(first: Assembly, other: Assembly) -> None:
    """Check that a load step has the rigid bodies of the first one."""
    for body, changed in zip_longest(first.rigid, other.rigid):
        if body is None or changed is None or _layout(body) != _layout(changed):
            raise InputError(
                f"rigid body {(body or changed).name!r} changes its shape, its place or what is given of it: change "
                "numbers only, or run the assembly on its own"
            )


def _layout(body: RigidBody) -> tuple[object, ...]:
    return body.name, body.obstacle, body.centre, body.is_driven.tolist()


def _insides(
    bodies: Sequence[PlacedBody], units: Units, before: PreparedAssembly | None
) -> tuple[ForcesInside | None, ...]:
    """Return the body forces of each body; copies with the same rotation share them."""
    known: dict[tuple[int, tuple[BodyForce, ...]], ForcesInside | None] = {}
    insides = []
    for number, body in enumerate(bodies):
        if before is not None and body.is_loaded_like(before.bodies[number]):
            insides.append(before.insides[number])
            continue
        forces = tuple(seen_from(force, body.turn) for force in body.body.body_forces)
        key = (id(body.own_mesh), forces)
        if key not in known:
            own_units = body.units(units.modulus, units.stress * units.length)
            known[key] = None
            if forces:
                scene = replace(body.scene, body_forces=forces)
                solution = particular_solution(scene, body.own_mesh, own_units.modulus, own_units.stress)
                known[key] = ForcesInside.of(solution, body.own_space)
        insides.append(known[key])
    return tuple(insides)


def _retained(
    bodies: Sequence[PlacedBody], conditions: Sequence[NodalConditions], rows: Sequence[ContactRows]
) -> tuple[NodalConditions, ...]:
    """Retain all nodes that a contact row involves, alike in all bodies that share a mesh."""
    touched = [np.zeros(body.space.n_dofs // 2, bool) for body in bodies]
    for one in rows:
        touched[one.body][one.on_body.indices] = True
        if isinstance(one.on_other, sparse.csr_array):
            touched[one.other][one.on_other.indices] = True
    for group in groups(bodies):
        union = np.any([touched[number] for number in group], axis=0)
        for number in group.tolist():
            touched[number] = union
    pairs = zip(conditions, touched, strict=True)
    return tuple(replace(of_body, is_retained=nodes[:, None] & ~of_body.is_fixed) for of_body, nodes in pairs)


def linear_solver(prepared: PreparedAssembly, number: int) -> ChosenLinearSolver:
    """Return the linear solver that the map of a body takes, and why."""
    body, conditions = prepared.bodies[number], prepared.conditions[number]
    requested, discretisation = prepared.assembly.linear_solver, body.scene.discretisation
    material = body.material.scaled(prepared.units.modulus)
    case = BodyCase(body.own_mesh, material, conditions, (prepared.map_data(number),), is_condensed=True)
    return linear_solver_of(requested, discretisation, case)
