"""Bodies that overlap beside their contacts once they are displaced."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest

import bemkit as bk

STEEL = bk.Material(1.0, 0.3)


def blocks(push: float, gap: float, *, in_contact: bool) -> bk.Scene:
    """Two blocks on their base, beside each other; the left one is pushed to the right one."""
    mesh = bk.MeshOptions(elements=32)
    left = bk.Body(
        name="left",
        shape=bk.Rectangle(1.0, 1.0),
        material=STEEL,
        parts=(bk.Part("push", bk.PrescribedDisplacement(push, 0.0), ("left", "bottom")),),
        mesh=mesh,
    )
    right = bk.Body(
        name="right",
        shape=bk.Rectangle(1.0, 0.8, (1.0 + gap, 0.1)),
        material=STEEL,
        parts=(bk.Part("base", bk.Clamped(), ("right",)),),
        mesh=mesh,
    )
    floor = bk.RigidBody(name="floor", obstacle=bk.RigidHalfPlane((0.0, 1.0), (0.0, -1.0)), centre=(0.0, 1.0))
    contacts = (bk.ContactPair(("left.top", "floor")),)
    if in_contact:
        contacts += (bk.ContactPair(("left.right", "right.left")),)
    return bk.Scene(
        title="blocks", bodies=(left, right), contacts=contacts, rigid=(floor,), law=bk.Frictionless(),
        discretisation=bk.Galerkin(1),
    )  # fmt: skip


@pytest.mark.parametrize(
    ("push", "in_contact", "is_warned"), [(3e-3, False, True), (3e-3, True, False), (5e-4, False, False)]
)
def test_bodies_that_overlap_beside_contacts_are_warned_of(push: float, in_contact: bool, is_warned: bool) -> None:
    solution = bk.run(blocks(push, 1e-3, in_contact=in_contact))
    assert solution.is_converged
    found = [warning for warning in solution.warnings if warning.kind == "overlap beside contacts"]
    assert len(found) == is_warned
    if is_warned:
        assert found[0].subject == "left / right"
        assert found[0].number == pytest.approx(push - 1e-3, rel=1e-6)
        assert "Bodies 'left' and 'right' overlap by 0.002 at (1" in found[0].text


def pressed(width: float, depth: float, *, is_rigid: bool) -> bk.Scene:
    """A block whose top may touch a disc within a width, pressed by a depth; the disc, or the base, moves."""
    disc = bk.RigidCircle((0.0, 1.0), 1.0)
    where = bk.Expression(f"abs(x) < {width}")
    base = bk.Part("base", bk.Clamped() if is_rigid else bk.PrescribedDisplacement(0.0, depth), ("bottom",))
    top = bk.Part("top", bk.Free() if is_rigid else bk.Contact(disc), ("top",), where)
    block = bk.Body(name="block", shape=bk.Rectangle(2.0, 1.0, (-1.0, -1.0)), material=STEEL, parts=(base, top))
    ball = bk.RigidBody(name="ball", obstacle=disc, centre=disc.centre, y=-depth)
    return bk.Scene(
        title="pressed",
        bodies=(block,),
        rigid=(ball,) if is_rigid else (),
        contacts=(bk.ContactPair(("block.top", "ball")),) if is_rigid else (),
        law=bk.Frictionless(),
        discretisation=bk.Galerkin(1),
        mesh=bk.MeshOptions(elements=120),
    )


@pytest.mark.parametrize("is_rigid", [True, False])
@pytest.mark.parametrize(("width", "is_warned"), [(0.1, True), (0.5, False)])
def test_obstacles_that_overlap_beside_their_contact_are_warned_of(
    width: float, is_warned: bool, is_rigid: bool
) -> None:
    solution = bk.run(pressed(width, 0.05, is_rigid=is_rigid))
    assert solution.is_converged
    found = [warning for warning in solution.warnings if warning.kind == "overlap beside contacts"]
    assert len(found) == is_warned
    if is_warned:
        assert 0.005 < found[0].number < 0.05
        assert found[0].subject == ("block / ball" if is_rigid else "block top")
        words = (
            "Body 'block' and rigid body 'ball' overlap by" if is_rigid else "The obstacle of part 'top' overlaps body"
        )
        assert words in found[0].text


def test_obstacles_of_several_parts_are_measured_once() -> None:
    scene = pressed(0.1, 0.05, is_rigid=False)
    (block,) = scene.bodies
    disc = block.parts[1].condition.obstacle
    left, right = (
        bk.Part(name, bk.Contact(disc), ("top",), bk.Expression(f"abs(x - ({at})) < 0.05"))
        for name, at in (("left", -0.05), ("right", 0.05))
    )
    halves = replace(scene, bodies=(replace(block, parts=(block.parts[0], left, right)),))
    found = [warning for warning in bk.run(halves).warnings if warning.kind == "overlap beside contacts"]
    assert [warning.subject for warning in found] == ["block left"]


@pytest.mark.parametrize("gap", [0.0, 2e-3])
def test_a_gap_that_a_contact_adds_is_no_overlap(gap: float) -> None:
    """Bodies drawn touching come as near as the gap; their corners bulge beside the contact."""
    lower = bk.Body(
        name="lower",
        shape=bk.Rectangle(3.0, 1.0, (-1.5, -1.0)),
        material=STEEL,
        parts=(bk.Part("base", bk.Clamped(), ("bottom",)),),
        mesh=bk.MeshOptions(elements=60),
    )
    load = bk.Part("load", bk.Traction(y=-0.01), ("top",))
    upper = replace(lower, name="upper", shape=bk.Rectangle(2.0, 1.0, (-1.0, 0.0)), parts=(load,))
    scene = bk.Scene(
        title="gap", bodies=(lower, upper), contacts=(bk.ContactPair(("upper.bottom", "lower.top"), gap=gap),),
        law=bk.Coulomb(0.3), discretisation=bk.Galerkin(1),
    )  # fmt: skip
    assert not [warning for warning in bk.run(scene).warnings if warning.kind == "overlap beside contacts"]


def test_obstacles_of_one_body_that_overlap_another_are_warned_of() -> None:
    """The second block is pushed into the disc that the first one may touch."""
    scene = pressed(0.1, 0.05, is_rigid=False)
    (block,) = scene.bodies
    moved = bk.Part("right", bk.PrescribedDisplacement(x=-0.05, y=0.0), ("right",))
    other = bk.Body(name="other", shape=bk.Rectangle(0.2, 0.2, (1.001, 0.9)), material=STEEL, parts=(moved,))
    still = replace(
        block, parts=tuple(replace(p, condition=bk.Clamped()) if p.name == "base" else p for p in block.parts)
    )
    solution = bk.run(replace(scene, bodies=(still, other)))
    texts = [warning.text for warning in solution.warnings if warning.kind == "overlap beside contacts"]
    assert any("The obstacle of part 'top' of body 'block' overlaps body 'other' by" in text for text in texts), texts


@pytest.mark.parametrize("turn", [0.0, 45.0])
def test_what_counts_as_an_overlap_does_not_turn_with_the_bodies(turn: float) -> None:
    """The corner of a block lies 9 % of the displacement deep between the nodes of a softer one."""
    cosine, sine = math.cos(math.radians(turn)), math.sin(math.radians(turn))
    base = bk.Part("base", bk.Clamped(), ("bottom",))
    down = bk.Part("top", bk.PrescribedDisplacement(4e-3 * sine, -4e-3 * cosine), ("top",))
    placed = {"placement": bk.Placement(turn=turn)}
    lower = bk.Body(
        name="lower",
        shape=bk.Rectangle(4.0, 1.0, (-2.0, -1.0)),
        material=bk.Material(0.1, 0.3),
        parts=(base,),
        mesh=bk.MeshOptions(elements=80),
        **placed,
    )
    upper = bk.Body(name="upper", shape=bk.Rectangle(1.53, 1.0, (-0.65, 0.0)), material=STEEL, parts=(down,), **placed)
    scene = bk.Scene(
        title="blocks",
        bodies=(lower, upper),
        contacts=(bk.ContactPair(("lower.top", "upper.bottom")),),
        law=bk.Coulomb(0.1),
        discretisation=bk.Galerkin(2),
        mesh=bk.MeshOptions(elements=40),
    )
    solution = bk.run(scene)
    assert solution.is_converged
    assert not [warning for warning in solution.warnings if warning.kind == "overlap beside contacts"]
