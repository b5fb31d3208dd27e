"""Fields of elements far from points, from series of their clusters.

Near the boundary, the displacement of the nearest boundary point is subtracted from all displacements, so that fields
are small. So there are three series: for the data and for the constant displacements 1 and i, which are subtracted term
by term.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import TypeAlias

import numpy as np

from bemkit.arrays import BoolArray, ComplexArray, IntArray
from bemkit.geometry.proximity.cluster_tree import Clusters, Pairs
from bemkit.geometry.quadrature import gauss_legendre
from bemkit.operators.element_geometry import ElementGeometry
from bemkit.operators.kernels import legendre_values
from bemkit.operators.material import Material
from bemkit.operators.somigliana.expansions import Expansions, Sources, layer_sources
from bemkit.operators.somigliana.moments import N_POINTS, ArcQuadrature
from bemkit.operators.somigliana.source_series import SEPARATION, SourceSeries

ORDER = 34
"""Highest power of the series; stresses of single clusters have errors of 1e-13, each power gains a factor of three."""
Fields: TypeAlias = Callable[[ComplexArray, ComplexArray, float], ComplexArray]


class FarFields:
    """Series of the clusters of a boundary with its displacements and tractions.

    Parameters
    ----------
    clusters : Clusters
    geometry : ElementGeometry
    curved : ArcQuadrature
    material : Material
    displacement, traction : (n_elements, n) complex arrays [m], [Pa]
        Coefficients of Legendre polynomials.
    length : float [m]
        Unit of length in the logarithm.
    """

    def __init__(
        self,
        clusters: Clusters,
        geometry: ElementGeometry,
        curved: ArcQuadrature,
        material: Material,
        displacement: ComplexArray,
        traction: ComplexArray,
        length: float,
    ) -> None:
        self.geometry, self._curved, self._clusters = geometry, curved, clusters
        self._expansions = Expansions(ORDER, material.kappa, length)
        self._material = material
        series = SourceSeries(self._expansions, clusters, geometry.half[clusters.tree.order])
        zero, one = np.zeros((traction.shape[0], 1), complex), np.ones((traction.shape[0], 1), complex)
        of_data = (
            series.of(partial(self._sources, v, p), len(clusters.levels))
            for v, p in ((displacement, traction), (one, zero), (1j * one, zero))
        )
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

    def _sources(
        self, displacement: ComplexArray, traction: ComplexArray, positions: IntArray, n_points: int
    ) -> Sources:
        """Return the sources of the single layer of tractions minus the double layer of displacements."""
        highest = max(displacement.shape[1], traction.shape[1]) - 1
        elements = self._clusters.tree.order[positions]
        is_straight = bool(self.geometry.is_straight[elements].all())
        xi, weights = gauss_legendre(n_points + (highest + 1) // 2 if is_straight else N_POINTS + highest // 2)
        half = (self.geometry.half * self.geometry.tangent)[elements, None]
        y, slope = self.geometry.centre[elements, None] + half * xi, np.repeat(half, xi.size, axis=1)
        curved = np.flatnonzero(~self.geometry.is_straight[elements])
        y[curved], slope[curved] = self._curved.points(elements[curved], xi)
        v, p = (
            field[elements] @ legendre_values(field.shape[1] - 1, xi).reshape(field.shape[1], -1)
            for field in (displacement, traction)
        )
        return layer_sources(y, slope * weights, p, v, self._material)
