"""Drivers take their tolerances from what a body says its responses are exact to, and ask costly bodies little."""

from dataclasses import replace

import numpy as np
import pytest

from bemkit.contact.equilibrium import Imbalance
from bemkit.contact.laws import Coulomb, Tresca
from bemkit.contact.problem import ContactProblem
from bemkit.solvers.active_sets import ActiveSets, ProjectionEquations
from bemkit.solvers.alm import AugmentedLagrangian
from bemkit.solvers.base import Status, solve
from bemkit.solvers.fallbacks import Fallbacks, SolutionPath
from bemkit.solvers.fixed_point import FixedPoint
from bemkit.solvers.homotopy import why_no_path
from bemkit.solvers.lemke import LemkePivoting
from bemkit.solvers.newton import negligible
from bemkit.solvers.progress import OuterIterate
from bemkit.solvers.ssn import SemismoothNewton
from tests.handmade import Inexact, block_body, block_problem, hard_problem

DRIVERS = [SemismoothNewton(), AugmentedLagrangian(), FixedPoint()]


def inexact_problem(law, accuracy=1e-10, error=1e-11, **options):
    """Return the paper's first example on a body whose responses carry the given relative error."""
    body = Inexact(block_body(), error, accuracy=accuracy, **options)
    return ContactProblem(body, np.zeros(body.n_contact), law)


@pytest.mark.parametrize("law", [Coulomb(0.5), Tresca(0.2)], ids=["coulomb", "tresca"])
@pytest.mark.parametrize("driver", DRIVERS, ids=lambda driver: type(driver).__name__)
def test_every_driver_ends_on_a_body_that_states_its_accuracy(driver, law):
    problem = inexact_problem(law, responses_are_expensive=True)
    exact = solve(block_problem(law), driver)
    found = solve(problem, driver, tolerance=1e-8)
    np.testing.assert_array_equal(found.node_status, exact.node_status)
    assert found.steps <= exact.steps + 2
    # errors of 1e-11 in displacements that are up to a hundred times those of single nodes
    assert np.abs(found.state.traction - exact.state.traction).max() <= 1e-8 * np.abs(exact.state.traction).max()


def test_a_body_that_claims_too_much_is_found_out():
    """Without the accuracy that belongs to its errors the inner tolerance of 1e-11 is never reached."""
    claimed = solve(inexact_problem(Coulomb(0.5), accuracy=1e-14), FixedPoint(), tolerance=1e-8, throw=False)
    assert claimed.status is Status.INNER_FAILED
    assert solve(inexact_problem(Coulomb(0.5)), FixedPoint(), tolerance=1e-8).is_converged


class Unforgiving(Inexact):
    """A body that measures its balance to within its accuracy, and allows for no round-off."""

    def imbalance(self, state):
        return Imbalance(5e-11, 0.0)


def test_the_inner_problems_of_the_fixed_point_end_where_the_body_ends():
    body = Unforgiving(block_body(), accuracy=1e-10)
    problem = ContactProblem(body, np.zeros(body.n_contact), Coulomb(0.5))
    assert solve(problem, FixedPoint()).is_converged  # its inner_tolerance is 1e-11


@pytest.mark.parametrize("accuracy", [1e-14, 1e-10])
def test_residuals_and_states_are_compared_by_the_accuracy(accuracy):
    problem = inexact_problem(Coulomb(0.5), accuracy=accuracy, error=0.0)
    assert negligible(problem.body) == pytest.approx(100.0 * accuracy)
    state = problem.sticking_state
    moved = replace(state, traction=(1.0 + 3.0 * accuracy) * state.traction)
    assert OuterIterate.begun(problem, state).followed_by(problem, moved, 1).ended is Status.STALLED
    moved = replace(state, traction=(1.0 + 30.0 * accuracy) * state.traction)
    assert OuterIterate.begun(problem, state).followed_by(problem, moved, 1).ended is None


def test_the_whole_path_is_skipped_where_responses_are_costly():
    problem = hard_problem(16)
    whole = Fallbacks((SemismoothNewton(), SolutionPath(from_start=True)))
    assert any("path of" in record.message for record in solve(problem, whole).history)
    costly = replace(problem, body=Inexact(problem.body, responses_are_expensive=True))
    found = solve(costly, whole, throw=False)
    assert found.status is Status.CYCLING
    words = "the path of solutions is not followed, because responses of this body are costly"
    assert f"SemismoothNewton: the active sets come back; SolutionPath: {words}" in found.message
    assert why_no_path(costly) == words
    assert not why_no_path(costly, is_short=True)
    assert solve(costly, Fallbacks()).is_converged  # by the path from the sets that come back


def test_lemkes_method_declines_before_it_asks():
    problem = inexact_problem(Coulomb(0.5), responses_are_expensive=True)
    found = solve(problem, LemkePivoting(), throw=False)
    assert found.status is Status.TOO_COSTLY
    assert found.message.startswith("This solver needs several responses for each contact node")
    assert problem.body.n_responses < problem.n_contact  # the loop's own and the certificates', but no 2 n probes


def test_an_open_node_with_given_friction_turns_round_by_way_of_stick():
    problem = block_problem(Tresca(0.2))
    conditions = ProjectionEquations(problem, 1.0, 1.0)
    state = problem.sticking_state
    n_contact = problem.n_contact
    lifted = replace(state, displacement=np.tile([-9.0, 9.0], (n_contact, 1)))
    residual = conditions.evaluate(lifted)
    assert not residual.sets.is_closed.any()
    assert (residual.sets.direction == 1).all()
    back = ActiveSets(residual.sets.is_closed, np.full(n_contact, -1))
    assert not conditions.through_stick(residual, back).direction.any()
    assert (conditions.through_stick(residual, residual.sets).direction == 1).all()
