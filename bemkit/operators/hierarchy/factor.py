"""A direct solver for compressed boundary equations whose conditions change a few leaves at a time.

On every element tractions and displacements, four numbers, follow linearly from two unknowns z: (t, u) = P z + q, which
states a support, a load, or any linear law of contact. In a leaf the equations D z = -F q - (what comes from outside)
are solved at once, D = F P; seen from outside it is a scattering matrix, from what its row skeleton feels to what its
column skeleton causes [MartinssonRokhlin2005]. The matrices of siblings are merged up to the root, so that a change of
conditions in one leaf touches that leaf and those above it.

A few unknowns and equations belong to the boundary as a whole (rigid errors of the equations, resultants of the
tractions). They are passed through all clusters beside the skeletons and solved for at the root.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import partial

import numpy as np

from bemkit.arrays import FloatArray, IntArray
from bemkit.operators.hierarchy.compression import Compression
from bemkit.operators.linear.dense import SingularMatrixError
from bemkit.operators.linear.threads import for_each_chunk

_SMALLEST_PIVOT = 1e-13
"""Pivots below this share of the largest entry of their column are round-off."""


@dataclass(frozen=True, eq=False)
class ElementLaws:
    """What is known on each element: (t_x, t_y, u_x, u_y) = factors @ z + given.

    Parameters
    ----------
    factors : (n_elements, 4, 2) array
    given : (n_elements, 4) array
    """

    factors: FloatArray
    given: FloatArray

    def take(self, rows: IntArray) -> ElementLaws:
        """Return those of some elements."""
        return ElementLaws(self.factors[rows], self.given[rows])


@dataclass(frozen=True, eq=False)
class Border:
    """Unknowns and equations of the boundary as a whole.

    Parameters
    ----------
    errors : (2 n_elements, n_border) array
        Columns of the additional unknowns in the equations.
    balances : (n_border, 4 n_elements) array
        Additional equations: balances @ (t_x, t_y, u_x, u_y of all elements) = 0.
    """

    errors: FloatArray
    balances: FloatArray


class _LU:
    """Factors of a dense matrix, its columns of any size."""

    def __init__(self, matrix: FloatArray, name: str) -> None:
        from scipy.linalg.lapack import dgetrf

        sizes = np.abs(matrix).max(axis=0, initial=0.0)
        self._factor, self._pivots, info = dgetrf(matrix)
        if info or np.any(np.abs(np.diagonal(self._factor)) <= _SMALLEST_PIVOT * sizes):
            raise SingularMatrixError(f"{name} is singular: check that supports and contacts hold the body")

    def solve(self, right: FloatArray) -> FloatArray:
        from scipy.linalg.lapack import dgetrs

        if not right.size:
            return np.zeros(right.shape)
        return np.asarray(dgetrs(self._factor, self._pivots, right)[0])

    @property
    def n_bytes(self) -> int:
        return int(self._factor.nbytes)


@dataclass(eq=False)
class _Cluster:
    """A cluster under the present conditions: what it causes is ``alone - scattering @ (what its rows feel)``."""

    scattering: FloatArray
    alone: FloatArray


@dataclass(eq=False)
class _Leaf(_Cluster):
    """A leaf; its unknowns are ``unknowns - response @ (what its rows feel)``."""

    response: FloatArray
    unknowns: FloatArray


@dataclass(eq=False)
class _Parent(_Cluster):
    """A cluster of two: its children cause ``caused - merged^-1 scattered``, scattered what they do to a field."""

    merged: _LU
    caused: FloatArray


@dataclass(eq=False)
class HierarchicalFactor:
    """Compressed equations under conditions that may change.

    Parameters
    ----------
    compression : Compression
    border : Border

    Notes
    -----
    The one mutable object of the solver: it keeps the factors of the conditions it has met last.
    """

    compression: Compression
    border: Border
    laws: ElementLaws | None = None
    n_factored: int = 0
    _levels: list[list[_Cluster | None]] = field(default_factory=list)
    _stale: set[int] = field(default_factory=set)

    def __post_init__(self) -> None:
        n_levels = self.compression.tree.n_levels
        self._levels = [[None] * 2 ** (n_levels - level) for level in range(n_levels + 1)]
        self._stale = set(range(self.compression.tree.n_leaves))

    def update(self, laws: ElementLaws) -> None:
        """Take over the conditions on all elements, and factor every leaf where they have changed, and what is above.

        Raises
        ------
        SingularMatrixError
            If the conditions do not determine the unknowns.
        """
        tree = self.compression.tree
        if self.laws is not None:
            differs = np.any(laws.factors != self.laws.factors, axis=(1, 2)) | np.any(
                laws.given != self.laws.given, axis=1
            )
            self._stale |= set(tree.leaves_of(np.flatnonzero(differs)).tolist())
        self.laws = laws
        changed = sorted(self._stale)
        n_integrals = len(changed) * tree.bounds[1] ** 2
        for leaf, factored in zip(
            changed, for_each_chunk(lambda leaf: self._leaf(leaf, laws), changed, n_integrals=n_integrals), strict=True
        ):
            self._levels[0][leaf] = factored
        for level in range(1, tree.n_levels + 1):
            changed = sorted({cluster // 2 for cluster in changed})
            merge = partial(self._parent, level)
            for cluster, merged in zip(changed, for_each_chunk(merge, changed, n_integrals=n_integrals), strict=True):
                self._levels[level][cluster] = merged
        self.n_factored = len(self._stale)
        self._stale = set()

    def unknowns(self, leaves: IntArray) -> FloatArray:
        """Return the unknowns z (n, 2) of the elements of some leaves, in their order.

        Parameters
        ----------
        leaves : (n_leaves,) array
            Ascending.
        """
        felt = {0: self.errors()}
        tree = self.compression.tree
        for level in range(tree.n_levels, 0, -1):
            wanted = set((leaves >> (level - 1)).tolist())
            felt = {
                child: of_child
                for cluster, of_cluster in felt.items()
                for child, of_child in self._felt_by_children(level, cluster, of_cluster)
                if child in wanted
            }
        parts = []
        for number in leaves.tolist():
            leaf = self._levels[0][number]
            assert isinstance(leaf, _Leaf)
            parts.append(leaf.unknowns - leaf.response @ felt[number])
        return np.concatenate([np.zeros(0), *parts]).reshape(-1, 2)

    def errors(self) -> FloatArray:
        """Return the unknowns (n_border,) of the boundary as a whole."""
        root = self._levels[-1][0]
        assert root is not None  # `update` comes first
        return _LU(root.scattering, "the balance of the body").solve(root.alone)

    @property
    def n_bytes(self) -> int:
        """Memory of all factors [bytes]."""
        total = 0
        for level in self._levels:
            for each in level:
                if isinstance(each, _Leaf):
                    total += each.scattering.nbytes + each.response.nbytes
                elif isinstance(each, _Parent):
                    total += each.scattering.nbytes + each.merged.n_bytes
        return total

    def _leaf(self, number: int, laws: ElementLaws) -> _Leaf:
        compression = self.compression
        places, columns = compression.tree.places(0, number), compression.unknowns[number]
        rows = np.arange(2 * places.start, 2 * places.stop)
        n, n_border = places.stop - places.start, self.border.errors.shape[1]
        factors, given = laws.factors[places], laws.given[places]
        entries = np.zeros((rows.size, 4 * n))
        own = columns - 4 * places.start
        entries[:, own] = compression.columns.entries(rows, columns)
        by_element = entries.reshape(rows.size, n, 4).transpose(1, 0, 2)
        matrix = np.ascontiguousarray((by_element @ factors).transpose(1, 0, 2)).reshape(rows.size, 2 * n)
        factor = _LU(matrix, "the body held by its supports and its contact boundary")
        skeleton = compression.skeletons[0][number]
        incoming = np.column_stack([skeleton.row_map, self.border.errors[rows]])
        outgoing = np.zeros((skeleton.columns.size + n_border, 4 * n))
        outgoing[: skeleton.columns.size, own] = skeleton.column_map.T
        outgoing[skeleton.columns.size :] = self.border.balances[:, 4 * places.start : 4 * places.stop]
        of_unknowns = (outgoing.reshape(-1, n, 4).transpose(1, 0, 2) @ factors).transpose(1, 0, 2)
        of_unknowns = np.ascontiguousarray(of_unknowns).reshape(-1, 2 * n)
        response, at_rest = factor.solve(incoming), np.zeros(2 * n)
        if given.any():
            at_rest = -factor.solve(entries @ given.ravel())
        alone = of_unknowns @ at_rest + outgoing @ given.ravel()
        return _Leaf(of_unknowns @ response, alone, response, at_rest)

    def _parent(self, level: int, cluster: int) -> _Parent:
        one, two = self._children(level, cluster)
        coupling = self.compression.couplings[level - 1][cluster]
        n_one, n_two = len(one.scattering), len(two.scattering)
        matrix = np.eye(n_one + n_two, order="F")
        rows_one, columns_two = coupling.on_first.shape
        rows_two, columns_one = coupling.on_second.shape
        matrix[:n_one, n_one : n_one + columns_two] = one.scattering[:, :rows_one] @ coupling.on_first
        matrix[n_one:, :columns_one] = two.scattering[:, :rows_two] @ coupling.on_second
        merged = _LU(matrix, "the body held by its supports and its contact boundary")
        caused = merged.solve(np.concatenate([one.alone, two.alone]))
        incoming, outgoing = self._maps(level, cluster)
        n_rows_one = one.scattering.shape[1]
        scattered = np.concatenate([one.scattering @ incoming[:n_rows_one], two.scattering @ incoming[n_rows_one:]])
        return _Parent(outgoing.T @ merged.solve(scattered), outgoing.T @ caused, merged, caused)

    def _felt_by_children(self, level: int, cluster: int, felt: FloatArray) -> list[tuple[int, FloatArray]]:
        """Return what the rows of both children feel, with their numbers, from what their parent feels."""
        one, two = self._children(level, cluster)
        parent = self._levels[level][cluster]
        assert isinstance(parent, _Parent)
        n_border, n_one = self.border.errors.shape[1], len(one.scattering)
        skeletons = self.compression.skeletons[level - 1][2 * cluster : 2 * cluster + 2]
        of_one, of_two = (np.append(np.zeros(each.rows.size), felt[felt.size - n_border :]) for each in skeletons)
        if level < self.compression.tree.n_levels:
            from_outside = self.compression.skeletons[level][cluster].row_map @ felt[: felt.size - n_border]
            of_one[:-n_border], of_two[:-n_border] = np.split(from_outside, [skeletons[0].rows.size])
        scattered = np.concatenate([one.scattering @ of_one, two.scattering @ of_two])
        caused = parent.caused - parent.merged.solve(scattered)
        coupling = self.compression.couplings[level - 1][cluster]
        rows_one, columns_two = coupling.on_first.shape
        rows_two, columns_one = coupling.on_second.shape
        of_one[:rows_one] += coupling.on_first @ caused[n_one : n_one + columns_two]
        of_two[:rows_two] += coupling.on_second @ caused[:columns_one]
        return [(2 * cluster, of_one), (2 * cluster + 1, of_two)]

    def _children(self, level: int, cluster: int) -> tuple[_Cluster, _Cluster]:
        one, two = self._levels[level - 1][2 * cluster : 2 * cluster + 2]
        assert one is not None  # children come first
        assert two is not None
        return one, two

    def _maps(self, level: int, cluster: int) -> tuple[FloatArray, FloatArray]:
        """Return what the rows of both children feel from what their parent feels, and the same of the columns."""
        one, two = self.compression.skeletons[level - 1][2 * cluster : 2 * cluster + 2]
        is_root = level == self.compression.tree.n_levels
        parent = None if is_root else self.compression.skeletons[level][cluster]
        n_border = self.border.errors.shape[1]
        row_map = None if parent is None else parent.row_map
        column_map = None if parent is None else parent.column_map
        return (
            _with_border(row_map, one.rows.size, two.rows.size, n_border),
            _with_border(column_map, one.columns.size, two.columns.size, n_border),
        )


def _with_border(skeleton_map: FloatArray | None, n_one: int, n_two: int, n_border: int) -> FloatArray:
    """Return a map of skeletons to which the border of the parent is added, that of both children."""
    n = 0 if skeleton_map is None else skeleton_map.shape[1]
    result = np.zeros((n_one + n_two + 2 * n_border, n + n_border))
    if skeleton_map is not None:
        result[:n_one, :n] = skeleton_map[:n_one]
        result[n_one + n_border : n_one + n_border + n_two, :n] = skeleton_map[n_one:]
    unit = np.eye(n_border)
    result[n_one : n_one + n_border, n:] = unit
    result[n_one + n_two + n_border :, n:] = unit
    return result
