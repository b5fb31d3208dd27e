"""Obstacles given by a function that is negative inside."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bemkit.arrays import FloatArray
from bemkit.errors import InputError
from bemkit.formulas import ScalarField, check_field, evaluate_field
from bemkit.geometry.vectors import turned_left

_STEPS = 4.0 ** -np.arange(2.5, 9.0)
"""Steps of differences relative to the extent of the points; one of them suits any curvature."""
_ONE_STEP = _STEPS[3:4]
"""The step for slopes of low accuracy."""
_STENCIL = ((1.0, 0.75), (2.0, -0.15), (3.0, 1.0 / 60.0))
"""Offsets and weights of the central difference of sixth order."""
_IS_DISTANCE = 1e-8
"""Largest difference of the slope of a distance from one."""
_ON_LEVEL, _ROUND_OFF = 1e-10, 1e-14
"""Distances from the surface, and steps on it, that count as zero, relative to the extent of the points."""
_FARTHEST_POINT = -1e-3
"""Second derivative of half the squared distance along the surface below which a point is no nearest point."""
_MOST_STEPS, _MOST_HALVINGS = 100, 20


@dataclass(frozen=True)
class SignedDistance:
    """The obstacle fills the region where a function of x and y is negative.

    Parameters
    ----------
    distance : Expression or callable (x, y) -> (n,) array
        The distance from the obstacle [m], or any other smooth function that vanishes on the surface and increases away
        from it, such as ``x**2 + 4 * y**2 - 1``; the nearest point of the surface is then found by iteration.

    Raises
    ------
    InputError
        If the distance is neither a formula nor a function or, when it is evaluated, if no nearest point of the surface
        is found.

    Notes
    -----
    Slopes are differences of sixth order with the step that agrees best with a step four times longer; they are
    accurate to 1e-11 for smooth functions. If f is a distance, the nearest point to p is ``p - f grad f``. Otherwise it
    is found along the surface by Newton's method with steps that reduce the distance. Deep inside, several points may
    be about equally near; any of them may be found.
    """

    distance: ScalarField

    def __post_init__(self) -> None:
        check_field(self.distance, "distance")
        if not callable(self.distance):
            raise InputError(f"distance = {self.distance} is a number; give a formula in x and y, or a function")

    def gap(self, points: FloatArray, normals: FloatArray) -> FloatArray:
        """Return the distance from the surface; see `Obstacle.gap`."""
        return self._measure(points)[0]

    def approach(self, points: FloatArray, normals: FloatArray) -> FloatArray:
        """Return the direction against the normal of the surface; see `DirectedObstacle.approach`."""
        return -self._measure(points)[1]

    def _measure(self, points: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return distances (n,) and outward normals (n, 2) of the obstacle at the nearest points of its surface."""
        value = evaluate_field(self.distance, points)
        spread, largest = float(np.ptp(points, axis=0).max(initial=0.0)), float(np.abs(points).max(initial=0.0))
        size = max(spread or largest, 1e-3 * largest) or 1.0  # a single point has no spread
        slope = self._slope(points, size)
        foot = points - (value / _squares(slope, points))[:, None] * slope
        is_distance = np.abs(np.hypot(*slope.T) - 1.0) <= _IS_DISTANCE
        is_distance &= np.abs(evaluate_field(self.distance, foot)) <= _ON_LEVEL * size
        other = np.flatnonzero(~is_distance)
        if other.size:
            nearest = self._nearest(points[other], size)
            slope[other] = self._slope(nearest, size)
        normals = slope / np.hypot(*slope.T)[:, None]
        if other.size:
            value[other] = np.sum((points[other] - nearest) * normals[other], axis=1)
        return value, normals

    def _nearest(self, points: FloatArray, size: float) -> FloatArray:
        """Return the nearest points (n, 2) of the surface."""
        foot = self._on_surface(points, size)
        for _ in range(_MOST_STEPS):
            slope = self._slope(foot, size)
            steepness = np.sqrt(_squares(slope, foot))
            normal = slope / steepness[:, None]
            tangent = turned_left(normal)
            offset = foot - points
            # first and second derivative of half the squared distance along the surface
            first = np.sum(offset * tangent, axis=1)
            curvature = np.einsum("ni,nik,nk->n", tangent, self._second_derivatives(foot, size), tangent) / steepness
            second = 1.0 - curvature * np.sum(offset * normal, axis=1)
            if np.all((np.abs(first) <= _ON_LEVEL * size) & (second > _FARTHEST_POINT)):
                return foot
            longest = 0.5 / np.maximum(np.abs(curvature), 1.0 / size)
            downhill = np.where(first > 0.0, -longest, longest)
            step = np.where(second > 0.0, -first / np.where(second > 0.0, second, 1.0), downhill)
            foot = self._descended(points, foot, np.clip(step, -longest, longest)[:, None] * tangent, size)
        worst = int(np.argmax(np.abs(first)))
        raise InputError(self._nothing_near(points[worst]))

    def _descended(self, points: FloatArray, foot: FloatArray, step: FloatArray, size: float) -> FloatArray:
        """Step from points `foot` of the surface; halve steps that increase the distance from the points."""
        distance = np.hypot(*(points - foot).T)
        for _ in range(_MOST_HALVINGS):
            trial = self._on_surface(foot + step, size)
            is_worse = np.hypot(*(points - trial).T) > distance + _ROUND_OFF * size
            if not is_worse.any():
                break
            step = np.where(is_worse[:, None], 0.5 * step, step)
        return trial

    def _on_surface(self, points: FloatArray, size: float) -> FloatArray:
        """Return points (n, 2) of the surface by Newton's method along the slopes from points (n, 2)."""
        foot = points
        for _ in range(_MOST_STEPS):
            slope = self._slope(foot, size, _ONE_STEP)
            step = (evaluate_field(self.distance, foot) / _squares(slope, foot))[:, None] * slope
            length = np.hypot(*step.T)
            if length.max() <= _ROUND_OFF * size:
                return foot
            foot = foot - step / np.maximum(length / size, 1.0)[:, None]
        raise InputError(self._nothing_near(points[int(np.argmax(length))]))

    def _nothing_near(self, point: FloatArray) -> str:
        x, y = point
        return (
            f"distance {self.distance!r}: no nearest point of its zero level is found from ({x:.6g}, {y:.6g}); "
            "give a smooth function that increases away from the obstacle, preferably the distance"
        )

    def _slope(self, points: FloatArray, size: float, steps: FloatArray = _STEPS) -> FloatArray:
        """Return the gradient (n, 2) by differences."""
        trials = np.zeros((len(steps), len(points), 2))
        for trial, step in zip(trials, size * steps, strict=True):
            for axis, unit in enumerate(np.eye(2)):
                for place, weight in _STENCIL:
                    shift = place * step * unit
                    ahead, behind = (evaluate_field(self.distance, points + sign * shift) for sign in (1.0, -1.0))
                    trial[:, axis] += weight / step * (ahead - behind)
        if len(steps) == 1:
            return np.asarray(trials[0])
        change = np.abs(np.diff(trials, axis=0)).max(axis=2)
        best = np.argmin(change, axis=0) + 1
        return np.asarray(trials[best, np.arange(len(points))])

    def _second_derivatives(self, points: FloatArray, size: float) -> FloatArray:
        """Return second derivatives (n, 2, 2) to about six digits, which is enough for Newton steps."""
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
        If a slope vanishes, so that there is no direction.
    """
    squares = np.sum(slope**2, axis=1)
    if not (squares > 0.0).all():
        x, y = points[int(np.argmin(squares))]
        raise InputError(
            f"distance has no slope at ({x:.6g}, {y:.6g}): give a function that increases away from the obstacle"
        )
    return np.asarray(squares)
