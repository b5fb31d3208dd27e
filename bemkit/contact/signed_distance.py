"""Obstacles known by a function that is negative inside of them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bemkit.arrays import FloatArray
from bemkit.errors import InputError
from bemkit.formulas import ScalarField, check_field, evaluate_field

_STEPS = 4.0 ** -np.arange(2.5, 9.0)
"""Steps of differences, in sizes of what is measured: whatever the curvature, one of them suits."""
_STENCIL = ((1.0, 0.75), (2.0, -0.15), (3.0, 1.0 / 60.0))
"""Places and weights of the central difference of sixth order."""
_IS_DISTANCE = 1e-8
"""How much the slope of a distance may differ from one."""
_ON_LEVEL = 1e-10
"""Distance from the surface, in sizes of what is measured, that counts as none."""
_NEAR = 1e-3
"""Distance from the surface, in the same sizes, from which on Newton's method finds the nearest point."""
_LAST_STEP = 1e-10
"""Step, in the same sizes, after which the next one is round-off: the curvature guides it by six digits."""
_MOST_STEPS = 50


@dataclass(frozen=True)
class SignedDistance:
    """The obstacle fills where a function of x and y is negative.

    Parameters
    ----------
    distance : Expression or callable (x, y) -> (n,) array
        Best the distance from the obstacle itself [m]. Any other smooth function that grows away from the obstacle and
        vanishes on its surface will do, such as ``x**2 + 4 * y**2 - 1``: the nearest point of the surface is then
        looked for.

    Raises
    ------
    InputError
        If the distance is neither a formula for a number nor a function; when it is measured, if no nearest point of
        the surface is found.

    Notes
    -----
    Slopes are differences of sixth order, of that step for which two orders of magnitude agree best: 1e-11 and better
    where the function is smooth. The nearest point c of a point p solves ``c + m grad f(c) = p`` and ``f(c) = 0``, by
    Newton's method; where f is a distance it is ``p - f grad f``.
    """

    distance: ScalarField

    def __post_init__(self) -> None:
        check_field(self.distance, "distance")
        if not callable(self.distance):
            raise InputError(f"distance = {self.distance} is a number; give a formula in x and y, or a function")

    def gap(self, points: FloatArray, normals: FloatArray) -> FloatArray:
        """Measure the distance from the surface; see `Obstacle.gap`."""
        return self._measure(points)[0]

    def approach(self, points: FloatArray, normals: FloatArray) -> FloatArray:
        """Return the direction against the normal of the surface; see `DirectedObstacle.approach`."""
        return -self._measure(points)[1]

    def _measure(self, points: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return distances (n,) and normals (n, 2) out of the obstacle, at the nearest points of its surface."""
        value = evaluate_field(self.distance, points)
        size = float(max(np.ptp(points, axis=0).max(initial=0.0), np.abs(points).max(initial=0.0) * 1e-3)) or 1.0
        slope = self._slope(points, size)
        foot = points - (value / _squares(slope, points))[:, None] * slope
        is_distance = np.abs(np.hypot(*slope.T) - 1.0) <= _IS_DISTANCE
        is_distance &= np.abs(evaluate_field(self.distance, foot)) <= _ON_LEVEL * size
        other = np.flatnonzero(~is_distance)
        if other.size:
            nearest = self._nearest(points[other], foot[other], size)
            slope[other] = self._slope(nearest, size)
        normals = slope / np.hypot(*slope.T)[:, None]
        if other.size:
            value[other] = np.sum((points[other] - nearest) * normals[other], axis=1)
        return value, normals

    def _nearest(self, points: FloatArray, foot: FloatArray, size: float) -> FloatArray:
        """Return the points (n, 2) of the surface nearest to points (n, 2), starting from a first guess."""
        foot = self._walked(foot, size)
        slope = self._slope(foot, size)
        factor = np.sum((points - foot) * slope, axis=1) / _squares(slope, foot)
        missing = self._missing(points, foot, factor, size)
        for _ in range(_MOST_STEPS):
            matrix = np.zeros((len(points), 3, 3))
            slope = self._slope(foot, size)
            matrix[:, :2, :2] = np.eye(2) + factor[:, None, None] * self._curvature(foot, size)
            matrix[:, :2, 2], matrix[:, 2, :2] = slope, slope / np.hypot(*slope.T)[:, None]
            try:
                step = np.linalg.solve(matrix, -missing[:, :, None])[:, :, 0]
            except np.linalg.LinAlgError:
                break
            share, largest = np.ones(len(points)), np.abs(missing).max(axis=1)
            for _ in range(8):  # shorter where that comes no nearer
                trial, trial_factor = foot + share[:, None] * step[:, :2], factor + share * step[:, 2]
                missing = self._missing(points, trial, trial_factor, size)
                is_worse = np.abs(missing).max(axis=1) > largest
                if not is_worse.any():
                    break
                share = np.where(is_worse, 0.5 * share, share)
            foot, factor = np.asarray(trial), np.asarray(trial_factor)
            if np.hypot(*step[:, :2].T).max() <= _LAST_STEP * size:
                break
        wrong = np.flatnonzero(~(np.abs(missing).max(axis=1) <= _ON_LEVEL * size))
        if wrong.size:
            x, y = points[wrong[0]]
            raise InputError(
                f"distance {self.distance!r}: no nearest point of its zero level is found from ({x:.6g}, {y:.6g}); "
                "give a smooth function that grows away from the obstacle, best the distance itself"
            )
        return foot

    def _walked(self, foot: FloatArray, size: float) -> FloatArray:
        """Return points (n, 2) near the surface, straight along the slopes from points (n, 2)."""
        for _ in range(_MOST_STEPS):
            slope = self._slope(foot, size)
            step = (evaluate_field(self.distance, foot) / _squares(slope, foot))[:, None] * slope
            foot = foot - step
            if np.hypot(*step.T).max() <= _NEAR * size:
                break
        return foot

    def _missing(self, points: FloatArray, foot: FloatArray, factor: FloatArray, size: float) -> FloatArray:
        """Return (n, 3) lengths: how far feet are from the normals through the points, and from the surface."""
        slope = self._slope(foot, size)
        off_surface = evaluate_field(self.distance, foot) / np.sqrt(_squares(slope, foot))
        return np.column_stack([foot - points + factor[:, None] * slope, off_surface])

    def _slope(self, points: FloatArray, size: float) -> FloatArray:
        """Return the gradient (n, 2) by differences."""
        trials = np.zeros((len(_STEPS), len(points), 2))
        for trial, step in zip(trials, size * _STEPS, strict=True):
            for axis, unit in enumerate(np.eye(2)):
                for place, weight in _STENCIL:
                    shift = place * step * unit
                    ahead, behind = (evaluate_field(self.distance, points + sign * shift) for sign in (1.0, -1.0))
                    trial[:, axis] += weight / step * (ahead - behind)
        change = np.abs(np.diff(trials, axis=0)).max(axis=2)
        best = np.argmin(change, axis=0) + 1
        return np.asarray(trials[best, np.arange(len(points))])

    def _curvature(self, points: FloatArray, size: float) -> FloatArray:
        """Return the second derivatives (n, 2, 2), good to six digits: they only guide the way."""
        step = 1e-3 * size
        x, y = step * np.eye(2)
        at = {(i, k): evaluate_field(self.distance, points + i * x + k * y) for i in (-1, 0, 1) for k in (-1, 0, 1)}
        xx = at[1, 0] - 2.0 * at[0, 0] + at[-1, 0]
        yy = at[0, 1] - 2.0 * at[0, 0] + at[0, -1]
        xy = 0.25 * (at[1, 1] - at[1, -1] - at[-1, 1] + at[-1, -1])
        return np.moveaxis(np.array([[xx, xy], [xy, yy]]), 2, 0) / step**2


def _squares(slope: FloatArray, points: FloatArray) -> FloatArray:
    """Return the squared lengths (n,) of slopes.

    Raises
    ------
    InputError
        Where a slope vanishes, so that no direction is known.
    """
    squares = np.sum(slope**2, axis=1)
    if not (squares > 0.0).all():
        x, y = points[int(np.argmin(squares))]
        raise InputError(f"distance is level at ({x:.6g}, {y:.6g}): give a function that grows away from the obstacle")
    return np.asarray(squares)
