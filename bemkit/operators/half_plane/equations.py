"""Equations ``u - F t - R q = 0`` of the surface of a half-plane for the direct solver of `bemkit.operators.hierarchy`.

Components are those along the tangent and the normal. The logarithm is symmetric, and the sign is constant outside of
a cluster: one interpolation of scalars serves both components, rows and columns.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from bemkit.arrays import ComplexArray, FloatArray, IntArray
from bemkit.operators.half_plane.flexibility import logarithms_between
from bemkit.operators.hierarchy.equations import Border
from bemkit.operators.hierarchy.interpolative import Block, Interpolation, sketched
from bemkit.operators.hierarchy.skeletons import Compression, LevelView, Skeleton
from bemkit.operators.material import Material

_MOST_KEPT = 400
"""Logarithms for each element that are kept; leaves and siblings of one tree take 160."""


@dataclass(frozen=True, eq=False)
class HalfPlaneEquations:
    """The surface of a half-plane; fulfils `BoundaryEquations`. Rows, and columns of tractions, come in pairs.

    Parameters
    ----------
    places : (n + 1,) array [m]
        Ends of the elements along the surface.
    material : Material
    motions : (n_motions, n) array
        The motions R that forces far away drive.
    kept : dict
        Logarithms of leaves, siblings and sampled nodes, which are needed again.
    """

    places: FloatArray
    material: Material
    motions: ComplexArray
    kept: dict[tuple[bytes, bytes], FloatArray] = field(default_factory=dict, repr=False)

    @cached_property
    def lengths(self) -> FloatArray:
        """(n,) array [m]."""
        return np.diff(self.places)

    @cached_property
    def points(self) -> ComplexArray:
        """(n,) array [m]: centres of the elements."""
        return np.asarray(0.5 * (self.places[1:] + self.places[:-1]), complex)

    @cached_property
    def supports(self) -> ComplexArray:
        """(3, n) array [m]: centres and ends of the elements."""
        return np.stack([self.points, self.places[:-1], self.places[1:]])

    @cached_property
    def border(self) -> Border:
        """Driven motions, and the work of tractions on them."""
        n_motions, n = self.motions.shape
        motions = np.stack([self.motions.real, self.motions.imag], axis=2)
        balances = np.zeros((n_motions, n, 4))
        balances[:, :, :2] = motions * self.lengths[:, None]
        errors = -motions.reshape(n_motions, 2 * n).T
        return Border(errors, balances.reshape(n_motions, 4 * n), np.zeros((n_motions, n_motions)))

    def logarithms(self, one: IntArray, two: IntArray) -> FloatArray:
        """Return the means of logarithms (n_one, n_two) between elements."""
        first, second = np.broadcast_arrays(one[:, None], two)
        first, second = np.minimum(first, second).ravel(), np.maximum(first, second).ravel()
        return logarithms_between(self.places, first, second).reshape(one.size, two.size)

    def kept_logarithms(self, one: IntArray, two: IntArray) -> FloatArray:
        """Return the same, evaluated once unless many others came between; the oldest are dropped."""
        key, other = (one.tobytes(), two.tobytes()), (two.tobytes(), one.tobytes())
        if other in self.kept:
            return self.kept[other].T
        if key not in self.kept:
            most = _MOST_KEPT * self.lengths.size
            while self.kept and sum(each.size for each in self.kept.values()) + one.size * two.size > most:
                del self.kept[next(iter(self.kept))]
            self.kept[key] = self.logarithms(one, two)
        return self.kept[key]

    def block(self, rows: IntArray, columns: IntArray) -> FloatArray:
        """Return entries (n_rows, n_columns) of the equations."""
        is_traction = columns % 4 < 2
        one, two = rows[::2] // 2, columns[is_traction][::2] // 4
        forces = np.empty((one.size, 2, two.size, 2))
        forces[:, 0, :, 0] = self.along * self.kept_logarithms(one, two)
        forces[:, 1, :, 1] = forces[:, 0, :, 0]
        forces[:, 0, :, 1] = self.across * np.sign(one[:, None] - two)
        forces[:, 1, :, 0] = -forces[:, 0, :, 1]
        forces *= -self.lengths[two, None]
        if is_traction.all():
            return forces.reshape(rows.size, columns.size)
        result = np.zeros((rows.size, columns.size))
        result[:, is_traction] = forces.reshape(rows.size, -1)
        moved = columns[~is_traction]
        result[:, ~is_traction] = rows[:, None] == 2 * (moved // 4) + moved % 2
        return result

    @property
    def along(self) -> float:
        """Displacement along a force by the mean of logarithms [1/Pa]."""
        return -2.0 / (np.pi * self.material.plane_modulus)

    @property
    def across(self) -> float:
        """Displacement across a force [1/Pa]."""
        return 0.5 * self.material.plane_compressibility

    def potentials(self, x: ComplexArray, elements: IntArray) -> FloatArray:
        """Return the means of log|x - s| (n_points, n) over elements, away from these."""
        begin, end = (self.places[of][None, :] - x[:, None] for of in (elements, elements + 1))
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
        """Return what rows feel of unit forces at some points, (2 n_points, n_rows)."""
        columns = 4 * (rows // 2) + rows % 2
        return self.fields(x, columns) / self.lengths[rows // 2]

    def residual(self, nodes: IntArray, traction: FloatArray, displacement: FloatArray) -> FloatArray:
        """Return u - F t (n, 2) at some elements, without any compression."""
        force = self.lengths[:, None] * traction
        sums = np.cumsum(force, axis=0)
        across = self.across * (2.0 * sums - force - sums[-1])[nodes]
        along = self.along * (self.kept_logarithms(nodes, np.arange(self.lengths.size)) @ force)
        caused = along + np.stack([across[:, 1], -across[:, 0]], axis=1)
        return np.asarray(displacement[nodes] - caused)


@dataclass(frozen=True, eq=False)
class StripView(LevelView):
    """The clusters of one level of a strip; see `LevelView`."""

    equations: HalfPlaneEquations

    def skeleton(self, cluster: int) -> Skeleton:
        """Choose the skeleton of one cluster: both components of some elements."""
        near_rows, _ = self.near(cluster)
        of, elements, near = self.equations, self.rows[cluster][::2] // 2, near_rows[::2] // 2
        proxies = self.proxies(cluster)
        proxies = proxies[proxies.imag > 0.0]  # the others see the same
        blocks = [Block(of.potentials(proxies, elements), np.ones(proxies.size))]
        if near.size:
            blocks.append(Block(of.logarithms(near, elements), np.sqrt(of.lengths[near])))
        # all rows: random combinations of them would cost a digit of the tractions
        found = sketched(blocks, np.sqrt(of.lengths[elements]), self.tolerance_at(cluster, elements), None)
        by_length = found.scaled(1.0 / of.lengths[elements])
        chosen = elements[found.skeleton]
        rows, columns = ((stride * chosen[:, None] + np.arange(2)).ravel() for stride in (2, 4))
        return Skeleton(rows, _of_pairs(found, 2), columns, _of_pairs(by_length, 4 if self.is_lowest else 2))


def _of_pairs(scalar: Interpolation, stride: int) -> Interpolation:
    """Return an interpolation of the first two of `stride` values of each element; others count for nothing."""
    skeleton, rest = ((stride * of[:, None] + np.arange(2)).ravel() for of in (scalar.skeleton, scalar.rest))
    idle = (stride * np.arange(scalar.n)[:, None] + np.arange(2, stride)).ravel()
    weights = np.zeros((skeleton.size, rest.size + idle.size))
    for component in (0, 1):
        weights[component::2, component : rest.size : 2] = scalar.weights
    return Interpolation(skeleton, np.concatenate([rest, idle]), weights)


def potential_of(compression: Compression, forces: FloatArray) -> FloatArray:
    """Return the sums of logarithms (n, 2) of the forces (n, 2) on all elements, by a compression with `StripView`.

    Forces are gathered at the skeletons of larger and larger clusters; siblings see each other, and what the skeletons
    of clusters feel is interpolated on smaller and smaller ones.
    """
    tree, equations = compression.tree, compression.equations
    assert isinstance(equations, HalfPlaneEquations)
    leaves = [tree.positions(0, leaf) for leaf in range(tree.n_leaves)]
    sources = [[forces[places].ravel() for places in leaves]]
    for skeletons in compression.skeletons:
        gathered = [each.row_map.gather(source) for each, source in zip(skeletons, sources[-1], strict=True)]
        sources.append(gathered)
        if len(gathered) > 2:
            sources.append([np.concatenate(pair) for pair in zip(gathered[::2], gathered[1::2], strict=True)])
    felt: list[FloatArray] = []
    for level in range(tree.n_levels - 1, -1, -1):
        skeletons, gathered = compression.skeletons[level], sources[2 * level + 1]
        at_skeletons: list[FloatArray] = []
        for one in range(0, len(skeletons), 2):
            between = equations.kept_logarithms(skeletons[one].rows[::2] // 2, skeletons[one + 1].rows[::2] // 2)
            at_skeletons += [(between @ gathered[one + 1].reshape(-1, 2)), (between.T @ gathered[one].reshape(-1, 2))]
        below = []
        for number, skeleton in enumerate(skeletons):
            seen = at_skeletons[number].ravel()
            if felt:
                parent = felt[number // 2]
                n_first = skeletons[number - number % 2].rows.size
                seen = seen + (parent[:n_first] if number % 2 == 0 else parent[n_first:])
            values = np.empty(skeleton.row_map.n)
            values[skeleton.row_map.skeleton] = seen
            values[skeleton.row_map.rest] = skeleton.row_map.weights.T @ seen
            below.append(values)
        felt = below
    result = np.empty_like(forces)
    for places, seen in zip(leaves, felt, strict=True):
        own = np.arange(places.start, places.stop)
        result[places] = seen.reshape(-1, 2) + equations.kept_logarithms(own, own) @ forces[places]
    return result
