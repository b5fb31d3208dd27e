"""Bodies that move along their contacts beyond what undeformed gaps and directions describe are never converged."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import bemkit as bk
from bemkit.runs.steps import UnsolvableSceneError
from tests.slow import slow_except, slow_only

BLOCK = bk.Body(
    name="block",
    shape=bk.Rectangle(4.0, 1.5, (-2.0, -1.5)),
    material=bk.Material(1.0, 0.3),
    parts=(bk.Part("base", bk.Clamped(), ("bottom",)),),
)
SLIDES = "contact 'block.top / .*': the sides move by .* along each other, and contact forces displace by"


def square(bottom: float) -> bk.RigidPolygon:
    return bk.RigidPolygon(((-0.8, bottom), (0.8, bottom), (0.8, 1.0), (-0.8, 1.0)))


def pressed(obstacle: bk.Obstacle, law: bk.FrictionLaw, **motion: float) -> bk.Scene:
    """Return a rigid body above a block."""
    punch = bk.RigidBody(name="punch", obstacle=obstacle, centre=(0.0, 0.0), **motion)
    return bk.Scene(
        title="Pressed",
        bodies=(BLOCK,),
        rigid=(punch,),
        contacts=(bk.ContactPair(("block.top", "punch")),),
        law=law,
        discretisation=bk.Galerkin(2),
        mesh=bk.MeshOptions(elements=96),
    )


def on_block(shape: bk.Shape, sides: tuple[str, ...], held: tuple[str, ...], drag: float, y: float = -1e-3) -> bk.Scene:
    """Return an elastic body that is pressed onto a block and dragged."""
    upper = bk.Body(
        name="upper",
        shape=shape,
        material=bk.Material(1.0, 0.3),
        parts=(
            bk.Part("foot", bk.Free(), sides),
            bk.Part("held", bk.PrescribedDisplacement(drag, y), held),
        ),
    )
    contact = bk.ContactPair(("block.top", "upper.foot"), reach=0.3)
    return replace(pressed(square(0.0), bk.Frictionless(), x=0.0), bodies=(BLOCK, upper), rigid=(), contacts=(contact,))


def refused(assembly: bk.Scene) -> None:
    solution = bk.run(assembly)
    assert solution.status is bk.Status.FINITE_SLIDING, solution.message
    assert "draw the bodies where they come to rest" in solution.message
    assert not solution.is_certified
    assert not any("more elements" in warning.text for warning in solution.warnings)


@pytest.mark.parametrize("gap", [0.0, 1e-7, 1e-5])
def test_a_punch_pushed_sideways_without_friction_has_no_equilibrium_whatever_its_gap(gap: float) -> None:
    push = pressed(square(gap), bk.Frictionless(), force_x=2e-8, force_y=-1e-6)
    with pytest.raises(UnsolvableSceneError, match="the load slides body 'punch' along body 'block'"):
        bk.run(push)


def test_a_punch_that_slides_until_its_side_meets_a_node_is_refused() -> None:
    refused(pressed(square(1e-3), bk.Frictionless(), force_x=2e-8, force_y=-1e-6))


@pytest.mark.parametrize("drag", [0.0, 1e-3])
def test_a_rigid_cylinder_may_move_by_a_share_of_its_contact(drag: float) -> None:
    assert bk.run(pressed(bk.RigidCircle((0.0, 1.0), 1.0), bk.Frictionless(), x=drag, y=-1e-3)).is_converged


@pytest.mark.parametrize("obstacle", [bk.RigidCircle((0.0, 1.0), 1.0), square(0.0)])
def test_a_rigid_body_moves_by_more_than_its_contact(obstacle: bk.Obstacle) -> None:
    refused(pressed(obstacle, bk.Frictionless(), x=0.1, y=-1e-3))


@pytest.mark.parametrize("x", [0.8, 1.6])
def test_a_cylinder_that_moves_so_far_that_its_false_gap_deforms_the_block_as_much_is_refused(x: float) -> None:
    refused(pressed(bk.RigidCircle((0.0, 1.0), 1.0), bk.Frictionless(), x=x, y=-1e-3))


@pytest.mark.parametrize("y", slow_except([-1e-2, -5e-2], -5e-2))
@pytest.mark.parametrize("law", slow_only([bk.Frictionless(), bk.Coulomb(0.3)], bk.Coulomb(0.3)))
def test_a_punch_is_dragged_so_far_that_its_corners_are_at_other_elements(law: bk.FrictionLaw, y: float) -> None:
    """Whether it is pressed lightly or so hard that the block gives way by half of the motion."""
    refused(pressed(square(0.0), law, x=0.2, y=y))
    assert bk.run(pressed(square(0.0), law, x=0.03, y=y)).is_converged


@pytest.mark.parametrize("law", slow_only([bk.Frictionless(), bk.Coulomb(0.3)], bk.Frictionless()))
@pytest.mark.parametrize("moment", [7e-7, -7.9e-7])
def test_a_punch_turns_about_a_corner_that_meets_a_node(law: bk.FrictionLaw, moment: float) -> None:
    """Turned, the corner lies beside the node by round-off; the distance of nodes does not resolve more than that."""
    punch = replace(pressed(square(0.0), law, force_y=-1e-6, moment=moment), mesh=bk.MeshOptions(elements=110))
    solution = bk.run(punch)
    assert np.isclose(np.abs(solution.contact.points[:, 0]), 0.8, rtol=1e-12).any()
    assert solution.is_converged, solution.message


def test_a_side_that_ends_outside_of_the_body_moves_along_itself_without_limit() -> None:
    """The same long box as a punch, and as a floor below the block."""
    box = bk.RigidPolygon(((-5.0, 0.0), (5.0, 0.0), (5.0, 1.0), (-5.0, 1.0)))
    assert bk.run(pressed(box, bk.Coulomb(0.3), x=1.0, y=-0.05)).is_converged
    assert bk.run(on_floor(-7.0, 2.0)).is_converged
    assert bk.run(on_floor(-7.0, 0.1)).is_converged


def on_floor(begin: float, drag: float) -> bk.Scene:
    """Return a block that is pressed onto a floor, which begins below or beside it, and moved along."""
    floor = bk.RigidPolygon(((begin, -3.0), (9.0, -3.0), (9.0, -1.5), (begin, -1.5)))
    foot = bk.Part("foot", bk.Contact(floor), ("bottom",))
    top = bk.Part("held", bk.PrescribedDisplacement(drag, -0.05), ("top",))
    return bk.Scene(
        title="Block on a floor", shape=BLOCK.shape, material=BLOCK.material, parts=(foot, top),
        discretisation=bk.Galerkin(2), mesh=bk.MeshOptions(elements=96),
    )  # fmt: skip


@pytest.mark.parametrize("drag", [0.5, -0.5])
def test_a_block_is_moved_so_that_more_or_less_of_it_is_above_the_floor(drag: float) -> None:
    refused(on_floor(0.0, drag))
    assert bk.run(on_floor(0.0, 0.1 * drag)).is_converged


def test_a_wheel_spins_about_its_centre_without_limit() -> None:
    wheel = pressed(bk.RigidCircle((0.0, 1.0), 1.0), bk.Coulomb(0.3), y=-1e-3, turn=0.5)
    centred = replace(wheel.rigid[0], centre=(0.0, 1.0))
    solution = bk.run(replace(wheel, rigid=(centred,)))
    assert solution.is_converged, solution.message
    punch = solution.rigid["punch"]
    assert abs(punch.force_x) == pytest.approx(-0.3 * punch.force_y, rel=1e-3)  # its direction turns along the zone
    refused(wheel)


def test_a_rigid_plane_moves_along_itself_without_limit_and_drags_by_friction() -> None:
    plane = bk.RigidHalfPlane((0.0, 0.0), (0.0, -1.0))
    solution = bk.run(pressed(plane, bk.Coulomb(0.3), x=0.5, y=-1e-3))
    assert solution.is_converged, solution.message
    punch = solution.rigid["punch"]
    assert punch.force_x == pytest.approx(-0.3 * punch.force_y, rel=1e-9)  # all nodes slip


@pytest.mark.slow
@pytest.mark.parametrize("drag", [0.0, 1e-3])
def test_two_bodies_may_move_by_less_than_an_element(drag: float) -> None:
    disc = on_block(bk.Disk(1.0, (0.0, 1.0)), ("arc-3", "arc-4"), ("arc-1", "arc-2"), drag)
    assert bk.run(replace(disc, mesh=bk.MeshOptions(elements=240))).is_converged  # its contact has a width of 0.06
    assert bk.run(on_block(bk.Rectangle(2.0, 1.0, (-1.0, 0.0)), ("bottom",), ("top",), 20.0 * drag)).is_converged


def test_two_bodies_are_dragged_by_more_than_their_contact() -> None:
    refused(on_block(bk.Disk(1.0, (0.0, 1.0)), ("arc-3", "arc-4"), ("arc-1", "arc-2"), 0.1))
    foot = bk.Rectangle(2.0, 1.0, (-1.0, 0.0))
    refused(on_block(foot, ("bottom",), ("top",), 0.5))
    refused(on_block(foot, ("bottom",), ("top",), 0.15, -0.05))


@pytest.mark.slow
def test_the_rule_does_not_depend_on_units_and_position() -> None:
    """The same cylinder in millimetres and MPa, a hundred radii away."""
    for drag, status in ((1e-3, bk.Status.CONVERGED), (0.1, bk.Status.FINITE_SLIDING)):
        near = pressed(bk.RigidCircle((0.0, 1.0), 1.0), bk.Frictionless(), x=drag, y=-1e-3)
        block = replace(BLOCK, shape=bk.Rectangle(4e3, 1.5e3, (98e3, -1.5e3)), material=bk.Material(1e-6, 0.3))
        far_away = bk.RigidBody(
            name="punch", obstacle=bk.RigidCircle((1e5, 1e3), 1e3), centre=(1e5, 0.0), x=1e3 * drag, y=-1.0
        )
        assert bk.run(near).status is bk.run(replace(near, bodies=(block,), rigid=(far_away,))).status is status


@pytest.mark.slow
def test_loads_of_any_size_deform_without_sliding() -> None:
    """Displacements grow with the load, and so does what contact forces displace."""
    for force in (1e-9, 1e-3):
        solution = bk.run(pressed(square(0.0), bk.Coulomb(0.3), force_x=0.1 * force, force_y=-force))
        assert solution.is_converged, solution.message
        assert np.isfinite(solution.contact.sigma_n).all()
