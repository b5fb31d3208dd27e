"""Series of the sources on elements, of their clusters from the leaves of a tree up [GreengardRokhlin1987]."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from bemkit.arrays import ComplexArray, FloatArray, IntArray
from bemkit.operators.hierarchy.tree import Clusters
from bemkit.operators.linear.threads import for_each_chunk
from bemkit.operators.somigliana.expansions import Expansions, Sources

SourcesOf: TypeAlias = Callable[[IntArray, int], Sources]
"""From (n,) places and a number of Gauss points: the sources of the elements there, arrays (n, n_sources)."""
SEPARATION = 3.0
"""Distance, by the radius of a cluster, from which on its series is summed: what a power is worth."""
_CHUNK, _FEW = 128, 8
"""Clusters whose series are moved at a time; leaves whose elements are evaluated at a time."""
_FEW_POINTS, _SHORT = 4, 0.08
"""Gauss points of an element that is so short by the radius of its leaf; a rule that is exact for all powers else."""
_POWERS = 50
"""Integrals that take as long as the powers of an element."""


def order_for(tolerance: float) -> int:
    """Return the largest power of series that err by a tolerance."""
    return math.ceil(math.log(1.0 / tolerance) / math.log(SEPARATION)) + 1


@dataclass(frozen=True, eq=False)
class SourceSeries:
    """Makes series of sources.

    Parameters
    ----------
    expansions : Expansions
    clusters : Clusters
    half : (n_elements,) array [m]
        Half lengths of the elements by place.
    """

    expansions: Expansions
    clusters: Clusters
    half: FloatArray

    def of(self, sources_of: SourcesOf, n_levels: int) -> list[ComplexArray]:
        """Return the series (n_clusters, 2, order + 1) of some levels, from the leaves on."""
        n_leaves = self.clusters.tree.n_leaves
        chunks = [slice(i, min(i + _FEW, n_leaves)) for i in range(0, n_leaves, _FEW)]

        def of_leaves(some: slice) -> ComplexArray:
            return self._of_leaves(some, sources_of)

        found = [np.concatenate(for_each_chunk(of_leaves, chunks, n_integrals=_POWERS * self.half.size))]
        for level, coarse in zip(self.clusters.levels[: n_levels - 1], self.clusters.levels[1:], strict=False):
            n = coarse.centre.size
            parents = np.empty((n, 2, self.expansions.order + 1), complex)
            for begin in range(0, n, _CHUNK):
                own = np.arange(begin, min(begin + _CHUNK, n))
                children, above = np.arange(2 * begin, 2 * begin + 2 * own.size), np.repeat(own, 2)
                arm = level.centre[children] - coarse.centre[above]
                moved = self.expansions.of_parents(
                    found[-1][children], arm, level.radius[children], coarse.radius[above]
                )
                parents[own] = moved[::2] + moved[1::2]
            found.append(parents)
        return found

    def _of_leaves(self, some: slice, sources_of: SourcesOf) -> ComplexArray:
        """Return the series of consecutive leaves."""
        bounds, leaves = self.clusters.tree.bounds, self.clusters.levels[0]
        places = np.arange(bounds[some.start], bounds[some.stop])
        leaf = np.repeat(np.arange(some.start, some.stop), np.diff(bounds[some.start : some.stop + 1]))
        is_short = self.half[places] < _SHORT * leaves.radius[leaf]
        result = np.zeros((some.stop - some.start, 2, self.expansions.order + 1), complex)
        for n_points, chosen in ((_FEW_POINTS, is_short), (self.expansions.order // 2 + 2, ~is_short)):
            if not chosen.any():
                continue
            present, first = np.unique(leaf[chosen], return_index=True)
            sources = sources_of(places[chosen], n_points)
            n_sources = sources.place.shape[1]
            own = np.repeat(leaf[chosen], n_sources)
            place, f, g, e = sources.place.ravel(), sources.f.ravel(), sources.g.ravel(), sources.e.ravel()
            result[present - some.start] += self.expansions.of_sources(
                Sources(place - leaves.centre[own], f, g, e), leaves.radius[own], n_sources * first
            )
        return result
