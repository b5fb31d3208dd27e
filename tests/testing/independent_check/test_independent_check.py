"""The independent check passes right answers and objects to every kind of wrong one."""

from __future__ import annotations

import dataclasses
from functools import lru_cache

import numpy as np
import pytest

import bemkit as bk
from bemkit.testing.independent_check import Violations, violations_of
from bemkit.testing.independent_check.obstacles import distance_to
from tests.scenes import CONSTANT, FLOOR, LINEAR, block, small_paper_scene
from tests.slow import slow_only
from tests.testing.independent_check.company import first_body, in_company, with_body

IN_BOTH = pytest.mark.parametrize("among", slow_only([False, True], True), ids=["one body", "one of several"])
PLACES = pytest.mark.parametrize(
    ("discretisation", "among"), slow_only([(LINEAR, False), (CONSTANT, False), (LINEAR, True)], (LINEAR, True))
)


@lru_cache
def solved(number: int, discretisation: bk.Galerkin | bk.ConstantCollocation, among: bool) -> bk.Solution:
    return run(small_paper_scene(number, discretisation=discretisation), among)


def run(scene: bk.Scene, among: bool) -> bk.Solution:
    return bk.run(in_company(scene) if among else scene)


@PLACES
@pytest.mark.parametrize("number", [1, 2])
def test_right_answers_pass(number: int, discretisation: bk.Galerkin, among: bool) -> None:
    check = violations_of(solved(number, discretisation, among))
    assert check.worst <= 1e-12  # a solved system of this size carries about 1e-15
    assert check.is_good
    assert not check.is_coarse
    assert check.reciprocity <= (0.03 if among else 0.02)  # the discretisation error at N = 64, of 16 in the company


def test_forces_at_held_corners_have_the_normal_of_their_own_side() -> None:
    """Across the wall of a ring, nearer than the next node of that side, another part of the contact faces away."""
    contact = bk.Part("contact", bk.Contact(bk.Gap(-1e-3)), ("outer-4", "inner-3"))
    held = bk.Part("held", bk.PrescribedDisplacement(x=1e-4, y=0.0), ("inner-4",))
    solution = run(block(contact, held, shape=bk.Ring(0.8, 1.0), discretisation=LINEAR, mesh=bk.MeshOptions(36)), False)
    assert violations_of(solution).table <= 1e-12


def tampered(solution: bk.Solution, **columns: np.ndarray) -> Violations:
    return violations_of(dataclasses.replace(solution, contact=dataclasses.replace(solution.contact, **columns)))


def with_displacement(solution: bk.Solution, row: int, shift: np.ndarray) -> Violations:
    boundary = first_body(solution).boundary
    displacement = boundary.displacement.copy()
    displacement[row] += shift
    return violations_of(with_body(solution, boundary=dataclasses.replace(boundary, displacement=displacement)))


def changed(solution: bk.Solution, name: str, node: int, factor: float) -> np.ndarray:
    column = getattr(solution.contact, name).copy()
    column[node] *= factor
    return column


def slipping_node(solution: bk.Solution) -> int:
    table = solution.contact
    return int(np.argmax(np.where(table.status > 1, np.abs(table.u_t), 0.0)))


@PLACES
def test_each_violation_of_contact_is_seen_under_its_name(discretisation: bk.Galerkin, among: bool) -> None:
    solution = solved(1, discretisation, among)
    table = solution.contact
    pressed, slipping, is_open = int(np.argmin(table.sigma_n)), slipping_node(solution), int(np.argmax(table.clearance))
    length = float(np.abs(table.u_n).max())
    row = int(np.argmin(np.hypot(*(first_body(solution).boundary.points - [table.x[pressed], table.y[pressed]]).T)))
    assert with_displacement(solution, row, np.array([0.0, -1e-3 * length])).penetration > 1e-6
    assert with_displacement(solution, row, np.array([0.0, 1e-3 * length])).complementarity > 1e-6
    tension = table.sigma_n.copy()
    tension[is_open] = 1e-3
    seen = tampered(solution, sigma_n=tension)
    assert min(seen.tension, seen.complementarity, seen.status) > 1e-4
    assert tampered(solution, sigma_t=changed(solution, "sigma_t", slipping, 1.01)).cone_excess > 1e-4
    assert tampered(solution, sigma_t=changed(solution, "sigma_t", slipping, 0.99)).slip_opposition > 1e-4
    assert tampered(solution, sigma_t=changed(solution, "sigma_t", slipping, -1.0)).slip_opposition > 1e-4
    assert tampered(solution, sigma_n=changed(solution, "sigma_n", pressed, 1.01)).equilibrium > 1e-5
    assert tampered(solution, gap=table.gap + 1e-3 * length).gaps > 1e-6


@PLACES
def test_a_table_that_is_not_that_of_the_boundary_is_seen(discretisation: bk.Galerkin, among: bool) -> None:
    solution = solved(1, discretisation, among)
    table, slipping = solution.contact, slipping_node(solution)
    assert tampered(solution, u_t=changed(solution, "u_t", slipping, 1.01)).table > 1e-6
    assert tampered(solution, clearance=table.clearance - 1e-3 * np.abs(table.u_n).max()).table > 1e-6
    assert tampered(solution, x=table.x + 1e-6).table > 1e-6
    assert tampered(solution, sigma_t=changed(solution, "sigma_t", slipping, 1.01)).tractions > 1e-5
    *others, contact = solution.contacts
    assert contact.name.endswith("foundation")
    for wrong in ({"force_normal": 1.01 * contact.force_normal}, {"force_tangential": 0.0}):
        reported = dataclasses.replace(solution, contacts=(*others, dataclasses.replace(contact, **wrong)))
        assert violations_of(reported).table > 1e-6


@IN_BOTH
def test_displacements_of_nodes_that_face_away_are_compared(among: bool) -> None:
    floor = bk.Part("floor", bk.Contact(bk.RigidHalfPlane()), sides=("bottom", "left"))
    load = bk.Part("load", bk.Pressure(1e-3), ("top",))
    solution = run(block(floor, load, mesh=bk.MeshOptions(20)), among)
    assert violations_of(solution).faults == ()
    away = int(np.flatnonzero(np.isinf(solution.contact.gap))[0])
    assert tampered(solution, u_n=changed(solution, "u_n", away, 1.01)).faults == ("table",)


@PLACES
def test_a_turned_direction_of_contact_is_seen(discretisation: bk.Galerkin, among: bool) -> None:
    """As if contact acted along a direction that is 5 degrees off, everything else consistent."""
    solution = solved(1, discretisation, among)
    table, (cosine, sine) = solution.contact, (np.cos(np.radians(5.0)), np.sin(np.radians(5.0)))
    turned = {
        "u_n": cosine * table.u_n + sine * table.u_t,
        "u_t": cosine * table.u_t - sine * table.u_n,
        "sigma_n": cosine * table.sigma_n + sine * table.sigma_t,
        "sigma_t": cosine * table.sigma_t - sine * table.sigma_n,
    }
    seen = tampered(solution, **turned, clearance=table.gap - turned["u_n"])
    assert min(seen.table, seen.tractions, seen.equilibrium) > 1e-4


@PLACES
def test_a_wrong_status_is_seen(discretisation: bk.Galerkin, among: bool) -> None:
    solution = solved(1, discretisation, among)
    table, slipping = solution.contact, slipping_node(solution)
    pressed, is_open = int(np.argmin(table.sigma_n)), int(np.argmax(table.clearance))
    assert sorted(set(table.status.tolist())) == [0, 1, 3]  # backward slip only, so that each claim below is wrong
    for node, claim in ((slipping, 0), (slipping, 1), (slipping, 2), (is_open, 1), (is_open, 3), (pressed, 0)):
        status = table.status.copy()
        status[node] = claim
        seen = tampered(solution, status=status)
        assert seen.faults == ("status",), (node, claim)


@PLACES
def test_wrong_supports_loads_and_energies_are_seen(discretisation: bk.Galerkin, among: bool) -> None:
    moved = bk.Part("top", bk.PrescribedDisplacement(x=0.002, y=-0.01), sides=("top",))
    wind = bk.Part("wind", bk.Pressure(1e-4), sides=("left",))
    solution = run(block(FLOOR, moved, wind, discretisation=discretisation), among)
    body = first_body(solution)
    points, mesh = body.boundary.points, body.mesh
    assert violations_of(solution).worst <= 1e-12
    top = int(np.argmax(points[:, 1] - 0.01 * np.abs(points[:, 0] - 0.5)))
    assert with_displacement(solution, top, np.array([0.0, 1e-6])).faults[0] == "supports"
    assert with_displacement(solution, top, np.array([1e-6, 0.0])).faults[0] == "supports"
    for side in ("wind", "right"):  # loaded, and free of traction
        elements = mesh.part(side) if side == "wind" else np.flatnonzero(mesh.centres[:, 0] > 0.9999)
        traction = body.boundary.traction.copy()
        traction[elements[0], 0] += 1e-5
        boundary = dataclasses.replace(body.boundary, traction=traction)
        assert violations_of(with_body(solution, boundary=boundary)).faults == ("tractions",)
    negative = violations_of(with_body(solution, energy=-body.energy))
    assert negative.faults == ("negative_energy",)


@PLACES
def test_energy_is_the_work_of_the_loads(discretisation: bk.Galerkin, among: bool) -> None:
    solution = solved(1, discretisation, among)
    energy = first_body(solution).energy
    assert violations_of(solution).energy <= 1e-12
    assert violations_of(with_body(solution, energy=1.001 * energy)).faults == ("energy",)
    assert set(violations_of(with_body(solution, energy=-energy)).faults) == {"energy", "negative_energy"}


@IN_BOTH
def test_numbers_that_are_none_are_seen(among: bool) -> None:
    solution = solved(1, LINEAR, among)
    for name in ("u_t", "sigma_n", "gap"):
        seen = tampered(solution, **{name: changed(solution, name, 3, np.nan)})
        assert seen.faults[0] == "numbers"
        assert not seen.is_good
    assert not violations_of(with_body(solution, energy=np.inf)).is_good


@IN_BOTH
def test_slip_counts_from_the_step_before(among: bool) -> None:
    scene = dataclasses.replace(small_paper_scene(1), load_factors=(1.0, 0.5))
    first, second = bk.run([in_company(scene) if among else scene])
    assert violations_of(first).is_good
    assert violations_of(second, first).is_good
    assert violations_of(second).is_good  # which step it is it says itself
    static = dataclasses.replace(second, loading=None)
    assert "status" in violations_of(static).faults  # sticking nodes moved with the first step


def test_round_off_of_a_large_step_is_no_slip_in_a_small_one() -> None:
    """Tangents of curved sides are known to some digits, which a step back to rest cannot be told from."""
    arc = bk.Part("arc", bk.Contact(bk.Gap(0.01)), sides=("arc",))
    held, pulled = bk.Part("held", bk.Clamped(), sides=("start",)), bk.Part("end", bk.Traction(-1e-6), sides=("end",))
    shape = bk.Sector(0.5, 0.0, 263.0, centre=(0.44, -1.71))
    options = {"law": bk.Tresca(1e-3), "load_factors": (1.0, 0.0), "solver": bk.LemkePivoting()}
    scene = block(arc, held, pulled, shape=shape, **options)
    first, second = bk.run([scene])
    assert set(first.contact.status_words() + second.contact.status_words()) == {"separated"}
    assert violations_of(first).is_good
    assert violations_of(second, first).is_good


@pytest.mark.parametrize(("share", "is_good"), [(1e-17, True), (1e-9, False)])
def test_tractions_that_a_large_step_leaves_are_measured_by_its_own(share: float, is_good: bool) -> None:
    """After unloading nothing is left but round-off of what was there, which may be tension here and there."""
    load = bk.Part("load", bk.Traction(y=-1.0), sides=("top",))
    first, second = bk.run([block(FLOOR, load, load_factors=(1.0, 0.0))])
    assert not second.contact.sigma_n.any()
    left = share * np.abs(first.contact.sigma_n).max() * (-1.0) ** np.arange(second.contact.n_contact)
    second = dataclasses.replace(second, contact=dataclasses.replace(second.contact, sigma_n=left))
    assert violations_of(second, first).is_good is is_good


@IN_BOTH
def test_a_node_that_carries_load_above_the_floor_is_seen(among: bool) -> None:
    """One node 1 mm above the floor with 100 Pa on it, all else in equilibrium: nothing touches."""
    solution = solved(1, LINEAR, among)
    table = solution.contact
    lifted = tampered(solution, gap=table.gap + 1e-3, clearance=table.clearance + 1e-3)
    assert {"complementarity", "status", "gaps"} <= set(lifted.faults)


@PLACES
def test_displacements_of_another_body_are_seen(discretisation: bk.Galerkin, among: bool) -> None:
    solution = solved(2, discretisation, among)
    body = first_body(solution)
    boundary = dataclasses.replace(body.boundary, displacement=2.0 * body.boundary.displacement)
    assert violations_of(with_body(solution, boundary=boundary)).is_coarse
    softer = dataclasses.replace(body.scene, material=bk.Material(5e3, 0.3))
    assert violations_of(with_body(solution, scene=softer)).is_coarse


def test_rigid_motions_do_not_hide_anything() -> None:
    pressed = bk.Part("top", bk.Pressure(1.0), sides=("top",))
    solution = bk.run(block(FLOOR, pressed, bk.Part("wall", bk.Roller(), sides=("right",))))
    far = dataclasses.replace(solution.boundary, displacement=solution.boundary.displacement + np.array([0.0, 1e3]))
    assert violations_of(with_body(solution, boundary=far)).reciprocity == pytest.approx(
        violations_of(solution).reciprocity, abs=1e-9
    )


def test_tresca_friction_across_a_gap_and_loose_bodies_pass() -> None:
    push = bk.Part("push", bk.Pressure(0.1), sides=("left",))
    load = bk.Part("load", bk.Traction(y=bk.Expression("-x")), sides=("top",))
    for law in (bk.Tresca(0.3), bk.Coulomb(bk.Expression("0.2 + x"))):
        for discretisation in (LINEAR, CONSTANT):
            check = violations_of(bk.run(block(FLOOR, push, load, law=law, discretisation=discretisation)))
            assert check.worst <= 1e-9


def test_a_body_that_an_overlap_pushed_aside_shows_the_smallest_traction_left_on_it() -> None:
    inside = bk.Part("inside", bk.Contact(bk.RigidCircle((0.5, -9.99), 10.0)), sides=("bottom",))
    solution = bk.run(block(inside))
    table = solution.contact
    assert violations_of(solution).is_good
    assert violations_of(solution).tension == 0.0
    # 1e-12 E' per displacement of the body's size: a thousandth of what the old measure, the overlap, let pass
    per_strain = solution.scene.material.plane_modulus * float(np.abs(table.u_n).max())

    def tension(share: float) -> float:
        left = np.zeros(table.n_contact)
        left[3] = share * per_strain
        return tampered(solution, sigma_n=left).tension

    assert tension(1e-12) > 1e-6
    assert tension(1e-14) <= 1e-6  # some eps, divided by the share of an element in the body
    displacement = solution.boundary.displacement - np.array([0.0, 1e-6 * float(np.abs(table.u_n).max())])
    inward = with_body(solution, boundary=dataclasses.replace(solution.boundary, displacement=displacement))
    assert violations_of(inward).penetration > 1e-6


def test_polygonal_obstacles_and_given_directions_are_measured_anew() -> None:
    points = np.array([[0.3, 1.5], [-1.0, 1.4], [2.0, 0.2], [0.5, 0.9], [0.0, 1.0], [0.4, 1.0]])
    normals = np.tile([0.0, -1.0], (len(points), 1))
    for vertices in ([[0, 0], [1, 0], [1, 1], [0, 1]], [[0, 1], [1, 1], [1, 0], [0, 0]]):
        square = bk.RigidPolygon(tuple((float(x), float(y)) for x, y in vertices))
        distance, direction = distance_to(square, points, normals)
        assert distance == pytest.approx([0.5, np.hypot(1.0, 0.4), 1.0, -0.1, 0.0, 0.0], abs=1e-15)
        corner = np.array([1.0, -0.4]) / np.hypot(1.0, 0.4)
        # at the corner itself either side will do
        assert direction[[0, 1, 2, 3, 5]] == pytest.approx(
            np.array([[0.0, -1.0], corner, [-1.0, 0.0], [0.0, -1.0], [0.0, -1.0]]), abs=1e-15
        )
    given = bk.Gap(0.1, direction=(bk.Expression("3 + 0 * x"), -4.0))
    distance, direction = distance_to(given, points, normals)
    assert distance == pytest.approx(np.full(len(points), 0.1))
    assert direction == pytest.approx(np.tile([0.6, -0.8], (len(points), 1)))


@IN_BOTH
def test_nodes_that_supports_push_into_an_obstacle_need_a_warning(among: bool) -> None:
    pushed = bk.Part("wall", bk.PrescribedDisplacement(y=-0.01), sides=("right",))
    check = violations_of(run(block(FLOOR, pushed), among))
    assert check.is_good
    assert check.held_overlap > 0.01  # a share of what the corner moves by, the rest is the way of the whole block
    assert check.needs_warning == "held_overlap"


@IN_BOTH
def test_elements_whose_nodes_supports_hold_pass(among: bool) -> None:
    """One element between clamped ones has reactions, and no row in the table; the ceiling gives the table others."""
    places = {"left": "x <= 0.49", "floor": "x > 0.49 and x < 0.51", "right": "x >= 0.51"}
    left, floor, right = (
        bk.Part(name, FLOOR.condition if name == "floor" else bk.Clamped(), ("bottom",), where=bk.Expression(place))
        for name, place in places.items()
    )
    ceiling = bk.Part("ceiling", bk.Contact(bk.RigidHalfPlane((0.0, 1.0), (0.0, -1.0))), ("top",))
    push = bk.Part("push", bk.Pressure(1e-3), ("left",))
    solution = run(block(left, floor, right, ceiling, push, discretisation=LINEAR, mesh=bk.MeshOptions(40)), among)
    assert "floor" not in {name.split(".")[-1] for name in solution.contact.parts}
    assert violations_of(solution).faults == ()
