"""The plan of a scene: needed and skipped items with reasons, counts, memory and time; checks of memory."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

from bemkit.errors import InputError, ResultWarning, first_of_each_kind
from bemkit.model.placed import Meshes, groups
from bemkit.model.prepared import Prepared, prepare_steps
from bemkit.notebook import ShownInNotebooks
from bemkit.operators.counts import OperationCounts
from bemkit.operators.linear_solvers import LinearSolver
from bemkit.plan.costs import BYTES, CONTACT_STEPS, SECONDS_PER_FLOP, BodyCase, cost_of, physical_memory
from bemkit.plan.items import PlanItem, Sizes, find_sizes, items_of_one, items_of_several
from bemkit.scene.scene import Scene
from bemkit.stopwatch import announce

if TYPE_CHECKING:
    from bemkit.geometry.outline import Outline
    from bemkit.geometry.symmetry.lines import Symmetry
    from bemkit.scene.body_scene import BodyScene

_FLOPS_PER_NUMBER = 30.0
"""Flops of a factorisation in the time that a number takes to move through memory."""
LEAST_SECONDS = 0.1
"""Seconds of a common computer for a scene of any size."""
_MANY = 10_000
"""Elements that are divided and planned in a moment, whether they fit or not."""
_FEW = 4_000
"""Elements of the mesh from whose plan larger ones are extrapolated, but no fewer than its sides need."""
_OF_SIDE = 4
"""Elements of a side on a coarse mesh; no mesh has less than one between two ends of sides and parts."""
_FILL = 6.0
"""Entries of the factors of a sparse contact system for each entry of the matrix, from walls of 100 to 1000 blocks."""


class TooLargeError(InputError):
    """A scene that does not fit into memory."""


@dataclass(frozen=True)
class Plan(ShownInNotebooks):
    """Costs of a scene on a mesh.

    Parameters
    ----------
    linear_solver : LinearSolver
        The one taken for a symmetric map.
    sizes : Sizes
    work : OperationCounts
        The counts that `Solution.work` will show if all load steps converge.
    memory : int [bytes]
        Largest sum of all arrays that exist at the same time.
    seconds : float [s]
        On a common computer; its order of magnitude is right.
    items : tuple of PlanItem
        In the order in which they are used.
    warnings : tuple of ResultWarning
        What to check in the result, known before the solve.
    is_compressed : bool
        Whether the equations are compressed over a tree, so that memory grows like the number of elements.
    """

    linear_solver: LinearSolver
    sizes: Sizes
    work: OperationCounts
    memory: int
    seconds: float
    items: tuple[PlanItem, ...]
    warnings: tuple[ResultWarning, ...] = ()
    is_compressed: bool = False

    def __repr__(self) -> str:
        """Return one line."""
        return f"Plan({self.sizes.n_elements} elements, {self.memory / 1e6:.3g} MB, about {self.seconds:.2g} s)"

    def __str__(self) -> str:
        """Return memory and time, and a line for each item, needed or skipped."""
        lines = (f"{each.name}: {'' if each.is_needed else 'skipped, '}{each.reason}" for each in self.items)
        return "\n".join([repr(self), *lines])

    def as_dict(self) -> dict[str, Any]:
        """Return the plan as JSON can hold it."""
        return {
            "memory": self.memory,
            "seconds": self.seconds,
            "work": self.work.as_dict(),
            "items": [item.as_dict() for item in self.items],
            "warnings": [warning.as_dict() for warning in self.warnings],
        }


def make_plan(scene: Scene, meshes: Meshes = None, *, proposal: Symmetry | None = None) -> Plan:
    """Return the plan of a scene, before any expensive computation.

    Parameters
    ----------
    scene : Scene
    meshes : BoundaryMesh or mapping of str to BoundaryMesh, optional
        Meshes of bodies by name, or that of the only body; by default what the scene describes.
    proposal : Symmetry, optional
        A symmetry that the scene has but does not use, from `bemkit.scene.symmetry.find_symmetry`.

    Raises
    ------
    ValueError
        As `bemkit.model.prepared.prepare_steps`.
    """
    from bemkit.scene.load_history import load_steps

    return plan_steps(prepare_steps(load_steps(scene), meshes), proposal)


def plan_steps(steps: Sequence[Prepared], proposal: Symmetry | None = None) -> Plan:
    """Return the plan of the scenes of a load history: sums over bodies, and the contact system.

    The linear solver is that of the largest body.
    """
    first = steps[0]
    firsts = [int(group[0]) for group in groups(first.bodies)]
    cases, drawn = [_case_of(steps, number) for number in firsts], [first.bodies[number] for number in firsts]
    costs = [cost_of(case) for case in cases]
    sizes = find_sizes(first)
    linear_solver = first.linear_solver(max(first.bodies, key=lambda body: body.space.n_dofs))
    contact = _ContactSystem.of(first, sizes, forms_matrix=not any(each.forms_no_matrix for each in cases))
    kept = sum(each.kept for each in costs)
    seconds = LEAST_SECONDS + CONTACT_STEPS * len(steps) * SECONDS_PER_FLOP * contact.flops
    if first.scene.has_obstacles_only:
        items = items_of_one(first.only.scene, sizes, cases[0], len(steps), proposal)
    else:
        items = tuple(items_of_several(first, sizes, len(steps), is_dense=contact.is_dense))
    thinness = [warning for body in drawn for warning in first.thinness_warnings(body)]
    of_profiles = [warning for body in drawn for warning in _profile_warnings(body.scene)]
    of_contacts = [*map(_too_short, first.unresolved), *_mixed_planes(first)]
    return Plan(
        linear_solver=linear_solver.solver,
        sizes=sizes,
        work=sum((each.work for each in costs), OperationCounts(contact_unknowns=sizes.n_contact_unknowns)),
        memory=int(kept + max(contact.memory, *(each.memory - each.kept for each in costs))),
        seconds=seconds + sum(each.seconds for each in costs),
        items=items,
        warnings=first_of_each_kind(dict.fromkeys([*thinness, *of_profiles, *of_contacts])),
        is_compressed=linear_solver.hierarchical is not None,
    )


def _too_short(contact: str) -> ResultWarning:
    text = (
        f"Contact {contact!r} is shorter than a hundredth of its elements and skipped: use more elements, or move the "
        "bodies so that these sides share more or nothing."
    )
    return ResultWarning("contact too short", contact, text)


def _mixed_planes(prepared: Prepared) -> Iterator[ResultWarning]:
    """Warn of contacts between a body in plane stress and one in plane strain."""
    for rows in prepared.rows:
        pair = [prepared.bodies[number] for number in (rows.body, rows.other) if 0 <= number < len(prepared.bodies)]
        if len({body.material.plane for body in pair}) > 1:
            states = " and ".join(f"{body.title} in plane {body.material.plane.value}" for body in pair)
            text = f"Contact {rows.name!r} joins {states}: give both materials the same plane state."
            yield ResultWarning("mixed plane states", rows.name, text)


def _profile_warnings(scene: BodyScene) -> Iterator[ResultWarning]:
    if scene.may_touch_profiles:
        from bemkit.scene.profiles import profile_warnings

        yield from profile_warnings(scene.obstacles, scene.units)


def _case_of(steps: Sequence[Prepared], number: int) -> BodyCase:
    first, body = steps[0], steps[0].bodies[number]
    loads = tuple(step.bodies[number].map_data for step in steps)
    return BodyCase(first.elastic_map(body), body.conditions, loads, first.is_condensed, first.linear_solver(body))


@dataclass(frozen=True)
class _ContactSystem:
    """Memory [bytes] of the contact system, flops of one of its steps, and whether it is one dense matrix."""

    memory: float
    flops: float
    is_dense: bool

    @classmethod
    def of(cls, prepared: Prepared, sizes: Sizes, *, forms_matrix: bool) -> _ContactSystem:
        """Count the numbers of the matrix of relative displacements and of its factors."""
        n, u = sizes.n_contact_unknowns + sizes.n_free_motions, sizes.n_displacements
        if not forms_matrix or not prepared.n_contact:
            return cls(0.0, 0.0, is_dense=True)
        if prepared.scene.has_obstacles_only or n <= _most_dense():
            flops = 2.0 / 3.0 * n**3 + _FLOPS_PER_NUMBER * (60.0 * n * n + u * u)
            return cls(6.0 * BYTES * n**2, flops, is_dense=True)
        coupled = sum(body.conditions.n_retained**2 for body in prepared.bodies)
        return cls(BYTES * _FILL * coupled, 40.0 * _FILL * coupled, is_dense=False)


def _most_dense() -> int:
    from bemkit.contact.joined.joined_bodies import MOST_DENSE  # single bodies are planned without it

    return MOST_DENSE


def announce_plan(plan: Plan) -> None:
    """Announce the size and the expected time of the next mesh to progress displays."""
    announce(f"{plan.sizes.n_elements} elements", plan.seconds)


def check_memory(plan: Plan) -> None:
    """Check that the matrices of a plan fit into this computer.

    Raises
    ------
    TooLargeError
        Naming the memory needed, the memory there is, and the number of elements that fits.
    """
    _check(plan.sizes.n_elements, plan.memory, plan.is_compressed)


def check_elements(scene: Scene) -> None:
    """Check, before the mesh is made, that the matrices for a number of elements fit into this computer.

    Memory grows with the square of that number, or linearly where the equations are compressed: the plans for small
    meshes predict the cost of a large one. Half-planes of many elements have no matrices.

    Raises
    ------
    TooLargeError
        As `check_memory`.
    """
    if len(scene.placed_bodies) > 1:
        return
    n_elements, outline = scene.only.mesh.elements, scene.only.shape.outline()
    few = max(_FEW, few_on(outline))
    if n_elements is None or n_elements <= max(_MANY, few) or outline.surface is not None:
        return
    plan, growth = _plan_of(scene, few), n_elements / few
    if plan.is_compressed:  # on meshes where what does not grow is all there
        one, two = (_plan_of(scene, factor * few).memory for factor in (2, 4))
        memory = one + int((0.5 * growth - 1.0) * (two - one))
    else:
        memory = int(growth**2 * plan.memory)
    _check(int(growth * plan.sizes.n_elements), memory, plan.is_compressed)


def few_on(outline: Outline) -> int:
    """Return the least number of elements for a coarse mesh of an outline."""
    return _OF_SIDE * len(outline.sides)


def _plan_of(scene: Scene, n_elements: int) -> Plan:
    scene = replace(scene, mesh=replace(scene.mesh, elements=n_elements))
    return make_plan(scene)


def _check(n_elements: int, memory: int, is_compressed: bool) -> None:
    available = physical_memory()
    if memory > available:
        n_fitting = int((available / memory) ** (1.0 if is_compressed else 0.5) * n_elements)
        raise TooLargeError(
            f"{n_elements} elements need about {memory / 1e9:.3g} GB, there are {available / 1e9:.3g} GB: "
            f"use at most {n_fitting} elements"
        )
