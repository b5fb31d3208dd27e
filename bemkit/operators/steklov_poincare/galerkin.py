"""The symmetric Galerkin map."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from bemkit.arrays import FloatArray, IntArray, read_only
from bemkit.errors import InputError
from bemkit.geometry.local_values import values_on_elements
from bemkit.geometry.mesh import BoundaryMesh
from bemkit.geometry.quadrature import gauss_legendre
from bemkit.geometry.reflection import antisymmetric_dofs
from bemkit.geometry.spaces import BoundarySpace, ConstantSpace, LinearSpace, dof_points, element_nodes
from bemkit.geometry.vectors import turned_right
from bemkit.operators.counts import OperationCounts
from bemkit.operators.forms import mass_matrix
from bemkit.operators.linear.dense import Cholesky, multiply
from bemkit.operators.linear.solvers import (
    Automatic,
    DenseCholesky,
    Hierarchical,
    LinearSolver,
    LinearSolverChoice,
    MatrixFree,
)
from bemkit.operators.material import Material
from bemkit.operators.pair_form import Tag
from bemkit.operators.rigid_modes import traction_free_modes
from bemkit.operators.steklov_poincare.cost import BodyCase, BodyCost, galerkin_cost
from bemkit.operators.steklov_poincare.layer_operators import assemble_layers, dilatation_of
from bemkit.operators.steklov_poincare.nodal_conditions import NodalConditions, integrate_traction
from bemkit.operators.steklov_poincare.protocol import BoundaryMap, CondensedMap
from bemkit.operators.steklov_poincare.schur import SchurCondensation
from bemkit.operators.steklov_poincare.volume_constraint import Volume

_DIRECT = DenseCholesky()
_MIRRORED = 128
"""Rows that are mirrored at a time, so that they stay in the cache."""
_NEARLY_INCOMPRESSIBLE = 0.49
"""Poisson's ratio up to which errors of the pressure in a curved hole are those of the discretisation."""
_HELD_BODY = "the body held by its supports and its contact boundary"


@dataclass(frozen=True, eq=False)
class GalerkinFactors:
    """The matrices that a Galerkin map computes once.

    Parameters
    ----------
    matrix : (n_dofs, n_dofs) array [Pa]
        S, symmetric, without the uniform pressure.
    single_layer : Cholesky
        V = L L^T.
    whitened_trace : (n_traction_dofs, n_dofs) array
        L^-1 (1/2 M + K), less the part whose tractions exert a resultant.
    work : OperationCounts
        Operations of their assembly and factorisation.
    """

    matrix: FloatArray
    single_layer: Cholesky
    whitened_trace: FloatArray
    work: OperationCounts = field(default_factory=OperationCounts)


class GalerkinElasticity(BoundaryMap):
    """Elasticity of a body by symmetric Galerkin, S = W + B^T V^-1 B with B = 1/2 M + K.

    Parameters
    ----------
    mesh : BoundaryMesh
    material : Material
    displacement_space, traction_space : BoundarySpace, optional
        Continuous linear displacements and piecewise constant tractions unless given.
    linear_solver : LinearSolver
        How `condense` solves for the free displacements: by forming S and factoring it unless given otherwise.

    Raises
    ------
    InputError
        If `linear_solver` is ``Automatic()``: that choice is made once, by the plan of a scene.

    Notes
    -----
    [Paper], eq. (28); [Steinbach2008]. V is inverted on the tractions that exert no resultant force and moment, so that
    all tractions are in exact equilibrium and S is independent of the constant in the logarithm; S is symmetric, and
    positive definite on displacements without rigid motions.

    At nu = 1/2 a uniform pressure on a loop causes no displacement, and only displacements that keep the volume are
    possible: V is then inverted on tractions without such pressures, the matrix is S without the pressure that keeps
    the volume, and `condense` finds that pressure as one more unknown, as it does for compressible bodies.
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
                f"linear_solver is {linear_solver}: give DenseCholesky(), or the result of "
                "bemkit.operators.linear.solvers.choose_linear_solver"
            )
        self.linear_solver: LinearSolver = linear_solver

    @property
    def tags(self) -> frozenset[Tag]:
        """Symmetric and semidefinite; the kernel are the rigid motions that the space holds, of a bounded body."""
        tags = {Tag.SYMMETRIC, Tag.POSITIVE_SEMIDEFINITE}
        return frozenset(tags if self.mesh.is_exterior else tags | {Tag.KILLS_RIGID_MOTIONS})

    def cost(self, case: BodyCase) -> BodyCost:
        """Return counts, memory and time of the map."""
        return galerkin_cost(case, self.traction_space.n_dofs, self.displacement_space.degree)

    @cached_property
    def factors(self) -> GalerkinFactors:
        """Matrices of the operator, computed on first use."""
        layers = assemble_layers(self.displacement_space, self.traction_space, self.material, self._pressures)
        matrix = _symmetric_sum(layers.hypersingular, layers.whitened_trace)
        return GalerkinFactors(matrix, layers.single_layer, layers.whitened_trace, layers.work)

    @cached_property
    def _pressures(self) -> FloatArray:
        """(n_traction_dofs, n_pressures) uniform pressures, for which the map takes normals that are exact.

        That of the whole boundary, those of each loop of an incompressible body; none of a compressible exterior.
        """
        dofs = self.traction_space.element_dofs
        everywhere = np.arange(self.mesh.n_elements)
        normals = np.zeros((self.traction_space.n_dofs // 2, 2))
        normals[dofs] = self.mesh.normals_at(everywhere, element_nodes(self.traction_space))
        pressures = np.zeros((len(normals), 2, len(self._pressed)))
        for number, elements in enumerate(self._pressed):
            pressures[dofs[elements].ravel(), :, number] = normals[dofs[elements].ravel()]
        return pressures.reshape(self.traction_space.n_dofs, -1)

    @property
    def _pressed(self) -> tuple[IntArray, ...]:
        """The elements under each of the uniform pressures."""
        if self.material.is_incompressible:
            return self.mesh.loops
        return () if self.mesh.is_exterior else (np.arange(self.mesh.n_elements),)

    @cached_property
    def _flux(self) -> FloatArray:
        """(n_dofs, 1) change of volume per displacement dof; no column for an exterior."""
        fluxes = self._fluxes(() if self.mesh.is_exterior else self._pressed)
        return np.asarray(fluxes.sum(axis=1, keepdims=True)[:, : fluxes.shape[1]])

    def _fluxes(self, parts: Sequence[IntArray]) -> FloatArray:
        """Return the (n_dofs, n_parts) changes of volume per displacement dof on parts of the boundary.

        Normals are integrated along the curves: those that traction dofs interpolate let a curved body gain volume.
        """
        fluxes = [
            integrate_traction(self.displacement_space, elements, lambda _, normals: normals).ravel()
            for elements in parts
        ]
        flux: FloatArray = np.array(fluxes).reshape(-1, self.displacement_space.n_dofs)
        flux[:, antisymmetric_dofs(self.displacement_space)] = 0.0
        # the interpolant of a rotation changes the volume of curved elements; a rigid motion does not
        motions = traction_free_modes(self.mesh, dof_points(self.displacement_space))
        return np.asarray(flux.T - motions @ np.linalg.lstsq(motions, flux.T, rcond=None)[0])

    @cached_property
    def _volume(self) -> Volume:
        """The change of volume, on which the uniform pressure works.

        Curved elements hold normals n only by interpolation; the rest of them, which does not vanish with 1 - 2 nu as
        V n does, would resist every change of volume of a nearly incompressible body. Exact normals are among the
        tractions instead. With the dilatation x, whose tractions are n / beta, beta the compressibility, and the flux f
        of displacements, the identities V n = beta (1/2 + K) x and (1/2 + K') n = n - beta W x give
        (f - beta W x) u = beta x (f - beta W x) p. On the other tractions, <V n, t> = 0, W x is S x.
        """
        total = self._flux
        if self.material.is_incompressible or self.mesh.is_exterior:
            return Volume(total, 0.0)
        beta, dilatation = self.material.plane_compressibility, dilatation_of(self.displacement_space)[:, None]
        change = total - beta * multiply(self.factors.matrix, dilatation)
        return Volume(change, beta * float(np.vdot(dilatation, change)))

    def stiffness(self) -> FloatArray:
        """Return S, (n_dofs, n_dofs) [Pa]; of an incompressible body without the pressure that keeps the volume."""
        if not self._volume.compliance:
            return self.factors.matrix
        change = self._volume.change
        return np.asarray(self.factors.matrix + change @ change.T / self._volume.compliance)

    def condense(self, conditions: NodalConditions, force: FloatArray) -> CondensedMap:
        """Eliminate every direction that is not retained, by a Schur complement, with the linear solver of the map."""
        condensation = SchurCondensation(self.factors.matrix, self._volume, conditions, self.linear_solver, _HELD_BODY)
        first = condensation.under(force, conditions.displacement)
        return replace(first, work=self.factors.work + condensation.work + first.work)

    def tractions(self, displacement: FloatArray) -> FloatArray:
        """Return the traction dofs (n_scalar, 2) [Pa] that belong to nodal displacements (n_nodes, 2) [m].

        Of an incompressible body they lack the pressures, which displacements do not give; those on curved loops of a
        nearly incompressible one they hardly determine.
        """
        factors = self.factors  # V^-1 (1/2 M + K) u on tractions without uniform pressures
        rest = factors.single_layer.solve_upper(factors.whitened_trace @ displacement.ravel())
        if self.material.is_incompressible or self.mesh.is_exterior:
            return rest.reshape(-1, 2)
        # the pressure by the work on the dilatation, whose forces are the flux over the compressibility
        arms, flux, of_dilatation = self._dilatation
        work = flux @ displacement.ravel() / self.material.plane_compressibility
        tension = (work - arms @ rest) / of_dilatation
        return np.asarray(rest + tension * self._pressures[:, 0]).reshape(-1, 2)

    @cached_property
    def _dilatation(self) -> tuple[FloatArray, FloatArray, float]:
        """The work of tractions on the dilatation x, of pressures on displacements, and of pressures on x."""
        everywhere, centre, flux = np.arange(self.mesh.n_elements), self.mesh.centre, self._flux[:, 0]
        arms = integrate_traction(self.traction_space, everywhere, lambda points, _: points - centre).ravel()
        return arms, flux, float(flux @ dilatation_of(self.displacement_space))

    def element_tractions(self, displacement: FloatArray, force: FloatArray) -> FloatArray:
        """Return the (n_elements, n_local, 2) tractions V^-1 (1/2 M + K) u, with the pressures that `force` determines.

        Around a hole V n is of the order of the compressibility. Curved elements interpolate the normal n, so their V n
        has an error, which causes an error of the pressure that grows without bound as Poisson's ratio approaches 1/2.
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
        """Whether displacements do not, or hardly, determine the pressures on the loops."""
        has_curved_holes = (self.mesh.is_exterior or len(self.mesh.loops) > 1) and not self.mesh.is_straight.all()
        is_nearly = self.material.effective_poisson_ratio > _NEARLY_INCOMPRESSIBLE
        return self.material.is_incompressible or bool(is_nearly and has_curved_holes)

    def _normals_of_true_mean(self) -> FloatArray:
        """Return the normals (n_elements, n_local, 2) at the local nodes, with the mean of those along the curve."""
        space, mesh = self.traction_space, self.mesh
        xi, weights = gauss_legendre(space.degree + 1)
        normals = mesh.normals_at(np.arange(mesh.n_elements), space.local_nodes)
        mean = np.einsum("p,epc->ec", space.basis(xi) @ weights / 2.0, normals)
        true_mean = turned_right(mesh.end - mesh.start) / mesh.lengths[:, None]
        shifted: FloatArray = normals + (true_mean - mean)[:, None]
        return shifted


def _symmetric_sum(hyper: FloatArray, whitened_trace: FloatArray) -> FloatArray:
    """Return `hyper`, symmetric, plus whitened_trace^T whitened_trace, read-only; `hyper` is overwritten."""
    from scipy.linalg.blas import dsyrk

    # one triangle, row-major that above the diagonal, which is then copied below it
    column_major = hyper.T if hyper.flags.c_contiguous else hyper
    matrix: FloatArray = dsyrk(1.0, whitened_trace.T, beta=1.0, c=column_major, lower=1, overwrite_c=1).T
    for begin in range(0, len(matrix), _MIRRORED):
        own, after = slice(begin, begin + _MIRRORED), slice(begin + _MIRRORED, None)
        matrix[after, own] = matrix[own, after].T
        matrix[own, own] = np.triu(matrix[own, own]) + np.triu(matrix[own, own], 1).T
    read_only(matrix)
    return matrix
