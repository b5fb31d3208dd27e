"""Steps in scenes and scene files: what they change, formulas of the time, and whatever can be wrong with them."""

from __future__ import annotations

import pickle
from contextlib import nullcontext
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import bemkit as bk
from bemkit.formulas import ExpressionError
from bemkit.scene.keys import SceneKeyError
from bemkit.scene.load_history import load_steps
from bemkit.scene.toml import SceneError, scene_from_toml, scene_to_toml
from tests.runs.test_rigid_bodies import driven

SCENE = replace(bk.load_scene("paper-1"), mesh=bk.MeshOptions(elements=24))
LOAD = "parts.top-load.condition.y"


def condition(scene: bk.Scene, part: str) -> Any:
    return next(each.condition for each in scene.parts if each.name == part)


def test_numbers_hold_and_formulas_follow_the_time() -> None:
    steps = (
        bk.Step(1.0, {LOAD: "-t", "law.friction_coefficient": 0.2}, increments=2),
        bk.Step(3.0, {"law.friction_coefficient": "0.2 + 0.1*(t - 1)"}),
        bk.Step(4.0, {LOAD: -0.5, "law": {"kind": "tresca", "bound_value": 0.1}}),
    )
    states = load_steps(replace(SCENE, steps=steps))
    assert [state.steps for state in states] == [(bk.Step(time),) for time in (0.5, 1.0, 3.0, 4.0)]
    assert [condition(state, "top-load").y for state in states] == [-0.5, -1.0, -1.0, -0.5]  # the formula ends
    laws = [bk.Coulomb(0.2), bk.Coulomb(0.2), bk.Coulomb(0.4), bk.Tresca(0.1)]
    assert [state.law for state in states] == laws
    assert replace(SCENE, steps=steps).n_steps == 4
    assert all(condition(state, "left-load") is condition(SCENE, "left-load") for state in states)


def test_load_factors_are_steps_of_one_kind() -> None:
    factors = load_steps(replace(SCENE, load_factors=(0.5, 1.5)))
    steps = load_steps(replace(SCENE, steps=(bk.Step(1.0, load_factor="t / 2"), bk.Step(2.0, load_factor=1.5))))
    assert factors == steps
    left = load_steps(replace(SCENE, steps=(bk.Step(0.5, load_factor="t"), bk.Step(2.0))))
    assert left[1].parts == left[0].parts == load_steps(replace(SCENE, load_factors=(0.5,)))[0].parts
    (single,) = load_steps(replace(SCENE, load_factors=(2.0,)))
    assert single.steps == ()


def test_formulas_of_time_and_place_and_functions() -> None:
    steps = (bk.Step(0.5, {LOAD: "-t**2 * (1 + x)"}), bk.Step(2.0, {LOAD: lambda t: bk.Expression(f"-{t} * y")}))
    first, second = load_steps(replace(SCENE, steps=steps))
    points = np.array([[0.25, 1.0]])
    assert condition(first, "top-load").at(points, points)[0, 1] == pytest.approx(-0.25 * 1.25, rel=1e-15)
    assert condition(second, "top-load").y == bk.Expression("-2.0 * y")
    with pytest.raises(SceneError, match="a Python function cannot be written"):
        scene_to_toml(replace(SCENE, steps=steps))


def test_steps_move_rigid_bodies_and_gaps() -> None:
    assembly = driven(y=-0.01, force_y=None)
    (pair,) = assembly.contacts
    steps = (
        bk.Step(1.0, {"rigid.punch.y": "-0.02*t", "contacts[0].gap": 1e-4}),
        bk.Step(2.0, {"law": bk.Coulomb(0.1)}),
    )
    first, second = load_steps(replace(assembly, steps=steps))
    assert [each.rigid[0].y for each in (first, second)] == [-0.02, -0.02]
    assert first.contacts == (replace(pair, gap=1e-4),)
    assert second.law == bk.Coulomb(0.1)
    assert first.bodies[0] is assembly.bodies[0]  # what no step names is not even made anew


def test_steps_in_scene_files() -> None:
    text = scene_to_toml(SCENE) + (
        "\n[[steps]]\ntime = 1\nincrements = 2\nload_factor = 't'\n"
        f"\n[[steps]]\ntime = 2\n[steps.changes]\n'{LOAD}' = '-t'\nlaw = {{ kind = 'tresca', bound_value = 0.3 }}\n"
    )
    text = text.replace("load_factors = [\n    1.0,\n]\n", "")
    scene = scene_from_toml(text)
    assert scene.steps[0] == bk.Step(1.0, load_factor="t", increments=2)
    assert scene_from_toml(scene_to_toml(scene)) == scene
    assert load_steps(scene)[2].law == bk.Tresca(0.3)
    from_objects = replace(
        SCENE, steps=(scene.steps[0], replace(scene.steps[1], changes={LOAD: "-t", "law": bk.Tresca(0.3)}))
    )
    assert load_steps(scene_from_toml(scene_to_toml(from_objects))) == load_steps(scene)
    assert pickle.loads(pickle.dumps(scene)) == scene


@pytest.mark.parametrize(
    ("steps", "message"),
    [
        (
            (bk.Step(1.0, {"parts.top_load.condition.y": 1.0}),),
            r"steps\[0\]: parts\.top_load: unknown key: .*'top-load'",
        ),
        ((bk.Step(1.0), bk.Step(2.0, {LOAD: "-q"})), r"steps\[1\]: .*condition\.y: .*'q': unknown name"),
        ((bk.Step(1.0, {LOAD: "sqrt(t - 2)"}),), r"steps\[0\]: expression 'sqrt\(\(1\.0\) - 2\)' is nan"),
        ((bk.Step(1.0, {"law.friction_coefficient": "-t"}),), r"steps\[0\]: law: friction_coefficient = -1"),
        ((bk.Step(1.0, {"mesh.elements": 0.5}),), r"steps\[0\]: mesh\.elements: 0\.5 does not fit"),
        ((bk.Step(1.0, {"law..x": 1.0}),), r"steps\[0\]: key 'law\.\.x': give a key of a scene file"),
        ((bk.Step(1.0, load_factor="x"), bk.Step(2.0)), r"steps\[0\]: load_factor is 'x' at t = 1: give a number"),
    ],
)
def test_steps_that_fit_nowhere_are_named(steps: tuple[bk.Step, ...], message: str) -> None:
    with pytest.raises(bk.InputError, match=message):
        bk.run(replace(SCENE, steps=steps))


@pytest.mark.parametrize("law", [bk.Coulomb(0.5), None])
def test_steps_change_no_law_that_no_contact_takes(law: bk.FrictionLaw | None) -> None:
    parts = tuple(
        replace(part, condition=replace(part.condition, law=law)) if isinstance(part.condition, bk.Contact) else part
        for part in SCENE.parts
    )
    scene = replace(SCENE, parts=parts, steps=(bk.Step(1.0), bk.Step(2.0, {"law.friction_coefficient": 0.1})))
    message = r"steps\[1\]: law.friction_coefficient changes, but every contact has a law of its own: change these"
    with nullcontext() if law is None else pytest.raises(bk.InputError, match=message):
        load_steps(scene)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"steps": (bk.Step(2.0), bk.Step(2.0))}, r"steps\[1\]: time is 2 after 2: give times that increase"),
        ({"steps": (bk.Step(1.0),), "load_factors": (0.5, 1.0)}, r"load_factors is \(0\.5, 1\.0\) besides 1 steps"),
        (
            {"law": bk.SlipWeakening(0.5, 0.3, 1e-3)},
            r"law of part 'foundation' is SlipWeakening, which depends on slip",
        ),
        ({"law": bk.RateStrengthening(0.5, 0.1, 1.0)}, r"RateStrengthening.*: give \[\[steps\]\] with their times"),
    ],
)
def test_histories_that_are_none_are_refused(options: dict[str, Any], message: str) -> None:
    with pytest.raises(bk.InputError, match=message):
        replace(SCENE, **options)


def test_laws_of_assemblies_that_need_steps() -> None:
    with pytest.raises(bk.InputError, match=r"^law is SlipWeakening, which depends on slip or time"):
        replace(driven(), law=bk.SlipWeakening(0.5, 0.3, 1e-3))
    (pair,) = driven().contacts
    with pytest.raises(bk.InputError, match=r"^law of contact '.*' is RateStrengthening"):
        replace(driven(), contacts=(replace(pair, law=bk.RateStrengthening(0.5, 0.1, 1.0)),))


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"time": 0.0}, r"time is 0\.0: give the time at the end of the step, a positive number"),
        ({"time": float("nan")}, "time is nan"),
        ({"time": 1.0, "increments": 0}, "increments is 0: give a whole number, 1 or more"),
        ({"time": 1.0, "increments": 2.0}, "increments is 2.0: give a whole number"),
    ],
)
def test_steps_that_are_none(options: dict[str, Any], message: str) -> None:
    with pytest.raises(bk.InputError, match=message):
        bk.Step(**options)


def test_the_time_is_known_in_steps_alone() -> None:
    with pytest.raises(
        ExpressionError, match=r"'t': the time is not known here; write formulas of t among the changes"
    ):
        bk.Expression("1 + t")


def test_times_of_scenes_that_follow_each_other_increase() -> None:
    first, second = (replace(SCENE, steps=(bk.Step(time),)) for time in (2.0, 1.0))
    with pytest.raises(bk.InputError, match="step 2: time is 1 after 2: give times that increase"):
        bk.run([first, second])


def test_places_name_what_does_not_fit() -> None:
    with pytest.raises(
        SceneKeyError, match=r"steps\[0\]: parts\.foundation\.condition\.obstacle\.point\[2\]: unknown entry"
    ):
        load_steps(replace(SCENE, steps=(bk.Step(1.0, {"parts.foundation.condition.obstacle.point[2]": 1.0}),)))
