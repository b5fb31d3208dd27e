"""Load steps of several bodies: walls up to their collapse and beyond, jumps that stall, steps that are kept."""

from __future__ import annotations

import logging
import re
from dataclasses import replace
from itertools import count

import numpy as np
import pytest

import bemkit as bk
from bemkit.model.model import build_model
from bemkit.model.prepared import prepare_steps
from bemkit.runs import load_path
from bemkit.runs.steps import UnsolvableSceneError
from bemkit.scene.load_history import load_steps, with_scaled_loads
from bemkit.solvers.base import Status
from bemkit.solvers.fallbacks import SolutionPath
from tests.failing_solver import Failing
from tests.runs.masonry import FRICTION, wall


def check_up_to_collapse(assembly: bk.Scene, expected: float, moved: str, weight: float) -> None:
    """Increments up to 98 % of the limit converge, 102 % cannot be carried, and the steps before are kept."""
    limit = bk.largest_load_factor(assembly)
    assert limit == pytest.approx(expected, rel=1e-6)  # accuracy of linear programmes
    factors = tuple(limit * share for share in (0.0, 0.5, 0.74, 0.86, 0.98, 1.02))
    *steps, beyond = bk.run([replace(assembly, load_factors=factors)])
    assert [step.is_converged for step in steps] == [True] * 5
    for factor, step in zip(factors, steps, strict=False):
        floors = [one for one in step.contacts if one.name.endswith(".floor")]
        assert sum(one.force_y for one in floors) == pytest.approx(weight, rel=1e-9)
        push = factor if expected > 1.0 else factor * weight
        assert sum(one.force_x for one in floors) == pytest.approx(-push, rel=1e-9, abs=1e-9 * weight)
        assert step.outer_steps < 20  # each from the end of the last one
    assert beyond.status is Status.UNSOLVABLE_LOAD
    assert f"bodies '{moved}" in beyond.message
    assert "The fields are those of the step before." in beyond.message
    np.testing.assert_array_equal(beyond.contact.sigma_n, steps[-1].contact.sigma_n)


@pytest.mark.slow
def test_a_wall_is_pushed_up_to_its_collapse() -> None:
    """Friction under the uppermost course, of weight 4, holds the push."""
    check_up_to_collapse(wall(2, 2, push=True), FRICTION * 4.0, "block 1-0", 8.0)


@pytest.mark.slow
def test_a_wall_leans_up_to_its_collapse() -> None:
    check_up_to_collapse(wall(5, 4, push=False), FRICTION, "block 0-0", 40.0)


@pytest.mark.slow
def test_a_wall_of_200_blocks_is_pushed_up_to_its_collapse() -> None:
    check_up_to_collapse(wall(10, 20, push=True), FRICTION * 40.0, "block 9-0", 400.0)


def test_a_load_history_is_one_scene_and_one_result(tmp_path) -> None:  # type: ignore[no-untyped-def]
    assembly = replace(wall(2, 1, push=True), load_factors=(0.5, 1.0))
    assert bk.scene_from_toml(bk.scene_to_toml(assembly)) == assembly
    steps = bk.run([assembly])
    solution = bk.run(assembly)
    assert solution.is_converged
    assert solution.message.startswith("load step 2 of 2: ")
    assert solution.linear_solves == sum(step.linear_solves for step in steps)
    assert [
        record.message.split(";")[0] for record in solution.history if record.step in (0, len(solution.history) - 1)
    ] == [
        "load step 1 of 2",
        "load step 2 of 2",
    ]
    np.testing.assert_array_equal(solution.contact.sigma_t, steps[-1].contact.sigma_t)
    assert solution.stated == assembly
    points = np.array([[1.0, 0.5]])
    inside = bk.interior_fields(solution.bodies["block 0-0"]).stress(points)
    np.testing.assert_allclose(inside, bk.interior_fields(steps[-1].bodies["block 0-0"]).stress(points), rtol=1e-12)
    bk.write_result(tmp_path / "wall.h5", solution)
    read = bk.read_result(tmp_path / "wall.h5")
    np.testing.assert_allclose(bk.interior_fields(read.bodies["block 0-0"]).stress(points), inside, rtol=1e-12)


@pytest.mark.slow
def test_steps_that_are_reached_are_kept_in_the_result_of_a_scene() -> None:
    assembly = replace(wall(2, 2, push=True), load_factors=(1.0, 5.0))  # friction holds 2.4
    solution = bk.run(assembly)
    assert solution.status is Status.UNSOLVABLE_LOAD
    assert solution.message.startswith("load step 2 of 2: No contact tractions can balance this load")
    assert "Finished: 1 of 2 steps, up to load factor 1." in solution.message
    assert solution.scene.bodies == assembly.bodies  # the fields are of this one
    assert not solution.is_certified
    with pytest.raises(UnsolvableSceneError, match="slides bodies 'block 1-0'"):
        bk.run(replace(assembly, load_factors=(5.0, 1.0)))


IMPATIENT = replace(wall(3, 4, push=True), load_factors=(0.0, 4.6), solver=bk.SemismoothNewton(max_steps=5))
"""Five steps settle small increments and no large ones."""


@pytest.fixture(scope="module")
def halved() -> tuple[bk.SolvedSteps, list[str]]:
    """Return the steps of that scene, and what is announced on the way."""
    announced: list[str] = []
    handler, logger = logging.Handler(), logging.getLogger("bemkit.progress")
    handler.emit = lambda record: announced.append(record.getMessage())  # type: ignore[method-assign]
    before = logger.level
    logger.addHandler(handler)
    logger.setLevel("DEBUG")
    try:
        return bk.run([IMPATIENT]), announced
    finally:
        logger.removeHandler(handler)
        logger.setLevel(before)


def test_a_jump_that_stalls_is_gone_in_halves(halved: tuple[bk.SolvedSteps, list[str]]) -> None:
    first, second = halved[0]
    assert second.is_converged
    assert "increments reached it" in second.message
    remarks = [record.message for record in second.history]
    assert any(remark.startswith("increment to load factor 2.3") for remark in remarks)
    steps = [record.step for record in second.history]
    assert steps == list(range(len(steps)))
    assert second.linear_solves == second.history[-1].linear_solves
    floors = [one.force_x for one in second.contacts if one.name.endswith(".floor")]
    assert sum(floors) == pytest.approx(-4.6, rel=1e-9)
    assert first.is_converged


def test_a_step_out_of_reach_says_how_far_it_came() -> None:
    n_solves = count(1)
    hopeless = bk.Fallbacks((Failing(fails=lambda problem, start: next(n_solves) > 1),))
    assembly = replace(wall(3, 4, push=True), load_factors=(0.0, 4.6), solver=hopeless)
    first, second = bk.run([assembly])
    assert first.is_converged
    assert second.status is Status.LOAD_NOT_REACHED
    assert second.status.value in second.message
    assert "Increments reached load factor 0, not load factor 0.071875." in second.message
    assert "finds no collapse under this load, but friction may give way below it" in second.message
    assert re.search("The last increment ended (stalled|cycling): The", second.message)
    np.testing.assert_array_equal(second.contact.sigma_n, first.contact.sigma_n)


def test_steps_of_other_bodies_are_refused() -> None:
    with pytest.raises(bk.InputError, match=r"the bodies are .*, and those of the step before .*: change numbers"):
        bk.run([wall(2, 2, push=True), wall(2, 3, push=True)])


def test_what_has_no_largest_factor_says_so() -> None:
    falling = bk.Gravity(1.0, (1.0, 0.0), is_constant=True)
    assembly = wall(2, 2, push=True)
    leaning = tuple(replace(body, body_forces=(*body.body_forces, falling)) for body in assembly.bodies)
    # a push to the right cannot hold what slides to the right, and a pull cannot hold all courses
    with pytest.raises(UnsolvableSceneError, match="no contact tractions can balance the constant load"):
        bk.largest_load_factor(replace(assembly, bodies=leaning, law=bk.Coulomb(0.1)))
    with pytest.raises(bk.InputError, match="no two bodies are in contact"):
        bk.largest_load_factor(replace(assembly, bodies=_without_floor(assembly), touching=None))


def _without_floor(assembly: bk.Scene) -> tuple[bk.Body, ...]:
    held = bk.Part("floor", bk.Clamped(), ("bottom",))
    return tuple(replace(body, parts=(held,)) for body in assembly.bodies)


def test_what_is_given_is_interpolated_between_two_steps() -> None:
    """Loads, body forces, given displacements and gaps halfway are those of the step halfway."""
    lower = bk.Body(
        name="lower",
        shape=bk.Rectangle(1.0, 1.0),
        material=bk.Material(10.0, 0.3),
        parts=(bk.Part("base", bk.PrescribedDisplacement(0.1, bk.Expression("0.2 * x")), ("left",)),),
        mesh=bk.MeshOptions(elements=16),
    )
    upper = replace(
        lower,
        name="upper",
        parts=(bk.Part("load", bk.Pressure(bk.Expression("1 + x")), ("top",)),),
        body_forces=(bk.Gravity(1.0, (0.0, -1.0)),),
        placement=bk.Placement((0.0, 1.0)),
    )
    pair = bk.ContactPair(("upper.bottom", "lower.top"))
    assembly = bk.Scene(title="Two", bodies=(lower, upper), contacts=(pair,), law=bk.Coulomb(0.5))
    steps = [
        replace(with_scaled_loads(assembly, factor), contacts=(replace(pair, gap=0.1 * factor),))
        for factor in (1.0, 2.0, 3.0)
    ]
    prepared = prepare_steps(steps)
    before = build_model(prepared[0])
    halfway, after = (before.under(each) for each in prepared[1:])
    problem = after.between(before, 0.5)
    for name in ("load", "prescribed"):
        expected = getattr(halfway.body, name)
        assert np.abs(expected).max() > 0.0
        np.testing.assert_allclose(getattr(problem.body, name), expected, atol=1e-13 * np.abs(expected).max())
    np.testing.assert_allclose(problem.gap, halfway.problem.gap, rtol=1e-13)


def test_blocks_of_the_same_objects_are_assembled_once_under_every_load() -> None:
    """Twelve blocks under two loads: whole and half ones, one that is pushed; those on the floor are held alone."""
    assembly = replace(wall(4, 3, push=True), load_factors=(0.0, 1.0))
    for step in prepare_steps(load_steps(assembly)):
        free = {id(body.own_mesh) for body in step.bodies if not body.body.is_held}
        assert len(free) == 3


def test_increments_are_announced_with_their_load_factors(halved: tuple[bk.SolvedSteps, list[str]]) -> None:
    words = [message for message in halved[1] if "load " in message]
    assert words[:3] == [
        "load step 1 of 2 finished",
        "load factor 4.6 failed, load factor 2.3 is next",
        "load factor 2.3 reached",
    ]
    assert words[-1] == "load step 2 of 2 finished"


@pytest.mark.slow
def test_an_increment_grows_only_where_the_solver_took_few_steps(
    halved: tuple[bk.SolvedSteps, list[str]], monkeypatch: pytest.MonkeyPatch
) -> None:
    """The first increment that succeeds is half the way; the next one takes the rest, its half, or a quarter of it."""

    def factors(solution: bk.Solution) -> list[float]:
        messages = [record.message for record in solution.history if "increment to" in record.message]
        words = [message.split("factor ")[1].split(";")[0] for message in messages]
        return [float(word) for word in dict.fromkeys(words)]

    monkeypatch.setattr(load_path, "_FAST", 0)
    monkeypatch.setattr(load_path, "_SLOW", 0)
    quick, slow = factors(halved[0][-1]), factors(bk.run(IMPATIENT))
    assert len(slow) > len(quick)
    assert slow[1] - slow[0] == pytest.approx(0.5 * slow[0])


@pytest.mark.slow
def test_the_whole_path_is_followed_once_in_a_load_step() -> None:
    class Counting(SolutionPath):
        n_paths = 0

        def step(self, problem, iterate):  # type: ignore[no-untyped-def]
            Counting.n_paths += self.from_start
            return replace(iterate, ended=Status.STALLED, message="counted")

    drivers = (bk.SemismoothNewton(max_steps=5), Counting(from_start=True))
    assembly = replace(wall(3, 4, push=True), load_factors=(0.0, 4.6), solver=bk.Fallbacks(drivers))
    solution = bk.run(assembly)
    assert "increments reached it" in solution.message
    assert Counting.n_paths == 1
