"""Lemmas 1 and 2 of the paper on `ProjectionEquations.evaluate`, the function that drivers call.

The equations (15), (16) hold exactly for the states that satisfy contact and friction. All solutions of (15) follow
from one number a node, ``z = rho (u - g) - sigma``, and those of (16) likewise: no projection is needed in the test.
"""

import numpy as np
import pytest
from hypothesis import Phase, given, settings
from hypothesis import strategies as st

from bemkit.contact import projection
from bemkit.contact.laws import Coulomb, Tresca
from bemkit.contact.problem import ContactProblem, ContactState
from bemkit.solvers import active_sets
from bemkit.solvers.active_sets import ProjectionEquations
from bemkit.solvers.alm import AugmentedLagrangian
from tests.contact.test_projection import N, numbers, positive, vector
from tests.handmade import block_body, block_problem, random_body

BODY = random_body(np.random.default_rng(0), N)
LAWS = st.one_of(st.builds(Coulomb, st.floats(0.0, 3.0)), st.builds(Tresca, st.floats(0.0, 50.0)))
DRAWN = {"z_n": vector(numbers), "z_t": vector(numbers), "gap": vector(numbers), "rho": positive, "law": LAWS}
ROUND_OFF = 1e-10  # numbers up to 1e4: z / rho with rho from 0.01, times rho up to 100


def solution(problem, z_n, z_t, rho):
    """Return the state with given z that satisfies (6), (7) and (8), case by case, and the nodes that slip."""
    sigma_n = np.minimum(-z_n, 0.0)  # pressed where z > 0, open elsewhere: condition (6)
    u_n = problem.gap + np.minimum(z_n, 0.0) / rho
    bound = problem.friction_bound(sigma_n, z_n > 0.0)
    slips = np.abs(z_t) > bound  # conditions (7), (8)
    sigma_t = np.where(slips, -bound * np.sign(z_t), -z_t)
    u_t = np.where(slips, z_t - bound * np.sign(z_t), 0.0) / rho
    return ContactState(np.column_stack([u_n, u_t]), np.column_stack([sigma_n, sigma_t])), slips


def check_lemmas_forward(z_n, z_t, gap, rho, law):
    """States of contact and friction satisfy (15), (16), and their sets are A_n, S_n, A_t, S_t."""
    problem = ContactProblem(BODY, gap, law)
    state, slips = solution(problem, z_n, z_t, rho)
    residual = ProjectionEquations(problem, rho, rho).evaluate(state)
    assert np.abs(residual.value).max() <= ROUND_OFF
    clear = np.abs(z_n) > 1e-9
    assert np.array_equal(residual.sets.is_closed[clear], (z_n > 0.0)[clear])
    clear &= np.abs(np.abs(z_t) - residual.bound) > 1e-9
    assert np.array_equal(residual.sets.direction[clear], np.where(slips, np.sign(z_t), 0.0)[clear])


@given(**DRAWN)
def test_lemmas_1_and_2_forward(z_n, z_t, gap, rho, law):
    check_lemmas_forward(z_n, z_t, gap, rho, law)


@given(**DRAWN, error=st.sampled_from([-1.0, -1e-3, 1e-3, 1.0]), component=st.integers(0, 1))
def test_lemmas_1_and_2_backward(z_n, z_t, gap, rho, law, error, component):
    """For one z only one traction solves the equations: with z kept, another traction leaves its difference."""
    problem = ContactProblem(BODY, gap, law)
    state, _ = solution(problem, z_n, z_t, rho)
    wrong = error * np.eye(2)[component]
    moved = ContactState(state.displacement + wrong / rho, state.traction + wrong)
    value = ProjectionEquations(problem, rho, rho).evaluate(moved).value
    assert np.allclose(value[:, component], error, atol=ROUND_OFF)


WRONG_PARTS = {
    "identity": lambda a: a,
    "absolute value": np.abs,
    "half slope": lambda a: 0.5 * np.maximum(a, 0.0),
    "leak": lambda a: np.where(a > 0.0, a, 1e-6 * a),
}
WRONG_CLIPS = {
    "identity": lambda x, bound: x,
    "zero": lambda x, bound: np.zeros_like(x),
    "0.999 bound": lambda x, bound: projection.clip_to_bound(x, 0.999 * bound),
}


@pytest.mark.parametrize(
    ("name", "wrong"),
    [("positive_part", wrong) for wrong in WRONG_PARTS.values()]
    + [("clip_to_bound", wrong) for wrong in WRONG_CLIPS.values()],
    ids=[*WRONG_PARTS, *(f"clip: {name}" for name in WRONG_CLIPS)],
)
def test_the_forward_lemmas_catch_each_wrong_projection(name, wrong, monkeypatch):
    monkeypatch.setattr(active_sets, name, wrong)

    @settings(database=None, phases=[Phase.generate])
    @given(**DRAWN)
    def check(z_n, z_t, gap, rho, law):
        check_lemmas_forward(z_n, z_t, gap, rho, law)

    with pytest.raises(AssertionError):
        check()


@pytest.mark.parametrize("rho", [1.0, 1e2, 1e4])
def test_a_step_of_algorithm_1_satisfies_step_1(rho):
    """sigma_n^(k+1) = -[rho (u_n - g) - sigma_n^(k)]_+ and likewise along the tangent, with the bound of sigma^(k)."""
    problem = block_problem(Coulomb(0.5))
    driver = AugmentedLagrangian(rho_n=rho, rho_t=rho)
    iterate = driver.init(problem, problem.sticking_state)
    for _ in range(5):
        before, iterate = iterate.state, driver.step(problem, iterate)
        z = rho * (iterate.state.displacement - np.column_stack([problem.gap, problem.slip_origin])) - before.traction
        bound = 0.5 * np.maximum(-before.sigma_n, 0.0)
        found = np.column_stack([-np.maximum(z[:, 0], 0.0), -np.clip(z[:, 1], -bound, bound)])
        # round-off of displacements of size 1, times rho
        assert np.abs(iterate.state.traction - found).max() <= 1e-12 * (1.0 + rho)


@pytest.mark.parametrize("rho", [3.0, 1e2, 1e4])
def test_theorem_1_algorithm_1_converges_for_a_given_friction_bound_on_a_floating_body(rho):
    """The block of Example 1 floats vertically. The theorem is on Tresca's law; Coulomb's is not covered."""
    body = block_body()
    assert body.rigid_motions().shape[0] > 0
    problem = ContactProblem(body, np.zeros(body.n_contact), Tresca(0.1))
    driver = AugmentedLagrangian(rho_n=rho, rho_t=rho)
    iterate, errors = driver.init(problem, problem.sticking_state), []
    limit = problem.sticking_state
    for _ in range(400):
        iterate = driver.step(problem, iterate)
        errors.append(float(np.abs(iterate.state.traction - limit.traction).max()))
        limit = iterate.state
        if errors[-1] <= 1e-11:
            break
    assert errors[-1] <= 1e-9
    exact = ProjectionEquations(problem, 1.0, 1.0).evaluate(iterate.state)
    assert np.abs(exact.value).max() <= 1e-8
