"""Bodies that supports carry along, nearly free of contact: forces count by themselves, not by those that could be."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import bemkit as bk
from bemkit.contact.body import ContactState
from bemkit.contact.equilibrium import NOISE_FACTOR, Unbalanced
from bemkit.contact.laws import Coulomb, Frictionless
from bemkit.model.model import build_model
from bemkit.model.prepared import prepare
from bemkit.solvers.base import ContactSolver
from bemkit.solvers.newton import carried_on
from bemkit.testing.independent_check import violations_of
from tests.slow import slow_except, slow_only

DRIVERS = [bk.SemismoothNewton(), bk.AugmentedLagrangian(), bk.FixedPoint(), bk.LemkePivoting()]
TILT = 0.6
WALL = bk.RigidHalfPlane((math.cos(TILT), math.sin(TILT)), (-math.cos(TILT), -math.sin(TILT)))
"""Touches a unit disc at the origin, and gives way to none that moves up: it slides aside, where nothing holds it."""


def carried_disc(distance: float, push: float = 0.0, **options: object) -> bk.Scene:
    """A disc of E = 1 that is moved up along a slanted wall, and pushed to the wall by a load on its far side."""
    parts = [
        bk.Part("wall", bk.Contact(WALL), sides=("arc-1",)),
        bk.Part("lift", bk.PrescribedDisplacement(y=distance), sides=("arc-4",)),
    ]
    if push:
        parts.append(bk.Part("push", bk.Traction(x=push), sides=("arc-3",)))
    defaults: dict[str, object] = {"law": Frictionless(), "mesh": bk.MeshOptions(32), "material": bk.Material(1.0, 0.3)}
    return bk.Scene(title="carried", shape=bk.Disk(1.0), parts=tuple(parts), **(defaults | options))


DRIVEN = pytest.mark.parametrize("driver", DRIVERS, ids=lambda driver: type(driver).__name__)


@DRIVEN
@pytest.mark.parametrize(
    ("discretisation", "distance"),
    [
        pytest.param(bk.Galerkin(1), 1e-12, marks=pytest.mark.slow),
        pytest.param(bk.Galerkin(2), 1e-3, marks=pytest.mark.slow),
        (bk.ConstantCollocation(), 0.3),
    ],
    ids=["linear", "quadratic", "constant"],
)
def test_a_body_that_gives_way_to_its_obstacle_is_solved_without_contact_forces(
    driver: ContactSolver, discretisation: bk.Galerkin, distance: float
) -> None:
    """No load pushes the disc to the wall: neither springs nor round-off of what the support causes."""
    solution = bk.run(carried_disc(distance, solver=driver, discretisation=discretisation))
    assert solution.is_converged
    assert not solution.contact.sigma_n.any()
    assert solution.contact.clearance.min() >= -1e-9 * distance
    assert violations_of(solution).is_good


def assert_right_or_unsolved(scene: bk.Scene, distance: float, push: float) -> bool:
    """Compare the force of the wall along x with the push, the only other one; return whether there is an answer."""
    solution = bk.run(scene)
    if not solution.is_converged:  # or the nodes do not meet the wall
        assert solution.certificate.worst > 1e-9 or solution.status is bk.Status.MISSED_CONTACT
        return False
    contact = solution.contact
    normal, shear = contact.weight @ contact.sigma_n, contact.weight @ contact.sigma_t
    along_x = normal * math.cos(TILT) - shear * math.sin(TILT)  # the tangent of contact is (-sin, cos)
    pushed = push * float(solution.mesh.lengths[solution.mesh.part("push")].sum()) if push else 0.0
    # a certificate lets 1e-6 of the forces pass, and without any some hundred eps of those that would strain the disc
    assert along_x == pytest.approx(-pushed, rel=1e-5, abs=1e-13 * distance)
    assert violations_of(solution).is_good
    return True


@pytest.mark.parametrize(
    "driver", slow_only(DRIVERS, bk.LemkePivoting(), bk.AugmentedLagrangian()), ids=lambda driver: type(driver).__name__
)
@pytest.mark.parametrize("push", slow_except([1e-10, 1e-4], 1e-10))
def test_the_wall_carries_the_push_however_small(driver: ContactSolver, push: float) -> None:
    """Beside what a disc clamped at the wall would exert on it, pushes are nothing; they are all there is."""
    is_solved = assert_right_or_unsolved(carried_disc(0.3, push, law=Coulomb(0.2), solver=driver), 0.3, push)
    assert is_solved or push < 1e-4  # 1e-10 of a strain of one leaves few digits


@pytest.mark.slow
@DRIVEN
@pytest.mark.parametrize("law", [Frictionless(), Coulomb(0.2)], ids=["frictionless", "coulomb"])
@pytest.mark.parametrize("distance", [1e-12, 1e-3, 0.3])
def test_a_carried_disc_is_right_or_has_no_answer(driver: ContactSolver, law: bk.FrictionLaw, distance: float) -> None:
    for discretisation in (bk.Galerkin(1), bk.Galerkin(2), bk.ConstantCollocation()):
        for push in (0.0, 1e-15, 1e-10, 1e-5, 1e-2):
            scene = carried_disc(distance, push, law=law, solver=driver, discretisation=discretisation)
            assert_right_or_unsolved(scene, distance, push)


def test_a_body_that_springs_hold_is_carried_to_the_next_node_alone() -> None:
    problem = build_model(prepare(scene := carried_disc(0.1), scene.build_mesh())).problem
    before, way = ContactState(np.zeros((problem.n_contact, 2)), np.ones((problem.n_contact, 2))), np.zeros(2)
    clearance = np.sort(problem.gap)[:2]
    assert clearance[1] > 1.1 * clearance[0]
    way[0] = 1e-9  # towards the wall with all nodes alike
    after = ContactState(before.displacement + way, before.traction)
    found = carried_on(problem, before, after)
    assert np.count_nonzero(found.u_n > problem.gap) == 1
    np.testing.assert_array_equal(found.traction, after.traction)
    # away from the wall none closes
    away = ContactState(before.displacement - way, before.traction)
    assert carried_on(problem, before, away) is away


def test_what_springs_leave_on_a_carried_body_is_no_equilibrium() -> None:
    """A force of 1e-8 on a body that is free to move: nothing beside the load of the clamped body, but all there is."""
    scene = carried_disc(0.3)
    problem = build_model(prepare(scene, scene.build_mesh())).problem
    body, sticking = problem.body, problem.sticking_state
    assert body.imbalance(ContactState(sticking.displacement, np.zeros_like(sticking.traction))).is_below(1e-12)
    left = np.zeros_like(sticking.traction)
    left[3, 0] = -1e-8
    off = body.imbalance(ContactState(sticking.displacement, left))
    assert off.force == pytest.approx(1.0)  # nothing else acts at the node
    assert off.moment > 0.1  # its share along x, where the body is free


forces = st.floats(1e-9, 1e9)


@given(forces, forces, st.floats(1e-12, 1e-3))
def test_what_is_missing_is_relative_to_the_forces_at_hand(contact: float, given_force: float, share: float) -> None:
    missing = share * max(contact, given_force)
    state = Unbalanced(np.array([-contact, 0.0]), missing, missing, 0.0, 0.0, terms=1e12 * (contact + given_force))
    off = state.relative_to(np.array([0.0, given_force]))
    assert off.force == pytest.approx(share)
    assert off.moment == pytest.approx(missing / (contact + given_force))
    # supports may squeeze a body by any force without work on its free motions
    squeezed = state.relative_to(np.array([given_force]), reaction=1e15)
    assert squeezed.force == pytest.approx(missing / 1e15)
    assert squeezed.moment == pytest.approx(off.moment)


@given(forces, st.floats(0.1, 0.9))
def test_round_off_of_a_moved_body_is_no_force_but_a_load_is(terms: float, share: float) -> None:
    round_off = np.finfo(float).eps * terms
    noise = share * NOISE_FACTOR * round_off
    moved = Unbalanced(np.array([noise]), noise, noise, round_off, round_off, terms)
    assert moved.relative_to(np.zeros(3)).worst <= NOISE_FACTOR * np.finfo(float).eps
    assert moved.relative_to(np.array([noise])).worst >= 0.5  # a body on its way to infinity balances no load
    assert moved.relative_to(np.array([noise])).round_off == 1e-6
    more = 1.1 / share * noise
    assert Unbalanced(np.array([more]), more, more, round_off, round_off, terms).relative_to(np.zeros(3)).worst == 1.0


@pytest.mark.parametrize("missing", [0.0, 1e-30, 1.0])
def test_nothing_is_small_beside_nothing(missing: float) -> None:
    """A stiffness of zero, as of one contact node of a driven half-plane, balances no load."""
    state = Unbalanced(np.zeros(2), missing, missing, 0.0, 0.0, terms=0.0)
    assert state.relative_to(np.zeros(2)).worst == float(missing > 0.0)
