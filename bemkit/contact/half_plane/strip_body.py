"""A strip of a half-plane as a `LinearBody`: it keeps the flexibility and solves for closed nodes only."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from bemkit.arrays import ComplexArray, FloatArray, IntArray
from bemkit.contact.body import SingularResponse
from bemkit.contact.half_plane.surface_body import SurfaceBody
from bemkit.contact.reduced_conditions import ReducedConditions
from bemkit.operators.half_plane.elasticity import HalfPlaneElasticity
from bemkit.operators.linear_solvers import DenseLU, SingularMatrixError


@dataclass(frozen=True, eq=False)
class StripBody(SurfaceBody):
    """A strip of a half-plane with its contact nodes and supports; see `SurfaceBody`.

    Parameters
    ----------
    kept : list
        The last factored conditions, and the factor: conditions that differ only in values use it again.

    Notes
    -----
    Forces ``f = a x`` of elements along their directions a cause the displacements ``u = (L - i c / 2 S) f``: L are the
    scaled means of logarithms, S the signs of the differences of indices, c the compressibility; see
    `bemkit.operators.half_plane.flexibility`. A response factors one matrix of the order of the unknown forces, two of
    a sticking node and one of a slipping one.
    """

    elastic: HalfPlaneElasticity
    kept: list[tuple[tuple[IntArray | ComplexArray, ...], DenseLU]] = field(default_factory=list, repr=False)

    accuracy = 1e-13

    def solve(
        self, reduced: ReducedConditions, right: FloatArray, motions: ComplexArray, load: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """Solve by one LU factorisation; see `SurfaceBody.solve`."""
        asked = (reduced.node, reduced.direction, reduced.on_displacement, reduced.on_traction, motions)
        if not self.kept or not all(map(np.array_equal, self.kept[0][0], asked)):
            try:
                factor = DenseLU(self._matrix(reduced, motions), "the flexibility of the closed nodes")
            except SingularMatrixError as error:
                raise SingularResponse(str(error)) from error
            self.kept[:] = [(asked, factor)]
        solution, n = self.kept[0][1].solve(np.concatenate([right, load])), right.size
        return solution[:n] / self.elastic.mesh.lengths[self.acting[reduced.node]], solution[n:]

    def _matrix(self, reduced: ReducedConditions, motions: ComplexArray) -> FloatArray:
        """Return the equations (n, n) of unknown forces and amounts of motions."""
        node, n = reduced.node, reduced.n_unknowns
        element, turn = self.acting[node], self.turn[node]
        along, seen = reduced.direction * turn, reduced.on_displacement * turn
        matrix = np.zeros((n + len(motions),) * 2)
        core = matrix[:n, :n]
        # the real part of conj(seen) (L - i c / 2 S) along, in real products of two columns
        core += _real_products(seen, along)
        core *= self.elastic.flexibility[np.ix_(element, element)]
        if self.elastic.material.plane_compressibility:
            signs = _real_products(seen, -1j * along)
            order = element.astype(float)
            signs *= np.sign(order[:, None] - order)
            signs *= 0.5 * self.elastic.material.plane_compressibility
            core += signs
        # tractions are forces by lengths; the unknowns of a node follow each other
        factor = reduced.on_traction.conj() / self.elastic.mesh.lengths[element]
        for offset in (-1, 0, 1):
            rows = np.arange(max(0, -offset), n - max(0, offset))
            rows = rows[node[rows] == node[rows + offset]]
            core[rows, rows + offset] += (factor[rows] * reduced.direction[rows + offset]).real
        moved = motions[:, node]
        matrix[:n, n:] = (reduced.on_displacement.conj() * moved).real.T
        matrix[n:, :n] = (moved.conj() * reduced.direction).real
        return matrix


def _real_products(one: ComplexArray, two: ComplexArray) -> FloatArray:
    """Return the real parts (n, m) of products of the conjugates of numbers (n,) with others (m,)."""
    return np.stack([one.real, one.imag], axis=1) @ np.stack([two.real, two.imag])
