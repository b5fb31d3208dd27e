"""Run the cases of the axes and judge each by two independent checks."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from functools import cache, partial
from typing import Any, TypeAlias

import numpy as np

from bemkit.errors import BemkitError
from bemkit.model.model import build_model
from bemkit.model.prepared import prepare
from bemkit.results.solution import Solution
from bemkit.runs.run import run
from bemkit.scene.scene import Scene
from bemkit.studies.engine import REFUSED, Attempt, StudyError, Task, attempt, compute
from bemkit.studies.stability.axes import Axis
from bemkit.studies.stability.case import Case
from bemkit.studies.stability.records import StabilityRecord, Verdict
from bemkit.studies.stability.similarity import Similarity
from bemkit.testing.independent_check import violations_of
from bemkit.testing.independent_check.verdict import Violations
from bemkit.threads import blas_threads_for

TWIN = Similarity(length=3.7e-3, modulus=7.3e5, stress=1.9e-2)
"""Every case is solved a second time in these units. No factor is a power of two, so all round-off differs."""
TWIN_OF_BODIES = Similarity(length=3.7e-3, modulus=7.3e5, stress=7.3e5)
"""The same for several bodies."""


RunTasks: TypeAlias = Callable[[Axis, Sequence[Task[StabilityRecord]]], Iterable[StabilityRecord]]


def sweep(
    scene: Scene,
    axes: Sequence[Axis],
    run_tasks: RunTasks | None = None,
) -> Iterator[StabilityRecord]:
    """Compute the records of some axes from a baseline scene, of one body or of several, one axis after the other.

    `run_tasks` computes the tasks of an axis, by default `compute` of the engine.

    Raises
    ------
    StudyError
        If the scene itself has no converged solution, or no contact, or of one body several load steps, or an axis says
        nothing of it.
    """
    if not scene.bodies and scene.n_steps > 1:
        raise StudyError(f"the scene has {scene.n_steps} load steps, but a sweep solves one: give it a single load")
    if not scene.has_contact:
        raise StudyError("the scene has no contact, which this suite is about: give one that has")
    for axis in axes:
        if reason := axis.reason_against(scene):
            raise StudyError(f"axis {axis.name!r} does not apply to this scene: {reason}; remove it")
    baseline = attempt(lambda: run(scene))
    if baseline.solution is None or not baseline.is_converged:
        raise StudyError(f"the scene itself has no converged solution ({baseline.message}): give one that has")
    for axis in axes:
        tasks = _tasks(axis, baseline.solution)
        yield from compute(tasks) if run_tasks is None else run_tasks(axis, tasks)


def _tasks(axis: Axis, baseline: Solution) -> list[Task[StabilityRecord]]:
    # the reference is solved when the first record needs it
    reference = cache(lambda: _reference(axis, baseline))

    def record(value: float) -> StabilityRecord:
        try:
            case = axis.make(baseline, value)
        except BemkitError as error:  # a body that cannot be, such as one that is stretched until it is flat
            none = (math.nan,) * 6
            return StabilityRecord(axis.name, value, Verdict.NAMED.value, REFUSED, 0, *none, 0.0, str(error))
        return solve_and_judge(axis.name, case, reference())

    return [Task((axis.name, value), f"{axis.name} {value:.6g}", partial(record, value)) for value in axis.values]


def solve_and_judge(
    axis: str, case: Case, reference: Solution | None, solve: Callable[..., Any] = run
) -> StabilityRecord:
    """Solve a case of an axis and its scaled copy, and judge them.

    The deviation is measured against the reference, which is None if it has no solution itself.
    """
    factors = TWIN_OF_BODIES if case.scene.bodies else TWIN
    copied_scene = factors.apply(case.scene)
    first, second = _attempt(case.scene, case, solve), _attempt(copied_scene, case, solve)
    solution = first.solution
    deviation = scaled_copy = math.nan
    check = None
    if solution is not None:
        check = _checked(solution)
        if reference is not None:
            deviation = difference(reference, solution, case.similarity)
        if second.solution is not None:
            scaled_copy = difference(solution, second.solution, factors, in_mean=case.levels > 0)
    verdict, objection = _judge(case, reference, first, second, check, deviation, scaled_copy)
    return StabilityRecord(
        axis=axis,
        value=case.value,
        verdict=verdict.value,
        status=first.status,
        linear_solves=0 if solution is None else solution.linear_solves,
        certificate=math.nan if solution is None else solution.certificate.worst,
        check=math.nan if check is None else check.worst,
        reciprocity=math.nan if check is None else check.reciprocity,
        condition=math.nan if solution is None else condition_number(copied_scene, case),
        deviation=deviation,
        scaled_copy=scaled_copy,
        seconds=first.seconds,
        message=objection or ("" if first.is_converged else first.message),
    )


def _checked(solution: Solution) -> Violations:
    steps = solution.each_step()
    return violations_of(solution, steps[-2] if len(steps) > 1 else None)


def _attempt(scene: Scene, case: Case, solve: Callable[..., Any] = run) -> Attempt:
    if scene.bodies:
        return attempt(lambda: solve(scene))
    # the mesh is made inside: an error there is an answer too
    return attempt(lambda: solve(scene, mesh=case.mesh(scene)))


def difference(reference: Solution, solution: Solution, similarity: Similarity, *, in_mean: bool = False) -> float:
    """Return the largest difference of two contact tables after scaling the second back.

    Parameters
    ----------
    reference, solution : Solution
    similarity : Similarity
        Leads from the reference to the solution.
    in_mean : bool
        Take the mean along each contact part instead of the largest entry; always on other meshes, because single nodes
        at corners see singular tractions. On different meshes the coarser one is interpolated to the finer one.

    Returns
    -------
    float
        Of clearances and tangential displacements relative to the largest displacement, of several bodies that of any
        of them, of tractions relative to the largest traction of the reference.
    """
    one, other = reference.contact, solution.contact
    moved = [one.u_n, one.u_t]
    if reference.scene.bodies:  # relative displacements are round-off where all sticks
        moved += [body.boundary.displacement for body in reference.bodies.values()]
    unit = max(float(np.abs(each).max()) for each in moved) or 1.0
    stress = max(float(np.abs(one.sigma_n).max()), float(np.abs(one.sigma_t).max())) or 1.0
    is_same_mesh = one.n_contact == other.n_contact
    worst = 0.0
    for part in dict.fromkeys(one.part):
        rows, others = (table.rows(part) for table in (one, other))
        if not others.any():
            return math.inf
        places, scaled_places = one.s[rows], other.s[others] / similarity.length
        is_finer = bool(others.sum() > rows.sum())
        weight = other.weight[others] if is_finer else one.weight[rows]
        for name in ("clearance", "u_t", "sigma_n", "sigma_t"):
            is_stress = name.startswith("sigma")
            before = getattr(one, name)[rows]
            scaled = getattr(other, name)[others] / (similarity.stress if is_stress else similarity.displacement)
            if not is_same_mesh and is_finer:
                before = np.interp(scaled_places, places, before)
            elif not is_same_mesh:
                scaled = np.interp(places, scaled_places, scaled)
            is_known = np.isfinite(before) | np.isfinite(scaled)  # infinite clearances agree with each other only
            gone = np.abs(np.where(is_known, scaled, 0.0) - np.where(is_known, before, 0.0))
            size = gone.max() if is_same_mesh and not in_mean else weight @ gone / weight.sum()
            worst = max(worst, float(size) / (stress if is_stress else unit))
    return worst


def condition_number(scene: Scene, case: Case) -> float:
    """Return the condition number of the contact stiffness of one body, NaN where none is formed and of several."""
    if scene.bodies:
        return math.nan
    mesh = case.mesh(scene)
    with blas_threads_for(2 * mesh.n_elements):
        model = build_model(prepare(scene, mesh))
        body, condensed = model.body, model.condensed_map(0)
        if condensed is None:
            return math.nan
        stiffness = condensed.stiffness
        diagonal = np.abs(np.diagonal(stiffness))
        scale = 1.0 / np.sqrt(np.where(diagonal > 0.0, diagonal, 1.0))
        singular = np.linalg.svd(scale[:, None] * stiffness * scale, compute_uv=False)
    smallest = float(singular[max(singular.size - 1 - body.rigid_motions().shape[0], 0)])
    return float(singular[0]) / smallest if smallest > 0.0 else math.inf


def _reference(axis: Axis, baseline: Solution) -> Solution | None:
    if axis.reference is None:
        return baseline
    case = axis.make(baseline, axis.reference)
    found = _attempt(case.scene, case)
    return found.solution if found.is_converged else None


def _judge(
    case: Case,
    reference: Solution | None,
    first: Attempt,
    second: Attempt,
    check: Violations | None,
    deviation: float,
    scaled_copy: float,
) -> tuple[Verdict, str]:
    """Return the verdict, and the reason if the record is not right."""
    if first.status != second.status:
        return Verdict.WRONG, f"{first.status}, but its scaled copy: {second.status} ({second.message})"
    if not first.is_converged or first.solution is None or second.solution is None or check is None:
        if case.is_solvable or case.keeps_steps:
            return Verdict.WRONG, f"solvable, but: {first.message}"
        return Verdict.NAMED, ""
    objections = {
        "no solution exists": case.is_solvable is False,
        f"the independent check finds {check.worst:.1e}": not check.is_good,
        "deviates from the reference": math.isfinite(case.deviation_limit) and not deviation <= case.deviation_limit,
    }
    if case.keeps_steps and reference is not None:
        objections["other active sets"] = not np.array_equal(first.solution.contact.status, reference.contact.status)
        objections["other linear solves"] = first.solution.linear_solves != reference.linear_solves
    differs = not scaled_copy <= case.precision
    is_another = differs and math.isinf(case.deviation_limit) and _checked(second.solution).is_good
    objections["the scaled copy differs"] = differs and not is_another
    found = [text for text, speaks_against in objections.items() if speaks_against]
    if found:
        return Verdict.WRONG, "; ".join(found)
    if differs:
        return Verdict.AMBIGUOUS, "the scaled copy is another solution by the independent check"
    if check.is_coarse:
        return Verdict.COARSE, f"Betti's theorem is missed by {check.reciprocity:.0%}: use more elements"
    return Verdict.RIGHT, ""
