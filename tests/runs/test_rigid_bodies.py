"""Rigid bodies that move: punches, discs, wedges; driven by displacements and by forces."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import bemkit as bk
from bemkit.cli.console import print_summary
from bemkit.model.contacts import OverlapError
from bemkit.model.model import build_model
from bemkit.model.prepared import prepare_steps
from bemkit.pictures import draw_deformation
from bemkit.results.solution import Solution
from bemkit.results.tables import to_json
from bemkit.runs.adaptive import run_adaptive
from bemkit.runs.steps import UnsolvableSceneError
from bemkit.solvers.base import solve
from tests.slow import slow_except

STEEL = bk.Material(1.0, 0.3)
FORCE = 0.01
BLOCK = bk.Body(
    name="block",
    shape=bk.Rectangle(2.0, 1.0),
    material=STEEL,
    parts=(bk.Part("base", bk.Clamped(), ("bottom",)),),
    mesh=bk.MeshOptions(elements=60),
)
SQUARE = bk.RigidPolygon(((0.5, 1.0), (1.5, 1.0), (1.5, 1.5), (0.5, 1.5)))
PUNCH = bk.RigidBody(name="punch", obstacle=SQUARE, centre=(1.0, 1.0), force_y=-FORCE)
PRESSED = bk.Scene(
    title="Punch",
    bodies=(BLOCK,),
    rigid=(PUNCH,),
    contacts=(bk.ContactPair(("block.top", "punch")),),
    discretisation=bk.Galerkin(2),
)
SOME = bk.Coulomb(0.3)


def solved(assembly: bk.Scene) -> Solution:
    solution = bk.run(assembly)
    assert solution.is_converged, solution.message
    return solution


def driven(**changes: float | None) -> bk.Scene:
    """Return the punch under other loads and motions."""
    return replace(PRESSED, rigid=(replace(PUNCH, **changes),))  # type: ignore[arg-type]


@pytest.mark.parametrize("law", slow_except([bk.Frictionless(), SOME], SOME))
def test_a_force_and_the_displacement_it_causes_are_one_problem(law: bk.FrictionLaw) -> None:
    by_force = solved(replace(PRESSED, law=law))
    punch = by_force.rigid["punch"]
    assert punch.force_y == pytest.approx(-FORCE, rel=1e-12)  # a sum of forty numbers
    assert by_force.contacts[0].force_y == pytest.approx(-FORCE, rel=1e-12)
    assert punch.y < 0.0
    assert (punch.x, punch.turn) == (0.0, 0.0)
    by_motion = solved(replace(driven(force_y=None, y=punch.y), law=law))
    peak = np.abs(by_force.contact.sigma_n).max()
    for name in ("sigma_n", "sigma_t"):
        np.testing.assert_allclose(getattr(by_motion.contact, name), getattr(by_force.contact, name), atol=1e-9 * peak)
    assert by_motion.rigid["punch"].force_y == pytest.approx(-FORCE, rel=1e-10)


def test_the_shipped_punch_tilts_as_on_a_half_plane() -> None:
    """The block is twenty half-widths deep, its mesh that of 2 %: tilt and pressure of [Johnson1985], section 2.8."""
    solution = solved(bk.load_scene("tilted-punch"))
    force, moment = 1e-3, 2e-4
    assert -solution.rigid["punch"].turn == pytest.approx(4.0 * moment / np.pi, rel=3e-3)
    table = solution.contact
    x, pressure = (column[np.abs(table.x) < 0.9] for column in (table.x, -table.sigma_n))
    np.testing.assert_allclose(pressure, (force + 2.0 * moment * x) / (np.pi * np.sqrt(1.0 - x**2)), rtol=1e-2)


@pytest.mark.slow
def test_an_eccentric_force_tilts_the_punch_and_its_moment_is_balanced() -> None:
    by_moment = solved(driven(moment=-0.1 * FORCE)).rigid["punch"]
    by_place = solved(driven(centre=(1.1, 1.0), moment=0.0)).rigid["punch"]  # type: ignore[arg-type]
    assert by_moment.turn < 0.0
    assert by_moment.moment == pytest.approx(-0.1 * FORCE, rel=1e-12)
    assert by_place.moment == pytest.approx(0.0, abs=1e-14 * FORCE)
    assert by_place.turn == pytest.approx(by_moment.turn, rel=1e-10)
    # the centres are 0.1 apart
    assert by_place.y - by_moment.y == pytest.approx(0.1 * by_moment.turn, rel=1e-10)
    # told to turn so, it takes the same moment
    told = solved(driven(turn=by_moment.turn)).rigid["punch"]
    assert told.moment == pytest.approx(-0.1 * FORCE, rel=1e-10)


def wedge(name: str, sign: float) -> bk.Body:
    """One side of a V of 90 degrees with its bottom at the origin."""
    points = ((0.0, -1.0), (2.0, -1.0), (2.0, 2.0), (0.0, 0.0))
    names = ("bottom", "outer", "face", "inner")
    if sign < 0.0:
        points, names = tuple((-x, y) for x, y in points[::-1]), ("face", "outer", "bottom", "inner")  # type: ignore[assignment]
    held = bk.Part("held", bk.Clamped(), ("bottom", "outer"))
    return bk.Body(
        name=name, shape=bk.Polygon(points, names), material=STEEL, parts=(held,), mesh=bk.MeshOptions(elements=80)
    )


V = bk.Scene(
    title="V",
    bodies=(wedge("left", -1.0), wedge("right", 1.0)),
    rigid=(
        bk.RigidBody(
            name="disc",
            obstacle=bk.RigidCircle((0.0, np.sqrt(2.0)), 1.0),
            centre=(0.0, np.sqrt(2.0)),
            force_x=0.0,
            force_y=-1e-3,
        ),
    ),
    contacts=(bk.ContactPair(("left.face", "disc")), bk.ContactPair(("disc", "right.face"))),
    discretisation=bk.Galerkin(2),
)


def test_a_disc_in_a_v_is_carried_by_both_sides() -> None:
    """By its centre, through which all forces of a frictionless disc go."""
    solution = solved(V)
    left, right = solution.contacts
    assert (left.force_y, right.force_y) == pytest.approx((-5e-4, -5e-4), rel=1e-10)
    assert left.force_x == pytest.approx(-right.force_x, rel=1e-10)
    for contact in (left, right):
        about_centre = contact.moment + np.sqrt(2.0) * contact.force_x
        # nodes in contact lie off the circle by the gap that was closed: 1e-3 of its size
        assert about_centre == pytest.approx(0.0, abs=1e-10 * contact.force_normal)
    disc = solution.rigid["disc"]
    assert disc.moment == pytest.approx(0.0, abs=1e-15)
    assert disc.x == pytest.approx(0.0, abs=1e-10 * abs(disc.y))  # meshes are mirror images


@pytest.mark.parametrize("push", slow_except([0.0, 3e-4], 3e-4))
def test_a_square_in_a_v_divides_its_weight_by_statics(push: float) -> None:
    """On its edge, so that contact forces are at 45 degrees exactly; a push from the side shifts them."""
    diamond = bk.RigidPolygon(((0.0, 0.0), (1.0, 1.0), (0.0, 2.0), (-1.0, 1.0)))
    body = replace(V.rigid[0], obstacle=diamond, force_x=push)
    left, right = solved(replace(V, rigid=(body,))).contacts
    assert left.force_normal == pytest.approx((1e-3 - push) / np.sqrt(2.0), rel=1e-10)
    assert right.force_normal == pytest.approx((1e-3 + push) / np.sqrt(2.0), rel=1e-10)


@pytest.mark.slow
def test_a_disc_that_contact_alone_holds_rests_between_two_blocks() -> None:
    """Its weight is the difference of what the blocks carry; also by the sparse form of many bodies."""
    weight, pressure = 1e-4, 1e-3
    upper = replace(
        BLOCK,
        name="upper",
        parts=(bk.Part("load", bk.Pressure(pressure), ("top",)), bk.Part("walls", bk.Roller(), ("left", "right"))),
        placement=bk.Placement((0.0, 2.0)),
    )
    disc = bk.RigidBody(
        name="disc",
        obstacle=bk.RigidCircle((1.0, 1.5), 0.5),
        centre=(1.0, 1.5),
        force_x=0.0,
        force_y=-weight,
        moment=0.0,
    )
    stack = replace(
        PRESSED,
        bodies=(BLOCK, upper),
        rigid=(disc,),
        contacts=(bk.ContactPair(("block.top", "disc")), bk.ContactPair(("disc", "upper.bottom"))),
        law=SOME,
    )
    solution = solved(stack)
    below, above = solution.contacts
    assert above.force_y == pytest.approx(2.0 * pressure, rel=1e-10)
    assert below.force_y == pytest.approx(-(2.0 * pressure + weight), rel=1e-10)
    assert solution.rigid["disc"].force_y == pytest.approx(-weight, rel=1e-10)
    weightless = solved(replace(stack, rigid=(replace(disc, force_y=0.0),)))
    assert weightless.certificate.force_imbalance < 1e-12  # though nothing remains of the forces on the disc
    model = build_model(prepare_steps([stack])[0])
    dense, sparse = (
        solve(replace(model.problem, body=replace(model.body, is_dense=is_dense)), stack.solver).state.traction
        for is_dense in (True, False)
    )
    np.testing.assert_allclose(sparse, dense, atol=1e-12 * np.abs(dense).max())


@pytest.mark.parametrize("law", slow_except([bk.Frictionless(), SOME], SOME))
@pytest.mark.parametrize("turn", slow_except([0.0, 30.0], 30.0))
def test_a_rigid_body_that_does_not_move_is_an_obstacle(law: bk.FrictionLaw, turn: float) -> None:
    """Also for a turned copy, whose own mesh is another."""
    placement = bk.Placement(turn=turn)
    nx, ny = placement.forward(np.array([[0.0, 1.0]]))[0].tolist()
    shear = 0.0 if law.is_frictionless else 0.2
    load = bk.Part("load", bk.Traction(*(FORCE * np.array([shear * ny - nx, -ny - shear * nx])).tolist()), ("top",))
    free = replace(BLOCK, parts=(load,), placement=placement)
    plane = bk.RigidHalfPlane((0.0, 0.0), (nx, ny))
    floor = bk.RigidBody(name="floor", obstacle=plane)
    pair = bk.ContactPair(("block.bottom", "floor"))
    rigid = solved(replace(PRESSED, bodies=(free,), rigid=(floor,), contacts=(pair,), law=law))
    held = replace(free, parts=(load, bk.Part("bottom", bk.Contact(plane), ("bottom",))))
    fixed = solved(replace(PRESSED, bodies=(held,), rigid=(), contacts=(), law=law))
    for name in ("sigma_n", "sigma_t", "u_n"):  # all of the size of the load, E being one
        one, other = getattr(rigid.contact, name), getattr(fixed.contact, name)
        np.testing.assert_allclose(one, other, rtol=0.0, atol=1e-10 * FORCE)
    np.testing.assert_allclose(rigid.contact.weight, fixed.contact.weight, rtol=1e-12)
    tractions = [one.bodies["block"].boundary.traction for one in (rigid, fixed)]
    np.testing.assert_allclose(*tractions, atol=1e-10 * FORCE)
    reaction = rigid.rigid["floor"]
    expected = 2.0 * FORCE * np.array([nx - shear * ny, ny + shear * nx])
    assert (reaction.force_x, reaction.force_y) == pytest.approx(tuple(expected), abs=1e-12)


def test_a_given_motion_is_felt_like_that_of_a_support() -> None:
    """The floor sinks and shifts with all that stands on it: nothing changes but the place."""
    load = bk.Part("load", bk.Pressure(FORCE), ("top",))
    bodies, pair = (replace(BLOCK, parts=(load,)),), bk.ContactPair(("block.bottom", "floor"))
    results = []
    for motion in ((0.0, 0.0, 0.0), (0.02, -0.05, 0.001)):
        x, y, turn = motion
        floor = bk.RigidBody(name="floor", obstacle=bk.RigidHalfPlane(), x=x, y=y, turn=turn)
        results.append(solved(replace(PRESSED, bodies=bodies, rigid=(floor,), contacts=(pair,), law=SOME)))
    still, moved = results
    atol = 1e-10 * FORCE  # of motions a few times as large as the deformation
    np.testing.assert_allclose(moved.contact.sigma_n, still.contact.sigma_n, atol=atol)
    boundary = still.bodies["block"].boundary
    floor = moved.scene.rigid[0]
    expected = boundary.displacement + floor.motions_at(boundary.points) @ floor.motion
    np.testing.assert_allclose(moved.bodies["block"].boundary.displacement, expected, atol=1e-10)


def test_a_turning_disc_drags_each_node_by_its_radius() -> None:
    """Whatever the gap: what a node may touch is a point of the disc, at the end of the gap."""
    disc = bk.RigidBody(name="punch", obstacle=bk.RigidCircle((1.0, 1.6), 0.5), centre=(1.0, 1.6), turn=0.01)
    (rows,) = prepare_steps([replace(PRESSED, rigid=(disc,), law=SOME)])[0].rows
    assert np.ptp(rows.gap) > 0.1
    assert rows.motions is not None
    dragged = np.einsum("nkc,ncm,m->nk", rows.frame, rows.motions, disc.motion)
    # tangents (-d_y, d_x) of directions d towards the centre run the other way round
    np.testing.assert_allclose(dragged, np.broadcast_to([0.0, -0.01 * 0.5], dragged.shape), atol=1e-16)


def test_a_circle_sticks_below_the_friction_and_is_refused_above() -> None:
    """A flat one: its normals at the nodes differ by 0.02, which friction of 0.3 turns into 2 % of its force."""
    middle = bk.Part("middle", bk.Free(), ("top",), bk.Expression("abs(x - 1) < 0.2"))
    roll = bk.RigidBody(name="roll", obstacle=bk.RigidCircle((1.0, 11.0), 10.0), centre=(1.0, 1.0), force_y=-FORCE)
    pair = bk.ContactPair(("block.middle", "roll"))
    block = replace(BLOCK, parts=(*BLOCK.parts, middle))
    on_block = replace(PRESSED, bodies=(block,), rigid=(roll,), contacts=(pair,), law=SOME)
    below = solved(replace(on_block, rigid=(replace(roll, force_x=0.28 * FORCE),)))
    assert below.rigid["roll"].force_x == pytest.approx(0.28 * FORCE, rel=1e-10)
    assert below.rigid["roll"].x > 0.0
    assert below.contacts[0].force_x == pytest.approx(0.28 * FORCE, rel=1e-10)
    with pytest.raises(UnsolvableSceneError, match="body 'roll'"):
        bk.run(replace(on_block, rigid=(replace(roll, force_x=0.33 * FORCE),)))
    # told to move far instead, it takes what friction holds
    dragged = solved(replace(on_block, rigid=(replace(roll, x=0.05),)))
    assert dragged.rigid["roll"].force_x == pytest.approx(0.3 * FORCE, rel=0.02)
    assert set(dragged.contact.status_words()) <= {"slip", "separated"}


@pytest.mark.parametrize(
    ("loads", "message"),
    [
        ({"force_y": FORCE}, "pushes body 'punch' away from body 'block'"),
        ({"moment": 0.6 * FORCE}, "tips body 'punch' away from body 'block'"),
        ({"force_x": 0.1 * FORCE}, "slides body 'punch' along body 'block'"),
    ],
)
def test_loads_that_contact_cannot_hold_name_the_rigid_body(loads: dict[str, float], message: str) -> None:
    with pytest.raises(UnsolvableSceneError, match=message):
        bk.run(driven(**loads))


@pytest.mark.slow
def test_shapes_of_one_circle_press_alike() -> None:
    """A polygon with 400 sides and a spline through 100 points, to their accuracy; a level set to round-off."""
    centre, radius = np.array([1.0, 2.0]), 1.0

    def points(n: int) -> tuple[tuple[float, float], ...]:
        angle = 2.0 * np.pi * (np.arange(n) + 0.5) / n
        at = centre + radius * np.stack([np.cos(angle), np.sin(angle)], axis=1)
        return tuple(map(tuple, at.tolist()))

    shapes = (
        (bk.RigidCircle((1.0, 2.0), 1.0), 0.0),
        (bk.SignedDistance(bk.Expression("hypot(x - 1, y - 2) - 1")), 1e-10),
        (bk.SignedDistance(bk.Expression("(x - 1)**2 + (y - 2)**2 - 1")), 1e-10),
        (bk.RigidSpline(points(100)), 1e-4),
        (bk.RigidPolygon(points(400)), 1e-2),
    )
    body = replace(PUNCH, centre=(1.0, 2.0))
    pressures = [solved(replace(PRESSED, rigid=(replace(body, obstacle=shape),), law=SOME)) for shape, _ in shapes]
    peak = pressures[0].contacts[0].peak_pressure
    for solution, (_, accuracy) in zip(pressures, shapes, strict=True):
        np.testing.assert_allclose(
            solution.contact.sigma_n, pressures[0].contact.sigma_n, rtol=0.0, atol=accuracy * peak
        )
        assert solution.rigid["punch"].force_y == pytest.approx(-FORCE, rel=1e-10)


def test_one_side_touches_the_nearest_of_several_rigid_bodies() -> None:
    rolls = tuple(
        bk.RigidBody(name=name, obstacle=bk.RigidCircle((x, 1.5), 0.5), centre=(x, 1.5), force_y=-force)
        for name, x, force in (("one", 0.5, FORCE), ("two", 1.5, FORCE / 2.0))
    )
    pairs = tuple(bk.ContactPair(("block.top", roll.name)) for roll in rolls)
    solution = solved(replace(PRESSED, rigid=rolls, contacts=pairs))
    assert [contact.force_y for contact in solution.contacts] == pytest.approx([-FORCE, -FORCE / 2.0], rel=1e-10)
    x = solution.contact.x
    assert x[solution.contact.rows("block.top / one")].max() <= 1.0 <= x[solution.contact.rows("block.top / two")].min()
    # each node stands for its own length, once
    assert solution.contact.weight.sum() == pytest.approx(2.0, rel=1e-12)


def test_a_side_between_an_elastic_and_a_rigid_body_passes_on_both_tractions() -> None:
    small = replace(
        BLOCK,
        name="small",
        shape=bk.Rectangle(0.5, 0.5),
        parts=(bk.Part("load", bk.Pressure(FORCE), ("top",)), bk.Part("wall", bk.Roller(), ("left",))),
        placement=bk.Placement((0.0, 1.0)),
        mesh=bk.MeshOptions(elements=40),
    )
    pairs = (*PRESSED.contacts, bk.ContactPair(("small.bottom", "block.top")))
    punch = replace(PUNCH, obstacle=bk.RigidCircle((1.5, 1.3), 0.3), centre=(1.5, 1.3))
    solution = solved(replace(PRESSED, bodies=(BLOCK, small), rigid=(punch,), contacts=pairs))
    top = next(force for force in solution.bodies["block"].part_forces if force.name.endswith("top"))
    # nodal forces are spread over whole elements: at the end of the small block over one that it does not touch
    assert top.force_y == pytest.approx(-1.5 * FORCE, rel=3e-2)


def test_steps_of_motions_and_forces_follow_each_other() -> None:
    """Down by force, sideways by motion, and back beyond the start: friction remembers."""
    steps = [replace(driven(x=x), law=SOME) for x in (0.0, 1e-3, 1e-2, -1e-2)]
    solutions = bk.run(steps)
    assert [one.is_converged for one in solutions] == [True] * 4
    forces = [one.rigid["punch"].force_x for one in solutions]
    assert abs(forces[0]) < 1e-12
    assert 0.0 < forces[1] < forces[2]
    # all slips one way, then the other
    assert (forces[2], forces[3]) == pytest.approx((0.3 * FORCE, -0.3 * FORCE), rel=1e-10)
    assert [one.rigid["punch"].force_y for one in solutions] == pytest.approx([-FORCE] * 4, rel=1e-10)
    pushed = bk.run([driven(), driven(force_y=-2.0 * FORCE)])
    assert pushed[1].rigid["punch"].y == pytest.approx(2.0 * pushed[0].rigid["punch"].y, rel=1e-10)
    with pytest.raises(
        bk.InputError, match="rigid body 'punch' changes its shape, its position or its given motions and loads"
    ):
        bk.run([driven(), driven(force_y=None, y=-1e-3)])
    more, pair = bk.RigidBody(name="more", obstacle=bk.RigidHalfPlane()), bk.ContactPair(("block.left", "more"))
    longer = replace(PRESSED, rigid=(PUNCH, more), contacts=(*PRESSED.contacts, pair))
    with pytest.raises(bk.InputError, match="rigid body 'more' changes its shape"):
        bk.run([driven(), longer])


@pytest.mark.slow
def test_load_factors_scale_motions_and_forces() -> None:
    """Sideways by a motion and down by a force, both in two steps: the last one has the whole of both."""
    scene = replace(driven(x=1e-2), law=SOME, load_factors=(0.5, 1.0))
    solution = bk.run(scene)
    assert solution.is_converged
    assert solution.stated == scene
    punch = solution.rigid["punch"]
    assert punch.x == pytest.approx(1e-2, rel=1e-12)
    assert punch.force_y == pytest.approx(-FORCE, rel=1e-10)
    assert punch.force_x == pytest.approx(0.3 * FORCE, rel=1e-10)  # all slips
    half = bk.run(replace(scene, load_factors=(0.5,)))
    assert half.rigid["punch"].x == pytest.approx(0.5e-2, rel=1e-12)
    assert half.rigid["punch"].force_y == pytest.approx(-0.5 * FORCE, rel=1e-10)


@pytest.mark.slow
@pytest.mark.parametrize("scale", [1e-9, 1e9])
def test_forces_and_motions_set_the_units(scale: float) -> None:
    """No other load is there to measure by: results are those of another unit of force."""
    for changes, name in (({"force_y": -scale * FORCE}, "y"), ({"force_y": None, "y": -scale * FORCE}, "force_y")):
        unit = {key: value if value is None else value / scale for key, value in changes.items()}
        expected = getattr(solved(driven(**unit)).rigid["punch"], name)
        assert getattr(solved(driven(**changes)).rigid["punch"], name) == pytest.approx(scale * expected, rel=1e-10)


@pytest.mark.parametrize(
    ("changes", "expected"),
    [
        ({"force_y": -3.0}, 3.0 / np.sqrt(5.0)),
        ({"moment": 30.0}, 30.0 / 5.0),
        ({"force_y": None, "y": -3.0}, 3.0 / np.sqrt(5.0) * STEEL.plane_modulus),
        ({"force_y": None, "turn": 3.0}, 3.0 * STEEL.plane_modulus),
    ],
)
def test_the_unit_of_stress_is_that_of_the_largest_force_or_motion(
    changes: dict[str, float | None], expected: float
) -> None:
    units = prepare_steps([driven(**changes)])[0].units
    assert units.length == pytest.approx(np.sqrt(5.0), rel=1e-12)
    assert units.stress == pytest.approx(expected, rel=1e-12)


def test_a_body_that_hangs_above_comes_down_and_one_without_force_stays() -> None:
    high = replace(PUNCH, obstacle=bk.RigidPolygon(((0.5, 1.1), (1.5, 1.1), (1.5, 1.5), (0.5, 1.5))))
    down = solved(replace(PRESSED, rigid=(high,))).rigid["punch"]
    assert down.y + 0.1 == pytest.approx(solved(PRESSED).rigid["punch"].y, rel=1e-10)
    still = solved(driven(force_y=0.0))
    assert still.rigid["punch"].y == 0.0
    assert np.abs(still.contact.sigma_n).max() == 0.0


def test_a_corner_that_ploughs_aside_is_warned_of() -> None:
    """More than friction holds: only nodes beside the corner hold the punch, at their nearest points, obliquely."""
    mesh = bk.MeshOptions(elements=200)
    above = bk.RigidPolygon(((0.5, 1.001), (1.5, 1.001), (1.5, 1.5), (0.5, 1.5)))
    punch = replace(PUNCH, obstacle=above, force_x=0.4 * FORCE)
    solution = bk.run(replace(PRESSED, bodies=(replace(BLOCK, mesh=mesh),), rigid=(punch,), law=SOME))
    (warning,) = (each for each in solution.warnings if each.kind == "oblique contact")
    assert "Contact 'block.top / punch' touches the rigid body at up to" in warning.text
    assert not any(each.kind == "oblique contact" for each in solved(replace(PRESSED, law=SOME)).warnings)


def test_what_overlaps_unmeant_is_refused_and_an_interference_presses() -> None:
    deep = replace(PUNCH, obstacle=bk.RigidCircle((1.0, 1.499), 0.5), force_y=None)
    with pytest.raises(OverlapError, match=r"contact 'block.top / punch': the bodies overlap by 0.001 at \(1, 1\)"):
        bk.run(replace(PRESSED, rigid=(deep,)))
    meant = replace(PRESSED, rigid=(deep,), contacts=(bk.ContactPair(("block.top", "punch"), interference=2e-3),))
    apart = replace(deep, obstacle=bk.RigidCircle((1.0, 1.5), 0.5))
    by_gap = replace(PRESSED, rigid=(apart,), contacts=(bk.ContactPair(("block.top", "punch"), gap=-1e-3),))
    by_motion = replace(PRESSED, rigid=(replace(apart, y=-1e-3),))
    forces = [solved(each).rigid["punch"].force_y for each in (meant, by_gap, by_motion)]
    assert forces[0] < 0.0
    assert forces == pytest.approx([forces[0]] * 3, rel=2e-2)  # arcs that differ by a thousandth of their radius


def test_meshes_follow_the_solution_under_a_rigid_body() -> None:
    roll = replace(PUNCH, obstacle=bk.RigidCircle((1.0, 2.0), 1.0))
    block = replace(BLOCK, mesh=None)
    assembly = replace(PRESSED, bodies=(block,), rigid=(roll,), mesh=bk.MeshOptions(accuracy=0.03))
    last = run_adaptive(assembly)[-1]
    assert last.is_converged
    mesh = last.bodies["block"].mesh
    is_near = np.hypot(*(mesh.centres - [1.0, 1.0]).T) < 0.1
    assert mesh.lengths[is_near].max() < 0.2 * mesh.lengths[~is_near].max()


def test_every_output_tells_of_rigid_bodies(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    solution = solved(driven(moment=0.0))
    bk.write_result(tmp_path / "r.h5", solution)
    copy = bk.read_result(tmp_path / "r.h5")
    assert isinstance(copy, Solution)
    assert copy.rigid == solution.rigid
    assert copy.summary() == solution.summary()
    assert '"rigid": {' in to_json(solution)
    assert solution.summary()["rigid"]["punch"]["y"] == solution.rigid["punch"].y
    items = {item.name: item.reason for item in solution.plan.items}
    assert items["rigid bodies"] == "1 in 1 contact, 2 motions driven by loads"
    print_summary(solution)
    assert "moved by (0, " in " ".join(capsys.readouterr().out.split())
    axes = draw_deformation(solution)
    legend = [text.get_text() for text in axes.get_legend().get_texts()]
    assert "rigid body" in legend
    before, after = axes.patches[-2:]
    factor = float(legend[1].split("\u00d7 ")[1])
    moved = after.get_path().vertices[0] - before.get_path().vertices[0]
    assert moved[1] == pytest.approx(factor * solution.rigid["punch"].y, rel=1e-6)
