"""Contacts along whole closed boundaries: nothing depends on where their nodes begin."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import bemkit as bk
from bemkit.results.contact_table import ContactTable
from bemkit.results.error_indicators import contact_errors
from bemkit.results.part_forces import PartForce, contact_forces
from bemkit.results.transitions import (
    find_transitions,
    resolved_transitions,
    slip_reversals,
    unresolved_contacts,
    unrolled,
)
from bemkit.solvers.active_sets import NodeStatus

N_NODES, HALF_ANGLE = 40, 0.7


def hole(begin: int, n_nodes: int = N_NODES) -> ContactTable:
    """Return a round contact that presses at angles within 0.7 of 0.2 and sticks within 0.3, from some node on."""
    angles = 2.0 * np.pi * np.roll(np.arange(n_nodes), -begin) / n_nodes
    apart = (angles - 0.2 + np.pi) % (2.0 * np.pi) - np.pi
    beyond = np.abs(apart) - HALF_ANGLE
    is_closed, step = beyond < 0.0, 2.0 * np.pi / n_nodes
    status = np.where(is_closed, np.where(np.abs(apart) < 0.3, NodeStatus.STICK, NodeStatus.SLIP_FORWARD), 0)
    clearance = np.where(is_closed, 0.0, np.maximum(beyond, 0.0) ** 1.5)
    slip = np.where(is_closed, np.maximum(np.abs(apart) - 0.3, 0.0) ** 1.5, 0.0)
    pressure = np.sqrt(np.maximum(HALF_ANGLE**2 - apart**2, 0.0))
    return ContactTable(
        part=("hole",) * n_nodes,
        x=np.cos(angles),
        y=np.sin(angles),
        s=step * np.arange(n_nodes),
        u_n=-clearance,
        u_t=slip,
        sigma_n=-pressure,
        sigma_t=0.1 * pressure,
        gap=np.zeros(n_nodes),
        clearance=clearance,
        status=status.astype(np.intp),
        weight=np.full(n_nodes, step),
    )


@given(begin=st.integers(0, N_NODES - 1))
def test_transitions_do_not_depend_on_the_first_node(begin: int) -> None:
    found = find_transitions(hole(begin))
    angles = sorted(np.arctan2(each.y, each.x) for each in found)
    # powers 3/2 are extrapolated exactly, and points between nodes lie on chords, 0.003 inside the circle
    assert angles == pytest.approx([0.2 - HALF_ANGLE, -0.1, 0.5, 0.2 + HALF_ANGLE], abs=1e-3)
    assert [each.s for each in found] == sorted(each.s for each in found)
    assert all(0.0 <= each.s < 2.0 * np.pi for each in found)
    turns = np.array([each.s for each in found]) + 2.0 * np.pi * begin / N_NODES
    for each, turn in zip(found, turns, strict=True):
        assert (np.cos(turn), np.sin(turn)) == pytest.approx((each.x, each.y), abs=4e-3)


@given(begin=st.integers(0, N_NODES - 1))
def test_lengths_and_estimates_do_not_depend_on_the_first_node(begin: int) -> None:
    table = hole(begin)
    transitions = find_transitions(table)
    (force,) = contact_forces(table, 1.0, [PartForce("hole", 0.0, 0.0, 0.0)], [2.0 * np.pi], transitions, {})
    assert force.contact_length == pytest.approx(2.0 * HALF_ANGLE, abs=1e-3)
    unrolled_table, on_it = unrolled(table, transitions)
    assert len(resolved_transitions(unrolled_table, on_it)) == 4
    assert not unresolved_contacts(unrolled_table, on_it)
    errors = np.roll(contact_errors(table, 1), begin)
    # nodes are neighbours across the seam, too
    assert errors == pytest.approx(contact_errors(hole(N_NODES // 2), 1)[np.roll(np.arange(N_NODES), N_NODES // 2)])


@given(begin=st.integers(0, N_NODES - 1))
def test_reversals_of_slip_do_not_depend_on_the_first_node(begin: int) -> None:
    table = hole(begin)
    angles = np.arctan2(table.y, table.x)
    sides = np.where(angles > 0.2, NodeStatus.SLIP_FORWARD, NodeStatus.SLIP_BACKWARD)
    table.status.flags.writeable = True
    table.status[:] = np.where(table.sigma_n < 0.0, sides, 0)
    (reversal,) = slip_reversals(table)
    assert np.arctan2(reversal.place.y, reversal.place.x) == pytest.approx(0.2, abs=2.0 * np.pi / N_NODES)
    assert 0.0 <= reversal.place.s < 2.0 * np.pi


def test_a_part_of_a_circle_is_not_closed() -> None:
    table = hole(0)
    kept = ContactTable(part=table.part[:-1], **{name: column[:-1] for name, column in table.columns().items()})
    assert set(table.circumferences) == {"hole"}
    assert table.circumferences["hole"] == pytest.approx(2.0 * np.pi)
    assert not kept.circumferences
    assert kept.unrolled[0] is kept


def test_contact_that_ends_at_the_seam_of_a_hole_is_like_any_other() -> None:
    """A peg pressed into a hole: to the left, and turned so that contact ends before the first node of the hole."""
    solutions = []
    inner, outer = (tuple(f"{side}-{k}" for k in range(1, 5)) for side in ("inner", "outer"))
    for angle in np.radians((180.0, -18.0)):  # by elements, of 18 degrees
        x, y = np.cos(angle), np.sin(angle)
        moved = bk.PrescribedDisplacement(-2e-3 * x, -2e-3 * y)
        scene = bk.Scene(
            title="peg in a hole",
            shape=bk.Ring(1.0, 2.0),
            material=bk.Material(1.0, 0.3),
            parts=(
                bk.Part("hole", bk.Contact(bk.RigidCircle((0.01 * x, 0.01 * y), 0.99)), sides=inner),
                bk.Part("rim", moved, sides=outer),
            ),
            discretisation=bk.Galerkin(2),
            mesh=bk.MeshOptions(elements=60),
        )
        solutions.append(bk.run(scene))
    left, at_seam = solutions
    assert left.is_converged
    assert at_seam.is_converged
    assert len(left.transitions) == len(at_seam.transitions) == 2
    assert at_seam.transitions[-1].s > at_seam.contact.s[-1]
    # the mesh is turned by whole elements: round-off
    assert at_seam.contacts[0].contact_length == pytest.approx(left.contacts[0].contact_length, rel=1e-9)
    assert at_seam.estimated_traction_error == pytest.approx(left.estimated_traction_error, rel=1e-6)
    assert at_seam.estimated_error == pytest.approx(left.estimated_error, rel=1e-6)
