"""The periodic half-plane as a `LinearBody`: responses by GMRES with Fourier transforms, without a matrix."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from bemkit.arrays import ComplexArray, FloatArray
from bemkit.contact.body import ContactState, LinearBody, SingularResponse
from bemkit.contact.condensation.nodes import ContactNodes
from bemkit.contact.conditions import LinearConditions
from bemkit.contact.reduced_conditions import ReducedConditions, as_complex, as_pairs
from bemkit.operators.counts import OperationCounts
from bemkit.operators.equilibrium import Imbalance
from bemkit.operators.half_plane.periodic import PeriodicElasticity
from bemkit.operators.steklov_poincare.forces_inside import ForcesInside
from bemkit.operators.steklov_poincare.nodal_conditions import NodalConditions

_ROUND_OFF = 4.0 * float(np.finfo(float).eps)
"""Round-off of a displacement, relative to the largest. In tractions the shortest of n waves magnifies it n times."""
_LEAST_ACCURACY = 1e-11
_RESTART, _MOST_RESTARTS, _MOST_CORRECTIONS = 100, 8, 6
"""Steps of GMRES before it restarts, restarts for one right-hand side, and corrections by new right-hand sides."""


@dataclass(frozen=True, eq=False)
class PeriodicBody(LinearBody):
    """The periodic half-plane with its contact nodes; fulfils `LinearBody`.

    Parameters
    ----------
    elastic : PeriodicElasticity
    conditions : NodalConditions
        Without fixed directions.
    nodes : ContactNodes
    force : (n_nodes, 2) array [N/m]
        Given nodal forces in x and y, beside the contact nodes.

    Notes
    -----
    Unknowns are the tractions that no condition gives, and the motions that forces far away drive. GMRES is
    preconditioned by the stiffness of the whole surface (tractions that hold given displacements everywhere), so that
    the number of iterations depends on the pattern of contact and hardly on the number of nodes.
    """

    elastic: PeriodicElasticity
    conditions: NodalConditions
    nodes: ContactNodes
    force: FloatArray

    is_costly = True
    condensed = None
    """No stiffness is formed."""

    @property
    def weights(self) -> FloatArray:  # type: ignore[override]  # read-only here
        """(n_contact,) array [m]: lengths of the elements."""
        return self.nodes.weights

    @property
    def accuracy(self) -> float:  # type: ignore[override]
        """Relative error at which GMRES stops; at least n times the round-off of displacements."""
        return max(_LEAST_ACCURACY, _ROUND_OFF * self.elastic.mesh.n_elements)

    @property
    def stiffness_scale(self) -> float:
        """E' by the length of an element [Pa/m]."""
        return self.elastic.material.plane_modulus / float(np.median(self.weights))

    @property
    def work(self) -> OperationCounts:
        """The order of the contact system, of which no matrix is formed."""
        return OperationCounts(contact_unknowns=2 * self.n_contact)

    def under(self, displacement: FloatArray, force: FloatArray, inside: ForcesInside | None = None) -> PeriodicBody:
        """Return the same body under other nodal forces."""
        return replace(self, force=force)

    @cached_property
    def _turn(self) -> ComplexArray:
        """(n_contact,) array: the complex number of the tangent of each contact frame."""
        return self.elastic.to_complex(self.nodes.frame[:, 1])

    def _on_surface(self, numbers: ComplexArray) -> ComplexArray:
        """Return a field at the contact nodes, in their frames, as one on all elements, zero elsewhere."""
        field = np.zeros(self.elastic.mesh.n_elements, complex)
        field[self.nodes.nodes] = numbers * self._turn
        return field

    def _at_contact(self, field: ComplexArray) -> ComplexArray:
        """Return a field on all elements at the contact nodes, in their frames."""
        return np.asarray(field[self.nodes.nodes] * self._turn.conj())

    @cached_property
    def _motions(self) -> ComplexArray:
        """(2, n_contact) array: unit motions along x and y."""
        return self.elastic.axes[:, None] * self._turn.conj()

    @property
    def _driven(self) -> list[int]:
        return list(self.elastic.drive.driven)

    @cached_property
    def _rest(self) -> ComplexArray:
        """(n_contact,) array [m]: displacements under the given forces and motions."""
        of_force = self.elastic.to_complex(self.elastic.strain_displacement(self.force))
        motion = np.array(self.elastic.drive.motion[:2])
        return np.asarray(self._at_contact(of_force) + motion @ self._motions)

    def rigid_motions(self) -> FloatArray:
        """Return the motions that forces far away drive."""
        return as_pairs(self._motions[self._driven])

    def rigid_load(self) -> FloatArray:
        """Return these forces, with those given on the surface."""
        total = np.array(self.elastic.drive.load[:2]) + self.force.sum(axis=0)
        return np.asarray(total[self._driven])

    def respond(self, conditions: LinearConditions) -> ContactState:
        """Return the response by preconditioned GMRES; see `LinearBody.respond`."""
        if len(conditions.free_motions(self.rigid_motions())):
            raise SingularResponse("the contact conditions leave a rigid motion free")
        reduced = ReducedConditions.of(conditions)
        system = _System(self, reduced)
        unknowns, motion = system.solved()
        traction = reduced.tractions(unknowns)
        displacement = self._rest + self._caused(traction) + motion @ self._motions[self._driven]
        return ContactState(
            conditions.with_given_displacements(as_pairs(displacement)),
            conditions.with_given_tractions(as_pairs(traction)),
        )

    def _caused(self, traction: ComplexArray) -> ComplexArray:
        return self._at_contact(self.elastic.displaced(self._on_surface(traction)))

    def imbalance(self, state: ContactState) -> Imbalance:
        """Return the largest tractions and driving forces that are missing; see `LinearBody.imbalance`."""
        traction, motions = as_complex(state.traction), self._motions[self._driven]
        misfit = as_complex(state.displacement) - self._rest - self._caused(traction)
        if len(motions):
            rows = np.concatenate([motions.real, motions.imag], axis=1)
            amounts = np.linalg.lstsq(rows.T, np.concatenate([misfit.real, misfit.imag]), rcond=None)[0]
            misfit = misfit - amounts @ motions
        missing = self._at_contact(self.elastic.held(self._on_surface(misfit)))
        force = (self.weights * traction * motions.conj()).real.sum(axis=1) + self.rigid_load()
        largest = float(np.abs(traction).max())
        total = float(np.abs(self.weights * traction).sum())
        if largest == 0.0:
            is_pushed = bool(np.abs(force).max(initial=0.0) > 0.0)
            return Imbalance(float(is_pushed or np.abs(missing).max() > 0.0), float(is_pushed))
        # an error of the mean traction moves the surface as a driven motion does
        on_motions = float(np.abs(force).max(initial=0.0)) / total
        return Imbalance(max(float(np.abs(missing).max()) / largest, on_motions), on_motions, self.accuracy)

    def recover(self, state: ContactState) -> tuple[FloatArray, FloatArray]:
        """Return displacement (n_nodes, 2) and total force (n_nodes, 2) of all elements, in x and y."""
        lengths = self.elastic.mesh.lengths[:, None]
        force = self.force + lengths * self.elastic.to_vectors(self._on_surface(as_complex(state.traction)))
        displacement = self.elastic.strain_displacement(force)
        misfit = as_complex(state.displacement) - self._at_contact(self.elastic.to_complex(displacement))
        displacement = displacement + self.elastic.to_vectors(np.array([(misfit * self._turn).mean()]))
        at_nodes = as_complex(state.displacement) * self._turn
        displacement[self.nodes.nodes] = self.elastic.to_vectors(at_nodes)
        return displacement, force


@dataclass(frozen=True, eq=False)
class _System:
    """The preconditioned equations for the tractions that no condition gives and for the driven motions."""

    body: PeriodicBody
    reduced: ReducedConditions

    def solved(self) -> tuple[FloatArray, FloatArray]:
        """Return unknown tractions (n_unknowns,) and driven motions (n_driven,).

        GMRES stops relative to the right-hand side, which may be far larger than the solution. So its residual is the
        next right-hand side, until it is small relative to the solution.
        """
        from scipy.sparse.linalg import LinearOperator, gmres

        body, reduced = self.body, self.reduced
        known = reduced.tractions(np.zeros(reduced.n_unknowns))
        right = reduced.value - reduced.rows(body._rest + body._caused(known), known)
        load = -(body.rigid_load() + self._resultants(known))
        n = reduced.n_unknowns
        if n == 0:
            return np.zeros(0), np.zeros(0)
        # a long travel is subtracted first: beside it the deformation would have few digits
        columns = [reduced.rows(motion, np.zeros_like(known)) for motion in self._motions]
        travel, right = _fitted(columns, right)
        residual = right = self._preconditioned(np.concatenate([right, load]))
        operator = LinearOperator((right.size, right.size), lambda x: self._preconditioned(self._left(x)), dtype=float)
        solution = np.zeros(right.size)
        for _ in range(_MOST_CORRECTIONS):
            largest = float(np.abs(reduced.tractions(solution[:n])).max())
            size = float(np.abs(residual).max())
            if size <= 0.5 * body.accuracy * largest:
                break
            rtol = min(max(0.1 * body.accuracy, 0.2 * body.accuracy * largest / size), 0.1)
            solution = solution + gmres(operator, residual, rtol=rtol, restart=_RESTART, maxiter=_MOST_RESTARTS)[0]
            residual = right - operator.matvec(solution)
        else:
            raise SingularResponse(f"{_MOST_CORRECTIONS} corrections have not led to a response")
        return solution[:n], travel + solution[n:] / self._sizes

    @cached_property
    def _motions(self) -> ComplexArray:
        """(n_driven, n_contact) array: unit driven motions."""
        return self.body._motions[self.body._driven]

    @cached_property
    def _works(self) -> ComplexArray:
        """(n_driven, n_contact) array: weighted driven motions; the real part of a product with tractions is work."""
        return np.asarray(self.body.weights * self._motions.conj())

    def _resultants(self, traction: ComplexArray) -> FloatArray:
        """Return the work of tractions on the driven motions."""
        return np.asarray((self._works @ traction).real)

    def _left(self, x: FloatArray) -> FloatArray:
        """Return the left-hand sides of the equations."""
        body, reduced = self.body, self.reduced
        traction = reduced.changes(x[: reduced.n_unknowns])
        displacement = body._caused(traction) + (x[reduced.n_unknowns :] / self._sizes) @ self._motions
        return np.concatenate([reduced.rows(displacement, traction), self._resultants(traction)])

    def _tractions_of(self, right: FloatArray) -> FloatArray:
        """Return approximate unknowns for given left-hand sides, without driven motions."""
        body, reduced = self.body, self.reduced
        displacement = reduced.displacements(right, body.stiffness_scale)
        held = body._at_contact(body.elastic.held(body._on_surface(displacement)))
        return reduced.unknowns(held, right, body.stiffness_scale)

    @cached_property
    def _for_motions(self) -> tuple[FloatArray, FloatArray]:
        """Return the tractions (n_unknowns, n_driven) that unit motions cause, and the inverse of their work."""
        reduced, zero = self.reduced, np.zeros(self.body.n_contact, complex)
        tractions = [self._tractions_of(reduced.rows(motion, zero)) for motion in self._motions]
        works = [self._resultants(reduced.changes(unknowns)) for unknowns in tractions]
        return np.array(tractions).T, np.asarray(np.linalg.inv(np.array(works).T))

    @cached_property
    def _sizes(self) -> FloatArray:
        """(n_driven,) array [Pa/m]: the largest traction that each unit motion causes; scales motions to tractions."""
        return np.asarray(np.abs(self._for_motions[0]).max(axis=0)) if len(self._motions) else np.zeros(0)

    def _preconditioned(self, right: FloatArray) -> FloatArray:
        """Return the approximate solution for given right-hand sides."""
        n = self.reduced.n_unknowns
        unknowns = self._tractions_of(right[:n])
        if right.size == n:
            return unknowns
        tractions, inverse = self._for_motions
        motion = inverse @ (self._resultants(self.reduced.changes(unknowns)) - right[n:])
        return np.concatenate([unknowns - tractions @ motion, self._sizes * motion])


def _fitted(columns: Sequence[FloatArray], values: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the least-squares amounts of columns (n,) for values (n,), and the residual (n,)."""
    if not columns:
        return np.zeros(0), values
    matrix = np.stack(columns, axis=1)
    amounts: FloatArray = np.asarray(np.linalg.lstsq(matrix, values, rcond=None)[0], dtype=float)
    return amounts, values - matrix @ amounts
