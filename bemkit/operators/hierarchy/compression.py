"""Skeletons of the clusters of a tree: a few unknowns and equations that stand for all of them.

Seen from afar the unknowns of a cluster are those of its column skeleton, and the equations of a cluster feel the rest
of the boundary through its row skeleton. Whatever the conditions on the elements are, the skeletons stay what they are,
because tractions and displacements are both among the unknowns. All couplings above the leaves are entries of the
boundary equations themselves, between the skeletons of siblings [MartinssonRokhlin2005], [HoGreengard2012].
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bemkit.arrays import BoolArray, FloatArray, IntArray
from bemkit.operators.hierarchy.boundary_columns import NOWHERE, BoundaryColumns
from bemkit.operators.hierarchy.interpolative import interpolative
from bemkit.operators.hierarchy.proxies import PROXY_RATIO, Discs, extents, n_proxies, point_forces
from bemkit.operators.hierarchy.tree import ClusterTree
from bemkit.operators.linear.threads import for_each_chunk

_FLOOR = 2e-13
"""No tolerance of a level is smaller: below, round-off of the entries would be compressed."""


@dataclass(frozen=True, eq=False)
class Skeleton:
    """What stands for a cluster.

    Parameters
    ----------
    rows : (n_rows,) array
        Equations 2 * place + component.
    row_map : (n_candidates, n_rows) array
        What all equations of the cluster (of its children: their skeletons) feel, from what these feel.
    columns : (n_columns,) array
        Unknowns 4 * place + 2 * kind + component.
    column_map : (n_candidates, n_columns) array
        What all unknowns of the cluster (of its children: their skeletons) add to these.
    """

    rows: IntArray
    row_map: FloatArray
    columns: IntArray
    column_map: FloatArray


@dataclass(frozen=True, eq=False)
class Coupling:
    """What the skeleton columns of one sibling cause at the skeleton rows of the other."""

    on_first: FloatArray
    on_second: FloatArray


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
    couplings : tuple of tuples of Coupling
        The same by pair of siblings.
    """

    columns: BoundaryColumns
    tree: ClusterTree
    unknowns: tuple[IntArray, ...]
    skeletons: tuple[tuple[Skeleton, ...], ...]
    couplings: tuple[tuple[Coupling, ...], ...]

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
        levels, couplings = [], []
        for level in range(tree.n_levels):
            view = _LevelView(columns, Discs.of(columns, tree, level), rows, candidates, extent, tolerance)
            n_integrals = columns.n_elements * n_proxies(tolerance)
            skeletons = tuple(for_each_chunk(view.skeleton, range(len(rows)), n_integrals=n_integrals))
            pairs = list(zip(skeletons[::2], skeletons[1::2], strict=True))
            levels.append(skeletons)
            couplings.append(
                tuple(
                    Coupling(columns.entries(one.rows, two.columns), columns.entries(two.rows, one.columns))
                    for one, two in pairs
                )
            )
            rows = [np.concatenate([one.rows, two.rows]) for one, two in pairs]
            candidates = [np.concatenate([one.columns, two.columns]) for one, two in pairs]
        return cls(columns, tree, unknowns, tuple(levels), tuple(couplings))

    @property
    def largest_rank(self) -> int:
        """Most rows or columns of a skeleton."""
        return max(max(each.rows.size, each.columns.size) for level in self.skeletons for each in level)

    @property
    def n_bytes(self) -> int:
        """Memory of all maps and couplings [bytes]."""
        maps = sum(each.row_map.nbytes + each.column_map.nbytes for level in self.skeletons for each in level)
        return maps + sum(each.on_first.nbytes + each.on_second.nbytes for level in self.couplings for each in level)


@dataclass(frozen=True, eq=False)
class _LevelView:
    """The clusters of one level with the rows and columns that are candidates for their skeletons."""

    columns: BoundaryColumns
    discs: Discs
    rows: list[IntArray]
    candidates: list[IntArray]
    extent: FloatArray
    tolerance: float

    def skeleton(self, cluster: int) -> Skeleton:
        """Choose the skeleton of one cluster."""
        near_rows, near_columns = self._near(cluster)
        row_choice, row_map = self._row_skeleton(cluster, near_columns)
        column_choice, column_map = self._column_skeleton(cluster, near_rows)
        return Skeleton(self.rows[cluster][row_choice], row_map, self.candidates[cluster][column_choice], column_map)

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
        share = 4.0 * float(self.columns.lengths[elements].min()) / (PROXY_RATIO * float(self.discs.radius[cluster]))
        return max(self.tolerance * float(np.sqrt(min(1.0, share))), _FLOOR)

    def _column_skeleton(self, cluster: int, near_rows: IntArray) -> tuple[IntArray, FloatArray]:
        """Interpolate the columns of a cluster, seen from near rows and from the proxy circle."""
        candidates, of = self.candidates[cluster], self.columns
        if not candidates.size:
            return np.zeros(0, np.intp), np.zeros((0, 0))
        points, number = np.unique(near_rows // 2, return_inverse=True)
        proxies = self.discs.points(cluster, n_proxies(self.tolerance))
        places = np.append(np.full(proxies.size, NOWHERE), points)
        fields = of.fields(np.append(proxies, of.centre[points]), places, candidates)
        seen, near = fields[: proxies.size], fields[proxies.size :]
        weight = self._proxy_weight(cluster)
        parts = np.stack([near.real, near.imag])[near_rows % 2, number]
        parts *= np.sqrt(of.lengths[near_rows // 2])[:, None]
        matrix = np.concatenate([weight * seen.real, weight * seen.imag, parts])
        sizes = 1.0 / np.sqrt(of.lengths[candidates // 4])
        matrix *= sizes
        norms = np.sqrt(np.square(matrix).sum(axis=0))
        for kind in (0, 1):
            own = (candidates // 2) % 2 == kind
            largest = norms[own].max(initial=0.0) or 1.0
            matrix[:, own] /= largest
            sizes[own] /= largest
        choice, interpolation = interpolative(matrix, self._tolerance_at(cluster, candidates // 4))
        # the columns were scaled by their sizes
        column_map = (interpolation * sizes[choice, None] / sizes).T
        return choice, np.ascontiguousarray(column_map)

    def _row_skeleton(self, cluster: int, near_columns: IntArray) -> tuple[IntArray, FloatArray]:
        """Interpolate the rows of a cluster under near columns and under forces on the proxy circle."""
        rows, of = self.rows[cluster], self.columns
        points, number = np.unique(rows // 2, return_inverse=True)
        x, proxies = of.centre[points], self.discs.points(cluster, n_proxies(self.tolerance))
        circle = PROXY_RATIO * float(self.discs.radius[cluster])
        forces = point_forces(x, proxies, of.constants.poisson_ratio, circle).reshape(-1, x.size)
        near = of.fields(x, points, near_columns).T / np.sqrt(of.lengths[near_columns // 4])[:, None]
        kind = np.append((near_columns // 2) % 2, np.full(len(forces), 2))
        fields = np.concatenate([near, forces])
        parts = np.stack([fields.real, fields.imag])[rows % 2, :, number].T
        sizes = np.sqrt(of.lengths[rows // 2])
        parts *= sizes
        for each in (0, 1, 2):
            group = parts[kind == each]
            parts[kind == each] /= np.sqrt(np.square(group).sum(axis=0).max(initial=0.0)) or 1.0
        choice, interpolation = interpolative(parts, self._tolerance_at(cluster, rows // 2))
        row_map = (interpolation * sizes[choice, None] / sizes).T
        return choice, np.ascontiguousarray(row_map)

    def _proxy_weight(self, cluster: int) -> float:
        n_points = n_proxies(self.tolerance)
        return float(np.sqrt(2.0 * np.pi * PROXY_RATIO * self.discs.radius[cluster] / n_points))
