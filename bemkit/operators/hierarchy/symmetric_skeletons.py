"""Skeletons of symmetric equations: one interpolation of a cluster serves its rows and its columns."""

from __future__ import annotations

import numpy as np

from bemkit.arrays import IntArray
from bemkit.operators.hierarchy.galerkin_columns import GalerkinColumns
from bemkit.operators.hierarchy.interpolative import Block, sketched
from bemkit.operators.hierarchy.proxies import PROXY_RATIO
from bemkit.operators.hierarchy.skeletons import LevelView, Skeleton

_SHARE = 0.1
"""Tolerance of a cluster of a few elements by that asked for: forces of nodes are small differences of large terms."""
_FLOOR = 2e-14
"""No tolerance is smaller: of entries of one size, compared with the largest, less is known to round-off."""


class SymmetricView(LevelView):
    """The clusters of one level of Galerkin's equations."""

    @property
    def _of(self) -> GalerkinColumns:
        assert isinstance(self.columns, GalerkinColumns)
        return self.columns

    def skeleton(self, cluster: int) -> Skeleton:
        """Choose the skeleton of one cluster."""
        of, candidates = self._of, self.candidates[cluster]
        _, near = self.near(cluster)
        proxies = self.proxies(cluster)
        entries = of.between(of.rows_of(near), of.rows_of(candidates))
        weights = np.append(np.ones(near.size), np.full(2 * proxies.size, of.material.plane_modulus))
        fields = np.concatenate([entries, of.fields(proxies, candidates)])
        own = candidates // 4
        tolerance = self.tolerance_at(cluster, own)
        guess = self.guess(own.size, np.append(own, near // 4), tolerance, 2)
        map_ = sketched([Block(fields, weights)], np.ones(own.size), tolerance, guess)
        columns = candidates[map_.skeleton]
        return Skeleton(of.rows_of(columns), map_, columns, map_)

    def tolerance_at(self, cluster: int, elements: IntArray) -> float:
        """Return the tolerance of a cluster: smooth displacements add up the errors of all its small elements."""
        share = 4.0 * float(self.columns.lengths[elements].min()) / (PROXY_RATIO * float(self.discs.radius[cluster]))
        return max(_SHARE * self.tolerance * min(1.0, share), _FLOOR)
