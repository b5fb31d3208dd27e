"""The independent check of assemblies: right ones pass to round-off, and every fault is found by its name."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import lru_cache

import numpy as np
import pytest

import bemkit as bk
from bemkit.results.solution import Solution
from bemkit.testing.independent_check import Violations, violations_of
from checks.trials import Outcome, judge
from tests.slow import slow_only
from tests.testing.independent_check.company import in_company

MATERIAL = bk.Material(1.0, 0.3)
SIDE = "upper.bottom / lower.top"


@lru_cache
def solved(degree: int = 2) -> Solution:
    """A block on a wider one whose mesh does not match, pressed and sheared: it sticks in the middle and slips."""
    lower = bk.Body(
        name="lower",
        shape=bk.Rectangle(2.0, 1.0),
        material=bk.Material(4.0, 0.2),
        parts=(bk.Part("base", bk.Clamped(), ("bottom",)),),
        mesh=bk.MeshOptions(elements=50),
    )
    upper = bk.Body(
        name="upper",
        shape=bk.Rectangle(1.0, 1.0),
        material=MATERIAL,
        parts=(bk.Part("load", bk.Traction(0.1, -1.0), ("top",)),),
        placement=bk.Placement((0.43, 1.0)),
        mesh=bk.MeshOptions(elements=60),
    )
    pair = bk.ContactPair(("upper.bottom", "lower.top"))
    discretisation = bk.Galerkin(degree)
    return bk.run(
        bk.Scene(
            title="x", bodies=(lower, upper), contacts=(pair,), law=bk.Coulomb(0.25), discretisation=discretisation
        )
    )


def test_a_right_solution_passes_to_round_off() -> None:
    check = violations_of(solved())
    assert check.faults == ()
    assert check.worst < 1e-9  # the certificate; gaps, means, reactions and equilibrium are round-off
    assert check.reciprocity < 0.02
    assert check.hidden_overlap < 0.02  # of a corner of pressure, between nodes 1 / 15 apart


def changed_table(**columns: Callable[[np.ndarray], np.ndarray]) -> Solution:
    solution = solved()
    table = solution.contact
    return replace(
        solution, contact=replace(table, **{name: change(getattr(table, name)) for name, change in columns.items()})
    )


def changed_body(name: str, field: str, change: Callable[[np.ndarray], np.ndarray]) -> Solution:
    solution = solved()
    body = solution.bodies[name]
    boundary = replace(body.boundary, **{field: change(getattr(body.boundary, field))})
    return replace(solution, bodies={**solution.bodies, name: replace(body, boundary=boundary)})


def middle(values: np.ndarray) -> np.ndarray:
    return np.arange(values.size) == values.size // 2


FAULTS: dict[str, tuple[Callable[[], Solution], str]] = {
    "a pulled node": (lambda: changed_table(sigma_n=lambda s: np.where(middle(s), 0.01, s)), "tension"),
    "friction beyond the cone": (lambda: changed_table(sigma_t=lambda s: np.where(middle(s), -0.5, s)), "cone_excess"),
    "friction along slip": (lambda: changed_table(sigma_t=lambda s: -s), "slip_opposition"),
    "another gap": (lambda: changed_table(gap=lambda g: g + 1e-3, clearance=lambda c: c + 1e-3), "gaps"),
    "bodies apart": (lambda: changed_table(u_n=lambda u: u - 1e-3, clearance=lambda c: c + 1e-3), "table"),
    "bodies in each other": (
        lambda: changed_table(u_n=lambda u: u + 1e-3, clearance=lambda c: c - 1e-3),
        "penetration",
    ),
    "another slip": (lambda: changed_table(u_t=lambda u: u + 1e-3), "table"),
    "a status": (lambda: changed_table(status=lambda s: np.where(middle(s), 0, s)), "status"),
    "a partner that feels less": (lambda: changed_body("lower", "traction_dofs", lambda t: 0.9 * t), "reactions"),
    "all contact too weak": (lambda: changed_table(sigma_n=lambda s: 0.9 * s), "equilibrium"),
    "a base that gives way": (lambda: changed_body("lower", "displacement", lambda u: u + 1e-3), "supports"),
    "a body elsewhere": (lambda: changed_body("upper", "displacement", lambda u: u + np.array([0.0, 1e-3])), "table"),
    "no number": (lambda: changed_body("upper", "displacement", lambda u: u * np.nan), "numbers"),
}


@pytest.mark.parametrize("fault", FAULTS)
def test_faults_are_named(fault: str) -> None:
    make, name = FAULTS[fault]
    solution = make()
    assert name in violations_of(solution).faults
    assert judge([solution])[0] is Outcome.WRONG


def test_energy_and_elasticity_are_compared() -> None:
    solution = solved()
    upper = solution.bodies["upper"]

    def with_upper(**changes: object) -> Violations:
        return violations_of(replace(solution, bodies={**solution.bodies, "upper": replace(upper, **changes)}))

    assert "energy" in with_upper(energy=1.01 * upper.energy).faults
    assert "negative_energy" in with_upper(energy=-upper.energy).faults
    other = with_upper(scene=replace(upper.scene, material=bk.Material(3.0, 0.3)))
    assert other.needs_warning == "reciprocity"


def disc(among: bool) -> bk.Solution:
    """A disc of thirteen constant elements between plates, or on a rigid floor.

    The mean distance of an element closes, not its middle.
    """
    plate = bk.Body(
        name="plate",
        shape=bk.Rectangle(2.0, 1.0, (-1.0, -1.0)),
        material=MATERIAL,
        parts=(bk.Part("base", bk.Clamped(), ("bottom",)),),
        mesh=bk.MeshOptions(elements=30),
    )
    below = bk.Free() if among else bk.Contact(bk.RigidHalfPlane())
    halves = (bk.Part("low", below, ("arc-3", "arc-4")), bk.Part("top", bk.Traction(y=-1e-5), ("arc-1", "arc-2")))
    body = bk.Body(
        name="disc", shape=bk.Disk(0.5, (0.0, 0.5)), material=MATERIAL, parts=halves, mesh=bk.MeshOptions(elements=13)
    )
    pair = bk.ContactPair(("disc.low", "plate.top"), multipliers_on="disc.low")
    return bk.run(
        bk.Scene(
            title="Disc",
            bodies=(plate, body) if among else (body,),
            contacts=(pair,) if among else (),
            law=bk.Tresca(1e-4),
            discretisation=bk.ConstantCollocation(),
        )
    )


@pytest.mark.parametrize("among", [False, True], ids=["one body", "one of several"])
def test_sides_that_overlap_deeply_between_nodes_need_a_name(among: bool) -> None:
    solution = disc(among)
    check = violations_of(solution)
    assert check.is_good
    assert check.needs_warning == "hidden_overlap"
    assert solution.status is bk.Status.MISSED_CONTACT
    assert judge([solution])[:2] == (Outcome.NAMED, "missed_contact")
    belittled = replace(solution)
    ((name, said),) = solution.contacts_between_nodes.items()
    belittled.__dict__["contacts_between_nodes"] = {name: replace(said, penetration_depth=said.penetration_depth / 2)}
    assert violations_of(belittled).faults == ("between_nodes",)


@pytest.mark.parametrize("among", slow_only([False, True], True), ids=["one body", "one of several"])
def test_rigid_bodies_move_and_are_loaded_as_they_are_told(among: bool) -> None:
    scene = bk.load_scene("tilted-punch")
    solution = bk.run(in_company(scene) if among else scene)
    check = violations_of(solution)
    assert check.is_good, check
    assert check.rigid < 1e-12  # sums of forces on a hundred nodes
    (punch,) = solution.rigid.values()
    for name in ("x", "force_x", "force_y", "moment"):
        changed = replace(punch, **{name: getattr(punch, name) + 1e-4})  # type: ignore[arg-type]
        wrong = violations_of(replace(solution, rigid={"punch": changed}))
        assert "rigid" in wrong.faults, name
    gap = np.where(solution.contact.gap < 0.1, solution.contact.gap + 1e-3, solution.contact.gap)
    moved = replace(solution.contact, gap=gap, clearance=gap - solution.contact.u_n)
    assert "gaps" in violations_of(replace(solution, contact=moved)).faults
    sunk = replace(punch, y=2.0 * punch.y)
    assert "energy" in violations_of(replace(solution, rigid={"punch": sunk})).faults


@pytest.mark.slow
def test_a_disc_that_turns_in_its_hole_is_not_in_the_rock() -> None:
    circle, sides = bk.Disk(2.0), ("arc-1", "arc-2", "arc-3", "arc-4")
    rock = bk.Body(
        name="rock",
        shape=bk.ExteriorOf(circle),
        material=MATERIAL,
        parts=(bk.Part("wall", bk.Free(), sides),),
        mesh=bk.MeshOptions(elements=33),
    )
    disc = bk.Body(
        name="disc",
        shape=circle,
        material=MATERIAL,
        parts=(bk.Part("out", bk.Free(), sides),),
        body_forces=(bk.Gravity(1e-3, (0.0, -1.0)),),
        mesh=bk.MeshOptions(elements=14),
    )
    pair = bk.ContactPair(("rock.wall", "disc.out"))
    discretisation = bk.Galerkin(3)
    assembly = bk.Scene(
        title="x", bodies=(rock, disc), contacts=(pair,), law=bk.Coulomb(0.5), discretisation=discretisation
    )
    solution = bk.run(assembly)
    placed = solution.bodies["disc"]
    points, displacement = placed.boundary.points, placed.boundary.displacement
    strained = float(np.abs(displacement).max())
    turned = displacement + 1e3 * strained * np.column_stack([-points[:, 1], points[:, 0]])

    def overlap(displacement: np.ndarray) -> float:
        moved = replace(placed, boundary=replace(placed.boundary, displacement=displacement))
        return violations_of(replace(solution, bodies={**solution.bodies, "disc": moved})).hidden_overlap

    assert overlap(displacement) < 0.02
    assert overlap(turned) < 0.02  # a thousand times the displacements, all along the wall
    assert overlap(displacement - np.array([0.0, strained])) > 0.2


def beside_one_that_carries_nothing(traction: float) -> Solution:
    """A block resting on another without any load, beside those of `solved`, and a traction written between them."""
    loaded = solved().scene
    far = bk.Body(name="far", shape=bk.Rectangle(1.0, 1.0), material=MATERIAL, placement=bk.Placement((0.2, 5.0)))
    near = bk.Body(
        name="near",
        shape=bk.Rectangle(1.0, 1.0),
        material=MATERIAL,
        parts=(bk.Part("base", bk.Clamped(), ("bottom",)),),
        placement=bk.Placement((0.0, 4.0)),
    )
    pair = bk.ContactPair(("far.bottom", "near.top"), law=bk.Coulomb(0.25))
    small = [replace(body, mesh=bk.MeshOptions(elements=20)) for body in (far, near)]
    solution = bk.run(replace(loaded, bodies=(*loaded.bodies, *small), contacts=(*loaded.contacts, pair)))
    rows = solution.contact.rows(pair.name)
    table = replace(solution.contact, sigma_n=np.where(rows, traction, solution.contact.sigma_n))
    return replace(solution, contact=table)


@pytest.mark.slow
def test_bodies_that_carry_nothing_are_not_judged_by_their_round_off() -> None:
    """A pull of 1e-15 of the load is round-off of the others, beside nothing at all; 1e-6 of it is a fault."""
    assert violations_of(beside_one_that_carries_nothing(1e-15)).faults == ()
    assert "tension" in violations_of(beside_one_that_carries_nothing(1e-6)).faults
