"""Curves by arc length: lengths, inverse and constant speed to round-off, and a named error for other parameters."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest
from scipy.special import ellipe, ellipeinc

from bemkit.arrays import FloatArray
from bemkit.geometry import BoundaryMesh, GeometryError
from bemkit.geometry.curves import ParametricCurve
from bemkit.geometry.free_form.arc_length import ArcLength


def ellipse(a: float, b: float) -> ParametricCurve:
    return ParametricCurve(
        lambda p: np.column_stack([a * np.cos(2 * np.pi * p), b * np.sin(2 * np.pi * p)]),
        lambda p: 2 * np.pi * np.column_stack([-a * np.sin(2 * np.pi * p), b * np.cos(2 * np.pi * p)]),
    )


@pytest.mark.parametrize(("a", "b"), [(2.0, 1.0), (10.0, 1.0), (1.0, 1e-2), (1e-6, 2e-6)])
def test_ellipses_against_elliptic_integrals(a: float, b: float) -> None:
    arc_length = ArcLength(ellipse(a, b).derivative_function)
    total = 4 * a * ellipe(1 - (b / a) ** 2)
    assert arc_length.total == pytest.approx(total, rel=1e-14)  # a sum of a few dozen pieces
    fractions = np.linspace(0.0, 1.0, 201)
    angle = 2 * np.pi * arc_length.parameter(fractions)
    reached = b * ellipeinc(angle, 1 - (a / b) ** 2)
    np.testing.assert_allclose(reached, fractions * total, rtol=0.0, atol=1e-14 * total)


def test_parametric_curves_run_at_constant_speed_along_the_same_points() -> None:
    curve = ellipse(3.0, 0.5)
    s = np.linspace(0.0, 1.0, 101)
    derivative = curve.derivative(s)
    assert np.ptp(np.hypot(*derivative.T)) < 1e-14 * np.hypot(*derivative[0])
    x, y = curve.point(s).T
    np.testing.assert_allclose((x / 3.0) ** 2 + (y / 0.5) ** 2, 1.0, rtol=1e-14)
    # equal steps of s cover equal lengths: chords differ by the square of the curvature times the step only
    fine = np.linspace(0.0, 1.0, 40_001)
    steps = np.hypot(*np.diff(curve.point(fine), axis=0).T)
    assert np.ptp(steps) < 1e-5 * steps.mean()


def test_a_speed_that_jumps_is_cornered() -> None:
    arc_length = ArcLength(lambda p: np.column_stack([np.where(p < 0.3, 1.0, 2.0), 0.0 * p]))
    assert arc_length.total == pytest.approx(1.7, abs=1e-8)  # the jump is known to 2**-30 of the curve
    assert arc_length.parameter(np.array([0.5]))[0] == pytest.approx(0.3 + 0.55 / 2, abs=1e-8)


@dataclass(frozen=True)
class Hurrying:
    """The upper half of the unit circle, traversed faster and faster."""

    is_straight: bool = False

    def point(self, s: FloatArray) -> FloatArray:
        angle = np.pi * s * (0.5 + 0.5 * s)
        return np.column_stack([np.cos(angle), np.sin(angle)])

    def derivative(self, s: FloatArray) -> FloatArray:
        angle = np.pi * s * (0.5 + 0.5 * s)
        return (np.pi * (0.5 + s))[:, None] * np.column_stack([-np.sin(angle), np.cos(angle)])


def test_a_curve_of_ones_own_must_run_at_constant_speed() -> None:
    def mesh_along(curve: Hurrying | ParametricCurve) -> BoundaryMesh:
        nodes = np.vstack([curve.point(np.array([0.0, 0.5, 1.0])), [(0.0, -1.0)]])
        elements = np.column_stack([np.arange(4), (np.arange(4) + 1) % 4])
        span = np.array([[0.0, 0.5], [0.5, 1.0], [0.0, 0.0], [0.0, 0.0]])
        return BoundaryMesh(nodes, elements, {}, (curve,), np.array([0, 0, -1, -1]), span)

    curve = Hurrying()
    with pytest.raises(GeometryError, match=r"element 0 follows curve 0 with speeds .* use ParametricCurve\("):
        mesh_along(curve)
    mesh = mesh_along(ParametricCurve(curve.point, curve.derivative))
    np.testing.assert_allclose(mesh.lengths[:2], np.pi / 2, rtol=1e-14)
