"""A field that is worked out when somebody asks for it."""

from __future__ import annotations

import dataclasses
import pickle

from bemkit.results.when_asked import WhenAsked


@dataclasses.dataclass(frozen=True)
class Square:
    side: int
    area: WhenAsked[int] = WhenAsked(0)  # noqa: RUF009


ASKED: list[int] = []


def area_of(square: Square) -> int:
    ASKED.append(square.side)
    return square.side**2


def with_area(side: int) -> Square:
    square = Square(side)
    object.__setattr__(square, "area", area_of)
    return square


def test_a_value_given_is_kept() -> None:
    assert (Square(3).area, Square(3, 5).area, Square.area) == (0, 5, 0)


def test_a_function_is_called_when_asked_and_once() -> None:
    ASKED.clear()
    square = with_area(3)
    assert ASKED == []
    assert (square.area, square.area, ASKED) == (9, 9, [3])


def test_copies_hold_the_same() -> None:
    for copied in (dataclasses.replace(with_area(3), side=4), pickle.loads(pickle.dumps(with_area(3)))):
        assert copied.area == 9


def test_a_function_goes_to_a_copy_without_being_called() -> None:
    ASKED.clear()
    square = with_area(3)
    larger = dataclasses.replace(square, side=4, area=WhenAsked.held(square, "area"))
    assert ASKED == []
    assert (larger.area, ASKED) == (16, [4])
