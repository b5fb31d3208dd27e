"""Responses of the clusters of a tree, and how those of two siblings are merged into that of their parent."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from bemkit.arrays import FloatArray
from bemkit.operators.hierarchy.skeletons import Skeleton
from bemkit.operators.linear_solvers import SingularMatrixError, SmallLU


@dataclass(eq=False)
class ClusterResponse:
    """Response of a cluster to f: incoming displacements at its row skeleton, followed by the border unknowns.

    Parameters
    ----------
    scattering, of_loads : (n_outgoing, n_incoming), (n_outgoing, k) arrays
        Outgoing unknowns and contributions to the balances are ``of_loads - scattering @ f``, for k loads.
    response, at_rest : arrays
        The unknowns of a leaf, or the incoming displacements of both children of another cluster, are
        ``at_rest - response @ f``.
    """

    scattering: FloatArray
    of_loads: FloatArray
    response: FloatArray
    at_rest: FloatArray

    def unloaded(self, k: int) -> ClusterResponse:
        """Return the same cluster under k zero loads."""
        return replace(self, of_loads=np.zeros((len(self.of_loads), k)), at_rest=np.zeros((len(self.at_rest), k)))


def merge_siblings(
    first: ClusterResponse,
    second: ClusterResponse,
    couplings: tuple[FloatArray, FloatArray],
    parent: Skeleton | None,
    n_border: int,
    singular: SingularMatrixError,
) -> ClusterResponse:
    """Merge two siblings under the same loads into their parent.

    Parameters
    ----------
    first, second : ClusterResponse
    couplings : pair of arrays
        S12 from the column skeleton of the second to the row skeleton of the first, and S21.
    parent : Skeleton or None
        None for the root.
    n_border : int
    singular : SingularMatrixError
        Raised if the equations of the siblings do not determine what enters them.

    Notes
    -----
    Let f be the incoming displacements of the parent, f1 and f2 those of the siblings, and e the border unknowns. The
    second sibling emits a2 - W2 (f2, e), so that

        f1 + S12 W2 (f2, e) = R1 f + S12 a2,

    and the same with 1 and 2 exchanged [MartinssonRokhlin2005]. f2 is eliminated from the first equation.
    """
    to_first, to_second = couplings
    n_first, n_second = len(to_first), len(to_second)
    row_map = np.zeros((n_first + n_second, 0)) if parent is None else parent.row_map.matrix()
    # columns: incoming displacements of the parent, border unknowns, loads
    n_incoming = row_map.shape[1] + n_border
    border = slice(row_map.shape[1], n_incoming)

    # S12 W2 and S21 W1
    from_second = to_first @ second.scattering[: to_first.shape[1]]
    from_first = to_second @ first.scattering[: to_second.shape[1]]
    # right-hand sides: R f, the border, S a
    loads_of_second = to_first @ second.of_loads[: to_first.shape[1]]
    loads_of_first = to_second @ first.of_loads[: to_second.shape[1]]
    into_first = _side_by_side(row_map[:n_first], -from_second[:, n_second:], loads_of_second)
    into_second = _side_by_side(row_map[n_first:], -from_first[:, n_first:], loads_of_first)
    # the elimination of f2, and f2 from f1
    into_first -= from_second[:, :n_second] @ into_second
    schur_complement = np.eye(n_first) - from_second[:, :n_second] @ from_first[:, :n_first]
    into_first = SmallLU(schur_complement, singular, 1.0).solve(into_first)
    into_second -= from_first[:, :n_first] @ into_first

    # both siblings emit through the column skeleton of the parent and add to the same balances
    emitted = _emitted(first, into_first, border), _emitted(second, into_second, border)
    balances = sum(part[len(part) - n_border :] for part in emitted)
    of_parent = np.zeros((0, into_first.shape[1]))
    if parent is not None:
        of_parent = parent.column_map.gather(np.concatenate([part[: len(part) - n_border] for part in emitted]))
    outgoing, incoming = np.concatenate([of_parent, balances]), np.concatenate([into_first, into_second])
    return ClusterResponse(
        np.ascontiguousarray(outgoing[:, :n_incoming]),
        -outgoing[:, n_incoming:],
        -incoming[:, :n_incoming],
        incoming[:, n_incoming:].copy(),
    )


def _side_by_side(*blocks: FloatArray) -> FloatArray:
    """Return blocks of columns in one array, stored by columns as LAPACK wants it."""
    joined = np.empty((len(blocks[0]), sum(block.shape[1] for block in blocks)), order="F")
    return np.concatenate(blocks, axis=1, out=joined)


def _emitted(child: ClusterResponse, incoming: FloatArray, border: slice) -> FloatArray:
    """Return W (f, e) - a of a child: outgoing unknowns and balances, with the opposite sign, for each column."""
    emitted: FloatArray = child.scattering[:, : len(incoming)] @ incoming
    emitted[:, border] += child.scattering[:, len(incoming) :]
    emitted[:, border.stop :] -= child.of_loads
    return emitted
