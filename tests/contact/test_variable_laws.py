"""Coefficients that vary along the boundary, and laws that differ from part to part."""

import numpy as np
import pytest

from bemkit.contact.certificate import certify
from bemkit.contact.further_laws import CohesiveCoulomb, PiecewiseLaw
from bemkit.contact.laws import Coulomb, Frictionless, LawError, Tresca
from bemkit.contact.problem import ContactProblem
from bemkit.formulas import Expression
from bemkit.solvers.alm import AugmentedLagrangian
from bemkit.solvers.base import solve
from bemkit.solvers.fixed_point import FixedPoint
from bemkit.solvers.homotopy import why_no_path
from bemkit.solvers.lemke import LemkePivoting
from bemkit.solvers.ssn import SemismoothNewton
from bemkit.testing import check_law
from tests.handmade import assert_solves, block_body
from tests.slow import slow_except

POINTS = np.stack([np.linspace(0.0, 1.0, 5), np.full(5, 2.0)], axis=1)
PRESSURE = -np.arange(5.0)


def test_formulas_and_functions_become_numbers():
    laws = [Coulomb(Expression("0.2 + x * y")), Coulomb(lambda x, y: 0.2 + x * y)]
    for law in laws:
        found = law.at(POINTS)
        assert isinstance(found, Coulomb)
        assert np.allclose(found.friction_coefficient, 0.2 + 2.0 * POINTS[:, 0], rtol=1e-15)
        check_law(found, n_contact=5)
        assert np.allclose(found.bound(PRESSURE), (0.2 + 2.0 * POINTS[:, 0]) * np.arange(5.0))
    assert np.allclose(Tresca(Expression("x")).at(POINTS).bound(PRESSURE), POINTS[:, 0])
    cohesive = CohesiveCoulomb(0.5, Expression("x / 10"), Expression("1 + x")).at(POINTS)
    expected = np.minimum(0.1 * POINTS[:, 0] + 0.5 * np.arange(5.0), 1.0 + POINTS[:, 0])
    assert np.allclose(cohesive.bound(PRESSURE), expected)
    check_law(cohesive, n_contact=5)


def test_laws_without_formulas_are_themselves_everywhere():
    for law in (Frictionless(), Coulomb(0.3)):
        assert law.at(POINTS).bound(PRESSURE) == pytest.approx(law.bound(PRESSURE))
    assert not Coulomb(Expression("0 * x")).is_frictionless  # not known before it is evaluated
    assert Coulomb(Expression("0 * x")).at(POINTS).is_frictionless


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: Coulomb(Expression("x > 1")), "friction_coefficient = 'x > 1' is a condition"),
        (
            lambda: Coulomb(Expression("0.5 - x")).at(POINTS),
            r"is -0.5 at \(x, y\) = \(1, 2\); it must be zero or positive",
        ),
        (lambda: Coulomb(Expression("x")).bound(PRESSURE), r"friction_coefficient is a function .*law.at\(points\)"),
        (lambda: Tresca(Expression("x")).scaled(2.0), "bound_value is a function of the coordinates"),
        (lambda: CohesiveCoulomb(0.1, Expression("x"), 0.5).at(POINTS), "cap = 0.5 is less than cohesion = 1"),
    ],
)
def test_refusals(call, message):
    with pytest.raises(ValueError, match=message):
        call()


LEFT, RIGHT = np.arange(0, 12, 2), np.arange(1, 12, 2)


def test_each_part_has_its_law():
    law = PiecewiseLaw([Coulomb(np.linspace(0.1, 0.6, 6)), Tresca(0.2)], [LEFT, RIGHT])
    sigma_n = -np.linspace(1.0, 2.0, 12)
    assert np.allclose(law.bound(sigma_n)[LEFT], np.linspace(0.1, 0.6, 6) * -sigma_n[LEFT])
    assert np.allclose(law.bound(sigma_n)[RIGHT], 0.2)
    assert np.array_equal(law.bound_derivative(sigma_n)[RIGHT], np.zeros(6))
    assert np.allclose(law.scaled(4.0).bound(sigma_n / 4.0), law.bound(sigma_n) / 4.0)
    assert np.array_equal(law.acts_across_gap, np.arange(12) % 2 == 1)
    check_law(law, n_contact=12)
    assert not law.is_frictionless
    assert PiecewiseLaw([Coulomb(0.0), Frictionless()], [LEFT, RIGHT]).is_frictionless
    for nodes in ([LEFT, LEFT], [LEFT], [LEFT, RIGHT + 1]):
        with pytest.raises(ValueError, match="give every contact node to exactly one of 2 laws"):
            PiecewiseLaw([Coulomb(0.1), Tresca(0.1)], nodes)


@pytest.mark.parametrize("other", [Frictionless(), Tresca(0.05), Coulomb(0.2)], ids=repr)
@pytest.mark.parametrize("press", slow_except([1.0, 0.1], 0.1))
def test_drivers_agree_on_mixed_laws(other, press):
    body = block_body(press=press)
    problem = ContactProblem(body, np.zeros(12), PiecewiseLaw([Coulomb(0.5), other], [LEFT, RIGHT]))
    assert not why_no_path(problem)
    referee = solve(problem, LemkePivoting())
    for driver in (SemismoothNewton(), AugmentedLagrangian(), FixedPoint()):
        solution = solve(problem, driver)
        assert certify(problem, solution.state).is_below(1e-9)
        assert np.allclose(solution.state.traction, referee.state.traction, atol=1e-7)
    if isinstance(other, Coulomb):
        assert_solves(problem, referee.state, np.where(np.arange(12) % 2, 0.2, 0.5))


def test_a_jump_on_one_part_alone_is_seen():
    law = PiecewiseLaw([Coulomb(0.5), CohesiveCoulomb(0.5, 0.1)], [LEFT, RIGHT])
    problem = ContactProblem(block_body(), np.zeros(12), law)
    assert why_no_path(problem)
    with pytest.raises(ValueError, match="LemkePivoting cannot treat the friction law Coulomb or CohesiveCoulomb"):
        solve(problem, LemkePivoting())


def test_a_list_of_coefficients_must_have_one_for_each_node() -> None:
    message = "friction_coefficient has 3 values for 5 contact nodes: give one number, one for each node, or a formula"
    with pytest.raises(LawError, match=message):
        Coulomb(np.array([0.1, 0.2, 0.3])).at(np.zeros((5, 2)))
