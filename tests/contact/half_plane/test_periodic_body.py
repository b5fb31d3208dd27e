"""The periodic half-plane as a body: its promises, and agreement of Fourier transforms with matrices."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import bemkit as bk
from bemkit.contact.body import ContactState, SingularResponse, separated
from bemkit.contact.half_plane.periodic_body import PeriodicBody
from bemkit.model.model import build_model
from bemkit.model.prepared import prepare
from bemkit.operators.boundary_equations import LinearConditions
from bemkit.operators.half_plane.flexibility import mean_logarithms
from bemkit.operators.half_plane.periodic import PeriodicElasticity, wave_flexibility
from bemkit.operators.material import Material, Plane
from bemkit.studies.stability.transform import with_gap_offset
from bemkit.testing import check_body
from tests.slow import slow_except

MATERIAL = bk.Material(2.0, 0.2)
PRESSURE = 0.5 * np.pi * 0.01 * MATERIAL.plane_modulus
DRIVES = {
    "force": bk.FarField(force_x=0.2 * PRESSURE, force_y=PRESSURE),
    "force and motion": bk.FarField(x=1e-3, force_y=PRESSURE),
    "motion": bk.FarField(x=1e-3, y=0.01),
    "at rest": None,
}


def scene(n_elements: int, far: bk.FarField | None = DRIVES["force"], **changes: object) -> bk.Scene:
    given = {
        "title": "wave",
        "shape": bk.PeriodicHalfPlane(1.0, -0.5),
        "material": MATERIAL,
        "law": bk.Coulomb(0.3),
        "parts": (bk.Part("zone", bk.Contact(bk.Gap(bk.Expression("0.01 * (1 - cos(2 * pi * x))")))),),
        "far": far,
        "mesh": bk.MeshOptions(elements=n_elements),
    }
    return bk.Scene(**(given | changes))  # type: ignore[arg-type]


def body_of(asked: bk.Scene) -> PeriodicBody:
    body = build_model(prepare(asked, asked.build_mesh())).body
    assert isinstance(body, PeriodicBody)
    return body


@pytest.mark.parametrize("drive", slow_except(DRIVES, "force and motion"))
def test_it_keeps_the_promises_of_a_body(drive: str) -> None:
    body = body_of(scene(32, DRIVES[drive]))
    other = replace(body, force=body.force + 0.1)
    check_body(body, is_symmetric=True, reloaded=other)


@pytest.mark.parametrize(("x", "y"), slow_except([("0.3", "-1.0"), ("x", "-1.0")], ("x", "-1.0")))
def test_contact_may_be_oblique(x: str, y: str) -> None:
    towards = bk.Expression(x), bk.Expression(y)
    parts = (bk.Part("zone", bk.Contact(bk.Gap(0.0, (towards[0], bk.Expression("1.0"))))),)
    check_body(body_of(scene(32, parts=parts)), is_symmetric=True)


@pytest.mark.parametrize("plane", Plane)
def test_waves_are_those_of_a_row_of_strips(plane: Plane) -> None:
    """Forces and their images on both sides, as strips of a half-plane: 400 periods leave 1e-3 of the logarithm."""
    n, n_images, material = 8, 400, Material(2.0, 0.35, plane)
    symbol = wave_flexibility(n, 1.0, material)
    column = np.fft.ifft(symbol)  # displacements of a unit traction on element 0
    distance = np.abs(np.arange(n * (2 * n_images + 1)) - n * n_images)
    row = np.log(np.maximum(distance, 1) / n)  # means over pairs of elements far apart
    row -= 1.0 / (12.0 * np.maximum(distance, 1) ** 2)
    near = distance < 40
    row[near] = mean_logarithms(np.arange(41) / n)[0][distance[near]]
    along = -2.0 / (np.pi * material.plane_modulus) / n * row
    sums = along.reshape(-1, n).sum(axis=0)  # every eighth element is an image
    expected = sums - sums.mean()
    np.testing.assert_allclose((column - column.mean()).real, expected, atol=2e-3 * np.abs(expected).max())
    # the other component: signs of the two sides, less their mean
    across = 0.5 * material.plane_compressibility / n
    saw = across * np.where(np.arange(n) == 0, 0.0, 1.0 - 2.0 * np.arange(n) / n)
    np.testing.assert_allclose(column.imag, -saw, atol=1e-14)


def test_it_commutes_with_translations_and_is_positive() -> None:
    mesh = scene(64).build_mesh().unit
    elastic = PeriodicElasticity(mesh, Material(1.0, 0.49))
    assert elastic.flexibility.min() > 0.0
    force = np.random.default_rng(3).normal(size=(64, 2))
    moved = elastic.strain_displacement(np.roll(force, 5, axis=0))
    np.testing.assert_allclose(moved, np.roll(elastic.strain_displacement(force), 5, axis=0), atol=1e-12)
    held = elastic.tractions_of(elastic.displaced(elastic.to_complex(force)))
    np.testing.assert_allclose(held, elastic.to_complex(force), atol=1e-12)


def test_westergaard() -> None:
    n = 4096
    asked = scene(n, bk.FarField(x=0.0, force_y=PRESSURE), law=bk.Frictionless())
    # from cold: responses that are exact to their right-hand sides alone, far above the tractions, would stall
    solution = bk.run(asked, mesh=asked.build_mesh())
    assert solution.is_converged
    assert [abs(place.x) for place in solution.transitions] == pytest.approx([0.25, 0.25], abs=0.1 / n)
    x = solution.contact.x
    inside = np.sin(np.pi * 0.25) ** 2 - np.sin(np.pi * x) ** 2
    exact = 2.0 * PRESSURE * np.cos(np.pi * x) / 0.5 * np.sqrt(np.maximum(inside, 0.0))
    error = np.abs(solution.contact.sigma_n + exact)
    assert error.mean() < 1e-4 * PRESSURE


@pytest.mark.slow
def test_the_number_of_newton_steps_does_not_grow_with_the_elements() -> None:
    solves = [bk.run(scene(n)).linear_solves for n in (2048, 8192, 16384)]
    assert max(solves) <= 5, solves


@pytest.mark.slow
def test_units_and_places_change_nothing() -> None:
    plain = bk.run(scene(256))
    shifted = replace(
        scene(256),
        shape=bk.PeriodicHalfPlane(1000.0, -500.0),
        material=bk.Material(2e-6, 0.2),
        far=bk.FarField(force_x=2e-4 * PRESSURE, force_y=1e-3 * PRESSURE),
        parts=(bk.Part("zone", bk.Contact(bk.Gap(bk.Expression("10 * (1 - cos(2 * pi * x / 1000))")))),),
    )
    other = bk.run(shifted)
    np.testing.assert_array_equal(plain.contact.status, other.contact.status)
    np.testing.assert_allclose(1e-6 * plain.contact.sigma_n, other.contact.sigma_n, rtol=0.0, atol=1e-9 * 1e-6)


@pytest.mark.slow
@pytest.mark.parametrize("travel", [1e3, 1e5])
def test_a_gap_far_larger_than_the_deformation_changes_nothing(travel: float) -> None:
    rough = replace(bk.load_scene("rough-surface"), mesh=bk.MeshOptions(elements=128))
    near = bk.run(rough)
    offset = travel * float(np.abs(near.boundary.displacement).max())
    far = bk.run(with_gap_offset(rough, offset))
    assert far.is_converged, far.message
    # a displacement holds 1e-16 of the travel, and iterations stop at 1e-11 of the tractions
    np.testing.assert_allclose(far.contact.sigma_n, near.contact.sigma_n, atol=1e-9 * -near.contact.sigma_n.min())
    np.testing.assert_array_equal(far.contact.status, near.contact.status)


def test_what_nothing_holds_is_singular() -> None:
    body = body_of(scene(32))
    with pytest.raises(SingularResponse, match="leave a rigid motion free"):
        body.respond(separated(32))
    nothing = separated(32)
    empty = LinearConditions(nothing.on_displacement, 0.0 * nothing.on_traction, nothing.value)
    with pytest.raises(SingularResponse):
        body_of(scene(32, DRIVES["motion"])).respond(empty)


def test_a_state_that_is_no_response_is_out_of_balance() -> None:
    body = body_of(scene(32))
    flat = ContactState(np.zeros((32, 2)), np.zeros((32, 2)))
    assert body.imbalance(flat).force == 1.0


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"mesh": bk.MeshOptions(elements=32, grading=bk.Algebraic(2.0))}, "remove the grading"),
        ({"mesh": bk.MeshOptions(accuracy=1e-3)}, "elements of a periodic half-plane are equal"),
        ({"far": bk.FarField(moment=1.0)}, "far.moment is 1.0: a periodic half-plane cannot turn"),
        ({"far": bk.FarField(turn=0.1)}, "far.turn is 0.1: a periodic half-plane cannot turn"),
        ({"parts": (bk.Part("zone", bk.Clamped()),), "law": bk.Frictionless()}, "holds the surface of a periodic"),
        ({"parts": (bk.Part("zone", bk.Pressure(1.0)),), "law": bk.Frictionless()}, "is in contact: give one an"),
        ({"discretisation": bk.Galerkin(2)}, "tractions on a half-plane are constant on each element"),
        ({"discretisation": bk.ConstantCollocation()}, "tractions on a half-plane are constant on each element"),
        ({"shape": bk.Rectangle(1.0, 1.0)}, "the body is not a half-plane"),
    ],
)
def test_what_it_cannot_do_is_named(changes: dict[str, object], message: str) -> None:
    with pytest.raises(bk.InputError, match=message):
        bk.run(scene(32, **changes))  # type: ignore[arg-type]


def test_a_load_that_no_contact_can_hold_is_named() -> None:
    with pytest.raises(bk.InputError, match="slides the body to the right"):
        bk.run(scene(64, bk.FarField(force_x=0.4 * PRESSURE, force_y=PRESSURE)))
