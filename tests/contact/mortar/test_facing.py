"""Which sides make a pair, which of the two carries the multipliers, and how long finding them takes to grow."""

from __future__ import annotations

import numpy as np
import pytest

import bemkit as bk
from bemkit.contact.mortar.coupling import couple
from bemkit.contact.mortar.facing import find_facing, is_non_mortar
from bemkit.contact.mortar.sides import ContactSide
from bemkit.geometry.mesh import BoundaryMesh
from bemkit.geometry.meshing.discretise import discretise
from bemkit.geometry.outline import Selection
from tests.contact.mortar.pairs import block, half_disc, quadrangle, space_of

PARTS = ("bottom", "right", "top", "left")


def all_sides(meshes: list[BoundaryMesh]) -> tuple[list[ContactSide], list[int]]:
    """Return the four sides of each quadrangle, and the number of its body."""
    spaces = [space_of(mesh, 1) for mesh in meshes]
    sides = [ContactSide(space, space.mesh.part(part)) for space in spaces for part in PARTS]
    return sides, [owner for owner in range(len(meshes)) for _ in PARTS]


def found(meshes: list[BoundaryMesh], distance: float = 1e-3) -> list[tuple[str, str]]:
    """Return the pairs as words such as "0 top"."""
    sides, owners = all_sides(meshes)
    words = [f"{owner} {part}" for owner, part in zip(owners, PARTS * len(meshes), strict=True)]
    return [(words[one], words[two]) for one, two, _ in find_facing(sides, distance, owners)]


def test_no_sides_make_no_pairs() -> None:
    assert find_facing([], 1.0) == []


def test_a_wall_in_running_bond() -> None:
    rows, columns = 5, 4
    meshes = [
        block((2.0 * k + row % 2, row), (2.0 * k + row % 2 + 2.0, row + 1.0), 8 + 4 * (k % 2), 5 + row % 2)
        for row in range(rows)
        for k in range(columns)
    ]
    sides, owners = all_sides(meshes)
    pairs = [pair[:2] for pair in find_facing(sides, 1e-3, owners)]
    assert len(pairs) == rows * (columns - 1) + (rows - 1) * (2 * columns - 1)
    assert sorted(map(sorted, pairs)) == [sorted(pair) for pair in pairs]  # in the order of the sides
    length = sum(couple(sides[one], sides[two], reach=1e-3).weights.sum() for one, two in pairs)
    assert length == pytest.approx(rows * (columns - 1) * 1.0 + (rows - 1) * (2 * columns - 1) * 1.0, rel=1e-13)
    assert all(is_non_mortar(sides[one], sides[two]) for one, two in pairs)


@pytest.mark.slow
def test_sizes_may_differ_by_far() -> None:
    ground = block((-100.0, -1.0), (100.0, 0.0), 2, 1)
    small = [block((k, 0.0), (k + 1e-3, 1e-3), 3, 2) for k in np.arange(-90.0, 90.0)]
    pairs = found([ground, *small])
    assert pairs == [(f"{k + 1} bottom", "0 top") for k in range(180)]


@pytest.mark.parametrize(
    ("low", "pairs"),
    [
        ((1.0, 1.0), []),  # touches at a corner
        ((1.0 - 1e-9, 1.0), []),  # by round-off of what is drawn
        ((0.999, 1.0), [("0 top", "1 bottom")]),  # a thousandth of the width covered, on any mesh
        ((1.0, 0.999), [("0 right", "1 left")]),
        ((0.9, 1.0), [("0 top", "1 bottom")]),
        ((0.2, 1.0005), [("0 top", "1 bottom")]),  # near
        ((0.2, 0.9995), [("0 top", "1 bottom")]),  # overlaps
        ((0.2, 1.002), []),  # too far away
        ((0.2, 3.0), []),
    ],
)
def test_two_blocks(low: tuple[float, float], pairs: list[tuple[str, str]]) -> None:
    meshes = [block((0.0, 0.0), (1.0, 1.0), 3, 3), block(low, (low[0] + 1.0, low[1] + 1.0), 3, 3)]
    assert found(meshes) == pairs


@pytest.mark.parametrize("thickness", [(0.01, 0.01), (0.9, 0.01), (0.01, 0.9)])
def test_plates_meet_only_between_them(thickness: tuple[float, float]) -> None:
    """Their outer sides oppose each other as well, and lie no farther apart than the distance."""
    meshes = [block((0.0, -thickness[0]), (1.0, 0.0), 50, 3), block((0.0, 0.0), (1.0, thickness[1]), 50, 3)]
    assert found(meshes, 1.0) == [("0 top", "1 bottom")]


@pytest.mark.parametrize(("distance", "pairs"), [(0.531, []), (0.533, [("0 top", "1 bottom")])])
def test_distance_of_inclined_sides(distance: float, pairs: list[tuple[str, str]]) -> None:
    """From the corner (0, 0.5) along the mean normal of sides at 40 degrees it is 0.5 / cos(20 degrees) = 0.53209."""
    along = np.array([np.cos(np.radians(40.0)), np.sin(np.radians(40.0))])
    tilted = np.array([[0.0, 0.5], [along[0], along[1] + 0.5], [along[0], along[1] + 2.5], [-0.1, 1.5]])
    meshes = [block((0.0, -1.0), (1.0, 0.0), 4, 2), quadrangle(tilted, [np.linspace(0.0, 1.0, 5)] * 4)]
    assert found(meshes, distance) == pairs


@pytest.mark.parametrize(("angle", "is_pair"), [(50.0, True), (70.0, False)])
def test_angles_between_sides(angle: float, is_pair: bool) -> None:
    tilted = np.array([[0.0, 0.0], [np.cos(np.radians(angle)), np.sin(np.radians(angle))], [0.0, 3.0], [-1.0, 1.0]])
    meshes = [block((0.0, -1.0), (1.0, 0.0), 4, 2), quadrangle(tilted, [np.linspace(0.0, 1.0, 5)] * 4)]
    assert (("0 top", "1 bottom") in found(meshes, 2.0)) == is_pair


def test_bodies_make_no_pair_with_themselves() -> None:
    """The two lips of a slit, once of one body and once of two."""
    sides, _ = all_sides([block((0.0, 0.0), (1.0, 1.0), 3, 3), block((0.0, 1.0), (1.0, 2.0), 3, 3)])
    assert find_facing(sides, 1e-3, [0] * 8) == []
    assert find_facing(sides, 1e-3) == [(2, 4, True)]


@pytest.mark.parametrize(("n_disc", "n_ring"), [(3, 3), (2, 9), (7, 2)])
def test_quarters_of_a_disc_face_those_of_its_ring_only_once(n_disc: int, n_ring: int) -> None:
    """The chords at the ends of the next quarter have a common projection, as long as the gap times their angle."""
    names = ("arc", "inner")
    sides, owners = [], []
    for owner, (shape, n) in enumerate(((bk.Disk(0.99), 4 * n_disc), (bk.Ring(1.0, 2.0), 12 * n_ring))):
        parts = {str(k): Selection((f"{names[owner]}-{k}",)) for k in range(1, 5)}
        mesh = discretise(shape.outline(), n_elements=n, parts=parts)
        sides += [ContactSide(space_of(mesh, 1), mesh.part(name)) for name in parts]
        owners += [owner] * 4
    pairs = find_facing(sides, 0.1, owners)
    assert len(pairs) == 4


@pytest.mark.parametrize("n", [8, 9])
def test_cylinders_face_each_other_about_the_point_where_they_touch(n: int) -> None:
    """With 8 points the middles of two elements touch, and their chords are 0.004 apart."""
    far = 0.6 + 0.4 * np.linspace(0.0, 1.0, 9)
    discs = [half_disc(is_below=below, far=far, near=np.linspace(0.4, 0.6, n)) for below in (False, True)]
    spaces = [space_of(mesh, 2) for mesh in discs]
    sides = [ContactSide(space, space.mesh.part(part)) for space in spaces for part in ("contact", "a", "b")]
    assert find_facing(sides, 1e-6, [0, 0, 0, 1, 1, 1]) == [(0, 3, True)]


@pytest.mark.parametrize(
    ("one", "two", "expected"),
    [
        (((0.0, 1.0), 3), ((0.0, 1.0), 5), False),  # both are covered: the finer one
        (((0.0, 1.0), 5), ((0.0, 1.0), 3), True),
        (((0.0, 1.0), 5), ((0.0, 1.0), 5), True),  # alike: the first one
        (((0.0, 1.0), 1), ((-1.0, 2.0), 99), True),  # the one that is covered wholly
        (((0.0, 1.0), 99), ((0.2, 0.8), 1), False),
        (((0.0, 1.0), 3), ((0.5, 1.5), 5), False),  # neither is covered
        (((0.0, 1.0), 5), ((0.5, 1.5), 3), True),
    ],
)
def test_which_side_carries_the_multipliers(
    one: tuple[tuple[float, float], int], two: tuple[tuple[float, float], int], expected: bool
) -> None:
    (span1, n1), (span2, n2) = one, two
    sides, _ = all_sides(
        [block((span1[0], 0.0), (span1[1], 1.0), n1, 2), block((span2[0], -1.0), (span2[1], 0.0), n2, 2)]
    )
    assert is_non_mortar(sides[0], sides[6]) == expected
    assert find_facing([sides[0], sides[6]], 1e-3) == [((0, 1) if expected else (1, 0)) + (True,)]
