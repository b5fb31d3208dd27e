"""The plan of a scene: what it needs, what it skips and why, counts, memory and time; refusal of what does not fit."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from bemkit.contact.condensation.nodes import following_tangents
from bemkit.contact.laws import FrictionLaw
from bemkit.errors import InputError
from bemkit.geometry.mesh import BoundaryMesh
from bemkit.geometry.outline import Outline
from bemkit.geometry.symmetry import Symmetry
from bemkit.model.prepared import Prepared, prepare_steps
from bemkit.notebook import ShownInNotebooks
from bemkit.operators.counts import OperationCounts
from bemkit.operators.linear.solvers import LinearSolver
from bemkit.operators.rigid_modes import admissible_modes
from bemkit.operators.steklov_poincare.needs import (
    CONTACT_STEPS,
    BodyCase,
    BodyNeeds,
    PlanItem,
    physical_memory,
    seconds_of,
)
from bemkit.result_warning import ResultWarning
from bemkit.scene.load_history import load_steps
from bemkit.scene.registry import BODY_FORCES
from bemkit.scene.scene import Scene
from bemkit.stopwatch import announce

_BYTES = 8
_FLOPS_PER_NUMBER = 30.0
"""A number that is only moved through memory takes as long as so many flops of a factorisation."""
LEAST_SECONDS = 0.1
"""Of a common computer, for a scene of any size."""
_MANY = 10_000
"""Elements that are divided and planned in a moment, whether they fit or not."""
_FEW = 4_000
"""Elements of the mesh from whose plan larger ones are extrapolated."""
_OF_SIDE = 4
"""Elements of a side on a coarse mesh; no mesh has less than one between two ends of sides and parts."""
_DEGREES = ("constant", "linear", "quadratic")


@dataclass(frozen=True)
class Sizes:
    """Numbers of elements and unknowns.

    Parameters
    ----------
    n_elements, n_curved, n_loops : int
        Elements, those of them that are curved, and closed curves of the boundary.
    n_sources : int
        Elements of the whole body, images by symmetry included.
    displacement_degree, traction_degree : int
        Of the polynomials on each element.
    n_displacements, n_tractions : int
        Components at all nodes of the two spaces.
    n_fixed, n_free, n_open : int
        Displacement components that supports prescribe, that carry a known force, and that contact decides.
    n_contact, n_contact_unknowns : int
        Contact nodes, and the order of their system.
    n_motions, n_free_motions : int
        Rigid motions that cause no traction (3, or none on an exterior), and those of them that no support holds.
    """

    n_elements: int
    n_curved: int
    n_loops: int
    n_sources: int
    displacement_degree: int
    traction_degree: int
    n_displacements: int
    n_tractions: int
    n_fixed: int
    n_free: int
    n_open: int
    n_contact: int
    n_contact_unknowns: int
    n_motions: int
    n_free_motions: int


def find_sizes(prepared: Prepared) -> Sizes:
    """Count the elements and unknowns of a prepared scene."""
    mesh, conditions, nodes = prepared.mesh, prepared.conditions, prepared.contact.nodes
    n_contact, tractions = nodes.nodes.size, prepared.scene.discretisation.traction_space(prepared.space.mesh)
    return Sizes(
        n_elements=mesh.n_elements,
        n_curved=int(np.count_nonzero(~mesh.is_straight)),
        n_loops=len(mesh.loops),
        n_sources=mesh.whole.n_elements,
        displacement_degree=prepared.space.degree,
        traction_degree=tractions.degree,
        n_displacements=prepared.space.n_dofs,
        n_tractions=tractions.n_dofs,
        n_fixed=int(np.count_nonzero(conditions.is_fixed)),
        n_free=int(np.count_nonzero(conditions.is_free)),
        n_open=int(np.count_nonzero(conditions.is_retained)),
        n_contact=n_contact,
        n_contact_unknowns=2 * n_contact - int(np.count_nonzero(following_tangents(conditions, nodes))),
        n_motions=len(admissible_modes(mesh)),
        n_free_motions=len(prepared.free_modes),
    )


def plan_items(
    scene: Scene, sizes: Sizes, of_body: tuple[PlanItem, ...], n_steps: int, proposal: Symmetry | None = None
) -> tuple[PlanItem, ...]:
    """List what a scene needs and what it skips, in the order of use.

    Besides the sizes that is what the discretisation says of its map, the number of load steps, and a symmetry that the
    scene has but does not use.
    """
    return (
        *_mesh_items(scene, sizes, proposal),
        *of_body,
        _body_force_item(scene),
        *_contact_items(scene, sizes, n_steps),
        *last_items(n_steps, "displacement inside the body", "stress inside the body"),
    )


def further_meshes(accuracy: float | None, given: str, first: str) -> PlanItem:
    """Say whether meshes follow the solution, in words for what is given otherwise and for what is planned first."""
    reason = given
    if accuracy is not None:
        reason = f"until the estimated error is below {accuracy:g}; this plan is for the {first}"
    return PlanItem("further meshes", accuracy is not None, reason)


def friction_item(laws: Iterable[FrictionLaw], kind: str = "") -> PlanItem:
    """Say which laws there are."""
    names = ", ".join(dict.fromkeys(type(law).__name__ for law in laws if not law.is_frictionless))
    return PlanItem("friction", bool(names), f"law {names}{kind}" if names else "the law allows no tangential traction")


def last_items(n_steps: int, *inside: str) -> Iterator[PlanItem]:
    """Yield what follows the contact system; fields inside by the names they have."""
    history = f"{n_steps} load steps; slip counts from the end of the step before"
    yield PlanItem("load history", n_steps > 1, history if n_steps > 1 else "the whole load comes in one step")
    yield PlanItem("fields on the boundary", True, "part of every result")
    for name in inside:
        yield PlanItem(name, False, "not asked for; see interior_fields")
    yield PlanItem("result file (h5py)", False, "no part of the solve; loaded and written after it where asked for")
    yield PlanItem("figures (matplotlib)", False, "no part of the solve; loaded and drawn after it where asked for")


def _mesh_items(scene: Scene, sizes: Sizes, proposal: Symmetry | None) -> Iterator[PlanItem]:
    """Yield what elements, symmetry and spaces need."""
    n, n_curved = sizes.n_elements, sizes.n_curved
    outline = scene.shape.outline()
    if outline.drawing is not None:
        read = "; ".join(outline.drawing.notes) or "taken as it is"
        yield PlanItem("drawn outline", True, f"{_count(len(outline.sides), 'side')}; {read}")
    yield PlanItem("elements", True, f"{n} on {_count(sizes.n_loops, 'closed curve')}")
    yield further_meshes(scene.mesh.accuracy, "the number of elements is given", "first mesh")
    curved = f"{n_curved} of {n} elements are curved" if n_curved else "all elements are straight"
    yield PlanItem("quadrature on curved elements", n_curved > 0, curved)
    if not sizes.n_motions and scene.symmetry is None:
        where = "outside of the boundary" if outline.surface is None else "half-plane below its surface"
        yield PlanItem("exterior domain", True, f"the body fills the {where}")
    reason = "not asked for"
    if scene.symmetry is not None:
        reason = f"about {scene.symmetry}: {n} of {sizes.n_sources} elements carry unknowns"
    elif proposal is not None:
        share = "half" if proposal.n_images == 2 else "a quarter"
        reason = f"proposed: the scene is symmetric about {proposal}, and {share} of its unknowns would do"
    yield PlanItem("symmetry", scene.symmetry is not None, reason)
    displacements, tractions = (
        _DEGREES[degree] if degree < len(_DEGREES) else f"degree {degree}"
        for degree in (sizes.displacement_degree, sizes.traction_degree)
    )
    reason = (
        f"{scene.discretisation.method}: {sizes.n_displacements} displacements and {sizes.n_tractions} tractions, "
        f"{sizes.n_fixed} of the displacements held, {sizes.n_open} retained for contact"
    )
    yield PlanItem(f"{displacements} displacements, {tractions} tractions", True, reason)


def _body_force_item(scene: Scene) -> PlanItem:
    kinds = ", ".join(dict.fromkeys(BODY_FORCES.kind_of(force) for force in scene.body_forces))
    reason = f"{kinds}, in closed form: no elements inside the body" if kinds else "nothing acts inside the body"
    return PlanItem("particular solution", bool(kinds), reason)


def _contact_items(scene: Scene, sizes: Sizes, n_steps: int) -> Iterator[PlanItem]:
    """Yield what contact needs."""
    c, n, n_free = sizes.n_contact_unknowns, sizes.n_contact, sizes.n_free_motions
    if not scene.contact_parts:
        yield PlanItem("contact system", False, "no part may touch an obstacle: the body is solved at once")
        return
    yield PlanItem("contact system", True, f"{n} nodes may touch; every contact step solves for {c} unknowns")
    yield PlanItem("second elastic body", False, "the obstacles are rigid")
    yield friction_item(scene.laws.values(), ", static" if n_steps == 1 else ", incremental")
    tangential = f"{c - n} of {_count(n, 'contact node')}" if c > n else "supports give all of them"
    yield PlanItem("tangential unknowns", c > n, tangential)
    modes = "the supports hold all rigid motions"
    if n_free:
        modes = f"{n_free} of {sizes.n_motions} rigid motions {'is' if n_free == 1 else 'are'} held only by contact"
    yield PlanItem("rigid motions as unknowns", n_free > 0, modes)


def _count(number: int, name: str) -> str:
    return f"{number} {name}" if number == 1 else f"{number} {name}s"


class TooLargeError(InputError):
    """A scene that does not fit into memory."""


@dataclass(frozen=True)
class Plan(ShownInNotebooks):
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

    def as_dict(self) -> dict[str, Any]:
        """Return the plan as JSON can hold it."""
        return {
            "memory": self.memory,
            "seconds": self.seconds,
            "work": self.work.as_dict(),
            "items": [item.as_dict() for item in self.items],
            "warnings": [warning.as_dict() for warning in self.warnings],
        }


def make_plan(scene: Scene, mesh: BoundaryMesh, *, proposal: Symmetry | None = None) -> Plan:
    """Return what a scene needs on a mesh and what it skips, before anything expensive happens.

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
    loads = tuple(step.map_data for step in steps)
    case = BodyCase(first.space.mesh, first.material, first.conditions, loads, first.linear_solver, first.is_condensed)
    needs = first.scene.discretisation.needs(case)
    return Plan(
        linear_solver=first.linear_solver.solver,
        sizes=sizes,
        work=needs.work + OperationCounts(contact_unknowns=sizes.n_contact_unknowns),
        memory=_memory(sizes, needs),
        seconds=_seconds(sizes, needs, len(steps)),
        items=plan_items(first.scene, sizes, needs.items, len(steps), proposal),
        warnings=needs.warnings,
        is_compressed=first.linear_solver.hierarchical is not None,
    )


def _memory(sizes: Sizes, needs: BodyNeeds) -> int:
    """Return the largest memory: of the body while it is made, or of body and contact system together [bytes]."""
    if needs.is_matrix_free:
        return needs.memory
    r, c = sizes.n_open, sizes.n_contact_unknowns
    rows = 2 * sizes.n_contact * c  # the contact system before tangents without friction are taken out
    return max(needs.memory, needs.kept + int(_BYTES * (r * r + r * c + 4.2 * rows)))


def _seconds(sizes: Sizes, needs: BodyNeeds, n_steps: int) -> float:
    c, u = sizes.n_contact_unknowns, sizes.n_displacements
    if needs.is_matrix_free:
        c = u = 0
    of_step = 2.0 / 3.0 * c**3 + _FLOPS_PER_NUMBER * (60.0 * c * c + u * u) if c else 0.0
    return LEAST_SECONDS + seconds_of(needs.evaluations, needs.flops + CONTACT_STEPS * n_steps * of_step)


def announce_plan(plan: Plan) -> None:
    """Say how large the next mesh is and how long it will take, to those who listen."""
    announce(f"{plan.sizes.n_elements} elements", plan.seconds)


def check_memory(plan: Plan) -> None:
    """Refuse a plan whose matrices cannot fit into this computer.

    Raises
    ------
    TooLargeError
        Naming the memory needed, the memory there is, and the number of elements that fits.
    """
    _check(plan.sizes.n_elements, plan.memory, plan.is_compressed)


def check_elements(scene: Scene) -> None:
    """Refuse a number of elements whose matrices cannot fit into this computer, before the mesh is made.

    Memory grows with the square of that number, or linearly where the equations are compressed: the plans for small
    meshes predict the cost of a large one. A periodic half-plane has no matrices.

    Raises
    ------
    TooLargeError
        As `check_memory`.
    """
    n_elements, outline = scene.mesh.elements, scene.shape.outline()
    few = max(_FEW, few_on(outline))
    is_periodic = outline.surface is not None and outline.surface.is_periodic
    if n_elements is None or n_elements <= max(_MANY, few) or is_periodic:
        return
    plan, growth = _plan_of(scene, few), n_elements / few
    if plan.is_compressed:  # on meshes where what does not grow is all there
        one, two = (_plan_of(scene, factor * few).memory for factor in (2, 4))
        memory = one + int((0.5 * growth - 1.0) * (two - one))
    else:
        memory = int(growth**2 * plan.memory)
    _check(int(growth * plan.sizes.n_elements), memory, plan.is_compressed)


def few_on(outline: Outline) -> int:
    """Return how many elements an outline takes at least, so that coarse meshes of it are possible."""
    return _OF_SIDE * len(outline.sides)


def _plan_of(scene: Scene, n_elements: int) -> Plan:
    scene = replace(scene, mesh=replace(scene.mesh, elements=n_elements))
    return make_plan(scene, scene.build_mesh())


def _check(n_elements: int, memory: int, is_compressed: bool) -> None:
    available = physical_memory()
    if memory > available:
        n_fitting = int((available / memory) ** (1.0 if is_compressed else 0.5) * n_elements)
        raise TooLargeError(
            f"{n_elements} elements need about {memory / 1e9:.3g} GB, there are {available / 1e9:.3g} GB: "
            f"use at most {n_fitting} elements"
        )
