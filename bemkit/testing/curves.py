"""Conformance of curves."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from bemkit.arrays import FloatArray
from bemkit.geometry.curves import Curve
from bemkit.geometry.vectors import cross, norms
from bemkit.testing.failure import demand, evaluated


def check_curve(curve: Curve, *, seed: int = 0) -> None:
    """Check everything that `Curve` promises; call it on your own curve.

    Parameters
    ----------
    curve : Curve
    seed : int
        Of the parameters tried.

    Raises
    ------
    CheckFailed
        Naming the curve, the promise broken, where, and by how much.
    """
    name = type(curve).__name__
    s = np.sort(np.concatenate([[0.0, 1.0], np.random.default_rng(seed).uniform(0.0, 1.0, 40)]))
    demand(isinstance(curve.is_straight, bool), f"{name}.is_straight is {curve.is_straight!r}, not a bool")
    points, derivatives = (_evaluated(method, name, s) for method in (curve.point, curve.derivative))
    speed = norms(derivatives)
    slowest = int(np.argmin(speed))
    demand(speed[slowest] > 0.0, f"{name}.derivative vanishes at s = {s[slowest]:.6g}")
    _check_derivative(curve, name, s[1:-1], derivatives[1:-1])
    if curve.is_straight:
        chord = points[-1] - points[0]
        away = np.abs(cross(points - points[0], np.broadcast_to(chord, points.shape))) / norms(chord)
        worst = int(np.argmax(away))
        # round-off of the coordinates
        tolerance = 1e-13 * (float(np.abs(points).max()) + float(norms(chord)))
        demand(
            away[worst] <= tolerance, f"{name} says it is straight, but strays by {away[worst]:.3g} at s = {s[worst]:g}"
        )


def _evaluated(method: Callable[[FloatArray], FloatArray], name: str, s: FloatArray) -> FloatArray:
    label = f"{name}.{method.__name__}"
    values = evaluated(label, method, s, (s.size, 2))
    one_by_one = np.concatenate([method(s[k : k + 1]) for k in range(s.size)])
    difference = float(np.abs(one_by_one - values).max())
    # vectorised functions may round differently from their scalar form
    demand(
        difference <= 1e-14 * (1e-300 + float(np.abs(values).max())),
        f"{label} at one parameter depends on the others: it differs by {difference:.3g}",
    )
    return values


def _check_derivative(curve: Curve, name: str, s: FloatArray, derivative: FloatArray) -> None:
    step = 1e-4 * np.minimum(1.0, np.minimum(s, 1.0 - s) / 1e-3)  # central differences that stay in [0, 1]
    difference = (curve.point(s + step) - curve.point(s - step)) / (2.0 * step)[:, None]
    error = norms(difference - derivative)
    size = float(norms(derivative).max())
    # relative truncation step^2, and the round-off of coordinates far from the origin over the step
    slack = 1e-5 * size + 1e-15 * float(np.abs(curve.point(s)).max()) / step
    worst = int(np.argmax(error - slack))
    demand(
        error[worst] <= slack[worst],
        f"{name}.derivative is {derivative[worst]} at s = {s[worst]:.6g}, but differences of point give "
        f"{difference[worst]}",
    )
