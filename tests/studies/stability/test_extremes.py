"""Extreme and degenerate cases, each against a closed form or a named refusal."""

from __future__ import annotations

import dataclasses
import re

import numpy as np
import pytest

import bemkit as bk
from bemkit.runs.run import UnsolvableSceneError
from bemkit.solvers.base import Status
from bemkit.studies.stability.axes import find_axes
from bemkit.testing.independent_check import violations_of
from tests.scenes import CONSTANT, FLOOR, LINEAR, block, small_paper_scene
from tests.slow import slow_except, slow_only

DISCRETISATIONS = pytest.mark.parametrize(
    "discretisation", slow_except([LINEAR, CONSTANT], LINEAR), ids=["linear", "constant"]
)
WALL = bk.Part("wall", bk.Roller(), sides=("right",))


def press(pressure: float) -> bk.Part:
    return bk.Part("press", bk.Pressure(pressure), sides=("top",))


@pytest.mark.parametrize("load", ["shear", "moment"])
def test_a_strip_of_1000_to_1_bends_as_beam_theory_says(load: str) -> None:
    length, modulus, inertia = 1000.0, 1.0 / (1.0 - 0.3**2), 1.0 / 12.0
    tip = bk.Traction(y=-1e-9) if load == "shear" else bk.Traction(x=bk.Expression("1.2e-8 * (y - 0.5)"))
    scene = block(
        bk.Part("floor", bk.Contact(bk.RigidHalfPlane(point=(0.0, -1e6))), sides=("bottom",)),
        bk.Part("clamp", bk.Clamped(), sides=("left",)),
        bk.Part("tip", tip, sides=("right",)),
        shape=bk.Rectangle(length, 1.0),
        discretisation=bk.Galerkin(2),
        mesh=bk.MeshOptions(104, density={"left": 4.0, "right": 4.0}),
    )
    solution = bk.run(scene)
    assert solution.is_converged
    assert violations_of(solution).is_good
    corner = np.argmin(np.hypot(*(solution.boundary.points - [length, 0.0]).T))
    exact = {
        "shear": -1e-9 * length**3 / (3.0 * modulus * inertia),
        "moment": -1e-9 * length**2 / (2.0 * modulus * inertia),
    }
    assert solution.boundary.displacement[corner, 1] == pytest.approx(exact[load], rel=3e-2)


def test_a_strip_too_thin_for_double_precision_is_not_called_solved() -> None:
    # the stiffnesses of a strip differ by (length / height)^3 = 1e15
    scene = block(
        bk.Part("floor", bk.Contact(bk.RigidHalfPlane(point=(0.0, -1e9))), sides=("bottom",)),
        bk.Part("clamp", bk.Clamped(), sides=("left",)),
        bk.Part("tip", bk.Traction(y=-1e-12), sides=("right",)),
        shape=bk.Rectangle(1e5, 1.0),
        discretisation=bk.Galerkin(2),
        mesh=bk.MeshOptions(104),
    )
    try:
        assert not bk.run(scene).is_converged
    except ValueError as error:
        assert "not positive definite" in str(error)  # noqa: PT017 - either refusal is right


@DISCRETISATIONS
def test_one_node_grazes_a_bump_and_carries_everything(discretisation: bk.Galerkin) -> None:
    # the load moves the body by about 1e-9, the bump falls away by 1e-4 at the next node
    bump = bk.Contact(bk.Gap(bk.Expression("(x - 0.4)**2")))
    scene = block(bk.Part("floor", bump, sides=("bottom",)), WALL, press(1e-9), discretisation=discretisation)
    solution = bk.run(scene)
    assert solution.status is bk.Status.MISSED_CONTACT  # the top of the bump is between two nodes
    assert np.count_nonzero(solution.contact.status) == 1
    assert np.count_nonzero(solution.contact.sigma_n) == 1
    assert solution.force_normal == pytest.approx(1e-9, rel=1e-10)
    assert violations_of(solution).is_good


@DISCRETISATIONS
@pytest.mark.parametrize("law", [bk.Frictionless(), bk.Coulomb(0.5)])
def test_a_ring_that_fits_its_cavity_neatly(discretisation: bk.Galerkin, law: bk.Coulomb) -> None:
    inner, outer, nu = 1.0, 2.0, 0.3
    parts = [
        bk.Part(
            "cavity", bk.Contact(bk.RigidCavity((0.0, 0.0), outer)), sides=tuple(f"outer-{k}" for k in range(1, 5))
        ),
        bk.Part("hole", bk.Pressure(1e-3), sides=tuple(f"inner-{k}" for k in range(1, 5))),
    ]
    scene = block(*parts, shape=bk.Ring(inner, outer), law=law, discretisation=discretisation, mesh=bk.MeshOptions(96))
    solution = bk.run(scene)
    assert solution.is_converged
    assert solution.contact.status.all()  # gaps of 1e-16 do not open a single node
    exact = -1e-3 * inner**2 * (2.0 - 2.0 * nu) / ((1.0 - 2.0 * nu) * outer**2 + inner**2)
    # the discretisation error of 32 elements on the inner circle
    np.testing.assert_allclose(solution.contact.sigma_n, exact, rtol=2e-2)


@DISCRETISATIONS
def test_a_tie_between_stick_and_slip_is_decided_not_chased(discretisation: bk.Galerkin) -> None:
    pressure, friction, nu = 1.0, 0.5, 0.3
    shear = friction * pressure
    side = nu / (1.0 - nu) * pressure
    parts = (
        FLOOR,
        bk.Part("top", bk.Traction(x=shear, y=-pressure), sides=("top",)),
        bk.Part("right", bk.Traction(x=-side, y=shear), sides=("right",)),
        bk.Part("left", bk.Traction(x=side, y=-shear), sides=("left",)),
    )
    solution = bk.run(block(*parts, law=bk.Coulomb(friction), discretisation=discretisation))
    assert solution.is_converged
    assert solution.linear_solves <= 30
    # exactly at the tie either status is right; the tractions are the same, up to the discretisation at corners
    assert np.sum(solution.contact.weight * solution.contact.sigma_t) == pytest.approx(-shear, rel=1e-9)
    if discretisation == LINEAR:  # which holds uniform stresses exactly
        np.testing.assert_allclose(solution.contact.sigma_n, -pressure, rtol=1e-7)
        np.testing.assert_allclose(solution.contact.sigma_t, -shear, rtol=1e-7)


@DISCRETISATIONS
def test_no_load_gives_no_answer_but_zero(discretisation: bk.Galerkin) -> None:
    solution = bk.run(block(FLOOR, WALL, press(0.0), discretisation=discretisation))
    assert solution.is_converged
    assert solution.linear_solves <= 2
    for name in ("u_n", "u_t", "sigma_n", "sigma_t"):
        np.testing.assert_array_equal(getattr(solution.contact, name), 0.0)
    assert violations_of(solution).is_good


@DISCRETISATIONS
@pytest.mark.parametrize("distance", [1e-3, 1.0, 1e12])
def test_a_contact_part_that_never_touches(discretisation: bk.Galerkin, distance: float) -> None:
    low = bk.Part("floor", bk.Contact(bk.RigidHalfPlane(point=(0.0, -distance))), sides=("bottom",))
    parts = (low, bk.Part("held", bk.Clamped(), sides=("top",)), bk.Part("pull", bk.Traction(x=1e-5), sides=("right",)))
    solution = bk.run(block(*parts, discretisation=discretisation))
    assert solution.is_converged
    assert not solution.contact.status.any()
    assert not solution.contact.sigma_n.any()
    assert solution.transitions == ()
    assert violations_of(solution).is_good
    other = bk.run(
        block(dataclasses.replace(low, condition=bk.Contact(bk.Gap(7.0))), *parts[1:], discretisation=discretisation)
    )
    np.testing.assert_allclose(
        solution.contact.u_t, other.contact.u_t, rtol=1e-9, atol=1e-12 * np.abs(other.contact.u_t).max()
    )


@DISCRETISATIONS
@pytest.mark.parametrize("pull", [1e-12, 1.0, 1e12])
def test_a_body_that_lifts_off_is_refused_with_a_remedy(discretisation: bk.Galerkin, pull: float) -> None:
    with pytest.raises(UnsolvableSceneError, match=r"upward.*hold"):
        bk.run(block(FLOOR, WALL, press(-pull), discretisation=discretisation))


@DISCRETISATIONS
def test_a_held_body_that_lifts_off_has_an_answer(discretisation: bk.Galerkin) -> None:
    held = bk.Part("held", bk.Clamped(), sides=("right",))
    solution = bk.run(
        block(FLOOR, held, bk.Part("pull", bk.Traction(y=1e-3), sides=("left",)), discretisation=discretisation)
    )
    assert solution.is_converged
    assert not solution.contact.status.any()
    assert solution.contact.clearance.max() > 1e-3


@DISCRETISATIONS
@pytest.mark.parametrize("share", [0.5, 0.999, 1.001, 2.0])
def test_a_body_slides_away_when_the_push_exceeds_friction(discretisation: bk.Galerkin, share: float) -> None:
    push = bk.Part("push", bk.Pressure(0.3 * share), ("left",), bk.Expression("y < 0.5"))
    scene = block(FLOOR, bk.Part("press", bk.Pressure(0.5), sides=("top",)), push, discretisation=discretisation)
    if share < 1.0:
        solution = bk.run(scene)
        assert solution.is_converged
        assert solution.force_tangential == pytest.approx(-0.15 * share, rel=1e-8)
        assert violations_of(solution).is_good
    else:
        with pytest.raises(UnsolvableSceneError, match=r"slides.*friction.*hold"):
            bk.run(scene)


@DISCRETISATIONS
@pytest.mark.parametrize("friction", [0.0, 0.5, 1e3])
def test_a_roller_and_a_sticking_corner_hold_one_direction_twice(discretisation: bk.Galerkin, friction: float) -> None:
    sides = (WALL, bk.Part("other wall", bk.Roller(), sides=("left",)))
    scene = block(FLOOR, *sides, press(2.0), law=bk.Coulomb(friction), discretisation=discretisation)
    solution = bk.run(scene)
    assert solution.is_converged
    if discretisation == LINEAR:  # which holds uniform stresses exactly: no spurious reaction at the corners
        np.testing.assert_allclose(solution.contact.sigma_n, -2.0, rtol=1e-9)
    assert solution.force_normal == pytest.approx(2.0, rel=1e-10)
    # constant elements miss uniform strain by some per cent of the pressure at the elements beside corners
    np.testing.assert_allclose(solution.contact.sigma_t, 0.0, atol=0.1 if discretisation == CONSTANT else 1e-9)
    corner = np.argmax(solution.contact.x)
    assert abs(solution.contact.u_t[corner]) <= (1e-12 if discretisation == LINEAR else 1e-2)


def test_a_body_too_far_from_the_origin_is_refused_and_a_far_one_is_not_held_by_round_off() -> None:
    def lifted(distance: float) -> bk.Scene:
        floor = bk.Part("floor", bk.Contact(bk.RigidHalfPlane(point=(distance, distance))), sides=("bottom",))
        return block(floor, WALL, press(-1.0), shape=bk.Rectangle(1.0, 1.0, corner=(distance, distance)))

    with pytest.raises(ValueError, match=r"times its size from the origin.*subtract about"):
        bk.run(lifted(1e9))
    # the nodes of the wall share their x exactly, or a slanted roller would hold the body against the pull
    with pytest.raises(UnsolvableSceneError, match="upward"):
        bk.run(lifted(0.7e6))


@DISCRETISATIONS
@pytest.mark.parametrize("distance", [1e5, 0.9e7])
def test_rollers_on_a_far_slanted_wall_do_not_hold_a_body_that_is_pulled_off(
    discretisation: bk.Galerkin, distance: float
) -> None:
    # out there the normals of the elements of one straight wall differ by eps distance / length of an element, 1e-8
    def turned(pressure: float) -> bk.Scene:
        axes = np.array([[np.cos(0.3), np.sin(0.3)], [-np.sin(0.3), np.cos(0.3)]])
        corners = [0.7 * distance, 0.6 * distance] + np.array([[0, 0], [1, 0], [1, 1], [0, 1]]) @ axes
        vertices = tuple((x, y) for x, y in corners.tolist())
        floor = bk.Contact(bk.RigidHalfPlane(point=vertices[0], normal=tuple(axes[1].tolist())))
        parts = (
            bk.Part("floor", floor, sides=("side-1",)),
            bk.Part("wall", bk.Roller(), sides=("side-2",)),
            bk.Part("press", bk.Pressure(pressure), sides=("side-3",)),
        )
        return block(*parts, shape=bk.Polygon(vertices), discretisation=discretisation)

    with pytest.raises(UnsolvableSceneError, match=r"at 107\.2 degrees .* 0\.001; nothing holds it"):
        bk.run(turned(-1e-3))
    solution = bk.run(turned(1e-3))
    assert solution.is_converged
    assert solution.force_normal == pytest.approx(1e-3, rel=1e-6)  # the length of the wall has nine digits


@DISCRETISATIONS
@pytest.mark.parametrize(("gap", "pressure"), [(1e9, 1e-2), (1e3, 1e-6)])
def test_a_gap_that_hides_the_deformation_is_named(discretisation: bk.Galerkin, gap: float, pressure: float) -> None:
    low = bk.Part("floor", bk.Contact(bk.RigidHalfPlane(point=(0.0, -gap))), sides=("bottom",))
    solution = bk.run(block(low, WALL, press(pressure), discretisation=discretisation))
    assert solution.status is Status.TOO_FAR
    assert re.search(r"move body and obstacle together.*the travel is \d\.\de\+\d\d times", solution.message)


def loose_scenes() -> dict[str, bk.Scene]:
    """Bodies that some motion carries nowhere: their open nodes have no traction, not a little."""
    disk = bk.Disk(1.0, centre=(0.0, 1.0))
    rollers = [bk.Part(name, bk.Roller(), sides=(name,)) for name in ("arc-3", "arc-4")]
    far = bk.Part("far", bk.Contact(bk.Gap(0.2)), sides=("arc-2",))
    tight = bk.Part("tight", bk.Contact(bk.Gap(-6.3e-3)), sides=("arc-3",))
    below = bk.Part("below", bk.Contact(bk.RigidCircle((0.0, -20.0), 20.0)), sides=("arc-1",))
    pulls = [bk.Part(name, bk.Pressure(-3.1e-5), sides=(name,)) for name in ("arc-2", "arc-4")]
    bump, dent = (bk.Contact(bk.Gap(bk.Expression(f"{gap} + x**2"))) for gap in (-1e-2, 0.0))
    level = bk.Contact(bk.RigidHalfPlane(point=(0.0, 1e-2)))
    sides = [bk.Part(f"side-{k}", each, sides=(f"side-{k}",)) for k, each in enumerate((bump, level, dent), 1)]
    lifted = bk.Part("right", bk.PrescribedDisplacement(y=5e-4), sides=("right",))
    sticky, rough = bk.CohesiveCoulomb(0.0, 4e-9, cap=4e-8), bk.CohesiveCoulomb(100.0, 2.7e-4, cap=2.7e-3)
    mesh = bk.MeshOptions(22, bk.Algebraic(2.0))
    return {
        "may turn between rollers": block(
            far, bk.Part("p", bk.Pressure(2e-6), sides=("arc-1",)), *rollers, shape=disk, law=sticky, mesh=mesh
        ),
        "may turn where it is pinched": block(
            tight, below, *pulls, shape=disk, law=rough, mesh=bk.MeshOptions(22), discretisation=CONSTANT
        ),
        "is pushed out of overlaps": block(
            *sides,
            shape=bk.Polygon(((0.14467, 0.51906), (-0.46116, 0.27872), (0.53884, 0.0))),
            material=bk.Material(1.0, 0.2),
            law=bk.Coulomb(0.5),
            solver=bk.AugmentedLagrangian(max_steps=50),
            discretisation=bk.Galerkin(2),
            mesh=mesh,
        ),
        "is lifted by its support": block(
            bk.Part("far", bk.Contact(bk.Gap(bk.Expression("8 + x**2"))), sides=("bottom", "top")),
            lifted,
            law=rough,
            mesh=mesh,
        ),
    }


@pytest.mark.parametrize("name", slow_only(loose_scenes(), "may turn where it is pinched", "is pushed out of overlaps"))
def test_open_nodes_of_a_body_that_may_still_move_have_no_traction_at_all(name: str) -> None:
    solution = bk.run(loose_scenes()[name])
    # a parabolic gap is least between two quadratic nodes of the body that was pushed out
    is_missed = name == "is pushed out of overlaps"
    assert solution.status is (bk.Status.MISSED_CONTACT if is_missed else bk.Status.CONVERGED)
    is_open = solution.contact.clearance > 1e-9 * np.abs(solution.boundary.displacement).max()
    assert is_open.any()
    assert not solution.contact.sigma_n[is_open].any()
    assert not solution.contact.sigma_t[is_open].any()
    assert violations_of(solution).is_good


@pytest.mark.parametrize("discretisation", slow_except([LINEAR, CONSTANT, bk.Galerkin(2)], CONSTANT))
def test_rollers_along_a_circle_do_not_hold_a_rotation(discretisation: bk.Galerkin) -> None:
    parts = (
        bk.Part("liner", bk.Contact(bk.Gap(0.0)), sides=("outer-1",)),
        bk.Part("rollers", bk.Roller(), sides=("outer-2", "outer-3")),
        bk.Part("torque", bk.Pressure(1e-3, shear=1e-4), sides=("inner-1", "inner-2", "inner-3", "inner-4")),
    )
    scene = block(*parts, shape=bk.Ring(1.0, 2.0), law=bk.Frictionless(), discretisation=discretisation)
    with pytest.raises(UnsolvableSceneError, match=r"turns the body .* about \(0, 0\).*hold"):
        bk.run(scene)
    # friction takes the torque up: 1e-4 * 2 pi against 0.3 of the pressure on a quarter of the outer circle
    held = bk.run(dataclasses.replace(scene, law=bk.Coulomb(3.0)))
    assert held.is_converged
    assert violations_of(held).is_good


def test_a_body_on_its_way_to_infinity_is_not_in_equilibrium() -> None:
    # the only contact node would have to be wedged by a turn that never closes its gap
    parts = (
        bk.Part("c", bk.Contact(bk.RigidHalfPlane()), sides=("inner-2",)),
        bk.Part("t", bk.Traction(x=1e-4), sides=("outer-1",)),
        bk.Part("rollers", bk.Roller(), sides=("outer-2", "outer-3")),
        bk.Part("p", bk.Pressure(1e-2), sides=("inner-4",)),
    )
    options = {
        "shape": bk.Ring(1.0, 2.0),
        "law": bk.Coulomb(3.0),
        "discretisation": CONSTANT,
        "mesh": bk.MeshOptions(12),
    }
    assert not bk.run(block(*parts, material=bk.Material(1.0, 0.2), **options)).is_converged


@pytest.mark.parametrize("discretisation", slow_except([LINEAR, CONSTANT], CONSTANT), ids=["linear", "constant"])
def test_tractions_beside_corners_stay_sensible_on_elements_of_1e_minus_12(discretisation: bk.Galerkin) -> None:
    (axis,) = find_axes(["grading"])
    baseline = bk.run(small_paper_scene(1, 48, discretisation=discretisation))
    case = axis.make(baseline, 1e12)
    solution = bk.run(case.scene, mesh=case.mesh(case.scene))
    assert solution.mesh.lengths.max() / solution.mesh.lengths.min() > 0.5e12
    # constant elements see the corner singularity at 1e-13; round-off alone made 1e10
    assert np.abs(solution.boundary.traction).max() < 1e4
    # the discretisation error of 48 constant elements is about 5 per cent
    assert solution.force_tangential == pytest.approx(baseline.force_tangential, rel=3e-2)


def test_supports_that_fix_every_contact_node_are_an_error_with_a_remedy() -> None:
    walls = (bk.Part("l", bk.Clamped(), sides=("left",)), bk.Part("r", bk.Clamped(), sides=("right",)))
    with pytest.raises(ValueError, match="every node of the contact boundary: use more elements"):
        bk.run(block(FLOOR, *walls, mesh=bk.MeshOptions(4)))
