"""The symmetric Galerkin map."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from bemkit.arrays import FloatArray, IntArray, read_only
from bemkit.geometry.mesh import BoundaryMesh
from bemkit.geometry.quadrature import gauss_legendre
from bemkit.geometry.space import BoundarySpace, ConstantSpace, LinearSpace, dof_points
from bemkit.operators.boundary import assemble, double_layer, hypersingular, mass, single_layer
from bemkit.operators.dense import Cholesky, SingularMatrixError, multiply
from bemkit.operators.material import Material
from bemkit.operators.nodal import NodalConditions
from bemkit.operators.rigid import resting_motions
from bemkit.operators.steklov_poincare.nodes import integrate_traction, rotate_columns, rotate_rows
from bemkit.operators.steklov_poincare.protocol import CondensedMap, TractionField


@dataclass(frozen=True, eq=False)
class GalerkinFactors:
    """What a Galerkin map computes once, and what `bemkit.operators.cache` stores.

    Parameters
    ----------
    matrix : (n_dofs, n_dofs) array [Pa]
        S, symmetric.
    single_layer : Cholesky
        V = L L^T.
    strained : (n_traction_dofs, n_dofs) array
        L^-1 (1/2 M + K), without the part whose tractions exert a resultant.
    """

    matrix: FloatArray
    single_layer: Cholesky
    strained: FloatArray


class GalerkinMap:
    """Symmetric Galerkin: S = W + (1/2 M + K)^T V^-1 (1/2 M + K), with tractions in exact equilibrium.

    Parameters
    ----------
    mesh : BoundaryMesh
    material : Material
    displacement_space, traction_space : BoundarySpace, optional
        Continuous linear displacements and piecewise constant tractions unless given.

    Notes
    -----
    Paper, eq. (28). V is inverted on the tractions that exert no resultant force and moment, which makes S
    independent of the constant in the logarithm; S is symmetric, and positive definite on displacements without rigid
    motions.

    At nu = 1/2 a uniform pressure on a loop causes no displacement, and only displacements that keep the volume are
    possible: V is then inverted on tractions without such pressures, `matrix` is S without the pressure that keeps
    the volume, and `condense` finds that pressure as one more unknown.
    """

    def __init__(
        self,
        mesh: BoundaryMesh,
        material: Material,
        displacement_space: BoundarySpace | None = None,
        traction_space: BoundarySpace | None = None,
    ) -> None:
        self.mesh = mesh
        self.material = material
        self.displacement_space = LinearSpace(mesh) if displacement_space is None else displacement_space
        self.traction_space = ConstantSpace(mesh) if traction_space is None else traction_space

    @cached_property
    def factors(self) -> GalerkinFactors:
        """What the map is made of, computed on first use."""
        u, t = self.displacement_space, self.traction_space
        v, k, w = (
            single_layer(t, t, self.material),
            double_layer(u, t, self.material),
            hypersingular(u, u, self.material),
        )
        assemble(v, k, w)
        identity = mass(u, t).matrix()
        pressures = mass(t, t).matrix() @ self._pressures
        factor = Cholesky(_without_kernel(v.matrix(), pressures), "the single layer operator")
        motions = resting_motions(self.mesh, dof_points(u))
        # polynomials do not hold a rotation of curved elements exactly: its interpolant is made a rigid motion
        at_rest, _ = np.linalg.qr(motions[:, : 0 if self.mesh.is_straight.all() else 3])
        strained = factor.solve_lower(_without(0.5 * identity + k.matrix(), at_rest))
        idle = np.column_stack([identity @ motions, pressures])
        resultant, _ = np.linalg.qr(factor.solve_lower(idle))
        if idle.shape[1]:
            strained -= multiply(resultant, multiply(resultant.T, strained))
        hyper = _without(_without(w.matrix(), at_rest).T, at_rest)
        return GalerkinFactors(_symmetric_sum(hyper, strained), factor, strained)

    @cached_property
    def _pressures(self) -> FloatArray:
        """(n_traction_dofs, n_loops) tractions that move an incompressible body nowhere; else no columns."""
        if not self.material.is_incompressible or self.mesh.is_exterior:
            return np.zeros((self.traction_space.n_dofs, 0))
        dofs = self.traction_space.element_dofs
        everywhere = np.arange(self.mesh.n_elements)
        normals = np.zeros((self.traction_space.n_dofs // 2, 2))
        normals[dofs] = self.mesh.normals_at(everywhere, self.traction_space.local_nodes)
        pressures = np.zeros((len(normals), 2, len(self.mesh.loops)))
        for number, loop in enumerate(self.mesh.loops):
            pressures[dofs[loop].ravel(), :, number] = normals[dofs[loop].ravel()]
        return pressures.reshape(-1, len(self.mesh.loops))

    @cached_property
    def _volume(self) -> FloatArray:
        """(n_dofs, 0 or 1) change of volume per displacement dof of an incompressible body."""
        total = self._pressures.sum(axis=1, keepdims=True)[:, : min(self._pressures.shape[1], 1)]
        return np.asarray(mass(self.displacement_space, self.traction_space).matrix().T @ total)

    def keep(self, factors: GalerkinFactors) -> None:
        """Take over the factors of an equal map, so that nothing is assembled any more."""
        self.__dict__["factors"] = factors  # where cached_property keeps its value

    def matrix(self) -> FloatArray:
        """Return the weak, symmetric matrix [Pa]; rigid motions are its kernel, and an exterior has none."""
        return self.factors.matrix

    def nodal_forces(self, elements: IntArray, traction: TractionField) -> FloatArray:
        """Return the consistent nodal forces of a traction field on some elements."""
        return integrate_traction(self.displacement_space, elements, traction)

    def condense(self, conditions: NodalConditions, force: FloatArray) -> CondensedMap:
        """Eliminate every direction that is not open by a Schur complement."""
        n = force.shape[0]
        matrix = rotate_rows(rotate_columns(self.matrix(), conditions.frame), conditions.frame)
        free, is_open, fixed = (
            np.flatnonzero(x) for x in (conditions.is_free, conditions.is_open, conditions.is_fixed)
        )
        factor = Cholesky(matrix[np.ix_(free, free)], "the body held by its supports and its contact boundary")
        coupling = matrix[np.ix_(free, is_open)]
        volume = rotate_rows(self._volume, conditions.frame)
        # what tangential motions change the volume by is round-off, and no room for an incompressible body
        room = np.where(np.abs(volume) > 1e-14 * np.abs(volume).max(initial=0.0), volume, 0.0)
        held = _HeldVolume(factor, room[free])
        response, pressures = held.solve(-coupling, -volume[is_open].T)
        stiffness = matrix[np.ix_(is_open, is_open)] + multiply(coupling.T, response) + volume[is_open] @ pressures
        stiffness = 0.5 * (stiffness + stiffness.T)
        of_fixed = matrix[:, fixed]
        sensitivity = np.abs(self.matrix()).sum(axis=0).reshape(n, 2)

        def under(force: FloatArray, displacement: FloatArray) -> CondensedMap:
            prescribed = displacement.ravel()[fixed]
            known = np.einsum("nkc,nc->nk", conditions.frame, force).ravel() - of_fixed @ prescribed
            at_rest, pressure = held.solve(known[free], -volume[fixed].T @ prescribed)
            load = known[is_open] - coupling.T @ at_rest - volume[is_open] @ pressure

            def recover(open_displacement: FloatArray) -> tuple[FloatArray, FloatArray]:
                local = np.empty(2 * n)
                local[fixed] = prescribed
                local[is_open] = open_displacement
                local[free] = at_rest + response @ open_displacement
                displacement = np.einsum("nkc,nk->nc", conditions.frame, local.reshape(n, 2))
                force = self.matrix() @ displacement.ravel()
                force += self._volume @ (pressure + pressures @ open_displacement)
                return displacement, force.reshape(n, 2)

            return CondensedMap(stiffness, load, recover, under, sensitivity)

        return under(force, conditions.displacement)

    def tractions(self, displacement: FloatArray) -> FloatArray:
        """Return the traction dofs (n_scalar, 2) [Pa] that belong to nodal displacements (n_nodes, 2) [m].

        Of an incompressible body they lack the pressures, which displacements do not tell.
        """
        factors = self.factors
        return factors.single_layer.solve_upper(factors.strained @ displacement.ravel()).reshape(-1, 2)

    def element_tractions(self, displacement: FloatArray, force: FloatArray) -> FloatArray:
        """Return the (n_elements, 2) mean tractions of V^-1 (1/2 M + K) u."""
        points, weights = gauss_legendre(self.traction_space.degree + 1)
        mean = self.traction_space.basis(points) @ weights / 2.0
        tractions = self.tractions(displacement)
        if self._pressures.shape[1]:
            identity = mass(self.displacement_space, self.traction_space).matrix()
            missing = force.ravel() - identity.T @ tractions.ravel()
            sizes = np.linalg.lstsq(identity.T @ self._pressures, missing, rcond=None)[0]
            tractions = tractions + (self._pressures @ sizes).reshape(-1, 2)
        at_dofs = tractions[self.traction_space.element_dofs]
        means: FloatArray = np.einsum("p,epc->ec", mean, at_dofs)
        return means


@dataclass(frozen=True, eq=False)
class _HeldVolume:
    """Solves for the free displacements, with the pressure that keeps the volume of an incompressible body.

    Parameters
    ----------
    stiffness : Cholesky
        Of the free directions.
    volume : (n_free, 0 or 1) array
        Their change of volume; no column for a compressible body.
    """

    stiffness: Cholesky
    volume: FloatArray

    @cached_property
    def _compliance(self) -> tuple[FloatArray, FloatArray]:
        """Displacements under a unit pressure, and the volume that they yield."""
        displacement = self.stiffness.solve(self.volume)
        yielded = self.volume.T @ displacement
        if yielded.size and not yielded.min() > 0.0:
            raise SingularMatrixError(
                "the incompressible body (poisson_ratio 0.5) has no free boundary to make room: leave a part free"
            )
        return displacement, yielded

    def solve(self, right: FloatArray, volume: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return displacements and pressure for given forces (n_free, ...) and changes of volume (0 or 1, ...)."""
        free = self.stiffness.solve(right)
        if not self.volume.shape[1]:
            return free, np.zeros(volume.shape)
        displacement, yielded = self._compliance
        pressure = (self.volume.T @ free - volume) / yielded[0, 0]
        return free - displacement @ pressure, pressure


def _symmetric_sum(hyper: FloatArray, strained: FloatArray) -> FloatArray:
    """Return the symmetric part of `hyper` plus strained^T strained, read-only."""
    from scipy.linalg.blas import dsyrk

    half: FloatArray = dsyrk(1.0, strained, trans=1, lower=1)  # column-major, zero above the diagonal
    half[np.diag_indices_from(half)] *= 0.5
    half += 0.5 * hyper.T
    matrix = half + half.T
    read_only(matrix)
    return matrix


def _without(matrix: FloatArray, motions: FloatArray) -> FloatArray:
    """Return the matrix made to vanish on some orthonormal motions (n_dofs, n_motions)."""
    if not motions.shape[1]:
        return matrix
    return matrix - multiply(multiply(matrix, motions), np.ascontiguousarray(motions.T))


def _without_kernel(matrix: FloatArray, directions: FloatArray) -> FloatArray:
    """Add a mean eigenvalue along directions that the matrix may annihilate; they are projected out later."""
    if not directions.shape[1]:
        return matrix
    unit, _ = np.linalg.qr(directions)
    raised: FloatArray = matrix + np.trace(matrix) / len(matrix) * unit @ unit.T
    return raised
