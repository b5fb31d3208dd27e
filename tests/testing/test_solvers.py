"""The check of drivers: ours pass it, broken ones are found out."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace

import numpy as np
import pytest

import bemkit as bk
from bemkit.contact.body import ContactState
from bemkit.contact.problem import ContactProblem
from bemkit.scene.registry import SOLVERS
from bemkit.solvers.alm import AugmentedLagrangian, BoundUpdate
from bemkit.solvers.base import Iterate, Status, solve
from bemkit.solvers.ssn import SemismoothNewton
from bemkit.testing import CheckFailed, check_discretisation, check_law, check_shape, check_solver
from bemkit.testing.problems import KNOWN_PROBLEMS
from tests.handmade import assert_solves


@pytest.mark.parametrize("kind", list(SOLVERS.built_in))
def test_every_driver_conforms(kind: str) -> None:
    check_solver(SOLVERS.find(kind)())


def test_options_conform() -> None:
    check_solver(AugmentedLagrangian(bound=BoundUpdate.CURRENT))
    check_solver(SemismoothNewton(rho=3.0))


@pytest.mark.parametrize("title", list(KNOWN_PROBLEMS))
def test_the_known_answers_are_answers(title: str) -> None:
    known = KNOWN_PROBLEMS[title]()
    for answer in known.solutions:
        state = ContactState(answer[:, 0], answer[:, 1])
        body = known.problem.body
        force = (body.weights[:, None] * state.traction).ravel()
        np.testing.assert_allclose(body.stiffness @ state.displacement.ravel() - body.load, force, atol=1e-14)
        if title != "given friction":  # Tresca's friction acts on open nodes, which that check does not know
            assert_solves(known.problem, state, getattr(known.problem.law, "friction_coefficient", 0.0))


@dataclass(frozen=True)
class Wrapped:
    """Does what semismooth Newton does; subclasses spoil it."""

    max_steps: int = 100

    def init(self, problem: ContactProblem, start: ContactState) -> Iterate:
        return SemismoothNewton().init(problem, start)

    def step(self, problem: ContactProblem, iterate: Iterate) -> Iterate:
        return SemismoothNewton().step(problem, iterate)


class GivesUp(Wrapped):
    def step(self, problem: ContactProblem, iterate: Iterate) -> Iterate:
        return replace(iterate, ended=Status.STALLED, message="tired")


class ForgetsItsCount(Wrapped):
    def step(self, problem: ContactProblem, iterate: Iterate) -> Iterate:
        return replace(super().step(problem, iterate), linear_solves=-1)


class WritesOnItsInput(Wrapped):
    def step(self, problem: ContactProblem, iterate: Iterate) -> Iterate:
        following = super().step(problem, iterate)
        iterate.state.displacement[:] += 1.0
        return following


@dataclass(frozen=True)
class ThrowsDice(Wrapped):
    dice: Iterator[int] = field(default_factory=itertools.count)

    def step(self, problem: ContactProblem, iterate: Iterate) -> Iterate:
        following = super().step(problem, iterate)
        state = following.state
        noise = 1e-13 * next(self.dice)
        return replace(following, state=ContactState(state.displacement + noise, state.traction))


class KnowsMetres(Wrapped):
    def step(self, problem: ContactProblem, iterate: Iterate) -> Iterate:
        if problem.body.stiffness_scale > 1e6 and iterate.linear_solves < 3:
            return replace(iterate, linear_solves=iterate.linear_solves + 1)
        return super().step(problem, iterate)


class NoDataclass:
    max_steps = 3


@pytest.mark.parametrize(
    ("driver", "message"),
    [
        (GivesUp(), "GivesUp on the problem .* ends with STALLED: .*tired"),
        (ForgetsItsCount(), "takes linear solves back"),
        (WritesOnItsInput(), "step changes the iterate|gives two answers|ends with"),
        (ThrowsDice(), "gives two answers to one question|is not a function"),
        (KnowsMetres(), "instead of . in other units"),
        (NoDataclass(), "NoDataclass is not a dataclass"),
        (Wrapped(max_steps=0), "Wrapped.max_steps is 0"),
    ],
    ids=lambda value: type(value).__name__,
)
def test_broken_drivers_are_found(driver: Wrapped, message: str) -> None:
    with pytest.raises(CheckFailed, match=message):
        check_solver(driver)


def test_a_driver_may_claim_less() -> None:
    check_solver(GivesUp(), problems=["lifted"])
    with pytest.raises(KeyError):
        check_solver(SemismoothNewton(), problems=["missing"])


def test_a_wrapped_driver_is_the_driver() -> None:
    check_solver(Wrapped())
    problem = KNOWN_PROBLEMS["floating"]().problem
    assert solve(problem, Wrapped()).steps == solve(problem, SemismoothNewton()).steps


@pytest.mark.parametrize(
    ("check", "implementation"),
    [
        (check_law, bk.Coulomb),
        (check_solver, bk.SemismoothNewton),
        (check_discretisation, bk.Galerkin),
        (check_shape, bk.Disk),
    ],
)
def test_a_class_in_place_of_an_object_is_named(check: Callable[[object], None], implementation: type) -> None:
    name = implementation.__name__
    with pytest.raises(CheckFailed, match=rf"{name} is a class: give an object, {name}\("):
        check(implementation)
