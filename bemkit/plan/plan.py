"""The plan of a scene: counts exactly, memory and time as estimates; and the refusal of what does not fit."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

from bemkit.errors import InputError
from bemkit.geometry.mesh import BoundaryMesh
from bemkit.geometry.symmetry import Symmetry
from bemkit.model.prepared import Prepared, prepare_steps
from bemkit.operators.counts import OperationCounts
from bemkit.operators.linear.memory import physical_memory
from bemkit.operators.linear.solvers import LinearSolver
from bemkit.operators.steklov_poincare.needs import BodyCase, BodyNeeds, PlanItem
from bemkit.operators.steklov_poincare.nodal_conditions import GivenData
from bemkit.plan.items import Sizes, find_sizes, plan_items
from bemkit.scene.load_history import load_steps
from bemkit.scene.scene import Scene

_BYTES = 8
_CONTACT_STEPS = 8
"""Steps of Newton's method for a contact problem; they hardly depend on its size."""
_FLOPS_PER_NUMBER = 30.0
"""A number that is only moved through memory takes as long as so many flops of a factorisation."""
_SECONDS_PER_EVALUATION, _SECONDS_PER_FLOP, _LEAST_SECONDS = 2e-8, 1e-10, 0.1
"""Of a common computer: for a closed-form integral, for a flop of a factorisation, and for a scene of any size."""
_MANY = 10_000
"""Elements that are divided and planned in a moment, whether they fit or not."""
_FEW = 2_000
"""Elements of the mesh from whose plan larger ones are told."""


class TooLargeError(InputError):
    """A scene that does not fit into memory."""


@dataclass(frozen=True)
class Plan:
    """What a scene takes on a mesh.

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
        On a common computer; tells milliseconds from seconds from minutes.
    items : tuple of PlanItem
        In the order in which they are used.
    warnings : tuple of str
        What will be doubtful about the result, one sentence each.
    """

    linear_solver: LinearSolver
    sizes: Sizes
    work: OperationCounts
    memory: int
    seconds: float
    items: tuple[PlanItem, ...]
    warnings: tuple[str, ...] = ()

    def as_dict(self) -> dict[str, Any]:
        """Return the plan as JSON can hold it."""
        return {
            "memory": self.memory,
            "seconds": self.seconds,
            "work": self.work.as_dict(),
            "items": [item.as_dict() for item in self.items],
            "warnings": list(self.warnings),
        }


def make_plan(scene: Scene, mesh: BoundaryMesh, *, proposal: Symmetry | None = None) -> Plan:
    """Say what a scene needs on a mesh and what it leaves out, before anything expensive happens.

    Parameters
    ----------
    scene : Scene
    mesh : BoundaryMesh
        As made by `Scene.build_mesh`.
    proposal : Symmetry, optional
        A symmetry that the scene has but does not use, from `bemkit.scene.symmetry.find_symmetry`.

    Raises
    ------
    ValueError
        As `bemkit.model.prepared.prepare`.
    """
    return plan_steps(prepare_steps(load_steps(scene), mesh), proposal)


def plan_steps(steps: Sequence[Prepared], proposal: Symmetry | None = None) -> Plan:
    """Say what scenes that follow each other in time need; see `make_plan`."""
    first = steps[0]
    sizes = find_sizes(first)
    loads = tuple(GivenData.of(first.conditions, step.force, step.conditions.displacement) for step in steps)
    case = BodyCase(first.mesh, first.material, first.conditions, loads, first.linear_solver)
    needs = first.scene.discretisation.needs(case)
    return Plan(
        linear_solver=first.linear_solver.solver,
        sizes=sizes,
        work=needs.work + OperationCounts(contact_unknowns=sizes.n_contact_unknowns),
        memory=_memory(sizes, needs),
        seconds=_seconds(sizes, needs, len(steps)),
        items=plan_items(first.scene, sizes, needs.items, len(steps), proposal),
        warnings=needs.warnings,
    )


def _memory(sizes: Sizes, needs: BodyNeeds) -> int:
    """Return the largest memory: of the body while it is made, or of body and contact system together [bytes]."""
    r, c = sizes.n_open, sizes.n_contact_unknowns
    rows = 2 * sizes.n_contact * c  # the contact system before tangents without friction are taken out
    return max(needs.memory, needs.kept + int(_BYTES * (r * r + r * c + 4.2 * rows)))


def _seconds(sizes: Sizes, needs: BodyNeeds, n_steps: int) -> float:
    c, u = sizes.n_contact_unknowns, sizes.n_displacements
    of_step = 2.0 / 3.0 * c**3 + _FLOPS_PER_NUMBER * (60.0 * c * c + u * u) if c else 0.0
    flops = needs.flops + _CONTACT_STEPS * n_steps * of_step
    return _LEAST_SECONDS + _SECONDS_PER_EVALUATION * needs.evaluations + _SECONDS_PER_FLOP * flops


def check_memory(plan: Plan) -> None:
    """Refuse a plan whose matrices cannot fit into this computer.

    Raises
    ------
    TooLargeError
        Naming the memory needed, the memory there is, and the number of elements that fits.
    """
    _check(plan.sizes.n_elements, plan.memory)


def check_elements(scene: Scene) -> None:
    """Refuse a number of elements whose matrices cannot fit into this computer, before the mesh is made.

    Parameters
    ----------
    scene : Scene
        Memory grows with the square of the number of elements: the plan for a small mesh tells what a large one takes.

    Raises
    ------
    TooLargeError
        As `check_memory`.
    """
    n_elements = scene.mesh.elements
    if n_elements is None or n_elements <= _MANY:
        return
    small = replace(scene, mesh=replace(scene.mesh, elements=_FEW))
    plan = make_plan(small, small.build_mesh())
    growth = n_elements / _FEW
    _check(int(growth * plan.sizes.n_elements), int(growth**2 * plan.memory))


def _check(n_elements: int, memory: int) -> None:
    available = physical_memory()
    if memory > available:
        n_fitting = int((available / memory) ** 0.5 * n_elements)
        raise TooLargeError(
            f"{n_elements} elements need about {memory / 1e9:.3g} GB, this computer has {available / 1e9:.3g} GB: "
            f"use at most {n_fitting} elements"
        )
