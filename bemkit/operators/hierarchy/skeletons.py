"""Skeletons of the clusters of a tree: a few rows and columns of the equations that represent a whole cluster.

The column skeleton holds the unknowns through which a cluster acts on distant elements, the row skeleton the equations
through which distant elements act on it. Skeletons do not depend on the conditions on the elements, because tractions
and displacements are both among the unknowns.

The proxy circle of a cluster has twice its radius. The displacements that the cluster causes outside of the circle
follow from their values on it. Inside, the displacements that distant elements cause are those of forces on the circle.
So near elements and the points of the proxy circle replace the rest of the boundary [MartinssonRokhlin2005].

All couplings above the leaves are entries of the boundary equations themselves, between the skeletons of siblings
[MartinssonRokhlin2005], [HoGreengard2012].
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bemkit.arrays import BoolArray, ComplexArray, FloatArray, IntArray
from bemkit.geometry.proximity.cluster_tree import ClusterTree, Discs
from bemkit.operators.boundary_equations import BoundaryEquations
from bemkit.operators.hierarchy.interpolative import Block, Interpolation, sketched
from bemkit.threads import for_each_chunk

PROXY_RATIO = 2.0
"""Radius of the proxy circle relative to that of the cluster: the m-th harmonic on the circle decays like 2^-m."""


def near_clusters(discs: Discs, cluster: int) -> IntArray:
    """Return the other clusters of a level that intersect the proxy circle of a cluster."""
    distance = np.abs(discs.centre - discs.centre[cluster])
    distance[cluster] = np.inf
    neighbours: IntArray = np.flatnonzero(distance < discs.radius + PROXY_RATIO * discs.radius[cluster])
    return neighbours


def proxy_points(discs: Discs, cluster: int, n_points: int) -> ComplexArray:
    """Return points on the proxy circle of a cluster."""
    turns = np.exp(2j * np.pi * np.arange(n_points) / n_points)
    points: ComplexArray = discs.centre[cluster] + PROXY_RATIO * discs.radius[cluster] * turns
    return points


def n_proxies(tolerance: float) -> int:
    """Return how many points of a proxy circle determine a field on it to a tolerance."""
    return int(2.2 * np.log(1.0 / tolerance) / np.log(PROXY_RATIO)) + 8


_FLOOR = 2e-13
"""Smallest tolerance of a level: below, the skeletons would resolve round-off of the entries."""
_FEW = 16
"""Largest number of clusters of a level just below the root; their ranks are higher."""
_UNEVEN = 1e3
"""Largest ratio of element lengths for which random combinations of rows are accurate enough."""


@dataclass(frozen=True, eq=False)
class Skeleton:
    """The skeleton of a cluster.

    Parameters
    ----------
    rows : (n_rows,) array
        Equations 2 * position + component.
    row_map : Interpolation
        From incoming displacements at these rows to all rows of the cluster (above the leaves: of its children's
        skeletons).
    columns : (n_columns,) array
        Unknowns 4 * position + 2 * kind + component.
    column_map : Interpolation
        Its transpose maps all unknowns of the cluster (above the leaves: of its children's skeletons) to equivalent
        unknowns in these columns.
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
        """Return the rows and columns of other clusters inside the proxy circle of a cluster or intersecting it."""
        near = near_clusters(self.discs, cluster)
        if not near.size:
            return np.zeros(0, np.intp), np.zeros(0, np.intp)
        rows = np.concatenate([self.rows[other] for other in near])
        columns = np.concatenate([self.candidates[other] for other in near])
        middle, circle = self.discs.centre[cluster], PROXY_RATIO * self.discs.radius[cluster]
        to_rows, to_columns = (np.abs(self.equations.points[nodes] - middle) for nodes in (rows // 2, columns // 4))
        return rows[to_rows < circle], columns[to_columns < circle + self.extent[columns // 4]]

    def tolerance_at(self, cluster: int, elements: IntArray) -> float:
        """Return the tolerance of a cluster, smaller for large clusters with small elements, which amplify errors."""
        share = (
            4.0
            * float(self.equations.lengths[elements].min(initial=np.inf))
            / (PROXY_RATIO * float(self.discs.radius[cluster]))
        )
        return max(self.tolerance * float(np.sqrt(min(1.0, share))), _FLOOR)

    def guess(self, n_candidates: int, elements: IntArray, tolerance: float, n_kinds: int) -> int | None:
        """Return a guess of the rank; None where random combinations would lose the smallest elements.

        The rank of a leaf depends on whether tractions and displacements are both candidates, and hardly on its size.
        The few clusters just below the root have higher ranks: most contain corners or are surrounded by others.
        """
        lengths = self.equations.lengths[elements]
        if lengths.max(initial=0.0) > _UNEVEN * lengths.min(initial=np.inf):
            return None
        if self.is_lowest:
            return min((3 * n_kinds + 2) * (14 + 2 * n_proxies(tolerance) // 3) // 5, n_candidates)
        return (7 if len(self.rows) <= _FEW else 6) * n_candidates // 10

    def proxies(self, cluster: int) -> ComplexArray:
        """Return the points of the proxy circle of a cluster."""
        return proxy_points(self.discs, cluster, n_proxies(self.tolerance))

    def skeleton(self, cluster: int) -> Skeleton:
        """Choose the skeleton of one cluster."""
        near_rows, near_columns = self.near(cluster)
        rows, columns = self.rows[cluster], self.candidates[cluster]
        row_map, column_map = self._row_map(cluster, near_columns), self._column_map(cluster, near_rows)
        return Skeleton(rows[row_map.skeleton], row_map, columns[column_map.skeleton], column_map)

    def _column_map(self, cluster: int, near_rows: IntArray) -> Interpolation:
        """Interpolate the columns of a cluster from their values at near rows and on the proxy circle."""
        candidates, equations = self.candidates[cluster], self.equations
        proxies, points = self.proxies(cluster), np.unique(near_rows // 2)
        near = equations.block((2 * points[:, None] + np.arange(2)).ravel(), candidates)
        entries = np.concatenate([equations.fields(proxies, candidates), near])
        spacing = 2.0 * np.pi * PROXY_RATIO * self.discs.radius[cluster] / proxies.size
        weights = np.repeat(np.sqrt(np.append(np.full(proxies.size, spacing), equations.lengths[points])), 2)
        elements, kinds = candidates // 4, (candidates // 2) % 2
        tolerance, n_kinds = self.tolerance_at(cluster, elements), 1 + int(np.ptp(kinds)) if kinds.size else 1
        return sketched(
            [Block(entries, weights)],
            1.0 / np.sqrt(equations.lengths[elements]),
            tolerance,
            self.guess(candidates.size, np.append(points, elements), tolerance, n_kinds),
            kinds=kinds,
        )

    def _row_map(self, cluster: int, near_columns: IntArray) -> Interpolation:
        """Interpolate the rows of a cluster from their values under near columns and forces on the proxy circle."""
        rows, equations = self.rows[cluster], self.equations
        points, point_of_row = np.unique(rows // 2, return_inverse=True)
        both_components = (2 * points[:, None] + np.arange(2)).ravel()
        forces = equations.under_forces(self.proxies(cluster), both_components)
        blocks = [Block(forces, np.ones(len(forces)))]
        for kind in (0, 1):
            if (columns := near_columns[(near_columns // 2) % 2 == kind]).size:
                near = equations.block(both_components, columns).T
                blocks.append(Block(near, 1.0 / np.sqrt(equations.lengths[columns // 4])))
        tolerance = self.tolerance_at(cluster, rows // 2)
        return sketched(
            blocks,
            np.sqrt(equations.lengths[rows // 2]),
            tolerance,
            self.guess(rows.size, np.append(points, near_columns // 4), tolerance, 1),
            chosen=None if rows.size == 2 * points.size else 2 * point_of_row + rows % 2,
        )


@dataclass(frozen=True, eq=False)
class Compression:
    """Boundary equations compressed over a tree.

    Parameters
    ----------
    equations : BoundaryEquations
    tree : ClusterTree
    unknowns : tuple of arrays
        Columns of each leaf whose traction or displacement may differ from zero.
    skeletons : tuple of tuples of Skeleton
        One tuple for each level below the root, leaves first, with one skeleton for each cluster.
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
        """Compress the equations; see `Factor` for the arguments.

        The tolerance of skeletons is smaller above the leaves, so that errors do not grow with the number of elements.
        """
        n, supports = equations.points.size, equations.supports
        all_columns = np.arange(4 * n).reshape(-1, 4)
        leaves = [tree.positions(0, leaf) for leaf in range(tree.n_leaves)]
        unknowns = tuple(all_columns[positions][may_differ[positions]] for positions in leaves)
        rows = [np.arange(2 * positions.start, 2 * positions.stop) for positions in leaves]
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
            rows = [np.concatenate([first.rows, second.rows]) for first, second in pairs]
            candidates = [np.concatenate([first.columns, second.columns]) for first, second in pairs]
        return cls(equations, tree, unknowns, tuple(levels))

    def couplings(self, level: int, pair: int) -> tuple[FloatArray, FloatArray]:
        """Return the blocks S12 and S21 between the skeletons of two siblings.

        S12 maps the columns of the second sibling to the rows of the first. Blocks are evaluated at each call: that is
        cheap compared with a merge and takes no memory.
        """
        first, second = self.skeletons[level][2 * pair : 2 * pair + 2]
        return self.equations.block(first.rows, second.columns), self.equations.block(second.rows, first.columns)
