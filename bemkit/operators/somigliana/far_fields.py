"""Fields of elements far from points, from series of their clusters.

Near the boundary, the displacement of the nearest boundary point is subtracted from all displacements, so that fields
are small. So there are three series: for the data and for the constant displacements 1 and i, which are subtracted term
by term.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import TypeAlias

import numpy as np

from bemkit.arrays import BoolArray, ComplexArray, IntArray
from bemkit.geometry.proximity.cluster_tree import Clusters, Pairs
from bemkit.geometry.quadrature import gauss_legendre
from bemkit.operators.material import Material
from bemkit.operators.somigliana.expansions import Expansions
from bemkit.operators.somigliana.point_sources import N_POINTS, BoundaryData, Sources, layer_sources
from bemkit.operators.somigliana.source_series import SEPARATION, SourceSeries

ORDER = 34
"""Highest power of the series; stresses of single clusters have errors of 1e-13, each power gains a factor of three."""
Fields: TypeAlias = Callable[[ComplexArray, ComplexArray, float], ComplexArray]


class FarFields:
    """Series of the clusters of a boundary with its displacements and tractions.

    Parameters
    ----------
    clusters : Clusters
    data : BoundaryData
    material : Material
    length : float [m]
        Unit of length in the logarithm.
    """

    def __init__(self, clusters: Clusters, data: BoundaryData, material: Material, length: float) -> None:
        self._clusters, self._material = clusters, material
        self._expansions = Expansions(ORDER, material.kappa, length)
        series = SourceSeries(self._expansions, clusters, 0.5 * data.mesh.lengths[clusters.tree.order])
        zero, one = np.zeros((data.mesh.n_elements, 1), complex), np.ones((data.mesh.n_elements, 1), complex)
        units = (replace(data, displacement=unit, traction=zero) for unit in (one, 1j * one))
        of_data = (series.of(partial(self._sources, each), len(clusters.levels)) for each in (data, *units))
        self._series = [np.stack(level, axis=1) for level in zip(*of_data, strict=True)]

    def divided(self, x: ComplexArray) -> tuple[list[Pairs], Pairs]:
        """Return pairs of points and far clusters for each level, and pairs of points and near elements."""

        def is_far(level: int, point: IntArray, cluster: IntArray) -> BoolArray:
            discs = self._clusters.levels[level]
            return np.asarray(np.abs(x[point] - discs.centre[cluster]) > SEPARATION * discs.radius[cluster])

        return self._clusters.divided(x.size, is_far)

    def displacements(self, x: ComplexArray, reference: ComplexArray, far: list[Pairs]) -> ComplexArray:
        """Return the far displacements (1, n_points) minus those of constant displacements `reference`."""
        expansions, two_mu = self._expansions, 2.0 * self._material.shear_modulus
        return self._summed(x, reference, far, 1, lambda *disc: expansions.outer_displacements(*disc)[None] / two_mu)

    def gradients(self, x: ComplexArray, reference: ComplexArray, far: list[Pairs]) -> ComplexArray:
        """Return Phi and D (2, n_points) of far clusters; see `displacements`."""
        return self._summed(x, reference, far, 2, lambda *disc: np.stack(self._expansions.outer_gradients(*disc)))

    def _summed(
        self, x: ComplexArray, reference: ComplexArray, far: list[Pairs], n_fields: int, fields: Fields
    ) -> ComplexArray:
        """Sum the fields of clusters at far points."""
        result = np.zeros((n_fields, x.size), complex)
        for (point, cluster), discs, series in zip(far, self._clusters.levels, self._series, strict=True):
            order = np.argsort(cluster, kind="stable")
            present, begins, counts = np.unique(cluster[order], return_index=True, return_counts=True)
            for source, begin, count in zip(present, begins, counts, strict=True):
                targets = point[order[begin : begin + count]]
                values = fields(series[source], x[targets] - discs.centre[source], float(discs.radius[source]))
                constant = reference[targets]
                result[:, targets] += values[..., 0] - constant.real * values[..., 1] - constant.imag * values[..., 2]
        return result

    def _sources(self, data: BoundaryData, positions: IntArray, n_points: int) -> Sources:
        """Return the sources of the single layer of tractions minus the double layer of displacements."""
        elements = self._clusters.tree.order[positions]
        is_straight = bool(data.mesh.is_straight[elements].all())
        rule = gauss_legendre(n_points + (data.highest + 1) // 2 if is_straight else N_POINTS + data.highest // 2)
        return layer_sources(*data.at(elements, *rule), self._material)
