"""Energies that are negative have a name, and those that round-off makes of zero have none."""

from __future__ import annotations

import numpy as np
import pytest

import bemkit as bk
from bemkit.model.solved_contact import is_indefinite, negative_share
from bemkit.operators.rigid_modes import rigid_motions
from bemkit.scene.toml import with_overrides

PAPER = bk.ConstantCollocation(slopes=False)


def thin_ring(inner_radius: float, elements: int, *parts: bk.Part, **options: object) -> bk.Scene:
    settings: dict[str, object] = {"material": bk.Material(1e4, 0.3), "law": bk.Coulomb(0.3), **options}
    shape = bk.Ring(inner_radius, 1.0)
    return bk.Scene(title="ring", shape=shape, mesh=bk.MeshOptions(elements), parts=parts, **settings)  # type: ignore[arg-type]


FLOOR = bk.Part("floor", bk.Contact(bk.RigidHalfPlane((0.0, -1.0))), sides=("outer-3", "outer-4"))
LOAD = bk.Part("load", bk.Traction(y=-1.0), sides=("outer-1", "outer-2"))


@pytest.mark.parametrize("law", [bk.Coulomb(0.3), bk.Frictionless(), bk.Tresca(0.1)])
def test_a_body_that_pushes_back_the_wrong_way_is_a_named_failure(law: bk.FrictionLaw) -> None:
    solution = bk.run(thin_ring(0.8, 40, FLOOR, LOAD, discretisation=PAPER, law=law))
    assert solution.status is bk.Status.NEGATIVE_ENERGY
    assert "more elements" in solution.message
    assert "the stiffness that the contact boundary sees is negative" in solution.message


def test_slopes_that_keep_means_bend_the_same_ring_the_right_way() -> None:
    solution = bk.run(thin_ring(0.8, 40, FLOOR, LOAD, discretisation=bk.ConstantCollocation()))
    # two nodes carry the ring, and the lowest point between them is deep in the floor
    assert solution.status is bk.Status.MISSED_CONTACT
    top = np.argmax(solution.boundary.points[:, 1])
    assert solution.boundary.displacement[top, 1] < 0.0 < solution.energy


@pytest.mark.slow
def test_scenes_without_contact_are_judged_too(monkeypatch: pytest.MonkeyPatch) -> None:
    squeeze = bk.Part("load", bk.Traction(y=bk.Expression("-y")), sides=tuple(f"outer-{k}" for k in range(1, 5)))
    scene = thin_ring(0.8, 40, squeeze, symmetry=bk.Symmetry(x=0.0, y=0.0), law=bk.Frictionless())
    assert bk.run(scene).is_converged
    monkeypatch.setattr("bemkit.model.solved_contact.negative_share", lambda *_: 0.25)
    solution = bk.run(scene)
    assert solution.status is bk.Status.NEGATIVE_ENERGY
    assert "2.5e-01 times" in solution.message


@pytest.mark.parametrize(
    "force", [bk.Gravity(1.0, (1.0, 0.0)), bk.Rotation(1.0, 1.0, (1.0, 0.0))], ids=["gravity", "rotation"]
)
def test_the_energy_of_forces_inside_counts(force: bk.BodyForce) -> None:
    """Six elements on a strip of 20 : 1: the map has a positive energy, less than the forces take of it."""
    clamp = bk.Part("clamp", bk.Clamped(), sides=("bottom",))
    strip = bk.Scene(
        title="strip",
        shape=bk.Rectangle(20.0, 1.0),
        material=bk.Material(1e3, 0.0),
        parts=(clamp,),
        body_forces=(force,),
        discretisation=bk.ConstantCollocation(),
        mesh=bk.MeshOptions(6),
    )
    solution = bk.run(strip)
    assert solution.status is bk.Status.NEGATIVE_ENERGY
    assert "times the work of all forces" in solution.message
    fine = bk.run(with_overrides(strip, elements=84))
    assert fine.is_converged
    assert fine.energy > 0.0


@pytest.mark.slow
def test_a_thin_ring_heated_from_inside_has_its_own_energy() -> None:
    """On 12 constant elements, too: its state is what balances the heat, nothing has to cancel."""
    ring = thin_ring(
        0.8,
        12,
        law=bk.Frictionless(),
        symmetry=bk.Symmetry(x=0.0, y=0.0),
        body_forces=(bk.Heating(1e-6, bk.Expression("log(hypot(x, y))")),),
        discretisation=bk.ConstantCollocation(),
    )
    coarse, fine = bk.run(ring), bk.run(with_overrides(ring, elements=96, discretisation="quadratic"))
    assert coarse.is_converged
    assert coarse.energy == pytest.approx(fine.energy, rel=1e-9)


@pytest.mark.parametrize("seed", range(8))
def test_work_is_judged_apart_from_rigid_motions(seed: int) -> None:
    rng = np.random.default_rng(seed)
    points = rng.normal(size=(20, 2))
    motions = rigid_motions(points, np.zeros(2), 1.0).reshape(40, 3)
    force = rng.normal(size=40)
    force -= motions @ np.linalg.lstsq(motions, force, rcond=None)[0]  # balanced
    force = force.reshape(20, 2)
    travel = 1e8 * motions.sum(axis=1).reshape(20, 2)
    assert negative_share(1e-3 * force, force, motions, None) == 0.0
    assert negative_share(-1e-3 * force, force, motions, None) == pytest.approx(1.0)
    # 1e8 * 1e-16 of round-off in displacements of 1e-3
    assert negative_share(travel - 1e-3 * force, force, motions, None) == pytest.approx(1.0, rel=1e-3)
    assert negative_share(travel + 1e-3 * force, force, motions, None) == 0.0
    assert negative_share(travel, force, motions, np.ones((20, 2))) == 0.0


def test_round_off_of_a_body_that_only_moves_is_no_negative_energy() -> None:
    """Forces of round-off on strains of round-off do a work of either sign."""
    travel = np.tile([0.0, 1e-7], (8, 1))
    motions = rigid_motions(np.random.default_rng(2).normal(size=(8, 2)), np.zeros(2), 1.0).reshape(16, 3)
    sensitivity, astray = np.full((8, 2), 5.0), 1e-23 * np.random.default_rng(3).normal(size=(8, 2))
    force = -1e-21 * np.sign(astray)  # thrice the round-off of 16 terms, each of 5 * 1e-7
    assert negative_share(travel + astray, force, motions, sensitivity) == 0.0
    # the same forces are not round-off of a body that stays where it is
    assert negative_share(1e10 * astray, force, motions, sensitivity) > 0.1


SLOPE = bk.RigidHalfPlane((-2.0612446580203554, -0.01907209024256276), (0.9142617547626685, -0.4051239856862175))
HINGED = bk.Scene(
    title="ring on one element that is held",
    shape=bk.Ring(1.1116006796304891, 1.9659005601975807),
    material=bk.Material(0.00021584280930069007, 0.09341455618575156),
    mesh=bk.MeshOptions(8),
    parts=(
        bk.Part("contact", bk.Contact(SLOPE), sides=("outer-3",)),
        bk.Part(
            "hinge", bk.PrescribedDisplacement(x=-1.3487208788246108e-05, y=1.3094944620704832e-05), sides=("outer-2",)
        ),
        bk.Part("load", bk.Pressure(-3.240145479188419e-11), sides=("inner-1",)),
    ),
    discretisation=bk.ConstantCollocation(),
)
SHIFTED = bk.Scene(
    title="ring that is moved towards a cavity",
    shape=bk.Ring(0.004488467361567214, 0.0063042777161298235),
    material=bk.Material(5.097701303693615, 0.0),
    mesh=bk.MeshOptions(14),
    symmetry=bk.Symmetry(x=0.0),
    law=bk.Coulomb(0.5),
    parts=(
        bk.Part(
            "contact", bk.Contact(bk.RigidCavity((0.0, 2.2e-05), 0.006326395362193901)), sides=("outer-3", "outer-4")
        ),
        bk.Part("top", bk.PrescribedDisplacement(y=-1.003295097364806e-07), sides=("outer-1", "outer-2")),
    ),
    discretisation=bk.ConstantCollocation(),
)


@pytest.mark.parametrize("scene", [HINGED, SHIFTED], ids=["hinged", "shifted"])
def test_a_body_that_only_moves_resists_by_round_off_of_either_sign(scene: bk.Scene) -> None:
    solution = bk.run(scene)
    assert solution.status is not bk.Status.NEGATIVE_ENERGY, solution.message


def test_what_is_indefinite() -> None:
    turn = np.linalg.qr(np.random.default_rng(1).normal(size=(6, 6)))[0]
    for least, expected in ((1.0, False), (0.0, False), (-1e-15, False), (-1e-6, True), (-1.0, True)):
        assert is_indefinite(turn @ np.diag([5.0, 4.0, 3.0, 2.0, 1.0, least]) @ turn.T) is expected
    assert not is_indefinite(np.diag([1.0, -1e-9]), np.full((2, 2), 1e6))  # the round-off of a body of such sizes
    assert not is_indefinite(np.array([[1.0, 5.0], [-5.0, 1.0]]))  # no energy in the part that is antisymmetric
    assert not is_indefinite(np.array([[np.nan]]))
    assert not is_indefinite(np.zeros((0, 0)))
