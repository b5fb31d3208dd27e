"""A binary tree of clusters of elements by bisection of coordinates.

Each cluster is halved across the longer side of the box around its midpoints. Elements that are close in the plane are
then close in the tree, even the two long sides of a thin body, which are far from each other along the boundary.

Discs around the clusters decide which clusters are far from a point.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from bemkit.arrays import BoolArray, ComplexArray, FloatArray, IntArray

_WIDE, _FEWEST = 0.25, 8
"""Two leaves are divided at a gap at least this wide relative to both, with at least so many elements on either side. A
leaf with a few distant elements would have half of the body in its near field."""


Pairs: TypeAlias = tuple[IntArray, IntArray]
"""Two arrays (n_pairs,): points, and the cluster or element paired with each."""


@dataclass(frozen=True, eq=False)
class ClusterTree:
    """Clusters of consecutive positions; the children of cluster i are the clusters 2 i and 2 i + 1 of the level below.

    Parameters
    ----------
    order : (n,) array
        The point at each position.
    bounds : (n_leaves + 1,) array
        Leaf i holds the positions bounds[i] ... bounds[i + 1] - 1.
    n_levels : int
        Levels below the root; there are 2**n_levels leaves.
    """

    order: IntArray
    bounds: IntArray
    n_levels: int

    @classmethod
    def of(cls, points: FloatArray, leaf_size: int) -> ClusterTree:
        """Divide points (n, 2) into at least two leaves of about `leaf_size` points, at most twice as many."""
        n_levels = max(1, round(np.log2(max(len(points) / leaf_size, 1.0))))
        order, bounds = np.arange(len(points)), np.array([0, len(points)])
        for level in range(n_levels - 1, -1, -1):
            middles = []
            for begin, end in itertools.pairwise(bounds.tolist()):
                members = order[begin:end]
                member_points = points[members]
                longer = int(np.argmax(np.ptp(member_points, axis=0)))
                across = member_points[:, longer]
                n_first = len(members) // 2 if level else _gap(across)
                halves = np.argpartition(across, n_first)
                if n_first and across[halves[:n_first]].max() == across[halves[n_first]]:
                    # many elements lie on the dividing line itself: divide them along it
                    halves = np.lexsort((member_points[:, 1 - longer], across))
                order[begin:end] = members[halves]
                middles.append(begin + n_first)
            bounds = np.sort(np.concatenate([bounds, middles]))
        # neighbours stay neighbours in memory
        for begin, end in itertools.pairwise(bounds):
            order[begin:end].sort()
        return cls(order, bounds, n_levels)

    @property
    def n_leaves(self) -> int:
        """Number of leaves."""
        return self.bounds.size - 1

    def positions(self, level: int, cluster: int) -> slice:
        """Return the positions of a cluster; level 0 holds the leaves, each higher level half as many clusters."""
        width = 2**level
        return slice(int(self.bounds[cluster * width]), int(self.bounds[(cluster + 1) * width]))

    def leaves_of(self, positions: IntArray) -> IntArray:
        """Return the leaves, ascending, that contain some positions."""
        leaves: IntArray = np.unique(np.searchsorted(self.bounds, positions, side="right") - 1)
        return leaves

    def members(self, point: IntArray, leaf: IntArray) -> Pairs:
        """Return pairs of points and leaves as pairs of the points and all elements of the leaves."""
        begins, counts = self.bounds[leaf], np.diff(self.bounds)[leaf]
        return np.repeat(point, counts), self.order[consecutive(begins, counts)]


def _gap(across: FloatArray) -> int:
    """Return how many coordinates lie below a wide gap; half of them if there is none."""
    ordered = np.sort(across)
    gaps = np.diff(ordered[_FEWEST - 1 : 1 - _FEWEST])
    if not gaps.size or gaps.max() < _WIDE * (ordered[-1] - ordered[0]):
        return across.size // 2
    return _FEWEST + int(np.argmax(gaps))


@dataclass(frozen=True, eq=False)
class Discs:
    """Discs around the clusters of a level.

    Parameters
    ----------
    centre : (n_clusters,) complex array [m]
    radius : (n_clusters,) array [m]
    """

    centre: ComplexArray
    radius: FloatArray

    @classmethod
    def around(cls, tree: ClusterTree, level: int, points: ComplexArray) -> Discs:
        """Return discs that contain points (k, n) of the nodes of each cluster, centred on their bounding boxes."""
        begins = tree.bounds[: -1 : 2**level]
        counts = np.diff(np.append(begins, points.shape[1]))
        low, high = (
            bound.reduceat(bound.reduce(points.real), begins) + 1j * bound.reduceat(bound.reduce(points.imag), begins)
            for bound in (np.minimum, np.maximum)
        )
        centre = 0.5 * (low + high)
        farthest = np.abs(points - np.repeat(centre, counts)).max(axis=0)
        return cls(centre, np.maximum.reduceat(farthest, begins))


@dataclass(frozen=True, eq=False)
class Clusters:
    """Clusters of elements and discs around them.

    Parameters
    ----------
    tree : ClusterTree
    levels : tuple of Discs
        Leaves first, root last.
    """

    tree: ClusterTree
    levels: tuple[Discs, ...]

    @classmethod
    def around(cls, tree: ClusterTree, points: ComplexArray) -> Clusters:
        """Return clusters whose discs contain k points of the element at each position, points (k, n)."""
        return cls(tree, tuple(Discs.around(tree, level, points) for level in range(tree.n_levels + 1)))

    def divided(
        self, n_points: int, is_far: Callable[[int, IntArray, IntArray], BoolArray]
    ) -> tuple[list[Pairs], Pairs]:
        """Divide the elements, for each point, into far clusters and near elements.

        Parameters
        ----------
        n_points : int
        is_far : callable (level, points, clusters) -> (n_pairs,) mask
            For arrays (n_pairs,) of points and clusters of a level.

        Returns
        -------
        far : list of pairs of points and clusters
            One entry for each level, leaves first.
        near : pair of arrays
            Points, ascending, and elements.
        """
        point, cluster = np.arange(n_points), np.zeros(n_points, np.intp)
        far: list[Pairs] = []
        for level in range(self.tree.n_levels, -1, -1):
            if far:
                point, cluster = children(point, cluster)
            away = is_far(level, point, cluster)
            far.append((point[away], cluster[away]))
            point, cluster = point[~away], cluster[~away]
        return far[::-1], self.tree.members(point, cluster)


def children(point: IntArray, cluster: IntArray) -> Pairs:
    """Return pairs of points and clusters as twice as many pairs with the clusters of the level below."""
    return np.repeat(point, 2), (2 * cluster[:, None] + np.array([0, 1])).ravel()


def consecutive(begins: IntArray, counts: IntArray) -> IntArray:
    """Return begins[0], begins[0] + 1, ... (counts[0] integers), begins[1], ..."""
    ends = np.cumsum(counts)
    numbers: IntArray = np.arange(counts.sum()) + np.repeat(begins - (ends - counts), counts)
    return numbers
