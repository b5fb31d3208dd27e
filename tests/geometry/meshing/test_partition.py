"""Partitions of outlines: cut, graded, shared by a density, and balanced."""

from __future__ import annotations

import numpy as np
import pytest

from bemkit.geometry.meshing.partition import LEAST, STEEPEST, Partition, better_partition, first_partition
from bemkit.geometry.outline import Selection
from bemkit.geometry.shapes import PlateWithHole, Rectangle

PARTS = {"floor": Selection(("bottom",)), "load": Selection(("top",), lambda x, y: x > 0.5)}


def first(n_elements: int = 40) -> Partition:
    return first_partition(Rectangle(1.0, 1.0).outline(), PARTS, n_elements, even=["floor"])


def ratios(partition: Partition) -> float:
    mesh = partition.mesh
    return max(
        float(np.maximum(along / np.roll(along, 1), np.roll(along, 1) / along).max())
        for along in (mesh.lengths[loop] for loop in mesh.loops)
    )


def test_the_first_partition_is_graded_but_for_even_parts() -> None:
    mesh = first().mesh
    inner = mesh.lengths[mesh.part("floor")][3:-3]
    np.testing.assert_allclose(inner, inner[0], rtol=1e-12)
    load = mesh.lengths[mesh.part("load")]
    assert load[0] < 0.3 * load[load.size // 2]
    assert 40 <= mesh.n_elements <= 80


def test_elements_end_at_the_cuts_and_crowd_around_them() -> None:
    old = first()
    density = np.ones(old.mesh.n_elements)
    new = better_partition(old, density, 80, cuts={0: [0.3, 0.6], 2: [0.25]}, spread_over=["floor"])
    for point in ((0.3, 0.0), (0.6, 0.0), (0.75, 1.0)):
        assert np.hypot(*(new.mesh.nodes - point).T).min() < 1e-14
    x = np.sort(new.mesh.start[new.mesh.part("floor"), 0])
    k = int(np.argmin(np.abs(x - 0.3)))
    assert x[k + 1] - x[k] < 0.2 * np.diff(x).max()
    assert new.mesh.parts.keys() == old.mesh.parts.keys()


def test_elements_follow_the_density() -> None:
    old = first()
    density = np.where(old.mesh.centres[:, 0] < 1e-9, 1.0, 0.0)  # the left side
    new = better_partition(old, density, 120, cuts={}, spread_over=[])
    on_left = new.mesh.centres[:, 0] < 1e-9
    # a fifth of the others' density remains, and they are balanced against their neighbours
    assert on_left.sum() > 0.5 * new.mesh.n_elements
    assert on_left.sum() >= 3 * (old.mesh.centres[:, 0] < 1e-9).sum()


def test_half_of_the_elements_are_spread_over_the_parts_named() -> None:
    old = first()
    density = np.where(old.mesh.centres[:, 0] < 1e-9, 1.0, 0.0)
    new = better_partition(old, density, 100, cuts={}, spread_over=["floor"])
    assert 50 <= new.mesh.part("floor").size <= 65


def test_without_any_density_all_elements_count_alike() -> None:
    old = first()
    new = better_partition(old, np.zeros(old.mesh.n_elements), 100, cuts={}, spread_over=[])
    counts = [np.count_nonzero(new.sides == side) / np.count_nonzero(old.sides == side) for side in range(4)]
    assert max(counts) < 2.0 * min(counts)


def test_every_piece_has_elements_and_neighbours_are_similar() -> None:
    rng = np.random.default_rng(7)
    partition = first()
    for _ in range(4):
        density = 10.0 ** rng.uniform(-6.0, 0.0, partition.mesh.n_elements)
        partition = better_partition(partition, density, 90, cuts={0: [0.9999]}, spread_over=["floor"])
        assert min(len(s) - 1 for s in partition.parameters) >= LEAST
        assert ratios(partition) <= STEEPEST * (1.0 + 1e-9)


def test_cuts_at_ends_of_pieces_change_nothing() -> None:
    old = first()
    density = np.ones(old.mesh.n_elements)
    plain, cut = (
        better_partition(old, density, 80, cuts=cuts, spread_over=[]) for cuts in ({}, {0: [0.0, 1.0], 2: [0.5]})
    )
    np.testing.assert_array_equal(plain.mesh.nodes, cut.mesh.nodes)


@pytest.mark.parametrize("cut", [0.31, 0.5])
def test_holes_and_curves(cut: float) -> None:
    outline = PlateWithHole(4.0, 2.0, 0.5).outline()
    old = first_partition(outline, {"hole": Selection(outline.side_names[4:5])}, 60)
    new = better_partition(old, np.ones(old.mesh.n_elements), 120, cuts={4: [cut]}, spread_over=["hole"])
    place = outline.sides[4].curve.point(np.array([cut]))
    assert np.hypot(*(new.mesh.nodes - place).T).min() < 1e-12
    assert len(new.mesh.loops) == 2
    assert ratios(new) <= STEEPEST * (1.0 + 1e-2)  # arcs against chords
    # nodes sit on the circle
    curved = np.flatnonzero(~new.mesh.is_straight)
    np.testing.assert_allclose(np.hypot(*(new.mesh.start[curved] - [2.0, 1.0]).T), 0.5, rtol=1e-12)


def test_spans_and_sides_describe_the_elements() -> None:
    partition = first()
    outline = partition.division.outline
    for element in range(0, partition.mesh.n_elements, 5):
        curve = outline.sides[int(partition.sides[element])].curve
        ends = curve.point(partition.spans[element])
        np.testing.assert_allclose(ends[0], partition.mesh.start[element], rtol=0.0, atol=1e-15)
        np.testing.assert_allclose(ends[1], partition.mesh.end[element], rtol=0.0, atol=1e-15)
