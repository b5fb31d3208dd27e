"""Which linear solver the map of a body takes, compressed equations among them, and why."""

from __future__ import annotations

from bemkit.geometry.spaces import BoundarySpace
from bemkit.operators.linear.solvers import (
    Automatic,
    ChosenLinearSolver,
    Hierarchical,
    LinearSolverChoice,
    choose_linear_solver,
)
from bemkit.operators.steklov_poincare.hierarchical_needs import choose_collocation_solver, choose_galerkin_solver
from bemkit.operators.steklov_poincare.needs import BodyCase
from bemkit.scene.discretisation import Discretisation


def linear_solver_of(
    requested: LinearSolverChoice, discretisation: Discretisation, case: BodyCase, space: BoundarySpace, memory: float
) -> ChosenLinearSolver:
    """Choose the linear solver of a map.

    Parameters
    ----------
    requested : LinearSolver, Hierarchical or Automatic
    discretisation : Discretisation
    case : BodyCase
        Its linear solver counts for nothing.
    space : BoundarySpace
        Of the displacements.
    memory : float [bytes]
        Of the computer.
    """
    hindrance = discretisation.why_dense(case.mesh)
    if not discretisation.is_symmetric:
        return choose_collocation_solver(requested, case, memory, hindrance)
    dense = choose_linear_solver(requested)
    if not isinstance(requested, Automatic | Hierarchical):
        return dense
    n_tractions = discretisation.traction_space(case.mesh).n_dofs
    return choose_galerkin_solver(requested, case, dense, n_tractions, space.degree, memory, hindrance)
