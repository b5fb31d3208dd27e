"""Closed forms of rigid indenters on a half-plane, met to 1e-3 on adaptive meshes, without any block."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

import bemkit as bk
from bemkit import reference
from tests.slow import slow_except

MATERIAL = bk.Material(1.0, 0.3)
MODULUS = MATERIAL.plane_modulus
FRICTION = bk.Coulomb(0.3)
ALONG = bk.FarField(force_y=1.0, x=0.0, turn=0.0)
ROUNDED = "where(abs(x) > 0.5, (abs(x) - 0.5)**2 / 2, 0 * x)"
WITHIN = 1e-3
"""What is asked of the meshes, and what all figures below are met to."""


def pressed(gap: str, half_width: float, far: bk.FarField, **changes: object) -> bk.Solution:
    changes = {"law": bk.Frictionless(), "mesh": bk.MeshOptions(accuracy=WITHIN)} | changes
    parts = (bk.Part("zone", bk.Contact(bk.Gap(bk.Expression(gap)))),)
    shape = bk.ElasticHalfPlane(-half_width, half_width)
    solution = bk.run(bk.Scene(title="indenter", shape=shape, material=MATERIAL, parts=parts, far=far, **changes))  # type: ignore[arg-type]
    assert solution.is_converged, solution.message
    return solution


def pressure_error(solution: bk.Solution, exact: Callable[[np.ndarray], np.ndarray], inner: float) -> float:
    """Return the mean error of the pressures of elements with |x| < inner, relative to its mean.

    They are compared with means over the elements: the pressure under a wedge is infinite at its tip.
    """
    table = solution.contact
    rows = np.abs(table.x) < inner
    places, weights = np.polynomial.legendre.leggauss(8)
    expected = exact(table.x[rows, None] + 0.5 * table.weight[rows, None] * places) @ weights / 2.0
    return float(table.weight[rows] @ np.abs(table.sigma_n[rows] + expected) / (table.weight[rows] @ np.abs(expected)))


def local_error(solution: bk.Solution, exact: Callable[[np.ndarray], np.ndarray], half_width: float) -> float:
    """Return the largest error of the pressure of an element, but on an equally small share of the contact.

    Relative to the pressure there or to the mean, whichever is larger.
    """
    mesh = solution.mesh
    rows = np.abs(mesh.centres[:, 0]) < half_width
    places, weights = np.polynomial.legendre.leggauss(8)
    inside = half_width * (1.0 - 1e-14)
    x = np.clip(mesh.centres[rows, :1] + 0.5 * mesh.lengths[rows, None] * places, -inside, inside)
    pressure = -solution.boundary.traction[rows, 1]
    unit = np.maximum(pressure, float(mesh.lengths[rows] @ pressure) / (2.0 * half_width))
    errors = np.abs(pressure - exact(x) @ weights / 2.0) / unit
    order = np.argsort(-errors)
    worse = np.cumsum(np.append(0.0, mesh.lengths[rows][order])) / (2.0 * half_width)
    return float(np.maximum(np.append(errors[order], 0.0), worse).min())


def zones(solution: bk.Solution) -> list[float]:
    """Return |x| of the places of change on the right, the outermost first."""
    return sorted((place.x for place in solution.transitions if place.x > 0.0), reverse=True)


INDENTERS: dict[str, tuple[str, bk.FarField, bk.FrictionLaw, reference.LineContact]] = {
    "cylinder": ("x**2 / 2", ALONG, bk.Frictionless(), reference.HertzLine(1.0, 1.0, MODULUS)),
    "wedge": ("0.5 * abs(x)", ALONG, bk.Frictionless(), reference.BluntWedge(1.0, 0.5, MODULUS)),
    "rounded": (ROUNDED, ALONG, bk.Frictionless(), reference.RoundedPunch(1.0, 0.5, 1.0, MODULUS)),
    "flat": ("0 * x", ALONG, bk.Frictionless(), reference.FlatPunch(1.0, 1.0, MODULUS)),
    "tilted": ("0 * x", replace(ALONG, turn=0.9), bk.Frictionless(), reference.FlatPunch(1.0, 1.0, MODULUS, 0.9)),
    "sliding": ("0 * x", replace(ALONG, x=10.0), FRICTION, reference.SlidingPunch(1.0, 1.0, -0.3, MATERIAL)),
}


@pytest.mark.parametrize("accuracy", slow_except([1e-2, 1e-3, 1e-4], 1e-2))
@pytest.mark.parametrize("name", INDENTERS)
def test_what_is_asked_of_the_pressures_is_what_they_have(name: str, accuracy: float) -> None:
    gap, far, law, exact = INDENTERS[name]
    is_smooth = name in ("cylinder", "wedge", "rounded")
    half_width = exact.half_width if is_smooth else 1.0
    width = 1.7 * half_width if is_smooth else half_width
    solution = pressed(gap, width, far, law=law, mesh=bk.MeshOptions(accuracy=accuracy))
    assert pressure_error(solution, exact.pressure, 0.95 * half_width) < accuracy
    largest, estimate = local_error(solution, exact.pressure, half_width), solution.estimated_local_traction_error
    assert estimate is not None
    assert largest < max(accuracy, 1e-3)
    assert 0.7 * largest < estimate < 4.0 * largest
    if is_smooth:
        assert zones(solution)[0] == pytest.approx(half_width, rel=accuracy)
    if name == "cylinder":
        assert -solution.contact.sigma_n.min() == pytest.approx(exact.pressure(np.zeros(1))[0], rel=accuracy)
    if is_smooth:  # punches, infinite at their edges, are better than they seem
        assert solution.estimated_traction_error is not None
        assert solution.estimated_traction_error < 6.0 * pressure_error(solution, exact.pressure, half_width)


def test_a_cylinder_as_hertz() -> None:
    a = np.sqrt(4.0 / (np.pi * MODULUS))
    peak = 2.0 / (np.pi * a)
    solution = pressed("x**2 / 2", 2.0 * a, ALONG)
    assert zones(solution)[0] == pytest.approx(a, rel=WITHIN)
    assert -solution.contact.sigma_n.min() == pytest.approx(peak, rel=WITHIN)
    assert pressure_error(solution, lambda x: peak * np.sqrt(1.0 - (x / a) ** 2), 0.95 * a) < WITHIN


@pytest.mark.slow
def test_a_flat_punch() -> None:
    solution = pressed("0 * x", 1.0, ALONG)
    assert pressure_error(solution, lambda x: 1.0 / (np.pi * np.sqrt(1.0 - x**2)), 0.95) < WITHIN


@pytest.mark.slow
def test_a_punch_under_a_moment() -> None:
    """Of a flat punch that carries the moment M, p = P / (pi w) + 2 M x / (pi w), w = sqrt(1 - x^2)."""
    solution = pressed("0 * x", 1.0, bk.FarField(force_y=1.0, x=0.0, moment=-0.1))
    # the moment turns the half-plane clockwise, so that the left end is pressed
    assert pressure_error(solution, lambda x: (1.0 - 0.2 * x) / (np.pi * np.sqrt(1.0 - x**2)), 0.95) < WITHIN
    (force,) = solution.contacts
    assert force.moment == pytest.approx(0.1, rel=1e-9)


@pytest.mark.slow
def test_a_blunt_wedge() -> None:
    slope = 0.01
    solution = pressed("0.01 * abs(x)", 2.0, bk.FarField(force_y=slope * MODULUS, x=0.0, turn=0.0))
    assert zones(solution)[0] == pytest.approx(1.0, rel=WITHIN)
    assert pressure_error(solution, lambda x: MODULUS * slope / np.pi * np.arccosh(1.0 / np.abs(x)), 0.95) < WITHIN


@pytest.mark.slow
def test_a_punch_that_slides() -> None:
    """Moved far to the right the half-plane feels friction to the left, and the pressure leans to one side."""
    nu = MATERIAL.poisson_ratio
    g = np.arctan(0.3 * (1.0 - 2.0 * nu) / (2.0 * (1.0 - nu))) / np.pi

    def exact(x: np.ndarray) -> np.ndarray:
        return np.asarray(np.cos(np.pi * g) / (np.pi * np.sqrt(1.0 - x**2)) * ((1.0 + x) / (1.0 - x)) ** g)

    solution = pressed("0 * x", 1.0, bk.FarField(force_y=1.0, x=10.0, turn=0.0), law=FRICTION)
    assert pressure_error(solution, exact, 0.95) < WITHIN
    (force,) = solution.contacts
    assert force.force_x == pytest.approx(-0.3, rel=1e-9)


@pytest.mark.slow
def test_a_punch_that_is_bonded() -> None:
    """Tractions under a bonded punch oscillate: t = P (kappa + 1) / (2 pi sqrt(kappa w2)) ((1 + x) / (1 - x))^(i e)."""
    parts = (bk.Part("punch", bk.PrescribedDisplacement(x=0.0, y=-0.1)),)
    scene = bk.Scene(
        title="bonded",
        shape=bk.ElasticHalfPlane(-1.0, 1.0),
        material=MATERIAL,
        parts=parts,
        mesh=bk.MeshOptions(accuracy=WITHIN),
    )
    solution = bk.run(scene)
    assert solution.is_converged, solution.message
    kappa, x = MATERIAL.kappa, solution.boundary.centres[:, 0]
    traction = solution.boundary.traction
    force = float(-traction[:, 1] @ solution.mesh.lengths)
    size = force * (kappa + 1.0) / (2.0 * np.pi * np.sqrt(kappa) * np.sqrt(1.0 - x**2))
    phase = np.log(kappa) / (2.0 * np.pi) * np.log((1.0 + x) / (1.0 - x))
    rows = np.abs(x) < 0.95
    np.testing.assert_allclose(-traction[rows, 1], (size * np.cos(phase))[rows], rtol=WITHIN)
    off = np.abs(np.abs(traction[rows, 0]) - (size * np.abs(np.sin(phase)))[rows])
    assert (off / size[rows]).max() < WITHIN


@pytest.mark.slow
def test_a_rounded_punch() -> None:
    """Flat for |x| < b, then a parabola [Ciavarella1998]: half-width a by 2 P R / (a^2 E') of the angle asin(b / a)."""
    b, half_width = 0.5, 1.0
    angle = np.arcsin(b / half_width)
    force = MODULUS * half_width**2 * (np.pi - 2.0 * angle - np.sin(2.0 * angle)) / 4.0
    solution = pressed(ROUNDED, 1.5, bk.FarField(force_y=force, x=0.0, turn=0.0))
    assert zones(solution)[0] == pytest.approx(half_width, rel=WITHIN)


@pytest.mark.slow
def test_stick_under_a_punch_and_under_a_cylinder_is_as_spence_says() -> None:
    """Of a flat punch pressed with friction the static and the incremental law agree: it slips inward everywhere.

    Under a cylinder they do not. Loads that grow (incremental) leave the stick ratio of the punch, whatever the profile
    [Spence1975]; a load that comes at once (static) leaves 0.296.
    """
    punch = zones(pressed("0 * x", 1.0, ALONG, law=FRICTION))[0]
    assert punch == pytest.approx(0.6891, rel=WITHIN)
    a = np.sqrt(4.0 / (np.pi * MODULUS))
    end, stick = zones(pressed("x**2 / 2", 1.5 * a, ALONG, law=FRICTION))
    assert stick / end == pytest.approx(0.29625, rel=WITHIN)
    steps = tuple((np.arange(1, 41) / 40.0) ** 2)
    mesh = bk.MeshOptions(elements=160)
    end, stick = zones(pressed("x**2 / 2", 1.1 * a, ALONG, law=FRICTION, load_factors=steps, mesh=mesh))
    # 40 steps leave 1 per cent, 160 a quarter of it
    assert stick / end == pytest.approx(punch, rel=1.5e-2)


@pytest.mark.slow
def test_two_equal_bodies_sheared_after_pressing_as_cattaneo_and_mindlin_say() -> None:
    """One half-plane of the composite modulus and of the Poisson ratio 1/2 stands for two of one material."""
    composite = 0.5 * MODULUS
    a = np.sqrt(4.0 / (np.pi * composite))
    shear = 0.5 * 0.3  # half of what friction can carry
    scene = bk.Scene(
        title="two cylinders",
        shape=bk.ElasticHalfPlane(-1.05 * a, 1.05 * a),
        material=bk.Material(0.75 * composite, 0.5),
        law=FRICTION,
        parts=(bk.Part("zone", bk.Contact(bk.Gap(bk.Expression("x**2 / 2")))),),
        far=bk.FarField(force_y=1.0, force_x=0.0, turn=0.0),
        mesh=bk.MeshOptions(elements=700),
    )
    sheared = replace(scene, far=bk.FarField(force_y=1.0, force_x=shear, turn=0.0))
    pressed_state, solution = bk.run([scene, sheared])
    assert solution.is_converged
    # pressing alone causes no friction between equal bodies
    assert np.abs(pressed_state.contact.sigma_t).max() < 1e-9
    stick = a * np.sqrt(1.0 - shear / 0.3)
    places = [place.x for place in solution.transitions if "stick" in (place.from_status, place.to_status)]
    assert sorted(places) == pytest.approx([-stick, stick], rel=WITHIN)
    x = solution.contact.x
    outer, inner = (np.sqrt(np.maximum(1.0 - (x / size) ** 2, 0.0)) for size in (a, stick))
    exact = 0.3 * 2.0 / (np.pi * a) * (outer - stick / a * inner)
    weight = solution.contact.weight
    assert weight @ np.abs(np.abs(solution.contact.sigma_t) - exact) < WITHIN * shear


def block(n_half_widths: float) -> bk.Solution:
    """Press the cylinder onto a block of so many half-widths between walls."""
    size = n_half_widths * np.sqrt(4.0 / (np.pi * MODULUS))
    scene = bk.Scene(
        title="block",
        shape=bk.Rectangle(size, size, (-0.5 * size, -size)),
        material=MATERIAL,
        law=FRICTION,
        parts=(
            bk.Part("zone", bk.Contact(bk.Gap(bk.Expression("x**2 / 2"))), ("top",), bk.Expression("abs(x) < 2")),
            bk.Part("load", bk.Pressure(1.0 / size), ("bottom",)),
            bk.Part("side", bk.Roller(), ("left", "right")),
        ),
        discretisation=bk.Galerkin(2),
        mesh=bk.MeshOptions(accuracy=3e-4),
    )
    solution = bk.run(scene)
    assert solution.is_certified, solution.message
    return solution


@pytest.mark.slow
def test_blocks_agree_as_they_grow() -> None:
    """Far away a half-plane moves towards the load by a constant, a block between its walls does not.

    That strains the surface by as much as its size is small: at 30, 60 and 120 half-widths the peak is 3.3e-3, 2.0e-3
    and 1.1e-3 too low, the stick zone 7.9, 3.9 and 1.9 per cent too long. What is left in proportion goes.
    """
    a = np.sqrt(4.0 / (np.pi * MODULUS))
    half_plane = pressed("x**2 / 2", 1.5 * a, ALONG, law=FRICTION)
    expected_peak, (expected_end, expected_stick) = -half_plane.contact.sigma_n.min(), zones(half_plane)
    sizes = [block(30.0), block(60.0)]
    peaks = [-each.contact.sigma_n.min() for each in sizes]
    (end, stick), (larger_end, larger_stick) = map(zones, sizes)
    assert larger_end == pytest.approx(expected_end, rel=WITHIN)
    assert [stick / expected_stick, larger_stick / expected_stick] == pytest.approx([1.079, 1.039], abs=3e-3)
    assert 2.0 * peaks[1] - peaks[0] == pytest.approx(expected_peak, rel=2.0 * WITHIN)
    assert 2.0 * larger_stick - stick == pytest.approx(expected_stick, rel=3.0 * WITHIN)
    assert end == pytest.approx(expected_end, rel=2.0 * WITHIN)
