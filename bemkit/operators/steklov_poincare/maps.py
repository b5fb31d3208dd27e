"""Steklov-Poincare maps as scipy's linear operators, from displacements of the boundary to consistent nodal forces.

Bodies are solved without this module, which loads `scipy.sparse.linalg`.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from functools import cached_property
from typing import TYPE_CHECKING, TypeAlias

import numpy as np
from scipy.sparse.linalg import LinearOperator

from bemkit.arrays import FloatArray, IntArray, read_only
from bemkit.geometry.mesh import BoundaryMesh
from bemkit.geometry.spaces import BoundarySpace
from bemkit.operators.linear.solvers import DenseCholesky, LinearSolverChoice
from bemkit.operators.material import Material
from bemkit.operators.pair_form import Tag
from bemkit.operators.steklov_poincare.collocation import CollocationElasticity, MixedSystem
from bemkit.operators.steklov_poincare.galerkin import GalerkinElasticity
from bemkit.operators.steklov_poincare.nodal_conditions import NodalConditions, TractionField, integrate_traction

if TYPE_CHECKING:
    _LinearOperator: TypeAlias = LinearOperator[np.float64]
else:
    _LinearOperator = LinearOperator


class _SteklovPoincareMap(_LinearOperator, ABC):
    """S: displacement dofs [m] -> nodal forces [N/m], both (n_dofs,), dof = 2 * node + component."""

    displacement_space: BoundarySpace

    def _become_operator(self) -> None:
        n_dofs = self.displacement_space.n_dofs
        LinearOperator.__init__(self, np.dtype(float), (n_dofs, n_dofs))  # type: ignore[call-arg]  # the stubs lack it

    @abstractmethod
    def _form(self) -> FloatArray:
        """Compute the matrix."""

    @cached_property
    def _formed(self) -> FloatArray:
        matrix = self._form()
        read_only(matrix)
        return matrix

    @property
    def trial(self) -> BoundarySpace:
        """The space of the displacements."""
        return self.displacement_space

    @property
    def test(self) -> BoundarySpace:
        """The same space: its functions carry the forces."""
        return self.displacement_space

    def matrix(self) -> FloatArray:
        """Return the dense (n_dofs, n_dofs) matrix [Pa], read-only; rigid motions of a bounded body are its kernel."""
        return self._formed

    def block(self, rows: IntArray, columns: IntArray) -> FloatArray:
        """Return the (m, n) entries of some rows and columns; S holds an inverse, so that all of it is formed."""
        block: FloatArray = self._formed[np.ix_(rows, columns)]
        return block

    def nodal_forces(self, elements: IntArray, traction: TractionField) -> FloatArray:
        """Return the consistent nodal forces (n_nodes, 2) [N/m] of a traction field [Pa] on some elements."""
        return integrate_traction(self.displacement_space, elements, traction)

    def _matvec(self, x: FloatArray) -> FloatArray:
        return np.asarray(self._formed @ x)

    _matmat = _matvec

    def _rmatvec(self, x: FloatArray) -> FloatArray:
        return np.asarray(self._formed.T @ x)

    _rmatmat = _rmatvec


class GalerkinMap(GalerkinElasticity, _SteklovPoincareMap):
    """The symmetric map; parameters and notes are those of `GalerkinElasticity`."""

    def __init__(
        self,
        mesh: BoundaryMesh,
        material: Material,
        displacement_space: BoundarySpace | None = None,
        traction_space: BoundarySpace | None = None,
        linear_solver: LinearSolverChoice = DenseCholesky(),  # noqa: B008 - frozen
    ) -> None:
        super().__init__(mesh, material, displacement_space, traction_space, linear_solver)
        self._become_operator()

    @property
    def tags(self) -> frozenset[Tag]:
        """Symmetric and semidefinite; the kernel are the rigid motions that the space holds, of a bounded body."""
        tags = {Tag.SYMMETRIC, Tag.POSITIVE_SEMIDEFINITE}
        return frozenset(tags if self.mesh.is_exterior else tags | {Tag.KILLS_RIGID_MOTIONS})

    def _form(self) -> FloatArray:
        if not self._volume.yields:
            return self.factors.matrix
        change = self._volume.change
        matrix: FloatArray = self.factors.matrix + change @ change.T / self._volume.yields
        return matrix


class CollocationMap(CollocationElasticity, _SteklovPoincareMap):
    """The direct map, not symmetric; parameters and notes are those of `CollocationElasticity`."""

    def __init__(self, mesh: BoundaryMesh, material: Material, *, slopes: bool = True) -> None:
        super().__init__(mesh, material, slopes=slopes)
        self._become_operator()

    @property
    def tags(self) -> frozenset[Tag]:
        """Zero on rigid motions of a bounded body, with slopes; without them on translations alone."""
        if self.mesh.is_exterior:
            return frozenset()
        return frozenset({Tag.KILLS_RIGID_MOTIONS if self.slopes else Tag.KILLS_TRANSLATIONS})

    def _form(self) -> FloatArray:
        n = self.mesh.n_elements
        frame = np.broadcast_to(np.eye(2), (n, 2, 2))
        everything_retained = NodalConditions(frame, np.zeros((n, 2), bool), np.zeros((n, 2)), np.ones((n, 2), bool))
        name = "the single layer operator"
        system = MixedSystem(self.mesh, self.material, everything_retained, name, np.zeros((n, 2)), slopes=self.slopes)
        return system.condensed().stiffness
