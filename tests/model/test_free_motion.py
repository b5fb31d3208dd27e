"""Unsolvable scenes are named in words, directions and physical units."""

from __future__ import annotations

import dataclasses
import re

import numpy as np
import pytest

import bemkit as bk
from bemkit.contact.solvability import UnsolvableLoad
from bemkit.model.free_motion import describe
from bemkit.model.model import build_model
from bemkit.model.prepared import prepare
from bemkit.runs.run import UnsolvableSceneError
from tests.scene.test_load_history import block
from tests.slow import slow_except


def complaint(scene: bk.Scene) -> str:
    with pytest.raises(UnsolvableSceneError) as caught:
        bk.run(scene)
    return str(caught.value)


def floating(load: bk.Traction, floor: bk.RigidHalfPlane, side: str, opposite: str) -> bk.Scene:
    return bk.Scene(
        title="floating",
        shape=bk.Rectangle(2.0, 2.0),
        material=bk.Material(3e7, 0.3),
        parts=(
            bk.Part("floor", bk.Contact(floor), sides=(side,)),
            bk.Part("load", load, sides=(opposite,)),
        ),
        mesh=bk.MeshOptions(elements=40),
    )


@pytest.mark.parametrize("law", [bk.Frictionless(), bk.Coulomb(0.5)], ids=lambda law: type(law).__name__)
def test_a_lifted_body(law: bk.FrictionLaw) -> None:
    scene = bk.load_scene("paper-1")
    lift = dataclasses.replace(scene.parts[2], condition=bk.Traction(y=0.1))
    lifted = dataclasses.replace(scene, law=law, parts=(*scene.parts[:2], lift, *scene.parts[3:]))
    # 0.1 on half of the top of length 1
    sentence = "the load pushes the body upward with 0.05; nothing holds it: change the load or hold the body"
    assert complaint(lifted) == sentence


@pytest.mark.parametrize(
    ("load", "floor", "side", "opposite", "words"),
    [
        (bk.Traction(y=-5.0), bk.RigidHalfPlane((0.0, 2.0), (0.0, -1.0)), "top", "bottom", "downward with 10"),
        (bk.Traction(x=-5.0), bk.RigidHalfPlane((2.0, 0.0), (-1.0, 0.0)), "right", "left", "to the left with 10"),
        (bk.Traction(x=5.0), bk.RigidHalfPlane((0.0, 0.0), (1.0, 0.0)), "left", "right", "to the right with 10"),
    ],
)
def test_directions(load: bk.Traction, floor: bk.RigidHalfPlane, side: str, opposite: str, words: str) -> None:
    assert f"the load pushes the body {words}; nothing holds it" in complaint(floating(load, floor, side, opposite))


def test_a_contact_that_faces_away_is_named() -> None:
    away = floating(bk.Traction(y=-5.0), bk.RigidHalfPlane((0.0, 0.0), (0.0, -1.0)), "bottom", "top")
    assert "nothing holds it: all contacts face away from their obstacles; choose sides" in complaint(away)


@pytest.mark.parametrize(("push", "direction"), [(0.3, "to the right"), (-0.3, "to the left")])
def test_a_sliding_body(push: float, direction: str) -> None:
    # 0.6 against 0.4 times the pressing force 1.0
    text = complaint(block(push=push, press=-0.5))
    assert text.startswith(f"the load slides the body {direction} with 0.2 more than friction can hold")


@pytest.mark.parametrize(
    ("push", "pivot", "sense", "moment"), [(1.5, "(2, 0)", "clockwise", 1.0), (-1.5, "(0, 0)", "anticlockwise", 1.0)]
)
def test_a_tipping_body(push: float, pivot: str, sense: str, moment: float) -> None:
    # pushed by 3 at the height 1 and pressed by 2 at the distance 1 from the corner; a stop keeps it from sliding
    text = complaint(block(push=push, press=-1.0, law=bk.Coulomb(1e3)))
    assert text.startswith(f"the load turns the body {sense} about {pivot} with {moment:.4g}")


def test_forces_do_not_depend_on_the_size_of_the_body_or_its_stiffness() -> None:
    for factor in (1e-6, 1e6):
        scene = floating(bk.Traction(y=1.0), bk.RigidHalfPlane(), "bottom", "top")
        scene = dataclasses.replace(scene, shape=bk.Rectangle(2.0 * factor, 2.0 * factor))
        assert f"upward with {2.0 * factor:.4g}" in complaint(scene)


@pytest.mark.slow
def test_a_free_disc_finds_its_rest_on_friction_alone() -> None:
    """No support at all: friction holds the rotation, contact the rest; sets settle in a few solves."""
    scene = bk.Scene(
        title="disc",
        shape=bk.Disk(1.0, (0.0, 1.0)),
        material=bk.Material(1.0, 0.3),
        law=bk.Coulomb(0.3),
        parts=(
            bk.Part("floor", bk.Contact(bk.RigidHalfPlane()), sides=("arc-3", "arc-4")),
            bk.Part("load", bk.Traction(y=-0.01), sides=("arc-1", "arc-2"), where=bk.Expression("y > 1.9")),
        ),
        mesh=bk.MeshOptions(elements=160),
    )
    for discretisation in (bk.Galerkin(1), bk.ConstantCollocation()):
        solution = bk.run(dataclasses.replace(scene, discretisation=discretisation))
        assert solution.linear_solves <= 10
        assert solution.certificate.worst <= 1e-11
        assert abs(solution.force_tangential) <= 1e-10
    model = build_model(prepare(scene, scene.build_mesh()))
    motions = model.body.rigid_motions().reshape(3, -1)
    # curved elements would otherwise leave 1e-6 of the stiffness on rigid motions
    assert abs(model.body.stiffness @ motions.T).max() <= 1e-12 * abs(model.body.stiffness).max()


def column(push: float, law: bk.FrictionLaw, obstacle: bk.Obstacle) -> bk.Scene:
    return bk.Scene(
        title="column",
        shape=bk.Rectangle(1.0, 2.0),
        material=bk.Material(3700.0, 0.3),
        discretisation=bk.ConstantCollocation(),
        mesh=bk.MeshOptions(elements=24),
        law=law,
        parts=(
            bk.Part("foot", bk.Contact(obstacle), sides=("bottom",)),
            bk.Part("load", bk.Traction(y=-1.0), sides=("top",)),
            bk.Part("push", bk.Traction(x=push), sides=("left",)),
        ),
    )


@pytest.mark.parametrize("law", [bk.Frictionless(), bk.Coulomb(0.3), bk.Tresca(0.01), bk.Coulomb(50.0)], ids=repr)
@pytest.mark.parametrize("push", slow_except([-1.0, 0.0, 0.001, 1.0], 1.0))
@pytest.mark.parametrize("x", slow_except([-0.2, 0.5, 0.97, 1.2], 1.2))
def test_a_column_on_a_round_obstacle_stands_or_has_a_named_escape(push: float, law: bk.FrictionLaw, x: float) -> None:
    text = ""
    try:
        bk.run(column(push, law, bk.RigidCircle((x, -0.4), 0.4)))
    except UnsolvableSceneError as error:
        text = str(error)
    assert re.match(r"the load (turns|pushes|slides) the body .* with \S+|$", text)


@pytest.mark.parametrize("node", [0, 3])
def test_a_body_that_turns_about_the_only_node_that_touches_does_not_slide(node: int) -> None:
    """It neither lifts nor moves there, so that the motion along the obstacle is none."""
    scene = column(0.001, bk.Coulomb(0.3), bk.RigidHalfPlane())
    model = build_model(prepare(scene, scene.build_mesh()))
    arms = model.prepared.contact_nodes.points - model.prepared.contact_nodes.points[node]
    turn = np.stack([-arms[:, 1], arms[:, 0]], axis=1)
    motion = np.einsum("nc,nkc->nk", turn, model.prepared.contact_nodes.frame)
    lift = np.where(np.arange(len(arms)) == node, 0.0, np.nan)
    escape = UnsolvableLoad(motion / np.abs(motion).max(), lift, work=1.0)
    assert not escape.is_sliding
    x, y = model.units.to_physical(model.prepared.contact_nodes.points[node])
    assert abs(y) < 1e-15
    assert describe(model.prepared, escape).startswith(f"the load turns the body anticlockwise about ({x:.4g}, 0) with")


@pytest.mark.parametrize("share", [0.5, 2.0])
def test_a_torque_beyond_the_friction_of_a_shrunk_ring_is_named(share: float) -> None:
    """The pressures of the fit bound the friction, which a motion of the ring as a whole does not know."""
    ring = bk.Scene(
        title="ring",
        shape=bk.Ring(1.0, 2.0),
        material=bk.Material(1.0, 0.3),
        law=bk.Coulomb(0.3),
        parts=(
            bk.Part("hole", bk.Contact(bk.Gap(-1e-3)), ("inner",)),
            # the friction of the fit holds a moment of 9.7e-4 N m/m: 1e-3 of interference on this ring
            bk.Part("rim", bk.Pressure(0.0, shear=share * 9.7e-4 / (2.0 * np.pi * 2.0**2)), ("outer",)),
        ),
        discretisation=bk.Galerkin(1),
        mesh=bk.MeshOptions(elements=48),
    )
    solution = bk.run(ring)
    is_named = (
        "At the pressures of the last state the load turns the body anticlockwise about (0, 0)" in solution.message
    )
    assert (solution.is_converged, is_named) == ((True, False) if share < 1.0 else (False, True))


@pytest.mark.parametrize("ends_at_corner", [False, True])
def test_a_corner_that_no_node_meets_is_named(ends_at_corner: bool) -> None:
    """A punch holds moments up to its force times its half width 0.487, where nodes meet its corners."""
    corners = ((0.513, 1.0), (1.487, 1.0), (1.487, 1.5), (0.513, 1.5))
    seat = bk.Part("seat", bk.Free(), ("top",), bk.Expression("x > 0.513 and x < 1.487" if ends_at_corner else "x > 0"))
    base = bk.Part("base", bk.Clamped(), ("bottom",))
    plate = bk.Body(
        name="plate",
        shape=bk.Rectangle(2.0, 1.0),
        material=bk.Material(1.0, 0.3),
        parts=(base, seat),
        mesh=bk.MeshOptions(40),
    )
    moment = 1.2 * 0.487e-3
    punch = bk.RigidBody(
        name="punch", obstacle=bk.RigidPolygon(corners), centre=(1.0, 1.0), force_y=-1e-3, moment=moment
    )
    scene = bk.Scene(
        title="punch", bodies=(plate,), rigid=(punch,), contacts=(bk.ContactPair(("plate.seat", "punch")),)
    )
    words = complaint(scene)
    assert "tips body 'punch' away from body 'plate'" in words
    assert ("The corner (0.513, 1) of the polygon lies between nodes" in words) != ends_at_corner
