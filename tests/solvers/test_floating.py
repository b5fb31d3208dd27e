"""Bodies that nothing holds: exact responses where forces balance, and no traction where none is needed."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import nnls

from bemkit.contact.body import ContactState, separated, slip, stick
from bemkit.contact.laws import Coulomb, Frictionless
from bemkit.contact.problem import ContactProblem
from bemkit.solvers.alm import AugmentedLagrangian
from bemkit.solvers.base import solve
from bemkit.solvers.fixed_point import FixedPoint
from bemkit.solvers.lemke import LemkePivoting
from bemkit.solvers.newton import FloatingResponse, floating_response
from bemkit.solvers.ssn import SemismoothNewton
from tests.handmade import block_body

N = 13
LOOSE = block_body(press=0.0, push=0.0, is_held_sideways=False)
OPEN = separated(N)


def test_the_response_to_balanced_forces_is_exact_and_the_nearest_one():
    bent = np.random.default_rng(0).normal(size=(N, 2))
    body = replace(LOOSE, load=LOOSE.stiffness @ bent.ravel())
    response = floating_response(body, OPEN)
    assert len(response.free_motions) == 3
    shift = 3.0 * body.motions[0] - 2.0 * body.motions[1] + 0.5 * body.motions[2]
    state = response.nearest(bent + shift)
    np.testing.assert_array_equal(state.traction, 0.0)
    np.testing.assert_allclose(state.displacement, bent + shift, atol=1e-10)  # a condition number of 1e3 and some eps


def test_closed_nodes_keep_their_places_and_friction_follows_their_pressure():
    # pressed at two nodes, which leaves one sliding motion; friction there would need the opposite slide
    gap, no_slip = np.full(N, 0.25), np.zeros(N)
    closed = np.zeros((N, 2), dtype=bool)
    closed[[3, 9]] = True
    direction = np.where(np.arange(N) == 3, 1.0, -1.0)
    conditions = OPEN.replaced(closed, slip(gap, direction, np.full(N, -0.5), np.zeros(N)))
    squeezed = np.zeros((N, 2))
    squeezed[[3, 9], 0] = 1.0
    body = replace(LOOSE, load=(LOOSE.stiffness @ squeezed.ravel()) * 1e-3)
    response = floating_response(body, conditions)
    assert len(response.free_motions) == 1
    assert np.abs(response.free_motions[0][[3, 9], 0]).max() <= 1e-12
    state = response.nearest(np.zeros((N, 2)))
    np.testing.assert_allclose(state.u_n[[3, 9]], 0.25, rtol=1e-12)
    np.testing.assert_allclose(state.sigma_t, -0.5 * direction * np.abs(state.sigma_n), atol=1e-13)
    assert not np.delete(state.traction, [3, 9], axis=0).any()
    held = OPEN.replaced(closed, stick(gap, no_slip))
    assert floating_response(body, held) is None


@pytest.mark.parametrize("net", [1.0, 1e-11])
def test_a_load_that_would_move_the_body_has_no_floating_response(net):
    # beside it a thousand times larger load that balances; even 1e-11 of it is more than round-off
    load = 1e3 * LOOSE.stiffness @ np.random.default_rng(1).normal(size=2 * N)
    load[0::2] += net * np.abs(load).max() / N
    assert floating_response(replace(LOOSE, load=load), OPEN) is None
    assert floating_response(block_body(is_held_sideways=False), OPEN) is None


def test_a_floating_body_is_moved_out_of_the_obstacle_by_the_least() -> None:
    """A shift where one node is in the way, a shift and a turn where three are."""
    response = floating_response(LOOSE, OPEN)
    far = response.nearest(1e4 * (LOOSE.motions[0] + LOOSE.motions[1])).displacement
    np.testing.assert_array_equal(response.nearest_clear(far, np.full(N, 1e5)).displacement, far)
    for depth in ([(4, 0.3)], [(0, 0.2), (5, 0.9), (12, 0.1)]):
        gap = np.full(N, 1e5)
        for node, deep in depth:
            gap[node] = far[node, 0] - deep
        moved = response.nearest_clear(far, gap).displacement
        clearance = gap - moved[:, 0]
        assert clearance.min() == pytest.approx(0.0, abs=1e-11)  # round-off of displacements of 1e4
        # the least of all: the shift is a combination, with one sign, of what moves the touching nodes
        touching = np.flatnonzero(clearance < 1e-10)
        motions = np.linalg.qr(response.free_motions.reshape(3, -1).T)[0]
        factors, rest = nnls(motions[2 * touching].T, -(motions.T @ (moved - far).ravel()))
        assert rest < 1e-10
        assert factors.max() > 0.1
    too_deep = far[:, 0] - 20.0
    np.testing.assert_array_equal(response.nearest_clear(far, too_deep).displacement, far)


def test_a_body_that_is_jammed_stays_where_it_is() -> None:
    """Two obstacles that face each other, one at each end of a sliding motion."""
    far = np.array([[0.0, 100.0], [0.0, 100.0]])
    response = FloatingResponse(ContactState(far, np.zeros((2, 2))), np.array([[[1.0, 0.0], [-1.0, 0.0]]]))
    np.testing.assert_array_equal(response.nearest_clear(far, np.array([-0.01, -0.01])).displacement, far)


DRIVERS = [SemismoothNewton(), SemismoothNewton(rho=1e-3), AugmentedLagrangian(), FixedPoint(), LemkePivoting()]


@pytest.mark.parametrize("law", [Coulomb(0.5), Frictionless()], ids=["coulomb", "frictionless"])
@pytest.mark.parametrize("driver", DRIVERS, ids=repr)
def test_a_loose_body_gives_way_to_an_overlap_and_keeps_no_traction(driver, law):
    gap = 1e-3 * (np.linspace(-1.0, 2.0, N) ** 2 - 1.0)
    problem = ContactProblem(LOOSE, gap, law)
    solution = solve(problem, driver)
    np.testing.assert_array_equal(solution.state.traction, 0.0)
    furthest = np.abs(solution.state.displacement).max()
    assert np.max(solution.state.u_n - gap) <= 1e-12 * furthest  # 1e-9 of a thousandth, as certificates measure
    assert furthest <= 1e-2  # nor does it leave for no reason
    again = solve(problem, driver, start=ContactState(solution.state.displacement, solution.state.traction))
    np.testing.assert_array_equal(again.state.traction, 0.0)
