"""Violations between the nodes of several bodies: known ones are found, on either side and at obstacles that move."""

from __future__ import annotations

import json
from dataclasses import replace
from itertools import count
from pathlib import Path

import h5py
import numpy as np
import pytest

import bemkit as bk
from bemkit.results import between_bodies
from bemkit.results.between_nodes import BetweenNodes
from bemkit.results.result_file import read_result, write_result
from bemkit.results.solution import Solution
from bemkit.results.solved_body import SideName
from bemkit.results.tables import to_json
from bemkit.results.warnings import LARGEST_PENETRATION, find_warnings
from tests.runs.test_assembly import SHEAR, patch
from tests.slow import slow_except

DEPTH, RISE = 1e-3, 0.3


def measured(solution: Solution | bk.Solution) -> BetweenNodes:
    assert solution.between_nodes is not None
    return solution.between_nodes


@pytest.fixture(scope="module")
def pressed() -> Solution:
    """Two quadratic blocks whose meshes do not match, under a pressure of one and a shear."""
    solution = bk.run(patch(2))
    assert solution.is_converged
    return solution


def changed(solution: Solution, body: str, displacement: float = 0.0, normal: float = 0.0) -> BetweenNodes:
    """Raise the first node of a contact element of a body, or tilt the normal tractions there around their mean."""
    own = solution.bodies[body]
    element = int(own.mesh.part({"upper": "bottom", "lower": "top"}[body])[2])
    u, t = own.boundary.displacement.copy(), own.boundary.traction_dofs.copy()
    u[own.scene.discretisation.displacement_space(own.mesh).element_dofs[element, 0], 1] += displacement
    t[2 * element : 2 * element + 2] += np.outer([-1.0, 1.0], [0.0, normal])
    moved = replace(own, boundary=replace(own.boundary, displacement=u, traction_dofs=t))
    return measured(replace(solution, bodies={**solution.bodies, body: moved}))


@pytest.mark.parametrize("degree", [0, 1, 2, 4])
@pytest.mark.parametrize("turn", slow_except([0.0, 33.0], 33.0))
def test_uniform_contact_is_perfect_between_the_nodes_too(degree: int, turn: float) -> None:
    assembly = patch(max(degree, 1), turn=turn)
    if not degree:
        # without friction, whose rest of a coarse mesh is not a uniform field of constant elements
        assembly = replace(assembly, discretisation=bk.ConstantCollocation())
        assert measured(bk.run(assembly)).penetration < 0.05  # collocation is exact for no linear field
        return
    assert measured(bk.run(assembly)).worst <= 1e-9  # the fields are exact to the round-off of bodies of condition 1e4


@pytest.mark.parametrize(("body", "sign"), [("upper", -1.0), ("lower", 1.0)])
def test_a_node_of_either_side_is_seen_to_penetrate(pressed: Solution, body: str, sign: float) -> None:
    found = changed(pressed, body, sign * DEPTH)
    assert found.penetration_depth == pytest.approx(DEPTH, rel=1e-9)  # at an end of a piece
    force = np.hypot(1.0, SHEAR)  # of the tractions on a width of one
    modulus = pressed.bodies["upper"].scene.material.plane_modulus
    assert found.penetration == pytest.approx(DEPTH * modulus / force, rel=1e-8)
    opened = changed(pressed, body, -sign * DEPTH)
    # a parabola, zero at the middle and at the other end: -DEPTH / 8 between them, on pieces of unequal lengths
    assert opened.penetration_depth == pytest.approx(DEPTH / 8.0, rel=0.02)
    assert opened.complementarity == pytest.approx(DEPTH * modulus / force, rel=1e-8)


@pytest.mark.parametrize("body", ["upper", "lower"])
def test_tension_on_either_side_is_seen(pressed: Solution, body: str) -> None:
    assert changed(pressed, body).tension == 0.0
    size = np.hypot(1.0, SHEAR)
    assert changed(pressed, body, normal=1.0 + RISE).tension == pytest.approx(RISE / size, rel=1e-8)


@pytest.mark.parametrize("turn", slow_except([0.0, 33.0], 33.0))
def test_pairs_that_are_copies_of_each_other_are_measured_as_if_alone(
    turn: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Three pairs of blocks; a node of the second one moves, and the contact there, and no other, sees it."""
    pair = patch(2)
    base, load = bk.Part("base", bk.Clamped(), ("bottom",)), bk.Part("load", bk.Pressure(1.0), ("top",))
    places = bk.ListedCopies(tuple(bk.Placement((3.0 * k, 0.0), turn * k) for k in range(3)))
    lower, upper = (
        replace(each, parts=(part,), copies=places) for each, part in zip(pair.bodies, (base, load), strict=True)
    )
    contacts = tuple(bk.ContactPair((f"upper-{k}.bottom", f"lower-{k}.top"), reach=0.1) for k in (1, 2, 3))
    solution = bk.run(replace(pair, bodies=(lower, upper), contacts=contacts))
    moved = solution.bodies["upper-2"]
    u = moved.boundary.displacement.copy()
    node = moved.scene.discretisation.displacement_space(moved.mesh).element_dofs[moved.mesh.part("bottom")[2], 1]
    u[node] += bk.Placement(turn=turn).rotation @ [0.0, -DEPTH]
    solution = replace(
        solution,
        bodies={**solution.bodies, "upper-2": replace(moved, boundary=replace(moved.boundary, displacement=u))},
    )
    alike = [each.as_dict() for each in solution.contacts_between_nodes.values()]
    assert [each["penetration_depth"] > 0.5 * DEPTH for each in alike] == [False, True, False]
    keys = count()
    monkeypatch.setattr(between_bodies, "congruence_key", lambda one, two, reach: next(keys))
    alone = [each.as_dict() for each in replace(solution).contacts_between_nodes.values()]
    assert next(keys) == 3
    for one, other in zip(alike, alone, strict=True):
        assert one == pytest.approx(other, abs=1e-12)  # round-off of coordinates of ten


def test_a_light_contact_is_not_judged_by_a_heavy_one(pressed: Solution) -> None:
    """The same pair once more, a hundred times less loaded: the same depth is a hundred times worse."""
    base, aside = pressed.scene, bk.Placement((5.0, 0.0))
    weak = [
        replace(body, name=f"weak {body.name}", placement=aside.after(body.placement), parts=body.parts[-2:])
        for body in base.bodies
    ]
    pair = bk.ContactPair(("weak upper.bottom", "weak lower.top"))
    assembly = replace(base, bodies=(*base.bodies, *weak), contacts=(*base.contacts, pair))
    table, bodies = pressed.contact, dict(pressed.bodies)
    for body in ("upper", "lower"):
        own = bodies[body]
        u = own.boundary.displacement - (DEPTH if body == "upper" else 0.0) * np.array([0.0, 1.0])
        bodies[body] = replace(own, boundary=replace(own.boundary, displacement=u))
        bodies[f"weak {body}"] = replace(bodies[body], name=f"weak {body}")
    both = replace(
        table,
        part=(*table.part, *(pair.name for _ in table.part)),
        **{name: np.concatenate([column, column]) for name, column in table.columns().items()},
    )
    share = np.repeat([1.0, 0.01], table.n_contact)
    both = replace(both, sigma_n=share * both.sigma_n, sigma_t=share * both.sigma_t)
    ((strong_name, strong_sides),) = pressed.contact_sides.items()
    weak_sides = tuple(SideName(f"weak {side.body}", side.part) for side in strong_sides)
    sides = {strong_name: strong_sides, pair.name: weak_sides}
    merged = replace(pressed, scene=assembly, contact=both, bodies=bodies, contact_sides=sides)
    found = merged.contacts_between_nodes
    strong, light = (found[each.name].penetration for each in assembly.contacts)
    assert light == pytest.approx(100.0 * strong, rel=1e-12)


def test_a_contact_without_forces_is_measured_by_what_its_own_bodies_move(pressed: Solution) -> None:
    """A third body, which touches nothing, is carried a million times as far."""
    far, own = replace(pressed.bodies["upper"], name="far"), pressed.bodies["upper"].boundary
    bodies = {**pressed.bodies, "far": replace(far, boundary=replace(own, displacement=1e6 + own.displacement))}
    table = replace(pressed.contact, sigma_n=np.zeros_like(pressed.contact.s), sigma_t=np.zeros_like(pressed.contact.s))
    found = changed(replace(pressed, contact=table, bodies=bodies), "upper", -DEPTH)
    moved = max(float(np.hypot(*body.boundary.displacement.T).max()) for body in pressed.bodies.values())
    assert found.penetration == pytest.approx(DEPTH / moved, rel=1e-9)


def test_a_contact_with_a_rigid_obstacle_is_that_of_one_body() -> None:
    scene = replace(bk.load_scene("paper-1"), discretisation=bk.Galerkin(2), mesh=bk.MeshOptions(elements=40))
    body = bk.Body(name="square", shape=scene.shape, material=scene.material, parts=scene.parts)
    assembly = bk.Scene(title="x", bodies=(body,), law=scene.law, discretisation=scene.discretisation, mesh=scene.mesh)
    alone, one_of_one = bk.run(scene), bk.run(assembly)
    assert measured(alone).worst > 1e-3  # there is something to compare
    for name, value in measured(alone).as_dict().items():
        assert measured(one_of_one).as_dict()[name] == pytest.approx(value, rel=1e-6, abs=1e-12), name


def test_an_obstacle_that_moves_is_measured_where_it_is() -> None:
    block = bk.Body(
        name="block",
        shape=bk.Rectangle(2.0, 1.0),
        material=bk.Material(1.0, 0.3),
        parts=(bk.Part("base", bk.Clamped(), ("bottom",)),),
        mesh=bk.MeshOptions(elements=60),
    )
    disc = bk.RigidBody(name="disc", obstacle=bk.RigidCircle((1.0, 2.0), 1.0), centre=(1.0, 2.0), x=0.0, turn=0.0)
    pair = bk.ContactPair(("block.top", "disc"))
    pressed = bk.Scene(
        title="x", bodies=(block,), rigid=(replace(disc, y=-0.01),), contacts=(pair,), discretisation=bk.Galerkin(2)
    )
    gap = replace(pressed, rigid=(replace(disc, y=0.0),), contacts=(replace(pair, gap=-0.01),))
    moved, near = bk.run(pressed), bk.run(gap)
    assert measured(moved).worst < 0.5
    # the directions of contact differ by no more than round-off, the gap along them by the cosine of small angles
    assert measured(moved).penetration_depth == pytest.approx(measured(near).penetration_depth, rel=0.1)
    lost = replace(moved.rigid["disc"], y=-0.02)
    deeper = measured(replace(moved, rigid={"disc": lost}))
    assert deeper.penetration_depth == pytest.approx(0.01, rel=0.02)


def coarse_disc(elements: int) -> bk.Scene:
    """A disc of constant elements between a plate that is clamped and one that comes down: it touches at two points."""
    common = {"material": bk.Material(1.0, 0.3), "mesh": bk.MeshOptions(elements=40)}
    plate = bk.Rectangle(2.0, 1.0)
    low = bk.Body(name="low", shape=plate, parts=(bk.Part("base", bk.Clamped(), ("bottom",)),), **common)
    press = bk.Part("press", bk.PrescribedDisplacement(0.0, -1e-3), ("top",))
    high = bk.Body(name="high", shape=plate, parts=(press,), placement=bk.Placement((0.0, 2.0)), **common)
    halves = (bk.Part("down", bk.Free(), ("arc-3", "arc-4")), bk.Part("up", bk.Free(), ("arc-1", "arc-2")))
    disc = bk.Body(
        name="disc",
        shape=bk.Disk(0.5, (1.0, 1.5)),
        material=bk.Material(1.0, 0.3),
        parts=halves,
        mesh=bk.MeshOptions(elements=elements),
    )
    return bk.Scene(
        title="x",
        bodies=(low, high, disc),
        contacts=(bk.ContactPair(("low.top", "disc.down")), bk.ContactPair(("disc.up", "high.bottom"))),
        law=bk.Coulomb(0.5),
        discretisation=bk.ConstantCollocation(),
    )


def test_bodies_that_only_touch_between_their_nodes_are_warned_of_or_named() -> None:
    """No node touches at half of 1e-3, the lowest elements are farther away on average: all forces are round-off.

    Whether they count as forces depends on the last bits.
    """
    solution = bk.run(coarse_disc(28))
    assert solution.status in (bk.Status.CONVERGED, bk.Status.MISSED_CONTACT)
    assert measured(solution).penetration_depth == pytest.approx(5e-4, rel=1e-3)
    assert measured(solution).penetration > LARGEST_PENETRATION
    if solution.is_converged:
        found = [
            text for text in map(str, solution.warnings) if "between the nodes (more than the displacement" in text
        ]
        assert len(found) == 2, solution.warnings
        assert "Contact 'low.top / disc.down': the sides overlap by 0.0005 between" in found[0]
    else:
        assert "Contact 'low.top / disc.down' overlaps by 0.0005 at (" in solution.message
    nothing = np.zeros_like(solution.contact.s)  # instead of round-off
    contact = replace(solution.contact, sigma_n=nothing, sigma_t=nothing)
    idle = replace(solution, status=bk.Status.CONVERGED, contact=contact)
    assert any(
        "(50 % of how far bodies move, without contact forces)" in text for text in map(str, find_warnings(idle))
    )


def test_one_body_that_touches_between_its_nodes_is_not_converged() -> None:
    floor = bk.Part("floor", bk.Contact(bk.RigidHalfPlane()), ("arc-3", "arc-4"))
    press = bk.Part("press", bk.PrescribedDisplacement(0.0, -5e-4), ("arc-1", "arc-2"))
    scene = bk.Scene(
        title="x",
        shape=bk.Disk(0.5, (0.0, 0.5)),
        material=bk.Material(1.0, 0.3),
        parts=(floor, press),
        law=bk.Coulomb(0.5),
        discretisation=bk.ConstantCollocation(),
        mesh=bk.MeshOptions(elements=28),
    )
    deeper = replace(press, condition=bk.PrescribedDisplacement(0.0, -5e-3))  # a zone of sixteen elements
    coarse, fine = bk.run(scene), bk.run(replace(scene, parts=(floor, deeper), mesh=bk.MeshOptions(elements=400)))
    assert coarse.status is bk.Status.MISSED_CONTACT
    assert "Contact 'floor' overlaps by 0.0005 at (" in coarse.message
    assert measured(fine).penetration < LARGEST_PENETRATION
    assert not any("overlap by" in text for text in map(str, fine.warnings))


@pytest.mark.slow
def test_results_and_files_say_it(tmp_path: Path) -> None:
    solution = bk.run(coarse_disc(28))
    expected = measured(solution).as_dict()
    assert solution.summary()["between_nodes"] == expected
    assert json.loads(to_json(solution))["between_nodes"] == expected
    write_result(tmp_path / "result.h5", solution)
    with h5py.File(tmp_path / "result.h5") as file:
        assert json.loads(file["derived"][()])["between_nodes"] == expected
    again = read_result(tmp_path / "result.h5")
    assert measured(again).as_dict() == expected


def test_what_is_not_finite_is_nan(pressed: Solution) -> None:
    own = pressed.bodies["upper"]
    lost = replace(own.boundary, displacement=np.full_like(own.boundary.displacement, np.inf))
    bodies = {**pressed.bodies, "upper": replace(own, boundary=lost)}
    assert np.isnan(measured(replace(pressed, bodies=bodies)).worst)
