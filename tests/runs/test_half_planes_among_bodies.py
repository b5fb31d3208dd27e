"""Half-planes beside other bodies: in contact with round, rectangular and rough ones, moved and loaded far away."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import bemkit as bk
from bemkit.testing import check_solution
from tests.slow import slow_except

SOFT = bk.Material(1.0, 0.3)
HERTZ_MODULUS = 0.5 * SOFT.plane_modulus
"""Of two bodies of one material: 1 / E* = 2 / E'."""
WAVE = 1e-3
"""Amplitude of the gap; a mean pressure of pi E* times it closes the contact [Westergaard1939]."""


def facing(shape: bk.ElasticHalfPlane | bk.PeriodicHalfPlane, far: bk.FarField) -> tuple[bk.Body, bk.Body]:
    """Return a half-plane at rest far away, and another one above it."""
    lower = bk.Body(name="lower", shape=shape, material=SOFT)
    return lower, replace(lower, name="upper", placement=bk.Placement((0.0, 0.0), 180.0), far=far)


def wavy(share: float, elements: int, **changes: object) -> bk.Scene:
    """Return two periodic half-planes with a wavy gap, under a share of the pressure that closes it."""
    far = bk.FarField(x=0.0, force_y=-share * np.pi * HERTZ_MODULUS * WAVE)
    gap = bk.Expression(f"{WAVE} * (1 - cos(2 * pi * x))")
    scene = bk.Scene(
        title="wavy",
        bodies=facing(bk.PeriodicHalfPlane(1.0, -0.5), far),
        contacts=(bk.ContactPair(("lower.surface", "upper.surface"), gap=gap),),
        mesh=bk.MeshOptions(elements=elements),
    )
    return replace(scene, **changes)


def stick_or_contact_length(share: float) -> float:
    """Return the length in contact under a share of the pressure that closes the gap."""
    return float(2.0 / np.pi * np.arcsin(np.sqrt(share)))


@pytest.mark.parametrize("share", [0.2, 0.5])
def test_wavy_half_planes_touch_on_the_length_of_westergaard(share: float) -> None:
    solution = bk.run(wavy(share, 100))
    check_solution(solution)
    # to half an element
    assert solution.contacts[0].contact_length == pytest.approx(stick_or_contact_length(share), abs=5e-3)
    assert solution.force_normal == pytest.approx(share * np.pi * HERTZ_MODULUS * WAVE, rel=1e-10)
    assert solution.work == solution.plan.work


def test_tractions_of_two_half_planes_have_an_estimate() -> None:
    """It falls by more than two with twice the elements."""
    coarse, fine = (bk.run(wavy(0.5, n, law=bk.Coulomb(0.3))).estimated_traction_error for n in (30, 60))
    assert coarse is not None
    assert fine is not None
    assert 2.0 < coarse / fine < 4.0
    assert 0.01 < fine < 0.03


@pytest.mark.slow
def test_wavy_half_planes_are_sheared_in_steps() -> None:
    """Partial slip by Jaeger's principle: the stick zone is the contact under the pressure less T / mu, at T < mu P."""
    steps = (bk.Step(1.0), bk.Step(2.0, {"bodies.upper.far.x": "1e-3 * (t - 1)"}, increments=4))
    solution = bk.run(wavy(0.5, 200, law=bk.Coulomb(0.3), steps=steps))
    partly = solution.at_step(2)
    check_solution(partly, solution.at_step(1))
    reached = abs(partly.force_tangential) / (0.3 * partly.force_normal)
    assert 0.7 < reached < 0.8
    n_stick = partly.contact.status_words().count("stick")
    assert n_stick / 200 == pytest.approx(stick_or_contact_length(0.5 * (1.0 - reached)), abs=0.01)  # two elements
    assert solution.force_tangential == pytest.approx(-0.3 * solution.force_normal, rel=1e-9)


@pytest.mark.parametrize("far", slow_except([{"y": -1e-3}, {"force_y": -1e-3}], {"force_y": -1e-3}))
def test_flat_half_planes_press_each_other_like_rigid_punches(far: dict[str, float]) -> None:
    """Two equal strips, of which only one has an edge on the other: P / (pi sqrt(a^2 - x^2))."""
    scene = bk.Scene(
        title="flat",
        bodies=facing(bk.ElasticHalfPlane(-1.0, 1.0), bk.FarField(x=0.0, turn=0.0, **far)),
        contacts=(bk.ContactPair(("lower.surface", "upper.surface")),),
        mesh=bk.MeshOptions(elements=200),
    )
    solution = bk.run(scene)
    table, inside = solution.contact, np.abs(solution.contact.x) < 0.9
    expected = solution.force_normal / np.pi / np.sqrt(1.0 - table.x[inside] ** 2)
    np.testing.assert_allclose(-table.sigma_n[inside], expected, rtol=6e-3)  # of elements of a hundredth
    moved = [float(body.boundary.displacement[100, 1]) for body in solution.bodies.values()]
    assert moved[0] < 0.0
    if "force_y" in far:
        assert solution.force_normal == pytest.approx(1e-3, rel=1e-10)
    else:  # what is given far away closes at the surface
        assert moved[0] == pytest.approx(moved[1], rel=1e-9)


@pytest.mark.parametrize("far", [{"force_y": 1e-3, "turn": 0.0}, {"y": 2e-3, "turn": 0.0, "strain": 1e-3}])
def test_a_rigid_body_at_rest_is_a_fixed_obstacle(far: dict[str, float]) -> None:
    """The matrix of the joined bodies and the equations of the strip have one answer."""
    alone = bk.load_scene("cylinder-on-half-plane")
    alone = replace(alone, far=bk.FarField(x=0.0, **far), mesh=bk.MeshOptions(elements=60))
    (part,) = alone.parts
    body = bk.Body(
        name="ground",
        shape=alone.shape,
        material=alone.material,
        far=alone.far,
        parts=(replace(part, condition=bk.Free()),),
    )
    rigid = bk.RigidBody(name="cylinder", obstacle=part.condition.obstacle, x=0.0, y=0.0, turn=0.0)
    beside = bk.Scene(
        title=alone.title,
        bodies=(body,),
        rigid=(rigid,),
        contacts=(bk.ContactPair((f"ground.{part.name}", "cylinder")),),
        law=alone.law,
        mesh=alone.mesh,
    )
    one, other = bk.run(alone), bk.run(beside)
    for name in ("u_n", "u_t", "sigma_n", "sigma_t"):
        ours, theirs = getattr(one.contact, name), getattr(other.contact, name)
        np.testing.assert_allclose(theirs, ours, rtol=0.0, atol=1e-9 * np.abs(ours).max())
    np.testing.assert_allclose(other.boundary.displacement, one.boundary.displacement, rtol=0.0, atol=1e-11)


def disc(mesh: bk.MeshOptions) -> bk.Scene:
    """Return a disc of radius 1 that is pressed on a half-plane."""
    load = bk.Part("load", bk.PrescribedDisplacement(x=0.0, y=-0.002), ("arc-1", "arc-2"))
    round_one = bk.Body(
        name="disc", shape=bk.Disk(1.0), material=SOFT, parts=(load,), placement=bk.Placement((0.0, 1.0))
    )
    ground = bk.Body(name="ground", shape=bk.ElasticHalfPlane(-0.1, 0.1), material=SOFT)
    pairs = tuple(bk.ContactPair(("ground.surface", f"disc.arc-{quarter}")) for quarter in (3, 4))
    return bk.Scene(title="disc", bodies=(round_one, ground), contacts=pairs, mesh=mesh)


@pytest.mark.slow
def test_a_disc_on_a_half_plane_meets_hertz() -> None:
    solution = bk.run(disc(bk.MeshOptions(accuracy=5e-4)))
    assert solution.is_converged, solution.message
    half_width = 0.5 * sum(contact.contact_length for contact in solution.contacts)
    peak = max(contact.peak_pressure for contact in solution.contacts)
    expected = np.sqrt(4.0 * solution.force_normal / (np.pi * HERTZ_MODULUS))
    # half-widths of 0.03 R: the disc differs from a parabola by as much squared
    assert half_width == pytest.approx(expected, rel=1e-4)
    assert peak == pytest.approx(2.0 * solution.force_normal / (np.pi * expected), rel=1e-4)


@pytest.mark.slow
def test_stiff_blocks_on_each_other_are_a_punch_on_a_half_plane() -> None:
    stiff, top = bk.Material(1e4, 0.3), bk.Part("top", bk.Traction(y=-1e-3), ("top",))
    block = bk.Body(name="lower", shape=bk.Rectangle(1.0, 0.5), material=stiff, placement=bk.Placement((-0.5, 0.0)))
    upper = replace(block, name="upper", parts=(top,), placement=bk.Placement((-0.5, 0.5)))
    ground = bk.Body(name="ground", shape=bk.ElasticHalfPlane(-1.0, 1.0), material=SOFT)
    scene = bk.Scene(
        title="stack",
        bodies=(upper, block, ground),
        contacts=(bk.ContactPair(("upper.bottom", "lower.top")), bk.ContactPair(("lower.bottom", "ground.surface"))),
        mesh=bk.MeshOptions(elements=120),
    )
    solution = bk.run(scene)
    check_solution(solution)
    assert [contact.force_normal for contact in solution.contacts] == pytest.approx([1e-3, 1e-3], rel=1e-8)
    rows = solution.contact.rows("lower.bottom / ground.surface")
    x, pressure = solution.contact.x[rows], -solution.contact.sigma_n[rows]
    inside = np.abs(x) < 0.4
    np.testing.assert_allclose(pressure[inside], 1e-3 / np.pi / np.sqrt(0.25 - x[inside] ** 2), rtol=0.02)
