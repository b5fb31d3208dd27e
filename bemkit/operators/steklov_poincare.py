"""Steklov-Poincare maps: from the displacement of the boundary to its tractions, by Galerkin or by collocation.

On bounded bodies both maps hold their tractions in exact equilibrium of forces and moments, as the continuous map
does. Discretisation alone would break it slightly, and with it the independence of the arbitrary constant in the
logarithm of the single layer.

On the exterior of a body (`BoundaryMesh.is_exterior`) no motion is free of tractions, and tractions may have a
resultant F. The displacement then grows like F log(r / r0) with the distance r, and nothing but the choice of r0, the
diameter of the mesh, fixes its constant; without a resultant it vanishes at infinity, rotation included.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Protocol

import numpy as np

from bemkit.arrays import BoolArray, FloatArray, IntArray, read_only
from bemkit.geometry.mesh import BoundaryMesh
from bemkit.geometry.quadrature import gauss_legendre
from bemkit.geometry.space import BoundarySpace, ConstantSpace, LinearSpace, dof_points
from bemkit.operators.boundary import assemble, double_layer, hypersingular, mass, single_layer
from bemkit.operators.collocation import collocation_matrices
from bemkit.operators.dense import Cholesky, DenseLU, SingularMatrixError, multiply
from bemkit.operators.material import Material
from bemkit.operators.nodal import NodalConditions
from bemkit.operators.rigid import resting_motions

Field = Callable[[FloatArray], FloatArray]
"""A vector field: (n, 2) points [m] -> (n, 2) values."""


@dataclass(frozen=True, eq=False)
class CondensedMap:
    """A body reduced to its open directions: force = stiffness @ displacement - load.

    Parameters
    ----------
    stiffness : (n_open, n_open) array
        In weak form (forces, not tractions).
    load : (n_open,) array
        What the given loads and supports press onto the open directions.
    recover : callable
        (n_open,) displacements -> displacement (n_nodes, 2) and total boundary force (n_nodes, 2) of all nodes, in x
        and y.
    under : callable
        Other given forces (n_nodes, 2) in x and y and prescribed displacements (n_nodes, 2) in the frames of the
        nodes -> the same body under them, without another factorisation.
    sensitivity : (n_nodes, 2) array, optional
        Sum of the sizes of all forces that a unit displacement of each node causes. Of thin bodies it is many orders
        above the forces themselves, which then are differences and carry its round-off.
    """

    stiffness: FloatArray
    load: FloatArray
    recover: Callable[[FloatArray], tuple[FloatArray, FloatArray]]
    under: Callable[[FloatArray, FloatArray], CondensedMap]
    sensitivity: FloatArray | None = None


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


class SteklovPoincare(Protocol):
    """The elastic body seen from its boundary: weak forces = matrix @ displacements."""

    @property
    def displacement_space(self) -> BoundarySpace:
        """The space of the displacements; its nodes carry the forces."""

    def matrix(self) -> FloatArray:
        """Return the weak (n_dofs, n_dofs) matrix [Pa]; its forces are in equilibrium."""

    def nodal_forces(self, elements: IntArray, traction: Field) -> FloatArray:
        """Return the (n_nodes, 2) nodal forces [N/m] of a traction field [Pa] on some elements."""

    def condense(self, conditions: NodalConditions, force: FloatArray) -> CondensedMap:
        """Eliminate every direction that is not open, with the given nodal forces (n_nodes, 2) on the free ones."""

    def element_tractions(self, displacement: FloatArray, force: FloatArray) -> FloatArray:
        """Return the (n_elements, 2) mean tractions [Pa] that belong to what `CondensedMap.recover` gives."""


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
        at_rest, _ = np.linalg.qr(motions)
        strained = factor.solve_lower(_without(0.5 * identity + k.matrix(), at_rest))
        idle = np.column_stack([identity @ motions, pressures])
        resultant, _ = np.linalg.qr(factor.solve_lower(idle))
        if idle.shape[1]:
            strained -= multiply(resultant, multiply(resultant.T, strained))
        hyper = _without(_without(w.matrix(), at_rest).T, at_rest)
        return GalerkinFactors(_symmetric_sum(hyper, strained), factor, strained)

    @cached_property
    def _pressures(self) -> FloatArray:
        """(n_traction_dofs, n_loops) tractions that an incompressible body answers by no displacement; else no columns."""
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

    def nodal_forces(self, elements: IntArray, traction: Field) -> FloatArray:
        """Return the consistent nodal forces of a traction field on some elements."""
        return _integrate(self.displacement_space, elements, traction)

    def condense(self, conditions: NodalConditions, force: FloatArray) -> CondensedMap:
        """Eliminate every direction that is not open by a Schur complement."""
        n = force.shape[0]
        matrix = _rotate_rows(_rotate_columns(self.matrix(), conditions.frame), conditions.frame)
        free, is_open, fixed = (
            np.flatnonzero(x) for x in (conditions.is_free, conditions.is_open, conditions.is_fixed)
        )
        factor = Cholesky(matrix[np.ix_(free, free)], "the body held by its supports and its contact boundary")
        coupling = matrix[np.ix_(free, is_open)]
        volume = _rotate_rows(self._volume, conditions.frame)
        held = _HeldVolume(factor, volume[free])
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


class CollocationMap:
    """Direct collocation with constant elements, (1/2 + T) u = U t at their midpoints, with tractions in equilibrium.

    Parameters
    ----------
    mesh : BoundaryMesh
    material : Material

    Notes
    -----
    The paper's discretisation. Plain collocation satisfies the equilibrium of forces and moments only up to the
    discretisation error. Here a rigid motion c is added to the equations and the resultants of the tractions are set
    to zero; c vanishes with the mesh size. Translations cause no tractions at all; a rotation, which constant
    elements cannot represent, causes some of the order of the discretisation error. On an exterior neither c nor the
    condition on the resultants is there.
    """

    def __init__(self, mesh: BoundaryMesh, material: Material) -> None:
        self.mesh = mesh
        self.material = material
        self.displacement_space = ConstantSpace(mesh)

    @cached_property
    def _weights(self) -> FloatArray:
        """Length of the element of each dof."""
        return np.repeat(self.mesh.lengths, 2)

    @cached_property
    def _motions(self) -> FloatArray:
        return resting_motions(self.mesh, self.mesh.centres)

    @cached_property
    def _matrices(self) -> tuple[FloatArray, FloatArray]:
        """The single layer U and 1/2 + T."""
        single, double = collocation_matrices(self.mesh, self.material)
        double[np.diag_indices_from(double)] += 0.5
        return single, double

    @cached_property
    def _matrix(self) -> FloatArray:
        single, double = self._matrices
        factor = DenseLU(
            self._bordered(single, np.ones(single.shape[1], bool), self._motions), "the single layer operator"
        )
        tractions = factor.solve(np.vstack([double, np.zeros((self._motions.shape[1], double.shape[1]))]))[
            : len(double)
        ]
        matrix: FloatArray = self._weights[:, None] * tractions
        read_only(matrix)
        return matrix

    def matrix(self) -> FloatArray:
        """Return the weak (n_dofs, n_dofs) matrix [Pa]; it is not symmetric."""
        return self._matrix

    def nodal_forces(self, elements: IntArray, traction: Field) -> FloatArray:
        """Return the resultants of a traction field on the elements."""
        return _integrate(self.displacement_space, elements, traction)

    def _bordered(self, columns: FloatArray, is_traction: BoolArray, motions: FloatArray) -> FloatArray:
        """Border a system with the rigid motion c and the resultants of its traction unknowns, by the mean length."""
        n = columns.shape[0]
        order = n + self._motions.shape[1]
        bordered = np.zeros((order, order), order="F")
        bordered[:n, :n] = columns
        bordered[:n, n:] = self._motions
        scale = self._weights / self._weights.mean()
        bordered[n:, :n] = np.where(is_traction, (scale[:, None] * motions).T, 0.0)
        return bordered

    def condense(self, conditions: NodalConditions, force: FloatArray) -> CondensedMap:
        """Exchange columns so that all unknowns but the open displacements stand on the left, and solve once."""
        n = force.shape[0]
        single, double = (_rotate_columns(matrix, conditions.frame) for matrix in self._matrices)
        motions = _rotate_columns(self._motions.T, conditions.frame).T
        free, is_open, fixed = (
            np.flatnonzero(x) for x in (conditions.is_free, conditions.is_open, conditions.is_fixed)
        )
        is_traction = ~conditions.is_free.ravel()
        factor = DenseLU(
            self._bordered(np.where(is_traction, -single, double), is_traction, motions),
            "the body held by its supports and its contact boundary",
        )
        right = np.zeros((2 * n + motions.shape[1], is_open.size), order="F")
        right[: 2 * n] = -double[:, is_open]
        response = factor.solve(right)[: 2 * n]
        of_traction, of_fixed, resting = single[:, free], double[:, fixed], motions[free]
        scale = (self._weights / self._weights.mean())[free]
        weights = self._weights[is_open]

        def under(force: FloatArray, displacement: FloatArray) -> CondensedMap:
            traction = np.einsum("nkc,nc->nk", conditions.frame, force).ravel() / self._weights
            prescribed = displacement.ravel()[fixed]
            known = of_traction @ traction[free] - of_fixed @ prescribed
            at_rest = factor.solve(np.concatenate([known, -(scale * traction[free]) @ resting]))[: 2 * n]
            load = weights * (traction[is_open] - at_rest[is_open])

            def recover(open_displacement: FloatArray) -> tuple[FloatArray, FloatArray]:
                unknowns = at_rest + response @ open_displacement
                local = np.where(is_traction, 0.0, unknowns)
                local[fixed] = prescribed
                local[is_open] = open_displacement
                local_force = self._weights * np.where(is_traction, unknowns, traction)
                displacement = np.einsum("nkc,nk->nc", conditions.frame, local.reshape(n, 2))
                return displacement, np.einsum("nkc,nk->nc", conditions.frame, local_force.reshape(n, 2))

            return CondensedMap(weights[:, None] * response[is_open], load, recover, under)

        return under(force, conditions.displacement)

    def element_tractions(self, displacement: FloatArray, force: FloatArray) -> FloatArray:
        """Return the (n_elements, 2) tractions."""
        return force / self.mesh.lengths[:, None]


def _integrate(space: BoundarySpace, elements: IntArray, field: Field) -> FloatArray:
    """Integrate a vector field against the scalar basis functions of a space over some elements."""
    points, weights = gauss_legendre(space.degree + 5)  # exact for tractions up to the ninth power of the coordinates
    places = space.mesh.points(elements, points)
    values = field(places.reshape(-1, 2)).reshape(places.shape)
    measure = space.mesh.jacobian(elements, points) * weights
    local = np.einsum("eq,pq,eqc->epc", measure, space.basis(points), values)
    result = np.zeros((space.n_dofs // 2, 2))
    np.add.at(result, space.element_dofs[elements], local)
    return result


def _symmetric_sum(hyper: FloatArray, strained: FloatArray) -> FloatArray:
    """Return the symmetric part of `hyper` plus strained^T strained, read-only."""
    from scipy.linalg.blas import dsyrk

    matrix: FloatArray = 0.5 * (hyper + hyper.T)
    product = dsyrk(1.0, strained, trans=1, lower=1)
    matrix += product
    matrix += np.tril(product, -1).T
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
    return matrix + np.trace(matrix) / len(matrix) * unit @ unit.T


def _rotate_columns(matrix: FloatArray, frame: FloatArray) -> FloatArray:
    """Express the columns (2 * node + component) in the frames of the nodes."""
    turned = np.flatnonzero(np.any(frame != np.eye(2), axis=(1, 2)))
    if not turned.size:
        return matrix
    result = matrix.copy()
    x, y = matrix[:, 2 * turned], matrix[:, 2 * turned + 1]
    for k in range(2):
        result[:, 2 * turned + k] = frame[turned, k, 0] * x + frame[turned, k, 1] * y
    return result


def _rotate_rows(matrix: FloatArray, frame: FloatArray) -> FloatArray:
    """Express the rows (2 * node + component) in the frames of the nodes."""
    turned = np.flatnonzero(np.any(frame != np.eye(2), axis=(1, 2)))
    if not turned.size:
        return matrix
    result = matrix.copy()
    x, y = matrix[2 * turned], matrix[2 * turned + 1]
    for k in range(2):
        result[2 * turned + k] = frame[turned, k, 0, None] * x + frame[turned, k, 1, None] * y
    return result
