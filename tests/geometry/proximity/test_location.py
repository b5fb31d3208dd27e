"""Location of points relative to a body."""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest

from bemkit.arrays import FloatArray
from bemkit.geometry import BoundaryMesh, Disk, ExteriorOf, Polygon, Rectangle, Ring, discretise
from bemkit.geometry.proximity.location import Locator
from tests.slow import slow_except

SHAPES = {
    "rectangle": Rectangle(2.0, 1.0),
    "notched": Polygon(((0.0, 0.0), (2.0, 0.0), (2.0, 1.0), (1.01, 0.02), (1.0, 2.0), (0.0, 2.0))),
    "disk": Disk(1.0, (3.0, 1.0)),
    "ring": Ring(0.9, 1.0),
    "exterior": ExteriorOf(Disk(1.0)),
}


def winding(mesh: BoundaryMesh, points: FloatArray) -> FloatArray:
    """Return winding numbers about polygons of 100 chords for each element, and distances from these."""
    xi = np.linspace(-1.0, 1.0, 101)
    z = mesh.points(np.arange(mesh.n_elements), xi) @ np.array([1.0, 1j])
    arms = z[None] - (points @ np.array([1.0, 1j]))[:, None, None]
    return np.asarray(np.angle(arms[..., 1:] / arms[..., :-1]).sum(axis=(1, 2)) / (2.0 * np.pi)), np.abs(arms).min(
        (1, 2)
    )


@pytest.mark.parametrize(
    ("name", "n_elements"),
    slow_except(product(sorted(SHAPES), (12, 100)), *((name, 12) for name in SHAPES), ("exterior", 100), ("ring", 100)),
)
def test_points_are_inside_as_winding_numbers_say(name: str, n_elements: int) -> None:
    mesh = discretise(SHAPES[name].outline(), n_elements=n_elements)
    rng = np.random.default_rng(0)
    angle = rng.uniform(0.0, 2.0 * np.pi, len(mesh.nodes))
    # all around, and close to nodes, where the elements that meet there must tell the side
    around = mesh.nodes + 0.01 * mesh.lengths.min() * np.column_stack([np.cos(angle), np.sin(angle)])
    points = np.concatenate([mesh.centre + mesh.diameter * rng.uniform(-0.6, 0.6, (100, 2)), around])
    numbers, distance = winding(mesh, points)
    is_clear = distance > 1e-4 * mesh.lengths.max()  # of the polygon's bulges
    location = Locator(mesh).locate(points)
    assert (location.is_inside == (np.rint(numbers) == (0 if mesh.is_exterior else 1)))[is_clear].all()
    nearest = np.array(
        [mesh.points(np.array([e]), np.array([xi]))[0, 0] for e, xi in zip(location.element, location.xi, strict=True)]
    )
    # the polygon's points are as far apart as a fiftieth of an element
    own = np.hypot(*(points - nearest).T)
    assert (own <= distance * (1.0 + 1e-9)).all()
    assert (own >= distance - 0.01 * mesh.lengths.max()).all()
