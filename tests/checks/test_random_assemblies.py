"""Random assemblies: pure functions of their numbers, wide, and each ends in the right answer or a named failure."""

from __future__ import annotations

from collections import Counter
from pathlib import Path

import numpy as np
import pytest

import bemkit as bk
from bemkit.cli.progress import compute_with_progress
from bemkit.results.result_file import read_result, write_result
from bemkit.results.solution import Solution
from bemkit.scene.toml import scene_from_toml
from checks.random_assemblies import random_assembly
from checks.trials import (
    EVERY,
    Outcome,
    Trial,
    drawn_case,
    save_trial,
    solved_steps,
    trial_tasks,
)
from tests.checks.test_random_scenes import assert_honest

FIRST = EVERY - 1


def trials_of(seed: int, count: int, processes: int = 1) -> list[Trial]:
    tasks = trial_tasks(seed, range(FIRST, FIRST + EVERY * count, EVERY))
    return list(compute_with_progress(tasks, "random assemblies", is_live=False, processes=processes))


def test_random_assemblies_end_in_the_right_answer_or_a_named_failure() -> None:
    trials = trials_of(2, 3)
    assert_honest(trials)
    counts = Counter(trial.outcome for trial in trials)
    assert counts[Outcome.SUCCESS] + counts[Outcome.WARNED] > 0  # assemblies without answers test nothing


@pytest.mark.slow
@pytest.mark.parametrize("seed", [1, 2, 3, 5])
def test_many_random_assemblies(seed: int) -> None:
    assert_honest(trials_of(seed, 300, processes=2))


def test_every_fourth_trial_has_several_bodies() -> None:
    kinds = [bool(drawn_case(7, index).scenes[0].bodies) for index in range(8)]
    assert kinds == [False, False, False, True] * 2
    assert drawn_case(7, FIRST) == random_assembly(7, FIRST)
    assert random_assembly(7, 3) != random_assembly(7, 7)
    assert random_assembly(7, 3) != random_assembly(8, 3)


@pytest.mark.slow
def test_assemblies_are_the_same_after_a_scene_file(tmp_path: Path) -> None:
    for index in range(4):
        case = random_assembly(7, index)
        assert tuple(scene_from_toml(text) for text in case.files().values()) == case.scenes
    save_trial(Trial(7, FIRST, Outcome.WRONG, "means", "means 1"), tmp_path)
    (path,) = tmp_path.iterdir()
    assert path.read_text().startswith("# wrong success: means\n# means 1\n")
    assert bk.load_scene(str(path)) == random_assembly(7, FIRST).scenes[0]


@pytest.mark.slow
def test_every_kind_is_drawn() -> None:
    assemblies = [scene for index in range(70) for scene in random_assembly(3, index).scenes]
    bodies = [body for each in assemblies for body in each.bodies]
    values = [value for body in bodies for value in (body.shape, body.copies, *body.body_forces)]
    values += [part.condition for body in bodies for part in body.parts]
    values += [value for each in assemblies for value in (each.solver, each.linear_solver, each.discretisation)]
    values += [each.law for each in assemblies] + [pair.law for each in assemblies for pair in each.contacts]
    drawn = Counter(type(value).__name__ for value in values)
    wanted = (
        *("Rectangle", "Polygon", "Disk", "Ring", "PlateWithHole", "ExteriorOf"),
        *("Clamped", "Roller", "PrescribedDisplacement", "Traction", "Pressure", "Contact", "Free"),
        *("Frictionless", "Tresca", "Coulomb", "CohesiveCoulomb", "Gravity", "Heating", "Rotation"),
        *("Fallbacks", "AugmentedLagrangian", "FixedPoint", "ConstantCollocation", "Galerkin"),
        *("GridCopies", "ListedCopies", "CircleCopies"),
    )
    assert not [name for name in wanted if not drawn[name]]
    pairs = [pair for each in assemblies for pair in each.contacts]
    assert any(pair.interference > 0.0 for pair in pairs)
    assert any(pair.gap < 0.0 for pair in pairs)
    assert any(pair.multipliers_on for pair in pairs)
    assert any(pair.sides[0].split(".")[0] == pair.sides[1].split(".")[0] for pair in pairs)
    assert any(each.touching for each in assemblies)
    assert any(each.mesh.accuracy is not None for each in assemblies)
    assert len(assemblies) > 72  # loads that change
    assert any(each.n_steps > 4 for each in assemblies)  # press, shear, reverse, unload
    moduli = [body.material.youngs_modulus for body in bodies]
    assert max(moduli) / min(moduli) > 1e10


@pytest.mark.slow
def test_results_survive_a_file_and_plans_count_what_is_done(tmp_path: Path) -> None:
    n_solved = 0
    for index in (6, 8):
        try:
            steps = solved_steps(random_assembly(11, index))
        except bk.BemkitError:
            continue
        solution = steps[-1]
        assert isinstance(solution, Solution)
        n_solved += 1
        if all(step.is_converged for step in steps) and solution.scene.mesh.accuracy is None:
            assert solution.work == solution.plan.work
        path = tmp_path / f"{index}.h5"
        write_result(path, solution)
        again = read_result(path)
        assert isinstance(again, Solution)
        assert again.summary() == solution.summary()
        np.testing.assert_array_equal(again.contact_directions, solution.contact_directions)
        for name, body in solution.bodies.items():
            np.testing.assert_array_equal(again.bodies[name].boundary.traction_dofs, body.boundary.traction_dofs)
            np.testing.assert_allclose(again.bodies[name].mesh.centres, body.mesh.centres, rtol=1e-12)
    assert n_solved >= 1
