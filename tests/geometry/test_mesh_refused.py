import re

import numpy as np
import pytest

from bemkit.errors import GeometryError
from bemkit.geometry.curves import Arc
from bemkit.geometry.mesh import BoundaryMesh
from bemkit.geometry.meshing.discretise import discretise
from bemkit.geometry.shapes import Rectangle

from .strategies import closed, rotation

SQUARE = [[0, 0], [1, 0], [1, 1], [0, 1]]
INNER = [[0.25, 0.25], [0.25, 0.75], [0.75, 0.75], [0.75, 0.25]]
ARCS = (Arc((0, 0), 1, 0, np.pi), Arc((0, 0), 1, np.pi, 2 * np.pi))
TWO_LOOPS = np.concatenate([closed(4), closed(4, 4)])


def disk(curves=ARCS, index=(0, 1), span=((0, 1), (0, 1))) -> BoundaryMesh:
    return BoundaryMesh([[1, 0], [-1, 0]], closed(2), {}, curves, index, span)


def with_parts(**parts) -> BoundaryMesh:
    return BoundaryMesh(SQUARE, closed(4), parts)


def refine(marked) -> BoundaryMesh:
    return discretise(Rectangle(1, 1).outline(), n_elements=8).refined(marked)


REFUSED = {
    "shape of nodes": (
        lambda: BoundaryMesh([1.0, 2.0], closed(2)),
        "nodes has shape (2,): give an array of shape (n, 2)",
    ),
    "no elements": (lambda: BoundaryMesh(SQUARE, np.zeros((0, 2), int)), "elements has shape (0, 2): give an array"),
    "float elements": (
        lambda: BoundaryMesh(SQUARE, closed(4) * 1.0),
        "elements is an array of float64: give an array of",
    ),
    "not finite": (
        lambda: BoundaryMesh([[0, 0], [1, np.nan], [0, 1]], closed(3)),
        "node 1 is (1, nan): coordinates must be finite",
    ),
    "no such node": (
        lambda: BoundaryMesh(SQUARE, closed(5)),
        "element 3 joins nodes [3, 4], but there are 4 nodes: use numbers from 0 to 3",
    ),
    "open": (
        lambda: BoundaryMesh(SQUARE, closed(4)[:3]),
        "node 0 at (0, 0) starts 1 and ends 0 elements: each node must start one and end one, so that the boundary",
    ),
    "turned element": (
        lambda: BoundaryMesh(SQUARE, [[0, 1], [2, 1], [2, 3], [3, 0]]),
        "node 1 at (1, 0) starts 0 and ends 2 elements",
    ),
    "unused node": (
        lambda: BoundaryMesh([*SQUARE, [9, 9]], closed(4)),
        "node 4 at (9, 9) starts 0 and ends 0 elements",
    ),
    "element to itself": (
        lambda: BoundaryMesh(SQUARE, [[0, 0], [1, 2], [2, 3], [3, 1]]),
        "element 0, from (0, 0) to (0, 0), has length 0, no more than the round-off of its coordinates: join its nodes",
    ),
    "no length": (
        lambda: BoundaryMesh([[0, 0], [1, 0], [1, 0], [0, 1]], closed(4)),
        "element 1, from (1, 0) to (1, 0), has length 0",
    ),
    "length of round-off": (
        lambda: BoundaryMesh([[0, 0], [1, 0], [1, 1e-15], [0, 1]], closed(4)),
        "element 1, from (1, 0) to (1, 1e-15), has length 1e-15, no more than the round-off",
    ),
    "same point": (
        lambda: BoundaryMesh([[0, 0], [1, -1], [2, 0], [1, 1], [0, 0], [-1, 0.5]], closed(6)),
        "nodes 0 and 4 are the same point (0, 0): a boundary must not touch itself; move them apart",
    ),
    "crossing": (
        lambda: BoundaryMesh([[0, 0], [1, 1], [1, 0], [0, 1]], closed(4)),
        "element 0, from (0, 0) to (1, 1) and element 2, from (1, 0) to (0, 1) cross, touch or fold back",
    ),
    "touching": (
        lambda: BoundaryMesh([[0, 0], [2, 0], [2, 1], [1, 0], [0, 1]], closed(5)),
        "element 0, from (0, 0) to (2, 0) and element 2, from (2, 1) to (1, 0) cross, touch",
    ),
    "fold back": (
        lambda: BoundaryMesh([[0, 0], [2, 0], [1, 0], [1, 1]], closed(4)),
        "element 0, from (0, 0) to (2, 0) and element 2, from (1, 0) to (1, 1) cross, touch or fold back",
    ),
    "twice the same": (lambda: BoundaryMesh([[0, 0], [1, 0]], closed(2)), "cross, touch or fold back"),
    "clockwise": (
        lambda: BoundaryMesh(SQUARE[::-1], closed(4)),
        "the outer loop of 4 elements through element 0 runs clockwise: list its vertices anticlockwise",
    ),
    "hole anticlockwise": (
        lambda: BoundaryMesh(SQUARE + INNER[::-1], TWO_LOOPS),
        "loop of 4 elements through element 4 runs anticlockwise inside or beside the outer loop of 4 elements",
    ),
    "hole beside": (
        lambda: BoundaryMesh(SQUARE + [[x + 5, y] for x, y in INNER], TWO_LOOPS),
        "loop of 4 elements through element 4 is a hole that lies outside of the outer loop",
    ),
    "loops cross": (
        lambda: BoundaryMesh(SQUARE + [[x + 0.5, y] for x, y in INNER], TWO_LOOPS),
        "element 1, from (1, 0) to (1, 1) and element 5, from (0.75, 0.75) to (1.25, 0.75) cross, touch",
    ),
    "exterior": (
        lambda: BoundaryMesh(SQUARE, closed(4), is_exterior=True),
        "runs anticlockwise, but the body lies outside of it (is_exterior=True): list its vertices clockwise",
    ),
    "span missing": (
        lambda: disk(span=None),
        "of element_curve and element_span one is missing: give both or neither",
    ),
    "shape of span": (lambda: disk(span=(0, 1)), "element_curve has shape (2,) and element_span (2,) for 2 elements"),
    "no such curve": (
        lambda: disk(index=(0, 2)),
        "element 1 follows curve 2 of 2 curves: use the index of a curve, or -1 for a straight element",
    ),
    "float curve": (lambda: disk(index=(0.0, 1.0)), "element_curve is an array of float64: give an array of integers"),
    "span backwards": (
        lambda: disk(span=((0, 1), (1, 0))),
        "element 1 has the span [1.0, 0.0] on its curve: give an increasing pair of parameters in [0, 1]",
    ),
    "span not finite": (lambda: disk(span=((0, np.nan), (0, 1))), "element 0 has the span [0.0, nan] on its curve"),
    "wrong span": (
        lambda: disk(span=((0, 0.5), (0, 1))),
        "element 0, from (1, 0) to (-1, 0), has ends 1.41 away from the points of its curve at [0.0, 0.5]: correct",
    ),
    "curve crosses chord": (
        lambda: BoundaryMesh(
            [[1, 0], [-1, 0], [0, 2]], closed(3), {}, (Arc((0, 0), 1, 0, np.pi),), [0, -1, -1], [[0, 1]] * 3
        ),
        "cross, touch or fold back",
    ),
    "overlapping parts": (
        lambda: with_parts(a=[0, 1], b=[3, 1]),
        "element 1 is in the parts 'a' and 'b': parts must not overlap",
    ),
    "part out of range": (lambda: with_parts(a=[4]), "part 'a' contains element 4: use numbers from 0 to 3"),
    "part below range": (lambda: with_parts(a=[-1, 1]), "part 'a' contains element -1: use numbers from 0 to 3"),
    "element twice": (lambda: with_parts(a=[2, 0, 2]), "part 'a' contains element 2 twice: list it once"),
    "empty part": (lambda: with_parts(a=[]), "part 'a' has 0 elements: give parts a name and at least one element"),
    "nameless part": (lambda: with_parts(**{"": [1]}), "part '' has 1 elements: give parts a name"),
    "mask for part": (
        lambda: with_parts(a=[True, False, True, True]),
        "part 'a' is an array of bool: give an array of",
    ),
    "marked out of range": (lambda: refine([0, 8]), "marked contains elements from 0 to 8: use numbers from 0 to 7"),
    "marked by mask": (lambda: refine(np.ones(8, dtype=bool)), "marked is an array of bool: give an array of integers"),
    "factor": (lambda: refine([0]).transformed((0, 0), -1.0), "BoundaryMesh: factor is -1.0: give a positive"),
    "shift": (lambda: refine([0]).transformed((0, 0, 0)), "BoundaryMesh: shift is (0, 0, 0): give two finite numbers"),
}


@pytest.mark.parametrize(("make", "message"), REFUSED.values(), ids=REFUSED)
def test_refused(make, message: str) -> None:
    with pytest.raises(GeometryError, match=re.escape(message)):
        make()


def sagging(sag: float) -> BoundaryMesh:
    """Return a strip 0.05 high whose upper side is one arc that sags."""
    radius = (0.25 + sag**2) / (2 * sag)
    half = np.arcsin(0.5 / radius)
    arc = Arc((0.5, 0.05 + radius - sag), radius, -np.pi / 2 + half, -np.pi / 2 - half)
    nodes = [[0, 0], [1, 0], [1, 0.05], [0, 0.05]]
    return BoundaryMesh(nodes, closed(4), {}, (arc,), [-1, -1, 0, -1], [[0, 1]] * 4)


def test_bent_element_is_seen_where_it_is_and_not_where_its_chord_is() -> None:
    assert sagging(0.0499).area == pytest.approx(0.05 - 2 / 3 * 0.0499, rel=5e-3)  # a flat arc is nearly a parabola
    for sag in (0.05, 0.0501):
        with pytest.raises(GeometryError, match=r"element 0, .* and element 2, .* cross, touch"):
            sagging(sag)


def test_bent_element_that_leaves_a_joint_to_cross_its_neighbour_is_seen() -> None:
    # it starts below the straight element, whose end it joins, and ends above
    arc = Arc((0.5 * np.sin(0.2), 0.5 * np.cos(0.2)), 0.5, -np.pi / 2 - 0.2, -np.pi / 2 + 0.4)
    end = arc.point(np.array([1.0]))[0].tolist()
    nodes = [[1, 0], [0, 0], end, [1, 1]]
    with pytest.raises(GeometryError, match=r"element 0, .* and element 1, .* cross, touch or fold back"):
        BoundaryMesh(nodes, closed(4), {}, (arc,), [-1, 0, -1, -1], [[0, 1]] * 4)


@pytest.mark.parametrize("scale", [1e-9, 1.0, 1e9])
@pytest.mark.parametrize("angle", [0.0, 1.0])
@pytest.mark.parametrize("place", [0.0, 1e6])
def test_touching_is_refused_and_near_is_not_wherever_the_body_is(scale: float, angle: float, place: float) -> None:
    def notched(tip: float) -> BoundaryMesh:
        nodes = np.array([[0, 0], [2, 0], [2, 1], [1, tip], [0, 1]]) @ rotation(angle).T + [place, -place]
        return BoundaryMesh(scale * nodes, closed(5))

    notched(1e-6)  # 1e6 away the last digit of the coordinates is 1e-10 of the body
    for tip in (0.0, -1e-6, -0.5):
        with pytest.raises(GeometryError, match=r"cross, touch or fold back"):
            notched(tip)
