"""What the drivers spend on the paper's examples, for any friction."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

import bemkit as bk
from bemkit.solvers.base import ContactSolver
from tests.slow import slow_except

DISCRETISATIONS = {"constant": bk.ConstantCollocation(), "linear": bk.Galerkin(1)}


def solved(example: int, discretisation: str, friction: float, solver: ContactSolver | None = None) -> bk.Solution:
    scene = bk.load_scene(f"paper-{example}")
    solver = bk.Fallbacks() if solver is None else solver
    law = bk.Coulomb(friction)
    return bk.run(dataclasses.replace(scene, law=law, discretisation=DISCRETISATIONS[discretisation], solver=solver))


def violations(solution: bk.Solution, friction: float) -> list[float]:
    """Contact and friction conditions (6) to (8) from the columns of the table, largest violation of each."""
    contact = solution.contact
    stress = float(np.abs(contact.sigma_n).max())
    length = float(np.abs(contact.u_n).max() + np.abs(contact.u_t).max())
    against = np.abs(contact.sigma_t + friction * np.abs(contact.sigma_n) * np.sign(contact.u_t)) / stress
    return [
        float(np.max(-contact.clearance)) / length,
        float(np.max(contact.sigma_n)) / stress,
        float(np.max(np.minimum(np.abs(contact.clearance) / length, np.abs(contact.sigma_n) / stress))),
        float(np.max(np.abs(contact.sigma_t) - friction * np.abs(contact.sigma_n))) / stress,
        float(np.max(np.minimum(np.abs(contact.u_t) / length, against))),
    ]


@pytest.mark.parametrize("example", [1, 2])
@pytest.mark.parametrize("discretisation", slow_except(DISCRETISATIONS, "constant"))
@pytest.mark.parametrize("friction", slow_except((0.05, 0.2, 0.5, 1.0, 2.0, 3.0, 5.0), 5.0))
def test_friction_up_to_five_takes_at_most_ten_solves(example: int, discretisation: str, friction: float) -> None:
    solution = solved(example, discretisation, friction)
    assert solution.is_converged
    assert solution.linear_solves <= 10  # 15 were asked for
    assert max(violations(solution, friction)) <= 1e-8


@pytest.mark.parametrize("discretisation", list(DISCRETISATIONS))
@pytest.mark.parametrize("friction", slow_except([10.0, 100.0], 100.0))
def test_friction_of_ten_and_a_hundred_still_converges(discretisation: str, friction: float) -> None:
    solution = solved(1, discretisation, friction)
    assert solution.is_converged
    assert max(violations(solution, friction)) <= 1e-8


@pytest.mark.parametrize(
    "solver",
    slow_except([bk.AugmentedLagrangian(), bk.FixedPoint(), bk.LemkePivoting()], bk.FixedPoint()),
    ids=lambda s: type(s).__name__,
)
@pytest.mark.parametrize("friction", slow_except([3.0, 10.0, 100.0], 10.0))
def test_other_drivers_are_right_or_say_that_they_failed(solver: ContactSolver, friction: float) -> None:
    solution = solved(1, "constant", friction, solver)
    is_right = max(violations(solution, friction)) <= 1e-7
    assert solution.is_converged == is_right
