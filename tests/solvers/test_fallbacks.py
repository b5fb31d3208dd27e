"""Drivers one after the other: when they hand on, what they say, what they count, and who takes part."""

from dataclasses import dataclass, replace

import numpy as np

from bemkit.contact.certificate import certify
from bemkit.contact.further_laws import CohesiveCoulomb
from bemkit.contact.laws import Coulomb
from bemkit.contact.problem import ContactProblem
from bemkit.solvers.base import Iterate, Status, solve
from bemkit.solvers.fallbacks import Fallbacks, SolutionPath, Springs, drivers_at_work
from bemkit.solvers.fixed_point import FixedPoint
from bemkit.solvers.lemke import LemkePivoting
from bemkit.solvers.ssn import SemismoothNewton
from bemkit.testing import check_solver
from tests.contact.joined.blocks import arch
from tests.handmade import assert_solves, block_problem, hard_problem


@dataclass(frozen=True)
class Idle:
    """Takes its steps without changing anything, by three linear solves each and one in `init`."""

    max_steps: int = 2

    def init(self, problem, start):
        return Iterate(state=start, linear_solves=1)

    def step(self, problem, iterate):
        return replace(iterate, linear_solves=iterate.linear_solves + 3)


@dataclass(frozen=True)
class Overflowing(Idle):
    """Its displacements are undefined after the first step."""

    def step(self, problem, iterate):
        undefined = replace(iterate.state, displacement=np.full((problem.n_contact, 2), np.nan))
        return replace(super().step(problem, iterate), state=undefined)


def messages(solution):
    return [record.message for record in solution.history]


def test_the_default_prints_itself():
    shown = repr(Fallbacks())
    assert shown.startswith("Fallbacks(drivers=(SemismoothNewton(rho=None, max_steps=30), Springs(")
    assert shown.endswith("SolutionPath(from_start=False, max_steps=5), SolutionPath(from_start=True, max_steps=5)))")
    assert eval(shown) == Fallbacks()


def test_a_limit_on_steps_hands_on_from_where_the_driver_has_stopped():
    problem = block_problem(Coulomb(0.5))
    newton = solve(problem, SemismoothNewton())
    hasty = solve(problem, Fallbacks((SemismoothNewton(max_steps=2), SemismoothNewton())))
    assert messages(hasty)[2] == "no solution after 2 steps; SemismoothNewton is next"
    assert hasty.steps == newton.steps  # no step is lost
    np.testing.assert_array_equal(hasty.state.traction, newton.state.traction)
    assert hasty.linear_solves == newton.linear_solves


def test_linear_solves_of_all_drivers_are_counted():
    problem = block_problem(Coulomb(0.5))
    alone = solve(problem, SemismoothNewton())
    after = solve(problem, Fallbacks((Idle(2), Idle(1), SemismoothNewton())))
    assert [record.linear_solves for record in after.history[:4]] == [2, 5, 9, 12]
    assert after.linear_solves == alone.linear_solves + 1 + 2 * 3 + 1 + 3


def test_a_driver_that_overflows_hands_on_its_last_state():
    problem = block_problem(Coulomb(0.5))
    alone = solve(problem, SemismoothNewton())
    found = solve(problem, Fallbacks((Overflowing(), SemismoothNewton())))
    assert messages(found)[1] == "numbers overflowed; SemismoothNewton is next"
    assert found.linear_solves == alone.linear_solves + 1 + 3
    np.testing.assert_array_equal(found.state.traction, alone.state.traction)


def test_what_overflows_ends_with_the_last_state():
    problem = block_problem(Coulomb(0.5))
    for driver in (Overflowing(), Fallbacks((Overflowing(),))):
        found = solve(problem, driver, throw=False)
        assert found.status is Status.NOT_FINITE
        assert found.state.is_finite
        assert np.isfinite(found.certificate.worst)
        assert found.steps == 1
        assert found.linear_solves == 2 + 3  # that of the cold start, too


def test_drivers_that_cannot_help_are_skipped():
    """Springs serve several bodies, and no path leads where a friction law jumps."""
    problem, loose = block_problem(CohesiveCoulomb(0.5, 0.1)), Springs(least_motions=4)
    found = solve(problem, Fallbacks((loose, SolutionPath(), SemismoothNewton())))
    assert found.is_converged
    assert messages(found)[0] == "SemismoothNewton is next"
    none = solve(problem, Fallbacks((loose, SolutionPath())), throw=False)
    assert none.status is Status.STALLED
    assert none.steps == 0
    assert "Springs: contact holds 1 rigid motions, less than 4; SolutionPath: there is no path" in none.message


def test_fallbacks_name_all_reasons_when_the_last_driver_has_ended():
    problem = hard_problem(11)
    drivers = Fallbacks((FixedPoint(), Fallbacks((Idle(1), Idle(2)))))
    found = solve(problem, drivers, throw=False)
    assert found.status is Status.STALLED
    assert "FixedPoint: " in found.message
    assert "Fallbacks: Idle: no solution after 1 step; Idle: no solution after 2 steps" in found.message


def test_the_path_begins_at_the_sets_reached_and_the_whole_path_anew():
    problem = hard_problem(16)
    for path in (SolutionPath(), SolutionPath(from_start=True)):
        found = solve(problem, Fallbacks((SemismoothNewton(), path)))
        assert "the active sets come back; SolutionPath is next" in messages(found)
        assert messages(found)[-1].startswith("path of ")
        assert_solves(problem, found.state, 2.0)
    assert solve(problem, SemismoothNewton(), throw=False).status is Status.CYCLING


def test_default_drivers_solve_problems_far_beyond_uniqueness():
    for seed in range(12):
        problem = hard_problem(seed, n_most=20, condition=1e3, friction_coefficient=5.0)
        assert_solves(problem, solve(problem, Fallbacks()).state, 5.0)


def test_without_the_whole_path():
    assert Fallbacks().without_whole_path() == Fallbacks((SemismoothNewton(), Springs(least_motions=4), SolutionPath()))
    only = Fallbacks((SolutionPath(from_start=True),))
    assert only.without_whole_path() == only


def test_drivers_at_work_are_those_that_have_taken_part():
    problem, newton = hard_problem(16), SemismoothNewton()
    drivers = Fallbacks((newton, SolutionPath(), LemkePivoting()))
    assert drivers_at_work(drivers, messages(solve(problem, drivers))) == (newton, SolutionPath())
    assert drivers_at_work(drivers, ()) == (newton,)
    assert drivers_at_work(newton, ()) == (newton,)


def test_compositions_pass_the_check():
    check_solver(Fallbacks((SolutionPath(max_steps=1), SemismoothNewton(max_steps=3), FixedPoint())))


def test_springs_that_become_weaker_lead_loose_bodies_to_rest():
    body = arch(8, 0.2)
    problem = ContactProblem(body, np.zeros(body.n_contact), Coulomb(0.7))
    found = solve(problem, Springs())
    assert found.is_converged
    springs = [message for message in messages(found) if message.startswith("springs of")]
    assert springs[0] == "springs of 3.0e-02"
    assert springs[-1] == "springs of 2.9e-05"  # 3e-2 / 4^5; the next, 7e-6, is weaker than the last allowed
    assert certify(problem, found.state).is_below(1e-9)
    assert found.linear_solves >= len(springs)
