import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bemkit.errors import GeometryError
from bemkit.geometry.curves import Arc, Segment
from bemkit.geometry.outline import Selection, breakpoints, merge_breakpoints

BOTTOM = Segment((0.0, 0.0), (1.0, 0.0))


@given(st.floats(0.01, 0.99))
def test_breakpoint_is_found_to_round_off(place: float) -> None:
    found = breakpoints(BOTTOM, lambda x, y: x < place)
    assert len(found) == 1
    # rounded to 15 decimals
    assert abs(found[0] - place) < 1e-15


@given(st.integers(1, 255))
def test_open_and_closed_conditions_break_at_the_same_point(k: int) -> None:
    place = k / 256
    conditions = [lambda x, y: x < place, lambda x, y: x <= place, lambda x, y: x > place, lambda x, y: x >= place]
    assert {breakpoints(BOTTOM, where)[0] for where in conditions} == {round(place, 15)}


def test_several_breakpoints_on_an_arc() -> None:
    arc = Arc((0.0, 0.0), 2.0, 0.0, np.pi)
    found = breakpoints(arc, lambda x, y: abs(x) < 1.0)
    # |x| = 1 at 60 and 120 degrees; cos is rounded
    assert np.allclose(found, [1 / 3, 2 / 3], rtol=0.0, atol=1e-15)


@pytest.mark.parametrize(
    "where", [lambda x, y: x > 0.0, lambda x, y: x < 1.0, lambda x, y: x > -1.0, lambda x, y: True]
)
def test_ends_are_no_breakpoints(where) -> None:
    assert len(breakpoints(BOTTOM, where)) == 0


def test_merging_drops_ends_and_repetitions() -> None:
    merged = merge_breakpoints(np.array([1.0, 0.5, 0.0, 0.5 + 1e-15, 1e-16, 0.25]))
    assert merged.tolist() == [0.25, 0.5]


def test_selection_of_sides_and_points() -> None:
    points = np.array([[0.2, 0.0], [0.8, 0.0]])
    assert Selection().holds("top", points).tolist() == [True, True]
    assert Selection(("bottom",)).holds("top", points).tolist() == [False, False]
    assert Selection(("bottom",), lambda x, y: x > 0.5).holds("bottom", points).tolist() == [False, True]
    assert Selection(where=lambda x, y: x > 0.5).holds("any", points).tolist() == [False, True]


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: Selection("bottom"), r"sides is the string 'bottom': give a tuple, \('bottom',\)"),
        (lambda: breakpoints(BOTTOM, lambda x, y: x), r"where returned an array of float64 of shape \(257,\) for 257"),
        (
            lambda: breakpoints(BOTTOM, lambda x, y: x[:3] > 0),
            r"of bool of shape \(3,\) for 257 points: return booleans",
        ),
    ],
)
def test_refused(make, message: str) -> None:
    with pytest.raises(GeometryError, match=message):
        make()
