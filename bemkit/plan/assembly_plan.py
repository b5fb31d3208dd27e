"""The plan of an assembly: what its bodies and contacts need, and what is skipped."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from bemkit.contact.joined.joined_bodies import MOST_DENSE
from bemkit.contact.joined.sparse_form import sparse_solver_name
from bemkit.model.assembled.placed import PlacedBody, groups
from bemkit.model.assembled.prepared import PreparedAssembly, linear_solver, prepare_assembly_steps
from bemkit.operators.counts import OperationCounts
from bemkit.operators.rigid_modes import admissible_modes
from bemkit.operators.steklov_poincare.needs import CONTACT_STEPS, BodyCase, BodyNeeds, PlanItem, seconds_of
from bemkit.operators.steklov_poincare.nodal_conditions import free_modes
from bemkit.plan.plan import LEAST_SECONDS, Plan, Sizes, friction_item, further_meshes, last_items
from bemkit.scene.assembly import Assembly
from bemkit.scene.load_history import load_steps

_BYTES = 8
_FILL = 6.0
"""Numbers in the factors of a sparse contact system for each one in the matrix: of walls of 100 to 1000 blocks."""


_MOST_NAMED = 12
"""Different bodies up to which each has a line of its own."""


def plan_assembly(steps: Sequence[PreparedAssembly]) -> Plan:
    """Say what an assembly needs, before anything expensive happens.

    Parameters
    ----------
    steps : sequence of PreparedAssembly
        One for each load step.

    Returns
    -------
    Plan
        Its sizes are sums over all bodies, its linear solver that of the largest one.
    """
    first = steps[0]
    shapes = groups(first.bodies)
    needs = [_needs(steps, int(group[0])) for group in shapes]
    sizes = _sizes(first)
    n_unknowns = sizes.n_contact_unknowns + sizes.n_free_motions
    is_dense = n_unknowns <= MOST_DENSE
    coupled = sum(len(condition.is_retained[condition.is_retained]) ** 2 for condition in first.conditions)
    contact = _BYTES * (6 * n_unknowns**2 if is_dense else _FILL * coupled)
    flops = float(sum(each.flops for each in needs))
    flops += CONTACT_STEPS * len(steps) * (2.0 / 3.0 * n_unknowns**3 if is_dense else 40.0 * _FILL * coupled)
    kept = sum(each.kept for each in needs)
    largest = max(range(len(first.bodies)), key=lambda number: first.bodies[number].space.n_dofs)
    return Plan(
        linear_solver=linear_solver(first, largest).solver,
        is_compressed=linear_solver(first, largest).hierarchical is not None,
        sizes=sizes,
        work=sum((each.work for each in needs), OperationCounts(contact_unknowns=sizes.n_contact_unknowns)),
        memory=int(kept + max(contact, *(each.memory - each.kept for each in needs))),
        seconds=LEAST_SECONDS + seconds_of(sum(each.evaluations for each in needs), flops),
        items=tuple(_items(first, sizes, len(steps), is_dense=is_dense)),
        warnings=tuple(dict.fromkeys(warning for each in needs for warning in each.warnings)),
    )


def _needs(steps: Sequence[PreparedAssembly], number: int) -> BodyNeeds:
    first = steps[0]
    body, conditions = first.bodies[number], first.conditions[number]
    loads = tuple(step.map_data(number) for step in steps)
    material = body.material.scaled(first.units.modulus)
    case = BodyCase(body.own_mesh, material, conditions, loads, linear_solver(first, number), is_condensed=True)
    return body.scene.discretisation.needs(case)


def _sizes(prepared: PreparedAssembly) -> Sizes:
    """Sum up the sizes of all bodies."""
    bodies, conditions = prepared.bodies, prepared.conditions
    tractions = [body.scene.discretisation.traction_space(body.mesh) for body in bodies]
    return Sizes(
        n_elements=sum(body.mesh.n_elements for body in bodies),
        n_curved=sum(int(np.count_nonzero(~body.mesh.is_straight)) for body in bodies),
        n_loops=sum(len(body.mesh.loops) for body in bodies),
        n_sources=sum(body.mesh.n_elements for body in bodies),
        displacement_degree=max(body.space.degree for body in bodies),
        traction_degree=max(space.degree for space in tractions),
        n_displacements=sum(body.space.n_dofs for body in bodies),
        n_tractions=sum(space.n_dofs for space in tractions),
        n_fixed=sum(int(np.count_nonzero(each.is_fixed)) for each in conditions),
        n_free=sum(int(np.count_nonzero(each.is_free)) for each in conditions),
        n_open=sum(int(np.count_nonzero(each.is_retained)) for each in conditions),
        n_contact=prepared.n_contact,
        n_contact_unknowns=2 * prepared.n_contact - int(np.count_nonzero(prepared.tangent_follows)),
        n_motions=sum(len(admissible_modes(body.mesh)) for body in bodies) + 3 * len(prepared.assembly.rigid),
        n_free_motions=_n_driven(prepared.assembly)
        + sum(len(free_modes(body.own_space, each)) for body, each in zip(bodies, conditions, strict=True)),
    )


def _items(prepared: PreparedAssembly, sizes: Sizes, n_steps: int, *, is_dense: bool) -> Iterator[PlanItem]:
    assembly = prepared.assembly
    shapes = [[prepared.bodies[number] for number in group] for group in groups(prepared.bodies)]
    n_bodies = len(prepared.bodies)
    yield PlanItem("bodies", True, f"{n_bodies}, of {len(shapes)} that are assembled and factored")
    shared = n_bodies - len(shapes)
    reason = f"{shared} bodies share what another one has" if shared else "every body differs, or is held by supports"
    yield PlanItem("copies", shared > 0, reason)
    for bodies in shapes[:_MOST_NAMED]:
        yield PlanItem(f"body {_names(bodies)}", True, _body_line(bodies[0]))
    if len(shapes) > _MOST_NAMED:
        yield PlanItem(f"{len(shapes) - _MOST_NAMED} bodies more", True, "of the same kinds")
    yield further_meshes(assembly.mesh.accuracy, "the numbers of elements are given", "first meshes")
    n_pairs = len(assembly.elastic_contacts)
    n_fixed = sum(rows.other < 0 for rows in prepared.rows)
    yield PlanItem("contacts between bodies", n_pairs > 0, f"{n_pairs}, coupled by mortar integrals")
    yield PlanItem("rigid obstacles", n_fixed > 0, f"{n_fixed} parts face them" if n_fixed else "no part faces one")
    n_rigid = len(assembly.rigid)
    moving = f"{n_rigid} in {len(assembly.contacts) - n_pairs} contacts, {_n_driven(assembly)} motions driven by loads"
    yield PlanItem("rigid bodies", n_rigid > 0, moving if n_rigid else "there are none")
    yield friction_item(rows.law for rows in prepared.rows)
    form = "one dense matrix of relative displacements"
    if not is_dense:
        form = f"a sparse system, factored in every step by {sparse_solver_name()}"
    yield PlanItem("contact system", True, f"{sizes.n_contact} nodes, {sizes.n_contact_unknowns} unknowns: {form}")
    modes = "supports hold all bodies"
    if sizes.n_free_motions:
        modes = f"{sizes.n_free_motions} of {sizes.n_motions} rigid motions are held only by contact"
    yield PlanItem("rigid motions as unknowns", sizes.n_free_motions > 0, modes)
    yield from last_items(n_steps, "fields inside the bodies")


def _n_driven(assembly: Assembly) -> int:
    """Return how many motions of rigid bodies are unknown."""
    return sum(int(np.count_nonzero(body.is_driven)) for body in assembly.rigid)


def _names(bodies: Sequence[PlacedBody]) -> str:
    return bodies[0].name if len(bodies) == 1 else f"{bodies[0].name} and {len(bodies) - 1} copies"


def _body_line(body: PlacedBody) -> str:
    method, mesh = body.scene.discretisation.method, body.own_mesh
    return f"{mesh.n_elements} elements, {body.space.n_dofs} displacements ({method})"


def make_assembly_plan(assembly: Assembly) -> Plan:
    """Plan an assembly; see `plan_assembly`."""
    return plan_assembly(prepare_assembly_steps(load_steps(assembly)))
