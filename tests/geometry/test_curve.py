import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bemkit.errors import GeometryError
from bemkit.geometry.curves import Arc, Curve, ParametricCurve, Segment, TransformedCurve, reverse_curve, scaled_curve
from bemkit.testing import check_curve


def ellipse(a: float = 2.0, b: float = 1.0) -> ParametricCurve:
    return ParametricCurve(
        lambda s: np.column_stack([a * np.cos(2 * np.pi * s), b * np.sin(2 * np.pi * s)]),
        lambda s: 2 * np.pi * np.column_stack([-a * np.sin(2 * np.pi * s), b * np.cos(2 * np.pi * s)]),
    )


CURVES = {
    "segment": Segment((0.25, -1.0), (3.0, 2.0)),
    "arc": Arc((1.0, 2.0), 3.0, 0.3, -1.2),
    "ellipse": ellipse(),
    "moved": scaled_curve(ellipse(), (1.0, -2.0), (0.25, 0.25), is_reversed=True),
}


@pytest.mark.parametrize("curve", CURVES.values(), ids=CURVES)
def test_derivative_is_the_limit_of_differences(curve: Curve) -> None:
    s, step = np.linspace(0.1, 0.9, 17), 1e-5
    differences = (curve.point(s + step) - curve.point(s - step)) / (2 * step)
    # truncation step**2 times a third derivative below 1e3, and round-off 1e-16 / step
    assert np.allclose(curve.derivative(s), differences, rtol=0.0, atol=1e-6)


@pytest.mark.parametrize("curve", CURVES.values(), ids=CURVES)
def test_reversed_curve_runs_back(curve: Curve) -> None:
    s = np.linspace(0.0, 1.0, 9)
    back = reverse_curve(curve)
    assert back.is_straight == curve.is_straight
    # the angle of an arc and 1 - s are rounded: a few units in the last place of coordinates below 10
    assert np.allclose(back.point(s), curve.point(1.0 - s), rtol=0.0, atol=1e-14)
    assert np.allclose(back.derivative(s), -curve.derivative(1.0 - s), rtol=0.0, atol=1e-13)


def test_segment_meets_its_ends_exactly() -> None:
    segment = Segment((0.1, 0.7), (1e9, -0.3))
    assert segment.point(np.array([0.0, 1.0])).tolist() == [[0.1, 0.7], [1e9, -0.3]]
    assert segment.is_straight


@given(st.floats(0.1, 10.0), st.floats(-6.0, 6.0), st.floats(0.01, 6.28))
def test_arc_is_anticlockwise_if_the_angle_grows(radius: float, start: float, sweep: float) -> None:
    arc = Arc((1.0, -1.0), radius, start, start + sweep)
    s = np.linspace(0.0, 1.0, 5)
    arm, velocity = arc.point(s) - [1.0, -1.0], arc.derivative(s)
    assert np.allclose(np.hypot(*arm.T), radius, rtol=1e-14)
    # cross product of arm and velocity: radius**2 times the angular speed
    assert np.allclose(arm[:, 0] * velocity[:, 1] - arm[:, 1] * velocity[:, 0], radius**2 * sweep, rtol=1e-12)
    assert not arc.is_straight


def test_moved_curve_is_shifted_then_scaled() -> None:
    moved = scaled_curve(Segment((1.0, 1.0), (2.0, 1.0)), (1.0, 0.5), (10.0, 10.0))
    assert moved.point(np.array([0.0, 1.0])).tolist() == [[0.0, 5.0], [10.0, 5.0]]
    assert moved.is_straight


def test_a_transformed_curve_keeps_what_is_known_of_the_original() -> None:
    turned = TransformedCurve(ellipse(), (1e3, 0.0), ((0.0, -2.0), (2.0, 0.0)), (0.0, 50.0))
    assert turned.point(np.array([0.0])).tolist() == [[0.0, 2.0 * (2.0 - 1e3) + 50.0]]
    assert turned.magnitude == pytest.approx(2.0 * (2.0 + 1e3) + 50.0)
    smooth = ellipse()
    rough = ParametricCurve(smooth.function, smooth.derivative_function, is_analytic=False)
    assert turned.is_analytic
    assert not scaled_curve(reverse_curve(rough), (0.0, 0.0), (1.0, 1.0)).is_analytic


def test_a_curve_of_ones_own_inherits_what_it_does_not_state() -> None:
    class Own(Curve):
        is_straight = True

        def point(self, s):
            return np.column_stack([3.0 * s, 0.0 * s])

        def derivative(self, s):
            return np.column_stack([3.0 + 0.0 * s, 0.0 * s])

    assert Own().is_analytic
    assert Own().magnitude == 3.0
    check_curve(Own())


def line(s):
    return np.column_stack([s, 0.0 * s])


def constant(s):
    return np.column_stack([1.0 + 0.0 * s, 0.0 * s])


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: Segment((1.0, 2.0), (1.0, 2.0)), r"start and end are the same point \(1.0, 2.0\): give two different"),
        (lambda: Segment((np.nan, 2.0), (1.0, 2.0)), r"Segment: start is .*nan.*: give two finite numbers"),
        (lambda: Segment((1.0, 2.0), (1.0, 2.0, 3.0)), r"Segment: end is \(1.0, 2.0, 3.0\): give two finite"),
        (lambda: Arc((0.0, 0.0), -1.0, 0.0, 1.0), r"Arc: radius is -1.0: give a positive"),
        (lambda: Arc((0.0, np.inf), 1.0, 0.0, 1.0), r"Arc: centre is \(0.0, inf\): give two finite"),
        (lambda: Arc((0.0, 0.0), 1.0, 2.0, 2.0), r"start_angle=2.0 to end_angle=2.0 is not an arc: give angles"),
        (lambda: Arc((0.0, 0.0), 1.0, 0.0, 90.0), r"end_angle=90.0 is not an arc: give angles in radians"),
        (lambda: Arc((0.0, 0.0), 1.0, 0.0, np.nan), r"end_angle=nan is not an arc"),
        (
            lambda: ParametricCurve(line, lambda s: 2.0 * constant(s)),
            r"function moves by \(0.125, 0\), but .*\(0.25, 0\)",
        ),
        (lambda: ParametricCurve(line, lambda s: -constant(s)), r"give the derivative of function with respect to s"),
        (lambda: ParametricCurve(line, lambda s: 0.0 * constant(s)), r"vanishes at s=.*: choose a parameter"),
        (lambda: ParametricCurve(line, lambda s: s), r"derivative_function returned an array of shape \(64,\) for 64"),
        (
            lambda: ParametricCurve(lambda s: line(s) / 0.0, constant),
            r"function is \(nan, nan\) at s=0: it must be finite",
        ),
    ],
)
@pytest.mark.filterwarnings("ignore:divide by zero:RuntimeWarning", "ignore:invalid value:RuntimeWarning")
def test_refused(make, message: str) -> None:
    with pytest.raises(GeometryError, match=message):
        make()


def test_closed_curve_with_a_derivative_of_the_wrong_size_is_refused() -> None:
    right = ellipse()
    with pytest.raises(GeometryError, match=r"give the derivative of function"):
        ParametricCurve(right.function, lambda s: 1.1 * right.derivative_function(s))
