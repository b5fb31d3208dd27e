"""Scenes of several bodies driven to their extremes."""

import dataclasses

import pytest

import bemkit as bk
from bemkit.contact.laws import Frictionless
from bemkit.errors import InputError
from bemkit.geometry.placement import Placement
from bemkit.model.units import TooFarError
from bemkit.runs.run import run
from bemkit.scene.load_history import load_steps
from bemkit.scene.scene import Scene
from bemkit.scene.toml import load_scene, with_overrides
from bemkit.studies.engine import StudyError
from bemkit.studies.stability.axes import axes_of, find_axes
from bemkit.studies.stability.records import Verdict
from bemkit.studies.stability.sweep import TWIN_OF_BODIES, difference, sweep
from tests.slow import slow_except

EXTREMES = {
    "stress": (1e-9, 1e9),
    "size": (1e-9, 1e9),
    "turn": (137.0,),
    "position": (1e2, 1e12),
    "stiffness": (1e-3, 1e8),
    "friction": (0.0, 100.0),
    "elements": (0.5,),
}
SIMILAR = ("stress", "size", "turn")


@pytest.fixture(scope="module")
def pin():
    scene = with_overrides(load_scene("pin-in-plate"), elements=40)
    assert isinstance(scene, Scene)
    return scene


def test_every_axis_is_tested_here(pin):
    assert {axis.name for axis in axes_of(pin)} == set(EXTREMES)
    with pytest.raises(StudyError, match="axis 'gap' does not apply to this scene: it is about one body; remove"):
        list(sweep(pin, find_axes(["gap"])))
    with pytest.raises(StudyError, match="axis 'turn' does not apply to this scene: it is about several bodies"):
        list(sweep(load_scene("paper-1"), find_axes(["turn"])))


@pytest.mark.slow
@pytest.mark.parametrize("name", EXTREMES)
def test_the_ends_of_every_axis_are_right_or_named(pin, name):
    (axis,) = find_axes([name])
    for row in sweep(pin, [dataclasses.replace(axis, values=EXTREMES[name])]):
        verdict = Verdict(row.verdict)
        assert verdict in (Verdict.RIGHT, Verdict.NAMED), row
        if name in SIMILAR:
            assert verdict is Verdict.RIGHT
            assert row.deviation < 1e-10  # 1e-12 found: round-off of coordinates


@pytest.mark.slow
@pytest.mark.parametrize("name", SIMILAR)
def test_parts_chosen_by_a_region_follow_the_body(name):
    cylinders = with_overrides(load_scene("two-cylinders"), elements=40)
    assert isinstance(cylinders, Scene)
    assert any(part.where for body in cylinders.bodies for part in body.parts)
    (axis,) = find_axes([name])
    (row,) = sweep(cylinders, [dataclasses.replace(axis, values=EXTREMES[name][-1:])])
    assert Verdict(row.verdict) is Verdict.RIGHT
    assert row.deviation < 1e-10


@pytest.mark.slow
def test_curved_bodies_far_away_are_what_they_are_at_home():
    cylinders = with_overrides(load_scene("two-cylinders"), elements=40)
    (axis,) = find_axes(["position"])
    rows = list(sweep(cylinders, [dataclasses.replace(axis, values=(1e6, 1e8))]))
    assert [row.verdict for row in rows] == ["right", "named"]
    assert "body 'upper' lies" in rows[-1].message
    upper, *others = cylinders.bodies
    drawn_afar = dataclasses.replace(upper.shape, centre=(1e9, 0.0))
    upper = dataclasses.replace(upper, shape=drawn_afar, placement=Placement((-1e9, 1.0)), parts=())
    with pytest.raises(TooFarError, match="body 'upper', where it is drawn, lies"):
        run(dataclasses.replace(cylinders, bodies=(upper, *others), contacts=(), law=Frictionless()))


def test_a_copy_that_is_not_similar_is_seen(pin):
    softer = dataclasses.replace(TWIN_OF_BODIES, modulus=1.0, stress=1.0)
    one, other = run(pin), run(softer.apply(pin))
    assert difference(one, other, TWIN_OF_BODIES) > 0.1
    assert difference(one, other, softer) < 1e-9


@pytest.fixture(scope="module")
def sheared():
    """A rigid disc that a force presses onto a block, and another shears and lets go, in steps, by a law of slip."""
    block = bk.Body(
        name="block",
        shape=bk.Rectangle(2.0, 1.0),
        material=bk.Material(1.0, 0.3),
        parts=(bk.Part("base", bk.Clamped(), ("bottom",)),),
        mesh=bk.MeshOptions(elements=60),
    )
    disc = bk.RigidBody(
        name="disc", obstacle=bk.RigidCircle((1.0, 2.0), 1.0), centre=(1.0, 2.0), force_x=0.0, force_y=-0.01, turn=0.0
    )
    shear = {"rigid.disc.force_x": "2.2e-3 * (1 - (t - 2)**2)"}
    return Scene(
        title="Sheared disc",
        bodies=(block,),
        rigid=(disc,),
        contacts=(bk.ContactPair(("block.top", "disc"), reach=0.5),),
        law=bk.SlipWeakening(0.3, 0.2, 1e-3),
        discretisation=bk.Galerkin(1),
        steps=(bk.Step(1.0), bk.Step(3.0, shear, increments=2)),
    )


@pytest.mark.parametrize("name", slow_except(("stress", "size", "turn", "stiffness", "elements"), "turn"))
def test_rigid_bodies_and_load_steps_have_similar_ones(sheared, name):
    (axis,) = find_axes([name])
    values = {"stiffness": (2.0,), "elements": (1.5,)}.get(name, EXTREMES[name][-1:])
    (row,) = sweep(sheared, [dataclasses.replace(axis, values=values)])
    assert Verdict(row.verdict) is Verdict.RIGHT, row
    if name in SIMILAR:
        assert row.deviation < 1e-8  # the certificate of a press by forces, 1e-9, in displacements of a soft half-space


@pytest.mark.slow
def test_steps_count_in_similar_assemblies(sheared):
    """The last step alone, without what slipped before, is another problem."""
    whole = run(sheared)
    assert "slip" in whole.at_step(2).contact.status_words()
    again = run(TWIN_OF_BODIES.apply(sheared))
    assert again.loading is not None
    assert len(again.loading.steps) == 3
    assert difference(whole, again, TWIN_OF_BODIES) < 1e-8
    alone = run(TWIN_OF_BODIES.apply(load_steps(sheared)[-1]))
    assert difference(whole, alone, TWIN_OF_BODIES) > 1e-4


def test_what_has_no_similar_assembly_is_refused(sheared):
    (punch,) = sheared.rigid
    (turn,) = find_axes(["turn"])
    pressed = load_scene("tilted-punch")
    assert "rigid body 'punch' is driven by a force along only one axis" in turn.reason_against(pressed)
    assert turn.reason_against(sheared) == ""
    for changes, words in (
        (
            {"rigid": (dataclasses.replace(punch, obstacle=bk.SignedDistance(bk.Expression("x + y"))),)},
            "obstacle is SignedDistance",
        ),
        ({"law": bk.SlipWeakening(bk.Expression("0.3 + 0 * x"), 0.2, 1e-3)}, "is not a number: give one"),
    ):
        with pytest.raises(InputError, match=words):
            TWIN_OF_BODIES.apply(dataclasses.replace(sheared, **changes))
