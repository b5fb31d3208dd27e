"""Tables, transitions and the summary of a solution."""

from __future__ import annotations

import dataclasses
import pickle
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import bemkit as bk
from bemkit.results.contact_table import ContactTable
from bemkit.results.part_forces import PartForce, contact_forces
from bemkit.results.solution import BoundaryFields, Solution
from bemkit.results.transitions import find_transitions
from bemkit.runs.run import run
from bemkit.scene.toml import load_scene, with_overrides
from bemkit.solvers.active_sets import NodeStatus
from bemkit.solvers.base import Status

SEPARATED, STICK, FORWARD, BACKWARD = (
    int(NodeStatus.SEPARATED),
    int(NodeStatus.STICK),
    int(NodeStatus.SLIP_FORWARD),
    int(NodeStatus.SLIP_BACKWARD),
)


def table(status: list[int], **columns: Any) -> ContactTable:
    """Nodes at x = 0, 1, 2, ... on the line y = 3."""
    n = len(status)
    names = ("u_n", "u_t", "sigma_n", "sigma_t", "gap", "clearance")
    given = {"part": ("a",) * n, "x": np.arange(n, dtype=float), "y": np.full(n, 3.0), "s": np.arange(n) + 0.5}
    given |= {name: np.zeros(n) for name in names} | {"weight": np.ones(n), "status": np.array(status)}
    return ContactTable(**{**given, **columns})


@pytest.fixture(scope="module")
def solution() -> Solution:
    return run(with_overrides(load_scene("paper-1"), elements=40))


@pytest.mark.parametrize("place", [2.1, 2.5, 2.9, 3.3])
@pytest.mark.parametrize("is_reversed", [False, True])
def test_the_end_of_contact_is_found_between_the_nodes(place: float, is_reversed: bool) -> None:
    x = np.arange(6, dtype=float)
    clearance = np.maximum(place - x, 0.0) ** 1.5
    status = [SEPARATED] * 3 + [STICK] * 3
    expected = (place, "separated", "stick")
    if is_reversed:
        clearance, status, expected = clearance[::-1].copy(), status[::-1], (5.0 - place, "stick", "separated")
    (found,) = find_transitions(table(status, clearance=clearance))
    if place < 3.0:
        assert (found.x, found.from_status, found.to_status) == (pytest.approx(expected[0], rel=1e-12), *expected[1:])
        assert found.s == pytest.approx(found.x + 0.5, rel=1e-12)
        assert found.y == 3.0
    else:  # the discrete status may be wrong by a node; the extrapolation corrects it
        assert found.x == pytest.approx(expected[0], abs=0.05)


def test_the_end_of_slip_is_found_from_the_slip() -> None:
    x = np.arange(6, dtype=float)
    (found,) = find_transitions(table([BACKWARD] * 3 + [STICK] * 3, u_t=-(np.maximum(2.3 - x, 0.0) ** 1.5)))
    assert (found.x, found.from_status, found.to_status) == (pytest.approx(2.3, rel=1e-12), "slip", "stick")


@pytest.mark.parametrize("power", [1.44, 1.5, 1.56])
@pytest.mark.parametrize("offset", [0.0, 2e-4])
def test_on_fine_meshes_the_power_of_the_distance_is_found_too(power: float, offset: float) -> None:
    n = 40
    distance = np.append((np.arange(n - 1, -1, -1) / n) ** 2.5 + offset, [-0.01, -0.05])
    s = 1.0 - distance
    clearance = np.maximum(distance, 0.0) ** power * (1.0 + 0.3 * distance)
    clearance[n - 2 : n] *= 0.5  # the values next to the transition are the least true
    columns = {"s": s, "x": s, "weight": np.full(n + 2, 1.0), "clearance": clearance}
    (found,) = find_transitions(table([SEPARATED] * n + [STICK] * 2, **columns))
    # a logarithm of the factor that is linear in d leaves out its d**2
    assert found.s == pytest.approx(1.0, abs=5e-7)


def test_nodes_that_face_no_obstacle_say_nothing_of_the_power() -> None:
    """As in random scene 4003, 3473: only a few nodes beside the transition have a clearance."""
    n = 40
    distance = np.append((np.arange(n - 1, -1, -1) / n) ** 2.5, [-0.01, -0.05])
    s, clearance = 1.0 - distance, np.maximum(distance, 0.0) ** 1.5
    clearance[: n - 6] = np.inf
    columns = {"s": s, "x": s, "weight": np.full(n + 2, 1.0), "clearance": clearance}
    (found,) = find_transitions(table([SEPARATED] * n + [STICK] * 2, **columns))
    assert found.s == pytest.approx(1.0, abs=1e-12)


def test_without_a_law_for_its_end_a_zone_ends_halfway() -> None:
    far = np.array([np.inf, np.inf, np.inf, 0.0, 0.0])
    assert find_transitions(table([SEPARATED] * 3 + [STICK] * 2, clearance=far))[0].x == 2.5
    assert find_transitions(table([SEPARATED] + [STICK] * 2))[0].x == 0.5
    assert find_transitions(table([STICK] * 2 + [SEPARATED]))[0].x == 1.5


def test_a_narrow_zone_keeps_its_nodes() -> None:
    """Slip that is extrapolated from both sides past the only node, or to the middle of three nodes, that stick."""
    x = np.arange(7, dtype=float)
    crossing = table([FORWARD] * 3 + [STICK] + [FORWARD] * 3, u_t=np.abs(x - 3.0) + 5.0)
    assert [found.s for found in find_transitions(crossing)] == [3.0, 4.0]
    x = np.arange(9, dtype=float)
    meeting = table([FORWARD] * 3 + [STICK] * 3 + [FORWARD] * 3, u_t=np.abs(x - 4.0) + 5.0)
    assert [found.s for found in find_transitions(meeting)] == [3.0, 6.0]
    half = table([FORWARD] * 3 + [STICK], u_t=8.0 - np.arange(4))
    assert [found.s for found in find_transitions(half)] == [3.0]


def test_what_moves_back_keeps_off_the_next_transition() -> None:
    """Slip crosses the only node that sticks; put back there, it meets the end of separation, which came too far."""
    x = np.arange(9, dtype=float)
    status = [SEPARATED] * 3 + [FORWARD] * 2 + [STICK] + [FORWARD] * 3
    beyond = table(status, clearance=10.0 - x, u_t=np.abs(x - 5.0) + 5.0)
    assert [found.s for found in find_transitions(beyond)] == [3.0, 5.0, 6.0]


def test_a_change_of_the_slip_direction_is_no_transition() -> None:
    assert find_transitions(table([FORWARD, FORWARD, BACKWARD])) == ()


def test_nodes_of_different_parts_or_pieces_are_not_neighbours() -> None:
    status = [SEPARATED, SEPARATED, STICK, STICK]
    assert len(find_transitions(table(status))) == 1
    assert find_transitions(table(status, part=("a", "a", "b", "b"))) == ()
    assert find_transitions(table(status, x=np.array([0.0, 1.0, 9.0, 10.0]))) == ()


@pytest.mark.parametrize("weights", [(0.5, 0.5), (1.0, 0.01), (0.2, 3.0)])
def test_neighbours_are_as_far_apart_as_the_lengths_they_stand_for(weights: tuple[float, float]) -> None:
    """Centres of constant elements are half the sum of their lengths apart; no other nodes are farther than the sum."""
    for distance, is_found in ((0.5, True), (1.0, True), (1.001, False), (2.0, False)):
        x = np.array([0.0, distance * sum(weights)])
        pair = table([SEPARATED, STICK], x=x, weight=np.array(weights))
        assert bool(find_transitions(pair)) == is_found


def test_tables_check_their_columns() -> None:
    with pytest.raises(ValueError, match=r"gap has the shape \(2,\): give \(3,\)"):
        table([0, 0, 0], gap=np.zeros(2))
    with pytest.raises(ValueError, match=r"status\[1\] is 7"):
        table([0, 7, 0])
    with pytest.raises(ValueError, match=r"traction has the shape \(2, 2\): give \(3, 2\)"):
        BoundaryFields(*np.zeros((3, 3, 2)), np.zeros((2, 2)), *np.zeros((2, 3, 2)))
    with pytest.raises(ValueError, match=r"traction_dofs has the shape \(4, 2\): give a multiple of 3 rows"):
        BoundaryFields(*np.zeros((4, 3, 2)), np.zeros((4, 2)), np.zeros((3, 2)))


def test_rows_are_those_of_a_part() -> None:
    two = replace(table([STICK] * 3), part=("left", "right", "left"))
    assert two.parts == ("left", "right")
    np.testing.assert_array_equal(two.rows("left"), [True, False, True])
    assert not two.rows("top").any()


def test_tables_cannot_be_written_to() -> None:
    with pytest.raises(ValueError, match="read-only"):
        table([0, 0]).gap[0] = 1.0


def test_the_summary_has_the_promised_names(solution: Solution) -> None:
    summary = solution.summary()
    names = "status converged n_elements n_contact linear_solves outer_steps force_normal force_tangential energy"
    names += " transitions certificate timings plan"
    assert set(names.split()) <= set(summary)
    assert (summary["status"], summary["converged"], summary["n_elements"], summary["n_contact"]) == (
        "converged",
        True,
        40,
        10,
    )
    assert summary["force_normal"] == pytest.approx(0.5, rel=1e-9)  # equilibrium, exact up to round-off
    assert summary["force_tangential"] > 0.0
    assert set(summary["transitions"][0]) == {"part", "x", "y", "s", "from", "to"}
    assert [item["from"] for item in summary["transitions"]] == ["separated", "slip"]


def test_a_failed_solution_says_so(solution: Solution) -> None:
    failed = dataclasses.replace(solution, status=Status.MAX_STEPS, message="")
    assert not failed.is_converged
    assert failed.summary()["status"] == "max_steps"
    assert "raise max_steps" in failed.summary()["message"]


def test_two_rows_of_one_node_change_where_they_are() -> None:
    s = np.array([0.5, 1.5, 2.5, 2.5, 3.5])
    columns = {"s": s, "x": s - 0.5, "clearance": np.array([3.0, 2.0, 1.0, 0.0, 0.0])}
    (found,) = find_transitions(table([SEPARATED] * 3 + [STICK] * 2, **columns))
    assert found.s == 2.5


def test_each_run_of_nodes_with_partners_has_its_own_contact_length() -> None:
    """Nodes of a side that face nothing are no rows: without an end between two runs, the second one is separated."""
    s = np.array([0.5, 1.5, 2.5, 9.5, 10.5, 11.5, 20.5, 21.5])
    rows = table([STICK] * 3 + [SEPARATED] * 3 + [SEPARATED, FORWARD], s=s, x=s)
    (end,) = find_transitions(rows)
    assert end.s == 21.0
    (force,) = contact_forces(rows, 1.0, [PartForce("a", 0.0, 0.0, 0.0)], [30.0], (end,), {})
    assert force.contact_length == pytest.approx(3.0 + 1.0, rel=1e-12)


def test_a_contact_beside_a_part_that_faces_nothing_is_no_longer_than_its_part() -> None:
    """The weight of the corner node includes half an element of the other part."""
    square = bk.Polygon(((0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)), ("floor", "right", "top", "left"))
    scene = bk.Scene(
        title="block in a corner",
        shape=square,
        material=bk.Material(1.0, 0.3),
        parts=(
            bk.Part("floor", bk.Contact(bk.RigidHalfPlane()), ("floor",)),
            bk.Part("right", bk.Contact(bk.RigidHalfPlane((0.0, -9.0))), ("right",)),
            bk.Part("load", bk.Traction(y=-1e-3), ("top",)),
        ),
        law=bk.Frictionless(),
        mesh=bk.MeshOptions(elements=32),
    )
    solution = bk.run(scene)
    assert solution.contacts[0].contact_length == pytest.approx(1.0, rel=1e-12)
    assert solution.part_length("floor") == pytest.approx(1.0, rel=1e-12)


def test_a_solution_can_be_sent_to_another_process_after_its_summary_was_read(solution: Solution) -> None:
    summary = solution.summary()
    assert pickle.loads(pickle.dumps(solution)).summary() == summary
