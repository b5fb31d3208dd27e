"""Fields of elements far from the points, from series of their clusters.

Near the boundary only differences of displacements from that of the nearest boundary point leave small fields. Besides
the series of the data those of the constant displacements 1 and i are therefore summed, so that these cancel term
by term.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import TypeAlias

import numpy as np

from bemkit.arrays import BoolArray, ComplexArray, IntArray
from bemkit.geometry.quadrature import gauss_legendre
from bemkit.operators.hierarchy.tree import Clusters, Pairs
from bemkit.operators.integrals.panels import Panels
from bemkit.operators.kernels import legendre_values
from bemkit.operators.material import Material
from bemkit.operators.somigliana.expansions import Expansions, Sources, layer_sources
from bemkit.operators.somigliana.moments import N_POINTS, ArcQuadrature
from bemkit.operators.somigliana.source_series import SEPARATION, SourceSeries

ORDER = 34
"""Largest power of the series: stresses of single clusters err by 1e-13, each power is worth a factor of three."""
Fields: TypeAlias = Callable[[ComplexArray, ComplexArray, float], ComplexArray]


class FarFields:
    """Series of the clusters of a boundary with its data.

    Parameters
    ----------
    clusters : Clusters
    panels : Panels
    curved : ArcQuadrature
    material : Material
    displacement, traction : (n_elements, n) complex arrays [m], [Pa]
        Coefficients of Legendre polynomials.
    length : float [m]
        Unit of length of the logarithm.
    """

    def __init__(
        self,
        clusters: Clusters,
        panels: Panels,
        curved: ArcQuadrature,
        material: Material,
        displacement: ComplexArray,
        traction: ComplexArray,
        length: float,
    ) -> None:
        self._panels, self._curved, self._clusters = panels, curved, clusters
        self._expansions = Expansions(ORDER, material.kappa, length)
        self._material = material
        series = SourceSeries(self._expansions, clusters, panels.half[clusters.tree.order])
        none, one = np.zeros((traction.shape[0], 1), complex), np.ones((traction.shape[0], 1), complex)
        of_data = (
            series.of(partial(self._sources, v, p), len(clusters.levels))
            for v, p in ((displacement, traction), (one, none), (1j * one, none))
        )
        self._series = [np.stack(level, axis=1) for level in zip(*of_data, strict=True)]

    def divided(self, x: ComplexArray) -> tuple[list[Pairs], Pairs]:
        """Return points with clusters far from them, level by level, and with elements near them; see `Clusters`."""

        def is_far(level: int, point: IntArray, cluster: IntArray) -> BoolArray:
            discs = self._clusters.levels[level]
            return np.asarray(np.abs(x[point] - discs.centre[cluster]) > SEPARATION * discs.radius[cluster])

        return self._clusters.divided(x.size, is_far)

    def displacements(self, x: ComplexArray, reference: ComplexArray, far: list[Pairs]) -> ComplexArray:
        """Return the displacements (1, n_points) of what is far, less that of constant displacements `reference`."""
        expansions, two_mu = self._expansions, 2.0 * self._material.shear_modulus
        return self._summed(x, reference, far, 1, lambda *disc: expansions.outer_displacements(*disc)[None] / two_mu)

    def gradients(self, x: ComplexArray, reference: ComplexArray, far: list[Pairs]) -> ComplexArray:
        """Return Phi and D (2, n_points); otherwise as `displacements`."""
        return self._summed(x, reference, far, 2, lambda *disc: np.stack(self._expansions.outer_gradients(*disc)))

    def _summed(
        self, x: ComplexArray, reference: ComplexArray, far: list[Pairs], n_fields: int, fields: Fields
    ) -> ComplexArray:
        """Sum the fields of all clusters at the points that are far from them."""
        result = np.zeros((n_fields, x.size), complex)
        for (point, cluster), discs, series in zip(far, self._clusters.levels, self._series, strict=True):
            order = np.argsort(cluster, kind="stable")
            present, begins, counts = np.unique(cluster[order], return_index=True, return_counts=True)
            for number, begin, count in zip(present, begins, counts, strict=True):
                own = point[order[begin : begin + count]]
                caused = fields(series[number], x[own] - discs.centre[number], float(discs.radius[number]))
                result[:, own] += (
                    caused[..., 0] - reference[own].real * caused[..., 1] - reference[own].imag * caused[..., 2]
                )
        return result

    def _sources(self, displacement: ComplexArray, traction: ComplexArray, places: IntArray, n_points: int) -> Sources:
        """Return the sources of the single layer of tractions less the double layer of displacements."""
        highest = max(displacement.shape[1], traction.shape[1]) - 1
        elements = self._clusters.tree.order[places]
        is_straight = bool(self._panels.is_straight[elements].all())
        xi, weights = gauss_legendre(n_points + (highest + 1) // 2 if is_straight else N_POINTS + highest // 2)
        half = (self._panels.half * self._panels.tangent)[elements, None]
        place, slope = self._panels.centre[elements, None] + half * xi, np.repeat(half, xi.size, axis=1)
        bent = np.flatnonzero(~self._panels.is_straight[elements])
        place[bent], slope[bent] = self._curved.place(elements[bent], xi)
        v, p = (
            each[elements] @ legendre_values(each.shape[1] - 1, xi).reshape(each.shape[1], -1)
            for each in (displacement, traction)
        )
        return layer_sources(place, slope * weights, p, v, self._material)
