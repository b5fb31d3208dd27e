"""Contacts that name several sides of a body, or all."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache

import numpy as np
import pytest

import bemkit as bk

STEEL = bk.Material(1.0, 0.3)
BASE = bk.Part("base", bk.Clamped(), ("bottom",))
PLATE = bk.Body(name="plate", shape=bk.PlateWithHole(6.0, 6.0, 1.01, (-3.0, -3.0)), material=STEEL, parts=(BASE,))
PIN = bk.Body(name="pin", shape=bk.Disk(1.0), material=STEEL, body_forces=(bk.Gravity(0.001, (0.1, -1.0)),))
PRESSED = bk.Scene(
    title="Pin",
    bodies=(PLATE, PIN),
    contacts=(bk.ContactPair(("pin.arc", "plate.hole")),),
    law=bk.Coulomb(0.5),
    mesh=bk.MeshOptions(elements=48),
)


@lru_cache
def forces_of(*sides: str) -> np.ndarray:
    solution = bk.run(replace(PRESSED, contacts=(bk.ContactPair(sides),)))  # type: ignore[arg-type]
    assert solution.is_converged
    return np.column_stack([solution.contact.x, solution.contact.y, solution.contact.sigma_n, solution.contact.sigma_t])


@pytest.mark.parametrize(
    "sides",
    [
        pytest.param(("pin.*", "plate.hole"), marks=pytest.mark.slow),
        ("pin.arc-1,arc-2, arc-3 ,arc-4", "plate.hole-1, hole-2, hole-3, hole-4"),
    ],
)
def test_lists_and_whole_shapes_are_those_sides(sides: tuple[str, str]) -> None:
    assert np.array_equal(forces_of(*sides), forces_of("pin.arc", "plate.hole"))


def test_sides_of_a_list_are_not_found_again() -> None:
    blocks = [
        bk.Body(name=name, shape=bk.Rectangle(1.0, 1.0), material=STEEL, placement=bk.Placement((x, 0.0)))
        for name, x in (("left", 0.0), ("right", 1.0))
    ]
    assembly = bk.Scene(title="Blocks", bodies=tuple(blocks), touching=bk.Touching(0.01))
    listed = replace(assembly, contacts=(bk.ContactPair(("left.right, top", "right.*")),))
    left, right = listed.placed_bodies
    assert listed.touching_parts(left) == ("right, top", "bottom", "left")
    assert listed.touching_parts(right) == ("*",)


def test_a_wrong_side_of_a_list_is_named() -> None:
    with pytest.raises(bk.InputError, match=r"body 'pin' has no part or side 'arc-5': .*; did you mean 'arc-4'\?"):
        replace(PRESSED, contacts=(bk.ContactPair(("pin.arc-1, arc-5", "plate.hole")),))
