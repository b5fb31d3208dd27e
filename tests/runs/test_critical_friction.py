"""Critical friction of scenes: Hild's triangle, whose coefficient is known, and solutions that are found."""

from __future__ import annotations

import json
import math
from dataclasses import replace

import numpy as np
import pytest

import bemkit as bk
from bemkit.cli.main import main
from bemkit.errors import InputError, NoResultError
from bemkit.runs.distinct_solutions import distinct_solutions
from bemkit.runs.steps import UnsolvableSceneError
from bemkit.scene.load_history import with_scaled_loads
from tests.model.test_finite_sliding import on_floor

LEG = bk.load_scene("wedged-leg")


def triangle(nu: float, discretisation: bk.Discretisation) -> bk.Scene:
    """A triangle, one side held, one in contact, one free, on which u = (x - q y, 0) needs no forces but friction.

    It vanishes on the held side x = q y, and with q^2 = lambda (lambda + 2 mu) / mu^2 the stress has a direction
    without traction, the normal of the free side. Uniform pressure keeps all of the foot in contact.
    """
    lame, shear = nu / ((1.0 + nu) * (1.0 - 2.0 * nu)), 0.5 / (1.0 + nu)
    q = np.sqrt(lame * (lame + 2.0 * shear)) / shear
    held, free = np.array([q, 1.0]), np.array([-(lame + 2.0 * shear), shear * q])
    tip = np.linalg.solve(np.stack([held, -free], axis=1), [1.0, 0.0])[0] * held
    squeeze = bk.PrescribedDisplacement(bk.Expression("-0.001 * x"), bk.Expression("-0.001 * y"))
    return bk.Scene(
        title="triangle",
        shape=bk.Polygon(((0.0, 0.0), (1.0, 0.0), (float(tip[0]), float(tip[1]))), ("foot", "free", "held")),
        material=bk.Material(1.0, nu),
        law=bk.Coulomb(0.01),
        parts=(
            bk.Part("foot", bk.Contact(bk.RigidHalfPlane()), ("foot",)),
            bk.Part("held", squeeze, ("held",)),
            bk.Part("push", bk.Pressure(0.002 * (lame + shear)), ("free",)),
        ),
        discretisation=discretisation,
        mesh=bk.MeshOptions(elements=24),
    )


@pytest.mark.parametrize("discretisation", [bk.Galerkin(1), bk.Galerkin(2), bk.ConstantCollocation()])
@pytest.mark.parametrize("nu", [0.2, 0.3, 0.4])
def test_a_triangle_loses_uniqueness_where_hild_says(nu: float, discretisation: bk.Discretisation) -> None:
    """sqrt((1 - nu) / nu): the motion is linear, so that elements hold it to round-off."""
    scene = triangle(nu, discretisation)
    found = bk.critical_friction(scene)
    assert found.n_contact == found.n_slipping > 4
    assert found.forward == pytest.approx(math.sqrt((1.0 - nu) / nu), rel=1e-10)
    assert found.smallest == found.forward
    # the foot slips backward in the solution
    assert found.present == found.backward


def with_friction(friction: float, degrees: float) -> bk.Scene:
    """The leg, pushed to the left and down, by an angle from the horizontal."""
    angle = math.radians(180.0 + degrees)
    load = bk.Traction(1e-3 * math.cos(angle), 1e-3 * math.sin(angle))
    parts = tuple(replace(part, condition=load) if part.name == "push" else part for part in LEG.parts)
    return replace(LEG, law=bk.Coulomb(friction), parts=parts)


def test_a_leg_has_three_solutions_above_and_one_below() -> None:
    found = bk.critical_friction(LEG)
    assert found.n_contact == 6  # all nodes of the foot
    assert found.backward == pytest.approx(1.0051, abs=1e-4)
    assert (found.forward, found.smallest) == (math.inf, found.backward)
    assert len(distinct_solutions(LEG)) == 3
    # on the corner alone it loses uniqueness at 0.8575, which is the least of all sets at one end of the foot
    for degrees in (30.0, 60.0):
        assert len(distinct_solutions(with_friction(0.85, degrees))) == 1
    assert len(distinct_solutions(with_friction(1.02, 48.0))) == 3


@pytest.mark.slow
@pytest.mark.parametrize(("coefficient", "degrees", "number"), [(0.85, 48.0, 1), (0.93, 50.0, 3)])
def test_a_leg_has_its_solutions_at_other_angles(coefficient: float, degrees: float, number: int) -> None:
    assert len(distinct_solutions(with_friction(coefficient, degrees))) == number


def test_one_of_several_bodies_is_as_critical_as_alone() -> None:
    body = bk.Body(name="leg", shape=LEG.shape, material=LEG.material, parts=LEG.parts, mesh=LEG.mesh)
    assembly = bk.Scene(title="leg", bodies=(body,), law=LEG.law, discretisation=LEG.discretisation)
    assert bk.critical_friction(assembly).backward == pytest.approx(bk.critical_friction(LEG).backward, rel=1e-8)


def test_units_and_meshes_that_follow_an_accuracy_change_nothing_else() -> None:
    scaled = replace(LEG, material=bk.Material(2e11, 0.3))
    parts = tuple(replace(p, condition=bk.Traction(-2e7, -2e7)) if p.name == "push" else p for p in LEG.parts)
    found = bk.critical_friction(replace(scaled, parts=parts))
    assert found.backward == pytest.approx(bk.critical_friction(LEG).backward, rel=1e-9)
    fine = bk.critical_friction(replace(triangle(0.3, bk.Galerkin(2)), mesh=bk.MeshOptions(accuracy=0.05)))
    assert fine.forward == pytest.approx(math.sqrt(7.0 / 3.0), rel=1e-8)


def floating(law: bk.FrictionLaw) -> bk.Scene:
    """A block that nothing but its friction on the floor keeps from sliding."""
    return bk.Scene(
        title="block",
        shape=bk.Rectangle(1.0, 1.0),
        material=bk.Material(1.0, 0.3),
        law=law,
        parts=(
            bk.Part("floor", bk.Contact(bk.RigidHalfPlane()), ("bottom",)),
            bk.Part("load", bk.Pressure(1.0), ("top",)),
        ),
        mesh=bk.MeshOptions(elements=24),
    )


def stacked(law: bk.FrictionLaw) -> bk.Scene:
    """A block on a block that is held."""
    shape, material = bk.Rectangle(1.0, 1.0), bk.Material(1.0, 0.3)
    foot, load = bk.Part("foot", bk.Clamped(), ("bottom",)), bk.Part("load", bk.Pressure(1e-3), ("top",))
    lower = bk.Body(name="lower", shape=shape, material=material, parts=(foot,))
    upper = bk.Body(
        name="upper", shape=shape, material=material, parts=(load,), placement=bk.Placement(shift=(0.0, 1.0))
    )
    return bk.Scene(
        title="stack",
        bodies=(lower, upper),
        contacts=(bk.ContactPair(("lower.top", "upper.bottom")),),
        law=law,
        mesh=bk.MeshOptions(elements=16),
    )


@pytest.mark.parametrize(
    ("scene", "error", "message"),
    [
        (bk.load_scene("bending"), InputError, "no part is in contact: nothing slides"),
        (
            replace(LEG, law=bk.Frictionless()),
            bk.InputError,
            "friction does not grow with the pressure: choose Coulomb",
        ),
        (replace(LEG, law=bk.Tresca(0.1)), bk.InputError, "friction does not grow with the pressure: choose Coulomb"),
        (replace(LEG, load_factors=(0.5, 1.0)), InputError, "a load history of 2 steps has no single state"),
        (with_friction(0.3, 10.0), NoResultError, "no node with friction is in contact under this load"),
        (
            floating(bk.Coulomb(0.3)),
            UnsolvableSceneError,
            "friction keeps the body from sliding, at any coefficient: add a support",
        ),
        (
            stacked(bk.Coulomb(0.3)),
            UnsolvableSceneError,
            "only friction keeps body 'upper' from sliding, at any coefficient: add a support",
        ),
        (
            replace(LEG, solver=bk.SemismoothNewton(max_steps=1)),
            NoResultError,
            "the scene has no solution to begin with: ",
        ),
    ],
)
def test_scenes_without_such_a_coefficient_are_named(scene: bk.Scene, error: type[Exception], message: str) -> None:
    with pytest.raises(error, match=message):
        bk.critical_friction(scene)


@pytest.mark.slow
def test_steps_and_load_factors_count() -> None:
    with pytest.raises(InputError, match="a load history of 32 steps has no single state"):
        bk.critical_friction(bk.load_scene("friction-loop"))
    rough = bk.critical_friction(replace(LEG, law=bk.Coulomb(1.5)))
    step = bk.Step(1.0, {"law.friction_coefficient": 1.5})
    assert bk.critical_friction(replace(LEG, steps=(step,))).n_slipping == rough.n_slipping
    assert rough.n_slipping != bk.critical_friction(LEG).n_slipping
    pulled = bk.critical_friction(replace(LEG, load_factors=(-1.0,)))
    assert pulled == bk.critical_friction(with_scaled_loads(LEG, -1.0))
    assert pulled != bk.critical_friction(LEG)


def roll(y: float) -> bk.Scene:
    """Half a disc that is moved into a plane, which it meets between two nodes."""
    tip = bk.Part("tip", bk.Contact(bk.RigidHalfPlane()), ("arc",), bk.Expression("-0.1 < x and x < 0.3"))
    return bk.Scene(
        title="roll",
        shape=bk.Sector(1.0, 180.0, 360.0, centre=(0.0, 1.0)),
        material=bk.Material(1.0, 0.3),
        law=bk.Coulomb(0.3),
        parts=(bk.Part("load", bk.PrescribedDisplacement(0.0, y), ("start", "end")), tip),
        mesh=bk.MeshOptions(elements=41),
    )


@pytest.mark.parametrize(
    ("scene", "words"),
    [
        (roll(-1e-6), "overlaps by 1e-06 at"),
        (replace(on_floor(0.0, -0.5), law=bk.Coulomb(0.3)), "the sides move by 0.45. along each other"),
    ],
)
def test_states_that_are_none_of_the_scene_are_not_searched(scene: bk.Scene, words: str) -> None:
    with pytest.raises(NoResultError, match=f"the scene has no solution to begin with: .*{words}"):
        bk.critical_friction(scene)
    assert not distinct_solutions(scene, n_starts=2)


def test_an_accuracy_that_no_mesh_reaches_is_named() -> None:
    options = bk.MeshOptions(accuracy=1e-6, most_elements=60)
    scene = replace(LEG, mesh=options, discretisation=bk.Galerkin(2))
    for search in (bk.critical_friction, distinct_solutions):
        with pytest.raises(NoResultError, match="no mesh reaches the accuracy, give elements or ask for less: The acc"):
            search(scene)


def test_bodies_that_follow_an_accuracy_are_placed_once() -> None:
    plate = bk.Body(
        name="plate",
        shape=bk.Rectangle(1.0, 0.5),
        material=bk.Material(1.0, 0.3),
        parts=(bk.Part("base", bk.Clamped(), ("bottom",)),),
    )
    punch = bk.Body(
        name="punch",
        shape=bk.Rectangle(0.4, 0.4),
        material=bk.Material(1.0, 0.3),
        parts=(bk.Part("push", bk.PrescribedDisplacement(0.0, -1e-3), ("top",)),),
        placement=bk.Placement((0.3, 0.5)),
    )
    contact = bk.ContactPair(("punch.bottom", "plate.top"))
    options = bk.MeshOptions(accuracy=0.2)
    assembly = bk.Scene(title="punch", bodies=(plate, punch), contacts=(contact,), law=bk.Coulomb(0.3), mesh=options)
    assert bk.critical_friction(assembly).n_contact > 4


def test_bodies_that_do_not_touch_are_named() -> None:
    body = bk.Body(
        name="leg",
        shape=LEG.shape,
        material=LEG.material,
        parts=(bk.Part("top", bk.Clamped(), ("top",)),),
        mesh=LEG.mesh,
    )
    with pytest.raises(InputError, match="no part is in contact: nothing slides"):
        bk.critical_friction(bk.Scene(title="leg", bodies=(body,)))


def call(*arguments: str) -> int:
    with pytest.raises(SystemExit) as caught:
        main(["critical-friction", *arguments])
    assert isinstance(caught.value.code, int)
    return caught.value.code


def test_the_command_prints_and_writes_json(capsys: pytest.CaptureFixture[str]) -> None:
    assert call("wedged-leg") == 0
    out = capsys.readouterr().out
    assert "6 nodes in contact, 4 of them slip in the solution" in out
    assert "all slide forward:             unique at any friction" in out
    assert "all slide backward:            loses uniqueness at 1.0051" in out
    assert call("wedged-leg", "--json", "-") == 0
    content = json.loads(capsys.readouterr().out)
    assert content["title"] == LEG.title
    assert content["forward"] is None
    assert content["smallest"] == content["backward"]
    assert call("wavy-obstacle") == 2
    assert "wavy-obstacle: friction does not grow with the pressure" in capsys.readouterr().err
