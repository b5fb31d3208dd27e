"""The periodic half-plane as a `LinearBody`: responses by GMRES with Fourier transforms, without a matrix."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from bemkit.arrays import ComplexArray, FloatArray
from bemkit.contact.body import SingularResponse
from bemkit.contact.half_plane.surface_body import SurfaceBody
from bemkit.contact.reduced_conditions import ReducedConditions
from bemkit.operators.half_plane.periodic import PeriodicElasticity

_ROUND_OFF = 4.0 * float(np.finfo(float).eps)
"""Round-off of a displacement, relative to the largest. In tractions the shortest of n waves magnifies it n times."""
_LEAST_ACCURACY = 1e-11
_RESTART, _MOST_RESTARTS, _MOST_CORRECTIONS = 100, 8, 6
"""Steps of GMRES before it restarts, restarts for one right-hand side, and corrections by new right-hand sides."""


@dataclass(frozen=True, eq=False)
class PeriodicBody(SurfaceBody):
    """The periodic half-plane with its contact nodes; see `SurfaceBody`. Supports hold no element.

    Notes
    -----
    Unknowns are the tractions that no condition gives, and the motions that forces far away drive. GMRES is
    preconditioned by the stiffness of the whole surface (tractions that hold given displacements everywhere), so that
    the number of iterations depends on the pattern of contact and hardly on the number of nodes.
    """

    elastic: PeriodicElasticity

    responses_are_expensive = True

    @property
    def accuracy(self) -> float:  # type: ignore[override]
        """Relative error at which GMRES stops; at least n times the round-off of displacements."""
        return max(_LEAST_ACCURACY, _ROUND_OFF * self.elastic.mesh.n_elements)

    @property
    def noise(self) -> float:  # type: ignore[override]
        """The accuracy."""
        return self.accuracy

    def missing(self, misfit: ComplexArray, traction: ComplexArray, size: float) -> float:
        """Return the largest tractions that are missing, relative to the largest one, of contact or given."""
        given = float(np.abs(self.force / self.elastic.mesh.lengths[:, None]).max(initial=0.0))
        return float(np.abs(self.stiffened(misfit)).max()) / max(float(np.abs(traction).max()), given)

    def stiffened(self, displacement: ComplexArray) -> ComplexArray:
        """Return the tractions (n_contact,) that hold displacements (n_contact,), those of other elements zero."""
        return self.at_acting(self.elastic.tractions_of(self.on_surface(displacement)))

    def solve(
        self, reduced: ReducedConditions, right: FloatArray, motions: ComplexArray, load: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """Solve by preconditioned GMRES; see `SurfaceBody.solve`."""
        return _System(self, reduced, motions).solved(right, load)


@dataclass(frozen=True, eq=False)
class _System:
    """The preconditioned equations for the tractions that no condition gives and for the driven motions."""

    body: PeriodicBody
    reduced: ReducedConditions
    motions: ComplexArray

    def solved(self, right: FloatArray, load: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return unknown tractions (n_unknowns,) and motions (n_motions,); see `SurfaceBody.solve`.

        GMRES stops relative to the right-hand side, which may be far larger than the solution. So its residual is the
        next right-hand side, until it is small relative to the solution.
        """
        from scipy.sparse.linalg import LinearOperator, gmres

        body, reduced, n = self.body, self.reduced, right.size
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
        return solution[:n], solution[n:] / self._sizes

    def _resultants(self, traction: ComplexArray) -> FloatArray:
        """Return the work of tractions on the motions."""
        return np.asarray(((self.body.weights * self.motions.conj()) @ traction).real)

    def _left(self, x: FloatArray) -> FloatArray:
        """Return the left-hand sides of the equations."""
        body, reduced = self.body, self.reduced
        traction = reduced.changes(x[: reduced.n_unknowns])
        displacement = body.displacement_by(traction) + (x[reduced.n_unknowns :] / self._sizes) @ self.motions
        return np.concatenate([reduced.rows(displacement, traction), self._resultants(traction)])

    def _tractions_of(self, right: FloatArray) -> FloatArray:
        """Return approximate unknowns for given left-hand sides, without driven motions."""
        body, reduced = self.body, self.reduced
        displacement = reduced.displacements(right, body.stiffness_scale)
        return reduced.unknowns(body.stiffened(displacement), right, body.stiffness_scale)

    @cached_property
    def _for_motions(self) -> tuple[FloatArray, FloatArray]:
        """Return the tractions (n_unknowns, n_driven) that unit motions cause, and the inverse of their work.

        Raises
        ------
        SingularResponse
            If they do no work on a motion.
        """
        reduced, zero = self.reduced, np.zeros(self.body.n_contact, complex)
        tractions = [self._tractions_of(reduced.rows(motion, zero)) for motion in self.motions]
        works = [self._resultants(reduced.changes(unknowns)) for unknowns in tractions]
        try:
            inverse = np.linalg.inv(np.array(works).T)
        except np.linalg.LinAlgError as error:
            raise SingularResponse("the contact conditions leave a motion far away free") from error
        return np.array(tractions).T, np.asarray(inverse)

    @cached_property
    def _sizes(self) -> FloatArray:
        """(n_driven,) array [Pa/m]: the largest traction that each unit motion causes; scales motions to tractions."""
        return np.asarray(np.abs(self._for_motions[0]).max(axis=0)) if len(self.motions) else np.zeros(0)

    def _preconditioned(self, right: FloatArray) -> FloatArray:
        """Return the approximate solution for given right-hand sides."""
        n = self.reduced.n_unknowns
        unknowns = self._tractions_of(right[:n])
        if right.size == n:
            return unknowns
        tractions, inverse = self._for_motions
        motion = inverse @ (self._resultants(self.reduced.changes(unknowns)) - right[n:])
        return np.concatenate([unknowns - tractions @ motion, self._sizes * motion])
