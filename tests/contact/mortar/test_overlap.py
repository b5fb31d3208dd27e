"""Overlaps are told from sides that face away."""

from __future__ import annotations

import numpy as np
import pytest

from bemkit.contact.mortar.sides import encloses, faces_away
from bemkit.geometry.curves import Arc
from bemkit.geometry.mesh import BoundaryMesh
from tests.contact.mortar.pairs import block, chain

S = np.linspace(0.0, 1.0, 17)
DISC = chain(("rim", Arc((0.0, 0.0), 1.0, 0.0, 2.0 * np.pi), S))
HOLE = BoundaryMesh(
    Arc((0.0, 0.0), 1.0, 2.0 * np.pi, 0.0).point(S[:-1]),
    np.column_stack([np.arange(16), (np.arange(16) + 1) % 16]),
    is_exterior=True,
)


@pytest.mark.parametrize(("mesh", "inside"), [(DISC, [True, False, False]), (HOLE, [False, True, True])])
def test_points_in_bodies_and_in_the_plane_outside_of_a_hole(mesh: BoundaryMesh, inside: list[bool]) -> None:
    points = np.array([[0.3, 0.2], [1.2, 0.0], [0.0, -9.0]])
    assert encloses(mesh, points).tolist() == inside


@pytest.mark.parametrize(
    ("bottom", "middle", "distance", "is_away"),
    [
        (0.9, 0.95, -0.1, False),  # the upper block reaches into the lower one
        (1.5, 1.25, -0.5, True),  # there is room between them
        (1.5, 1.25, 0.5, False),  # ahead
        (1.5, 1.25, -1e-3, False),  # within the slack
    ],
)
def test_two_blocks(bottom: float, middle: float, distance: float, is_away: bool) -> None:
    lower, upper = block((0.0, 0.0), (1.0, 1.0), 2, 2), block((0.0, bottom), (1.0, bottom + 1.0), 2, 2)
    found = faces_away(upper, lower, np.array([[0.5, middle]]), np.array([distance]), np.array([0.01]))
    assert found.tolist() == [is_away]
