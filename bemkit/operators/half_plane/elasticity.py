"""The half-plane as an elastic map: its flexibility, inverted where it is condensed as the body of an assembly."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from bemkit.arrays import ComplexArray, FloatArray, IntArray
from bemkit.operators.counts import Entries, Factorisation, FactorKind, OperationCounts
from bemkit.operators.half_plane.flexibility import mean_logarithms
from bemkit.operators.half_plane.surface import SurfaceElasticity
from bemkit.operators.linear.dense import Cholesky
from bemkit.operators.steklov_poincare.nodal_conditions import GivenData, NodalConditions, rotated
from bemkit.operators.steklov_poincare.protocol import CondensedMap


@dataclass(frozen=True, eq=False)
class HalfPlaneElasticity(SurfaceElasticity):
    """Elasticity of a half-plane seen from a strip of its surface; see `SurfaceElasticity`."""

    @cached_property
    def flexibility(self) -> FloatArray:
        """(n_elements, n_elements) array [1/Pa]: displacements along forces; see `bemkit.operators.half_plane`."""
        return np.asarray(-2.0 / (np.pi * self.material.plane_modulus) * mean_logarithms(self.places))

    @cached_property
    def places(self) -> FloatArray:
        """(n_elements + 1,) array: ends of the elements along the surface."""
        ends = self.mesh.nodes[np.append(self.mesh.elements[:, 0], self.mesh.elements[-1, 1])]
        return np.asarray((ends - ends[0]) @ self.mesh.tangents[0])

    @property
    def work(self) -> OperationCounts:
        """Operation counts of the flexibility."""
        return half_plane_work(self.mesh.n_elements)

    def _displaced(self, traction: ComplexArray) -> ComplexArray:
        force = self.mesh.lengths * traction
        along = self.flexibility @ np.stack([force.real, force.imag], axis=1)
        # forces before each element less those behind it
        sums = np.cumsum(force)
        across = 2.0 * sums - force - sums[-1]
        return np.asarray(along[:, 0] + 1j * along[:, 1] - 0.5j * self.material.plane_compressibility * across)

    @cached_property
    def full_flexibility(self) -> FloatArray:
        """(n_dofs, n_dofs) array [1/Pa] from forces to displacements, index ``2 element + component`` in x and y."""
        order = np.arange(self.mesh.n_elements)
        across = 0.5 * self.material.plane_compressibility * np.sign(order[:, None] - order)
        local = np.array([[self.flexibility, across], [-across, self.flexibility]])  # by components t and n
        axes = np.stack([self.mesh.tangents[0], self.mesh.normals[0]])
        full = np.einsum("ka,klij,lb->iajb", axes, local, axes, optimize=True).reshape(2 * order.size, -1)
        return np.asarray(0.5 * (full + full.T))

    def condense(self, conditions: NodalConditions, force: FloatArray) -> CondensedMap:
        """Solve for the forces on retained and fixed directions, at rest far away; see `SteklovPoincare.condense`."""
        acting = np.flatnonzero(~conditions.is_free)
        flexibility, stiffness = rotated(self.full_flexibility, conditions.frame), np.zeros((0, 0))
        if acting.size:
            factor = Cholesky(flexibility[np.ix_(acting, acting)], "the flexibility of the half-plane")
            stiffness = factor.solve(np.eye(acting.size))
            stiffness = 0.5 * (stiffness + stiffness.T)
        retained = np.flatnonzero(conditions.is_retained.ravel()[acting])
        condensation = _Condensation(conditions, flexibility, acting, retained, stiffness)
        condensed = condensation.under(force, conditions.displacement)
        return replace(condensed, work=half_plane_work(self.mesh.n_elements, acting.size))


def half_plane_work(n_elements: int, n_acting: int = 0) -> OperationCounts:
    """Return what a flexibility takes, and its inverse on `n_acting` directions that are retained or fixed."""
    return OperationCounts(
        element_pairs=n_elements**2,
        single_layer=Entries.full(n_elements, n_elements),
        factorisations=(Factorisation(FactorKind.CHOLESKY, n_acting),) if n_acting else (),
        right_hand_sides=n_acting,
    )


@dataclass(frozen=True, eq=False)
class _Condensation:
    """A half-plane whose forces on some directions are unknown: ``f = stiffness (u - F f_given)`` there.

    Parameters
    ----------
    conditions : NodalConditions
    flexibility : (n_dofs, n_dofs) array [1/Pa]
        In the frames of the nodes.
    acting, retained : int arrays
        Indices of the directions retained or fixed, and which of these are retained.
    stiffness : (n_acting, n_acting) array [Pa]
    """

    conditions: NodalConditions
    flexibility: FloatArray
    acting: IntArray
    retained: IntArray
    stiffness: FloatArray

    def under(self, force: FloatArray, displacement: FloatArray) -> CondensedMap:
        """Return the map under nodal forces (n_nodes, 2) in x and y and fixed displacements in the frames."""
        data = GivenData.of(self.conditions, force, displacement)
        given, held = data.force.ravel(), data.displacement.ravel()[self.acting]
        rest = self.flexibility @ given

        return _HalfPlaneMap(
            stiffness=self.stiffness[np.ix_(self.retained, self.retained)],
            load=-(self.stiffness @ (held - rest[self.acting]))[self.retained],
            condensation=self,
            given=given,
            held=held,
            rest=rest,
        )


@dataclass(frozen=True, eq=False, kw_only=True)
class _HalfPlaneMap(CondensedMap):
    """The half-plane under one load.

    Parameters
    ----------
    condensation : _Condensation
    given : (n_dofs,) array [N/m]
        Given forces in the frames.
    held : (n_acting,) array [m]
        Displacements of acting directions, the retained ones at rest.
    rest : (n_dofs,) array [m]
        What the given forces cause.
    """

    condensation: _Condensation
    given: FloatArray
    held: FloatArray
    rest: FloatArray

    def recover(self, retained_displacement: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return displacement and force of all elements."""
        displaced = self.held.copy()
        displaced[self.condensation.retained] = retained_displacement
        everywhere, total = map(self.condensation.conditions.in_plane, self._response(displaced))
        return everywhere, total

    def under(self, force: FloatArray, displacement: FloatArray) -> CondensedMap:
        """Return the map under other loads."""
        return self.condensation.under(force, displacement)

    def follow(self, directions: IntArray) -> tuple[FloatArray, FloatArray]:
        """Return what free directions do."""
        body = self.condensation
        responses = body.flexibility[np.ix_(directions, body.acting)] @ body.stiffness[:, body.retained]
        return responses, self._response(self.held)[0][directions]

    def _response(self, displaced: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return displacements and forces (n_dofs,) in the frames, those of acting directions given."""
        body = self.condensation
        forces = body.stiffness @ (displaced - self.rest[body.acting])
        everywhere, total = self.rest + body.flexibility[:, body.acting] @ forces, self.given.copy()
        everywhere[body.acting], total[body.acting] = displaced, forces
        return everywhere, total
