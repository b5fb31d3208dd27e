"""Bodies that nothing holds: exact responses where forces balance, and no traction where none is needed."""

from dataclasses import replace

import numpy as np
import pytest

from bemkit.contact.conditions import separated, slip, stick
from bemkit.contact.laws import Coulomb, Frictionless
from bemkit.contact.problem import ContactProblem, ContactState
from bemkit.solvers.alm import AugmentedLagrangian
from bemkit.solvers.base import solve
from bemkit.solvers.fixed_point import FixedPoint
from bemkit.solvers.newton import floating_response
from bemkit.solvers.ssn import SemismoothNewton
from bemkit.testing.lemke import LemkePivoting
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


DRIVERS = [SemismoothNewton(), SemismoothNewton(rho=1e-3), AugmentedLagrangian(), FixedPoint(), LemkePivoting()]


@pytest.mark.parametrize("law", [Coulomb(0.5), Frictionless()], ids=["coulomb", "frictionless"])
@pytest.mark.parametrize("driver", DRIVERS, ids=repr)
def test_a_loose_body_gives_way_to_an_overlap_and_keeps_no_traction(driver, law):
    gap = 1e-3 * (np.linspace(-1.0, 2.0, N) ** 2 - 1.0)
    problem = ContactProblem(LOOSE, gap, law)
    solution = solve(problem, driver)
    np.testing.assert_array_equal(solution.state.traction, 0.0)
    furthest = np.abs(solution.state.displacement).max()
    assert np.max(solution.state.u_n - gap) <= 1e-9 * furthest  # the tolerance of the certificate
    assert furthest <= 1e-2  # nor does it leave for no reason
    again = solve(problem, driver, start=ContactState(solution.state.displacement, solution.state.traction))
    np.testing.assert_array_equal(again.state.traction, 0.0)
