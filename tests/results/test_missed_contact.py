"""Contact that no node meets is found: a round side is nearest between two nodes, and the approach is small."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import bemkit as bk
from bemkit.results.between_nodes import BetweenNodes, missed_contacts
from bemkit.results.points_between import PointsBetween, deepest, with_least_clearances
from bemkit.results.solved_scene import place_in
from bemkit.runs.adaptive import run_adaptive
from tests.slow import slow_except

STEEL = bk.Material(1.0, 0.3)
KINDS: dict[str, Any] = {"constant": bk.ConstantCollocation(), **{f"degree {k}": bk.Galerkin(k) for k in (1, 2, 5)}}


def roll(approach: float, degrees: float, discretisation: Any, mesh: bk.MeshOptions, width: float = 0.3) -> bk.Scene:
    """Return half a disc that approaches a plane tilted by an angle [degrees]; contact is possible on an arc."""
    angle = np.radians(degrees)
    normal = np.array([-np.sin(angle), np.cos(angle)])
    shift = -approach * normal
    where = bk.Expression(f"abs(x - {np.sin(angle) + 0.071:.6g}) < {width}")
    return bk.Scene(
        title="roll",
        shape=bk.Sector(1.0, 180.0, 360.0),
        material=STEEL,
        parts=(
            bk.Part("load", bk.PrescribedDisplacement(*shift.tolist()), ("start", "end")),
            bk.Part("tip", bk.Contact(bk.RigidHalfPlane(tuple(-normal), tuple(normal))), ("arc",), where),
        ),
        law=bk.Frictionless(),
        discretisation=discretisation,
        mesh=mesh,
    )


def is_inside(solution: bk.Solution) -> bool:
    """Whether a body without any contact force reaches into the obstacle, on a thousand points of each element."""
    mesh, space = solution.mesh, solution.scene.discretisation.displacement_space(solution.mesh)
    (part,) = solution.scene.contact_parts
    elements = mesh.part("tip")
    points = mesh.points(elements, np.linspace(-1.0, 1.0, 1001)).reshape(-1, 2)
    assert space is not None
    motion = solution.boundary.displacement.mean(axis=0)
    gap = part.condition.obstacle.gap(
        points + motion, mesh.normals_at(elements, np.linspace(-1, 1, 1001)).reshape(-1, 2)
    )
    return bool(solution.force_normal == 0.0 and gap.min() < -1e-13)


@pytest.mark.parametrize("word", slow_except(KINDS, "constant"))
@pytest.mark.parametrize("approach", slow_except((1e-9, 1e-6, 1e-4), 1e-6))
@pytest.mark.parametrize("degrees", slow_except((0.0, 7.0, -13.0), 0.0))
def test_fixed_meshes_that_miss_contact_end_by_name(word: str, approach: float, degrees: float) -> None:
    for elements in (24, 29, 41):
        solution = bk.run(roll(approach, degrees, KINDS[word], bk.MeshOptions(elements=elements)))
        if solution.force_normal > 0.0:
            continue
        assert solution.status is bk.Status.MISSED_CONTACT
        assert solution.estimated_error is None
        assert solution.between_nodes is not None
        # constant elements see their middles move, which lie on the arc
        assert solution.between_nodes.penetration_depth == pytest.approx(approach, rel=1e-3)
        x, y = solution.missed_contacts["tip"]
        assert (x, y) == pytest.approx((np.sin(np.radians(degrees)), -np.cos(np.radians(degrees))), abs=2e-3)
        assert place_in(solution, (x, y)) in solution.message


@pytest.mark.parametrize("word", slow_except(KINDS, "degree 1"))
def test_a_body_that_stays_apart_is_converged(word: str) -> None:
    solution = bk.run(roll(-1e-9, 3.0, KINDS[word], bk.MeshOptions(elements=29)))
    assert solution.is_converged
    assert not solution.missed_contacts
    assert solution.contact.clearance.min() > 1e-9


@pytest.mark.slow
@pytest.mark.parametrize("degrees", [0.0, pytest.param(20.0, marks=pytest.mark.slow)])
def test_rising_degrees_find_contact_between_nodes(degrees: float) -> None:
    exact = bk.run(roll(1e-6, degrees, bk.Galerkin(2), bk.MeshOptions(accuracy=4e-3)))
    rising = bk.MeshOptions(accuracy=1e-2, rising_degrees=True)
    solution = bk.run(roll(1e-6, degrees, bk.Galerkin(2), rising))
    assert solution.is_converged
    assert solution.force_normal == pytest.approx(exact.force_normal, rel=2e-2)


@pytest.mark.parametrize("approach", [1e-7, -1e-7])
def test_a_rigid_body_that_meets_no_node_ends_by_name(approach: float) -> None:
    block = bk.Body(
        name="block",
        shape=bk.Rectangle(2.0, 1.0, (-1.0, -1.0)),
        material=STEEL,
        parts=(bk.Part("base", bk.Clamped(), ("bottom",)),),
        mesh=bk.MeshOptions(elements=26),
    )
    ball = bk.RigidBody(name="ball", obstacle=bk.RigidCircle((0.013, 1.0), 1.0), centre=(0.013, 1.0), y=-approach)
    contact = bk.ContactPair(("block.top", "ball"))
    solution = bk.run(
        bk.Scene(
            title="ball", bodies=(block,), rigid=(ball,), contacts=(contact,), law=bk.Frictionless(),
            discretisation=bk.Galerkin(1),
        )
    )  # fmt: skip
    assert solution.force_normal == 0.0
    assert solution.status is (bk.Status.MISSED_CONTACT if approach > 0.0 else bk.Status.CONVERGED)
    if approach > 0.0:
        assert solution.between_nodes.penetration_depth == pytest.approx(approach, rel=1e-3)
        assert solution.missed_contacts["block.top / ball"] == pytest.approx((0.013, 0.0), abs=1e-3)


def sampled(clearance_of: Callable[[np.ndarray], np.ndarray], n: int = 9, friction: float = 0.0) -> PointsBetween:
    """Return the points of one piece; friction acts against the place (n,) [-] on it."""
    xi = -np.cos(np.linspace(0.0, np.pi, n))

    def sample(pieces, low_end, high_end):
        at = (0.5 * (low_end + high_end)[:, None] + 0.5 * (high_end - low_end)[:, None] * xi).ravel()
        nothing, clearance = np.zeros_like(at), clearance_of(at)
        points = np.stack([at, nothing], axis=1)
        # friction across the gap points to a corner from one side, and away from it on the other
        along = -friction * np.sign(np.gradient(clearance, at)) if friction else nothing
        return PointsBetween(points, at, points, clearance, along, nothing, nothing)

    return with_least_clearances(sample, 1, xi)


@pytest.mark.parametrize("middle", [-0.99, -0.1, 0.37, 0.875, 1.0])
def test_the_least_clearance_is_found_where_no_point_is_inside(middle: float) -> None:
    depth, place = deepest(sampled(lambda at: (at - middle) ** 2 - 1e-9))
    assert depth == pytest.approx(1e-9, rel=1e-6)
    assert place[0] == pytest.approx(middle, abs=1e-2)
    assert deepest(sampled(lambda at: (at - middle) ** 2 + 1e-9))[0] == 0.0


@pytest.mark.parametrize(
    ("of_deeper", "begin"),
    # a corner between two points, and the end of a piece that faces away
    [(lambda at: 0.2 * np.abs(at + 0.61) - 0.005, -1.0), (lambda at: at + 0.99, -0.995)],
)
def test_the_deeper_of_two_minima_is_found_though_points_beside_it_are_higher(
    of_deeper: Callable[[np.ndarray], np.ndarray], begin: float
) -> None:
    def clearance(at: np.ndarray) -> np.ndarray:
        return np.where(at < begin, np.inf, np.minimum(of_deeper(at), (at - 0.71) ** 2 + 1e-3))

    depth, place = deepest(sampled(clearance))
    assert place[0] < -0.5
    assert depth == pytest.approx(0.005, rel=0.4)  # points are a part of the overlap apart


@pytest.mark.parametrize("friction", [0.0, 1.0])
@pytest.mark.parametrize("n", [5, 9, 13])
@pytest.mark.parametrize("low", [5e-3, 1e-7])
@given(middle=st.floats(-0.98, 0.98))
def test_a_sharp_corner_between_two_points_is_found(low: float, n: int, friction: float, middle: float) -> None:
    """Intervals become as short as the overlap is deep, and shorter."""
    depth, place = deepest(sampled(lambda at: np.abs(at - middle) - low, n, friction))
    assert depth == pytest.approx(low, rel=0.1)  # the last interval is 1e-8 long
    assert place[0] == pytest.approx(middle, abs=low)


def test_a_jump_between_two_elements_is_no_parabola() -> None:
    """Both end at one point; its coordinates differ by round-off, its clearances by the step of constant elements."""
    s = np.array([0.0, 1.0 - 1e-16, 1.0, 1.0 + 1e-9, 2.0])
    clearance = np.array([1e-6, 1e-6, -1e-6, -1e-6, -0.9e-6])
    points = np.stack([s, 0.0 * s], axis=1)
    depth, _ = deepest(PointsBetween(points, s, points, clearance, 0.0 * s, 0.0 * s, 0.0 * s))
    assert depth == pytest.approx(1e-6, rel=1e-6)


def test_the_parabola_stays_between_its_points() -> None:
    s = np.array([0.0, 1e-3, 1.0])
    flat = np.array([-1.0, -1.0 - 1e-9, -0.5])
    points = np.stack([s, s], axis=1)
    depth, _ = deepest(PointsBetween(points, s, points, flat, 0.0 * s, 0.0 * s, 0.0 * s))
    assert depth < 1.1


@pytest.mark.parametrize("approach", [1e-7, pytest.param(-1e-7, marks=pytest.mark.slow)])
def test_sides_with_a_force_that_touch_nowhere_end_by_name(approach: float) -> None:
    """Weighted gaps of a round side over long linear elements are negative where the gap is not."""
    mesh = bk.MeshOptions(elements=26)
    block = bk.Body(
        name="block",
        shape=bk.Rectangle(2.0, 1.0, (-1.0, -1.0)),
        material=STEEL,
        parts=(bk.Part("base", bk.Clamped(), ("bottom",)),),
        mesh=mesh,
    )
    disc = bk.Body(
        name="disc",
        shape=bk.Sector(1.0, 180.0, 360.0, centre=(0.013, 1.0)),
        material=STEEL,
        parts=(bk.Part("load", bk.PrescribedDisplacement(0.0, -approach), ("start", "end")),),
        mesh=mesh,
    )
    pair = bk.ContactPair(("disc.arc", "block.top"))
    solution = bk.run(
        bk.Scene(
            title="disc", bodies=(block, disc), contacts=(pair,), law=bk.Frictionless(), discretisation=bk.Galerkin(1)
        )
    )
    assert solution.force_normal > 100.0 * abs(approach)
    assert solution.status is bk.Status.MISSED_CONTACT
    assert "Contact 'disc.arc / block.top' has a force, but its sides touch nowhere." in solution.message


def test_an_overlap_beside_a_contact_zone_belongs_to_its_end() -> None:
    s = np.arange(8.0)
    points, nothing = np.stack([s, s], axis=1), np.zeros(8)
    clearance = np.array([0.0, 0.0, -1e-2, 1e-3, -2e-3, 1e-3, -3e-3, 0.0])
    sigma_n = np.array([-1.0, -1.0, 0.0, 0.0, 0.0, 0.0, 0.0, -1.0])
    values = PointsBetween(points, s, points, clearance, sigma_n, nothing, nothing)
    assert np.flatnonzero(np.isfinite(values.beyond_zones().clearance)).tolist() == [3, 4, 5]
    assert deepest(values.beyond_zones())[0] == pytest.approx(2e-3, rel=0.1)
    free = values._replace(sigma_n=nothing)
    assert free.beyond_zones().clearance.tolist() == clearance.tolist()
    assert deepest(values._replace(step=nothing + 5e-3).beyond_zones())[0] == 0.0


@pytest.mark.slow
def test_places_that_move_after_a_missed_contact_take_one_mesh_more() -> None:
    """The first mesh in layers only finds the zone; the fifth one has its ends, and a sixth one the accuracy."""
    plane = bk.RigidHalfPlane((-0.3420201433256687, -0.9396926207859084), (0.3420201433256687, 0.9396926207859084))
    scene = bk.Scene(
        title="half disc on a tilted plane",
        shape=bk.Sector(1.0, 180.0, 360.0),
        material=bk.Material(1.0, 0.3),
        parts=(
            bk.Part("load", bk.PrescribedDisplacement(-3.42e-6, -9.4e-6), ("start", "end")),
            bk.Part("arc", bk.Contact(plane), ("arc",)),
        ),
        law=bk.Frictionless(),
        discretisation=bk.Galerkin(2),
        mesh=bk.MeshOptions(accuracy=1e-3, rising_degrees=True),
    )
    solution = bk.run(scene)
    assert solution.is_converged, solution.message
    # the half-width of a cylinder under the same force [Johnson1985], to the accuracy
    width = 2.0 * np.sqrt(4.0 * solution.force_normal * (1.0 - 0.3**2) / np.pi)
    one, two = (each.s for each in solution.transitions)
    assert two - one == pytest.approx(width, rel=1e-3)


@pytest.mark.slow
def test_the_next_mesh_keeps_a_node_in_a_zone_whose_ends_are_zones_of_single_nodes() -> None:
    """One node slips on either side of a few that stick; without a node there the next mesh missed the contact."""
    mesh = bk.MeshOptions(accuracy=5e-3, rising_degrees=True)
    scene = replace(roll(1.1e-6, 11.2, bk.Galerkin(2), mesh), law=bk.Coulomb(0.3))
    arc = replace(scene.contact_parts[0], where=None)
    solutions = run_adaptive(replace(scene, parts=(scene.parts[0], arc)))
    assert solutions[-1].is_converged, solutions[-1].message
    assert [each.status for each in solutions].count(bk.Status.MISSED_CONTACT) == 1


@pytest.mark.parametrize(
    ("penetration", "has_forces", "is_missed"),
    [
        (1e-9, False, True),
        (1e-9, True, False),
        (0.04, True, False),
        (0.06, True, True),
    ],
)
def test_a_free_contact_of_loaded_bodies_is_missed_by_a_share_of_their_displacement(
    penetration: float, has_forces: bool, is_missed: bool
) -> None:
    """A head joint whose end node belongs to the bed joint overlaps there a little, and carries next to nothing."""
    table = bk.run(roll(-1e-9, 3.0, bk.Galerkin(1), bk.MeshOptions(elements=29))).contact
    free = replace(table, sigma_n=0.0 * table.sigma_n, sigma_t=0.0 * table.sigma_t)
    found = BetweenNodes(penetration, 0.0, 0.0, 0.0, penetration, place=(1.0, 2.0), has_forces=has_forces)
    assert missed_contacts(free, {"tip": found}) == ({"tip": (1.0, 2.0)} if is_missed else {})


@pytest.mark.slow
def test_two_pressed_nodes_beside_a_deeper_point_are_not_converged() -> None:
    """The lowest point of a sector is the end of two long elements, whose next nodes carry the whole load."""
    scene = bk.Scene(
        title="Sector under a load",
        shape=bk.Sector(1.0, 180.0, 360.0, centre=(0.0, 1.0)),
        material=STEEL,
        parts=(
            bk.Part("floor", bk.Contact(bk.RigidHalfPlane()), ("arc",)),
            bk.Part("load", bk.Traction(y=bk.Expression("-3.33e-5 * (1 + 0.5 * cos(2 * x))")), ("start", "end")),
        ),
        law=bk.Tresca(1.72e-6),
        discretisation=bk.Galerkin(7),
        mesh=bk.MeshOptions(elements=21, grading=bk.Algebraic(2.936)),
    )
    missed = bk.run(scene)
    assert missed.status is bk.Status.MISSED_CONTACT
    assert missed.estimated_error is None
    # a parabola is flat to round-off there
    assert missed.unfound_contacts["floor"] == pytest.approx((0.0, 0.0), abs=1e-8)
    fine = bk.run(replace(scene, discretisation=bk.Galerkin(2), mesh=bk.MeshOptions(elements=121)))
    assert fine.status is bk.Status.CONVERGED
    assert not fine.unfound_contacts
