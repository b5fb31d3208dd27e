"""A half-plane with thousands of elements as a `LinearBody`: its equations are compressed and factored over a tree."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from bemkit.arrays import ComplexArray, FloatArray, IntArray
from bemkit.contact.body import SingularResponse
from bemkit.contact.half_plane.surface_body import SurfaceBody
from bemkit.contact.reduced_conditions import ReducedConditions, as_pairs
from bemkit.operators.boundary_equations import LinearConditions
from bemkit.operators.half_plane.elasticity import LargeHalfPlane
from bemkit.operators.hierarchy.system import LocalConditions, solved
from bemkit.operators.linear_solvers import SingularMatrixError

_SAMPLED = 24
"""Number of elements in contact whose equations the certificate evaluates without compression."""


@dataclass(frozen=True, eq=False)
class LargeStripBody(SurfaceBody):
    """A large strip of a half-plane with its contact nodes, without supports; see `SurfaceBody`.

    Notes
    -----
    A response factors the leaves whose conditions differ from those of the last response, and the clusters above them.
    """

    elastic: LargeHalfPlane

    responses_are_expensive = True

    @property
    def accuracy(self) -> float:  # type: ignore[override]
        """The tolerance of the compression."""
        return self.elastic.tolerance

    def solve(
        self, reduced: ReducedConditions, right: FloatArray, motions: ComplexArray, load: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """Solve over the tree; see `SurfaceBody.solve`."""
        factor = self.elastic.factor
        try:
            factor.update(self._local_conditions(reduced, right))
            factor.border_load = load
            unknowns, amounts = factor.unknowns(np.arange(factor.tree.n_leaves)), factor.errors()
        except SingularMatrixError as error:
            raise SingularResponse(str(error)) from error
        assert factor.conditions is not None  # `update` has set them
        components = (factor.conditions.factors[:, :2] @ unknowns[:, :, None])[:, :, 0]
        traction = self.at_acting(components[:, 0] + 1j * components[:, 1])
        return (reduced.direction.conj() * traction[reduced.node]).real, amounts

    def _local_conditions(self, reduced: ReducedConditions, right: FloatArray) -> LocalConditions:
        """Return the local conditions of all elements; elements outside of contact have no traction."""
        n = self.elastic.mesh.n_elements
        factors, given = np.zeros((n, 4, 2)), np.zeros((n, 4))
        factors[:, 2:] = np.eye(2)
        on_traction, on_displacement = np.zeros((2, self.n_contact, 2, 2))
        on_traction[:] = np.eye(2)
        value = np.zeros((self.n_contact, 2))
        # a node with one unknown has no traction across its direction; a node with two has two conditions
        node, turn = reduced.node, self.turn[reduced.node]
        row = np.where(np.append(node[1:] == node[:-1], False), 0, 1)
        on_traction[node, 0] = _along(1j * reduced.direction * turn)
        on_traction[node, row] = _along(reduced.on_traction * turn)
        on_displacement[node, row] = _along(reduced.on_displacement * turn)
        value[node, row] = right
        local = solved(LinearConditions(on_displacement, on_traction, value), 1.0 / self.stiffness_scale)
        factors[self.acting], given[self.acting] = local.factors, local.given
        return LocalConditions(factors, given)

    def missing(self, misfit: ComplexArray, traction: ComplexArray, size: float) -> float:
        """Return the larger relative residual: of `SurfaceBody`, or of the uncompressed equations at some elements."""
        nodes = self._sampled
        field = self.on_surface(traction)
        components = np.stack([field.real, field.imag], axis=1)
        displaced = self.elastic.displaced(field)
        left = self.elastic.factor.equations.residual(nodes, components, np.stack([displaced.real, displaced.imag], 1))
        return max(super().missing(misfit, traction, size), float(np.abs(left).max()) / size)

    @cached_property
    def _sampled(self) -> IntArray:
        positions = (np.arange(_SAMPLED) + 0.5) / _SAMPLED * self.n_contact
        return np.unique(self.acting[positions.astype(int)])


def _along(numbers: ComplexArray) -> FloatArray:
    """Return the factors (n, 2) of tangential and normal component in the real parts of complex products."""
    return as_pairs(numbers)[:, ::-1]
