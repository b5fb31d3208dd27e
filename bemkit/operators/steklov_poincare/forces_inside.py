"""Body forces and heat for any elastic map by a particular solution, without a mesh of the domain.

Let u_p be a displacement whose stresses sigma_p balance the body forces. The rest u_h = u - u_p fulfils the map S
without body forces: S (u - u_p) = f - f_p, with f the nodal forces of all tractions and f_p those of sigma_p n. The
values of u_p at the nodes are exact, so that only u_h has a discretisation error.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from bemkit.arrays import FloatArray, IntArray, blended
from bemkit.geometry.local_values import values_on_elements
from bemkit.geometry.quadrature import gauss_legendre
from bemkit.geometry.spaces import BoundarySpace, dof_points
from bemkit.operators.rigid_modes import without_motion
from bemkit.operators.steklov_poincare import CondensedMap, WrappedMap
from bemkit.operators.steklov_poincare.nodal_conditions import NodalConditions, integrate_traction

if TYPE_CHECKING:
    from bemkit.operators.particular_solutions import ParticularSolution

_MORE_POINTS = 5
"""Gauss points beyond the degree of the tractions."""


@dataclass(frozen=True, eq=False)
class ForcesInside:
    """Nodal values of a particular solution for body forces and heat.

    Parameters
    ----------
    solution : ParticularSolution
    displacement, force : (n_nodes, 2) arrays [m], [N/m]
        Displacements at the nodes, and the nodal forces of the tractions.
    volume_force : (3,) array [N/m], [N/m], [N]
        Resultants of the body forces along x and y, and their moment about the origin.
    inner_force : float [N/m]
        Sum of the magnitudes of the nodal forces and of E' times the thermal strains along the boundary.
    """

    solution: ParticularSolution
    displacement: FloatArray
    force: FloatArray
    volume_force: FloatArray
    inner_force: float

    @classmethod
    def of(cls, solution: ParticularSolution, space: BoundarySpace) -> ForcesInside:
        """Evaluate a solution at the nodes of a space of displacements."""
        points, mesh = dof_points(space), space.mesh
        force = integrate_traction(space, np.arange(mesh.n_elements), solution.traction)
        moment = float(np.sum(points[:, 0] * force[:, 1] - points[:, 1] * force[:, 0]))
        strained_length = float(np.abs(solution.expansion(mesh.centres)) @ mesh.lengths)
        return cls(
            solution=solution,
            displacement=solution.displacement(points),
            force=force,
            volume_force=-np.array([*force.sum(axis=0), moment]),
            inner_force=float(np.abs(force).sum()) + solution.material.plane_modulus * strained_length,
        )

    def blended(self, other: ForcesInside, share: float) -> ForcesInside:
        """Return nodal values (1 - share) self + share other, with the particular solution of `other`."""
        return replace(
            other,
            displacement=blended(self.displacement, other.displacement, share),
            force=blended(self.force, other.force, share),
            volume_force=blended(self.volume_force, other.volume_force, share),
            inner_force=max(self.inner_force, other.inner_force),
        )

    def add_to(self, without_body_forces: CondensedMap, conditions: NodalConditions) -> CondensedMap:
        """Return a condensed map under these body forces.

        Parameters
        ----------
        without_body_forces : CondensedMap
            The map under the data of `left_of`.
        conditions : NodalConditions
        """
        along = conditions.in_frames(self.displacement)
        shift = np.append(along[conditions.is_retained], np.zeros(without_body_forces.n_pressures))
        return _MapWithBodyForces(
            stiffness=without_body_forces.stiffness,
            load=without_body_forces.load + without_body_forces.stiffness @ shift,
            n_pressures=without_body_forces.n_pressures,
            sensitivity=without_body_forces.sensitivity,
            work=without_body_forces.work,
            volume_force=self.volume_force,
            inner_force=self.inner_force,
            without_body_forces=without_body_forces,
            inside=self,
            conditions=conditions,
            along=along,
            shift=shift,
        )

    def left_of(self, conditions: NodalConditions, force: FloatArray) -> tuple[NodalConditions, FloatArray]:
        """Return the conditions and the given forces (n_nodes, 2) [N/m] minus those of the particular solution."""
        particular = conditions.in_frames(self.displacement)
        displacement = np.where(conditions.is_fixed, conditions.displacement - particular, 0.0)
        return replace(conditions, displacement=displacement), force - self.force

    def under(self, without_body_forces: CondensedMap, conditions: NodalConditions, force: FloatArray) -> CondensedMap:
        """Return a condensed body without body forces under other data and these body forces."""
        left, left_force = self.left_of(conditions, force)
        return self.add_to(without_body_forces.under(left_force, left.displacement), conditions)


@dataclass(frozen=True, eq=False, kw_only=True)
class _MapWithBodyForces(CondensedMap):
    """A condensed map under body forces; see `ForcesInside.add_to`."""

    without_body_forces: CondensedMap
    inside: ForcesInside
    conditions: NodalConditions
    along: FloatArray  # (n_nodes, 2) [m]: particular displacements in the frames
    shift: FloatArray  # (n_retained,) [m]: the same along the retained directions

    def recover(self, retained_displacement: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return displacement and force of all nodes."""
        displacement, force = self.without_body_forces.recover(retained_displacement - self.shift)
        return displacement + self.inside.displacement, force + self.inside.force

    def under(self, force: FloatArray, displacement: FloatArray) -> CondensedMap:
        """Return the map under other loads and the same body forces."""
        return self.inside.under(self.without_body_forces, replace(self.conditions, displacement=displacement), force)

    def follow(self, directions: IntArray) -> tuple[FloatArray, FloatArray]:
        """Return response and displacement at rest of free directions."""
        response, at_rest = self.without_body_forces.follow(directions)
        return response, at_rest + self.along.ravel()[directions] - response @ self.shift


def condensed_under(
    condensed: CondensedMap, conditions: NodalConditions, force: FloatArray, inside: ForcesInside | None = None
) -> CondensedMap:
    """Return a condensed body under other displacements, forces and, if given, body forces; nothing is factored."""
    if inside is None:
        return condensed.under(force, conditions.displacement)
    return inside.under(condensed.without_body_forces or condensed, conditions, force)


@dataclass(frozen=True, eq=False)
class ElasticityWithBodyForces(WrappedMap):
    """A map of a bounded body under body forces and heat; fulfils `SteklovPoincare`.

    Parameters
    ----------
    elastic : SteklovPoincare
        The map without them.
    inside : ForcesInside
        Values on the displacement space of the map.
    """

    inside: ForcesInside

    def condense(self, conditions: NodalConditions, force: FloatArray) -> CondensedMap:
        """Condense the map without body forces, then add them; see `SteklovPoincare.condense`."""
        return self.inside.add_to(self.elastic.condense(*self.inside.left_of(conditions, force)), conditions)

    def element_tractions(self, displacement: FloatArray, force: FloatArray) -> FloatArray:
        """Return all tractions (n_elements, n_local, 2) [Pa]; those of the particular solution are projected."""
        inside = self.inside
        rest = self.elastic.element_tractions(displacement - inside.displacement, force - inside.force)
        return rest + self._particular_tractions

    @cached_property
    def _particular_tractions(self) -> FloatArray:
        return projected_tractions(self.inside.solution, self.traction_space)

    @cached_property
    def _particular_energy(self) -> float:
        return self.inside.solution.energy(self.traction_space.mesh)

    def own_fields(self, displacement: FloatArray, force: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return displacement and force minus those of the particular solution."""
        return displacement - self.inside.displacement, force - self.inside.force

    def further_energy(self, displacement: FloatArray, force: FloatArray) -> FloatArray:
        """Return the parts (4,) of the elastic energy [J/m] in addition to that of the map, f_h u_h / 2.

        Parameters
        ----------
        displacement, force : (n_nodes, 2) arrays [m], [N/m]
            u_h and f_h of the map without body forces.

        Notes
        -----
        The parts are the energy of sigma_p and the work of sigma_h on the strains of sigma_p. By Betti's theorem the
        latter is the work of the tractions t_h on u_p for forces, and of the tractions sigma_p n on u_h for heat. The
        nodal forces f_h work on the interpolant of u_p; the tractions t_h, whose normals are interpolated, work on the
        small interpolation error.
        """
        traction = self.elastic.element_tractions(displacement, force)
        at_nodes, rest, of_heat = self._work_on_particular
        strained = without_motion(self.traction_space.mesh, dof_points(self.displacement_space), displacement)
        pairs = (force, at_nodes), (traction, rest), (of_heat, strained)
        return np.array([*(np.sum(force * path) for force, path in pairs), self._particular_energy])

    @cached_property
    def _work_on_particular(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Factors whose products with forces, tractions and displacements are work; see `further_energy`.

        Shapes are (n_nodes, 2), (n_elements, n_local, 2) and (n_nodes, 2).
        """
        inside, space, moved_space = self.inside, self.traction_space, self.displacement_space
        xi, weights = gauss_legendre(space.degree + _MORE_POINTS)
        elements = np.arange(space.mesh.n_elements)
        points = space.mesh.points(elements, xi)
        of_forces = inside.solution.forces
        at_nodes = of_forces.displacement(dof_points(moved_space))
        interpolated = np.einsum("pq,epc->eqc", moved_space.basis(xi), values_on_elements(moved_space, at_nodes))
        rest = of_forces.displacement(points.reshape(-1, 2)).reshape(points.shape) - interpolated
        measure = space.mesh.jacobian(elements, xi) * weights
        of_heat = integrate_traction(moved_space, elements, inside.solution.expansions.traction)
        return at_nodes, np.einsum("eq,lq,eqc->elc", measure, space.basis(xi), rest, optimize=True), of_heat


def projected_tractions(solution: ParticularSolution, space: BoundarySpace) -> FloatArray:
    """Project the tractions of a solution onto a space, element by element; return (n_elements, n_local, 2) [Pa]."""
    xi, weights = gauss_legendre(space.degree + _MORE_POINTS)
    elements, basis = np.arange(space.mesh.n_elements), space.basis(xi)
    points, normals = space.mesh.points(elements, xi), space.mesh.normals_at(elements, xi)
    values = solution.traction(points.reshape(-1, 2), normals.reshape(-1, 2)).reshape(points.shape)
    measure = space.mesh.jacobian(elements, xi) * weights
    gram = np.einsum("eq,lq,mq->elm", measure, basis, basis)
    return np.asarray(np.linalg.solve(gram, np.einsum("eq,lq,eqc->elc", measure, basis, values)))
