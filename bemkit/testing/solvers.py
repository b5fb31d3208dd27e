"""Conformance of contact solvers."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import is_dataclass

import numpy as np

from bemkit.arrays import FloatArray
from bemkit.contact.body import ContactState
from bemkit.contact.dense_body import DenseBody
from bemkit.contact.problem import ContactProblem
from bemkit.solvers.base import ContactSolution, ContactSolver, Iterate, Status, solve
from bemkit.testing.failure import class_name, demand
from bemkit.testing.problems import KNOWN_PROBLEMS, KnownProblem


def check_solver(solver: ContactSolver, *, problems: Iterable[str] | None = None, tolerance: float = 1e-9) -> None:
    """Check a contact solver on problems with known answers; call it on your own solver.

    Parameters
    ----------
    solver : ContactSolver
    problems : iterable of str, optional
        Names from `bemkit.testing.problems.KNOWN_PROBLEMS`, for a solver that claims less than all friction laws;
        all of them by default.
    tolerance : float
        Bound on the certificate.

    Raises
    ------
    CheckFailed
        Naming the solver, the problem and what is wrong: no convergence, a wrong state, a success where there is no
        solution, different answers to one question, a changed problem, uncounted linear solves, or a dependence on
        units.
    """
    name = class_name(solver)
    demand(is_dataclass(solver), f"{name} is not a dataclass: options of solvers are frozen values")
    demand(solver.max_steps >= 1, f"{name}.max_steps is {solver.max_steps}; it allows no step")
    for title in KNOWN_PROBLEMS if problems is None else problems:
        known = KNOWN_PROBLEMS[title]()
        label = f"{name} on the problem {title!r}"
        if not known.solutions:
            solution = solve(known.problem, solver, throw=False, tolerance=tolerance)
            demand(not solution.is_converged, f"{label} claims a solution where there is none")
            continue
        solution = _solved(known, solver, label, tolerance)
        again = solve(known.problem, solver, throw=False, tolerance=tolerance)
        is_same = np.array_equal(_as_array(again.state), _as_array(solution.state)) and again.steps == solution.steps
        demand(is_same, f"{label} gives two answers to one question")
        _check_units(known, solver, label, solution, tolerance)
        again = solve(known.problem, solver, start=solution.state, throw=False, tolerance=tolerance)
        ending = f"{again.steps} steps, {again.status.name}"
        demand(again.is_converged and again.steps == 0, f"{label} leaves its own solution as a start ({ending})")
        _check_purity(known, solver, label)


def _solved(known: KnownProblem, solver: ContactSolver, label: str, tolerance: float) -> ContactSolution:
    solution = solve(known.problem, solver, throw=False, tolerance=tolerance)
    demand(solution.status is Status.CONVERGED, f"{label} ends with {solution.status.name}: {solution.message}")
    state = _as_array(solution.state)
    misses = [float(np.abs(state - answer).max()) for answer in known.solutions]
    # a certificate of 1e-9 leaves errors of that size times the condition number, here below 10
    demand(min(misses) <= 100.0 * tolerance, f"{label} misses every solution by {min(misses):.1e}")
    counts = [record.linear_solves for record in solution.history]
    demand(counts == sorted(counts), f"{label} takes linear solves back: {counts}")
    return solution


def _check_units(
    known: KnownProblem, solver: ContactSolver, label: str, found: ContactSolution, tolerance: float
) -> None:
    """Measure lengths and forces in other units (powers of two, so that nothing is rounded)."""
    if any(getattr(solver, option, None) is not None for option in ("rho", "rho_n", "rho_t")):
        return  # a given penalty has units of its own
    for length, stress in ((2.0**-40, 1.0), (2.0**40, 2.0**-30)):
        problem = _in_units(known.problem, length, stress)
        other = solve(problem, solver, throw=False, tolerance=tolerance)
        demand(
            other.is_converged and other.steps == found.steps,
            f"{label} takes {other.steps} steps instead of {found.steps} in other units ({other.status.name})",
        )
        same = np.array_equal(other.node_status, found.node_status)
        demand(same, f"{label} finds other contact sets in other units")


def _in_units(problem: ContactProblem, length: float, stress: float) -> ContactProblem:
    body = problem.body
    if not isinstance(body, DenseBody):
        raise TypeError("known problems have dense bodies")
    scaled = DenseBody(body.stiffness * stress / length, body.load * stress, body.weights, body.motions)
    law = problem.law.scaled(1.0 / stress)
    return ContactProblem(scaled, problem.gap * length, law, problem.slip_origin * length)


def _check_purity(known: KnownProblem, solver: ContactSolver, label: str) -> None:
    """Step twice from one iterate; the iterate must not change, and its successors must be equal."""
    first = solver.init(known.problem, known.problem.sticking_state)
    demand(isinstance(first, Iterate), f"{label}: init returns a {type(first).__name__}, not an Iterate")
    before = _as_array(first.state).copy()
    after, again = (solver.step(known.problem, first) for _ in range(2))
    demand(isinstance(after, Iterate), f"{label}: step returns a {type(after).__name__}, not an Iterate")
    demand(np.array_equal(_as_array(first.state), before), f"{label}: step changes the iterate it was given")
    demand(np.array_equal(_as_array(after.state), _as_array(again.state)), f"{label}: step is not a function")
    demand(after.linear_solves >= first.linear_solves, f"{label}: step takes linear solves back")


def _as_array(state: ContactState) -> FloatArray:
    """Return (n_contact, 2, 2): displacement and traction of each node."""
    return np.stack([state.displacement, state.traction], axis=1)
