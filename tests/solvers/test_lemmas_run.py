"""Solvers project with the functions whose lemmas `tests/solvers/test_lemmas.py` proves."""

import pytest

from bemkit.contact.laws import Coulomb
from bemkit.solvers import active_sets
from bemkit.solvers.active_sets import (
    clip_to_bound,
    clip_to_bound_derivative,
    positive_part,
    positive_part_derivative,
)
from bemkit.solvers.alm import AugmentedLagrangian
from bemkit.solvers.base import solve
from bemkit.solvers.fixed_point import FixedPoint
from bemkit.solvers.ssn import SemismoothNewton
from tests.handmade import block_problem
from tests.slow import slow_only

NEWTON = SemismoothNewton(max_steps=20)
DRIVERS = [NEWTON, AugmentedLagrangian(max_steps=20), FixedPoint(NEWTON, max_steps=20)]
PROBLEM = block_problem(Coulomb(0.5), n=6)

WRONG = {
    "positive_part": lambda a: -positive_part(a),
    "positive_part_derivative": lambda a: 1.0 - positive_part_derivative(a),
    "clip_to_bound": lambda x, bound: -clip_to_bound(x, bound),
    "clip_to_bound_derivative": lambda x, bound: tuple(-part for part in clip_to_bound_derivative(x, bound)),
}


def misled(solver, name, monkeypatch):
    """Whether a driver ends elsewhere, or elsehow, with one of the four functions wrong."""
    right = solve(PROBLEM, solver)
    assert right.is_converged
    monkeypatch.setattr(active_sets, name, WRONG[name])
    wrong = solve(PROBLEM, solver, max_steps=right.steps, throw=False)
    return (wrong.status, wrong.steps, wrong.linear_solves) != (right.status, right.steps, right.linear_solves)


@pytest.mark.parametrize("name", [name for name in WRONG if name != "clip_to_bound"])
def test_a_wrong_projection_or_derivative_misleads_newtons_method(name, monkeypatch):
    """The value of the clipped traction only measures the residual; its lemmas test it on `evaluate`."""
    assert misled(NEWTON, name, monkeypatch)


@pytest.mark.parametrize("solver", slow_only(DRIVERS, DRIVERS[1]), ids=lambda solver: type(solver).__name__)
@pytest.mark.parametrize("name", ["positive_part_derivative", "clip_to_bound_derivative"])
def test_a_wrong_derivative_misleads_every_driver(name, solver, monkeypatch):
    """Their linear conditions are those of the sets that the derivatives tell."""
    assert misled(solver, name, monkeypatch)
