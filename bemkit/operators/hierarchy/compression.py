"""Boundary equations compressed over a tree: skeletons of its clusters, and what couples them.

All couplings above the leaves are entries of the boundary equations themselves, between the skeletons of siblings
[MartinssonRokhlin2005], [HoGreengard2012].
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bemkit.arrays import BoolArray, FloatArray, IntArray
from bemkit.operators.hierarchy.clusters import Discs
from bemkit.operators.hierarchy.equations import BoundaryEquations
from bemkit.operators.hierarchy.proxies import n_proxies
from bemkit.operators.hierarchy.skeletons import LevelView, Skeleton
from bemkit.operators.hierarchy.tree import ClusterTree
from bemkit.operators.linear.threads import for_each_chunk


@dataclass(frozen=True, eq=False)
class Compression:
    """Boundary equations over a tree.

    Parameters
    ----------
    equations : BoundaryEquations
    tree : ClusterTree
    unknowns : tuple of arrays
        The columns of each leaf that may have a value: those of tractions and displacements that are not always zero.
    skeletons : tuple of tuples of Skeleton
        By level from the leaves up to below the root, and by cluster.
    """

    equations: BoundaryEquations
    tree: ClusterTree
    unknowns: tuple[IntArray, ...]
    skeletons: tuple[tuple[Skeleton, ...], ...]

    @classmethod
    def of(
        cls,
        equations: BoundaryEquations,
        tree: ClusterTree,
        may_differ: BoolArray,
        tolerance: float,
        level_view: type[LevelView] = LevelView,
    ) -> Compression:
        """Compress the equations.

        Parameters
        ----------
        equations : BoundaryEquations
            In the order of the tree.
        tree : ClusterTree
        may_differ : (n_elements, 4) bool array
            By place: which tractions and displacements may differ from zero.
        tolerance : float
            Of the skeletons of leaves; those above are finer, so that errors do not grow with the number of elements.
        level_view : type of LevelView
            How skeletons are chosen.
        """
        n, supports = equations.points.size, equations.supports
        every = np.arange(4 * n).reshape(-1, 4)
        leaves = [tree.places(0, leaf) for leaf in range(tree.n_leaves)]
        unknowns = tuple(every[places][may_differ[places]] for places in leaves)
        rows = [np.arange(2 * places.start, 2 * places.stop) for places in leaves]
        candidates = list(unknowns)
        extent = np.abs(supports - equations.points).max(axis=0)
        levels: list[tuple[Skeleton, ...]] = []
        for level in range(tree.n_levels):
            discs = Discs.around(tree, level, supports)
            view = level_view(equations, discs, rows, candidates, extent, tolerance, is_lowest=level == 0)
            n_integrals = n * n_proxies(tolerance)
            skeletons = tuple(for_each_chunk(view.skeleton, range(len(rows)), n_integrals=n_integrals))
            levels.append(skeletons)
            pairs = list(zip(skeletons[::2], skeletons[1::2], strict=True))
            rows = [np.concatenate([one.rows, two.rows]) for one, two in pairs]
            candidates = [np.concatenate([one.columns, two.columns]) for one, two in pairs]
        return cls(equations, tree, unknowns, tuple(levels))

    def couplings(self, level: int, pair: int) -> tuple[FloatArray, FloatArray]:
        """Return what columns of two siblings of a level cause at the rows of the other, at the first one first.

        They are evaluated anew each time: that takes less than what follows, and no memory.
        """
        one, two = self.skeletons[level][2 * pair : 2 * pair + 2]
        return self.equations.block(one.rows, two.columns), self.equations.block(two.rows, one.columns)

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
