"""A binary tree of clusters of elements by bisection of coordinates.

Each cluster is halved across the longer side of the box around its midpoints, so that what is close in the plane is
close in the tree: the two long sides of a thin body, which are far from each other along the boundary, too.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import numpy as np

from bemkit.arrays import FloatArray, IntArray

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
