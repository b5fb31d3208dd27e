"""Solver problems with known answers: C1, C3, C4, Theorem 1."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bemkit.contact.body import ContactState
from bemkit.contact.dense_body import DenseBody
from bemkit.contact.laws import Coulomb, Frictionless, Tresca
from bemkit.contact.problem import ContactProblem
from bemkit.solvers.active_sets import NodeStatus
from bemkit.solvers.alm import AugmentedLagrangian, BoundUpdate
from bemkit.solvers.base import solve
from bemkit.solvers.fixed_point import FixedPoint
from bemkit.solvers.lemke import LemkePivoting
from bemkit.solvers.multistart import probe, start_with
from bemkit.solvers.ssn import SemismoothNewton
from tests.handmade import assert_solves, block_problem, random_body
from tests.slow import slow_only

DRIVERS = [
    SemismoothNewton(),
    AugmentedLagrangian(),
    AugmentedLagrangian(bound=BoundUpdate.CURRENT),
    FixedPoint(),
    LemkePivoting(),
]

# One node, stiffness [[1, 1/2], [1/2, 1]] in (n, t), load (1, 2.5): C1 with the normal pointing into the obstacle.
THREE = ContactProblem(
    DenseBody(np.array([[1.0, 0.5], [0.5, 1.0]]), np.array([1.0, 2.5]), np.ones(1)), np.zeros(1), Coulomb(3.0)
)
THREE_ANSWERS = {
    NodeStatus.STICK: ([0.0, 0.0], [-1.0, -2.5]),
    NodeStatus.SLIP_FORWARD: ([0.0, 1.0], [-0.5, -1.5]),
    NodeStatus.SEPARATED: ([-1 / 3, 8 / 3], [0.0, 0.0]),
}


@pytest.mark.parametrize("status", list(THREE_ANSWERS), ids=lambda status: status.name)
def test_three_solutions_one_for_each_start(status):
    solution = solve(THREE, SemismoothNewton(), start=start_with(THREE, [status]))
    displacement, traction = THREE_ANSWERS[status]
    assert np.allclose(solution.state.displacement, [displacement], atol=1e-14)
    assert np.allclose(solution.state.traction, [traction], atol=1e-14)
    assert solution.node_status.tolist() == [status]
    assert_solves(THREE, solution.state, 3.0)


def test_probe_finds_all_three_and_tells_them_apart():
    found = probe(THREE, SemismoothNewton())
    assert {NodeStatus(int(solution.node_status[0])) for solution in found} == set(THREE_ANSWERS)
    assert len(found) == 3
    assert len(probe(THREE, SemismoothNewton(), n_starts=1)) == 1
    with pytest.raises(ValueError, match="n_starts = -1"):
        probe(THREE, SemismoothNewton(), n_starts=-1)


def test_probe_finds_one_solution_where_there_is_one():
    assert len(probe(block_problem(Coulomb(0.3)), SemismoothNewton())) == 1


@pytest.mark.parametrize("driver", DRIVERS, ids=repr)
def test_each_driver_returns_one_of_the_three_reproducibly(driver):
    solution, again = solve(THREE, driver), solve(THREE, driver)
    assert_solves(THREE, solution.state, 3.0)
    assert np.array_equal(solution.state.displacement, again.state.displacement)


@pytest.mark.parametrize("driver", DRIVERS, ids=repr)
@pytest.mark.parametrize("law", [Coulomb(0.5), Tresca(0.3), Frictionless()], ids=repr)
def test_no_load_no_gap(driver, law):
    random = np.random.default_rng(0)
    body = random_body(random, 7)
    problem = ContactProblem(DenseBody(body.stiffness, np.zeros(14), body.weights), np.zeros(7), law)
    solution = solve(problem, driver)
    assert solution.steps <= 2
    assert not solution.state.displacement.any()
    assert not solution.state.traction.any()
    assert not solution.node_status.any()  # touching without traction counts as separated


@pytest.mark.parametrize("rho", [0.3, 1.0, 20.0])
def test_augmented_multiplier_error_shrinks_by_one_over_one_plus_rho_compliance(rho):
    stiffness, load = 2.0, 3.0
    body = DenseBody(np.diag([stiffness, 1.0]), np.array([load, 0.0]), np.ones(1))
    problem = ContactProblem(body, np.zeros(1), Frictionless())
    driver = AugmentedLagrangian(rho_n=rho, rho_t=rho)
    start = ContactState(np.array([[0.5, 0.0]]), np.array([[2 * 0.5 - load, 0.0]]))
    iterate = driver.init(problem, start)
    error = 1.0  # of sigma_n = -2 against -3
    for _ in range(6):
        iterate = driver.step(problem, iterate)
        error /= 1.0 + rho / stiffness
        assert iterate.state.sigma_n[0] + load == pytest.approx(error, rel=1e-9, abs=1e-13)


@settings(max_examples=settings.default.max_examples // 3)
@given(
    seed=st.integers(0, 10**6),
    rho_n=st.sampled_from([0.01, 1.0, 30.0, 1e4]),
    rho_t=st.sampled_from([0.01, 1.0, 30.0, 1e4]),
)
def test_theorem_1_decrease_in_every_step(seed, rho_n, rho_t):
    """(46): energy of the displacement error <= loss of the weighted multiplier errors, for Tresca's law."""
    random = np.random.default_rng(seed)
    body = random_body(random, int(random.integers(1, 15)))
    law = Tresca(random.uniform(0.0, 5.0, body.n_contact))
    problem = ContactProblem(body, random.normal(size=body.n_contact) * 0.3, law)
    exact = solve(problem, LemkePivoting()).state
    driver = AugmentedLagrangian(rho_n=rho_n, rho_t=rho_t)

    def distance(state):
        squares = body.weights @ (state.traction - exact.traction) ** 2
        return squares[0] / (2 * rho_n) + squares[1] / (2 * rho_t)

    iterate = driver.init(problem, problem.sticking_state)
    for _ in range(8):
        before = distance(iterate.state)
        iterate = driver.step(problem, iterate)
        error = (iterate.state.displacement - exact.displacement).ravel()
        energy = error @ body.stiffness @ error
        # round-off of tractions of size 10 to 100, squared over rho
        assert energy <= before - distance(iterate.state) + 1e-10 * max(1.0, before)


def test_a_tie_is_decided_for_stick_in_all_units():
    """One node pressed by p and pulled by exactly s p; then by one unit in the last place more."""
    for unit in (1e-12, 1.0, 3e11):
        for excess, status in ((0.0, NodeStatus.STICK), (1e-3, NodeStatus.SLIP_FORWARD)):
            body = DenseBody(np.eye(2) * unit, np.array([2.0, 1.0 + excess]) * unit, np.ones(1))
            solution = solve(ContactProblem(body, np.zeros(1), Coulomb(0.5)), SemismoothNewton())
            assert solution.node_status.tolist() == [status]
            assert solution.steps <= 2


def test_a_block_on_the_edge_of_sliding_does_not_cycle():
    problem = block_problem(Coulomb(0.2), is_held_sideways=False, push=0.2)
    solution = solve(problem, SemismoothNewton())
    assert solution.is_converged
    assert problem.body.weights @ solution.state.sigma_t == pytest.approx(-0.1, rel=1e-6)


def test_a_decoupled_tangential_dof_stays_at_rest():
    """Nodes on a roller have a dummy tangential dof with stiffness and without load."""
    body = block_problem(Coulomb(0.5)).body
    stiffness, load = body.stiffness.copy(), body.load.copy()
    for node in (3, 11):
        dof = 2 * node + 1
        stiffness[dof], stiffness[:, dof], load[dof] = 0.0, 0.0, 0.0
        stiffness[dof, dof] = 1.0
    body = DenseBody(stiffness, load, body.weights, body.motions)
    for law in (Coulomb(0.5), Frictionless(), Tresca(0.1)):
        for driver in DRIVERS:
            solution = solve(ContactProblem(body, np.zeros(12), law), driver)
            assert np.all(np.abs(solution.state.u_t[[3, 11]]) <= 1e-12)
            assert np.all(np.abs(solution.state.sigma_t[[3, 11]]) <= 1e-12)


@pytest.mark.parametrize("friction_coefficient", slow_only([0.0, 0.05, 0.5, 2.0, 10.0, 100.0], 0.05, 2.0, 10.0))
def test_newton_needs_few_solves_whatever_the_friction(friction_coefficient):
    problem = block_problem(Coulomb(friction_coefficient), n=24)
    solution = solve(problem, SemismoothNewton())
    assert solution.linear_solves <= 7
    assert_solves(problem, solution.state, friction_coefficient)


@pytest.mark.slow
def test_example_1_on_finite_elements():
    """The paper's first example: separation near 0.2576, change from slip to stick near 0.4676, print 0.26 and 0.47."""
    solution = solve(block_problem(Coulomb(0.5), n=32), SemismoothNewton())
    status = solution.node_status
    n_open, n_slip = np.count_nonzero(status == NodeStatus.SEPARATED), np.count_nonzero(status >= 2)
    assert np.array_equal(status, np.repeat([0, status[n_open], 1], [n_open, n_slip, 32 - n_open - n_slip]))
    # within one element of 1/32, as nodes stand at multiples of it
    assert abs((n_open - 0.5) / 32 - 0.2576) < 1 / 32
    assert abs((n_open + n_slip - 0.5) / 32 - 0.4676) < 1 / 32
    weights = block_problem(Coulomb(0.5), n=32).body.weights
    assert abs(weights @ solution.state.sigma_t) == pytest.approx(0.0821, rel=0.1)  # the node at the roller is left out
