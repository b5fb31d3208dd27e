"""Which bodies of an assembly its symmetry lines cross, and which lie beyond them."""

from __future__ import annotations

import numpy as np

from bemkit.arrays import FloatArray
from bemkit.errors import InputError
from bemkit.geometry.placement import Placement
from bemkit.geometry.symmetry import Symmetry
from bemkit.scene.body import Body

_ALONG = np.linspace(0.0, 1.0, 33)
"""Parameters of curves at which the extent of a body is taken."""
_ON_LINE = 1e-9
"""Share of its size by which a body that ends on a symmetry line may cross it by round-off."""


def lines_across(body: Body, symmetry: Symmetry | None) -> Symmetry | None:
    """Return those of some symmetry lines that cross a placed body; None if there is none."""
    if symmetry is None:
        return None
    low, high = _extent(body)
    margin = _ON_LINE * float((high - low).max())
    places = zip((symmetry.x, symmetry.y), (low + margin).tolist(), (high - margin).tolist(), strict=True)
    x, y = (place if place is not None and below < place < above else None for place, below, above in places)
    return None if x is None and y is None else Symmetry(x, y)


def check_place(body: Body, symmetry: Symmetry) -> None:
    """Refuse a placed body that lies beyond a symmetry line, and one that a line crosses away from where it was drawn.

    Raises
    ------
    InputError
    """
    crossing = lines_across(body, symmetry)
    if crossing is not None and body.placement != Placement():
        raise InputError(f"body {body.name!r} has a placement, and {crossing} halves it: draw it in its place")
    middle = _extent(body).mean(axis=0)
    others = (line for line in symmetry.lines if crossing is None or line not in crossing.lines)
    if any(line.is_beyond(middle) for line in others):
        raise InputError(
            f"body {body.name!r} lies beyond the symmetry line {symmetry}: its image stands for it, leave it out"
        )


def _extent(body: Body) -> FloatArray:
    """Return the smallest and the largest coordinates, (2, 2) [m], of a placed body."""
    curves = [side.curve for loop in body.shape.outline().loops for side in loop]
    points = body.placement.forward(np.concatenate([curve.point(_ALONG) for curve in curves]))
    return np.array([points.min(axis=0), points.max(axis=0)])
