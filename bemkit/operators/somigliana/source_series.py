"""Far series of the clusters of a tree, from the leaves up [GreengardRokhlin1987]."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from bemkit.arrays import ComplexArray, FloatArray, IntArray
from bemkit.geometry.proximity.cluster_tree import Clusters
from bemkit.operators.somigliana.expansions import Expansions
from bemkit.operators.somigliana.point_sources import Sources
from bemkit.threads import for_each_chunk

SourcesOf: TypeAlias = Callable[[IntArray, int], Sources]
"""(n,) positions in the tree and a number of Gauss points -> sources on the elements, arrays (n, n_sources)."""
SEPARATION = 3.0
"""Smallest distance of a point from a cluster, relative to its radius, and the gain of each power of the series."""
_CHUNK, _FEW = 128, 8
"""Clusters whose series are translated at a time, and leaves whose elements are evaluated at a time."""
_FEW_POINTS, _SHORT = 4, 0.08
"""Gauss points of short elements, and their largest half length relative to the radius of the leaf; longer elements
take a rule that is exact for all powers."""
_POWERS = 50
"""Number of integrals that take as long as the powers of an element."""


def order_for(tolerance: float) -> int:
    """Return the highest power of series whose error is a tolerance."""
    return math.ceil(math.log(1.0 / tolerance) / math.log(SEPARATION)) + 1


@dataclass(frozen=True, eq=False)
class SourceSeries:
    """Far series of sources on a tree.

    Parameters
    ----------
    expansions : Expansions
    clusters : Clusters
    half : (n_elements,) array [m]
        Half lengths of the elements, in the order of the tree.
    """

    expansions: Expansions
    clusters: Clusters
    half: FloatArray

    def of(self, sources_of: SourcesOf, n_levels: int) -> list[ComplexArray]:
        """Return the series (n_clusters, 2, order + 1) of each of `n_levels` levels, leaves first."""
        n_leaves = self.clusters.tree.n_leaves
        chunks = [slice(i, min(i + _FEW, n_leaves)) for i in range(0, n_leaves, _FEW)]

        def of_leaves(leaves: slice) -> ComplexArray:
            return self._of_leaves(leaves, sources_of)

        series = [np.concatenate(for_each_chunk(of_leaves, chunks, n_integrals=_POWERS * self.half.size))]
        for level, coarse in zip(self.clusters.levels[: n_levels - 1], self.clusters.levels[1:], strict=False):
            n = coarse.centre.size
            parents = np.empty((n, 2, self.expansions.order + 1), complex)
            for begin in range(0, n, _CHUNK):
                chunk = np.arange(begin, min(begin + _CHUNK, n))
                children, above = np.arange(2 * begin, 2 * begin + 2 * chunk.size), np.repeat(chunk, 2)
                arm = level.centre[children] - coarse.centre[above]
                translated = self.expansions.of_parents(
                    series[-1][children], arm, level.radius[children], coarse.radius[above]
                )
                parents[chunk] = translated[::2] + translated[1::2]
            series.append(parents)
        return series

    def _of_leaves(self, chunk: slice, sources_of: SourcesOf) -> ComplexArray:
        """Return the series of consecutive leaves."""
        bounds, leaves = self.clusters.tree.bounds, self.clusters.levels[0]
        positions = np.arange(bounds[chunk.start], bounds[chunk.stop])
        leaf = np.repeat(np.arange(chunk.start, chunk.stop), np.diff(bounds[chunk.start : chunk.stop + 1]))
        is_short = self.half[positions] < _SHORT * leaves.radius[leaf]
        result = np.zeros((chunk.stop - chunk.start, 2, self.expansions.order + 1), complex)
        for n_points, chosen in ((_FEW_POINTS, is_short), (self.expansions.order // 2 + 2, ~is_short)):
            if not chosen.any():
                continue
            present, first = np.unique(leaf[chosen], return_index=True)
            sources = sources_of(positions[chosen], n_points)
            n_sources = sources.position.shape[1]
            source_leaf = np.repeat(leaf[chosen], n_sources)
            flat = Sources._make(values.ravel() for values in sources)
            relative = flat._replace(position=flat.position - leaves.centre[source_leaf])
            result[present - chunk.start] += self.expansions.of_sources(
                relative, leaves.radius[source_leaf], n_sources * first
            )
        return result
