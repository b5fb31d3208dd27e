"""Skeletons of the clusters of a tree: a few unknowns and equations that stand for all of them.

Seen from afar the unknowns of a cluster are those of its column skeleton, and the equations of a cluster feel the rest
of the boundary through its row skeleton. Whatever the conditions on the elements are, the skeletons stay what they are,
because tractions and displacements are both among the unknowns. All couplings above the leaves are entries of the
boundary equations themselves, between the skeletons of siblings [MartinssonRokhlin2005], [HoGreengard2012].
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bemkit.arrays import BoolArray, ComplexArray, FloatArray, IntArray
from bemkit.operators.hierarchy.boundary_columns import NOWHERE, BoundaryColumns
from bemkit.operators.hierarchy.interpolative import Interpolation, sketched
from bemkit.operators.hierarchy.proxies import PROXY_RATIO, Discs, extents, n_proxies, point_forces
from bemkit.operators.hierarchy.tree import ClusterTree
from bemkit.operators.linear.threads import for_each_chunk

_FLOOR = 2e-13
"""No tolerance of a level is smaller: below, round-off of the entries would be compressed."""
_UNEVEN = 10.0
"""Ratio of lengths of elements that see each other beyond which no random combinations are taken."""
_FIRST_GUESS, _GROWTH = 100, 1.3
"""Guesses of ranks: of a leaf, and from one level to the next."""


@dataclass(frozen=True, eq=False)
class Skeleton:
    """What stands for a cluster.

    Parameters
    ----------
    rows : (n_rows,) array
        Equations 2 * place + component.
    row_map : Interpolation
        What all equations of the cluster (of its children: their skeletons) feel, from what these feel.
    columns : (n_columns,) array
        Unknowns 4 * place + 2 * kind + component.
    column_map : Interpolation
        What all unknowns of the cluster (of its children: their skeletons) cause, as if these had caused it.
    """

    rows: IntArray
    row_map: Interpolation
    columns: IntArray
    column_map: Interpolation


@dataclass(frozen=True, eq=False)
class Compression:
    """The boundary equations of collocation over a tree.

    Parameters
    ----------
    columns : BoundaryColumns
    tree : ClusterTree
    unknowns : tuple of arrays
        The columns of each leaf that may have a value: those of tractions and displacements that are not always zero.
    skeletons : tuple of tuples of Skeleton
        By level from the leaves up to below the root, and by cluster.
    """

    columns: BoundaryColumns
    tree: ClusterTree
    unknowns: tuple[IntArray, ...]
    skeletons: tuple[tuple[Skeleton, ...], ...]

    @classmethod
    def of(cls, columns: BoundaryColumns, tree: ClusterTree, may_differ: BoolArray, tolerance: float) -> Compression:
        """Compress the equations.

        Parameters
        ----------
        columns : BoundaryColumns
            In the order of the tree.
        tree : ClusterTree
        may_differ : (n_elements, 4) bool array
            By place: which tractions and displacements may differ from zero.
        tolerance : float
            Of the skeletons of leaves; those above are finer, so that errors do not grow with the number of elements.
        """
        every = np.arange(4 * columns.n_elements).reshape(-1, 4)
        leaves = [tree.places(0, leaf) for leaf in range(tree.n_leaves)]
        unknowns = tuple(every[places][may_differ[places]] for places in leaves)
        rows = [np.arange(2 * places.start, 2 * places.stop) for places in leaves]
        candidates = list(unknowns)
        extent = extents(columns)
        levels: list[tuple[Skeleton, ...]] = []
        guesses = [_FIRST_GUESS] * tree.n_leaves
        for level in range(tree.n_levels):
            view = _LevelView(columns, Discs.of(columns, tree, level), rows, candidates, extent, tolerance, guesses)
            n_integrals = columns.n_elements * n_proxies(tolerance)
            skeletons = tuple(for_each_chunk(view.skeleton, range(len(rows)), n_integrals=n_integrals))
            levels.append(skeletons)
            pairs = list(zip(skeletons[::2], skeletons[1::2], strict=True))
            rows = [np.concatenate([one.rows, two.rows]) for one, two in pairs]
            candidates = [np.concatenate([one.columns, two.columns]) for one, two in pairs]
            ranks = [max(each.rows.size, each.columns.size) for each in skeletons]
            guesses = [int(_GROWTH * max(pair)) for pair in zip(ranks[::2], ranks[1::2], strict=True)]
        return cls(columns, tree, unknowns, tuple(levels))

    def couplings(self, level: int, pair: int) -> tuple[FloatArray, FloatArray]:
        """Return what columns of two siblings of a level cause at the rows of the other, at the first one first.

        They are evaluated anew each time: that takes less than what follows, and no memory.
        """
        one, two = self.skeletons[level][2 * pair : 2 * pair + 2]
        return self.columns.entries(one.rows, two.columns), self.columns.entries(two.rows, one.columns)

    @property
    def largest_rank(self) -> int:
        """Most rows or columns of a skeleton."""
        return max(max(each.rows.size, each.columns.size) for level in self.skeletons for each in level)

    @property
    def n_bytes(self) -> int:
        """Memory of all skeletons [bytes]."""
        return sum(
            each.row_map.n_bytes + each.column_map.n_bytes + each.rows.nbytes + each.columns.nbytes
            for level in self.skeletons
            for each in level
        )


@dataclass(frozen=True, eq=False)
class _LevelView:
    """The clusters of one level with the rows and columns that are candidates for their skeletons."""

    columns: BoundaryColumns
    discs: Discs
    rows: list[IntArray]
    candidates: list[IntArray]
    extent: FloatArray
    tolerance: float
    guesses: list[int]

    def skeleton(self, cluster: int) -> Skeleton:
        """Choose the skeleton of one cluster."""
        near_rows, near_columns = self._near(cluster)
        rows, columns = self.rows[cluster], self.candidates[cluster]
        row_map, column_map = self._row_map(cluster, near_columns), self._column_map(cluster, near_rows)
        return Skeleton(rows[row_map.skeleton], row_map, columns[column_map.skeleton], column_map)

    def _near(self, cluster: int) -> tuple[IntArray, IntArray]:
        """Return the rows and columns of other clusters that lie in the proxy circle of one, or reach into it."""
        near = self.discs.near(cluster)
        if not near.size:
            return np.zeros(0, np.intp), np.zeros(0, np.intp)
        rows = np.concatenate([self.rows[other] for other in near])
        columns = np.concatenate([self.candidates[other] for other in near])
        middle, circle = self.discs.centre[cluster], PROXY_RATIO * self.discs.radius[cluster]
        of_rows, of_columns = (np.abs(self.columns.centre[each] - middle) for each in (rows // 2, columns // 4))
        return rows[of_rows < circle], columns[of_columns < circle + self.extent[columns // 4]]

    def _tolerance_at(self, cluster: int, elements: IntArray) -> float:
        """Return the tolerance of a cluster: errors of large clusters with small elements count more."""
        share = (
            4.0
            * float(self.columns.lengths[elements].min(initial=np.inf))
            / (PROXY_RATIO * float(self.discs.radius[cluster]))
        )
        return max(self.tolerance * float(np.sqrt(min(1.0, share))), _FLOOR)

    def _column_map(self, cluster: int, near_rows: IntArray) -> Interpolation:
        """Interpolate the columns of a cluster, seen from near rows and from the proxy circle."""
        candidates, of = self.candidates[cluster], self.columns
        points, proxies = np.unique(near_rows // 2), self._proxies(cluster)
        places = np.append(np.full(proxies.size, NOWHERE), points)
        fields = of.fields(np.append(proxies, of.centre[points]), places, candidates)
        spacing = 2.0 * np.pi * PROXY_RATIO * self.discs.radius[cluster] / proxies.size
        weights = np.repeat(np.sqrt(np.append(np.full(proxies.size, spacing), of.lengths[points])), 2)
        sizes = 1.0 / np.sqrt(of.lengths[candidates // 4])
        norms = sizes * np.sqrt(np.square(weights) @ np.square(fields))
        for kind in (0, 1):
            own = (candidates // 2) % 2 == kind
            sizes[own] /= norms[own].max(initial=0.0) or 1.0
        guess = self._guess(cluster, np.append(points, candidates // 4))
        return sketched(fields, weights, sizes, self._tolerance_at(cluster, candidates // 4), guess)

    def _row_map(self, cluster: int, near_columns: IntArray) -> Interpolation:
        """Interpolate the rows of a cluster under near columns and under forces on the proxy circle."""
        rows, of = self.rows[cluster], self.columns
        points, number = np.unique(rows // 2, return_inverse=True)
        x, proxies = of.centre[points], self._proxies(cluster)
        circle = PROXY_RATIO * float(self.discs.radius[cluster])
        forces = of.of_forces(point_forces(x, proxies, of.constants.poisson_ratio, circle), points, proxies)
        fields = np.concatenate([of.fields(x, points, near_columns).T, forces])[:, 2 * number + rows % 2]
        weights = np.append(1.0 / np.sqrt(of.lengths[near_columns // 4]), np.ones(len(forces)))
        sizes = np.sqrt(of.lengths[rows // 2])
        kind = np.append((near_columns // 2) % 2, np.full(len(forces), 2))
        groups = (kind == np.arange(3)[:, None]) * np.square(weights)
        largest = np.sqrt(np.max((groups @ np.square(fields)) * np.square(sizes), axis=1, initial=0.0))
        weights /= np.where(largest > 0.0, largest, 1.0)[kind]
        guess = self._guess(cluster, np.append(points, near_columns // 4))
        return sketched(fields, weights, sizes, self._tolerance_at(cluster, rows // 2), guess)

    def _guess(self, cluster: int, elements: IntArray) -> int | None:
        """Return a guess of the rank; none where random combinations would lose the smallest elements."""
        lengths = self.columns.lengths[elements]
        is_even = lengths.max(initial=0.0) <= _UNEVEN * lengths.min(initial=np.inf)
        return self.guesses[cluster] if is_even else None

    def _proxies(self, cluster: int) -> ComplexArray:
        return self.discs.points(cluster, n_proxies(self.tolerance))
