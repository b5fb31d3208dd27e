"""Products with the single and double layer of collocation by the fast multipole method [GreengardRokhlin1987].

No array grows like n^2. Elements belong to clusters of a tree, each in a disc. Series of the complex potentials of a
cluster (`expansions`) give its displacements in distant discs; closed-form integrals, evaluated for each product, give
them nearby. Two clusters of a level are far if the distance of their centres is at least three times the larger radius
plus the smaller radius; the error then falls by a factor of three with each term of a series.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from bemkit.arrays import ComplexArray, FloatArray, IntArray
from bemkit.geometry.proximity.cluster_tree import Clusters, ClusterTree, Discs
from bemkit.geometry.quadrature import gauss_legendre
from bemkit.operators.collocation.equations import CollocationEquations, Densities
from bemkit.operators.material import Material
from bemkit.operators.somigliana.expansions import Expansions
from bemkit.operators.somigliana.point_sources import Sources, layer_sources
from bemkit.operators.somigliana.source_series import SEPARATION, SourceSeries, order_for
from bemkit.threads import for_each_chunk

LEAF_SIZE = 40
"""Elements of a leaf: near integrals and far series then take about the same time."""
_CHUNK, _FEW = 128, 8
"""Clusters or pairs whose series are translated at a time, and leaves evaluated at a time."""


class _Level(NamedTuple):
    """Discs of a level, and its far pairs whose parents are near, sorted by target."""

    discs: Discs
    target: IntArray
    source: IntArray


class _Near(NamedTuple):
    """Leaves near each leaf, including itself, ascending: source[first[leaf]] ... source[first[leaf + 1] - 1]."""

    first: IntArray
    source: IntArray


class FastMultipole:
    """Products (1/2 + T) u - U t at the midpoints of straight elements.

    Parameters
    ----------
    equations : CollocationEquations
        On straight elements, in the order of the tree.
    material : Material
    tree : ClusterTree
    tolerance : float
        Error of the series relative to the largest displacement that distant elements cause.
    """

    def __init__(
        self, equations: CollocationEquations, material: Material, tree: ClusterTree, tolerance: float
    ) -> None:
        self.equations, self.tree, self._material = equations, tree, material
        self._expansions = Expansions(order_for(tolerance), material.kappa, equations.constants.log_length)
        clusters = Clusters.around(tree, np.stack([equations.start, equations.end]))
        self._levels, self._near = _interactions(clusters)
        self._sources = SourceSeries(self._expansions, clusters, 0.5 * equations.lengths)

    def product(self, traction: FloatArray, displacement: FloatArray) -> FloatArray:
        """Return (1/2 + T) u - U t, (n, 2), for tractions and displacements (n, 2) in the order of the tree."""
        densities = self.equations.densities(traction, displacement)
        result = 0.5 * (displacement @ np.array([1.0, 1j]))
        self._add_far_field(self._local_series(self._series(densities)), result)
        self._add_near_field(densities, result)
        return np.asarray(result.view(float).reshape(-1, 2))

    def _add_near_field(self, densities: Densities, result: ComplexArray) -> None:
        """Add the displacements that the near leaves of each leaf cause there."""
        tree, near, first = self.tree, self._near.source, self._near.first

        def add_to_leaves(leaves: slice) -> None:
            for leaf in range(leaves.start, leaves.stop):
                nodes = np.r_[tree.positions(0, leaf)]
                near_leaves = near[first[leaf] : first[leaf + 1]].tolist()
                elements = np.concatenate([np.r_[tree.positions(0, source)] for source in near_leaves])
                result[nodes] += self.equations.potential(nodes, elements, densities)

        chunks = [slice(i, min(i + _FEW, tree.n_leaves)) for i in range(0, tree.n_leaves, _FEW)]
        for_each_chunk(add_to_leaves, chunks, n_integrals=near.size * LEAF_SIZE**2)

    def _series(self, densities: Densities) -> list[ComplexArray]:
        """Return the series of the sources of all clusters, one array for each level, leaves first."""
        equations, material = self.equations, self._material

        def sources_of(elements: IntArray, n_points: int) -> Sources:
            xi, weights = gauss_legendre(n_points)
            half = 0.5 * (equations.end - equations.start)[elements, None]
            t, u, s = (density[elements, None] for density in densities)
            # double layer minus single layer
            return layer_sources(
                equations.points[elements, None] + half * xi, half * weights, -t, -u - s * xi, material
            )

        return self._sources.of(sources_of, len(self._levels))

    def _local_series(self, series: list[ComplexArray]) -> ComplexArray:
        """Return the series of the far field in the discs of all leaves."""
        of_parents: ComplexArray | None = None
        for index in range(len(self._levels) - 1, -1, -1):
            level, discs = self._levels[index], self._levels[index].discs
            n = discs.centre.size
            local = np.zeros((n, 2, self._expansions.order + 1), complex)
            if of_parents is not None:
                above = self._levels[index + 1].discs
                for begin in range(0, n, _CHUNK):
                    clusters = np.arange(begin, min(begin + _CHUNK, n))
                    arm = discs.centre[clusters] - above.centre[clusters // 2]
                    local[clusters] = self._expansions.of_children(
                        of_parents[clusters // 2], arm, above.radius[clusters // 2], discs.radius[clusters]
                    )
            self._add_far_pairs(local, level, series.pop())
            of_parents = local
        assert of_parents is not None
        return of_parents

    def _add_far_pairs(self, local: ComplexArray, level: _Level, series: ComplexArray) -> None:
        """Add the series of the far pairs of a level to those in its discs."""
        for begin in range(0, level.target.size, _CHUNK):
            target, source = level.target[begin : begin + _CHUNK], level.source[begin : begin + _CHUNK]
            arm, radius = level.discs.centre[source] - level.discs.centre[target], level.discs.radius
            fields = self._expansions.of_fields(series[source], arm, radius[source], radius[target])
            present, first = np.unique(target, return_index=True)
            local[present] += np.add.reduceat(fields, first)

    def _add_far_field(self, series: ComplexArray, result: ComplexArray) -> None:
        """Add complex displacements (n_elements,) at the midpoints from the series in the leaves."""
        leaves, bounds, n_leaves = self._levels[0].discs, self.tree.bounds, self.tree.n_leaves
        for begin in range(0, n_leaves, _FEW):
            end = min(begin + _FEW, n_leaves)
            nodes = slice(bounds[begin], bounds[end])
            leaf = np.repeat(np.arange(begin, end), np.diff(bounds[begin : end + 1]))
            arm = self.equations.points[nodes] - leaves.centre[leaf]
            displacements = self._expansions.displacements(series[leaf], arm, leaves.radius[leaf])
            result[nodes] += displacements / (2.0 * self._material.shear_modulus)


def _interactions(clusters: Clusters) -> tuple[list[_Level], _Near]:
    """Return the levels with far pairs, leaves first, and the near leaves of each leaf."""
    pairs = np.zeros((1, 2), np.intp)
    levels: list[_Level] = []
    for discs in clusters.levels[::-1]:
        if levels:
            children = 2 * pairs[:, None, :] + np.array([[0, 0], [0, 1], [1, 0], [1, 1]])
            pairs = children.reshape(-1, 2)
        radii = discs.radius[pairs]
        distance = np.abs(discs.centre[pairs[:, 0]] - discs.centre[pairs[:, 1]])
        is_far = SEPARATION * radii.max(axis=1) + radii.min(axis=1) < distance
        far, pairs = pairs[is_far], pairs[~is_far]
        far = far[np.argsort(far[:, 0], kind="stable")]
        levels.append(_Level(discs, far[:, 0], far[:, 1]))
    while len(levels) > 1 and not levels[0].target.size:
        del levels[0]
    pairs = pairs[np.lexsort(pairs.T[::-1])]
    first = np.searchsorted(pairs[:, 0], np.arange(clusters.tree.n_leaves + 1))
    return levels[::-1], _Near(first, np.ascontiguousarray(pairs[:, 1]))
