import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from bemkit.geometry.pieces import (
    find_meeting,
    make_pieces,
    overlapping_boxes,
    point_distances,
    segment_distances,
)

points = arrays(float, (150, 2), elements=st.integers(-20, 20).map(float))


@settings(max_examples=settings.default.max_examples // 3)
@given(points, points)
def test_overlapping_boxes_finds_what_comparing_all_pairs_finds(a, b) -> None:
    low, high = np.minimum(a, b), np.maximum(a, b)
    first, second = overlapping_boxes(low, high)
    meets = ((low[:, None] <= high) & (low <= high[:, None])).all(axis=2)
    assert set(zip(first.tolist(), second.tolist(), strict=True)) == {
        (i, j) for i, j in np.argwhere(meets).tolist() if i < j
    }


@pytest.mark.parametrize("n", [1, 2, 3, 64, 65, 131])
def test_overlapping_boxes_of_any_number(n: int) -> None:
    low = np.zeros((n, 2))
    first, _ = overlapping_boxes(low, low)
    assert len(first) == n * (n - 1) // 2


@pytest.mark.parametrize(
    ("c", "d", "distance"),
    [
        ((0.5, -1.0), (0.5, 1.0), 0.0),  # crosses
        ((0.5, 0.0), (0.5, 1.0), 0.0),  # touches
        ((0.5, 1e-9), (0.5, 1.0), 1e-9),
        ((1.0 + 1e-9, 0.0), (5.0, 0.0), 1e-9),  # goes on in the same line
        ((0.25, 0.0), (0.75, 0.0), 0.0),  # lies within
        ((2.0, 1.0), (2.0, -1.0), 1.0),
        ((0.0, 3.0), (1.0, 3.0), 3.0),
        ((4.0, 4.0), (7.0, 9.0), 5.0),
    ],
)
@pytest.mark.parametrize("scale", [1e-9, 1.0, 1e9])
def test_segment_distances(c, d, distance: float, scale: float) -> None:
    a, b, c, d = (scale * np.array([p]) for p in ((0.0, 0.0), (1.0, 0.0), c, d))
    for pair in ((a, b, c, d), (b, a, c, d), (c, d, a, b), (d, c, b, a)):
        # round-off of coordinates near 1: 1e-16 of the scale
        assert segment_distances(*pair)[0] == pytest.approx(distance * scale, abs=4e-16 * scale)


@settings(max_examples=settings.default.max_examples // 3)
@given(points, points, points, st.floats(0.0, 1.0))
def test_no_point_of_a_segment_is_nearer_than_the_distance(p, a, b, fraction: float) -> None:
    b = np.where((a == b).all(axis=1)[:, None], b + 1.0, b)
    distance = point_distances(p, a, b)
    between = np.hypot(*(p - (1.0 - fraction) * a - fraction * b).T)
    assert (distance <= between + 1e-14).all()  # round-off of coordinates up to 40
    assert (distance <= np.minimum(np.hypot(*(p - a).T), np.hypot(*(p - b).T))).all()


def test_pairs_are_settled_batch_by_batch() -> None:
    angle = 2.0 * np.pi * np.arange(120) / 120
    start = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    nothing = np.zeros(120, int)
    pieces = make_pieces((), start, np.roll(start, -1, axis=0), nothing - 1, np.zeros((120, 2)))
    assert find_meeting(pieces, np.roll(np.arange(120), -1), batch=4) is None
    folded = make_pieces((), start, start[(np.arange(120) + 60) % 120], nothing - 1, np.zeros((120, 2)))
    assert find_meeting(folded, np.roll(np.arange(120), -1), batch=4) is not None
