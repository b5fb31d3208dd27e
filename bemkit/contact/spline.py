"""Smooth curves through points as obstacles."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from bemkit.arrays import FloatArray
from bemkit.contact.obstacle import check_pair
from bemkit.errors import InputError

if TYPE_CHECKING:
    from scipy.interpolate import CubicSpline

_SAMPLES = 8
"""Samples of each span, among which the search for the nearest point begins."""
_MOST_STEPS = 60
"""Largest number of steps that refine the nearest point; bisection takes fewer."""


@dataclass(frozen=True)
class RigidSpline:
    """The obstacle fills the left side of a smooth curve through points.

    The obstacle is inside of a closed curve with anticlockwise points, and outside (a cavity) with clockwise points. An
    open curve continues along straight lines beyond its ends.

    Parameters
    ----------
    points : sequence of (x, y) [m]
        In order along the curve, which must not cross itself; the first point is not repeated at the end.
    is_closed : bool

    Raises
    ------
    InputError
        If there are fewer than three points, two neighbours coincide, or a coordinate is not finite.

    Notes
    -----
    The curve is a cubic spline with continuous curvature, parametrised by chord length. The error of approximation of a
    smooth curve is of fourth order in the distance of the points.
    """

    points: tuple[tuple[float, float], ...]
    is_closed: bool = True

    def __post_init__(self) -> None:
        if len(self.points) < 3:
            raise InputError(f"points has {len(self.points)} entries: give at least three")
        for index, point in enumerate(self.points):
            check_pair(f"points[{index}]", point)
            if tuple(point) == tuple(self.points[index - 1]) and (index or self.is_closed):
                raise InputError(f"points[{index}] is {point}, as is the one before it: remove one of them")

    def gap(self, points: FloatArray, normals: FloatArray) -> FloatArray:
        """Return the distance from the curve; see `Obstacle.gap`."""
        nearest, outward = self._nearest(points)
        return np.asarray(np.sum((points - nearest) * outward, axis=1))

    def approach(self, points: FloatArray, normals: FloatArray) -> FloatArray:
        """Return the direction against the normal of the curve; see `DirectedObstacle.approach`."""
        return -self._nearest(points)[1]

    def curve(self, n_samples: int = _SAMPLES) -> FloatArray:
        """Return points (n, 2) [m] of the curve, `n_samples` on each span and the end."""
        return np.asarray(self._spline(self._samples(n_samples)))

    @cached_property
    def _spline(self) -> CubicSpline:
        from scipy.interpolate import CubicSpline

        points = np.array(self.points, dtype=float)
        if self.is_closed:
            points = np.concatenate([points, points[:1]])
        lengths = np.cumsum(np.append(0.0, np.hypot(*np.diff(points, axis=0).T)))
        return CubicSpline(lengths, points, bc_type="periodic" if self.is_closed else "not-a-knot")

    def _samples(self, n_samples: int) -> FloatArray:
        knots = self._spline.x
        share = np.arange(n_samples) / n_samples
        return np.append((knots[:-1, None] + share * np.diff(knots)[:, None]).ravel(), knots[-1])

    def _nearest(self, points: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the nearest points (n, 2) of the curve, and the outward unit normals (n, 2) there."""
        from scipy.spatial import KDTree

        spline, samples = self._spline, self._samples(_SAMPLES)
        slope = spline.derivative()
        nearest_sample = KDTree(spline(samples)).query(points)[1]
        s, last = samples[nearest_sample], len(samples) - 1
        if self.is_closed:  # a periodic spline may be asked beyond its ends
            step = np.diff(samples)
            low, high = s - step[nearest_sample - 1], s + step[nearest_sample % last]
        else:
            low, high = samples[np.maximum(nearest_sample - 1, 0)], samples[np.minimum(nearest_sample + 1, last)]
        for _ in range(_MOST_STEPS):
            # Newton's method for the derivative of half the squared distance, with bisection outside of the bracket
            offset, along = spline(s) - points, slope(s)
            first = np.sum(offset * along, axis=1)
            low, high = np.where(first < 0.0, s, low), np.where(first > 0.0, s, high)
            second = np.sum(along**2, axis=1) + np.sum(offset * slope(s, 1), axis=1)
            following = s - first / np.where(second > 0.0, second, np.inf)
            is_inside = (following >= low) & (following <= high) & (second > 0.0)
            following = np.where(is_inside, following, 0.5 * (low + high))
            if np.array_equal(following, s):
                break
            s = following
        nearest, along = spline(s), slope(s)
        if not self.is_closed:
            nearest, along = self._with_straight_ends(points, nearest, along)
        along = along / np.hypot(*along.T)[:, None]
        return nearest, np.stack([along[:, 1], -along[:, 0]], axis=1)

    def _with_straight_ends(
        self, points: FloatArray, nearest: FloatArray, along: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        for place, sign in ((self._spline.x[0], -1.0), (self._spline.x[-1], 1.0)):
            end, tangent = self._spline(place), self._spline(place, 1)
            outward = sign * tangent / np.hypot(*tangent)
            foot = end + np.maximum((points - end) @ outward, 0.0)[:, None] * outward
            is_nearer = np.hypot(*(points - foot).T) < np.hypot(*(points - nearest).T)
            nearest = np.where(is_nearer[:, None], foot, nearest)
            along = np.where(is_nearer[:, None], tangent, along)
        return nearest, along
