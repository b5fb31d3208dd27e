"""Bodies that overlap as they are drawn are refused before anything is solved."""

from __future__ import annotations

from contextlib import nullcontext
from dataclasses import replace

import pytest

import bemkit as bk
from bemkit.model.contacts import OverlapError
from bemkit.model.prepared import prepare

STEEL = bk.Material(1.0, 0.3)
LOWER = bk.Polygon(
    ((0.0, 0.0), (3.0, 0.0), (3.0, 1.2), (2.0, 1.2), (2.0, 1.0), (0.0, 1.0)),
    side_names=("bottom", "right", "step", "riser", "top", "left"),
)


def blocks(left: float = 0.3, interference: float = 0.0) -> bk.Scene:
    """A block on a block with a step, into which it reaches by 0.3 beside their contact."""
    lower = bk.Body(name="lower", shape=LOWER, material=STEEL, parts=(bk.Part("base", bk.Clamped(), ("bottom",)),))
    upper = bk.Body(
        name="upper",
        shape=bk.Rectangle(2.0, 1.0, (left, 1.0)),
        material=STEEL,
        parts=(bk.Part("load", bk.Traction(0.0, -0.01), ("top",)),),
    )
    pair = bk.ContactPair(("upper.bottom", "lower.top"), interference=interference)
    return bk.Scene(
        title="blocks", bodies=(lower, upper), contacts=(pair,), law=bk.Coulomb(0.3), mesh=bk.MeshOptions(elements=40)
    )


def test_blocks_that_overlap_beside_their_contact_are_refused() -> None:
    with pytest.raises(OverlapError, match=r"bodies 'lower' and 'upper' overlap by 0\.2 at \(2\.\d+, 1[.\d]*\)"):
        bk.run(blocks())


@pytest.mark.parametrize("scene", [blocks(-0.1), blocks(interference=0.21)])
def test_blocks_that_stay_apart_or_are_meant_to_overlap_are_solved(scene: bk.Scene) -> None:
    assert bk.run(scene).is_certified


def test_a_rigid_body_inside_of_a_body_beside_their_contact_is_refused() -> None:
    block = bk.Body(
        name="block",
        shape=bk.Rectangle(2.0, 1.0),
        material=STEEL,
        parts=(bk.Part("base", bk.Clamped(), ("bottom",)),),
        mesh=bk.MeshOptions(elements=40),
    )
    vertices = ((1.5, 1.0), (2.5, 1.0), (2.5, 0.6), (1.9, 0.6))
    punch = bk.RigidBody(name="punch", obstacle=bk.RigidPolygon(vertices), centre=(2.0, 1.0), y=-1e-3)
    scene = bk.Scene(
        title="punch", bodies=(block,), rigid=(punch,), contacts=(bk.ContactPair(("block.left", "punch")),),
        law=bk.Frictionless(), discretisation=bk.Galerkin(1),
    )  # fmt: skip
    with pytest.raises(OverlapError, match="bodies 'block' and 'punch' overlap by"):
        bk.run(scene)
    away = replace(punch, obstacle=bk.RigidPolygon(tuple((x + 2.0, y) for x, y in vertices)))
    assert bk.run(replace(scene, rigid=(away,))).is_converged


@pytest.mark.parametrize(("x", "is_refused"), [(2.4, True), (2.6, False)])
def test_an_obstacle_inside_of_a_body_beside_the_part_that_touches_it_is_refused(x: float, is_refused: bool) -> None:
    """A circle on the tread of a step, 0.1 inside of its riser or 0.1 off."""
    vertices = ((0.0, 0.0), (3.0, 0.0), (3.0, 1.0), (2.0, 1.0), (2.0, 2.0), (0.0, 2.0))
    parts = (
        bk.Part("base", bk.Clamped(), ("side-1",)),
        bk.Part("tread", bk.Contact(bk.RigidCircle((x, 1.4999), 0.5)), ("side-3",)),
    )
    scene = bk.Scene(
        title="step", shape=bk.Polygon(vertices), material=STEEL, parts=parts, law=bk.Frictionless(),
        mesh=bk.MeshOptions(elements=40),
    )  # fmt: skip
    message = r"obstacle of part 'tread' overlaps the body by 0\.\d+ beside this part, at \(2, 1\.5"
    with pytest.raises(OverlapError, match=message) if is_refused else nullcontext():
        prepare(scene)


@pytest.mark.parametrize(("x", "is_refused"), [(1.7, True), (2.1, False)])
def test_an_obstacle_of_one_body_inside_of_another_is_refused(x: float, is_refused: bool) -> None:
    scene = blocks(-0.1)
    side = bk.Part("side", bk.Contact(bk.RigidCircle((x + 1.5, 1.6), 0.2)), ("right",))
    neighbour = bk.Body(name="third", shape=bk.Rectangle(0.5, 0.5, (2.75, 1.3)), material=STEEL)
    neighbour = replace(neighbour, parts=(bk.Part("top", bk.Clamped(), ("top",)),))
    lower, upper = scene.bodies
    scene = replace(scene, bodies=(replace(lower, parts=(*lower.parts, side)), upper, neighbour))
    message = r"obstacle of part 'side' of body 'lower' overlaps body 'third' by 0\.\d+, at \(3\.\d+, 1\.\d+\): move"
    with pytest.raises(OverlapError, match=message) if is_refused else nullcontext():
        prepare(scene)
