import numpy as np
import pytest

from bemkit.errors import GeometryError
from bemkit.geometry.curves import Arc, Curve, ParametricCurve, Segment, reverse_curve, scaled_curve
from bemkit.geometry.meshing.discretise import discretise
from bemkit.geometry.outline import Outline, Side
from tests.slow import slow_only

DOWN = -np.pi / 2 + np.pi / 32  # the middle of one of the 16 pieces of a half circle


def polygon(*points, name: str = "s") -> tuple[Side, ...]:
    return tuple(
        Side(f"{name}{k + 1}", Segment(start, end))
        for k, (start, end) in enumerate(zip(points, (*points[1:], points[0]), strict=True))
    )


def square(half: float, x: float = 0.0, y: float = 0.0, name: str = "s") -> tuple[Side, ...]:
    corners = [(x - half, y - half), (x + half, y - half), (x + half, y + half), (x - half, y + half)]
    return polygon(*corners, name=name)


def hole(half: float, x: float = 0.0, y: float = 0.0, name: str = "h") -> tuple[Side, ...]:
    corners = [(x - half, y - half), (x - half, y + half), (x + half, y + half), (x + half, y - half)]
    return polygon(*corners, name=name)


def circle(radius: float, x: float, y: float, name: str, sign: float = 1.0) -> tuple[Side, ...]:
    return (Side(name, Arc((x, y), radius, 0.0, sign * 2 * np.pi)),)


def wavy(amplitude: float, n_waves: int) -> ParametricCurve:
    """Return the curve y = amplitude cos(n_waves pi x), traversed from x = 1 to x = -1."""
    omega = n_waves * np.pi
    return ParametricCurve(
        lambda s: np.column_stack([1 - 2 * s, amplitude * np.cos(omega * (1 - 2 * s))]),
        lambda s: np.column_stack([-2 + 0 * s, 2 * amplitude * omega * np.sin(omega * (1 - 2 * s))]),
    )


def test_names_and_corners() -> None:
    outline = Outline((square(1.0), hole(0.25)))
    assert outline.side_names == ("s1", "s2", "s3", "s4", "h1", "h2", "h3", "h4")
    assert outline.corners[0].tolist() == [[-1, -1], [1, -1], [1, 1], [-1, 1]]
    assert [side.name for side in outline.sides] == list(outline.side_names)


LEGAL = {
    "two holes": lambda: Outline((square(2.0), hole(0.5, -1.0), hole(0.5, 1.0, name="g"))),
    "hole first": lambda: Outline((hole(0.5), square(2.0))),
    "two cavities": lambda: Outline((hole(1.0, -2.0), hole(1.0, 2.0, name="g")), is_exterior=True),
    "one closed side": lambda: Outline((circle(1.0, 0.0, 0.0, "rim"),)),
    "holes a millionth apart": lambda: Outline(
        (square(4.0), circle(1.0, -1.0 - 1e-6, 0.0, "a", -1.0), circle(1.0, 1.0, 0.0, "b", -1.0))
    ),
    "hole in the bay of a bent side": lambda: Outline(
        (
            (Side("bow", Arc((0, 0), 1.0, -np.pi, 0.0)), Side("chord", Segment((1.0, 0.0), (-1.0, 0.0)))),
            circle(0.05, 0.0, -0.94, "a", -1.0),  # beyond every chord of a coarse division of the bow
        )
    ),
    "hole that starts close to a bent side": lambda: Outline(
        (
            (Side("bow", Arc((0, 0), 1.0, -np.pi, 0.0)), Side("chord", Segment((1.0, 0.0), (-1.0, 0.0)))),
            (Side("a", Arc((0.94 * np.cos(DOWN), 0.94 * np.sin(DOWN)), 0.0599, DOWN, DOWN - 2 * np.pi)),),
        )
    ),
    "angle typed with 15 digits": lambda: Outline(
        ((Side("bow", Arc((0, 0), 1.0, 0.0, 3.14159265358978)), Side("chord", Segment((-1.0, 0.0), (1.0, 0.0)))),)
    ),
    "lens of two arcs": lambda: Outline((_lens(),)),
    "waves over waves": lambda: Outline((_waves(0.1, 0.1, 0.01),)),
}


def _lens() -> tuple[Side, ...]:
    half = 0.3  # each arc turns by 0.6, less than a piece may, and both share both ends
    down, up = np.cos(half), -np.cos(half)
    low = Arc((0.0, down), 1.0, -np.pi / 2 - half, -np.pi / 2 + half)
    high = Arc((0.0, up), 1.0, np.pi / 2 - half, np.pi / 2 + half)
    return (Side("low", low), Side("high", high))


def _waves(low: float, high: float, distance: float) -> tuple[Side, ...]:
    """Return a strip between two waves: they cross if `distance` is less than half the difference in height."""
    top, bottom = wavy(high, 12), wavy(low, 12)
    y_top, y_bottom = high + distance, low
    shifted = scaled_curve(top, (0.0, -distance), (1.0, 1.0))
    back = reverse_curve(bottom)
    return (
        Side("bottom", back),
        Side("right", Segment((1.0, y_bottom), (1.0, y_top))),
        Side("top", shifted),
        Side("left", Segment((-1.0, y_top), (-1.0, y_bottom))),
    )


@pytest.mark.parametrize("make", LEGAL.values(), ids=LEGAL)
def test_accepted_and_meshed(make) -> None:
    outline = make()
    mesh = discretise(outline, n_elements=48)
    assert len(mesh.loops) == len(outline.loops)


def test_lens_of_two_arcs_has_its_area() -> None:
    mesh = discretise(Outline((_lens(),)), n_elements=2)
    # two circular segments of half angle 0.3
    assert mesh.area == pytest.approx(0.6 - np.sin(0.6), rel=1e-13)


def kinked(s):
    return np.column_stack([2 * s - 1, np.abs(2 * s - 1) - 1])


def kinked_derivative(s):
    return np.column_stack([2 + 0 * s, 2 * np.sign(2 * s - 1)])


REFUSED = {
    "no loop": (lambda: Outline(()), r"Outline: loops is \(\): give at least one loop"),
    "empty loop": (lambda: Outline(((),)), r"each of at least one side"),
    "same name": (lambda: Outline((square(2.0), hole(1.0, name="s"))), r"2 sides are named 's1': give each its own"),
    "open": (
        lambda: Outline(((*square(1.0)[:3], Side("s4", Segment((-1.0, 1.0), (-1.0, -0.9)))),)),
        r"side 's4' ends at \(-1, -0.9\), but side 's1' starts at \(-1, -1\), 0.1 away: make every side start where",
    ),
    "open by little": (
        lambda: Outline(((*square(1.0)[:3], Side("s4", Segment((-1.0, 1.0), (-1.0, -1.0 + 1e-11)))),)),
        r"side 's4' ends at \(-1, -1\), but side 's1' starts at \(-1, -1\), 1e-11 away: make every side start where",
    ),
    "one straight side": (
        lambda: Outline(((Side("only", Segment((0, 0), (1, 0))),),)),
        r"side 'only' ends at \(1, 0\), but side 'only' starts at",
    ),
    "tiny side far away": (
        lambda: Outline((polygon((1e9, 0), (1e9 + 2, 0), (1e9 + 2, 1e-7), (1e9 + 2, 2), (1e9, 2)),)),
        r"side 's2' at .* has no length, or less than the digits .* resolve: remove it, or move the body",
    ),
    "bow tie": (
        lambda: Outline((polygon((0, 0), (1, 1), (1, 0), (0, 1)),)),
        r"side 's1' and side 's3' cross, touch or fold back .*; move them apart",
    ),
    "vertex on a side": (
        lambda: Outline((polygon((0, 0), (2, 0), (2, 1), (1, 0), (0, 1)),)),
        r"side 's1' and side 's[34]' cross, touch",
    ),
    "vertex on a side, turned": (
        lambda: Outline((polygon(*(np.array([[0, 0], [2, 0], [2, 1], [1, 0], [0, 1]]) @ TURN).tolist()),)),
        r"side 's1' and side 's[34]' cross, touch",
    ),
    "fold back": (
        lambda: Outline((polygon((0, 0), (2, 0), (1, 0), (1, 1)),)),
        r"side 's1' and side 's[23]' cross, touch or fold back",
    ),
    "two straight sides": (
        lambda: Outline((polygon((0, 0), (2, 0)),)),
        r"side 's1' and side 's2' cross, touch or fold back",
    ),
    "straight pair of curves": (
        lambda: Outline(((Side("there", Arc((0, 0), 1, 0, 1)), Side("back", Arc((0, 0), 1, 1, 0))),)),
        r"side 'there' and side 'back' cross, touch or fold back",
    ),
    "cusp": (
        lambda: Outline((_drop(),)),
        r"side 'big' and side 'small' cross, touch or fold back",
    ),
    "hole touches": (
        lambda: Outline((square(1.0), circle(0.5, 0.5, 0.0, "h", -1.0))),
        r"side 's2' and side 'h' cross, touch",
    ),
    "hole crosses between nodes": (
        lambda: Outline((square(1.0), circle(0.5, 0.5 + 1e-9, 0.0, "h", -1.0))),
        r"side 's2' and side 'h' cross, touch",
    ),
    "equal circles": (
        lambda: Outline((circle(1.0, 0.0, 0.0, "o"), circle(1.0, 0.0, 0.0, "h", -1.0))),
        r"side 'o' and side 'h' cross, touch",
    ),
    "equal circles, divided elsewhere": (
        lambda: Outline((circle(1.0, 0.0, 0.0, "o"), (Side("h", Arc((0, 0), 1.0, 1.0, 1.0 - 2 * np.pi)),))),
        r"side 'o' and side 'h' cross, touch",
    ),
    "waves through waves": (lambda: Outline((_waves(-0.1, 0.1, 0.15),)), r"side 'bottom' and side 'top' cross, touch"),
    "curve through itself": (
        lambda: Outline(((Side("eight", _eight()),),)),
        r"side 'eight' meets itself: .* correct its curve",
    ),
    "kink": (
        lambda: Outline(
            (
                (
                    Side("v", ParametricCurve(kinked, kinked_derivative)),
                    Side("lid", Segment((1.0, 0.0), (-1.0, 0.0))),
                ),
            )
        ),
        r"the curve of side 'v' has a kink near s=0\.\d+: .*split it into two sides there",
    ),
    "clockwise": (
        lambda: Outline((hole(1.0),)),
        r"outer loop of sides h1, h2, h3, h4 runs clockwise: list its vertices",
    ),
    "all reversed": (lambda: Outline((hole(2.0), square(1.0))), r"outer loop of sides h1, .* runs clockwise"),
    "hole anticlockwise": (
        lambda: Outline((square(2.0), square(1.0, name="h"))),
        r"loop of sides h1, h2, h3, h4 runs anticlockwise inside or beside the outer .*: list the vertices of a hole",
    ),
    "two bodies": (
        lambda: Outline((square(1.0), square(1.0, 5.0, name="t"))),
        r"give a second body an outline of its own",
    ),
    "hole outside": (lambda: Outline((square(1.0), hole(0.5, 3.0))), r"is a hole that lies outside of the outer loop"),
    "hole in hole": (
        lambda: Outline((square(3.0), hole(2.0), hole(1.0, name="g"))),
        r"loop of sides g1.* lies inside loop of sides h1.*, where there is no body: remove one",
    ),
    "exterior anticlockwise": (
        lambda: Outline((square(1.0),), is_exterior=True),
        r"runs anticlockwise, but the body lies outside of it .* list its vertices clockwise",
    ),
    "cavity in cavity": (
        lambda: Outline((hole(2.0), hole(1.0, name="g")), is_exterior=True),
        r"lies inside loop .*, where there is no body",
    ),
    "many sides": (
        lambda: Outline((polygon((0, 0), (0, 1), (0.5, 2), (1, 1), (1, 0)),)),
        r"outer loop of sides s1, s2, \.\.\., s5 runs clockwise",
    ),
    "not finite": (
        lambda: Outline(((Side("bad", NotFinite()),),)),
        r"side 'bad' has an end that is not finite: correct",
    ),
    "no name": (lambda: Side("", Segment((0, 0), (1, 0))), r"Side: name is '': give a non-empty string"),
    "no curve": (
        lambda: Side("odd", object()),
        r"the curve of 'odd', a object, has no is_straight, .*derivative: derive its class from bemkit",
    ),
}
TURN = np.array([[np.cos(0.7), np.sin(0.7)], [-np.sin(0.7), np.cos(0.7)]])


class NotFinite(Curve):
    """A curve that is nowhere."""

    is_straight = True

    def point(self, s):
        return np.full((len(s), 2), np.nan)

    def derivative(self, s):
        return np.full((len(s), 2), np.nan)


def _eight() -> ParametricCurve:
    return ParametricCurve(
        lambda s: np.column_stack([np.sin(4 * np.pi * s), np.sin(2 * np.pi * s + 0.3)]),
        lambda s: 2 * np.pi * np.column_stack([2 * np.cos(4 * np.pi * s), np.cos(2 * np.pi * s + 0.3)]),
    )


def _drop() -> tuple[Side, ...]:
    """Return two half circles that leave the origin in the same direction: a cusp of angle zero."""
    return (
        Side("big", Arc((0, 1), 1.0, -np.pi / 2, np.pi / 2)),
        Side("lid", Segment((0.0, 2.0), (0.0, 1.0))),
        Side("small", Arc((0, 0.5), 0.5, np.pi / 2, -np.pi / 2)),
    )


@pytest.mark.parametrize(
    "name", slow_only(REFUSED, "straight pair of curves", "equal circles, divided elsewhere", "waves through waves")
)
def test_refused(name: str) -> None:
    make, message = REFUSED[name]
    with pytest.raises(GeometryError, match=message):
        make()


@pytest.mark.parametrize("scale", [1e-9, 1.0, 1e9])
@pytest.mark.parametrize("gap", [1e-6, 1e-9])
def test_nearly_touching_circle_is_accepted_at_any_size(scale: float, gap: float) -> None:
    Outline((square(scale), circle(0.5 * scale, (0.5 - gap) * scale, 0.0, "h", -1.0)))
