"""Products with the single and the double layer of collocation, of which nothing is stored that grows like n^2.

Elements are in the clusters of a tree, each in a disc. What a cluster causes in discs far from it comes from series of
its complex potentials (`expansions`), what it causes nearby from the integrals in closed form, evaluated again for each
product [GreengardRokhlin1987]. Pairs of clusters of one level are far if the distance of their centres is at least
three times the larger radius and the smaller one together; then every power of a series is worth a factor of three.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from bemkit.arrays import ComplexArray, FloatArray, IntArray
from bemkit.geometry.quadrature import gauss_legendre
from bemkit.operators.collocation.equations import CollocationEquations, Densities
from bemkit.operators.hierarchy.tree import Clusters, ClusterTree, Discs
from bemkit.operators.linear.threads import for_each_chunk
from bemkit.operators.material import Material
from bemkit.operators.somigliana.expansions import Expansions, Sources, layer_sources
from bemkit.operators.somigliana.source_series import SEPARATION, SourceSeries, order_for

LEAF_SIZE = 40
"""Elements of a leaf: integrals nearby and series from afar then take about the same time."""
_CHUNK, _FEW = 128, 8
"""Clusters, or pairs of them, whose series are moved at a time; leaves whose elements are evaluated at a time."""


class _Level(NamedTuple):
    """Discs of a level, and pairs of them, sorted by target, that are far from each other but whose parents are not."""

    discs: Discs
    target: IntArray
    source: IntArray


class _Near(NamedTuple):
    """Leaves near each leaf, itself among them, ascending: source[first[leaf]] ... source[first[leaf + 1] - 1]."""

    first: IntArray
    source: IntArray


class FastMultipole:
    """The equations (1/2 + T) u - U t in the middle of all straight elements.

    Parameters
    ----------
    equations : CollocationEquations
        In the order of the tree, whose elements are all straight.
    material : Material
    tree : ClusterTree
    tolerance : float
        Of the series, by the largest displacement that comes from afar.
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
        """Return (1/2 + T) u - U t, (n, 2), of tractions and displacements (n, 2) in the order of the tree."""
        densities = self.equations.densities(traction, displacement)
        result = 0.5 * (displacement @ np.array([1.0, 1j]))
        self._add_from_afar(self._locals(self._series(densities)), result)
        self._add_nearby(densities, result)
        return np.asarray(result.view(float).reshape(-1, 2))

    def _add_nearby(self, densities: Densities, result: ComplexArray) -> None:
        """Add what the elements of the leaves that are not far from each one cause there."""
        tree, near, first = self.tree, self._near.source, self._near.first

        def add_to_leaves(some: slice) -> None:
            for leaf in range(some.start, some.stop):
                nodes = np.r_[tree.places(0, leaf)]
                leaves = near[first[leaf] : first[leaf + 1]].tolist()
                elements = np.concatenate([np.r_[tree.places(0, number)] for number in leaves])
                result[nodes] += self.equations.potential(nodes, elements, densities)

        chunks = [slice(i, min(i + _FEW, tree.n_leaves)) for i in range(0, tree.n_leaves, _FEW)]
        for_each_chunk(add_to_leaves, chunks, n_integrals=near.size * LEAF_SIZE**2)

    def _series(self, densities: Densities) -> list[ComplexArray]:
        """Return the series of the sources of all clusters that are far from others, level by level from the leaves."""
        equations, material = self.equations, self._material

        def sources_of(elements: IntArray, n_points: int) -> Sources:
            xi, weights = gauss_legendre(n_points)
            half = 0.5 * (equations.end - equations.start)[elements, None]
            t, u, s = (each[elements, None] for each in densities)
            # the double layer less the single layer
            return layer_sources(
                equations.points[elements, None] + half * xi, half * weights, -t, -u - s * xi, material
            )

        return self._sources.of(sources_of, len(self._levels))

    def _locals(self, series: list[ComplexArray]) -> ComplexArray:
        """Return the series in the discs of all leaves of what comes from afar."""
        inherited: ComplexArray | None = None
        for number in range(len(self._levels) - 1, -1, -1):
            level, discs = self._levels[number], self._levels[number].discs
            n = discs.centre.size
            own = np.zeros((n, 2, self._expansions.order + 1), complex)
            if inherited is not None:
                above = self._levels[number + 1].discs
                for begin in range(0, n, _CHUNK):
                    some = np.arange(begin, min(begin + _CHUNK, n))
                    arm = discs.centre[some] - above.centre[some // 2]
                    own[some] = self._expansions.of_children(
                        inherited[some // 2], arm, above.radius[some // 2], discs.radius[some]
                    )
            self._add_far(own, level, series.pop())
            inherited = own
        assert inherited is not None
        return inherited

    def _add_far(self, own: ComplexArray, level: _Level, series: ComplexArray) -> None:
        """Add to the series in discs what the clusters far from them cause."""
        for begin in range(0, level.target.size, _CHUNK):
            target, source = level.target[begin : begin + _CHUNK], level.source[begin : begin + _CHUNK]
            arm, radius = level.discs.centre[source] - level.discs.centre[target], level.discs.radius
            fields = self._expansions.of_fields(series[source], arm, radius[source], radius[target])
            present, first = np.unique(target, return_index=True)
            own[present] += np.add.reduceat(fields, first)

    def _add_from_afar(self, series: ComplexArray, result: ComplexArray) -> None:
        """Add complex displacements (n_elements,) in the middle of the elements from the series in their leaves."""
        leaves, bounds, n_leaves = self._levels[0].discs, self.tree.bounds, self.tree.n_leaves
        for begin in range(0, n_leaves, _FEW):
            end = min(begin + _FEW, n_leaves)
            nodes = slice(bounds[begin], bounds[end])
            leaf = np.repeat(np.arange(begin, end), np.diff(bounds[begin : end + 1]))
            arm = self.equations.points[nodes] - leaves.centre[leaf]
            displacements = self._expansions.displacements(series[leaf], arm, leaves.radius[leaf])
            result[nodes] += displacements / (2.0 * self._material.shear_modulus)


def _interactions(clusters: Clusters) -> tuple[list[_Level], _Near]:
    """Return the levels from the leaves up to the last one with pairs, and the leaves near each leaf."""
    pairs = np.zeros((1, 2), np.intp)
    levels: list[_Level] = []
    for discs in clusters.levels[::-1]:
        if levels:
            children = 2 * pairs[:, None, :] + np.array([[0, 0], [0, 1], [1, 0], [1, 1]])
            pairs = children.reshape(-1, 2)
        of_pair = discs.radius[pairs]
        distance = np.abs(discs.centre[pairs[:, 0]] - discs.centre[pairs[:, 1]])
        is_far = SEPARATION * of_pair.max(axis=1) + of_pair.min(axis=1) < distance
        far, pairs = pairs[is_far], pairs[~is_far]
        far = far[np.argsort(far[:, 0], kind="stable")]
        levels.append(_Level(discs, far[:, 0], far[:, 1]))
    while len(levels) > 1 and not levels[0].target.size:
        del levels[0]
    pairs = pairs[np.lexsort(pairs.T[::-1])]
    first = np.searchsorted(pairs[:, 0], np.arange(clusters.tree.n_leaves + 1))
    return levels[::-1], _Near(first, np.ascontiguousarray(pairs[:, 1]))
