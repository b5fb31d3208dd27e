"""The loop: history, callback, starts; floating bodies; the path; metamorphic properties."""

import itertools
from functools import cache

import numpy as np
import pytest

from bemkit.contact.body import ContactState
from bemkit.contact.certificate import certify
from bemkit.contact.dense_body import DenseBody
from bemkit.contact.further_laws import CohesiveCoulomb
from bemkit.contact.laws import Coulomb, Frictionless, Tresca
from bemkit.contact.problem import ContactProblem
from bemkit.solvers import lemke as lemke_solver
from bemkit.solvers.active_sets import ActiveSets, NodeStatus, contact_sets
from bemkit.solvers.alm import AugmentedLagrangian, BoundUpdate
from bemkit.solvers.base import solve
from bemkit.solvers.fallbacks import Fallbacks
from bemkit.solvers.fixed_point import FixedPoint
from bemkit.solvers.homotopy import AffineBound, follow_path, why_no_path
from bemkit.solvers.lemke import LemkePivoting, lemke
from bemkit.solvers.multistart import start_with
from bemkit.solvers.ssn import SemismoothNewton
from tests.contact.test_laws import Rubber
from tests.handmade import assert_solves, block_body, block_problem, hard_problem, random_problem
from tests.slow import slow_except

OUTER = [AugmentedLagrangian(), AugmentedLagrangian(bound=BoundUpdate.CURRENT), FixedPoint()]
DRIVERS = [SemismoothNewton(), Fallbacks(), *OUTER]


def test_history_and_callback_tell_the_same_true_story():
    problem = block_problem(Coulomb(0.5))
    seen = []
    solution = solve(problem, AugmentedLagrangian(), callback=seen.append)
    assert tuple(seen) == solution.history
    assert [record.step for record in seen] == list(range(solution.steps + 1))
    assert seen[0].relative_change == np.inf
    assert seen[0].linear_solves == 1
    assert seen[-1].linear_solves == solution.linear_solves
    assert seen[-1].certificate == solution.certificate == certify(problem, solution.state)
    assert all(later.linear_solves > sooner.linear_solves for sooner, later in itertools.pairwise(seen))
    for record in seen:
        assert record.n_separated + record.n_stick + record.n_slip == problem.n_contact
    counts = np.bincount(solution.node_status, minlength=4)
    assert (seen[-1].n_separated, seen[-1].n_stick, seen[-1].n_slip) == (counts[0], counts[1], counts[2] + counts[3])
    assert seen[1].n_changed > 0
    assert seen[-1].n_changed == 0


def test_the_papers_stopping_quantity_is_recorded():
    """Its first step below 1e-8 counts the outer steps of the paper's tables: many at small rho, then a constant."""
    problem = block_problem(Coulomb(0.5), n=24)
    steps = []
    for rho in (30.0, 1e3, 1e4, 1e5):  # the block has E = 1 and unit length
        history = solve(problem, AugmentedLagrangian(rho_n=rho, rho_t=rho), tolerance=1e-13, throw=False).history
        steps.append(next(record.step for record in history if record.relative_change <= 1e-8))
    assert 15 <= steps[0] <= 30  # print: 25
    assert all(8 <= step <= 14 for step in steps[1:])  # print: 13
    assert steps[0] > steps[1] + 3
    assert max(steps[1:]) - min(steps[1:]) <= 1


def test_differentiating_the_bound_saves_outer_steps():
    problem = block_problem(Coulomb(1.0), n=24)
    lagged, current = (solve(problem, AugmentedLagrangian(bound=bound)) for bound in BoundUpdate)
    assert current.steps <= 6 < lagged.steps


@pytest.mark.parametrize("driver", DRIVERS, ids=repr)
def test_a_solution_is_its_own_start(driver):
    problem = block_problem(Coulomb(0.5))
    solution = solve(problem, SemismoothNewton())
    again = solve(problem, driver, start=solution.state)
    assert again.steps == 0
    assert again.linear_solves == 1
    # a start that is in no equilibrium is not believed, though it violates no contact condition
    rest = ContactState(np.zeros((12, 2)), np.zeros((12, 2)))
    assert solve(problem, driver, start=rest).steps > 0


@pytest.mark.parametrize("driver", [*DRIVERS, LemkePivoting()], ids=repr)
@pytest.mark.parametrize("status", slow_except(NodeStatus, NodeStatus.SLIP_FORWARD), ids=lambda status: status.name)
def test_a_floating_block_from_any_start(driver, status):
    """All open, all sliding: the tangent is singular, springs help, and the result is right."""
    problem = block_problem(Coulomb(0.5), is_held_sideways=False, push=0.1)
    solution = solve(problem, driver, start=start_with(problem, [status] * problem.n_contact))
    assert_solves(problem, solution.state, 0.5)
    assert problem.body.weights @ solution.state.traction == pytest.approx([-0.5, -0.05])


@pytest.mark.parametrize("driver", DRIVERS, ids=repr)
@pytest.mark.parametrize("distance", slow_except([0.1, 1e3, 1e6], 1e6))
def test_a_block_far_from_its_foundation_falls_and_lands(driver, distance):
    landed = plain_solution(0, driver)
    body = block_body()
    far = solve(ContactProblem(body, np.full(12, distance), Coulomb(0.5)), driver)
    assert np.array_equal(far.node_status, landed.node_status)
    # displacements of 1e6 leave 1e-10 of round-off, times a stiffness of about 10
    assert np.allclose(far.state.traction, landed.state.traction, atol=1e-7)


@pytest.mark.parametrize("driver", DRIVERS, ids=repr)
def test_a_free_direction_without_load_is_left_where_it_is(driver):
    problem = block_problem(Frictionless(), is_held_sideways=False, push=0.0)
    solution = solve(problem, driver)
    assert_solves(problem, solution.state, 0.0)
    assert np.abs(solution.state.u_t).max() < 1.0


def test_certificate_and_statuses_are_those_of_the_state_with_the_least_slip():
    """A block without friction may be anywhere; which way its nodes slip is that of the position chosen."""
    problem = block_problem(Frictionless(), is_held_sideways=False, push=0.0)
    far = problem.sticking_state
    far = ContactState(far.displacement + np.array([0.0, 3.0]), far.traction)
    solution = solve(problem, SemismoothNewton(), start=far)
    assert solution.certificate == certify(problem, solution.state)
    assert np.array_equal(solution.node_status, contact_sets(problem, solution.state).node_status)
    assert {NodeStatus.SLIP_FORWARD, NodeStatus.SLIP_BACKWARD} <= set(solution.node_status)
    assert solution.history[-1].certificate != solution.certificate  # it was moved after the last step


@pytest.mark.parametrize(
    "law",
    [Rubber(), CohesiveCoulomb(0.5, 0.02, 0.2), CohesiveCoulomb(0.5, 0.0, 0.1)],
    ids=["rubber", "cohesion and cap", "cap"],
)
def test_nonlinear_laws(law):
    problem = block_problem(law)
    states = [solve(problem, driver).state for driver in DRIVERS]
    for state in states[1:]:
        assert np.allclose(state.traction, states[0].traction, atol=1e-7 * np.abs(states[0].traction).max())
    closed = states[0].sigma_n < 0.0
    assert np.all(np.abs(states[0].sigma_t[closed]) <= law.bound(states[0].sigma_n)[closed] + 1e-12)
    assert np.any(np.abs(states[0].u_t[closed]) > 1e-3)


def test_an_overlap_is_pressed_out_without_any_load():
    """Shrink fit: zero load, negative gap."""
    body = DenseBody(np.diag([2.0, 1.0]), np.zeros(2), np.array([0.5]))
    for driver in DRIVERS:
        solution = solve(ContactProblem(body, np.array([-0.3]), Coulomb(0.5)), driver)
        # the augmented Lagrangian stops at a certificate of 1e-9
        assert solution.state.displacement == pytest.approx(np.array([[-0.3, 0.0]]), abs=1e-8)
        assert solution.state.traction == pytest.approx(np.array([[-1.2, 0.0]]), abs=1e-8)


# ----------------------------------------------------------------------------------------------------------- the path


@pytest.mark.parametrize("seed", slow_except(range(40), *range(4)))
def test_the_path_leads_to_a_solution_whatever_the_friction(seed):
    problem = hard_problem(seed, n_most=20, condition=1e3, friction_coefficient=5.0)
    end = follow_path(problem, AffineBound.tangent(problem, np.zeros(problem.n_contact)))
    assert_solves(problem, end.state, 5.0)
    assert end.linear_solves == 2 * end.n_segments
    assert end.n_segments <= 10 * problem.n_contact  # usually 1.5 n_contact


def test_the_path_goes_to_tresca_solutions_with_open_sticking_nodes():
    body = DenseBody(np.eye(4), np.array([-1.0, 0.2, -1.0, 2.0]), np.ones(2))
    problem = ContactProblem(body, np.zeros(2), Tresca(0.5))
    end = follow_path(problem, AffineBound.tangent(problem, np.zeros(2)))
    assert np.allclose(end.state.displacement, [[-1.0, 0.0], [-1.0, 1.5]])
    assert np.allclose(end.state.traction, [[0.0, -0.2], [0.0, -0.5]])
    assert not why_no_path(problem)


def test_the_path_reports_its_ends():
    problem = hard_problem(16)
    bound = AffineBound.tangent(problem, np.zeros(problem.n_contact))
    assert follow_path(problem, bound, max_segments=1).reason == "the path has more than 1 segments"
    assert follow_path(problem, bound, max_segments=1).state is None
    lifting = block_problem(Coulomb(0.5), press=-1.0)
    end = follow_path(lifting, AffineBound.tangent(lifting, np.zeros(12)))
    assert end.state is None
    assert "singular response" in end.reason or "does not return" in end.reason
    assert why_no_path(block_problem(CohesiveCoulomb(0.5, 0.1)))


@cache
def path_from_open_nodes(seed):
    """A random problem at moderate friction, with its affine bound and the path from all nodes open."""
    problem = hard_problem(seed, n_most=20, condition=1e3, friction_coefficient=0.5)
    bound = AffineBound.tangent(problem, np.zeros(problem.n_contact))
    is_closed, direction = np.zeros(problem.n_contact, bool), np.zeros(problem.n_contact, np.intp)
    return problem, bound, follow_path(problem, bound, ActiveSets(is_closed, direction))


@pytest.mark.parametrize("seed", slow_except(range(40), *range(4)))
def test_a_path_from_nearby_statuses_is_short_and_leads_to_a_solution(seed):
    """From the statuses of a solution, from these with one node changed, and from all nodes open."""
    problem, bound, opened = path_from_open_nodes(seed)
    solution = follow_path(problem, bound).state
    sets = contact_sets(problem, solution)
    unchanged = follow_path(problem, bound, sets)
    assert unchanged.n_segments == 1
    assert np.allclose(unchanged.state.displacement, solution.displacement)
    node = seed % problem.n_contact
    is_closed, direction = sets.is_closed.copy(), sets.direction.copy()
    is_closed[node] = not is_closed[node]
    direction[node] = 0
    end = follow_path(problem, bound, ActiveSets(is_closed, direction))
    if end.state is not None:  # there is no promise of an end
        assert_solves(problem, end.state, 0.5)
        assert end.n_segments <= 20
    if opened.state is not None:
        assert_solves(problem, opened.state, 0.5)


@pytest.mark.slow
def test_most_paths_from_nearby_statuses_end():
    assert np.mean([path_from_open_nodes(seed)[2].state is not None for seed in range(40)]) > 0.9


def test_statuses_that_do_not_hold_the_body_begin_no_path():
    problem = block_problem(Coulomb(0.5))
    bound = AffineBound.tangent(problem, np.zeros(12))
    end = follow_path(problem, bound, ActiveSets(np.zeros(12, bool), np.zeros(12, np.intp)))
    assert end.state is None
    assert "leave a rigid motion free: hold the body by a support" in end.reason


# ------------------------------------------------------------------------------------------------------- metamorphic


def fingerprint(solution):
    return solution.node_status.tolist(), solution.steps, solution.linear_solves


SUBJECTS = [block_problem(Coulomb(0.5)), random_problem(5)]


@cache
def plain_solution(subject, driver):
    return solve(SUBJECTS[subject], driver)


@pytest.mark.parametrize("driver", [*DRIVERS, LemkePivoting()], ids=repr)
@pytest.mark.parametrize("subject", range(2))
@pytest.mark.parametrize(
    ("length", "stress"),
    slow_except([(1e-12, 1.0), (1e12, 1.0), (1.0, 1e-12), (1.0, 1e12), (1e12, 1e-12)], (1.0, 1e12)),
)
def test_units(driver, subject, length, stress):
    """Lengths by c, stresses by c: the same sets after the same number of steps and linear solves."""
    problem = SUBJECTS[subject]
    body = problem.body
    scaled_body = DenseBody(body.stiffness * stress / length, body.load * stress, body.weights, body.motions)
    scaled = solve(ContactProblem(scaled_body, problem.gap * length, problem.law), driver)
    plain = plain_solution(subject, driver)
    assert fingerprint(scaled) == fingerprint(plain)
    assert np.allclose(scaled.state.displacement / length, plain.state.displacement, atol=1e-8)
    assert np.allclose(scaled.state.traction / stress, plain.state.traction, atol=1e-8)


def transformed(problem, order, tangent_sign):
    """The problem with its nodes renumbered and its tangents reversed."""
    body = problem.body
    dofs = np.stack([2 * order, 2 * order + 1], axis=1).ravel()
    sign = np.tile([1.0, tangent_sign], len(order))
    stiffness = sign[:, None] * body.stiffness[np.ix_(dofs, dofs)] * sign
    motions = body.rigid_motions()[:, order] * [1.0, tangent_sign]
    other = DenseBody(stiffness, sign * body.load[dofs], body.weights[order], motions)
    return ContactProblem(other, problem.gap[order], problem.law)


@pytest.mark.parametrize("driver", DRIVERS, ids=repr)
@pytest.mark.parametrize("subject", range(2))
@pytest.mark.parametrize("tangent_sign", [1.0, -1.0])
def test_reflection_and_renumbering(driver, subject, tangent_sign):
    problem = SUBJECTS[subject]
    order = np.random.default_rng(7).permutation(problem.n_contact)
    plain, other = plain_solution(subject, driver), solve(transformed(problem, order, tangent_sign), driver)
    expected = plain.node_status[order]
    if tangent_sign < 0.0:
        expected = np.array([0, 1, 3, 2])[expected]
    assert (other.node_status.tolist(), other.steps, other.linear_solves) == (
        expected.tolist(),
        plain.steps,
        plain.linear_solves,
    )
    assert np.allclose(other.state.traction, plain.state.traction[order] * [1.0, tangent_sign], atol=1e-8)


# ------------------------------------------------------------------------------------------------------------- lemke


def test_lemke_on_known_problems(monkeypatch):
    matrix, vector = np.array([[2.0, 1.0], [1.0, 2.0]]), np.array([-5.0, -6.0])
    assert np.allclose(lemke(matrix, vector)[0], [4 / 3, 7 / 3])
    assert np.array_equal(lemke(matrix, -vector)[0], [0.0, 0.0])
    assert lemke(np.array([[-1.0]]), np.array([-1.0]))[0] is None  # -z - 1 >= 0 has no solution
    monkeypatch.setattr(lemke_solver, "_MOST_PIVOTS", 0)
    assert lemke(matrix, vector)[0] is None
