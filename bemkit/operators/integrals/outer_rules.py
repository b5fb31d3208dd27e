"""Gauss rules on the outer elements of pairs: their number of points follows from the distance of the inner element."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
import numpy.typing as npt

from bemkit.arrays import BoolArray, FloatArray, IntArray, read_only
from bemkit.geometry.quadrature import gauss_graded, gauss_legendre
from bemkit.operators import kernels
from bemkit.operators.integrals.panels import Panels, squared_distance
from bemkit.operators.integrals.splitting import SEPARATION, split_until

# An analytic function whose nearest singularity lies z half lengths from the centre is integrated by n Gauss points
# with an error of about (z + sqrt(z^2 - 1))^(-2n). A factor P_a costs a digits of that base, and every rule has one
# point more for every two degrees (`Degrees.extra_points`), so that an odd a costs one digit: the distances below make
# the error 1e-15 for even a and at most 7e-14 for odd a, of what P_0 gives.
GAUSS_LEVELS = ((2, 1.2e4), (3, 212.0), (4, 38.0), (6, 9.0), (10, 3.0))
"""Numbers of outer points, and the distance [half lengths of the outer element] from which each is enough."""
N_REGULAR = 10
N_TOUCHING = 30
LevelArray = npt.NDArray[np.int8]
"""An index into `GAUSS_LEVELS` for each pair; one byte, because there are as many as matrix blocks."""


def gauss_levels(panels: Panels, outer: IntArray, inner: IntArray) -> LevelArray:
    """Return how many of the distances of `GAUSS_LEVELS` pairs fall short of, for elements of shapes that broadcast.

    A curved inner element needs a rule of its own, with the same distances in its own half lengths.
    """
    centre, half = panels.centre[outer], panels.half[outer]
    nearest = np.minimum(squared_distance(centre, panels.start[inner]), squared_distance(centre, panels.end[inner]))
    level = np.zeros(nearest.shape, np.int8)
    for _, distance in GAUSS_LEVELS:
        level += nearest < np.square(half * panels.reach(distance)[outer])
    if panels.curved is not None:
        from_centre = squared_distance(centre, panels.centre[inner])
        own = np.zeros_like(level)
        for _, distance in GAUSS_LEVELS:
            own += from_centre < np.square(panels.half[inner] * panels.reach(distance)[inner] + half)
        level = np.where(panels.is_straight[inner], level, np.maximum(level, own))
    return level


@dataclass(frozen=True, eq=False)
class OuterRule:
    """Points on the outer elements of some pairs.

    Points are given as fractions of the length from one end node, so that the distance to a shared node, and to a node
    at any small distance from it, is exact however small it is.

    Parameters
    ----------
    item : (n,) int array
        The pairs, ascending.
    at_start : (n, n_points) bool array
        Whether the start is the end node that points are measured from.
    fraction : (n, n_points) array
    weight : (n, n_points) array, optional
        By default points and weights are Gauss' on whole elements; then a single row of points serves all pairs.
    """

    item: IntArray
    at_start: BoolArray
    fraction: FloatArray
    weight: FloatArray | None = None

    @classmethod
    def whole(cls, item: IntArray, n_points: int) -> OuterRule:
        """Return one Gauss rule for all, each half of it measured from its own end."""
        points, _ = gauss_legendre(n_points)
        return cls(item, (points < 0.0)[None], 0.5 * (1.0 - np.abs(points))[None])

    @property
    def n_points(self) -> int:
        """How many points there are on all pairs."""
        return int(self.item.size * self.fraction.shape[1])

    @property
    def points(self) -> tuple[IntArray, BoolArray, FloatArray]:
        """The pair of each point, which end it is measured from and how far it is away."""
        shape = self.item.size, self.fraction.shape[1]
        at_start, fraction = np.broadcast_to(self.at_start, shape), np.broadcast_to(self.fraction, shape)
        return np.repeat(self.item, shape[1]), at_start.ravel(), fraction.ravel()

    def part(self, chosen: slice) -> OuterRule:
        """Return the rule for some of the pairs."""
        if self.weight is None:
            return OuterRule(self.item[chosen], self.at_start, self.fraction)
        return OuterRule(self.item[chosen], self.at_start[chosen], self.fraction[chosen], self.weight[chosen])

    def moments(self, values: FloatArray, n_polynomials: int) -> tuple[IntArray, FloatArray]:
        """Sum values (n_rows, n_points) at the points, times the Legendre polynomials of the outer elements.

        Returns
        -------
        items : (m,) int array
            Without repetition.
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
    """Group rules, cut where they are long, so that each group has so many points at most."""
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


@lru_cache(maxsize=16)
def _on_unit_interval(n_points: int) -> tuple[FloatArray, FloatArray]:
    """Return Gauss points and weights on [0, 1], read-only."""
    reference, reference_weights = gauss_legendre(n_points)
    points, weights = 0.5 * (reference + 1.0), 0.5 * reference_weights
    read_only(points)
    read_only(weights)
    return points, weights


def split_rules(
    panels: Panels, outer: IntArray, inner: IntArray, item: IntArray, extra_points: int
) -> tuple[OuterRule, OuterRule]:
    """Return rules on pieces of outer elements, bisected until each piece is away from both ends of the inner element.

    A piece that begins at a common node takes a rule for that, the second one, but must be away from the other node.
    """
    own, other = np.tile(outer[item], 2), np.tile(inner[item], 2)
    at_start = np.repeat([True, False], item.size)
    node = np.where(at_start, panels.start[own], panels.end[own])
    number = np.where(at_start, panels.start_node[own], panels.end_node[own])
    reach = (panels.reach(SEPARATION) * panels.half)[own]
    to_start, to_end = node - panels.start[other], node - panels.end[other]
    meets_start, meets_end = number == panels.start_node[other], number == panels.end_node[other]

    def is_clear(half: IntArray, low: FloatArray, high: FloatArray) -> BoolArray:
        centre = panels.offset(own[half], 0.5 * (low + high), at_start[half])
        distance, at_node = reach[half] * (high - low), low == 0.0
        start_is_clear = (np.abs(to_start[half] + centre) >= distance) | (at_node & meets_start[half])
        end_is_clear = (np.abs(to_end[half] + centre) >= distance) | (at_node & meets_end[half])
        return np.asarray(start_is_clear & end_is_clear)

    half, low, high = split_until(is_clear, own.size, 0.0, 0.5)
    order = np.argsort(half % max(item.size, 1), kind="stable")
    half, low, high = half[order], low[order], high[order]
    touches = (low == 0.0) & (meets_start | meets_end)[half]
    item, at_start = np.tile(item, 2)[half], at_start[half]

    def on_pieces(chosen: BoolArray, points: FloatArray, weights: FloatArray) -> OuterRule:
        start, length = low[chosen, None], (high - low)[chosen, None]
        ends = np.broadcast_to(at_start[chosen, None], (start.size, points.size))
        return OuterRule(item[chosen], ends, start + points * length, 2.0 * weights * length)

    regular, touching = _on_unit_interval(N_REGULAR + extra_points), gauss_graded(N_TOUCHING + extra_points)
    return on_pieces(~touches, *regular), on_pieces(touches, *touching)
