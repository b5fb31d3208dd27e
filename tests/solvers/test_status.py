"""Each status is produced, and no failure passes for a success."""

from dataclasses import replace

import numpy as np
import pytest

from bemkit.contact.body import ContactState, LinearBody, SingularResponse
from bemkit.contact.dense_body import DenseBody
from bemkit.contact.equilibrium import Imbalance
from bemkit.contact.laws import Coulomb, FrictionLaw, LawError
from bemkit.contact.problem import ContactProblem
from bemkit.solvers.alm import AugmentedLagrangian, InnerNewton
from bemkit.solvers.base import ContactFailure, Status, solve
from bemkit.solvers.fallbacks import Fallbacks, SolutionPath, Springs
from bemkit.solvers.fixed_point import FixedPoint
from bemkit.solvers.lemke import LemkePivoting
from bemkit.solvers.ssn import SemismoothNewton
from tests.handmade import Inexact, assert_solves, block_body, block_problem, hard_problem, random_problem
from tests.slow import slow_only


class OnlyClamped(LinearBody):
    """A body that responds to prescribed displacements and to nothing else."""

    weights = np.ones(2)
    stiffness_scale = 1.0

    def __init__(self, *, never=False):
        self.never = never

    def respond(self, conditions):
        if self.never or conditions.on_traction.any():
            raise SingularResponse("the sockets are empty")
        return ContactState(conditions.value[:, ::1].copy(), np.array([[1.0, 0.0], [-1.0, 0.0]]))

    def imbalance(self, state):
        return Imbalance(0.0, 0.0)


def overflowing_problem():
    """Load and compliance beyond the range of floating point together."""
    body = DenseBody(np.eye(2) * 1e-200, np.array([-1e200, 0.0]), np.ones(1))
    return ContactProblem(body, np.zeros(1), Coulomb(0.1))


class Unbalanced(DenseBody):
    """A body whose forces are never in equilibrium, whatever the contact does."""

    def imbalance(self, state):
        return Imbalance(1e-6, 0.0)


def unbalanced_problem():
    body = block_problem(Coulomb(0.5)).body
    return ContactProblem(
        Unbalanced(body.stiffness, body.load, body.weights, body.motions), np.zeros(body.n_contact), Coulomb(0.5)
    )


class Unaware(DenseBody):
    """A body that does not compare its volume with the gaps."""

    def lacks_room(self, gap):
        return False


def enclosed_problem(kind):
    """Two nodes that forces press to their obstacles, on a body of constant volume, whose pressure is unknown."""
    stiffness = np.diag([2.0, 1.0, 2.0, 1.0, 0.0])
    stiffness[4, [0, 2]] = stiffness[[0, 2], 4] = 1.0
    body = kind(stiffness, np.array([1.0, 0.0, 1.0, 0.0, 0.0]), np.ones(2), n_pressures=1)
    return ContactProblem(body, np.full(2, -1e-3), Coulomb(0.1))


CASES = {
    "converged": (Status.CONVERGED, random_problem(0), SemismoothNewton(), {}),
    "max steps": (Status.MAX_STEPS, block_problem(Coulomb(0.5)), AugmentedLagrangian(), {"max_steps": 1}),
    "max steps, none": (Status.MAX_STEPS, block_problem(Coulomb(0.5)), SemismoothNewton(), {"max_steps": 0}),
    "stalled, few steps": (
        Status.STALLED,
        block_problem(Coulomb(0.5)),
        Fallbacks((SemismoothNewton(max_steps=2),)),
        {},
    ),
    "stalled, tiny rho": (Status.STALLED, block_problem(Coulomb(0.5)), AugmentedLagrangian(rho_n=1e-4, rho_t=1e-4), {}),
    "stalled, fixed point": (Status.STALLED, hard_problem(71), FixedPoint(), {}),
    "stalled, tolerance below round-off": (
        Status.STALLED,
        block_problem(Coulomb(0.5)),
        AugmentedLagrangian(),
        {"tolerance": 1e-30},
    ),
    "stalled, nothing left to do": (Status.STALLED, unbalanced_problem(), SemismoothNewton(), {}),
    "cycling, newton": (Status.CYCLING, hard_problem(120), SemismoothNewton(), {}),
    "cycling, fixed point": (Status.CYCLING, hard_problem(11), FixedPoint(), {}),
    "cycling, augmented": (Status.CYCLING, hard_problem(11), AugmentedLagrangian(), {}),
    "singular at the start": (
        Status.SINGULAR,
        ContactProblem(OnlyClamped(never=True), np.zeros(2), Coulomb(0.1)),
        SemismoothNewton(),
        {},
    ),
    "singular later": (
        Status.SINGULAR,
        ContactProblem(OnlyClamped(), np.zeros(2), Coulomb(0.1)),
        SemismoothNewton(),
        {},
    ),
    "closed volume": (Status.CLOSED_VOLUME, enclosed_problem(DenseBody), SemismoothNewton(), {}),
    "closed volume, later": (Status.CLOSED_VOLUME, enclosed_problem(Unaware), SemismoothNewton(), {}),
    "unsolvable load": (Status.UNSOLVABLE_LOAD, block_problem(Coulomb(0.5), press=-1.0), SemismoothNewton(), {}),
    "too far": (
        Status.TOO_FAR,
        replace(block_problem(Coulomb(0.5)), gap=np.full(12, 1e12)),
        SemismoothNewton(),
        {},
    ),
    "inner failed, augmented": (
        Status.INNER_FAILED,
        block_problem(Coulomb(0.5)),
        AugmentedLagrangian(inner=InnerNewton(max_steps=1)),
        {},
    ),
    "inner failed, fixed point": (
        Status.INNER_FAILED,
        block_problem(Coulomb(0.5)),
        FixedPoint(inner=SemismoothNewton(max_steps=1)),
        {},
    ),
    "not finite": (Status.NOT_FINITE, overflowing_problem(), SemismoothNewton(), {}),
    "singular stiffness, lemke": (
        Status.SINGULAR,
        ContactProblem(DenseBody(np.diag([1.0, 0.0]), np.array([1.0, 1.0]), np.ones(1)), np.zeros(1), Coulomb(0.1)),
        LemkePivoting(),
        {},
    ),
    "too costly": (
        Status.TOO_COSTLY,
        ContactProblem(Inexact(block_body(n=3), responses_are_expensive=True), np.zeros(3), Coulomb(0.5)),
        LemkePivoting(),
        {},
    ),
}


@pytest.mark.parametrize("name", slow_only(CASES, "stalled, tiny rho", "stalled, fixed point", "cycling, augmented"))
def test_status(name):
    status, problem, driver, options = CASES[name]
    solution = solve(problem, driver, throw=False, **options)
    assert solution.status is status
    assert solution.message.startswith(status.value)
    assert solution.is_converged == (status is Status.CONVERGED)
    if status is Status.CONVERGED:
        assert_solves(problem, solution.state, problem.law.friction_coefficient)
        return
    assert not solution.certificate.is_below(options.get("tolerance", 1e-9))
    with pytest.raises(ContactFailure, match=f"^{status.name}: ") as caught:
        solve(problem, driver, **options)
    assert caught.value.solution.status is status


def test_every_status_has_a_case():
    # `run` alone judges energies, estimates, load steps and places between nodes: tests/model/test_energy.py,
    # tests/adaptive, tests/runs, tests/results/test_missed_contact.py
    by_run = {
        Status.NEGATIVE_ENERGY,
        Status.ACCURACY_NOT_REACHED,
        Status.UNFINISHED,
        Status.LOAD_NOT_REACHED,
        Status.MISSED_CONTACT,
        Status.FINITE_SLIDING,
    }
    assert {case[0] for case in CASES.values()} == set(Status) - by_run


@pytest.mark.parametrize(
    ("case", "words"),
    [
        ("stalled, few steps", "SemismoothNewton: no solution after 2 steps"),
        ("cycling, newton", "the active sets come back"),
        ("stalled, nothing left to do", "the rest of the certificate is beyond this driver"),
        ("singular later", "the sockets are empty"),
        ("singular at the start", "the sockets are empty"),
        ("unsolvable load", "the load pushes the body away from the obstacle"),
        ("too far", "times the deformation"),
        ("inner failed, augmented", "inner Newton iteration unfinished after 1 linear solve"),
        ("inner failed, fixed point", "Tresca problem of this step: MAX_STEPS"),
        ("singular stiffness, lemke", "motions that are not listed as rigid"),
    ],
)
def test_messages_name_the_reason(case, words):
    _, problem, driver, options = CASES[case]
    assert words in solve(problem, driver, throw=False, **options).message


@pytest.mark.parametrize("far", [1e8, 1e12])
def test_only_an_obstacle_that_the_load_needs_is_too_far(far):
    """A distant obstacle does not matter where a near one holds the load, and is not blamed for other failures."""
    problem = block_problem(Coulomb(0.5))
    gap = np.where(np.arange(12) < 6, far, 0.0)
    assert solve(replace(problem, gap=gap), SemismoothNewton()).is_converged
    steps = {"max_steps": 0, "throw": False}
    assert solve(replace(problem, gap=gap), AugmentedLagrangian(rho_n=1e-4), **steps).status is Status.MAX_STEPS
    stalled = solve(replace(problem, gap=gap), AugmentedLagrangian(inner=InnerNewton(max_steps=1)), throw=False)
    assert stalled.status is Status.INNER_FAILED


@pytest.mark.parametrize("seed", [11, 16, 71, 120, 245, 397, 479])
def test_fallbacks_solve_what_others_fail_on(seed):
    problem = hard_problem(seed)
    assert_solves(problem, solve(problem, Fallbacks()).state, 2.0)


@pytest.mark.parametrize("driver", [AugmentedLagrangian(), FixedPoint()], ids=repr)
def test_large_friction_on_real_stiffness_is_no_trouble(driver):
    problem = block_problem(Coulomb(5.0))
    assert_solves(problem, solve(problem, driver).state, 5.0)


class Broken(FrictionLaw):
    """Fails as soon as it meets pressure."""

    def bound(self, sigma_n):
        if sigma_n.any():
            raise KeyError("temperature")
        return np.zeros_like(sigma_n)

    def bound_derivative(self, sigma_n):
        return np.zeros_like(sigma_n)


@pytest.mark.parametrize("driver", [SemismoothNewton(), AugmentedLagrangian(), FixedPoint(), LemkePivoting()], ids=repr)
def test_errors_inside_a_law_surface_with_its_name(driver):
    problem = block_problem(Broken())
    with pytest.raises(LawError, match=r"friction law Broken.bound failed: KeyError: 'temperature'"):
        solve(problem, driver, throw=False)


@pytest.mark.parametrize(
    ("make", "complaint"),
    [
        (lambda: SemismoothNewton(rho=0.0), "rho = 0.0; give a positive number"),
        (lambda: SemismoothNewton(max_steps=0), "max_steps = 0; give at least 1"),
        (
            lambda: Fallbacks((SemismoothNewton,)),
            r"drivers contains <class .*>; give solvers, such as SemismoothNewton\(\)",
        ),
        (lambda: Fallbacks(()), r"drivers is empty; give at least one solver, such as SemismoothNewton\(\)"),
        (lambda: SolutionPath(max_steps=0), "max_steps = 0"),
        (lambda: Springs(max_steps=0), "max_steps = 0"),
        (lambda: Springs(first=1e-6), "springs from 1e-06 to 1e-05; give positive numbers, the last not larger"),
        (lambda: AugmentedLagrangian(rho_n=float("inf")), "rho_n = inf"),
        (lambda: AugmentedLagrangian(rho_t=-1.0), "rho_t = -1.0"),
        (lambda: InnerNewton(max_steps=0), "max_steps = 0"),
        (lambda: FixedPoint(inner_tolerance=0.0), "inner_tolerance = 0.0; give a number between 0 and 1"),
        (lambda: FixedPoint(max_steps=0), "max_steps = 0"),
        (lambda: LemkePivoting(max_steps=0), "max_steps = 0"),
        (lambda: solve(random_problem(0), SemismoothNewton(), max_steps=-1), "max_steps = -1"),
        (lambda: solve(random_problem(0), SemismoothNewton(), tolerance=-1.0), "tolerance = -1.0"),
        (lambda: solve(random_problem(0), SemismoothNewton(), tolerance=float("nan")), "tolerance = nan"),
    ],
)
def test_refusals(make, complaint):
    with pytest.raises(ValueError, match=complaint):
        make()


def test_starts_are_checked():
    problem = block_problem(Coulomb(0.5))
    with pytest.raises(ValueError, match="start has 3 nodes; the problem has 12"):
        solve(problem, SemismoothNewton(), start=ContactState(np.zeros((3, 2)), np.zeros((3, 2))))
    with pytest.raises(ValueError, match="start contains entries that are not finite"):
        solve(problem, SemismoothNewton(), start=ContactState(np.full((12, 2), np.nan), np.zeros((12, 2))))


def test_drivers_refuse_each_others_iterates():
    problem = random_problem(0)
    drivers = (SemismoothNewton(), AugmentedLagrangian(), FixedPoint(), Fallbacks(), Springs(), SolutionPath())
    iterate = LemkePivoting().init(problem, problem.sticking_state)
    for driver in drivers:
        with pytest.raises(TypeError, match="iterate is a Iterate; give a result of init or step of this solver"):
            driver.step(problem, iterate)


def test_newton_ends_when_only_the_body_is_out_of_balance():
    """No other driver could improve what is no matter of contact."""
    assert solve(unbalanced_problem(), Fallbacks(), throw=False).linear_solves <= 10
