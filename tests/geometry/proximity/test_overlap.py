"""The deepest point of one body inside another."""

from __future__ import annotations

import numpy as np
import pytest

from bemkit.geometry.meshing.discretise import discretise
from bemkit.geometry.proximity.overlap import Polyline, deepest_overlap, near_pairs
from bemkit.geometry.shapes import Disk, PlateWithHole, Rectangle
from bemkit.geometry.symmetry.lines import Symmetry


def polyline(shape, n: int = 40, symmetry: Symmetry | None = None) -> Polyline:
    return Polyline.of(discretise(shape.outline(), n_elements=n, symmetry=symmetry))


@pytest.mark.parametrize("x", [0.0, 0.5, 0.9])
@pytest.mark.parametrize("far", [0.0, 1e5])
def test_a_corner_inside_of_a_block_is_as_deep_as_the_nearest_side(x: float, far: float) -> None:
    block = polyline(Rectangle(2.0, 1.0, (far, 0.0)))
    other = polyline(Rectangle(2.0, 1.0, (far + x, 0.8)))
    depth, place = deepest_overlap(block, other, 1e-9)
    assert depth == pytest.approx(0.2, rel=1e-9)
    assert place[0] - far >= x - 1e-9
    assert deepest_overlap(block, other, 0.3)[0] == 0.0


def test_bodies_that_touch_do_not_overlap() -> None:
    block, above = polyline(Rectangle(2.0, 1.0)), polyline(Rectangle(1.3, 1.0, (0.2, 1.0)), 37)
    assert deepest_overlap(block, above, 1e-9)[0] == 0.0
    assert near_pairs([block, above, polyline(Rectangle(1.0, 1.0, (5.0, 0.0)))]) == [(0, 1)]


def test_a_disc_in_a_hole_does_not_overlap_and_one_that_is_shifted_does() -> None:
    plate = polyline(PlateWithHole(8.0, 8.0, 1.0, (-4.0, -4.0)), 80)
    disc = polyline(Disk(1.0), 40)
    least = plate.tolerance + disc.tolerance
    assert deepest_overlap(plate, disc, least)[0] == 0.0
    depth, place = deepest_overlap(plate, polyline(Disk(1.0, (0.1, 0.0)), 40), least)
    assert depth == pytest.approx(0.1, rel=2e-2)
    assert place[0] == pytest.approx(1.1, abs=2e-2)


def test_points_count_only_where_they_are_asked_for() -> None:
    block, above = polyline(Rectangle(2.0, 1.0)), polyline(Rectangle(2.0, 1.0, (0.3, 0.8)))
    nowhere = [np.zeros(len(each.points), bool) for each in (block, above)]
    assert deepest_overlap(block, above, 1e-9, nowhere)[0] == 0.0


def test_a_halved_body_counts_as_a_whole() -> None:
    halved = polyline(Rectangle(2.0, 1.0, (-1.0, 0.0)), 40, Symmetry(x=0.0))
    assert halved.box[0].tolist() == [-1.0, 0.0]
    assert deepest_overlap(halved, polyline(Rectangle(1.0, 1.0, (-1.8, 0.0))), 1e-9)[0] == pytest.approx(0.2)


@pytest.mark.parametrize("symmetry", [Symmetry(x=0.0), Symmetry(y=0.0), Symmetry(x=0.0, y=0.0)])
def test_a_block_beside_a_halved_disc_overlaps_it_in_no_corner_of_its_box(symmetry: Symmetry) -> None:
    """The images of a single reflection run the other way round."""
    disc = polyline(Disk(1.0), 64, symmetry)
    corners = np.array([[-0.8, -0.8], [0.8, -0.8], [0.8, 0.8], [-0.8, 0.8]])
    assert disc.deepest(corners, 1e-9) == (0.0, -1)
    depth, k = disc.deepest(np.append(corners, [[-0.6, -0.6]], axis=0), 1e-9)
    assert (depth, k) == (pytest.approx(1.0 - 0.6 * np.sqrt(2.0), rel=1e-3), 4)
