"""Skeletons of the clusters of a tree: a few unknowns and equations that represent all of them.

Seen from afar the unknowns of a cluster are those of its column skeleton, and the equations of a cluster feel the rest
of the boundary through its row skeleton. For all conditions on the elements, the skeletons stay the same,
because tractions and displacements are both among the unknowns.

Outside of a circle of twice the radius of a cluster every displacement that its elements cause follows from that on the
circle, and every displacement that comes from outside of it is, within, that of forces on the circle. So the near field
and the points of a proxy circle say all that the elements of a cluster do to the rest of the boundary, and the other
way round [MartinssonRokhlin2005].

All couplings above the leaves are entries of the boundary equations themselves, between the skeletons of siblings
[MartinssonRokhlin2005], [HoGreengard2012].
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bemkit.arrays import BoolArray, ComplexArray, FloatArray, IntArray
from bemkit.operators.hierarchy.equations import BoundaryEquations
from bemkit.operators.hierarchy.interpolative import Block, Interpolation, sketched
from bemkit.operators.hierarchy.tree import ClusterTree, Discs
from bemkit.operators.linear.threads import for_each_chunk

PROXY_RATIO = 2.0
"""Radius of the proxy circle by that of the cluster: what varies m times along the circle decays like 2^-m inside."""


def near_clusters(discs: Discs, cluster: int) -> IntArray:
    """Return the other clusters of a level that reach into the proxy circle of one."""
    distance = np.abs(discs.centre - discs.centre[cluster])
    distance[cluster] = np.inf
    found: IntArray = np.flatnonzero(distance < discs.radius + PROXY_RATIO * discs.radius[cluster])
    return found


def proxy_points(discs: Discs, cluster: int, n_points: int) -> ComplexArray:
    """Return points on the proxy circle of a cluster."""
    turns = np.exp(2j * np.pi * np.arange(n_points) / n_points)
    points: ComplexArray = discs.centre[cluster] + PROXY_RATIO * discs.radius[cluster] * turns
    return points


def n_proxies(tolerance: float) -> int:
    """Return how many points of a proxy circle make the field on it known to a tolerance."""
    return int(2.2 * np.log(1.0 / tolerance) / np.log(PROXY_RATIO)) + 8


_FLOOR = 2e-13
"""No tolerance of a level is smaller: below, round-off of the entries would be compressed."""
_FEW = 16
"""Clusters of a level that are few."""
_UNEVEN = 1e3
"""Ratio of lengths of elements that see each other beyond which no random combinations are taken."""


@dataclass(frozen=True, eq=False)
class Skeleton:
    """The skeleton of a cluster.

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
class LevelView:
    """The clusters of one level with the rows and columns that are candidates for their skeletons."""

    equations: BoundaryEquations
    discs: Discs
    rows: list[IntArray]
    candidates: list[IntArray]
    extent: FloatArray
    tolerance: float
    is_lowest: bool

    def near(self, cluster: int) -> tuple[IntArray, IntArray]:
        """Return the rows and columns of other clusters that lie in the proxy circle of one, or reach into it."""
        near = near_clusters(self.discs, cluster)
        if not near.size:
            return np.zeros(0, np.intp), np.zeros(0, np.intp)
        rows = np.concatenate([self.rows[other] for other in near])
        columns = np.concatenate([self.candidates[other] for other in near])
        middle, circle = self.discs.centre[cluster], PROXY_RATIO * self.discs.radius[cluster]
        of_rows, of_columns = (np.abs(self.equations.points[each] - middle) for each in (rows // 2, columns // 4))
        return rows[of_rows < circle], columns[of_columns < circle + self.extent[columns // 4]]

    def tolerance_at(self, cluster: int, elements: IntArray) -> float:
        """Return the tolerance of a cluster: errors of large clusters with small elements count more."""
        share = (
            4.0
            * float(self.equations.lengths[elements].min(initial=np.inf))
            / (PROXY_RATIO * float(self.discs.radius[cluster]))
        )
        return max(self.tolerance * float(np.sqrt(min(1.0, share))), _FLOOR)

    def guess(self, n_candidates: int, elements: IntArray, tolerance: float, n_kinds: int) -> int | None:
        """Return a guess of the rank, none where random combinations would lose the smallest elements.

        That of a leaf hardly depends on its size, but on whether tractions and displacements are two kinds of columns;
        most of the few clusters below the root have corners or others all around.
        """
        lengths = self.equations.lengths[elements]
        if lengths.max(initial=0.0) > _UNEVEN * lengths.min(initial=np.inf):
            return None
        if self.is_lowest:
            return min((3 * n_kinds + 2) * (14 + 2 * n_proxies(tolerance) // 3) // 5, n_candidates)
        return (7 if len(self.rows) <= _FEW else 6) * n_candidates // 10

    def proxies(self, cluster: int) -> ComplexArray:
        """Return the points that represent all that is far from a cluster."""
        return proxy_points(self.discs, cluster, n_proxies(self.tolerance))

    def skeleton(self, cluster: int) -> Skeleton:
        """Choose the skeleton of one cluster."""
        near_rows, near_columns = self.near(cluster)
        rows, columns = self.rows[cluster], self.candidates[cluster]
        row_map, column_map = self._row_map(cluster, near_columns), self._column_map(cluster, near_rows)
        return Skeleton(rows[row_map.skeleton], row_map, columns[column_map.skeleton], column_map)

    def _column_map(self, cluster: int, near_rows: IntArray) -> Interpolation:
        """Interpolate the columns of a cluster, seen from near rows and from the proxy circle."""
        candidates, of = self.candidates[cluster], self.equations
        proxies, points = self.proxies(cluster), np.unique(near_rows // 2)
        near = of.block((2 * points[:, None] + np.arange(2)).ravel(), candidates)
        entries = np.concatenate([of.fields(proxies, candidates), near])
        spacing = 2.0 * np.pi * PROXY_RATIO * self.discs.radius[cluster] / proxies.size
        weights = np.repeat(np.sqrt(np.append(np.full(proxies.size, spacing), of.lengths[points])), 2)
        elements, kinds = candidates // 4, (candidates // 2) % 2
        tolerance, n_kinds = self.tolerance_at(cluster, elements), 1 + int(np.ptp(kinds)) if kinds.size else 1
        return sketched(
            [Block(entries, weights)],
            1.0 / np.sqrt(of.lengths[elements]),
            tolerance,
            self.guess(candidates.size, np.append(points, elements), tolerance, n_kinds),
            kinds=kinds,
        )

    def _row_map(self, cluster: int, near_columns: IntArray) -> Interpolation:
        """Interpolate the rows of a cluster under near columns and under forces on the proxy circle."""
        rows, of = self.rows[cluster], self.equations
        points, number = np.unique(rows // 2, return_inverse=True)
        both = (2 * points[:, None] + np.arange(2)).ravel()
        forces = of.under_forces(self.proxies(cluster), both)
        blocks = [Block(forces, np.ones(len(forces)))]
        for kind in (0, 1):
            if (seen := near_columns[(near_columns // 2) % 2 == kind]).size:
                blocks.append(Block(of.block(both, seen).T, 1.0 / np.sqrt(of.lengths[seen // 4])))
        tolerance = self.tolerance_at(cluster, rows // 2)
        return sketched(
            blocks,
            np.sqrt(of.lengths[rows // 2]),
            tolerance,
            self.guess(rows.size, np.append(points, near_columns // 4), tolerance, 1),
            chosen=None if rows.size == 2 * points.size else 2 * number + rows % 2,
        )


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
