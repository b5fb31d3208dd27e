"""Products with the single and the double layer of collocation, of which nothing is stored that grows like n^2.

Elements are in the clusters of a tree, each in a disc. What a cluster causes in discs far from it comes from series of
its complex potentials (`expansions`), what it causes nearby from the integrals in closed form, evaluated again for each
product [GreengardRokhlin1987]. Pairs of clusters of one level are far if the distance of their centres is at least
three times the larger radius and the smaller one together; then every power of a series is worth a factor of three.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, TypeAlias

import numpy as np
from scipy.sparse.linalg import LinearOperator

from bemkit.arrays import ComplexArray, FloatArray, IntArray
from bemkit.geometry.quadrature import gauss_legendre
from bemkit.operators.hierarchy import compiled
from bemkit.operators.hierarchy.boundary_columns import BoundaryColumns, Densities
from bemkit.operators.hierarchy.clusters import Clusters, Discs
from bemkit.operators.hierarchy.expansions import Expansions, Sources
from bemkit.operators.hierarchy.source_series import SEPARATION, SourceSeries, order_for
from bemkit.operators.hierarchy.tree import ClusterTree
from bemkit.operators.linear.threads import for_each_chunk

if TYPE_CHECKING:
    _LinearOperator: TypeAlias = LinearOperator[np.float64]
else:
    _LinearOperator = LinearOperator

LEAF_SIZE = 40
"""Elements of a leaf: integrals nearby and series from afar then take about the same time."""
_CHUNK, _FEW = 256, 32
"""Clusters, or pairs of them, whose series are moved at a time; leaves whose elements are evaluated at a time."""


@dataclass(frozen=True, eq=False)
class _Level:
    """Discs of a level, and pairs that are far from each other but whose parents are not.

    Parameters
    ----------
    discs : Discs
    target, source : (n_pairs,) arrays
        Sorted by target.
    """

    discs: Discs
    target: IntArray
    source: IntArray


@dataclass(frozen=True, eq=False)
class _Near:
    """Leaves that are near each leaf, itself among them, ascending.

    Parameters
    ----------
    first : (n_leaves + 1,) array
        Where those of each leaf begin in `source`.
    source : (n_pairs,) array
    """

    first: IntArray
    source: IntArray


class FastMultipole(_LinearOperator):
    """(1/2 + T) u - U t in the middle of all straight elements, from their tractions t and displacements u.

    As a linear operator it is (2 n_elements, 4 n_elements), numbered like `BoundaryColumns.entries`.

    Parameters
    ----------
    columns : BoundaryColumns
        Of straight elements, without images and places of holes.
    tree : ClusterTree
        In whose order the elements are.
    tolerance : float
        Of the series, by the largest displacement that comes from afar.
    """

    def __init__(self, columns: BoundaryColumns, tree: ClusterTree, tolerance: float) -> None:
        n = columns.n_elements
        LinearOperator.__init__(self, np.dtype(float), (2 * n, 4 * n))  # type: ignore[call-arg]  # the stubs lack it
        constants = columns.constants
        self.columns, self.tree = columns, tree
        self._expansions = Expansions(order_for(tolerance), 3.0 - 4.0 * constants.poisson_ratio, constants.log_length)
        clusters = Clusters.around(tree, np.stack([columns.start, columns.end]))
        self._levels, self._near = _interactions(clusters)
        self._sources = SourceSeries(self._expansions, clusters, 0.5 * columns.lengths)

    def _matvec(self, x: FloatArray) -> FloatArray:
        state = np.reshape(x, (-1, 4))
        return self.applied(state[:, :2], state[:, 2:]).ravel()

    def applied(self, traction: FloatArray, displacement: FloatArray) -> FloatArray:
        """Return (1/2 + T) u - U t, (n, 2), from tractions and displacements (n, 2); all by place."""
        densities = self.columns.densities(traction, displacement)
        far = self._from_afar(self._locals(self._series(densities)))
        far += self._from_nearby(densities)
        return far.view(float).reshape(-1, 2) + 0.5 * displacement

    def _from_nearby(self, densities: Densities) -> ComplexArray:
        """Return what the elements of the leaves that are not far from each one cause there, (n,) by place."""
        columns, tree, near, first = self.columns, self.tree, self._near.source, self._near.first
        fast = compiled.products()

        def of_leaves(some: slice) -> ComplexArray:
            if fast is not None:
                geometry = columns.centre, columns.start, columns.end
                caused: ComplexArray = fast.nearby(
                    columns.constants.numbers, *geometry, *densities, tree.bounds, first, near, some.start, some.stop
                )
                return caused
            parts = []
            for leaf in range(some.start, some.stop):
                elements = np.concatenate([np.r_[tree.places(0, k)] for k in near[first[leaf] : first[leaf + 1]]])
                parts.append(columns.layers(np.r_[tree.places(0, leaf)], elements, densities))
            return np.concatenate(parts)

        chunks = [slice(i, min(i + _FEW, tree.n_leaves)) for i in range(0, tree.n_leaves, _FEW)]
        return np.concatenate(for_each_chunk(of_leaves, chunks, n_integrals=near.size * LEAF_SIZE**2))

    def _series(self, densities: Densities) -> list[ComplexArray]:
        """Return the series of the sources of all clusters that are far from others, level by level from the leaves."""
        columns, b, mu = self.columns, self.columns.constants.double, self._shear_modulus

        def sources_of(places: IntArray, n_points: int) -> Sources:
            xi, weights = gauss_legendre(n_points)
            start, end, t, u, s = (each[places, None] for each in (columns.start, columns.end, *densities))
            half = 0.5 * (end - start)
            w, density = np.abs(half) * weights, u + s * xi
            normal = -1j * half / np.abs(half)
            f = (0.5 * b) * w * t  # of -t: the single layer is subtracted
            g, e = (b * mu * w) * normal * density, (-2.0 * b * mu * w) * (normal.conj() * density).real
            return Sources(0.5 * (start + end) + half * xi, f, g, e)

        return self._sources.of(sources_of, len(self._levels))

    @property
    def _shear_modulus(self) -> float:
        constants = self.columns.constants
        return 0.5 * constants.double / constants.single

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
            self._add_far(own, level, series[number])
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

    def _from_afar(self, series: ComplexArray) -> ComplexArray:
        """Return complex displacements (n,) in the middle of the elements from the series in their leaves."""
        leaves, bounds, n_leaves = self._levels[0].discs, self.tree.bounds, self.tree.n_leaves
        result = np.empty(self.columns.n_elements, complex)
        for begin in range(0, n_leaves, _FEW):
            end = min(begin + _FEW, n_leaves)
            places = slice(int(bounds[begin]), int(bounds[end]))
            leaf = np.repeat(np.arange(begin, end), np.diff(bounds[begin : end + 1]))
            arm = self.columns.centre[places] - leaves.centre[leaf]
            result[places] = self._expansions.displacements(series[leaf], arm, leaves.radius[leaf])
        return np.asarray(result / (2.0 * self._shear_modulus))


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
