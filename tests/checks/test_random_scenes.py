"""Random scenes: pure functions of their numbers, wide, and each ends in the right answer or a named failure."""

from __future__ import annotations

import contextlib
import dataclasses
import re
from collections import Counter

import numpy as np
import pytest

import bemkit as bk
from bemkit.cli.progress import compute_with_progress
from bemkit.errors import ResultWarning
from bemkit.scene.toml import scene_from_toml
from bemkit.testing.independent_check import energy_fault
from checks.random_scenes import RandomCase, random_case
from checks.trials import (
    EVERY,
    Outcome,
    Trial,
    judge,
    trial_tasks,
    try_case,
)
from tests.scenes import FLOOR, block
from tests.solutions import changed

REMEDY = re.compile(
    r"\b(give|use|change|hold|raise|make|check|try|start|allow|choose|remove|restrict|list|subtract|move|keep|press|name|take|leave|describe|let|bring|put)\b"
)


def assert_honest(trials: list[Trial]) -> None:
    """Assert that every success is right and every failure has a name and a remedy."""
    failures = [trial for trial in trials if trial.is_failure]
    assert not failures, "\n".join(f"{t.seed} {t.index}: {t.outcome.value}: {t.reason}: {t.message}" for t in failures)
    for trial in trials:
        if trial.outcome is Outcome.NAMED:
            assert REMEDY.search(trial.message), f"no remedy: {trial.index}: {trial.message}"


def random_trials(seed: int, count: int, processes: int = 1) -> list[Trial]:
    tasks = trial_tasks(seed, range(count))
    return list(compute_with_progress(tasks, "random scenes", is_live=False, processes=processes))


def test_random_scenes_end_in_the_right_answer_or_a_named_failure() -> None:
    trials = random_trials(1, 8)
    assert_honest(trials)
    counts = Counter(trial.outcome for trial in trials)
    assert counts[Outcome.SUCCESS] + counts[Outcome.WARNED] >= 2  # a generator of scenes without answers tests nothing


def half_planes_among(seed: int, count: int) -> list[RandomCase]:
    """Return the half-planes among single bodies; what was drawn and is not a scene is not among them."""
    cases = []
    for index in range(count):
        with contextlib.suppress(bk.BemkitError):
            cases.append(random_case(seed, index))
    return [case for case in cases if case.scenes[0].shape.outline().surface is not None]


@pytest.mark.slow
def test_random_half_planes_end_in_the_right_answer_or_a_named_failure() -> None:
    cases = half_planes_among(4, 40)
    assert len(cases) >= 3  # 12 per cent
    assert {type(case.scenes[0].shape).__name__ for case in cases} == {"ElasticHalfPlane", "PeriodicHalfPlane"}
    for case in cases:
        assert tuple(scene_from_toml(text) for text in case.files().values()) == case.scenes
    trials = [try_case(case.seed, case.index) for case in cases[:3] if case.index % EVERY != EVERY - 1]
    assert_honest(trials)
    counts = Counter(trial.outcome for trial in trials)
    assert counts[Outcome.SUCCESS] + counts[Outcome.WARNED] >= len(trials) // 2


@pytest.mark.slow
@pytest.mark.parametrize("seed", [1, 2, 3, 5])
def test_many_random_scenes(seed: int) -> None:
    assert_honest(random_trials(seed, 2000, processes=2))


def test_a_scene_is_a_function_of_its_numbers() -> None:
    for index in (0, 17, 33):
        assert random_case(7, index) == random_case(7, index)
    assert random_case(7, 1) != random_case(7, 2)
    assert random_case(7, 1).scenes[0].shape != random_case(8, 1).scenes[0].shape


def test_scenes_are_the_same_after_a_scene_file() -> None:
    for index in range(12):
        case = random_case(7, index)
        assert tuple(scene_from_toml(text) for text in case.files().values()) == case.scenes


@pytest.mark.slow
def test_every_kind_is_drawn() -> None:
    cases = [random_case(3, index) for index in range(150)]
    scenes = [scene for case in cases for scene in case.scenes]
    drawn = Counter(type(value).__name__ for scene in scenes for value in kinds_in(scene))
    wanted = (
        *("Rectangle", "Polygon", "Disk", "Sector", "Ring", "PlateWithHole", "ExteriorOf"),
        *("ElasticHalfPlane", "PeriodicHalfPlane", "FarField"),
        *("RigidHalfPlane", "RigidCircle", "RigidCavity", "Gap"),
        *("Clamped", "Roller", "PrescribedDisplacement", "Traction", "Pressure", "Contact"),
        *("Frictionless", "Tresca", "Coulomb", "CohesiveCoulomb"),
        *("Fallbacks", "AugmentedLagrangian", "FixedPoint", "LemkePivoting"),
        *("Galerkin", "ConstantCollocation", "Symmetry", "Algebraic", "Geometric"),
    )
    assert not [name for name in wanted if not drawn[name]]
    assert any(len(scene.load_factors) > 1 for scene in scenes)
    assert any(len(case.scenes) > 1 for case in cases)
    assert any(scene.steps for scene in scenes)
    assert any(scene.mesh.accuracy is not None for scene in scenes)
    assert any(scene.material.poisson_ratio == 0.5 for scene in scenes)
    assert any(len(scene.contact_parts) > 1 for scene in scenes)
    modulus = [scene.material.youngs_modulus for scene in scenes]
    assert max(modulus) / min(modulus) > 1e15


def kinds_in(scene: bk.Scene) -> list[object]:
    conditions = [part.condition for part in scene.parts]
    obstacles = [condition.obstacle for condition in conditions if isinstance(condition, bk.Contact)]
    return [
        *(scene.shape, scene.law, scene.solver, scene.discretisation, scene.linear_solver, scene.symmetry),
        *(scene.mesh.grading, scene.far, *conditions, *obstacles),
    ]


def solved_block() -> bk.Solution:
    return bk.run(block(FLOOR, bk.Part("load", bk.Pressure(1e-3), sides=("top",)), mesh=bk.MeshOptions(160)))


def test_a_wrong_success_is_called_wrong() -> None:
    solution = solved_block()
    assert judge([solution])[0] in (Outcome.SUCCESS, Outcome.WARNED)
    outcome, reason, message = judge([changed(solution, energy=-solution.energy)])
    assert (outcome, reason) == (Outcome.WRONG, "energy")
    assert "negative_energy" in message


def test_friction_that_gives_back_and_work_that_is_missing_are_wrong() -> None:
    loop = bk.load_scene("friction-loop")
    steps = bk.run([dataclasses.replace(loop, mesh=bk.MeshOptions(elements=40), steps=loop.steps[:1])])
    assert judge(steps)[0] in (Outcome.SUCCESS, Outcome.WARNED)
    for changes, message in (
        ({"dissipation": -1e-9}, "friction gave back"),
        ({"friction_gain": 1e-3}, "friction acts along slip"),
        ({"external_work": 1.0}, "is missing"),
    ):
        loading = steps[-1].loading
        assert loading is not None
        last = loading.steps[-1]
        work = dataclasses.replace(last.work, **changes)
        wrong = dataclasses.replace(loading, steps=(*loading.steps[:-1], dataclasses.replace(last, work=work)))
        outcome, reason, text = judge([*steps[:-1], dataclasses.replace(steps[-1], loading=wrong)])
        assert (outcome, reason) == (Outcome.WRONG, "energy of the load history")
        assert message in text


def test_round_off_of_a_body_that_only_moves_is_no_missing_work() -> None:
    loop = bk.load_scene("friction-loop")
    (step, *_) = bk.run([dataclasses.replace(loop, mesh=bk.MeshOptions(elements=40), steps=loop.steps[:1])])
    assert step.loading is not None
    last = step.loading.steps[-1]
    size = step.body.scene.material.plane_modulus * float(np.abs(step.boundary.displacement).max()) ** 2
    for share, is_fault in ((1e-15, False), (1e-11, True)):  # either side of ROUND_OFF
        work = dataclasses.replace(last.work, external_work=share * size, dissipation=0.0, increment_work=0.0)
        idle = dataclasses.replace(last, work=work, end=changed(step, energy=0.0))
        moved = dataclasses.replace(step, loading=dataclasses.replace(step.loading, steps=(idle,)))
        assert ("missing" in energy_fault(moved)) is is_fault


def test_fields_of_another_body_are_wrong_unless_the_solution_says_that_it_is_coarse() -> None:
    solution = solved_block()
    strained = changed(
        solution,
        scene=dataclasses.replace(solution.scene, material=bk.Material(3.0, 0.3)),
        energy=solution.energy,
    )
    assert judge([strained.with_warnings(())])[:2] == (Outcome.WRONG, "reciprocity")
    warned = strained.with_warnings((ResultWarning("test", "", "use more elements"),))
    assert judge([warned])[0] is Outcome.WARNED


def test_what_is_not_a_number_in_summary_or_tables_is_wrong() -> None:
    solution = solved_block()
    for changes, place in (
        ({"energy": float("nan")}, "summary.energy"),
        ({"contact": dataclasses.replace(solution.contact, u_t=0.0 * solution.contact.u_t + np.nan)}, "contact.u_t"),
    ):
        outcome, reason, message = judge([changed(solution, **changes)])
        assert (outcome, reason) == (Outcome.WRONG, "not a number")
        assert place in message


def test_a_status_is_a_named_failure() -> None:
    stalled = changed(solved_block(), status=bk.Status.STALLED, energy=-1.0)
    assert judge([stalled])[:2] == (Outcome.NAMED, "stalled")


def test_errors_without_a_name_are_tracebacks() -> None:
    def fails(*arguments: object) -> None:
        raise ZeroDivisionError("float division by zero")

    trial = try_case(7, 4, fails)
    assert (trial.outcome, trial.reason) == (Outcome.TRACEBACK, "ZeroDivisionError")
    assert "float division by zero" in trial.message
    assert (
        try_case(7, 4, lambda case: np.float64(1.0) / np.float64(0.0)).reason == "RuntimeWarning"
    )  # numpy's warnings count as errors
