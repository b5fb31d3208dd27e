"""Bodies that enlarged displacements would draw into each other."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

import bemkit as bk
from bemkit.geometry.spaces import dof_points
from bemkit.pictures.magnification import LINE, drawn_overlap, magnification
from bemkit.pictures.shown import DrawnScene, shown
from bemkit.results.contact_table import ContactTable


def moved(shapes: tuple[bk.Shape, bk.Shape], placement: bk.Placement, motion: tuple[float, float]) -> DrawnScene:
    """Return two bodies, the second one placed and moved as a whole."""
    steel, mesh = bk.Material(1.0, 0.3), bk.MeshOptions(elements=64)
    placements = (bk.Placement(), placement)
    bodies = tuple(
        bk.Body(name=name, shape=shape, material=steel, placement=where, mesh=mesh)
        for name, shape, where in zip("ab", shapes, placements, strict=True)
    )
    first, second = (
        shown(bk.Scene(title="two", bodies=bodies, contacts=(), touching=bk.Touching(0.2), law=bk.Coulomb(0.3)))
    ).bodies
    displacement = np.broadcast_to(np.array(motion), second.displacement.shape)
    pair = (first, replace(second, displacement=displacement))
    return DrawnScene("two", None, pair, (), ContactTable.empty())


@pytest.mark.parametrize(("motion", "overlap"), [((0.0, -0.1), 0.1), ((0.3, 0.0), 0.0), ((0.0, 0.1), 0.0)])
def test_a_block_that_is_moved_into_another_overlaps_by_that(
    motion: tuple[float, float], overlap: float, without: Callable[..., None]
) -> None:
    """Interactive pages, which need no matplotlib, ask this too."""
    without("matplotlib")
    pair = moved((bk.Rectangle(1.0, 1.0), bk.Rectangle(1.0, 1.0)), bk.Placement((0.0, 1.0)), motion)
    assert drawn_overlap(pair, 0.0) == 0.0
    assert drawn_overlap(pair, 1.0) == pytest.approx(overlap, abs=1e-12)
    assert drawn_overlap(pair, 0.5) == pytest.approx(0.5 * overlap, abs=1e-12)


def test_a_disc_overlaps_with_the_ring_around_it_when_its_play_is_gone() -> None:
    pair = moved((bk.Ring(1.0, 2.0), bk.Disk(0.9)), bk.Placement(), (0.15, 0.0))
    assert drawn_overlap(pair, 0.5) == 0.0
    # chords of 30 elements and more are 5e-3 of the radius inside of the circle
    assert drawn_overlap(pair, 1.0) == pytest.approx(0.05, abs=1e-2)


def test_a_side_that_has_slipped_along_a_bent_one_is_not_drawn_inside_it() -> None:
    """Both sides are bent alike, so that nothing overlaps before the upper one is moved along."""
    pair = moved((bk.Rectangle(8.0, 1.0), bk.Rectangle(8.0, 1.0)), bk.Placement((0.0, 1.0)), (0.0, 0.0))
    bent = []
    for body, slip in zip(pair.bodies, (0.0, 2e-3), strict=True):
        x = dof_points(body.space)[:, 0]
        bent.append(
            replace(body, displacement=np.column_stack([np.full(x.size, slip), 2e-3 * np.sin(0.5 * np.pi * x)]))
        )
    pair = replace(pair, bodies=tuple(bent))
    factor = magnification(pair)
    assert drawn_overlap(pair, factor) <= LINE * pair.size < drawn_overlap(pair, 5.0 * factor)
