"""All drivers reach the same certified state."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bemkit.contact.body import ContactState
from bemkit.contact.further_laws import CohesiveCoulomb
from bemkit.contact.laws import Coulomb, Frictionless, Tresca
from bemkit.contact.problem import ContactProblem
from bemkit.solvers.alm import AugmentedLagrangian, BoundUpdate
from bemkit.solvers.base import solve
from bemkit.solvers.fixed_point import FixedPoint
from bemkit.solvers.homotopy import AffineBound, follow_path
from bemkit.solvers.lemke import LemkePivoting
from bemkit.solvers.ssn import SemismoothNewton
from tests.handmade import assert_solves, block_problem, random_problem
from tests.slow import slow_except

DRIVERS = {
    "newton": SemismoothNewton(),
    "augmented": AugmentedLagrangian(),
    "augmented, current bound": AugmentedLagrangian(bound=BoundUpdate.CURRENT),
    "fixed point": FixedPoint(),
    "lemke": LemkePivoting(),
}


def assert_same(problem, state, other, tolerance=1e-7):
    """Compare relative to the largest entries, or to what the load makes of a clamped body if little is left of it."""
    stress = max(np.abs(other.traction).max(), np.abs(problem.sticking_state.traction).max())
    length = max(np.abs(other.displacement).max(), stress / problem.body.stiffness_scale)
    assert np.abs(state.displacement - other.displacement).max() <= tolerance * length
    assert np.abs(state.traction - other.traction).max() <= tolerance * stress


def check_random_problem(seed):
    problem = random_problem(seed)
    coefficient = problem.law.friction_coefficient
    referee = solve(problem, LemkePivoting())
    for driver in DRIVERS.values():
        solution = solve(problem, driver)
        assert_solves(problem, solution.state, coefficient)
        # certificates of 1e-9 and condition numbers of 10 leave 1e-8
        assert_same(problem, solution.state, referee.state)
    path = follow_path(problem, AffineBound.tangent(problem, np.zeros(problem.n_contact)))
    assert_same(problem, path.state, referee.state)


@settings(max_examples=settings.default.max_examples // 6)
@given(st.integers(0, 10**9))
def test_drivers_agree_on_random_problems(seed):
    check_random_problem(seed)


@pytest.mark.slow
@settings(max_examples=200)
@given(st.integers(10**9, 10**12))
def test_drivers_agree_on_more_random_problems(seed):
    check_random_problem(seed)


RISING = np.linspace(0.0, 0.6, 12)


@pytest.mark.parametrize("law", [Frictionless(), Tresca(RISING), Coulomb(RISING)], ids=repr)
@pytest.mark.parametrize("press", slow_except([1.0, 0.1], 0.1))
def test_drivers_agree_on_a_floating_block(law, press):
    problem = block_problem(law, press=press)
    referee = solve(problem, LemkePivoting())
    for driver in DRIVERS.values():
        solution = solve(problem, driver)
        # certificates measure displacements by single-node compliances, about n times smaller than the block's
        assert_same(problem, solution.state, referee.state)
        assert np.array_equal(solution.node_status, referee.node_status)


def test_drivers_agree_on_a_capped_law_which_the_referee_refuses():
    problem = block_problem(CohesiveCoulomb(0.5, 0.0, 0.15))
    reference = solve(problem, SemismoothNewton())
    assert np.isclose(np.abs(reference.state.sigma_t), 0.15, rtol=1e-12).any()
    for name in ("augmented", "augmented, current bound", "fixed point"):
        assert_same(problem, solve(problem, DRIVERS[name]).state, reference.state)
    with pytest.raises(ValueError, match="LemkePivoting cannot treat the friction law CohesiveCoulomb"):
        solve(problem, DRIVERS["lemke"])


def test_drivers_agree_with_nodes_that_never_touch():
    problem = block_problem(Coulomb(0.5))
    gap = np.where(np.arange(problem.n_contact) % 4 == 0, np.inf, 0.0)
    problem = ContactProblem(problem.body, gap, problem.law)
    reference = solve(problem, LemkePivoting())
    for driver in DRIVERS.values():
        assert_same(problem, solve(problem, driver).state, reference.state)


@pytest.mark.slow
def test_results_do_not_depend_on_rho():
    problem = block_problem(Coulomb(0.5))
    reference = solve(problem, SemismoothNewton())
    scale = problem.body.stiffness_scale
    for factor in (1e-4, 1e-2, 1e2, 1e4):
        solution = solve(problem, SemismoothNewton(rho=factor * scale))
        assert_same(problem, solution.state, reference.state, 1e-10)
        assert abs(solution.linear_solves - reference.linear_solves) <= 1
    for rho_n in (1.0, 1e2, 1e5):
        for rho_t in (1.0, 1e2, 1e5):
            solution = solve(problem, AugmentedLagrangian(rho_n=rho_n * scale, rho_t=rho_t * scale))
            assert_same(problem, solution.state, reference.state)


@pytest.mark.slow
def test_incremental_law_is_the_static_law_moved():
    """Moving the reference slip by what the body can follow without strain moves the solution along."""
    problem = block_problem(Coulomb(0.5), is_held_sideways=False, push=0.1)
    shift = 0.7
    moved = ContactProblem(problem.body, problem.gap, problem.law, np.full(problem.n_contact, shift))
    for driver in DRIVERS.values():
        here, there = solve(problem, driver), solve(moved, driver)
        expected = ContactState(here.state.displacement + np.array([0.0, shift]), here.state.traction)
        assert_same(problem, there.state, expected)
        assert np.array_equal(here.node_status, there.node_status)
