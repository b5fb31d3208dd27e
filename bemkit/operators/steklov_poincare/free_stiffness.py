"""The stiffness of the free directions of a body, as an operator that need not be formed."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from bemkit.arrays import FloatArray, IntArray
from bemkit.geometry.spaces import BoundarySpace, dof_points
from bemkit.operators.rigid_modes import rigid_motions
from bemkit.operators.steklov_poincare.layer_operators import Layers
from bemkit.operators.steklov_poincare.nodal_conditions import NodalConditions, rotate_columns, rotate_rows

if TYPE_CHECKING:
    from scipy.sparse import csr_matrix

_DEPENDENT = 1e-10
"""Motions that add less than this to the others, relative to their size, add nothing."""


@dataclass(frozen=True, eq=False)
class FreeStiffness:
    """S_ff in the frames of the nodes; fulfils `DefiniteOperator`.

    Parameters
    ----------
    layers : Layers
    space : BoundarySpace
        Of the displacements.
    conditions : NodalConditions

    Notes
    -----
    The equivalent matrix is the hypersingular operator W_ff [SteinbachWendland1998]. With S' the map of the outside,
    W^-1 = S^-1 + S'^-1 up to rigid motions, hence S = W (1 + S'^-1 S): the energies of S lie between those of W and a
    few times them, for every mesh; thin bodies, too, because bending them is as easy for W as for S. Only the rigid
    motions of one loop against another are free in W and not in S; of several loops their energies are added.
    """

    layers: Layers
    space: BoundarySpace
    conditions: NodalConditions

    @cached_property
    def free(self) -> IntArray:
        """Numbers 2 node + component of the free directions."""
        return np.flatnonzero(self.conditions.is_free)

    @property
    def order(self) -> int:
        """Number of free directions."""
        return int(self.free.size)

    def to_xy(self, local: FloatArray) -> FloatArray:
        """Turn the columns of an (n_dofs, m) array from the frames of the nodes to x and y."""
        columns = local.reshape(len(self.conditions.frame), 2, -1)
        turned: FloatArray = np.einsum("nkc,nkm->ncm", self.conditions.frame, columns).reshape(len(local), -1)
        return turned

    def to_frames(self, along_xy: FloatArray) -> FloatArray:
        """Turn the columns of an (n_dofs, m) array from x and y to the frames of the nodes."""
        columns = along_xy.reshape(len(self.conditions.frame), 2, -1)
        turned: FloatArray = np.einsum("nkc,ncm->nkm", self.conditions.frame, columns).reshape(len(along_xy), -1)
        return turned

    def forces(self, local: FloatArray) -> FloatArray:
        """Return S u for the columns of an (n_dofs, m) array, both in the frames of the nodes."""
        return self.to_frames(self.layers.apply(self.to_xy(local)))

    def matrix(self) -> FloatArray:
        """Form the matrix column by column."""
        return self.apply(np.eye(self.order))

    def apply(self, x: FloatArray) -> FloatArray:
        """Return S_ff x."""
        return self.forces(self._extended(x))[self.free]

    def equivalent(self) -> FloatArray:
        """Return W_ff, positive definite."""
        # frames of nodes without a free direction do not matter, and turning columns copies the matrix
        is_turned = np.any(self.conditions.is_free, axis=1, keepdims=True)[:, :, None]
        frame = np.where(is_turned, self.conditions.frame, np.eye(2))
        hyper = rotate_rows(rotate_columns(self.layers.hypersingular, frame), frame)
        matrix = np.ascontiguousarray(hyper[np.ix_(self.free, self.free)])
        motions = self._loop_motions
        missing = self._extended(motions)
        energies = motions.T @ self.to_frames(self.layers.beyond_hypersingular(self.to_xy(missing)))[self.free]
        matrix += motions @ energies @ motions.T
        return matrix

    def neighbours(self) -> csr_matrix:
        """Return stiffness and mass of a string along the boundary, one for each component."""
        from scipy.sparse import bsr_matrix, coo_matrix, identity, kron

        n = self.space.n_dofs // 2
        order = np.argsort(self.space.local_nodes)
        first, last = (self.space.element_dofs[:, order[part]].ravel() for part in (slice(None, -1), slice(1, None)))
        is_step = first != last  # elements of a lower degree than others repeat their last dof
        first, last = first[is_step], last[is_step]
        points = dof_points(self.space)
        length = np.hypot(*(points[last] - points[first]).T)
        size = self.space.mesh.diameter
        on, off = 1.0 / length + length / size**2 / 3.0, -1.0 / length + length / size**2 / 6.0
        rows, columns = np.concatenate([first, last, first, last]), np.concatenate([first, last, last, first])
        string = coo_matrix((np.concatenate([on, on, off, off]), (rows, columns)), shape=(n, n))
        frames = self.conditions.frame.transpose(0, 2, 1)
        turn = bsr_matrix((frames, np.arange(n), np.arange(n + 1))).tocsc()[:, self.free]
        result: csr_matrix = (turn.T @ kron(string, identity(2)) @ turn).tocsr()
        result.eliminate_zeros()  # frames along x and y do not couple the components
        return result

    @cached_property
    def _loop_motions(self) -> FloatArray:
        """(order, n_motions) orthonormal rigid motions of each of several loops, as far as free directions follow."""
        mesh, points = self.space.mesh, dof_points(self.space)
        if len(mesh.loops) == 1:  # what holds the body holds its boundary
            return np.zeros((self.order, 0))
        motions = []
        for loop in mesh.loops:
            own = np.unique(self.space.element_dofs[loop])
            moved = np.zeros((len(points), 2, 3))
            moved[own] = rigid_motions(points[own], points[own].mean(axis=0), mesh.diameter)
            motions.append(self.to_frames(moved.reshape(-1, 3))[self.free])
        left, sizes, _ = np.linalg.svd(np.concatenate(motions, axis=1), full_matrices=False)
        return np.ascontiguousarray(left[:, sizes > _DEPENDENT * sizes.max(initial=0.0)])

    def _extended(self, x: FloatArray) -> FloatArray:
        extended = np.zeros((self.space.n_dofs, x.shape[1]))
        extended[self.free] = x
        return extended
