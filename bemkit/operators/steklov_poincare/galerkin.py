"""The symmetric Galerkin map."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import cached_property

import numpy as np

from bemkit.arrays import FloatArray, IntArray
from bemkit.errors import InputError
from bemkit.geometry.local_values import values_on_elements
from bemkit.geometry.mesh import BoundaryMesh
from bemkit.geometry.quadrature import gauss_legendre
from bemkit.geometry.spaces import BoundarySpace, ConstantSpace, LinearSpace, dof_points, element_nodes
from bemkit.geometry.symmetry.images import antisymmetric_dofs
from bemkit.geometry.vectors import turned_right
from bemkit.operators.counts import Entries, Factorisation, FactorKind, OperationCounts
from bemkit.operators.forms import mass_matrix
from bemkit.operators.linear_solvers import (
    Automatic,
    DenseCholesky,
    Hierarchical,
    LinearSolver,
    LinearSolverChoice,
    MatrixFree,
    Tag,
    multiply,
)
from bemkit.operators.material import Material
from bemkit.operators.rigid_modes import admissible_modes, traction_free_modes
from bemkit.operators.steklov_poincare import BoundaryMap, CondensedMap
from bemkit.operators.steklov_poincare.layer_operators import GalerkinFactors, dilatation_of, galerkin_factors
from bemkit.operators.steklov_poincare.nodal_conditions import GivenData, NodalConditions, integrate_traction
from bemkit.operators.steklov_poincare.schur import SchurCondensation
from bemkit.operators.steklov_poincare.volume_constraint import Volume

_DIRECT = DenseCholesky()
_NEARLY_INCOMPRESSIBLE = 0.49
"""Poisson's ratio above which displacements hardly determine the pressure in a curved hole."""
_HELD_BODY = "the body held by its supports and its contact boundary"


class GalerkinElasticity(BoundaryMap):
    """Elasticity of a body by symmetric Galerkin, S = W + B^T V^-1 B with B = 1/2 M + K.

    Parameters
    ----------
    mesh : BoundaryMesh
    material : Material
    displacement_space, traction_space : BoundarySpace, optional
        By default continuous linear displacements and piecewise constant tractions.
    linear_solver : LinearSolver
        Solver of `condense` for the free displacements; by default S is formed and factored.

    Raises
    ------
    InputError
        If `linear_solver` is ``Automatic()``: that choice is made once, by the plan of a scene.

    Notes
    -----
    [Paper], eq. (28); [Steinbach2008]. V is inverted on tractions without resultant force and moment. All tractions are
    then in exact equilibrium, and S does not depend on the constant in the logarithm. S is symmetric, and positive
    definite on displacements without rigid motions.

    At nu = 1/2 a uniform pressure on a loop causes no displacement, and displacements keep the volume. V is then
    inverted on tractions without such pressures, the matrix is S without the uniform pressure, and `condense` solves
    for that pressure as an additional unknown, as it does for compressible bodies.
    """

    def __init__(
        self,
        mesh: BoundaryMesh,
        material: Material,
        displacement_space: BoundarySpace | None = None,
        traction_space: BoundarySpace | None = None,
        linear_solver: LinearSolverChoice = _DIRECT,
    ) -> None:
        self.mesh = mesh
        self.material = material
        self.displacement_space = LinearSpace(mesh) if displacement_space is None else displacement_space
        self.traction_space = ConstantSpace(mesh) if traction_space is None else traction_space
        if isinstance(linear_solver, Automatic | Hierarchical | MatrixFree):
            raise InputError(
                f"linear_solver is {linear_solver}, by which scenes choose one: give DenseCholesky() or your own"
            )
        self.linear_solver: LinearSolver = linear_solver

    @property
    def tags(self) -> frozenset[Tag]:
        """Symmetric and positive semidefinite; rigid motions in the space are the kernel of a bounded body."""
        tags = {Tag.SYMMETRIC, Tag.POSITIVE_SEMIDEFINITE}
        return frozenset(tags if self.mesh.is_exterior else tags | {Tag.KILLS_RIGID_MOTIONS})

    def counts(self, conditions: NodalConditions, loads: Sequence[GivenData]) -> OperationCounts:
        """Return the operation counts of `condense` and of all load steps; no matrix is formed."""
        t, u, mesh = self.traction_space.n_dofs, self.displacement_space.n_dofs, self.mesh
        # right-hand sides with V: displacements, resultants and pressures; with the body: its volume
        n_columns = u + len(admissible_modes(mesh)) + len(self._pressed) + int(not mesh.is_exterior)
        return OperationCounts(
            element_pairs=mesh.n_elements * mesh.whole.n_elements,
            single_layer=Entries.full(t, t),
            double_layer=Entries.full(t, u),
            hypersingular=Entries.full(u, u),
            factorisations=tuple(Factorisation(FactorKind.CHOLESKY, order) for order in (t, conditions.n_free)),
            right_hand_sides=n_columns + conditions.n_retained + len(loads),
        )

    @cached_property
    def factors(self) -> GalerkinFactors:
        """Matrices of the operator, computed on first use."""
        return galerkin_factors(self.displacement_space, self.traction_space, self.material, self._pressures)

    @cached_property
    def _pressures(self) -> FloatArray:
        """(n_traction_dofs, n_pressures) array: uniform pressures with exact normals.

        A compressible body has one on its whole boundary, an incompressible body one on each loop, and a compressible
        exterior none.
        """
        dofs = self.traction_space.element_dofs
        elements = np.arange(self.mesh.n_elements)
        normals = np.zeros((self.traction_space.n_dofs // 2, 2))
        normals[dofs] = self.mesh.normals_at(elements, element_nodes(self.traction_space))
        pressures = np.zeros((len(normals), 2, len(self._pressed)))
        for index, elements in enumerate(self._pressed):
            pressures[dofs[elements].ravel(), :, index] = normals[dofs[elements].ravel()]
        return pressures.reshape(self.traction_space.n_dofs, -1)

    @property
    def _pressed(self) -> tuple[IntArray, ...]:
        """The elements under each uniform pressure."""
        if self.material.is_incompressible:
            return self.mesh.loops
        return () if self.mesh.is_exterior else (np.arange(self.mesh.n_elements),)

    @cached_property
    def _flux(self) -> FloatArray:
        """(n_dofs, 1) array: change of volume per displacement dof; an exterior has no column."""
        fluxes = self._fluxes(() if self.mesh.is_exterior else self._pressed)
        return np.asarray(fluxes.sum(axis=1, keepdims=True)[:, : fluxes.shape[1]])

    def _fluxes(self, parts: Sequence[IntArray]) -> FloatArray:
        """Return the (n_dofs, n_parts) changes of volume per displacement dof on parts of the boundary.

        Normals are integrated along the curves; with interpolated normals a curved body would gain volume.
        """
        fluxes = [
            integrate_traction(self.displacement_space, elements, lambda _, normals: normals).ravel()
            for elements in parts
        ]
        flux: FloatArray = np.array(fluxes).reshape(-1, self.displacement_space.n_dofs)
        flux[:, antisymmetric_dofs(self.displacement_space)] = 0.0
        # the interpolant of a rotation changes the volume of curved elements: remove that part
        motions = traction_free_modes(self.mesh, dof_points(self.displacement_space))
        return np.asarray(flux.T - motions @ np.linalg.lstsq(motions, flux.T, rcond=None)[0])

    @cached_property
    def _volume(self) -> Volume:
        """The change of volume, which is conjugate to the uniform pressure.

        Curved elements interpolate normals n. The interpolation error, unlike V n, does not vanish with 1 - 2 nu and
        would resist every change of volume of a nearly incompressible body. So exact normals are added to the
        tractions. Let x be the dilatation, whose tractions are n / beta with the compressibility beta, and f the flux
        of displacements. The identities V n = beta (1/2 + K) x and (1/2 + K') n = n - beta W x give (f - beta W x) u =
        beta x (f - beta W x) p. On the other tractions, with <V n, t> = 0, W x equals S x.
        """
        total = self._flux
        if self.material.is_incompressible or self.mesh.is_exterior:
            return Volume(total, 0.0, is_stiff=True)
        beta, dilatation = self.material.plane_compressibility, dilatation_of(self.displacement_space)[:, None]
        change = total - beta * multiply(self.factors.matrix, dilatation)
        compliance = beta * float(np.vdot(dilatation, change))
        return Volume(change, compliance, self.material.is_nearly_incompressible)

    def stiffness(self) -> FloatArray:
        """Return S, (n_dofs, n_dofs) [Pa]; for an incompressible body without the uniform pressure."""
        if not self._volume.compliance:
            return self.factors.matrix
        change = self._volume.change
        return np.asarray(self.factors.matrix + change @ change.T / self._volume.compliance)

    def condense(self, conditions: NodalConditions, force: FloatArray) -> CondensedMap:
        """Eliminate all directions that are not retained by a Schur complement, with the linear solver of the map."""
        condensation = SchurCondensation(self.factors.matrix, self._volume, conditions, self.linear_solver, _HELD_BODY)
        first = condensation.under(force, conditions.displacement)
        return replace(first, work=self.factors.work + condensation.work + first.work)

    def tractions(self, displacement: FloatArray) -> FloatArray:
        """Return the traction dofs (n_scalar, 2) [Pa] of nodal displacements (n_nodes, 2) [m].

        Displacements do not determine the uniform pressures of an incompressible body, which are left zero. They hardly
        determine those on curved loops of a nearly incompressible body.
        """
        factors = self.factors  # V^-1 (1/2 M + K) u on tractions without uniform pressures
        rest = factors.single_layer.solve_upper(factors.whitened_trace @ displacement.ravel())
        if self.material.is_incompressible or self.mesh.is_exterior:
            return rest.reshape(-1, 2)
        # reciprocity with the dilatation, whose forces are the flux over the compressibility, gives the pressure
        arms, flux, of_dilatation = self._dilatation
        work = flux @ displacement.ravel() / self.material.plane_compressibility
        tension = (work - arms @ rest) / of_dilatation
        return np.asarray(rest + tension * self._pressures[:, 0]).reshape(-1, 2)

    @cached_property
    def _dilatation(self) -> tuple[FloatArray, FloatArray, float]:
        """The work of tractions on the dilatation x, of a unit pressure on displacements, and of that pressure on x."""
        elements, centre, flux = np.arange(self.mesh.n_elements), self.mesh.centre, self._flux[:, 0]
        arms = integrate_traction(self.traction_space, elements, lambda points, _: points - centre).ravel()
        return arms, flux, float(flux @ dilatation_of(self.displacement_space))

    def element_tractions(self, displacement: FloatArray, force: FloatArray) -> FloatArray:
        """Return the tractions (n_elements, n_local, 2) [Pa], V^-1 (1/2 M + K) u with pressures fitted to `force`.

        Around a hole V n is of the order of the compressibility. Curved elements interpolate the normal n, so that
        their V n has an error. The resulting error of the pressure grows without bound as Poisson's ratio approaches
        1/2.
        """
        tractions = self.tractions(displacement)
        at_nodes = values_on_elements(self.traction_space, tractions)
        if self._needs_forces:
            missing = force.ravel() - mass_matrix(self.traction_space, self.displacement_space) @ tractions.ravel()
            pressures = np.linalg.lstsq(self._fluxes(self.mesh.loops), missing, rcond=None)[0]
            normals = self._normals_of_true_mean()
            for elements, pressure in zip(self.mesh.loops, pressures, strict=True):
                at_nodes[elements] += pressure * normals[elements]
        return at_nodes

    @property
    def _needs_forces(self) -> bool:
        """Whether displacements determine the pressures on the loops hardly or not at all."""
        has_curved_holes = (self.mesh.is_exterior or len(self.mesh.loops) > 1) and not self.mesh.is_straight.all()
        is_nearly = self.material.effective_poisson_ratio > _NEARLY_INCOMPRESSIBLE
        return self.material.is_incompressible or bool(is_nearly and has_curved_holes)

    def _normals_of_true_mean(self) -> FloatArray:
        """Return normals (n_elements, n_local, 2) at the local nodes, shifted to the exact mean over each element."""
        space, mesh = self.traction_space, self.mesh
        xi, weights = gauss_legendre(space.degree + 1)
        normals = mesh.normals_at(np.arange(mesh.n_elements), space.local_nodes)
        mean = np.einsum("p,epc->ec", space.basis(xi) @ weights / 2.0, normals)
        true_mean = turned_right(mesh.end - mesh.start) / mesh.lengths[:, None]
        shifted: FloatArray = normals + (true_mean - mean)[:, None]
        return shifted
