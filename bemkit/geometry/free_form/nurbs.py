"""Rational B-splines (NURBS): Bezier curves, ellipses and the free-form curves of drawing programs, exactly."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from bemkit.arrays import FloatArray
from bemkit.errors import GeometryError
from bemkit.geometry.curves import ParametricCurve
from bemkit.geometry.vectors import norms

if TYPE_CHECKING:
    from scipy.interpolate import BSpline

_END = 1e-7
"""Distance from an end with coincident control points, where the curve has no speed, at which the tangent is
evaluated."""


@dataclass(frozen=True, eq=False)
class Nurbs:
    """A rational B-spline as a function of a parameter in [0, 1].

    Parameters
    ----------
    points : (n, 2) array [m]
        Control points.
    degree : int
        Of the polynomials between knots, less than n.
    knots : (n + degree + 1,) array
        Not decreasing; the first and the last `degree` + 1 of them equal, and fewer than `degree` + 1 others.
    weights : (n,) array
        Positive.

    Raises
    ------
    GeometryError
        If numbers of points, knots and weights do not fit each other, knots decrease, or a weight is not positive.

    References
    ----------
    L. Piegl, W. Tiller: The NURBS Book. Springer 1997, chapter 4.
    """

    points: FloatArray
    degree: int
    knots: FloatArray
    weights: FloatArray

    def __post_init__(self) -> None:
        n, degree = len(self.points), self.degree
        if not 1 <= degree < n:
            raise GeometryError(f"nurbs: degree is {degree} with {n} control points: give one from 1 to {n - 1}")
        if len(self.weights) != n or not all(0.0 < weight < np.inf for weight in self.weights):
            raise GeometryError(
                f"nurbs: weights are {list(self.weights)} for {n} control points, both ends counted: give as many "
                "positive numbers"
            )
        knots = self.knots
        if len(knots) != n + degree + 1 or not np.isfinite(knots).all() or (np.diff(knots) < 0.0).any():
            raise GeometryError(
                f"nurbs: knots has {len(knots)} numbers for {n} control points and degree {degree}: give "
                f"{n + degree + 1} numbers that do not decrease"
            )
        is_clamped = knots[0] == knots[degree] < knots[-degree - 1] == knots[-1]
        inner = knots[degree + 1 : -degree - 1]
        if not is_clamped or any(np.count_nonzero(inner == knot) >= degree for knot in inner):
            raise GeometryError(
                f"nurbs: knots {list(knots)} do not make a smooth curve from the first control point to the last: "
                f"repeat the first and the last knot {degree + 1} times, and those between less than {degree} times"
            )

    @cached_property
    def _homogeneous(self) -> tuple[BSpline, BSpline]:
        from scipy.interpolate import BSpline

        knots = (self.knots - self.knots[0]) / (self.knots[-1] - self.knots[0])
        values = np.column_stack([self.points * self.weights[:, None], self.weights])
        spline = BSpline(knots, values, self.degree)
        return spline, spline.derivative()

    @cached_property
    def _inset(self) -> tuple[float, float]:
        """How far from its ends the derivative is taken: where the curve has no speed there, not at zero."""
        first, last = norms(self._velocity(np.array([0.0, 1.0])))
        size = norms(np.diff(self.points, axis=0)).max()
        return (_END if first <= _END * size else 0.0), (_END if last <= _END * size else 0.0)

    def point(self, p: FloatArray) -> FloatArray:
        """Evaluate the curve at parameters (n,) in [0, 1]."""
        value = self._homogeneous[0](p)
        points: FloatArray = value[:, :2] / value[:, 2:]
        return points

    def derivative(self, p: FloatArray) -> FloatArray:
        """Differentiate the curve with respect to p."""
        first, last = self._inset
        return self._velocity(np.clip(p, first, 1.0 - last))

    def _velocity(self, p: FloatArray) -> FloatArray:
        value, slope = (spline(p) for spline in self._homogeneous)
        velocity: FloatArray = (slope[:, :2] - slope[:, 2:] * value[:, :2] / value[:, 2:]) / value[:, 2:]
        return velocity

    def curve(self) -> ParametricCurve:
        """Return the curve by its arc length."""
        return ParametricCurve(self.point, self.derivative, is_analytic=len(self.knots) == 2 * self.degree + 2)


def clamped_knots(n_points: int, degree: int) -> FloatArray:
    """Return knots at equal distances, the ends repeated: of as many points as degree + 1, a Bezier curve."""
    return np.concatenate([np.zeros(degree), np.linspace(0.0, 1.0, n_points - degree + 1), np.ones(degree)])


def conic_arc(centre: FloatArray, first: FloatArray, second: FloatArray, start: float, end: float) -> Nurbs:
    """Return the arc centre + cos(t) first + sin(t) second of an ellipse, from t = start to end, exactly.

    Parameters
    ----------
    centre, first, second : (2,) array [m]
        Centre and two conjugate half diameters.
    start, end : float [rad]
        Less than pi apart, in either sense.
    """
    half, middle = 0.5 * (end - start), 0.5 * (start + end)
    directions = np.array([[np.cos(t), np.sin(t)] for t in (start, middle, end)])
    directions[1] /= np.cos(half)
    points = centre + directions @ np.array([first, second])
    return Nurbs(points, 2, clamped_knots(3, 2), np.array([1.0, np.cos(half), 1.0]))
