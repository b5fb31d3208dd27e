"""What is chosen for a scene before anything is computed: values that the solver follows."""

from __future__ import annotations

import enum
from dataclasses import dataclass

from bemkit.geometry.mesh import BoundaryMesh
from bemkit.geometry.spaces import BoundarySpace, ConstantSpace, LinearSpace, QuadraticSpace, break_nodes
from bemkit.operators.linear.choice import choose_linear_solver
from bemkit.operators.linear.memory import physical_memory
from bemkit.operators.linear.solvers import Automatic, Choice, DenseCholesky, Krylov, LinearSolverWish
from bemkit.scene.scene import LARGEST_KRYLOV_ERROR, ConstantCollocation, QuadraticGalerkin, Scene


class Formulation(enum.Enum):
    """How tractions follow from displacements."""

    GALERKIN = "symmetric Galerkin"
    COLLOCATION = "direct collocation"


@dataclass(frozen=True)
class Decisions:
    """The choices of a plan; `bemkit.model.contact_model.build_model` and `bemkit.runs.run.run` follow them.

    Parameters
    ----------
    formulation : Formulation
    displacement_degree, traction_degree : int
        Of the polynomials on each element.
    takes_slopes : bool
        Whether the double layer of constant elements takes slopes between neighbours
        (`bemkit.operators.collocation.gradient_reconstruction`).
    n_load_steps : int
    has_contact : bool
        Whether any part may touch an obstacle; without one the body is solved at once.
    linear_solver : LinearSolver or Automatic
        Of a symmetric map; a plan holds the one that `linear_choice` has taken.
    """

    formulation: Formulation
    displacement_degree: int
    traction_degree: int
    takes_slopes: bool
    n_load_steps: int
    has_contact: bool
    linear_solver: LinearSolverWish

    def linear_choice(self, n_displacements: int, n_open: int) -> Choice:
        """Return the linear solver of a symmetric map and the reason."""
        return choose_linear_solver(self.linear_solver, n_displacements, n_open, physical_memory())

    @property
    def forms_matrix(self) -> bool:
        """Whether the Steklov-Poincare map is formed, and its free part factored, by the linear solver taken."""
        return not isinstance(self.linear_solver, Automatic) and self.linear_solver.forms_matrix

    def displacement_space(self, mesh: BoundaryMesh) -> BoundarySpace:
        """Return the space of the displacements, continuous in the Galerkin formulation."""
        if self.formulation is Formulation.COLLOCATION:
            return ConstantSpace(mesh)
        return LinearSpace(mesh) if self.displacement_degree == 1 else QuadraticSpace(mesh)

    def traction_space(self, mesh: BoundaryMesh) -> BoundarySpace:
        """Return the space of the tractions, which may jump at corners and at ends of parts at least."""
        return ConstantSpace(mesh) if self.traction_degree == 0 else LinearSpace(mesh, break_nodes(mesh))


def decide(scene: Scene, mesh: BoundaryMesh, n_load_steps: int) -> Decisions:
    """Choose what a scene needs on a mesh.

    Parameters
    ----------
    scene : Scene
    mesh : BoundaryMesh
    n_load_steps : int

    Returns
    -------
    Decisions
    """
    discretisation = scene.discretisation
    is_collocation = isinstance(discretisation, ConstantCollocation)
    return Decisions(
        formulation=Formulation.COLLOCATION if is_collocation else Formulation.GALERKIN,
        displacement_degree=discretisation.displacement_space(mesh).degree,
        traction_degree=1 if isinstance(discretisation, QuadraticGalerkin) else 0,
        takes_slopes=isinstance(discretisation, ConstantCollocation) and discretisation.slopes,
        n_load_steps=n_load_steps,
        has_contact=bool(scene.contact_parts),
        linear_solver=_linear_solver(scene),
    )


def _linear_solver(scene: Scene) -> LinearSolverWish:
    """Return what the scene asks for, or a factorisation where iteration would be too inexact."""
    if isinstance(scene.linear_solver, Automatic) and Krylov().error_at(scene.material) > LARGEST_KRYLOV_ERROR:
        return DenseCholesky()
    return scene.linear_solver
