import numpy as np
import pytest

from bemkit.contact import further_laws, laws
from bemkit.contact.further_laws import CohesiveCoulomb, PiecewiseLaw, RateStrengthening, SlipWeakening
from bemkit.contact.laws import Coulomb, FrictionLaw, Frictionless, LawError, LawOfCoefficients, RescaledLaw, Tresca
from bemkit.contact.problem import ContactProblem
from bemkit.formulas import Expression
from bemkit.testing import check_law
from tests.handmade import random_problem

PER_NODE = np.array([0.0, 0.1, 0.5, 1.0, 5.0])
LAWS = [
    Frictionless(),
    Tresca(0.3),
    Tresca(PER_NODE),
    Coulomb(0.5),
    Coulomb(PER_NODE),
    CohesiveCoulomb(0.4, 0.1, 3.0),
    CohesiveCoulomb(PER_NODE, 0.2 * PER_NODE, 1.0 + PER_NODE),
    CohesiveCoulomb(0.0),
    RescaledLaw(CohesiveCoulomb(0.4, 0.1, 3.0), stress_scale=7.0),
    SlipWeakening(0.6, PER_NODE.clip(max=0.6), 1e-3),
    RateStrengthening(PER_NODE, 0.1, 2.0),
    PiecewiseLaw([Coulomb(0.5), Tresca(0.2)], [np.arange(0, PER_NODE.size, 2), np.arange(1, PER_NODE.size, 2)]),
]


@pytest.mark.parametrize("law", LAWS, ids=repr)
def test_conformance(law):
    check_law(law)


@pytest.mark.parametrize(
    ("make", "other"),
    [
        (lambda: Coulomb(0.5), Coulomb(0.4)),
        (lambda: Coulomb(0.5), Tresca(0.5)),
        (lambda: Coulomb(np.array([0.5, 0.4])), Coulomb(np.array([0.5, 0.3]))),
        (lambda: Coulomb(np.array([0.5, 0.5])), Coulomb(0.5)),
        (lambda: Tresca(Expression("x")), Tresca(Expression("y"))),
        (lambda: CohesiveCoulomb(0.5, cap=2.0), CohesiveCoulomb(0.5, cap=3.0)),
    ],
)
def test_laws_are_equal_by_their_coefficients(make, other):
    assert make() == make()
    assert hash(make()) == hash(make())
    assert make() != other


def test_every_law_is_checked():
    classes = {**vars(laws), **vars(further_laws)}.values()
    found = {cls for cls in classes if isinstance(cls, type) and FrictionLaw in cls.__mro__[1:]}
    assert found - {LawOfCoefficients} == {type(law) for law in LAWS}


def test_values():
    sigma_n = np.array([0.0, -1.0, -10.0])
    assert np.allclose(CohesiveCoulomb(0.5, 0.25, 2.0).bound(sigma_n), [0.25, 0.75, 2.0], rtol=1e-15)
    assert np.array_equal(CohesiveCoulomb(0.5, 0.25, 2.0).bound_derivative(sigma_n), [-0.5, -0.5, 0.0])
    assert np.array_equal(Coulomb(0.5).bound(np.array([1.0, -2.0])), [0.0, 1.0])
    assert np.array_equal(Coulomb(0.5).bound_derivative(np.array([1.0, 0.0])), [0.0, -0.5])
    assert np.array_equal(Tresca(2.0).bound(sigma_n), [2.0, 2.0, 2.0])


@pytest.mark.parametrize(
    ("law", "is_frictionless"),
    [
        (Frictionless(), True),
        (Coulomb(0.0), True),
        (Coulomb(PER_NODE), False),
        (Tresca(0.0), True),
        (Tresca(0.1), False),
        (CohesiveCoulomb(0.0, 0.1), False),
        (CohesiveCoulomb(0.5, 0.0, 0.0), True),
        (RescaledLaw(Coulomb(0.0), 7.0), True),
    ],
    ids=repr,
)
def test_is_frictionless(law, is_frictionless):
    assert law.is_frictionless is is_frictionless


class Rubber(FrictionLaw):
    """A user's law with a curved bound: two methods and nothing else."""

    def bound(self, sigma_n):
        return np.sqrt(np.maximum(-sigma_n, 0.0) + 0.01) - 0.1

    def bound_derivative(self, sigma_n):
        return -0.5 / np.sqrt(np.maximum(-sigma_n, 0.0) + 0.01)


def test_a_users_law_conforms_and_rescales():
    check_law(Rubber())
    assert Rubber().scaled(100.0).bound(np.array([-0.03])) == pytest.approx(Rubber().bound(np.array([-3.0])) / 100)


class WrongSign(Rubber):
    def bound_derivative(self, sigma_n):
        return -super().bound_derivative(sigma_n)


class WrongSlope(Rubber):
    def bound_derivative(self, sigma_n):
        return 1.01 * super().bound_derivative(sigma_n)


class Falling(Rubber):
    def bound(self, sigma_n):
        return 1.0 / (1.0 - sigma_n)


class Negative(Rubber):
    def bound(self, sigma_n):
        return sigma_n


class OneNumber(Rubber):
    def bound(self, sigma_n):
        return 0.5


class Infinite(Rubber):
    def bound(self, sigma_n):
        return np.full_like(sigma_n, np.inf)


class Averaging(Rubber):
    def bound(self, sigma_n):
        return np.full_like(sigma_n, -sigma_n.mean())


class Liar(Rubber):
    @property
    def is_frictionless(self):
        return True


class Overwriting(Rubber):
    def bound(self, sigma_n):
        sigma_n *= 0.5
        return -sigma_n


class Fickle(Rubber):
    n_calls = 0

    def bound(self, sigma_n):
        self.n_calls += 1
        return -sigma_n * self.n_calls


class BadUnit(Rubber):
    def scaled(self, stress_scale):
        return self


@pytest.mark.parametrize(
    ("law", "complaint"),
    [
        (WrongSign(), "bound_derivative is positive"),
        (WrongSlope(), r"WrongSlope.bound_derivative is -.* at node .* differences of bound give"),
        (Falling(), "Falling.bound falls when the pressure grows"),
        (Negative(), "Negative.bound is negative"),
        (OneNumber(), r"OneNumber.bound returns the shape \(\)"),
        (Infinite(), "Infinite.bound is not finite"),
        (Averaging(), "Averaging.bound_derivative is|depends on the pressure at other nodes"),
        (Liar(), "Liar says it is frictionless and has a bound"),
        (Overwriting(), "Overwriting.bound changes its argument"),
        (Fickle(), "Fickle.bound gives two answers"),
        (BadUnit(), r"BadUnit.scaled\(1e\+06\).bound is not the bound"),
    ],
    ids=lambda value: type(value).__name__,
)
def test_the_check_finds_broken_laws(law, complaint):
    with pytest.raises(AssertionError, match=complaint):
        check_law(law)


@pytest.mark.parametrize(
    ("make", "complaint"),
    [
        (lambda: Coulomb(-0.1), "friction_coefficient = -0.1; give a number >= 0"),
        (lambda: Coulomb(np.array([0.1, np.nan])), "friction_coefficient = nan at contact node 1"),
        (lambda: Coulomb(np.zeros((2, 2))), r"friction_coefficient has the shape \(2, 2\)"),
        (lambda: Coulomb(float("inf")), "friction_coefficient = inf"),
        (lambda: Tresca(-1.0), "bound_value = -1"),
        (lambda: CohesiveCoulomb(0.1, -1.0), "cohesion = -1"),
        (lambda: CohesiveCoulomb(0.1, 2.0, 1.0), "cap = 1 is less than cohesion = 2"),
        (lambda: Coulomb(0.1).scaled(0.0), "stress_scale = 0; give a positive finite stress"),
    ],
)
def test_refusals(make, complaint):
    with pytest.raises(ValueError, match=complaint):
        make()


class Raising(Rubber):
    def bound(self, sigma_n):
        raise ZeroDivisionError("temperature is missing")


class NoLaw:
    def bound(self, sigma_n):
        return sigma_n


@pytest.mark.parametrize(
    ("law", "complaint"),
    [
        (Raising(), "friction law Raising.bound failed: ZeroDivisionError: temperature is missing"),
        (OneNumber(), r"friction law OneNumber.bound returned the shape \(\) for"),
        (Infinite(), "friction law Infinite.bound is inf at contact node 0"),
        (NoLaw(), "friction law NoLaw has no bound_derivative, is_frictionless, acts_across_gap, scaled; derive it"),
        (Coulomb(np.zeros(99)), "friction law Coulomb.bound failed: ValueError"),
    ],
    ids=lambda value: type(value).__name__,
)
def test_a_problem_refuses_broken_laws_by_name(law, complaint):
    problem = random_problem(0)
    with pytest.raises(LawError, match=complaint):
        ContactProblem(problem.body, problem.gap, law)


def test_a_negative_bound_is_refused_by_name():
    problem = random_problem(0)
    broken = ContactProblem(problem.body, problem.gap, Negative())  # zero at zero pressure: seen only later
    with pytest.raises(LawError, match=r"friction law Negative.bound is -1 at contact node 0"):
        broken.friction_bound(np.full(problem.n_contact, -1.0))
