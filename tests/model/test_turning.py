"""Round bodies without friction turn; their meshes do not support."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import bemkit as bk
from bemkit.runs.steps import UnsolvableSceneError
from tests.slow import slow_only

STEEL = bk.Material(1e3, 0.3)
ROCK = bk.Body(
    name="rock",
    shape=bk.ExteriorOf(bk.Disk(1.0)),
    material=STEEL,
    parts=(bk.Part("wall", bk.Free(), sides=tuple(f"arc-{k}" for k in range(1, 5))),),
    mesh=bk.MeshOptions(25),
)
OUTSIDE = bk.Part("out", bk.Free(), sides=tuple(f"outer-{k}" for k in range(1, 5)))


def tunnel(inside: bk.Condition, **options: object) -> bk.Scene:
    """A ring in a hole of the plane, under a load from inside."""
    part = bk.Part("in", inside, sides=tuple(f"inner-{k}" for k in range(1, 5)))
    lining = bk.Body(
        name="lining", shape=bk.Ring(0.7, 1.0), material=STEEL, parts=(part, OUTSIDE), mesh=bk.MeshOptions(18)
    )
    settings: dict[str, object] = {"discretisation": bk.Galerkin(1), "law": bk.Frictionless(), **options}
    contacts = (bk.ContactPair(("rock.wall", "lining.out")),)
    return bk.Scene(title="tunnel", bodies=(ROCK, lining), contacts=contacts, **settings)  # type: ignore[arg-type]


TWISTED = tunnel(bk.Pressure(1.0, 0.1))


@pytest.mark.slow
def test_a_load_that_turns_a_round_body_is_not_held_by_its_mesh() -> None:
    # 2 pi 0.7^2 0.1; around a hole the boundary runs clockwise
    words = r"turns body 'lining' clockwise about \(0, 0\) with 0\.3079, and contacts that are round"
    # the rotation of curved elements is exact, and constant elements of equal lengths turn freely
    for scene in (TWISTED, replace(TWISTED, discretisation=bk.ConstantCollocation())):
        with pytest.raises(UnsolvableSceneError, match=words):
            bk.run(scene)


@pytest.mark.slow
@pytest.mark.parametrize(("of_shaft", "of_ring"), [(12, 16), (18, 22)])
def test_bodies_that_friction_joins_turn_together(of_shaft: int, of_ring: int) -> None:
    """A torque on a shaft that is pressed into a ring, which lies in the hole without friction.

    On the finer meshes the solver ends first, and the torque is named then.
    """
    inside = bk.Part("in", bk.Pressure(1.0, 0.1), sides=tuple(f"inner-{k}" for k in range(1, 5)))
    seat = bk.Part("seat", bk.Free(), sides=tuple(f"inner-{k}" for k in range(1, 5)))
    shaft = bk.Body(
        name="shaft", shape=bk.Ring(0.4, 0.7), material=STEEL, parts=(inside, OUTSIDE), mesh=bk.MeshOptions(of_shaft)
    )
    ring = bk.Body(
        name="ring", shape=bk.Ring(0.7, 1.0), material=STEEL, parts=(seat, OUTSIDE), mesh=bk.MeshOptions(of_ring)
    )
    fit = bk.ContactPair(("shaft.out", "ring.seat"), law=bk.Coulomb(0.5), gap=-1e-3)
    contacts = (fit, bk.ContactPair(("rock.wall", "ring.out")))
    assembly = replace(TWISTED, bodies=(ROCK, shaft, ring), contacts=contacts)
    solution = bk.run(assembly)
    assert solution.status is bk.Status.UNSOLVABLE_LOAD
    assert "turns bodies 'shaft' and 'ring' clockwise about (0, 0) with 0.1005" in solution.message  # 2 pi 0.4^2 0.1
    assert bk.run(replace(assembly, law=bk.Coulomb(0.5))).is_converged


@pytest.mark.parametrize(
    "held",
    [
        pytest.param(tunnel(bk.Pressure(1.0)), marks=pytest.mark.slow),
        pytest.param(replace(TWISTED, law=bk.Coulomb(0.3)), marks=pytest.mark.slow),
        tunnel(bk.Traction(bk.Expression("1 - y"), bk.Expression("-x"))),  # a push, and a moment of cos(2 angle)
        replace(tunnel(bk.Clamped()), contacts=(bk.ContactPair(("rock.wall", "lining.out"), gap=-1e-3),)),
    ],
    ids=["no moment", "friction", "pushed", "clamped"],
)
def test_what_does_not_turn_is_solved(held: bk.Scene) -> None:
    assert bk.run(held).is_converged


def test_corners_keep_a_body_from_turning() -> None:
    square = bk.Rectangle(1.0, 1.0, (-0.5, -0.5))
    base = bk.Body(
        name="base",
        shape=bk.Rectangle(3.0, 1.0, (-1.5, -1.5)),
        material=STEEL,
        parts=(bk.Part("floor", bk.Clamped(), sides=("bottom",)), bk.Part("top", bk.Free(), sides=("top",))),
        mesh=bk.MeshOptions(32),
    )
    loads = bk.Part("push", bk.Traction(0.0, bk.Expression("-1 - x")), sides=("top",))
    block = bk.Body(name="block", shape=square, material=STEEL, parts=(loads,), mesh=bk.MeshOptions(16))
    contacts = (bk.ContactPair(("block.bottom", "base.top")),)
    assembly = bk.Scene(title="block", bodies=(base, block), contacts=contacts, discretisation=bk.Galerkin(1))
    assert bk.run(assembly).is_converged


def test_a_later_step_that_turns_the_body_ends_the_history() -> None:
    change = {"bodies.lining.parts.in.condition.shear": 0.1}
    steps = (bk.Step(1.0), bk.Step(2.0, changes=change))
    solution = bk.run(replace(tunnel(bk.Pressure(1.0, 0.0)), steps=steps))
    assert solution.status is bk.Status.UNSOLVABLE_LOAD
    assert solution.message.count("No contact tractions can balance this load") == 1
    assert np.abs(solution.bodies["lining"].boundary.displacement).max() < 1e-2  # of the step before


def disc_in_cavity(n_elements: int, radius: float = 1.001, degree: int = 2) -> bk.Scene:
    """A heavy disc in a round rigid cavity, a little larger than itself."""
    cavity = bk.Part(
        "rim", bk.Contact(bk.RigidCavity((0.0, 0.0), radius)), sides=tuple(f"arc-{k}" for k in range(1, 5))
    )
    return bk.Scene(
        title="disc in a cavity",
        shape=bk.Disk(1.0),
        material=STEEL,
        law=bk.Frictionless(),
        parts=(cavity,),
        body_forces=(bk.Gravity(1.0, (0.0, -1.0)),),
        discretisation=bk.Galerkin(degree),
        mesh=bk.MeshOptions(n_elements),
    )


@pytest.mark.parametrize("degree", slow_only([1, 2], 2))
def test_a_disc_that_may_turn_in_a_cavity_ends_by_name(degree: int) -> None:
    """A mesh that is not symmetric turns the disc; a symmetric one leaves it where it is."""
    assert bk.run(disc_in_cavity(40, degree=degree)).is_converged
    solution = bk.run(disc_in_cavity(41, degree=degree))
    assert solution.status is bk.Status.SINGULAR
    assert "nothing but the mesh keeps the body from turning about (0, 0)" in solution.message
    assert "give them friction" in solution.message
    assert bk.run(replace(disc_in_cavity(41, degree=degree), law=bk.Coulomb(0.3))).is_converged
