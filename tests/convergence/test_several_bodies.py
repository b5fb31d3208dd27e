"""Contact of several bodies against closed forms: shrink fits, a pin in a hole, cylinders that are sheared, a slot."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import bemkit as bk


def quadrants(name: str) -> tuple[str, ...]:
    return tuple(f"{name}-{number}" for number in (1, 2, 3, 4))


def fit(plane: bk.Plane, pressure: float, heat: float | None = None) -> bk.Scene:
    """Ring 0.5 < r < 1 (E = 1, nu = 0.3) in a ring 1 < r < 2 (E = 0.5, nu = 0.2), an interference of 1e-3.

    A small arc of the outer boundary is moved as Lame says, so that nothing turns and nothing is added. With `heat` the
    interference comes of it: 1e-3 in plane stress.
    """
    outer = bk.Material(0.5, 0.2, plane)
    nu, shear = outer.effective_poisson_ratio, outer.shear_modulus
    stretch = pressure / (6.0 * shear) * ((1.0 - 2.0 * nu) * 2.0 + 2.0) / 2.0
    hold = bk.Part(
        "hold",
        bk.PrescribedDisplacement(bk.Expression(f"{stretch!r} * x"), bk.Expression(f"{stretch!r} * y")),
        ("outer-1", "outer-4"),
        bk.Expression("x > 1.99"),
    )
    forces = () if heat is None else (bk.Heating(heat, 1.0),)
    rings = (
        bk.Body(name="inner", shape=bk.Ring(0.5, 1.0), material=bk.Material(1.0, 0.3, plane), body_forces=forces,
                parts=(bk.Part("fit", bk.Free(), quadrants("outer")),)),
        bk.Body(name="outer", shape=bk.Ring(1.0, 2.0), material=outer,
                parts=(bk.Part("fit", bk.Free(), quadrants("inner")), hold)),
    )  # fmt: skip
    pair = bk.ContactPair(("inner.fit", "outer.fit"), gap=-1e-3 if heat is None else 0.0)
    return bk.Scene(
        title="Shrink fit", bodies=rings, contacts=(pair,), law=bk.Coulomb(0.2), discretisation=bk.Galerkin(8),
        mesh=bk.MeshOptions(elements=32),
    )  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize(
    ("plane", "pressure", "heat"),
    [
        pytest.param(bk.Plane.STRESS, 1.96078431e-4, None, marks=pytest.mark.slow),
        pytest.param(bk.Plane.STRAIN, 2.08044383e-4, None, marks=pytest.mark.slow),
        (bk.Plane.STRESS, 1.96078431e-4, 1e-3),
    ],
)
def test_shrink_fit_of_two_rings(plane: bk.Plane, pressure: float, heat: float | None) -> None:
    """Lame's pressure, given to nine digits; elements of degree 8 over 11 degrees leave 1e-8."""
    solution = bk.run(fit(plane, pressure, heat))
    assert solution.is_converged
    np.testing.assert_allclose(-solution.contact.sigma_n, pressure, rtol=3e-8)
    assert np.abs(solution.contact.sigma_t).max() < 1e-8 * pressure


@pytest.mark.slow
@pytest.mark.parametrize(
    ("clearance", "half_angle", "peak"),
    [(2.823121, 45.0, 0.882111), (0.287077, 75.0, 0.628103)],
)
def test_pin_in_a_hole_of_an_infinite_sheet(clearance: float, half_angle: float, peak: float) -> None:
    """Persson's problem: equal materials, no friction, the pin loaded at its centre.

    Nothing but the hole holds the pin, which may turn. The adaptive meshes leave 0.1 % of the
    pressure; the ends of contact, told by a power law on quadratic elements, scatter by up to 0.2 % of the angle.
    """
    load, radius, material = 1e-5, 0.02, bk.Material(0.91, 0.3)
    sheet = bk.Body(
        name="sheet", shape=bk.ExteriorOf(bk.Disk(1.0 + clearance * load)), material=material,
        parts=(bk.Part("hole", bk.Free(), quadrants("arc")),),
    )  # fmt: skip
    core = bk.Part("core", bk.Traction(y=load / (2.0 * np.pi * radius)), quadrants("inner"))
    pin = bk.Body(
        name="pin", shape=bk.Ring(radius, 1.0), material=material,
        parts=(core, bk.Part("surface", bk.Free(), quadrants("outer"))),
    )  # fmt: skip
    pair, options = bk.ContactPair(("pin.surface", "sheet.hole")), bk.MeshOptions(accuracy=0.004)
    scene = bk.Scene(title="Pin", bodies=(sheet, pin), contacts=(pair,), discretisation=bk.Galerkin(2), mesh=options)
    solution = bk.run(scene)
    assert solution.is_converged
    (contact,) = solution.contacts
    assert contact.force_normal > load  # pressures around an arc
    assert abs(contact.force_y) == pytest.approx(load, rel=1e-9)  # statics; a floating body of condition 1e4
    assert np.degrees(contact.contact_length / 2.0) == pytest.approx(half_angle, rel=2e-3)
    assert contact.peak_pressure == pytest.approx(peak * load, rel=1e-3)


@pytest.mark.slow
def test_cylinders_approach_each_other_as_the_closed_form_says() -> None:
    """Two discs between smooth rigid plates: each centre nears each contact by (P / pi E') (2 ln(4 R / a) - 1).

    The closed form leaves out (a / R)^2 = 3e-4; the force drives the upper plate.
    """
    load, material = 2e-4, bk.Material(0.91, 0.3)  # E' = 1
    near, low, high = bk.Expression("abs(x) < 0.06"), ("arc-3", "arc-4"), ("arc-1", "arc-2")
    top = bk.Part("top", bk.Free(), high, near)
    floor = bk.Part("floor", bk.Contact(bk.RigidHalfPlane()), low, near)
    lower = bk.Body(name="lower", shape=bk.Disk(1.0, (0.0, 1.0)), material=material, parts=(top, floor))
    bottom = bk.Part("bottom", bk.Free(), low, near)
    upper = bk.Body(name="upper", shape=bk.Disk(1.0, (0.0, 3.0)), material=material, parts=(top, bottom))
    plate = bk.RigidBody(name="plate", obstacle=bk.RigidHalfPlane((0.0, 4.0), (0.0, -1.0)), force_y=-load)
    solution = bk.run(
        bk.Scene(
            title="Cylinders between plates",
            bodies=(lower, upper),
            rigid=(plate,),
            contacts=(bk.ContactPair(("upper.bottom", "lower.top")), bk.ContactPair(("upper.top", "plate"))),
            discretisation=bk.Galerkin(2),
            mesh=bk.MeshOptions(accuracy=0.01),
        )
    )
    assert solution.is_converged
    half_width = np.sqrt(4.0 * load / np.pi)  # R E* are 1/2 and 1/2 between the discs, 1 and 1 at the plates
    expected = 2.0 * load / np.pi * (2.0 * np.log(4.0 / half_width) - 1.0)
    heights = {"lower": 1.0, "upper": 3.0}
    sinks = [
        bk.interior_fields(solution.bodies[name]).displacement(np.array([[0.0, y]]))[0, 1]
        for name, y in heights.items()
    ]
    assert sinks[0] - sinks[1] == pytest.approx(expected, rel=1e-3)
    assert -solution.rigid["plate"].y == pytest.approx(2.0 * expected, rel=1e-3)
    for contact in solution.contacts:
        assert contact.peak_pressure == pytest.approx(2.0 * load / (np.pi * half_width), rel=1e-3)


@pytest.mark.slow
def test_cylinders_pressed_then_sheared_are_those_of_cattaneo_and_mindlin() -> None:
    """Two steps on meshes that fit the sheared state: stick zone, shear and slip at the edge to half a per cent."""
    scene, friction = bk.load_scene("two-cylinders"), 0.5

    def sheared(shift: float, mesh: bk.MeshOptions) -> bk.Scene:
        upper, lower = scene.bodies
        pushed = replace(upper.parts[0], condition=bk.PrescribedDisplacement(shift, -0.0022))
        bodies = (replace(upper, parts=(pushed, *upper.parts[1:])), lower)
        return replace(scene, bodies=bodies, law=bk.Coulomb(friction), mesh=mesh)

    fitted = bk.run(sheared(0.0008, bk.MeshOptions(accuracy=0.004)))
    meshes = {name: body.mesh for name, body in fitted.bodies.items()}
    options = bk.MeshOptions(elements=100)  # not used: the meshes are given
    pressed, solution = bk.run([sheared(0.0, options), sheared(0.0008, options)], mesh=meshes)
    (contact,) = solution.contacts
    press, shear = contact.force_normal, abs(contact.force_tangential)
    half_width = np.sqrt(4.0 * press / np.pi)  # R = 1/2, E* = 1/2
    stuck, peak = half_width * np.sqrt(1.0 - shear / (friction * press)), 2.0 * press / (np.pi * half_width)
    places = [each.x for each in solution.transitions if "stick" in (each.from_status, each.to_status)]
    assert (places[-1] - places[0]) / 2.0 == pytest.approx(stuck, rel=5e-3)
    table = solution.contact

    def arch(a: float) -> np.ndarray:
        return np.sqrt(np.maximum(1.0 - (table.x / a) ** 2, 0.0))

    expected = friction * peak * (arch(half_width) - stuck / half_width * arch(stuck))
    error = table.weight @ (np.abs(table.sigma_t) - expected) ** 2 / (table.weight @ expected**2)
    assert np.sqrt(error) < 1e-2
    slip = np.abs(table.u_t - pressed.contact.u_t)
    edge = friction * peak / (0.5 * half_width) * (
        half_width * np.sqrt(half_width**2 - stuck**2) - stuck**2 * np.arccosh(half_width / stuck)
    )  # fmt: skip
    right = table.x > 0.0
    assert np.interp(half_width, table.x[right], slip[right]) == pytest.approx(edge, rel=5e-3)


@pytest.mark.slow
def test_two_sides_of_one_body_touch_as_its_half_touches_a_wall() -> None:
    """A clamp with a slot that closes: by symmetry each half meets a smooth rigid line in the middle."""
    gap, material = 0.01, bk.Material(1.0, 0.3)
    press = bk.Part("press", bk.Pressure(0.02), ("top",), bk.Expression("x > 1"))
    wall = bk.Part("wall", bk.Clamped(), ("left",))
    whole = bk.Body(
        name="clamp", material=material, mesh=bk.MeshOptions(elements=140),
        shape=bk.Polygon(
            ((0, -1), (2, -1), (2, -gap), (0.5, -gap), (0.5, gap), (2, gap), (2, 1), (0, 1)),
            ("bottom", "end 1", "lower", "root", "upper", "end 2", "top", "left"),
        ),
        parts=(wall, press, bk.Part("push", bk.Pressure(0.02), ("bottom",), bk.Expression("x > 1"))),
    )  # fmt: skip
    pair = bk.ContactPair(("clamp.lower", "clamp.upper"))
    solution = bk.run(bk.Scene(title="Slot", bodies=(whole,), contacts=(pair,), discretisation=bk.Galerkin(2)))
    half = bk.Scene(
        title="Half of it", material=material, mesh=bk.MeshOptions(elements=70), discretisation=bk.Galerkin(2),
        shape=bk.Polygon(
            ((0, 0), (0.5, 0), (0.5, gap), (2, gap), (2, 1), (0, 1)), ("middle", "root", "upper", "end", "top", "left")
        ),
        parts=(
            wall, press, bk.Part("line", bk.Roller(), ("middle",)),
            bk.Part("contact", bk.Contact(bk.RigidHalfPlane()), ("upper",)),
        ),
    )  # fmt: skip
    expected = bk.run(half)
    assert solution.is_converged
    assert expected.is_converged
    (contact,) = solution.contacts
    assert contact.force_normal == pytest.approx(expected.force_normal, rel=3e-3)  # two meshes of about 70 elements
    assert contact.contact_length == pytest.approx(expected.contacts[0].contact_length, abs=0.03)  # an element
