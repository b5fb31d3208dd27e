import re

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bemkit.errors import GeometryError
from bemkit.geometry.curves import ParametricCurve, Segment
from bemkit.geometry.meshing.discretise import Algebraic, Geometric, discretise, share_elements
from bemkit.geometry.outline import Outline, Selection, Side
from bemkit.geometry.shapes import Disk, PlateWithHole, Polygon, Rectangle, Ring
from tests.geometry.strategies import sizes, star_polygons

UNIT = Rectangle(1.0, 1.0).outline()


@given(st.lists(st.integers(1, 1000), min_size=1, max_size=20), st.integers(0, 500))
def test_shares_add_up_and_are_fair(lengths: list[int], extra: int) -> None:
    n = len(lengths) + extra
    counts = share_elements(n, np.array(lengths, dtype=float))
    assert counts.sum() == n
    assert counts.min() >= 1
    for i, j in np.argwhere(np.greater.outer(lengths, lengths)):
        assert counts[i] >= counts[j]
    if counts.min() > 1:  # where nobody is lifted to one element, the shares are the quotas but for rounding
        assert (np.abs(counts - n * np.array(lengths) / sum(lengths)) < 1.0).all()


def test_shares_of_equal_pieces_are_equal() -> None:
    assert share_elements(320, np.array([0.1 + 0.2, 0.3, 0.3, 0.3])).tolist() == [80] * 4
    assert share_elements(10, np.array([1e-9, 1.0, 1.0, 1.0])).tolist() == [1, 3, 3, 3]
    # ties go to the first, also where round-off makes one a little longer
    assert share_elements(6, np.array([0.3, 0.3, 0.1 + 0.2, 0.3])).tolist() == [2, 2, 1, 1]


def test_nodes_run_along_the_boundary() -> None:
    mesh = discretise(UNIT, n_elements=8)
    assert mesh.nodes.tolist() == [[0, 0], [0.5, 0], [1, 0], [1, 0.5], [1, 1], [0.5, 1], [0, 1], [0, 0.5]]
    assert mesh.elements.tolist() == [[0, 1], [1, 2], [2, 3], [3, 4], [4, 5], [5, 6], [6, 7], [7, 0]]
    assert not mesh.parts
    assert mesh.element_curve is None
    ring = discretise(Ring(1.0, 2.0).outline(), n_elements=12)
    assert np.array_equal(ring.elements[:, 0], np.arange(12))
    assert ring.elements[7].tolist() == [7, 0]
    assert ring.elements[11].tolist() == [11, 8]
    assert ring.nodes[0].tolist() == [2.0, 0.0]
    mixed = discretise(PlateWithHole(2, 1, 0.25).outline(), n_elements=12)
    assert mixed.element_curve.tolist() == [-1] * 8 + [0, 1, 2, 3]


@given(star_polygons(), sizes, st.integers(12, 60))
def test_number_of_elements_is_exact(vertices, size, n_elements) -> None:
    mesh = discretise(Polygon(tuple(map(tuple, (size * vertices).tolist()))).outline(), n_elements=n_elements)
    assert mesh.n_elements == n_elements
    corners = {tuple(vertex) for vertex in (size * vertices).tolist()}
    assert corners <= {tuple(node) for node in mesh.nodes.tolist()}


@given(st.floats(0.1, 0.45), st.floats(0.55, 0.9), st.integers(6, 40))
def test_parts_end_at_nodes(start: float, end: float, n_elements: int) -> None:
    parts = {
        "load": Selection(("top",), lambda x, y: (x > start) & (x < end)),
        "contact": Selection(("bottom",)),
        "clamp": Selection(("top",), lambda x, y: x <= start),
    }
    mesh = discretise(UNIT, n_elements=n_elements, parts=parts)
    assert list(mesh.parts) == ["load", "contact", "clamp"]
    expected = {"load": end - start, "contact": 1.0, "clamp": start}
    for name, length in expected.items():
        # breakpoints are rounded to 15 decimals
        assert mesh.lengths[mesh.part(name)].sum() == pytest.approx(length, abs=4e-15)
    assert (mesh.centres[mesh.part("load"), 1] == 1.0).all()


def test_part_over_several_sides_and_a_curve() -> None:
    mesh = discretise(Disk(2.0).outline(), n_elements=40, parts={"right": Selection(where=lambda x, y: x > 1.0)})
    # x > 1 on a circle of radius 2: 60 degrees on both sides of the axis
    assert mesh.lengths[mesh.part("right")].sum() == pytest.approx(2.0 * 2.0 * np.pi / 3.0, rel=1e-13)
    assert len(mesh.loops[0]) == 40


def test_grading_acts_on_every_piece() -> None:
    parts = {"load": Selection(("bottom",), lambda x, y: x < 0.5)}
    mesh = discretise(UNIT, n_elements=32, parts=parts, grading=Algebraic(2.0))
    assert np.allclose(mesh.lengths[:4] * 2, [0.125, 0.375, 0.375, 0.125], rtol=1e-15)
    assert np.allclose(mesh.lengths[4:8] * 2, [0.125, 0.375, 0.375, 0.125], rtol=1e-15)


def test_elements_of_an_uneven_parameter_are_even() -> None:
    # y = 0 traversed as s**2 from 1: the speed varies from 0.1 to 2.1
    rail = ParametricCurve(
        lambda s: np.column_stack([(0.1 * s + s**2) / 1.1, -0.1 * np.sin(np.pi * (0.1 * s + s**2) / 1.1)]),
        lambda s: np.column_stack(
            [
                (0.1 + 2 * s) / 1.1,
                -0.1 * np.pi * np.cos(np.pi * (0.1 * s + s**2) / 1.1) * (0.1 + 2 * s) / 1.1,
            ]
        ),
    )
    sides = (Side("rail", rail), Side("a", Segment((1.0, 0.0), (0.5, 1.0))), Side("b", Segment((0.5, 1.0), (0.0, 0.0))))
    mesh = discretise(Outline((sides,)), n_elements=60, parts={"rail": Selection(("rail",))})
    lengths = mesh.lengths[mesh.part("rail")]
    # the inverse of the arc length is interpolated between 257 points
    assert np.allclose(lengths, lengths.mean(), rtol=1e-3)
    # cut in two, the pieces join and end where the side ends, to the last digit
    parts = {"begin": Selection(("rail",), lambda x, y: x < 0.3), "rest": Selection(("rail",), lambda x, y: x > 0.3)}
    cut = discretise(Outline((sides,)), n_elements=60, parts=parts)
    spans = cut.element_span[np.concatenate([cut.part("begin"), cut.part("rest")])]
    assert spans[0, 0] == 0.0
    assert np.array_equal(spans[1:, 0], spans[:-1, 1])
    assert spans[-1, 1] == 1.0


def test_density_divides_a_side_more_finely() -> None:
    mesh = discretise(UNIT, n_elements=70, parts={"low": Selection(("bottom",))}, density={"bottom": 4.0})
    assert len(mesh.part("low")) == 40


def test_part_density_divides_a_part_more_finely() -> None:
    low = {"low": Selection(("bottom",), lambda x, y: x < 0.5)}
    mesh = discretise(UNIT, n_elements=75, parts=low, density={"bottom": 2.0}, part_density={"low": 2.0})
    assert mesh.part("low").size == 25  # lengths times densities: 2 of 6
    assert discretise(UNIT, n_elements=75, parts=low, part_density={"other": 2.0}).part("low").size == 9


class Backwards:
    """A grading that does not increase."""

    def positions(self, n):
        return np.linspace(1.0, 0.0, n + 1)

    def __repr__(self) -> str:
        return "Backwards()"


BOTTOM, TOP = Selection(("bottom",)), Selection(("top",))
REFUSED = {
    "too few": (
        lambda: discretise(UNIT, n_elements=4, parts={"load": Selection(("top",), lambda x, y: x < 0.3)}),
        "n_elements is 4, but the outline has 5 pieces (sides, cut where parts end): give a whole number of at least 5",
    ),
    "not whole": (lambda: discretise(UNIT, n_elements=8.0), "n_elements is 8.0, but the outline has 4 pieces"),
    "unknown side": (
        lambda: discretise(UNIT, n_elements=8, parts={"load": Selection(("lid",))}),
        "part 'load' names the side 'lid': the sides are 'bottom', 'right', 'top', 'left'",
    ),
    "empty": (
        lambda: discretise(UNIT, n_elements=8, parts={"load": Selection(("top",), lambda x, y: y < 0.5)}),
        "part 'load' is empty: its predicate holds at none of 257 points along each of the sides 'top'; widen it",
    ),
    "overlap": (
        lambda: discretise(UNIT, n_elements=8, parts={"a": BOTTOM, "b": Selection(where=lambda x, y: x < 0.4)}),
        "parts 'a' and 'b' overlap on side 'bottom', at (0.2, 0): restrict one of them",
    ),
    "all twice": (
        lambda: discretise(UNIT, n_elements=8, parts={"a": Selection(), "b": TOP}),
        "parts 'a' and 'b' overlap",
    ),
    "bad grading": (
        lambda: discretise(UNIT, n_elements=8, grading=Backwards()),
        "Backwards() does not place 2 elements on a piece: its positions(2) must increase strictly from 0 to 1",
    ),
    "too much grading": (
        lambda: discretise(UNIT, n_elements=80, grading=Algebraic(20.0)),
        "Algebraic(exponent=20.0) does not place 20 elements on a piece",
    ),
    "graded below round-off": (
        lambda: discretise(UNIT, n_elements=400, grading=Geometric(0.5, 49)),
        "no more than the round-off of its coordinates: join its nodes, grade less",
    ),
    "density of no side": (
        lambda: discretise(UNIT, n_elements=8, density={"lid": 2.0}),
        "density names the side 'lid': the sides are bottom, right, top, left",
    ),
    "negative density": (
        lambda: discretise(UNIT, n_elements=8, density={"top": -2.0}),
        "the density of side 'top' is -2.0: give a positive, finite number",
    ),
}


@pytest.mark.parametrize(("make", "message"), REFUSED.values(), ids=REFUSED)
def test_refused(make, message: str) -> None:
    with pytest.raises(GeometryError, match=re.escape(message)):
        make()
