"""Contact with obstacles along which a body has moved too far for its gaps is named or warned of."""

from __future__ import annotations

from dataclasses import replace

import pytest

import bemkit as bk

CYLINDER = bk.RigidCircle((0.5, -1.0), 1.0)


def block(x: float, obstacle: bk.Obstacle = CYLINDER) -> bk.Scene:
    """A block of unit size, pressed by a hundredth onto an obstacle and moved sideways."""
    return bk.Scene(
        title="Block on a cylinder",
        shape=bk.Rectangle(1.0, 1.0),
        material=bk.Material(1e4, 0.3),
        law=bk.Coulomb(0.1),
        parts=(
            bk.Part("floor", bk.Contact(obstacle), ("bottom",)),
            bk.Part("top", bk.PrescribedDisplacement(x=x, y=-0.01), ("top",)),
        ),
        discretisation=bk.Galerkin(2),
        mesh=bk.MeshOptions(elements=60, density={"bottom": 4.0}),
    )


def doubts(solution: bk.Solution) -> list[str]:
    return [sentence for sentence in map(str, solution.warnings) if "moves so far" in sentence]


def test_sliding_far_along_a_curved_obstacle_ends_by_name() -> None:
    """By a tenth of the radius, which takes the block 5e-3 away from the cylinder that it is pressed into by 1e-2."""
    solution = bk.run(block(0.1))
    assert solution.status is bk.Status.FINITE_SLIDING
    assert "contact 'floor': the sides move by" in solution.message
    there = bk.run(replace(block(0.0), shape=bk.Rectangle(1.0, 1.0, (0.1, 0.0))))
    assert solution.force_normal > 1.2 * there.force_normal  # the name is right


def test_a_light_contact_with_a_curved_obstacle_far_away_is_doubted() -> None:
    """A block slides on a plane until a light force presses it against a cylinder 0.2 away."""
    stop = bk.Contact(bk.RigidCircle((1.7, 0.25), 0.5))
    scene = replace(
        block(0.0), shape=bk.Rectangle(1.0, 0.5), material=bk.Material(1.0, 0.3), law=bk.Frictionless(),
        parts=(
            bk.Part("floor", bk.Contact(bk.RigidHalfPlane()), ("bottom",)),
            bk.Part("stop", stop, ("right",)),
            bk.Part("push", bk.Traction(1e-4, -1e-3), ("left",)),
            bk.Part("load", bk.Pressure(1e-3), ("top",)),
        ),
        discretisation=bk.Galerkin(1),
        mesh=bk.MeshOptions(elements=80),
    )  # fmt: skip
    (doubt,) = doubts(bk.run(scene))
    assert "Part 'stop' moves so far that its contact ends 0.0002" in doubt
    assert "Model the body in its final position" in doubt


@pytest.mark.parametrize("scene", [block(0.01), block(0.1, bk.RigidHalfPlane()), block(0.1, bk.Gap(0.0))])
def test_small_motions_and_straight_obstacles_are_not_doubted(scene: bk.Scene) -> None:
    assert not doubts(bk.run(scene))


def test_bodies_of_an_assembly_are_judged_where_they_are_placed() -> None:
    scene = block(0.1)
    placed = bk.Body(
        name="block",
        shape=bk.Rectangle(1.0, 1.0, (3.0, 2.0)),
        material=scene.material,
        parts=scene.parts,
        placement=bk.Placement((-3.0, -2.0)),
    )
    lid = bk.Body(
        name="lid", shape=bk.Rectangle(1.0, 1.0), material=scene.material, placement=bk.Placement((1.0, 0.0)),
        parts=(bk.Part("end", bk.Clamped(), ("right",)),),
    )  # fmt: skip
    pair = bk.ContactPair(("block.right", "lid.left"), gap=1.0)
    assembly = bk.Scene(
        title="Block on a cylinder", bodies=(placed, lid), contacts=(pair,), law=scene.law, mesh=scene.mesh
    )
    solution = bk.run(assembly)
    assert solution.status is bk.Status.FINITE_SLIDING
    assert "contact 'block.floor': the sides move by" in solution.message


def test_a_part_that_does_not_face_its_obstacle_is_not_doubted() -> None:
    floor = bk.Part("floor", bk.Contact(bk.RigidHalfPlane()), ("bottom",))
    side = bk.Part("side", bk.Contact(bk.RigidHalfPlane((0.0, -1.0))), ("right",))
    load = bk.Part("load", bk.Pressure(1e-3), ("top",))
    scene = replace(
        block(0.0), shape=bk.Rectangle(1.0, 1.0), parts=(floor, side, load), discretisation=bk.Galerkin(1),
        mesh=bk.MeshOptions(elements=16),
    )  # fmt: skip
    assert not doubts(bk.run(scene))


def test_friction_across_the_gap_is_no_contact_that_slides() -> None:
    """A disc sinks a long way before it touches; by the law of Tresca nodes that face away carry friction, too."""
    disc = bk.Scene(
        title="Disc that sinks onto a floor",
        shape=bk.Sector(1.0, 180.0, 360.0, centre=(0.0, 1.05)),
        material=bk.Material(1.0, 0.3),
        parts=(
            bk.Part("floor", bk.Contact(bk.RigidHalfPlane()), ("arc",)),
            bk.Part("load", bk.PrescribedDisplacement(0.0, -0.051), ("start", "end")),
        ),
        law=bk.Tresca(1e-6),
        mesh=bk.MeshOptions(elements=120),
    )
    assert bk.run(disc).status is bk.Status.CONVERGED
