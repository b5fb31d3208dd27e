"""Obstacles that load steps move along a body drag it by friction."""

from __future__ import annotations

import numpy as np
import pytest

import bemkit as bk
from bemkit.model.obstacle_travel import shift_between
from tests.slow import slow_except

FRICTION = 0.3
PRESSED = bk.RigidCircle((0.0, 0.999), 1.0)
TABLE = bk.RigidPolygon(((-3.0, 0.0), (3.0, 0.0), (3.0, 1.0), (-3.0, 1.0)))


def pressed(*obstacles: bk.Obstacle, law: bk.FrictionLaw | None = None) -> bk.Scene:
    """Return a block under an obstacle that takes these places one after the other."""
    contact = bk.Contact(obstacles[0], law or bk.Coulomb(FRICTION))
    steps = tuple(
        bk.Step(float(time), {"parts.top.condition.obstacle": obstacle})
        for time, obstacle in enumerate(obstacles, start=1)
    )
    return bk.Scene(
        title="Dragged",
        shape=bk.Rectangle(4.0, 1.5, (-2.0, -1.5)),
        material=bk.Material(1.0, 0.3),
        parts=(bk.Part("top", contact, ("top",)), bk.Part("base", bk.Clamped(), ("bottom",))),
        steps=steps,
        discretisation=bk.Galerkin(2),
        mesh=bk.MeshOptions(elements=160),
    )


def forces(solution: bk.Solution) -> tuple[float, float]:
    table = solution.contact
    return float(table.weight @ table.sigma_n), float(table.weight @ table.sigma_t)


@pytest.mark.parametrize("way", slow_except([1.0, -1.0], -1.0))
def test_a_circle_that_moves_along_a_block_drags_it(way: float) -> None:
    moved = [bk.RigidCircle((way * 1e-3 * k, 0.999), 1.0) for k in (1, 2, 4)]
    solution = bk.run(pressed(PRESSED, *moved))
    assert solution.is_converged, solution.message
    normal, tangential = forces(solution)
    assert tangential / (FRICTION * normal) == pytest.approx(way, rel=1e-6)  # tangents run along -x
    work = solution.loading.steps[-1].work
    slip_work = abs(tangential) * 2e-3
    assert work.dissipation == pytest.approx(slip_work, rel=5e-2)  # nodes that open or close do not count


def test_a_plane_that_moves_along_itself_drags_as_a_rigid_body_does() -> None:
    planes = [bk.RigidHalfPlane((x, -1e-3), (0.0, -1.0)) for x in (0.0, 4e-4, 1.0)]
    solution = bk.run(pressed(*planes))
    assert solution.is_converged, solution.message
    normal, tangential = forces(solution)
    assert tangential / (FRICTION * normal) == pytest.approx(1.0, rel=1e-9)


def test_obstacles_are_shifted_or_have_no_known_way() -> None:
    moved = bk.RigidPolygon(tuple((x + 0.5, y - 0.1) for x, y in TABLE.vertices))
    np.testing.assert_allclose(shift_between(TABLE, moved), (0.5, -0.1), rtol=1e-12)
    assert shift_between(TABLE, bk.RigidHalfPlane()) is None
    assert shift_between(bk.RigidHalfPlane(), bk.RigidHalfPlane(normal=(0.1, 1.0))) is None
    np.testing.assert_array_equal(shift_between(bk.Gap(0.0), bk.Gap(0.1)), (0.0, 0.0))


def test_friction_cannot_follow_an_obstacle_that_turns() -> None:
    tilted = bk.RigidHalfPlane((0.0, -1e-3), (1e-3, -1.0))
    flat = bk.RigidHalfPlane((0.0, -1e-3), (0.0, -1.0))
    with pytest.raises(bk.InputError, match="contact 'top': its obstacle turns or changes its shape between two steps"):
        bk.run(pressed(flat, tilted))
    assert bk.run(pressed(flat, tilted, law=bk.Frictionless())).is_converged
