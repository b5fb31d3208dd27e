"""Scenes of several bodies driven to their extremes."""

import dataclasses

import pytest

from bemkit.errors import InputError
from bemkit.geometry.placement import Placement
from bemkit.model.prepared import TooFarError
from bemkit.runs.run import run
from bemkit.scene.assembly import Assembly
from bemkit.scene.toml import load_scene, with_overrides
from bemkit.studies.stability.assembly_axes import ASSEMBLY_AXES
from bemkit.studies.stability.axes import UnknownAxisError, find_axes
from bemkit.studies.stability.records import Verdict
from bemkit.studies.stability.sweep import ASSEMBLY_TWIN, difference, sweep

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
    assert isinstance(scene, Assembly)
    return scene


def test_every_axis_is_tested_here():
    assert {axis.name for axis in ASSEMBLY_AXES} == set(EXTREMES)
    with pytest.raises(UnknownAxisError, match="'gap': the axes are stress, size, turn"):
        find_axes(["gap"], ASSEMBLY_AXES)


@pytest.mark.parametrize("name", EXTREMES)
def test_the_ends_of_every_axis_are_right_or_named(pin, name):
    (axis,) = find_axes([name], ASSEMBLY_AXES)
    for row in sweep(pin, [dataclasses.replace(axis, values=EXTREMES[name])]):
        verdict = Verdict(row.verdict)
        assert verdict in (Verdict.RIGHT, Verdict.NAMED), row
        if name in SIMILAR:
            assert verdict is Verdict.RIGHT
            assert row.drift < 1e-10  # 1e-12 found: round-off of coordinates


@pytest.mark.parametrize("name", SIMILAR)
def test_parts_chosen_by_a_region_follow_the_body(name):
    cylinders = with_overrides(load_scene("two-cylinders"), elements=40)
    assert isinstance(cylinders, Assembly)
    assert any(part.where for body in cylinders.bodies for part in body.parts)
    (axis,) = find_axes([name], ASSEMBLY_AXES)
    (row,) = sweep(cylinders, [dataclasses.replace(axis, values=EXTREMES[name][-1:])])
    assert Verdict(row.verdict) is Verdict.RIGHT
    assert row.drift < 1e-10


def test_curved_bodies_far_away_are_what_they_are_at_home():
    cylinders = with_overrides(load_scene("two-cylinders"), elements=40)
    (axis,) = find_axes(["position"], ASSEMBLY_AXES)
    rows = list(sweep(cylinders, [dataclasses.replace(axis, values=(1.0, 1e6, 1e8))]))
    assert [row.verdict for row in rows] == ["right", "right", "named"]
    assert "body 'upper' lies" in rows[-1].message
    upper, *others = cylinders.bodies
    drawn_afar = dataclasses.replace(upper.shape, centre=(1e9, 0.0))
    upper = dataclasses.replace(upper, shape=drawn_afar, placement=Placement((-1e9, 1.0)), parts=())
    with pytest.raises(TooFarError, match="body 'upper', where it is drawn, lies"):
        run(dataclasses.replace(cylinders, bodies=(upper, *others), contacts=()))


def test_a_twin_that_is_not_similar_is_seen(pin):
    one, other = run(pin), run(dataclasses.replace(ASSEMBLY_TWIN, stress=1.0).apply(pin))
    assert difference(one, other, ASSEMBLY_TWIN) > 0.1
    assert difference(one, other, dataclasses.replace(ASSEMBLY_TWIN, stress=1.0)) < 1e-9


def test_what_has_no_similar_assembly_is_refused():
    with pytest.raises(InputError, match="the assembly has rigid bodies: leave them out"):
        ASSEMBLY_TWIN.apply(load_scene("tilted-punch"))
