"""Gauss rules on the outer elements of pairs, with more points the closer the inner element is."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from bemkit.arrays import BoolArray, FloatArray, IntArray
from bemkit.geometry.quadrature import gauss_graded, gauss_legendre
from bemkit.operators import kernels
from bemkit.operators.element_geometry import ElementGeometry, squared_distance
from bemkit.operators.integrals.splitting import SEPARATION, split_until

# n Gauss points integrate an analytic function, whose nearest singularity is z half lengths from the centre, with an
# error of about r^(-2n), r = z + sqrt(z^2 - 1). A factor P_a increases the error by r^a, and each rule has one point
# more for every two degrees (`Degrees.extra_points`). At the distances below the error is 1e-15 for even a and at most
# 7e-14 for odd a, relative to the integral with P_0.
GAUSS_LEVELS = ((2, 1.2e4), (3, 212.0), (4, 38.0), (6, 9.0), (10, 3.0))
"""Numbers of outer points, and the smallest distance of each [half lengths of the outer element]."""
N_REGULAR = 10
"""Points on a piece away from both ends of the inner element."""
N_TOUCHING = 30
"""Graded points on a piece that begins at a common node."""
LevelArray = npt.NDArray[np.int8]
"""An index into `GAUSS_LEVELS` for each pair, in one byte because pairs are many."""


def gauss_levels(geometry: ElementGeometry, outer: IntArray, inner: IntArray) -> LevelArray:
    """Return the level of pairs: the number of distances in `GAUSS_LEVELS` that exceed theirs; arrays broadcast.

    Curved inner elements take a Gauss rule, too, with the same distances in half lengths of the inner element.
    """
    centre, half = geometry.centre[outer], geometry.half[outer]
    nearest = np.minimum(squared_distance(centre, geometry.start[inner]), squared_distance(centre, geometry.end[inner]))
    level = np.zeros(nearest.shape, np.int8)
    for _, distance in GAUSS_LEVELS:
        level += nearest < np.square(half * geometry.distance_at(distance)[outer])
    if geometry.curved is not None:
        from_centre = squared_distance(centre, geometry.centre[inner])
        inner_level = np.zeros_like(level)
        for _, distance in GAUSS_LEVELS:
            inner_level += from_centre < np.square(geometry.half[inner] * geometry.distance_at(distance)[inner] + half)
        level = np.where(geometry.is_straight[inner], level, np.maximum(level, inner_level))
    return level


@dataclass(frozen=True, eq=False)
class OuterRule:
    """Points on the outer elements of some pairs.

    Points are fractions of the length from one end node. So their distances from a common node are exact, however
    small.

    Parameters
    ----------
    item : (n,) int array
        The pairs, ascending.
    at_start : (n, n_points) bool array
        Whether fractions are measured from the start node.
    fraction : (n, n_points) array
    weight : (n, n_points) array, optional
        By default points and weights are those of Gauss on whole elements; one row of points then serves all pairs.
    """

    item: IntArray
    at_start: BoolArray
    fraction: FloatArray
    weight: FloatArray | None = None

    @classmethod
    def whole(cls, item: IntArray, n_points: int) -> OuterRule:
        """Return one Gauss rule for all pairs, each half of it measured from the nearer end."""
        points, _ = gauss_legendre(n_points)
        return cls(item, (points < 0.0)[None], 0.5 * (1.0 - np.abs(points))[None])

    @property
    def n_points(self) -> int:
        """Number of points of all pairs."""
        return int(self.item.size * self.fraction.shape[1])

    @property
    def points(self) -> tuple[IntArray, BoolArray, FloatArray]:
        """The pair of each point, whether it is measured from the start, and its fraction."""
        shape = self.item.size, self.fraction.shape[1]
        at_start, fraction = np.broadcast_to(self.at_start, shape), np.broadcast_to(self.fraction, shape)
        return np.repeat(self.item, shape[1]), at_start.ravel(), fraction.ravel()

    def part(self, chosen: slice) -> OuterRule:
        """Return the rule for some of the pairs."""
        if self.weight is None:
            return OuterRule(self.item[chosen], self.at_start, self.fraction)
        return OuterRule(self.item[chosen], self.at_start[chosen], self.fraction[chosen], self.weight[chosen])

    def moments(self, values: FloatArray, n_polynomials: int) -> tuple[IntArray, FloatArray]:
        """Integrate values (n_rows, n_points) at the points times the Legendre polynomials of the outer elements.

        Returns
        -------
        items : (m,) int array
            The distinct pairs.
        moments : (n_rows, n_polynomials, m) array
        """
        n_points = self.fraction.shape[1]
        values = values.reshape(len(values), -1, n_points)
        if self.weight is None:
            return self.item, kernels.legendre_weights(n_polynomials, n_points) @ values.transpose(0, 2, 1)
        xi = np.where(self.at_start, 2.0 * self.fraction - 1.0, 1.0 - 2.0 * self.fraction)
        factors = self.weight * kernels.legendre_values(n_polynomials - 1, xi)
        moments = values.transpose(1, 0, 2) @ factors.transpose(1, 2, 0)
        begins = np.flatnonzero(np.diff(self.item, prepend=-1))
        if begins.size < self.item.size:
            moments = np.add.reduceat(moments, begins, axis=0)
        return self.item[begins], moments.transpose(1, 2, 0)


def batches(rules: Iterable[OuterRule], n_points: int) -> Iterator[list[OuterRule]]:
    """Group rules into batches of at most `n_points` points; long rules are cut."""
    batch: list[OuterRule] = []
    room = n_points
    for rule in rules:
        first, n_each = 0, rule.fraction.shape[1]
        while first < rule.item.size:
            part = rule.part(slice(first, first + max(1, room // n_each)))
            batch.append(part)
            first += part.item.size
            room -= part.n_points
            if room < n_each:
                yield batch
                batch, room = [], n_points
    if batch:
        yield batch


def split_rules(
    geometry: ElementGeometry, outer: IntArray, inner: IntArray, item: IntArray, extra_points: int
) -> tuple[OuterRule, OuterRule]:
    """Return rules on pieces of outer elements, bisected until each piece is away from both ends of the inner element.

    Pieces that begin at a common node take the second, graded rule; they must be away from the other end only.
    """
    # both halves of each outer element, measured from its start and its end
    outer_element, inner_element = np.tile(outer[item], 2), np.tile(inner[item], 2)
    at_start = np.repeat([True, False], item.size)
    point = np.where(at_start, geometry.start[outer_element], geometry.end[outer_element])
    node = np.where(at_start, geometry.start_node[outer_element], geometry.end_node[outer_element])
    least_distance = (geometry.distance_at(SEPARATION) * geometry.half)[outer_element]
    to_start, to_end = point - geometry.start[inner_element], point - geometry.end[inner_element]
    meets_start, meets_end = node == geometry.start_node[inner_element], node == geometry.end_node[inner_element]

    def is_separated(half: IntArray, low: FloatArray, high: FloatArray) -> BoolArray:
        centre = geometry.offset(outer_element[half], 0.5 * (low + high), at_start[half])
        distance, at_node = least_distance[half] * (high - low), low == 0.0
        from_start = (np.abs(to_start[half] + centre) >= distance) | (at_node & meets_start[half])
        from_end = (np.abs(to_end[half] + centre) >= distance) | (at_node & meets_end[half])
        return np.asarray(from_start & from_end)

    half, low, high = split_until(is_separated, outer_element.size, 0.0, 0.5)
    order = np.argsort(half % max(item.size, 1), kind="stable")
    half, low, high = half[order], low[order], high[order]
    touches = (low == 0.0) & (meets_start | meets_end)[half]
    item, at_start = np.tile(item, 2)[half], at_start[half]

    def on_pieces(chosen: BoolArray, points: FloatArray, weights: FloatArray) -> OuterRule:
        start, length = low[chosen, None], (high - low)[chosen, None]
        ends = np.broadcast_to(at_start[chosen, None], (start.size, points.size))
        return OuterRule(item[chosen], ends, start + points * length, 2.0 * weights * length)

    xi, weights = gauss_legendre(N_REGULAR + extra_points)
    regular = on_pieces(~touches, 0.5 * (xi + 1.0), 0.5 * weights)
    return regular, on_pieces(touches, *gauss_graded(N_TOUCHING + extra_points))
