"""Curves of the sides of a body and of curved elements."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from numbers import Real
from typing import TYPE_CHECKING, ClassVar, Protocol

import numpy as np

from bemkit.arrays import FloatArray
from bemkit.errors import GeometryError, format_point
from bemkit.geometry.quadrature import gauss_legendre
from bemkit.geometry.vectors import norms

if TYPE_CHECKING:
    from bemkit.geometry.free_form.arc_length import ArcLength

CURVE_MEMBERS = ("is_straight", "is_analytic", "magnitude", "point", "derivative")
"""Members of every curve; see `Curve`."""
_SAMPLES = np.linspace(0.0, 1.0, 17)
_N_CHECK_INTERVALS = 8
_N_CHECK_POINTS = 8
_DERIVATIVE_TOLERANCE = 1e-2  # catches a wrong sign, factor or component; forgives the quadrature of a rough curve


class Curve(Protocol):
    """A smooth piece of boundary, traversed with the body on its left at constant speed.

    A curve of one's own that derives from this class writes `is_straight`, `point` and `derivative`. Its parameter must
    be proportional to the arc length, because functions on curved elements are polynomials of the arc length;
    `ParametricCurve(curve.point, curve.derivative)` makes such a curve of any other.
    """

    @property
    def is_straight(self) -> bool:
        """Whether the curve is a straight segment, so that its elements are their chords."""
        ...

    @property
    def is_analytic(self) -> bool:
        """Whether the curve is smooth to all orders, so that elements can follow it to round-off; true by default."""
        return True

    @property
    def magnitude(self) -> float:
        """Largest length [m] met when the curve is evaluated: its points are known to eps times that.

        By default its largest coordinate.
        """
        return float(np.abs(self.point(_SAMPLES)).max())

    def point(self, s: FloatArray) -> FloatArray:
        """Evaluate the curve.

        Parameters
        ----------
        s : (n,) array
            Parameters in [0, 1].

        Returns
        -------
        (n, 2) array [m]
            Points; s = 0 is the start, s = 1 the end.
        """
        ...

    def derivative(self, s: FloatArray) -> FloatArray:
        """Differentiate the curve with respect to its parameter.

        Parameters
        ----------
        s : (n,) array
            Parameters in [0, 1].

        Returns
        -------
        (n, 2) array [m]
            dx/ds along the traversal; its size is the length of the curve at every s.
        """
        ...


@dataclass(frozen=True)
class Segment(Curve):
    """A straight segment.

    Parameters
    ----------
    start, end : (float, float) [m]
        Its two different end points.
    """

    is_straight: ClassVar[bool] = True

    start: tuple[float, float]
    end: tuple[float, float]

    def __post_init__(self) -> None:
        start = as_point(self.start, "Segment: start")
        end = as_point(self.end, "Segment: end")
        if start == end:
            raise GeometryError(f"Segment: start and end are the same point {start}: give two different points")
        object.__setattr__(self, "start", start)
        object.__setattr__(self, "end", end)

    def point(self, s: FloatArray) -> FloatArray:
        """Evaluate the curve; both ends are met to the last digit."""
        s = np.asarray(s, dtype=float)[:, None]
        start, end = np.array(self.start), np.array(self.end)
        # a coordinate that does not change keeps its last digit, so a side along an axis is straight at any distance
        return np.where(start == end, start, (1.0 - s) * start + s * end)

    def derivative(self, s: FloatArray) -> FloatArray:
        """Return the constant vector from start to end."""
        return np.tile(np.array(self.end) - np.array(self.start), (len(s), 1))


@dataclass(frozen=True)
class Arc(Curve):
    """A circular arc.

    Parameters
    ----------
    centre : (float, float) [m]
        Centre of the circle.
    radius : float [m]
        Its radius, positive.
    start_angle, end_angle : float [rad]
        Polar angles of the two ends; the arc is traversed anticlockwise if `end_angle` is the larger.
    """

    is_straight: ClassVar[bool] = False

    centre: tuple[float, float]
    radius: float
    start_angle: float
    end_angle: float

    def __post_init__(self) -> None:
        object.__setattr__(self, "centre", as_point(self.centre, "Arc: centre"))
        require_positive("Arc", radius=self.radius)
        sweep = self.end_angle - self.start_angle
        if not 0.0 < abs(sweep) <= 2.0 * np.pi * (1.0 + 1e-12):  # the slack forgives angles rounded from degrees
            raise GeometryError(
                f"Arc: from start_angle={self.start_angle} to end_angle={self.end_angle} is not an arc: "
                "give angles in radians that differ by more than 0 and at most 2 pi"
            )

    def point(self, s: FloatArray) -> FloatArray:
        """Evaluate the curve; s is proportional to the angle."""
        angle = self._angle(s)
        return np.array(self.centre) + self.radius * np.column_stack([np.cos(angle), np.sin(angle)])

    def derivative(self, s: FloatArray) -> FloatArray:
        """Differentiate the curve with respect to s."""
        angle = self._angle(s)
        speed = self.radius * (self.end_angle - self.start_angle)
        return speed * np.column_stack([-np.sin(angle), np.cos(angle)])

    @property
    def magnitude(self) -> float:
        """Largest length that its evaluation meets [m]."""
        return float(np.abs(self.centre).max()) + self.radius

    def _angle(self, s: FloatArray) -> FloatArray:
        angle: FloatArray = (1.0 - s) * self.start_angle + s * self.end_angle
        return angle


@dataclass(frozen=True, eq=False)
class ParametricCurve(Curve):
    """A smooth curve given by two vectorised functions of any parameter.

    Parameters
    ----------
    function : callable
        (n,) parameters p in [0, 1] -> (n, 2) points [m].
    derivative_function : callable
        (n,) parameters -> (n, 2) derivatives dx/dp [m]; checked against `function`.
    is_analytic : bool
        Whether it is smooth to all orders, so that elements can follow it to round-off. They follow one that is not,
        such as a spline, as closely as polynomials do.

    Raises
    ------
    GeometryError
        If a function returns another shape or something not finite, the derivative vanishes, or the
        derivative does not belong to the function.

    Notes
    -----
    The curve itself takes the arc length, as a fraction of its total, for its parameter s: p(s) is found to round-off.
    """

    is_straight: ClassVar[bool] = False  # for any shape

    function: Callable[[FloatArray], FloatArray]
    derivative_function: Callable[[FloatArray], FloatArray]
    is_analytic: bool = True

    def __post_init__(self) -> None:
        nodes, weights = gauss_legendre(_N_CHECK_POINTS)
        ends = np.linspace(0.0, 1.0, _N_CHECK_INTERVALS + 1)
        half = 0.5 / _N_CHECK_INTERVALS
        s = ((ends[:-1, None] + half) + half * nodes).ravel()
        velocity = self._velocity(s)
        speed = norms(velocity)
        if not speed.min() > 0.0:
            raise GeometryError(
                f"ParametricCurve: derivative_function vanishes at s={s[speed.argmin()]:.6g}: "
                "choose a parameter with a nonzero derivative everywhere"
            )
        steps = np.diff(self._place(ends), axis=0)
        integrals = half * np.einsum("q,iqk->ik", weights, velocity.reshape(_N_CHECK_INTERVALS, _N_CHECK_POINTS, 2))
        mismatch = norms(steps - integrals)
        worst = int(mismatch.argmax())
        if mismatch[worst] > _DERIVATIVE_TOLERANCE * speed.mean() / _N_CHECK_INTERVALS:
            raise GeometryError(
                f"ParametricCurve: from s={ends[worst]:.6g} to s={ends[worst + 1]:.6g} function moves by "
                f"{format_point(steps[worst])}, but derivative_function adds up to {format_point(integrals[worst])}: "
                "give the derivative of function with respect to s"
            )

    @cached_property
    def _arc_length(self) -> ArcLength:
        from bemkit.geometry.free_form.arc_length import ArcLength

        return ArcLength(self._velocity)

    def point(self, s: FloatArray) -> FloatArray:
        """Evaluate the curve."""
        return self._place(self._arc_length.parameter(np.asarray(s, dtype=float)))

    def derivative(self, s: FloatArray) -> FloatArray:
        """Differentiate the curve with respect to s."""
        velocity = self._velocity(self._arc_length.parameter(np.asarray(s, dtype=float)))
        derivative: FloatArray = velocity * (self._arc_length.total / norms(velocity))[:, None]
        return derivative

    def _place(self, p: FloatArray) -> FloatArray:
        return _checked_values("function", self.function(p), p)

    def _velocity(self, p: FloatArray) -> FloatArray:
        return _checked_values("derivative_function", self.derivative_function(p), p)


@dataclass(frozen=True, eq=False)
class TransformedCurve(Curve):
    """The curve matrix (x - origin) + shift, from start to end or, if reversed, from end to start.

    Parameters
    ----------
    curve : Curve
    origin, shift : (float, float) [m]
    matrix : ((float, float), (float, float))
        A rotation or reflection times a factor, so that the parameter stays proportional to the arc length.
    is_reversed : bool
    """

    curve: Curve
    origin: tuple[float, float] = (0.0, 0.0)
    matrix: tuple[tuple[float, float], tuple[float, float]] = ((1.0, 0.0), (0.0, 1.0))
    shift: tuple[float, float] = (0.0, 0.0)
    is_reversed: bool = False

    @property
    def is_straight(self) -> bool:
        """Whether the original is straight."""
        return self.curve.is_straight

    @property
    def is_analytic(self) -> bool:
        """Whether the original is smooth to all orders."""
        return self.curve.is_analytic

    @property
    def magnitude(self) -> float:
        """Largest length in its evaluation [m]: it includes the round-off at the position of the original."""
        factor = float(np.hypot(*self.matrix[0]))
        before = self.curve.magnitude + float(np.abs(self.origin).max())
        return factor * before + float(np.abs(self.shift).max())

    def point(self, s: FloatArray) -> FloatArray:
        """Evaluate the curve."""
        arms = self.curve.point(self._parameter(s)) - np.array(self.origin)
        return np.asarray(arms @ np.array(self.matrix).T + np.array(self.shift))

    def derivative(self, s: FloatArray) -> FloatArray:
        """Differentiate the curve with respect to s."""
        derivative: FloatArray = self.curve.derivative(self._parameter(s)) @ np.array(self.matrix).T
        return -derivative if self.is_reversed else derivative

    def _parameter(self, s: FloatArray) -> FloatArray:
        return 1.0 - s if self.is_reversed else s


def scaled_curve(
    curve: Curve, origin: tuple[float, float], factors: tuple[float, float], *, is_reversed: bool = False
) -> TransformedCurve:
    """Return the curve (x - origin) * factors; these differ by a sign only, which reflects the curve."""
    return TransformedCurve(curve, origin, ((factors[0], 0.0), (0.0, factors[1])), is_reversed=is_reversed)


def reverse_curve(curve: Curve) -> Curve:
    """Return the same curve, traversed the other way."""
    match curve:
        case Segment(start, end):
            return Segment(end, start)
        case Arc(centre, radius, start_angle, end_angle):
            return Arc(centre, radius, end_angle, start_angle)
        case _:
            return TransformedCurve(curve, is_reversed=True)


def as_point(value: tuple[float, float], name: str) -> tuple[float, float]:
    """Return two finite floats; the error explains the form of `name`."""
    try:
        array = np.asarray(value, dtype=float)
    except (TypeError, ValueError):
        array = np.zeros(0)  # refused like any other wrong shape
    if array.shape != (2,) or not np.isfinite(array).all():
        raise GeometryError(f"{name} is {value}: give two finite numbers (x, y)")
    return float(array[0]), float(array[1])


def require_positive(owner: str, **lengths: float) -> None:
    """Raise unless every named length is finite and positive."""
    for name, value in lengths.items():
        if not (isinstance(value, Real) and 0.0 < value < np.inf):
            raise GeometryError(f"{owner}: {name} is {value!r}: give a positive finite length")


def _checked_values(name: str, values: FloatArray, s: FloatArray) -> FloatArray:
    values = np.asarray(values, dtype=float)
    if values.shape != (len(s), 2):
        raise GeometryError(
            f"ParametricCurve: {name} returned an array of shape {values.shape} for {len(s)} parameters: "
            f"return shape ({len(s)}, 2)"
        )
    is_bad = ~np.isfinite(values).all(axis=1)
    if is_bad.any():
        raise GeometryError(
            f"ParametricCurve: {name} is {format_point(values[is_bad][0])} at s={np.asarray(s)[is_bad][0]:.6g}: "
            "it must be finite on [0, 1]"
        )
    return values
