"""Skeletons of the clusters of a tree: a few unknowns and equations that represent all of them.

Seen from afar the unknowns of a cluster are those of its column skeleton, and the equations of a cluster feel the rest
of the boundary through its row skeleton. For all conditions on the elements, the skeletons stay the same,
because tractions and displacements are both among the unknowns.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bemkit.arrays import ComplexArray, FloatArray, IntArray
from bemkit.operators.hierarchy.clusters import Discs
from bemkit.operators.hierarchy.equations import BoundaryEquations
from bemkit.operators.hierarchy.interpolative import Block, Interpolation, sketched
from bemkit.operators.hierarchy.proxies import PROXY_RATIO, n_proxies, near_clusters, proxy_points

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
