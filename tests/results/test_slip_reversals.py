"""Stick zones between opposite slips that the mesh does not resolve, and what rising degrees make of them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import bemkit as bk
from bemkit.results.contact_table import ContactTable
from bemkit.results.transitions import friction_across_gaps, slip_reversals
from bemkit.solvers.active_sets import NodeStatus
from checks.calibration.true_errors import true_errors
from tests.slow import slow_except

OPEN, STICK, FORWARD, BACKWARD = NodeStatus


def table(*status: NodeStatus, sigma_t: float = 1.0, parts: str | None = None) -> ContactTable:
    """Return nodes at the distance 1 whose slip follows their status."""
    n = len(status)
    slip = np.array([{FORWARD: 3.0, BACKWARD: -1.0}.get(each, 0.0) for each in status])
    columns = {name: np.zeros(n) for name in ("y", "u_n", "sigma_n", "gap", "clearance")}
    x, codes = np.arange(float(n)), np.array([int(each) for each in status])
    part = tuple(parts or "a" * n)
    return ContactTable(
        part=part, x=x, s=x, u_t=slip, sigma_t=-sigma_t * slip, status=codes, weight=np.ones(n), **columns
    )


@pytest.mark.parametrize(
    ("contact", "places"),
    [
        (table(FORWARD, FORWARD, BACKWARD, BACKWARD), [(1.75, 0)]),  # the slip 3 falls to -1
        (table(BACKWARD, STICK, FORWARD), [(0.5, 1)]),
        (table(FORWARD, STICK, STICK, BACKWARD), []),  # a zone of its own
        (table(FORWARD, STICK, FORWARD), []),
        (table(FORWARD, OPEN, BACKWARD), []),
        (table(FORWARD, BACKWARD, sigma_t=0.0), []),
        (table(FORWARD, BACKWARD, parts="ab"), []),
        (table(FORWARD, BACKWARD, FORWARD), [(0.75, 0), (1.25, 0)]),
    ],
)
def test_places_where_the_direction_of_slip_changes(contact: ContactTable, places: list[tuple[float, int]]) -> None:
    found = slip_reversals(contact)
    assert [(each.place.s, each.n_sticking) for each in found] == places
    assert all(abs(each.jump) == 4.0 for each in found)  # from -3 to 1
    assert all((each.place.from_status, each.place.to_status) == ("slip", "slip") for each in found)


def test_displacements_that_keep_their_sign_say_nothing() -> None:
    contact = replace(table(FORWARD, BACKWARD), u_t=np.array([3.0, 1.0]))
    assert [each.place.s for each in slip_reversals(contact)] == [0.5]


def test_friction_across_gaps_has_a_status_of_its_own() -> None:
    contact = replace(table(OPEN, OPEN, OPEN, FORWARD, OPEN), sigma_t=np.array([2.0, 0.5, -2.0, -2.0, 0.0]))
    bound = np.array([2.0, 2.0, 2.0, 2.0, 0.0])
    assert friction_across_gaps(contact, bound).status.tolist() == [BACKWARD, STICK, FORWARD, OPEN, OPEN]


def squeezed(mesh: bk.MeshOptions, degree: int) -> bk.Scene:
    """A block above a floor that it does not reach; Tresca's friction acts across the gap where its foot shortens."""
    sides = [bk.Part(name, bk.Pressure(load), sides=(name,)) for name, load in (("left", 0.01), ("right", 0.02))]
    floor = bk.Contact(bk.RigidHalfPlane(point=(0.0, -0.1)))
    return bk.Scene(
        title="squeezed block",
        shape=bk.Rectangle(1.0, 0.5),
        material=bk.Material(1.0, 0.3),
        law=bk.Tresca(1e-3),
        parts=(bk.Part("floor", floor, sides=("bottom",)), bk.Part("top", bk.Clamped(), sides=("top",)), *sides),
        discretisation=bk.Galerkin(degree),
        mesh=mesh,
    )


@pytest.mark.parametrize(
    ("mesh", "degree"),
    slow_except(
        [
            (bk.MeshOptions(accuracy=3e-3, rising_degrees=True), 2),
            (bk.MeshOptions(elements=30), 3),
            (bk.MeshOptions(elements=30), 6),
        ],
        (bk.MeshOptions(elements=30), 6),
    ),
)
def test_estimates_see_where_friction_across_a_gap_changes(mesh: bk.MeshOptions, degree: int) -> None:
    """Its stick zone was neither resolved nor counted: at 3e-3 a tenth of the tractions was wrong without a word."""
    fine = bk.run(squeezed(bk.MeshOptions(accuracy=3e-4, rising_degrees=True), 2))
    assert fine.is_converged
    assert not fine.transitions  # of contact
    assert fine.places.reversals == ()
    assert len(fine.places.zone_ends(fine.missed_contacts)) == 2
    solution = bk.run(squeezed(mesh, degree))
    _, tractions = true_errors(solution, fine)
    assert solution.estimated_traction_error is not None
    assert 0.5 < solution.estimated_traction_error / tractions < 3.0
    assert (tractions > 0.05) == (not mesh.rising_degrees)  # an element of 30 holds the whole zone


def pushed(law: bk.FrictionLaw, accuracy: float) -> bk.Scene:
    """A block under a given displacement: its foot spreads, and sticks on less than a thousandth of its length."""
    return bk.Scene(
        title="block",
        shape=bk.Rectangle(1.0, 0.5),
        material=bk.Material(1.0, 0.3),
        law=law,
        parts=(
            bk.Part("floor", bk.Contact(bk.RigidHalfPlane()), sides=("bottom",)),
            bk.Part("top", bk.PrescribedDisplacement(x=2e-3, y=-1e-2), sides=("top",)),
        ),
        discretisation=bk.Galerkin(2),
        mesh=bk.MeshOptions(rising_degrees=True, accuracy=accuracy),
    )


@pytest.mark.parametrize("accuracy", [1e-3, pytest.param(1e-5, marks=pytest.mark.slow)])
def test_short_stick_zones_are_resolved(accuracy: float) -> None:
    """No accuracy below 2e-3 was reached without layers towards the reversal; the zone is told to a tenth at 1e-3."""
    solution = bk.run(pushed(bk.Tresca(1e-3), accuracy))
    assert solution.is_converged
    assert solution.n_elements <= (60 if accuracy == 1e-3 else 140)
    stick = [transition.s for transition in solution.transitions]
    assert stick == pytest.approx([0.3101956, 0.3106496], abs=0.05 * accuracy)
    assert solution.places.reversals == ()


def test_both_sides_of_a_contact_are_cut_where_slip_reverses() -> None:
    halves = [
        bk.Body(
            name=name,
            shape=bk.Rectangle(1.0, 0.25, corner=(0.0, y)),
            material=bk.Material(young, 0.3),
            parts=(
                bk.Part("face", bk.Free(), sides=(face,)),
                bk.Part("end", bk.PrescribedDisplacement(x=0.0, y=move), sides=(end,)),
            ),
        )
        for name, y, young, face, end, move in (
            ("low", 0.0, 1.0, "top", "bottom", 0.0),
            ("high", 0.25, 9.0, "bottom", "top", -1e-2),
        )
    ]
    pair = bk.ContactPair(sides=("low.face", "high.face"))
    mesh = bk.MeshOptions(elements=20)
    assembly = bk.Scene(title="pair", bodies=tuple(halves), contacts=(pair,), law=bk.Tresca(1e-4), mesh=mesh)
    ends = bk.run(assembly).places.reversals
    assert [end.body for end in ends] == ["low", "high"]
    for end in ends:
        start, stop = end.mesh.start[end.element, 0], end.mesh.end[end.element, 0]
        assert start + end.fraction * (stop - start) == pytest.approx(0.5, abs=1e-6)
