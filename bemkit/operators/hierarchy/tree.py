"""A binary tree of clusters of elements by bisection of coordinates.

Each cluster is halved across the longer side of the box around its midpoints, so that what is close in the plane is
close in the tree: the two long sides of a thin body, which are far from each other along the boundary, too.

Discs around the clusters say which of them are far from points.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from bemkit.arrays import BoolArray, ComplexArray, FloatArray, IntArray

_WIDE, _FEWEST = 0.25, 8
"""Two leaves part at a gap, if it is as wide as this share of both and leaves so many elements on either side: few that
are far from the others make a leaf see half of the body as near."""


@dataclass(frozen=True, eq=False)
class ClusterTree:
    """Clusters of consecutive places; cluster i of a level has the clusters 2 i and 2 i + 1 of the next one.

    Parameters
    ----------
    order : (n,) array
        The point at each place.
    bounds : (n_leaves + 1,) array
        Leaf i holds the places bounds[i] ... bounds[i + 1] - 1.
    n_levels : int
        Levels below the root; there are 2**n_levels leaves.
    """

    order: IntArray
    bounds: IntArray
    n_levels: int

    @classmethod
    def of(cls, points: FloatArray, leaf_size: int) -> ClusterTree:
        """Divide points (n, 2) into clusters of about `leaf_size`, twice as many at most, at least into two."""
        n_levels = max(1, round(np.log2(max(len(points) / leaf_size, 1.0))))
        order, bounds = np.arange(len(points)), np.array([0, len(points)])
        for level in range(n_levels - 1, -1, -1):
            middles = []
            for begin, end in itertools.pairwise(bounds.tolist()):
                members = order[begin:end]
                own = points[members]
                longer = int(np.argmax(np.ptp(own, axis=0)))
                across = own[:, longer]
                n_first = own.shape[0] // 2 if level else _gap(across)
                halves = np.argpartition(across, n_first)
                if n_first and across[halves[:n_first]].max() == across[halves[n_first]]:
                    # most elements may be on a side along the dividing line, which then is divided at a point
                    halves = np.lexsort((own[:, 1 - longer], across))
                order[begin:end] = members[halves]
                middles.append(begin + n_first)
            bounds = np.sort(np.concatenate([bounds, middles]))
        # neighbours stay neighbours in memory
        for begin, end in itertools.pairwise(bounds):
            order[begin:end].sort()
        return cls(order, bounds, n_levels)

    @classmethod
    def single(cls, n: int) -> ClusterTree:
        """Return a tree whose only cluster holds n points in their own order."""
        return cls(np.arange(n), np.array([0, n]), 0)

    @property
    def n_leaves(self) -> int:
        """Number of leaves."""
        return self.bounds.size - 1

    def places(self, level: int, cluster: int) -> slice:
        """Return the places of a cluster; level 0 holds the leaves, each further one half as many clusters."""
        width = 2**level
        return slice(int(self.bounds[cluster * width]), int(self.bounds[(cluster + 1) * width]))

    def leaves_of(self, places: IntArray) -> IntArray:
        """Return the leaves, ascending, that hold some places."""
        found: IntArray = np.unique(np.searchsorted(self.bounds, places, side="right") - 1)
        return found


def _gap(across: FloatArray) -> int:
    """Return how many of some coordinates are on one side of a wide gap, half of them if there is none."""
    ordered = np.sort(across)
    gaps = np.diff(ordered[_FEWEST - 1 : 1 - _FEWEST])
    if not gaps.size or gaps.max() < _WIDE * (ordered[-1] - ordered[0]):
        return across.size // 2
    return _FEWEST + int(np.argmax(gaps))


Pairs: TypeAlias = tuple[IntArray, IntArray]
"""Two arrays (n_pairs,): points, and the clusters or elements that each of them is paired with."""


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
        """Return discs about the middles of the boxes around points (k, n) of the nodes of each cluster."""
        begins = tree.bounds[: -1 : 2**level]
        counts = np.diff(np.append(begins, points.shape[1]))
        low, high = (
            of.reduceat(of.reduce(points.real), begins) + 1j * of.reduceat(of.reduce(points.imag), begins)
            for of in (np.minimum, np.maximum)
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
        From the leaves up to the root.
    """

    tree: ClusterTree
    levels: tuple[Discs, ...]

    @classmethod
    def around(cls, tree: ClusterTree, points: ComplexArray) -> Clusters:
        """Return clusters whose discs hold some points (k, n) of the element at each place."""
        return cls(tree, tuple(Discs.around(tree, level, points) for level in range(tree.n_levels + 1)))

    def divided(
        self, n_points: int, is_far: Callable[[int, IntArray, IntArray], BoolArray]
    ) -> tuple[list[Pairs], Pairs]:
        """Divide the elements into clusters far from points and elements near them, each element in one of the two.

        Parameters
        ----------
        n_points : int
        is_far : callable (level, points, clusters) -> (n_pairs,) mask
            Of a level and arrays (n_pairs,) of points and clusters.

        Returns
        -------
        far : list of pairs of points and clusters
            For each level, from the leaves on.
        near : pair of arrays
            Points, ascending, and numbers of elements.
        """
        point, cluster = np.arange(n_points), np.zeros(n_points, np.intp)
        far: list[Pairs] = []
        for level in range(self.tree.n_levels, -1, -1):
            if far:
                point, cluster = np.repeat(point, 2), (2 * cluster[:, None] + np.array([0, 1])).ravel()
            away = is_far(level, point, cluster)
            far.append((point[away], cluster[away]))
            point, cluster = point[~away], cluster[~away]
        begins, counts = self.tree.bounds[cluster], np.diff(self.tree.bounds)[cluster]
        return far[::-1], (np.repeat(point, counts), self.tree.order[consecutive(begins, counts)])


def consecutive(begins: IntArray, counts: IntArray) -> IntArray:
    """Return begins[0], begins[0] + 1, ... (counts[0] numbers), begins[1], ..."""
    ends = np.cumsum(counts)
    numbers: IntArray = np.arange(counts.sum()) + np.repeat(begins - (ends - counts), counts)
    return numbers
