"""Conformance of solutions: their fields obey supports, contact, friction, equilibrium and elasticity."""

from __future__ import annotations

from bemkit.errors import InputError
from bemkit.results.solution import Solution
from bemkit.testing.failure import demand
from bemkit.testing.independent_check import energy_fault, violations_of
from bemkit.testing.independent_check.verdict import Violations


def check_solution(solution: Solution, before: Solution | None = None) -> Violations:
    """Check a converged solution by its own fields; call it on what your discretisation, body, law or solver returns.

    Parameters
    ----------
    solution : Solution
    before : Solution, optional
        The end of the load step before, from which slip counts. Without it, the direction of friction is not checked at
        the end of a load history.

    Returns
    -------
    Violations
        Dimensionless; zero is perfect.

    Raises
    ------
    CheckFailed
        Naming the violated conditions and their sizes, the missing work of a load step, or the warning that a coarse
        mesh or a hidden overlap needs and the solution does not have.
    InputError
        If the solution has not converged: it promises nothing.

    Notes
    -----
    Normals are differentiated from the points of the mesh, distances to obstacles measured anew, and elasticity is
    tested by Betti's theorem with Kelvin's solution. No stiffness matrix, active set or certificate of the solver is
    read. Conditions of contact, supports and equilibrium must hold to 1e-6; Betti's theorem holds up to the
    discretisation error.
    """
    if not solution.is_converged:
        raise InputError(f"the solution ended as {solution.status_words}: give a converged one")
    violations = violations_of(solution, before)
    demand(violations.is_good, f"the solution violates {violations.description}")
    fault = energy_fault(solution)
    demand(not fault, f"the load history does not balance: {fault}")
    missing = violations.needs_warning
    is_warned = not missing or bool(solution.warnings)
    demand(is_warned, f"the solution lacks a warning of {missing}: {violations.description}")
    return violations
