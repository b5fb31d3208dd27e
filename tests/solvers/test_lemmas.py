"""Lemmas 1 to 4 and Theorem 1 of the paper on `ProjectionEquations.evaluate`, the function that solvers call.

All solutions of (15) follow from one number a node, ``z = rho (u_n - g) - sigma_n``, and those of (16) from one number
or vector: the tests cover all of them and need no projection of their own. A plane body has one tangent; the lemmas for
tangential vectors are tested on `clip_to_bound`, which `evaluate` calls.
"""

import numpy as np
import pytest
from hypothesis import Phase, given, settings
from hypothesis import strategies as st

from bemkit.contact.body import ContactState
from bemkit.contact.laws import Coulomb, Tresca
from bemkit.contact.problem import ContactProblem
from bemkit.model.model import build_model
from bemkit.model.prepared import prepare
from bemkit.solvers import active_sets
from bemkit.solvers.active_sets import ProjectionEquations, clip_to_bound
from bemkit.solvers.alm import AugmentedLagrangian
from bemkit.solvers.base import solve
from bemkit.solvers.ssn import SemismoothNewton
from tests.handmade import block_problem, random_body
from tests.scenes import small_paper_scene
from tests.slow import slow_only
from tests.solvers.test_projection import N, bounds, numbers, pairs, positive, vector

BODY = random_body(np.random.default_rng(0), N)
LAWS = st.one_of(st.builds(Coulomb, st.floats(0.0, 3.0)), st.builds(Tresca, st.floats(0.0, 50.0)))
DRAWN = {"z_n": vector(numbers), "z_t": vector(numbers), "gap": vector(numbers), "rho": positive, "law": LAWS}
STEPS = vector(st.one_of(st.just(0.0), numbers))
ROUND_OFF = 1e-10  # numbers up to 1e4: z / rho with rho from 0.01, times rho up to 100
SQUARED = 1e-9  # products of two numbers up to 200


def solution(problem, z_n, z_t, rho):
    """Return the state with given z that satisfies (6), (7) and (8), case by case, and the nodes that slip."""
    sigma_n = np.minimum(-z_n, 0.0)  # pressed where z > 0, open elsewhere: condition (6)
    u_n = problem.gap + np.minimum(z_n, 0.0) / rho
    bound = problem.friction_bound(sigma_n, z_n > 0.0)
    slips = np.abs(z_t) > bound  # conditions (7), (8)
    sigma_t = np.where(slips, -bound * np.sign(z_t), -z_t)
    u_t = np.where(slips, z_t - bound * np.sign(z_t), 0.0) / rho
    return ContactState(np.column_stack([u_n, u_t]), np.column_stack([sigma_n, sigma_t])), slips


def check_lemmas_1_and_2(z_n, z_t, gap, rho, law):
    """States of contact and friction satisfy (15), (16), and their sets are A_n, S_n, A_t, S_t."""
    problem = ContactProblem(BODY, gap, law)
    state, slips = solution(problem, z_n, z_t, rho)
    residual = ProjectionEquations(problem, rho, rho).evaluate(state)
    assert np.abs(residual.value).max() <= ROUND_OFF
    clear = np.abs(z_n) > 1e-9
    assert np.array_equal(residual.sets.is_closed[clear], (z_n > 0.0)[clear])
    clear &= np.abs(np.abs(z_t) - residual.bound) > 1e-9
    assert np.array_equal(residual.sets.direction[clear], np.where(slips, np.sign(z_t), 0.0)[clear])


def check_lemmas_3_and_4(z_n, z_t, gap, rho, law, step_n, step_t):
    """(35) and (36) at each node: what Step 1 returns for z against a solution, with the friction bound of both."""
    problem = ContactProblem(BODY, gap, law)
    exact, _ = solution(problem, z_n, z_t, rho)
    bound = problem.friction_bound(exact.sigma_n, z_n > 0.0)
    steps = np.column_stack([step_n, step_t])  # of z from the solution to the iterate; zero is among them
    equations = ProjectionEquations(problem, rho, rho, multiplier=exact.traction - steps, given_bound=bound)
    untracted = ContactState(exact.displacement, np.zeros((N, 2)))
    change = -equations.evaluate(untracted).value - exact.traction  # sigma^(k+1) - sigma*
    assert np.all(-change * steps >= change**2 - SQUARED)


@given(**DRAWN)
def test_lemmas_1_and_2_forward(z_n, z_t, gap, rho, law):
    check_lemmas_1_and_2(z_n, z_t, gap, rho, law)


@given(**DRAWN, error=st.sampled_from([-1.0, -1e-3, 1e-3, 1.0]), component=st.integers(0, 1))
def test_lemmas_1_and_2_backward(z_n, z_t, gap, rho, law, error, component):
    """For one z only one traction solves the equations: with z kept, another traction leaves its difference."""
    problem = ContactProblem(BODY, gap, law)
    state, _ = solution(problem, z_n, z_t, rho)
    wrong = error * np.eye(2)[component]
    moved = ContactState(state.displacement + wrong / rho, state.traction + wrong)
    value = ProjectionEquations(problem, rho, rho).evaluate(moved).value
    assert np.allclose(value[:, component], error, atol=ROUND_OFF)


@given(**DRAWN, step_n=STEPS, step_t=STEPS)
def test_lemmas_3_and_4(z_n, z_t, gap, rho, law, step_n, step_t):
    check_lemmas_3_and_4(z_n, z_t, gap, rho, law, step_n, step_t)


def vector_solution(z, bound):
    """Return slip times rho and traction (N, 2) with given ``z = rho u_t - sigma_t`` that satisfy (7) and (8)."""
    length = np.hypot(*z.T)
    slips = length > bound
    unit = z / np.where(slips, length, 1.0)[:, None]
    traction = np.where(slips[:, None], -bound[:, None] * unit, -z)
    return z + traction, traction


def check_vectors(z, bound, step, clip=clip_to_bound):
    """(16), and (36) at each node, for tangential vectors."""
    slip, traction = vector_solution(z, bound)
    assert np.abs(traction + clip(slip - traction, bound)).max() <= ROUND_OFF
    change = -clip(z + step, bound) - traction
    assert np.all(np.sum(-change * step, axis=1) >= np.sum(change**2, axis=1) - SQUARED)


VECTORS = {"z": pairs(numbers), "bound": vector(bounds), "step": pairs(st.one_of(st.just(0.0), numbers))}


@given(**VECTORS)
def test_lemmas_2_and_4_for_vectors(z, bound, step):
    check_vectors(z, bound, step)


@given(z=pairs(numbers), bound=vector(bounds), error=pairs(st.sampled_from([-1.0, 0.0, 1e-3])))
def test_lemma_2_backward_for_vectors(z, bound, error):
    """With z kept, another traction leaves its difference."""
    slip, traction = vector_solution(z, bound)
    value = traction + error + clip_to_bound((slip + error) - (traction + error), bound)
    assert np.allclose(value, error, atol=ROUND_OFF)


WRONG_PARTS = {
    "identity": lambda a: a,
    "absolute value": np.abs,
    "dead zone": lambda a: np.maximum(a - 1e-3, 0.0),
    "offset": lambda a: np.maximum(a, 0.0) + 1e-6,
    "leak": lambda a: np.where(a > 0.0, a, 1e-6 * a),
    "slope": lambda a: 0.999 * np.maximum(a, 0.0),
    "cap": lambda a: np.clip(a, 0.0, 50.0),
}
WRONG_CLIPS = {
    "identity": lambda x, bound: x,
    "half the bound": lambda x, bound: np.clip(x, -0.5 * bound, 0.5 * bound),
    "0.999 bound": lambda x, bound: np.clip(x, -0.999 * bound, 0.999 * bound),
    "slope inside": lambda x, bound: np.clip(0.5 * x, -bound, bound),
    "zero": lambda x, bound: np.zeros_like(x),
}
WRONG_BALLS = WRONG_CLIPS | {
    "square": lambda x, bound: np.clip(x, -bound, bound),
    "direction": lambda x, bound: np.minimum(np.hypot(*x.T)[:, None], bound) * np.array([1.0, 0.0]),
}
CHECKS = {
    "lemmas 1 and 2": (check_lemmas_1_and_2, DRAWN),
    "lemmas 3 and 4": (check_lemmas_3_and_4, DRAWN | {"step_n": STEPS, "step_t": STEPS}),
}


def fails(check, drawn):
    """Whether a property fails for some of the values drawn."""
    property_test = settings(database=None, phases=[Phase.generate])(given(**drawn)(check))
    with pytest.raises(AssertionError):
        property_test()


@pytest.mark.parametrize("lemmas", CHECKS)
@pytest.mark.parametrize(
    ("name", "wrong"),
    [("positive_part", wrong) for wrong in WRONG_PARTS.values()]
    + [("clip_to_bound", wrong) for wrong in WRONG_CLIPS.values()],
    ids=[*WRONG_PARTS, *(f"clip: {name}" for name in WRONG_CLIPS)],
)
def test_each_pair_of_lemmas_by_itself_catches_each_wrong_projection(lemmas, name, wrong, monkeypatch):
    monkeypatch.setattr(active_sets, name, wrong)
    check, drawn = CHECKS[lemmas]
    fails(lambda **values: check(**values), drawn)


@pytest.mark.parametrize("name", WRONG_BALLS)
def test_the_lemmas_for_vectors_catch_each_wrong_projection(name):
    def wrong(x, bound):
        return WRONG_BALLS[name](x, bound[:, None])

    fails(lambda z, bound, step: check_vectors(z, bound, step, wrong), VECTORS)


@given(bounds, bounds)
def test_lemma_4_fails_with_two_bounds(bound, other):
    """Equal arguments outside both balls: the left side is zero, the right side is the squared difference of bounds."""
    z = np.array([[2.0 * (bound + other) + 1.0, 0.0]])
    difference = clip_to_bound(z, other) - clip_to_bound(z, bound)
    left, right = (difference * (z - z)).sum(), (difference * difference).sum()
    assert left == 0.0
    assert right == pytest.approx((bound - other) ** 2)
    assert (left >= right) == ((bound - other) ** 2 == 0.0)  # squares of the smallest numbers are zero


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


@pytest.fixture(scope="module")
def floating():
    """Example 1 by boundary elements under a given friction bound: the block floats vertically."""
    scene = small_paper_scene(1, 64, law=Tresca(0.1))
    problem = build_model(prepare(scene, scene.build_mesh())).problem
    assert problem.body.rigid_motions().shape[0] == 1
    return problem


@pytest.mark.parametrize("rho", slow_only([3.0, 1e2, 1e4], 3.0))
def test_theorem_1_on_a_floating_boundary_element_body(rho, floating):
    """(42) and (46) in every step, and convergence; the theorem is on Tresca's law, Coulomb's is not covered."""
    exact = solve(floating, SemismoothNewton()).state
    driver, weights = AugmentedLagrangian(rho_n=rho, rho_t=rho), floating.body.weights

    def distance(state):
        return float(np.sum(weights @ (state.traction - exact.traction) ** 2)) / (2.0 * rho)

    iterate, errors = driver.init(floating, floating.sticking_state), []
    while len(errors) < 400 and (not errors or errors[-1] > 1e-9):
        before = distance(iterate.state)
        iterate = driver.step(floating, iterate)
        error, difference = iterate.state.displacement - exact.displacement, iterate.state.traction - exact.traction
        energy = float(np.sum(weights @ (difference * error)))  # <S delta, delta> by (42)
        # round-off of tractions of size 1, squared over rho
        assert -1e-12 <= energy <= before - distance(iterate.state) + 1e-10 * max(1.0, before)
        errors.append(float(np.abs(error).max()) / float(np.abs(exact.displacement).max()))
    assert errors[-1] <= 1e-9
