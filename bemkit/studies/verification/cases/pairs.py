"""Two elastic bodies."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from bemkit.contact.laws import Coulomb
from bemkit.contact.obstacle import RigidHalfPlane
from bemkit.formulas import Expression
from bemkit.geometry.shapes import Disk, ElasticHalfPlane, ExteriorOf, Rectangle, Ring
from bemkit.geometry.symmetry.lines import Symmetry
from bemkit.operators.material import Material
from bemkit.reference import (
    GravityColumn,
    HertzLine,
    LameRing,
    PartialSlip,
    PinInHole,
    RecedingLayer,
    ShrinkFit,
    pair_modulus,
)
from bemkit.results.solution import Solution
from bemkit.runs.run import run
from bemkit.scene.body import Body
from bemkit.scene.body_forces import Gravity
from bemkit.scene.conditions import Contact, Free, Part, PrescribedDisplacement, Pressure, Roller, Traction
from bemkit.scene.contacts import ContactPair
from bemkit.scene.discretisation import Galerkin, MeshOptions
from bemkit.scene.scene import Scene
from bemkit.scene.toml import load_scene, with_overrides
from bemkit.studies.verification.case import Case, Quantity
from bemkit.studies.verification.measures import (
    half_length,
    half_stuck,
    largest_error,
    peak_pressure,
    pressure_error,
    shear_error,
    uniform_error,
)

_UNIT = Material(1.0, 0.3)
_PRESSURE = "pressure, largest error"


def pair_patch() -> Case:
    """Apply a uniform pressure of 1 and shear of 0.2 on meshes that do not match."""
    left, right = (Part(name, Traction(y=y), (name,)) for name, y in (("left", -0.2), ("right", 0.2)))
    moved = PrescribedDisplacement(Expression("0.39 * x + 0.52 * y"), Expression("-0.91 * y"))
    base, load = Part("base", moved, ("bottom",)), Part("load", Traction(0.2, -1.0), ("top",))
    scene = Scene(
        title="two blocks under uniform stresses",
        bodies=(
            Body(name="lower", shape=Rectangle(1.0, 1.0), material=_UNIT, parts=(base, left, right)),
            Body(name="upper", shape=Rectangle(1.0, 1.0, (0.0, 1.0)), material=_UNIT, parts=(load, left, right)),
        ),
        contacts=(ContactPair(("upper.bottom", "lower.top")),),
        law=Coulomb(0.5),
        discretisation=Galerkin(2),
    )
    bounds = (1e-11, 1e-11)
    quantities = (
        Quantity(_PRESSURE, lambda found: uniform_error(-found.contact.sigma_n, 1.0), bounds),
        Quantity("shear, largest error", lambda found: uniform_error(-found.contact.sigma_t, 0.2), bounds),
    )
    return Case(scene, "Wriggers2006", "exact for every pair of meshes", (20, 40), quantities, _unmatched)


def _unmatched(scene: Scene, n: float) -> Solution:
    """Divide the second body into 1.7 times as many elements as the first."""
    counts = int(n), int(1.7 * n)
    bodies = (replace(body, mesh=MeshOptions(elements=k)) for body, k in zip(scene.bodies, counts, strict=True))
    return run(replace(scene, bodies=tuple(bodies)))


def gravity_columns() -> Case:
    """Put a column on another one."""
    exact = GravityColumn((1.5, 1.0), (2.0, 1.0), (Material(2.0, 0.2), _UNIT))
    on_floor, between = exact.base_pressures()
    walls = Part("walls", Roller(), ("left", "right"))
    floor = Part("floor", Contact(RigidHalfPlane()), ("bottom",))
    heavy, light = (Gravity(density=density, acceleration=(0.0, -1.0)) for density in (2.0, 1.0))
    lower = Body(
        name="lower",
        shape=Rectangle(1.0, 1.5),
        material=Material(2.0, 0.2),
        parts=(walls, floor),
        body_forces=(heavy,),
    )
    upper = Body(
        name="upper", shape=Rectangle(1.0, 1.0, (0.0, 1.5)), material=_UNIT, parts=(walls,), body_forces=(light,)
    )
    scene = Scene(
        title="two columns between smooth walls under their weight",
        bodies=(lower, upper),
        contacts=(ContactPair(("upper.bottom", "lower.top")),),
        discretisation=Galerkin(2),
    )

    def settlement(solution: Solution) -> float:
        boundary = solution.bodies["upper"].boundary
        return -float(boundary.displacement[boundary.points[:, 1] > 2.5 - 1e-9, 1].mean())

    bounds = (1e-11, 1e-11)
    quantities = (
        Quantity("settlement of the top", settlement, bounds, exact.settlements()[1]),
        Quantity("pressure between", peak_pressure, bounds, between),
        Quantity("pressure on the floor", lambda found: float(found.contacts[1].peak_pressure), bounds, on_floor),
    )
    validity = "smooth, rigid walls; exact for every mesh of quadratic elements"
    return Case(scene, "TimoshenkoGoodier1970", validity, (20, 40), quantities)


def shrink_fit() -> Case:
    """Shrink by an interference of 0.001; a piece of the outer rim is moved as the whole rim moves."""
    exact = ShrinkFit(0.5, 1.0, 2.0, _UNIT, Material(0.5, 0.2), 1e-3)
    moved = float(LameRing(1.0, 2.0, exact.pressure, 0.0, exact.outer).displacement(2.0)) / 2.0
    held = PrescribedDisplacement(Expression(f"{moved!r} * x"), Expression(f"{moved!r} * y"))
    parts = (Part("fit", Free(), ("inner",)), Part("held", held, ("outer-1", "outer-4"), Expression("x > 1.99")))
    scene = Scene(
        title="shrink fit of two rings",
        bodies=(
            Body(name="inner", shape=Ring(0.5, 1.0), material=_UNIT, parts=(Part("fit", Free(), ("outer",)),)),
            Body(name="outer", shape=Ring(1.0, 2.0), material=Material(0.5, 0.2), parts=parts),
        ),
        contacts=(ContactPair(("inner.fit", "outer.fit"), gap=-1e-3),),
        law=Coulomb(0.2),
        discretisation=Galerkin(4),
    )
    error = Quantity(
        _PRESSURE,
        lambda found: uniform_error(-found.contact.sigma_n, exact.pressure),
        (1.2e-2, 6e-4, 1e-5),
        order=5.0,
    )
    validity = "plane strain, small strains; rings of different materials"
    return Case(scene, "TimoshenkoGoodier1970", validity, (20, 32, 48), (error,))


def hertz_cylinders() -> Case:
    """Compare with Hertz under the force that comes out."""
    scene = replace(load_scene("two-cylinders"), title="two pressed cylinders")

    def half_width(solution: Solution) -> float:
        return half_length(solution) / _hertz(solution).half_width

    def peak(solution: Solution) -> float:
        return peak_pressure(solution) / _hertz(solution).peak_pressure

    quantities = (
        Quantity("half-width over Hertz's", half_width, (2e-3, 2e-3), 1.0),
        Quantity("peak pressure over Hertz's", peak, (8e-3, 5e-3), 1.0),
    )
    validity = "contact small beside the radius: the finite cylinders differ by 1e-4"
    return Case(scene, "Johnson1985", validity, (0.02, 0.005), quantities, n_quick=1)


def _hertz(solution: Solution) -> HertzLine:
    """Return Hertz's solution of two cylinders of radius 1 under the force of a solution."""
    upper, lower = (body.material for body in solution.scene.bodies)
    return HertzLine(solution.contacts[0].force_normal, 0.5, pair_modulus(upper, lower))


def cattaneo_mindlin() -> Case:
    """Compare with Mindlin under the forces that come out."""
    scene = replace(load_scene("two-cylinders"), title="two cylinders pressed, then sheared", law=Coulomb(0.5))

    def sheared(solution: Solution) -> PartialSlip:
        return PartialSlip(_hertz(solution), abs(solution.contacts[0].force_tangential), 0.5)

    def stick_zone(solution: Solution) -> float:
        return half_stuck(solution) / sheared(solution).stick_half_width

    quantities = (
        Quantity("stick zone over Mindlin's", stick_zone, (5e-2, 4e-3), 1.0),
        Quantity("shear traction, L2", lambda found: shear_error(found, sheared(found)), (5e-2, 6e-3)),
    )
    validity = "as of pressed cylinders; incremental law, shear in a second step"
    return Case(scene, "Mindlin1949", validity, (0.016, 0.004), quantities, _pressed_then_sheared, n_quick=1)


def _pressed_then_sheared(scene: Scene, accuracy: float) -> Solution:
    """Push the upper cylinder down, then to the side, on the meshes that suit the end."""

    def under(shift: float) -> Scene:
        upper, lower = scene.bodies
        pushed = replace(upper.parts[0], condition=PrescribedDisplacement(shift, -0.0022))
        return replace(scene, bodies=(replace(upper, parts=(pushed, *upper.parts[1:])), lower))

    fitted = run(with_overrides(under(0.0008), accuracy=accuracy))
    meshes = {name: body.mesh for name, body in fitted.bodies.items()}
    steps = [with_overrides(under(shift), elements=100) for shift in (0.0, 0.0008)]
    return run(steps, mesh=meshes)[-1]


def pin_in_hole() -> Case:
    """Take one material."""
    return _pin("pin in a hole of the same material", "Persson1964", _UNIT)


def pin_in_stiffer_hole() -> Case:
    """Take two materials."""
    return _pin("pin in a hole of a stiffer material", "CiavarellaDecuzzi2001", Material(3.0, 0.15))


def _pin(title: str, source: str, sheet: Material) -> Case:
    """Pull a core of 1/50 radius by 1e-5 in a hole that is larger by 2e-5."""
    exact = PinInHole(1e-5, 1.0, 2e-5, _UNIT, sheet)
    core = Part("core", Traction(y=1e-5 / (2.0 * np.pi * 0.02)), ("inner",))
    hole, surface = Part("hole", Free(), ("arc",)), Part("surface", Free(), ("outer",))
    scene = Scene(
        title=title,
        bodies=(
            Body(name="sheet", shape=ExteriorOf(Disk(1.00002)), material=sheet, parts=(hole,)),
            Body(name="pin", shape=Ring(0.02, 1.0), material=_UNIT, parts=(core, surface)),
        ),
        contacts=(ContactPair(("pin.surface", "sheet.hole")),),
        discretisation=Galerkin(2),
    )
    quantities = (
        Quantity("half-angle", half_length, (3e-2, 3e-2, 3e-3), exact.half_angle),
        Quantity("peak pressure", peak_pressure, (1e-2, 1e-2, 3e-4), exact.peak_pressure),
    )
    validity = "clearance small beside the radius, no friction; pulled at a core of 1/50 radius: 1e-4 of the peak"
    return Case(scene, source, validity, (0.04, 0.01, 0.0025), quantities)


def receding_pair() -> Case:
    """Press a layer of thickness 1 by a strip load of width 1."""
    exact = RecedingLayer(1.0, 0.5, 1.0, 1.0)
    load = Part("load", Pressure(1.0), ("top",), Expression("abs(x) < 0.5"))
    scene = Scene(
        title="layer pressed on a half-plane by a strip load",
        bodies=(
            Body(name="base", shape=ElasticHalfPlane(-2.5, 2.5), material=_UNIT),
            Body(name="layer", shape=Rectangle(10.0, 1.0, (-5.0, 0.0)), material=_UNIT, parts=(load,)),
        ),
        contacts=(ContactPair(("layer.bottom", "base.surface")),),
    )
    quantities = (
        Quantity("half-width", half_length, (6e-2, 1e-2, 2e-3), exact.half_width),
        Quantity(
            "pressure, L2", lambda found: pressure_error(found, exact.pressure), (6e-2, 2.5e-2, 1.2e-2), order=0.9
        ),
    )
    validity = "no friction, no weight; any load; the layer ends at five thicknesses, long lifted off"
    return Case(scene, "KeerDundursTsai1972", validity, (0.05, 0.01, 0.003), quantities)


def snug_disc() -> Case:
    """Model a ring of the sheet; at its edge act the tractions of the infinite sheet under 2e-3 and 1e-3."""
    mean, difference = 1.5e-3, 1e-3
    radial, hoop = "(-0.0015 - 0.000421875 * (x**2 - y**2) / 4)", "0.000515625 * x * y / 2"
    edge = Traction(Expression(f"{radial} * x / 2 - {hoop} * y / 2"), Expression(f"{radial} * y / 2 + {hoop} * x / 2"))
    parts = (Part("hole", Free(), ("inner",)), Part("edge", edge, ("outer",)))
    scene = Scene(
        title="disc that fits its hole exactly, in a sheet pressed from two sides",
        bodies=(
            Body(name="disc", shape=Disk(1.0), material=_UNIT, parts=(Part("rim", Free(), ("arc",)),)),
            Body(name="sheet", shape=Ring(1.0, 2.0), material=_UNIT, parts=parts),
        ),
        contacts=(ContactPair(("disc.rim", "sheet.hole")),),
        symmetry=Symmetry(x=0.0, y=0.0),
        discretisation=Galerkin(4),
    )

    def error(solution: Solution) -> float:
        angle = np.arctan2(solution.contact.y, solution.contact.x)
        return largest_error(-solution.contact.sigma_n, mean + 0.75 * difference * np.cos(2.0 * angle))

    quantity = Quantity(_PRESSURE, error, (2.6e-3, 6e-4, 1.7e-4), order=2.5)
    validity = "the same material inside and outside, no friction; pressed everywhere while 5 N2 > N1"
    return Case(scene, "TimoshenkoGoodier1970", validity, (20, 32, 48), (quantity,))
