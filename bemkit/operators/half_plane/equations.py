"""Equations ``u - F t - R q = 0`` of the surface of a half-plane for the direct solver of `bemkit.operators.hierarchy`.

Components are tangential and normal. The logarithm is symmetric, and the sign function is constant outside of a
cluster, so that one scalar interpolation serves both components, rows and columns.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from bemkit.arrays import ComplexArray, FloatArray, IntArray
from bemkit.operators.boundary_equations import Border
from bemkit.operators.half_plane.flexibility import logarithms_between
from bemkit.operators.hierarchy.interpolative import Block, Interpolation, sketched
from bemkit.operators.hierarchy.skeletons import Compression, LevelView, Skeleton
from bemkit.operators.material import Material

_MOST_KEPT = 400
"""Logarithms for each element that are kept; leaves and siblings of one tree take 160."""


class KeptArrays(dict[tuple[bytes, bytes], FloatArray]):
    """Arrays by key, of bounded total size."""

    n_entries = 0
    """Sum of the sizes of the arrays."""

    def add(self, key: tuple[bytes, bytes], array: FloatArray, most: int) -> None:
        """Keep an array; drop the oldest ones while all have more than `most` entries together."""
        while self and self.n_entries + array.size > most:
            self.n_entries -= self.pop(next(iter(self))).size
        self[key] = array
        self.n_entries += array.size


@dataclass(frozen=True, eq=False)
class HalfPlaneEquations:
    """Equations on the surface of a half-plane; fulfils `BoundaryEquations`.

    Rows, and columns of tractions, come in pairs of components.

    Parameters
    ----------
    nodes : (n + 1,) array [m]
        Ends of the elements along the surface.
    material : Material
    motions : (n_motions, n) array
        Load-controlled motions R.
    kept : KeptArrays
        Cached logarithms of leaves, siblings and sampled nodes.
    """

    nodes: FloatArray
    material: Material
    motions: ComplexArray
    kept: KeptArrays = field(default_factory=KeptArrays, repr=False)

    @cached_property
    def lengths(self) -> FloatArray:
        """(n,) array [m]."""
        return np.diff(self.nodes)

    @cached_property
    def points(self) -> ComplexArray:
        """(n,) array [m]: centres of the elements."""
        return np.asarray(0.5 * (self.nodes[1:] + self.nodes[:-1]), complex)

    @cached_property
    def supports(self) -> ComplexArray:
        """(3, n) array [m]: centres and ends of the elements."""
        return np.stack([self.points, self.nodes[:-1], self.nodes[1:]])

    @cached_property
    def border(self) -> Border:
        """Load-controlled motions, and the work of tractions on them."""
        n_motions, n = self.motions.shape
        motions = np.stack([self.motions.real, self.motions.imag], axis=2)
        balances = np.zeros((n_motions, n, 4))
        balances[:, :, :2] = motions * self.lengths[:, None]
        errors = -motions.reshape(n_motions, 2 * n).T
        return Border(errors, balances.reshape(n_motions, 4 * n))

    def logarithms(self, targets: IntArray, sources: IntArray) -> FloatArray:
        """Return the mean logarithms (n_targets, n_sources) between elements."""
        first, second = np.broadcast_arrays(targets[:, None], sources)
        first, second = np.minimum(first, second).ravel(), np.maximum(first, second).ravel()
        return logarithms_between(self.nodes, first, second).reshape(targets.size, sources.size)

    def kept_logarithms(self, targets: IntArray, sources: IntArray) -> FloatArray:
        """Return the mean logarithms between elements from a cache of bounded size; the oldest are dropped."""
        key, transposed = (targets.tobytes(), sources.tobytes()), (sources.tobytes(), targets.tobytes())
        if transposed in self.kept:
            return self.kept[transposed].T
        if key not in self.kept:
            self.kept.add(key, self.logarithms(targets, sources), _MOST_KEPT * self.lengths.size)
        return self.kept[key]

    def block(self, rows: IntArray, columns: IntArray) -> FloatArray:
        """Return entries (n_rows, n_columns) of the equations."""
        is_traction = columns % 4 < 2
        targets, sources = rows[::2] // 2, columns[is_traction][::2] // 4
        of_tractions = np.empty((targets.size, 2, sources.size, 2))
        of_tractions[:, 0, :, 0] = self.along * self.kept_logarithms(targets, sources)
        of_tractions[:, 1, :, 1] = of_tractions[:, 0, :, 0]
        of_tractions[:, 0, :, 1] = self.across * np.sign(targets[:, None] - sources)
        of_tractions[:, 1, :, 0] = -of_tractions[:, 0, :, 1]
        of_tractions *= -self.lengths[sources, None]
        if is_traction.all():
            return of_tractions.reshape(rows.size, columns.size)
        result = np.zeros((rows.size, columns.size))
        result[:, is_traction] = of_tractions.reshape(rows.size, -1)
        of_displacements = columns[~is_traction]
        result[:, ~is_traction] = rows[:, None] == 2 * (of_displacements // 4) + of_displacements % 2
        return result

    @property
    def along(self) -> float:
        """Displacement along a unit force per mean logarithm [1/Pa]."""
        return -2.0 / (np.pi * self.material.plane_modulus)

    @property
    def across(self) -> float:
        """Displacement across a unit force [1/Pa]."""
        return 0.5 * self.material.plane_compressibility

    def potentials(self, x: ComplexArray, elements: IntArray) -> FloatArray:
        """Return the means of log|x - s| (n_points, n) over elements, for points outside of them."""
        begin, end = (self.nodes[ends][None, :] - x[:, None] for ends in (elements, elements + 1))
        integral = (end * np.log(end) - begin * np.log(begin)).real
        return np.asarray(integral / self.lengths[elements] - 1.0)

    def fields(self, x: ComplexArray, columns: IntArray) -> FloatArray:
        """Return displacements (2 n_points, n_columns) that tractions cause away from the surface."""
        elements, result = columns // 4, np.zeros((x.size, 2, columns.size))
        along = self.along * self.potentials(x, elements)
        across = self.across * np.sign(x.real[:, None] - self.points.real[elements])
        for component in (0, 1):
            of_other = across if component == 0 else -across
            values = np.where(columns % 2 == component, along, of_other) * self.lengths[elements]
            result[:, component] = np.where(columns % 4 < 2, -values, 0.0)
        return result.reshape(2 * x.size, columns.size)

    def under_forces(self, x: ComplexArray, rows: IntArray) -> FloatArray:
        """Return the displacements (2 n_points, n_rows) at rows under unit forces at some points."""
        columns = 4 * (rows // 2) + rows % 2
        return self.fields(x, columns) / self.lengths[rows // 2]

    def residual(self, nodes: IntArray, traction: FloatArray, displacement: FloatArray) -> FloatArray:
        """Return the uncompressed u - F t (n, 2) at some elements."""
        force = self.lengths[:, None] * traction
        sums = np.cumsum(force, axis=0)
        across = self.across * (2.0 * sums - force - sums[-1])[nodes]
        along = self.along * (self.kept_logarithms(nodes, np.arange(self.lengths.size)) @ force)
        of_tractions = along + np.stack([across[:, 1], -across[:, 0]], axis=1)
        return np.asarray(displacement[nodes] - of_tractions)


@dataclass(frozen=True, eq=False)
class StripView(LevelView):
    """The clusters of one level on the surface of a half-plane; see `LevelView`."""

    equations: HalfPlaneEquations

    def skeleton(self, cluster: int) -> Skeleton:
        """Choose the skeleton of one cluster: both components of some elements."""
        near_rows, _ = self.near(cluster)
        equations, elements, near = self.equations, self.rows[cluster][::2] // 2, near_rows[::2] // 2
        proxies = self.proxies(cluster)
        proxies = proxies[proxies.imag > 0.0]  # the lower half of the circle gives the same values
        blocks = [Block(equations.potentials(proxies, elements), np.ones(proxies.size))]
        if near.size:
            blocks.append(Block(equations.logarithms(near, elements), np.sqrt(equations.lengths[near])))
        # no guess of the rank, hence all rows: random combinations would cost a digit of the tractions
        lengths = equations.lengths[elements]
        scalar = sketched(blocks, np.sqrt(lengths), self.tolerance_at(cluster, elements), None)
        by_length = scalar.scaled(1.0 / lengths)
        chosen = elements[scalar.skeleton]
        rows, columns = ((stride * chosen[:, None] + np.arange(2)).ravel() for stride in (2, 4))
        return Skeleton(rows, _of_pairs(scalar, 2), columns, _of_pairs(by_length, 4 if self.is_lowest else 2))


def _of_pairs(scalar: Interpolation, stride: int) -> Interpolation:
    """Return an interpolation of the first two of `stride` values of each element; the others have no weight."""
    skeleton, rest = ((stride * index[:, None] + np.arange(2)).ravel() for index in (scalar.skeleton, scalar.rest))
    idle = (stride * np.arange(scalar.n)[:, None] + np.arange(2, stride)).ravel()
    weights = np.zeros((skeleton.size, rest.size + idle.size))
    for component in (0, 1):
        weights[component::2, component : rest.size : 2] = scalar.weights
    return Interpolation(skeleton, np.concatenate([rest, idle]), weights)


def potential_of(compression: Compression, forces: FloatArray) -> FloatArray:
    """Return the sums of logarithms (n, 2) over the forces (n, 2) on all elements, from a compression by `StripView`.

    Forces are gathered at the skeletons of larger and larger clusters, siblings interact, and incoming values at the
    skeletons are interpolated on smaller and smaller clusters.
    """
    tree, equations = compression.tree, compression.equations
    assert isinstance(equations, HalfPlaneEquations)
    leaves = [tree.positions(0, leaf) for leaf in range(tree.n_leaves)]
    sources = [forces[positions].ravel() for positions in leaves]
    outgoing: list[list[FloatArray]] = []
    for skeletons in compression.skeletons:
        gathered = [skeleton.row_map.gather(source) for skeleton, source in zip(skeletons, sources, strict=True)]
        outgoing.append(gathered)
        sources = [np.concatenate(pair) for pair in zip(gathered[::2], gathered[1::2], strict=True)]
    incoming: list[FloatArray] = []
    for skeletons, gathered in zip(compression.skeletons[::-1], outgoing[::-1], strict=True):
        incoming = _on_clusters(equations, skeletons, gathered, incoming)
    result = np.empty_like(forces)
    for positions, of_leaf in zip(leaves, incoming, strict=True):
        elements = np.arange(positions.start, positions.stop)
        near = equations.kept_logarithms(elements, elements) @ forces[positions]
        result[positions] = of_leaf.reshape(-1, 2) + near
    return result


def _on_clusters(
    equations: HalfPlaneEquations,
    skeletons: tuple[Skeleton, ...],
    outgoing: list[FloatArray],
    of_parents: list[FloatArray],
) -> list[FloatArray]:
    """Return the incoming values on the clusters of a level: from siblings and, unless empty, from the parents."""
    at_skeletons: list[FloatArray] = []
    for first in range(0, len(skeletons), 2):
        between = equations.kept_logarithms(skeletons[first].rows[::2] // 2, skeletons[first + 1].rows[::2] // 2)
        at_skeletons += [between @ outgoing[first + 1].reshape(-1, 2), between.T @ outgoing[first].reshape(-1, 2)]
    incoming = []
    for cluster, skeleton in enumerate(skeletons):
        values = at_skeletons[cluster].ravel()
        if of_parents:
            parent, n_first = of_parents[cluster // 2], skeletons[cluster - cluster % 2].rows.size
            values = values + (parent[:n_first] if cluster % 2 == 0 else parent[n_first:])
        on_cluster = np.empty(skeleton.row_map.n)
        on_cluster[skeleton.row_map.skeleton] = values
        on_cluster[skeleton.row_map.rest] = skeleton.row_map.weights.T @ values
        incoming.append(on_cluster)
    return incoming
