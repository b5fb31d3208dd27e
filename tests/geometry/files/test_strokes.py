"""Joining strokes: any order and sense, names, and curves drawn backwards."""

from __future__ import annotations

import numpy as np
import pytest

from bemkit.geometry.files.strokes import Stroke, StrokeSide, join_strokes, named_loops
from bemkit.geometry.free_form.drawn import ArcTo, LineTo, NurbsTo, OutlineShape, SplineTo
from bemkit.geometry.meshing.discretise import discretise
from tests.slow import slow_except

SIDES: list[StrokeSide] = [
    LineTo((1.0, 0.0)),
    ArcTo((1.0, 1.0), (1.5, 0.5)),
    SplineTo((0.0, 1.0), ((0.7, 1.1), (0.2, 1.05))),
    NurbsTo((0.0, 0.0), ((-0.1, 0.9), (-0.4, 0.3), (-0.1, 0.1)), 3, (0, 0, 0, 0, 0.3, 1, 1, 1, 1), (1, 2, 1, 1, 1)),
]
STROKES = [Stroke(start, side) for start, side in zip([SIDES[k - 1].to for k in range(4)], SIDES, strict=True)]


@pytest.mark.parametrize("seed", slow_except(range(5), 0, 1))
def test_any_order_and_sense(seed: int) -> None:
    random = np.random.default_rng(seed)
    mixed = [STROKES[k] if random.random() < 0.5 else STROKES[k].reversed() for k in random.permutation(4)]
    loops, notes = join_strokes(mixed, 1e-9)
    shape = OutlineShape(named_loops(loops))
    assert notes == []
    assert [type(side) for side in shape.loops[0].sides] == [type(side) for side in SIDES]
    straight = OutlineShape(named_loops([STROKES]))
    own, exact = (discretise(each.outline(), n_elements=80).area for each in (shape, straight))
    assert own == pytest.approx(exact, rel=1e-12)


@pytest.mark.parametrize("stroke", STROKES)
def test_backwards_is_the_same_curve(stroke: Stroke) -> None:
    forth, back = stroke.points, stroke.reversed().points[::-1]
    assert (
        np.abs(forth - back).max() < 1e-9
    )  # speeds and their integrals are known to round-off, knots cost a few digits
    moved = stroke.mapped(lambda p: (2.0 * p[0] + 1.0, 2.0 * p[1]))
    assert np.abs(moved.points - (2.0 * forth + [1.0, 0.0])).max() < 1e-9


def test_names_are_kept_numbered_or_made() -> None:
    groups = ["wall", "foot", "wall", "side-4"]
    sides = [
        LineTo(to, group=group)
        for to, group in zip([(1.0, 0.0), (1.0, 1.0), (0.0, 1.0), (0.0, 0.0)], groups, strict=True)
    ]
    square = [Stroke(sides[k - 1].to, sides[k]) for k in range(4)]
    (loop,) = named_loops([square])
    assert [(side.name, side.group) for side in loop.sides] == [
        ("wall-1", "wall"),
        ("foot", ""),
        ("wall-2", "wall"),
        ("side-4", ""),
    ]
    unnamed = [Stroke(each.start, LineTo(each.end, group="side-1" if k == 2 else "")) for k, each in enumerate(square)]
    (loop,) = named_loops([unnamed])
    assert [side.name for side in loop.sides] == ["side-1'", "side-2", "side-1", "side-4"]
    layer = [Stroke(each.start, LineTo(each.end, group="outline")) for each in square]
    (loop,) = named_loops([layer])
    assert [(side.name, side.group) for side in loop.sides] == [(f"side-{k}", "outline") for k in range(1, 5)]
