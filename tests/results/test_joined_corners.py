"""A square punch on a block of its material: its corners are named, and what is asked for is reached but at them."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import lru_cache

import numpy as np
import pytest

import bemkit as bk
from bemkit.results.solution import Solution
from bemkit.results.wedge import HELD, JoinedWedge, WedgeSide, joined_exponent
from bemkit.solvers.active_sets import NodeStatus

MATERIAL = bk.Material(1.0, 0.3)
RIGHT = round(0.5 * math.pi, 6)
PUNCH, PLANE = JoinedWedge(RIGHT, MATERIAL.kappa, 1.0), JoinedWedge(math.pi, MATERIAL.kappa, 1.0)


def pressed(friction: float, *, softness: float = 1.0, width: float = 4.0) -> bk.Scene:
    """A punch of width 1 on a block; on one of the same width both sides end together."""
    base, table = bk.Part("base", bk.Clamped(), ("bottom",)), bk.Part("table", bk.Free(), ("top",))
    foot, load = bk.Part("foot", bk.Free(), ("bottom",)), bk.Part("load", bk.Traction(y=-1e-3), ("top",))
    shape = bk.Rectangle(width, 2.0, (-0.5 * width, -2.0))
    softer = replace(MATERIAL, youngs_modulus=softness)
    bodies = (
        bk.Body(name="block", shape=shape, material=MATERIAL, parts=(base, table)),
        bk.Body(name="punch", shape=bk.Rectangle(1.0, 1.0, (-0.5, 0.0)), material=softer, parts=(foot, load)),
    )
    pair = bk.ContactPair(("punch.foot", "block.table"))
    mesh = bk.MeshOptions(elements=40)
    return bk.Scene(
        title="punch",
        bodies=bodies,
        contacts=(pair,),
        law=bk.Coulomb(friction),
        discretisation=bk.Galerkin(4),
        mesh=mesh,
    )


SLIDES = WedgeSide(True, friction=0.48)


@lru_cache
def solved(friction: float, accuracy: float) -> Solution:
    mesh = bk.MeshOptions(accuracy=accuracy, rising_degrees=True)
    scene = replace(pressed(friction), discretisation=bk.Galerkin(2), mesh=mesh)
    solution: Solution = bk.run(scene)
    return solution


@pytest.mark.slow
@pytest.mark.parametrize(("friction", "contact"), [(0.6, HELD), (0.48, SLIDES)])
@pytest.mark.parametrize("accuracy", [1e-2, 1e-3, 1e-4])
def test_the_accuracy_is_reached_and_both_corners_are_named(
    friction: float, contact: WedgeSide, accuracy: float
) -> None:
    solution = solved(friction, accuracy)
    assert solution.is_converged
    assert solution.estimated_traction_error is not None
    assert solution.estimated_traction_error <= accuracy
    expected = joined_exponent(PUNCH, PLANE, contact)
    for name, partner in (("block", "punch"), ("punch", "block")):
        corners = solution.places.corners[name]
        assert [(corner.x, corner.y, corner.partner) for corner in corners] == [(-0.5, 0, partner), (0.5, 0, partner)]
        assert [corner.exponent for corner in corners] == pytest.approx(
            [expected, expected], abs=1e-6
        )  # of the angles' digits
        left_out = np.concatenate([corner.elements for corner in corners])
        assert not np.isin(left_out, solution.places.elements(name)).any()
        assert np.abs(np.abs(solution.bodies[name].mesh.centres[left_out, 0]) - 0.5).max() < 5e-3
    assert any("singular at (-0.5, 0)" in str(warning) for warning in solution.warnings)


def test_above_the_critical_friction_only_the_last_node_may_slip() -> None:
    """From 0.5430756 on complete contact of equal materials sticks; see `tests/results/test_wedge.py`."""
    table = solved(0.6, 1e-2).contact
    assert np.all(np.isin(table.status[1:-1], NodeStatus.STICK))


@pytest.mark.slow
def test_below_it_the_slip_zone_has_a_length_that_settles() -> None:
    """To 2 % from mesh to mesh."""
    lengths = [0.5 - solved(0.48, accuracy).transitions[-1].x for accuracy in (1e-2, 1e-3, 1e-4)]
    assert lengths[0] == pytest.approx(lengths[1], rel=0.02)
    assert lengths[1] == pytest.approx(lengths[2], rel=0.02)
    assert lengths[-1] == pytest.approx(1.15e-3, rel=0.02)


@pytest.mark.slow
def test_sides_that_end_together_have_corners_if_their_materials_differ() -> None:
    """Equal ones are one body with a straight side."""
    same, softer = (bk.run(pressed(2.0, softness=softness, width=1.0)) for softness in (1.0, 0.1))
    assert same.singular_corners == ()
    soft = replace(PUNCH, stiffness=0.1)
    expected = joined_exponent(soft, replace(PUNCH, stiffness=1.0), HELD)
    assert expected is not None
    for name in ("block", "punch"):
        found = [(corner.x, corner.exponent) for corner in softer.places.corners[name]]
        assert sorted(found) == [(-0.5, pytest.approx(expected)), (0.5, pytest.approx(expected))]


def test_an_edge_that_lifts_off_is_not_singular_in_the_mirror_either() -> None:
    """Its node is separated and the next one slips; round-off chose one of them by the side of the punch."""
    scene = replace(pressed(0.3), discretisation=bk.Galerkin(1), mesh=bk.MeshOptions(elements=60))
    block, punch = scene.bodies
    for push in (2e-4, -2e-4):
        load = bk.Part("load", bk.Traction(push, -1e-3), ("top",))
        pushed = replace(punch, parts=(punch.parts[0], load))
        corners = bk.run(replace(scene, bodies=(block, pushed))).places.corners["punch"]
        assert [corner.x for corner in corners] == [math.copysign(0.5, push)]
