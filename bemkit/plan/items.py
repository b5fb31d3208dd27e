"""What a plan needs and what it leaves out, each with its reason, stage and cost."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any

from bemkit.geometry.symmetry import Symmetry
from bemkit.operators.linear.choice import krylov_cost
from bemkit.operators.linear.solvers import Krylov
from bemkit.plan.costs import CONTACT_STEPS, FLOPS_PER_NUMBER, Cost, Stage, assembly
from bemkit.plan.decisions import Decisions, Formulation
from bemkit.plan.machine import Machine
from bemkit.plan.sizes import Sizes
from bemkit.scene.scene import Scene

_BYTES = 8
_DEGREES = ("constant", "linear", "quadratic")


@dataclass(frozen=True)
class Wishes:
    """Outputs that somebody has asked for.

    Parameters
    ----------
    result_file, figures : bool
    """

    result_file: bool = False
    figures: bool = False


@dataclass(frozen=True)
class PlanItem:
    """One thing that is needed or left out.

    Parameters
    ----------
    name : str
    is_needed : bool
    reason : str
    stage : Stage
        The part of the run that it belongs to.
    cost : Cost
        What it takes; nothing if it is left out.
    """

    name: str
    is_needed: bool
    reason: str
    stage: Stage
    cost: Cost = field(default_factory=Cost)

    def as_dict(self, machine: Machine | None = None) -> dict[str, Any]:
        """Return the entries as JSON can hold them, with the time if a computer is given."""
        entries = {
            "name": self.name,
            "needed": self.is_needed,
            "reason": self.reason,
            "stage": self.stage.value,
            "flops": self.cost.flops,
            "size": self.cost.size,
        }
        return entries if machine is None else {**entries, "seconds": self.cost.seconds(machine)}


def plan_items(
    scene: Scene, decisions: Decisions, sizes: Sizes, why_solver: str, proposal: Symmetry | None = None
) -> tuple[PlanItem, ...]:
    """Say what a scene needs and what it leaves out, in the order in which it is used.

    Parameters
    ----------
    scene : Scene
    decisions : Decisions
    sizes : Sizes
    why_solver : str
        Why the linear solver was taken.
    proposal : Symmetry, optional
        A symmetry that the scene has but does not use.

    Returns
    -------
    tuple of PlanItem
    """
    is_galerkin = decisions.formulation is Formulation.GALERKIN
    return (
        *_mesh_items(scene, sizes),
        _symmetry(scene, sizes, proposal),
        _spaces(decisions, sizes),
        *(_galerkin_items if is_galerkin else _collocation_items)(decisions, sizes),
        *_condensation_items(decisions, sizes, why_solver),
        *(_contact_items(scene, decisions, sizes) if decisions.has_contact else [_no_contact()]),
        _load_history(decisions),
        *_field_items(),
        *output_items(Wishes()),
    )


def _mesh_items(scene: Scene, sizes: Sizes) -> Iterator[PlanItem]:
    n, n_curved, accuracy = sizes.n_elements, sizes.n_curved, scene.mesh.accuracy
    yield PlanItem("elements", True, f"{n} on {_count(sizes.n_loops, 'closed curve')}", Stage.MESH, Cost(calls=70000.0))
    reason = "the number of elements is given"
    if accuracy is not None:
        reason = f"until the estimated error is below {accuracy:g}; this plan is for the first mesh"
    yield PlanItem("further meshes", accuracy is not None, reason, Stage.MESH)
    reason = f"{n_curved} of {n} elements are curved" if n_curved else "all elements are straight"
    yield PlanItem("quadrature on curved elements", n_curved > 0, reason, Stage.ASSEMBLE)
    if sizes.n_motions == 0 and scene.symmetry is None:
        yield PlanItem("exterior domain", True, "the body fills the outside of the boundary", Stage.ASSEMBLE)


def _symmetry(scene: Scene, sizes: Sizes, proposal: Symmetry | None) -> PlanItem:
    if scene.symmetry is not None:
        reason = f"about {scene.symmetry}: {sizes.n_elements} of {sizes.n_sources} elements carry unknowns"
        return PlanItem("symmetry", True, reason, Stage.ASSEMBLE)
    reason = "not asked for"
    if proposal is not None:
        share = "half" if proposal.n_images == 2 else "a quarter"
        reason = f"proposed: the scene is symmetric about {proposal}, and {share} of its unknowns would do"
    return PlanItem("symmetry", False, reason, Stage.ASSEMBLE)


def _spaces(decisions: Decisions, sizes: Sizes) -> PlanItem:
    displacements, tractions = _DEGREES[decisions.displacement_degree], _DEGREES[decisions.traction_degree]
    name = f"{displacements} displacements, {tractions} tractions"
    reason = (
        f"{decisions.formulation.value}: {sizes.n_displacements} displacements and {sizes.n_tractions} tractions, "
        f"{sizes.n_fixed} of the displacements held, {sizes.n_open} open to contact"
    )
    return PlanItem(name, True, reason, Stage.ASSEMBLE)


def _galerkin_items(decisions: Decisions, sizes: Sizes) -> Iterator[PlanItem]:
    t, u = sizes.n_tractions, sizes.n_displacements
    third = assembly(decisions, sizes) / 3.0  # one sweep over the element pairs serves all three
    yield _matrix("single layer V", "maps tractions to displacements; symmetric", t, t, third)
    yield _matrix("double layer K", "maps displacements to displacements", t, u, third)
    yield PlanItem("adjoint double layer K'", False, "it is the transpose of K", Stage.ASSEMBLE)
    yield _matrix("hypersingular operator W", "makes the Steklov-Poincare map symmetric", u, u, third)
    reason = f"V^-1 by Cholesky, because V is symmetric and positive definite; order {t}"
    if decisions.linear_choice(u, sizes.n_open).solver.forms_matrix:
        flops = 2.0 * (t**3 / 3.0 + t * t * u + t * u * u)
        cost = Cost(flops=flops, calls=2000.0, size=_BYTES * (u * u + t * t))
    else:
        reason += "; products with it are enough, it is not formed"
        cost = Cost(flops=t**3 / 3.0, calls=2000.0, size=_BYTES * t * t)
    yield PlanItem("Steklov-Poincare map", True, reason, Stage.CONDENSE, cost)


def _collocation_items(decisions: Decisions, sizes: Sizes) -> Iterator[PlanItem]:
    n, evaluations = sizes.n_displacements, assembly(decisions, sizes)
    n_single, n_double = sizes.n_fixed + sizes.n_open, sizes.n_free + sizes.n_open
    reason = "unknown tractions: held and open directions"
    yield _matrix("single layer V", reason, n, n_single, evaluations * n_single / (n_single + n_double))
    n_zero = max(n - n_single - sizes.n_loaded, 0)
    yield _left_out("columns of V on the free surface", "the traction is zero there", n_zero, n)
    reason = "unknown displacements: free and open directions"
    yield _matrix("double layer K", reason, n, n_double, evaluations * n_double / (n_single + n_double))
    n_zero = max(n - n_double - sizes.n_moved, 0)
    yield _left_out("columns of K where supports hold", "the displacement is zero there", n_zero, n)
    n_given = sizes.n_loaded + sizes.n_moved
    reason = f"{n_given} columns are multiplied by given data at once" if n_given else "all given data are zero"
    yield PlanItem("storage of columns under given data", False, reason, Stage.ASSEMBLE)
    reason = "rotations then cause no tractions" if decisions.takes_slopes else "the method of the source paper"
    yield PlanItem("slopes between constant elements", decisions.takes_slopes, reason, Stage.ASSEMBLE)
    for name in ("adjoint double layer K'", "hypersingular operator W"):
        yield PlanItem(name, False, "collocation takes the displacement equation alone", Stage.ASSEMBLE)


def _matrix(name: str, reason: str, n_rows: int, n_columns: int, evaluations: float) -> PlanItem:
    cost = Cost(evaluations, calls=2000.0, size=_BYTES * n_rows * n_columns)
    return PlanItem(name, True, f"{reason}; {n_rows} x {n_columns}", Stage.ASSEMBLE, cost)


def _left_out(name: str, reason: str, n_columns: int, n_all: int) -> PlanItem:
    if n_columns == 0:
        return PlanItem(name, True, "no column can be left out", Stage.ASSEMBLE)
    return PlanItem(name, False, f"{reason}; {n_columns} of {n_all} columns", Stage.ASSEMBLE)


def _condensation_items(decisions: Decisions, sizes: Sizes, why_solver: str) -> Iterator[PlanItem]:
    is_galerkin = decisions.formulation is Formulation.GALERKIN
    f, o, n = sizes.n_free, sizes.n_open, sizes.n_displacements + sizes.n_motions + sizes.n_loops
    if is_galerkin and decisions.forms_matrix:
        flops = f**3 / 3.0 + 2.0 * f * f * o + 2.0 * f * o * o
        reason = f"{why_solver}; order {f}"
        size = _BYTES * (f * f + 2 * f * o)
    elif is_galerkin:
        iteration = krylov_cost(sizes.n_displacements, o)
        flops = 0.5 * iteration.flops - sizes.n_tractions**3 / 6.0  # the single layer is factored by another item
        reason = f"{why_solver}; order {f}"
        size = _BYTES * f * f
    else:
        flops = 2.0 / 3.0 * n**3 + 2.0 * n * n * o
        reason = f"LU, because the equations of collocation are not symmetric; order {n}"
        size = _BYTES * (n * n + n * o)
    cost = Cost(flops=2.0 * flops, calls=50000.0, size=size)
    yield PlanItem("linear solver of the body", True, reason, Stage.CONDENSE, cost)
    yield _multigrid(decisions, sizes)
    yield _pressure(is_galerkin, sizes)


def _multigrid(decisions: Decisions, sizes: Sizes) -> PlanItem:
    solver, name = decisions.linear_solver, "algebraic multigrid (pyamg)"
    if decisions.formulation is Formulation.COLLOCATION or decisions.forms_matrix:
        return PlanItem(name, False, "the linear solver is direct", Stage.CONDENSE)
    if not isinstance(solver, Krylov):
        return PlanItem(name, False, f"the linear solver is {type(solver).__name__}", Stage.CONDENSE)
    if sizes.n_free <= solver.coarsest:
        reason = f"the preconditioner is factored: its order {sizes.n_free} does not exceed {solver.coarsest}"
        return PlanItem(name, False, reason, Stage.CONDENSE)
    return PlanItem(name, True, "preconditions the conjugate gradients", Stage.CONDENSE)


def _pressure(is_galerkin: bool, sizes: Sizes) -> PlanItem:
    is_incompressible = sizes.n_volumes > 0
    reason = "Poisson's ratio is 1/2" if is_incompressible else "the body is compressible"
    if is_incompressible and not is_galerkin:
        reason = "collocation has it among the tractions"
    return PlanItem("pressure that keeps the volume", is_incompressible and is_galerkin, reason, Stage.CONDENSE)


def _contact_items(scene: Scene, decisions: Decisions, sizes: Sizes) -> Iterator[PlanItem]:
    c, n_steps = sizes.n_contact_unknowns, decisions.n_load_steps
    u = sizes.n_displacements
    moved = 60.0 * c * c + u * (u if decisions.formulation is Formulation.GALERKIN else c)
    of_step = 2.0 / 3.0 * c**3 + FLOPS_PER_NUMBER * moved
    n_solves = CONTACT_STEPS * n_steps
    cost = Cost(flops=n_solves * of_step, calls=9000.0 * n_solves, size=3 * _BYTES * c * c)
    reason = f"{sizes.n_contact} nodes may touch; every contact step solves for {c} unknowns"
    yield PlanItem("contact system", True, reason, Stage.SOLVE, cost)
    yield PlanItem("second elastic body", False, "the obstacles are rigid", Stage.SOLVE)
    names = ", ".join(dict.fromkeys(type(law).__name__ for law in scene.laws.values() if not law.is_frictionless))
    kind = "static" if n_steps == 1 else "incremental"
    reason = f"law {names}, {kind}" if names else "the law allows no tangential traction"
    yield PlanItem("friction", bool(names), reason, Stage.SOLVE)
    n_tangential = c - sizes.n_contact
    reason = f"{n_tangential} of {_count(sizes.n_contact, 'contact node')}" if n_tangential else "frictionless"
    yield PlanItem("tangential unknowns", n_tangential > 0, reason, Stage.SOLVE)
    n_free = sizes.n_free_motions
    reason = "the supports hold all rigid motions"
    if n_free:
        reason = f"{n_free} of {sizes.n_motions} rigid motions {'is' if n_free == 1 else 'are'} held by contact alone"
    yield PlanItem("rigid motions as unknowns", n_free > 0, reason, Stage.SOLVE)


def _no_contact() -> PlanItem:
    return PlanItem("contact system", False, "no part may touch an obstacle: the body is solved at once", Stage.SOLVE)


def _load_history(decisions: Decisions) -> PlanItem:
    n_steps = decisions.n_load_steps
    reason = "the whole load comes in one step"
    if n_steps > 1:
        reason = f"{n_steps} load steps; slip counts from the end of the step before"
    return PlanItem("load history", n_steps > 1, reason, Stage.SOLVE)


def _field_items() -> Iterator[PlanItem]:
    yield PlanItem("fields on the boundary", True, "part of every result", Stage.RECOVER, Cost(calls=5000.0))
    for name in ("displacement inside the body", "stress inside the body"):
        yield PlanItem(name, False, "not asked for; see interior_fields", Stage.RECOVER)


def output_items(wishes: Wishes) -> tuple[PlanItem, ...]:
    """Say which libraries the outputs need.

    Parameters
    ----------
    wishes : Wishes

    Returns
    -------
    tuple of PlanItem
    """
    libraries = (
        ("result file (h5py)", wishes.result_file, Cost(calls=2e5)),
        ("figures (matplotlib)", wishes.figures, Cost(calls=6e6)),
    )
    return tuple(
        PlanItem(name, is_wished, "asked for", Stage.OUTPUTS, cost)
        if is_wished
        else PlanItem(name, False, "not asked for", Stage.OUTPUTS)
        for name, is_wished, cost in libraries
    )


def _count(number: int, name: str) -> str:
    return f"{number} {name}" if number == 1 else f"{number} {name}s"
