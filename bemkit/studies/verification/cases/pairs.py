"""Two elastic bodies."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from bemkit.contact.laws import Coulomb
from bemkit.contact.obstacle import HalfPlane
from bemkit.geometry.shapes import Disk, ExteriorOf, Rectangle, Ring
from bemkit.operators.material import Material
from bemkit.reference import (
    GravityColumn,
    HertzLine,
    LameRing,
    PartialSlip,
    PinInHole,
    ShrinkFit,
    pair_modulus,
)
from bemkit.results.assembly_solution import AssemblySolution
from bemkit.runs.assembly import run_assembly_history
from bemkit.runs.run import run
from bemkit.scene.assembly import Assembly, ContactPair
from bemkit.scene.body import Body
from bemkit.scene.body_forces import Gravity
from bemkit.scene.conditions import Contact, Free, Part, PrescribedDisplacement, Roller, Traction
from bemkit.scene.discretisation import Galerkin, QuadraticGalerkin
from bemkit.scene.mesh_options import MeshOptions
from bemkit.scene.toml import load_scene, with_overrides
from bemkit.studies.verification.case import Case, Quantity, at_resolution

STEEL = Material(1.0, 0.3)


def patch() -> Case:
    """Return two blocks with meshes that do not match under a uniform pressure and shear."""
    shear, nu = 0.2, STEEL.poisson_ratio
    along, across, down = nu * (1.0 + nu), 2.0 * (1.0 + nu) * shear, 1.0 - nu**2

    def block(name: str, y: float, *parts: Part) -> Body:
        sides = (Part("left", Traction(y=-shear), ("left",)), Part("right", Traction(y=shear), ("right",)))
        return Body(name=name, shape=Rectangle(1.0, 1.0, (0.0, y)), material=STEEL, parts=(*parts, *sides))

    base = Part(
        "base", PrescribedDisplacement(lambda x, y: along * x + across * y, lambda x, y: -down * y), ("bottom",)
    )
    upper = block("upper", 1.0, Part("load", Traction(shear, -1.0), ("top",)))
    scene = Assembly(
        title="two blocks under uniform stresses",
        bodies=(block("lower", 0.0, base), upper),
        contacts=(ContactPair(("upper.bottom", "lower.top")),),
        law=Coulomb(0.5),
        discretisation=QuadraticGalerkin(),
    )

    def solve(n: float) -> AssemblySolution:
        lower, other = scene.bodies
        meshes = (MeshOptions(elements=int(n)), MeshOptions(elements=int(1.7 * n)))
        bodies = (replace(lower, mesh=meshes[0]), replace(other, mesh=meshes[1]))
        return run(replace(scene, bodies=bodies))

    return Case(
        title=scene.title,
        source="Wriggers2006",
        validity="exact for every pair of meshes",
        solve=solve,
        resolutions=(20, 40),
        quantities=(
            Quantity("pressure, largest error", lambda solution: _most(solution.contact.sigma_n + 1.0), (1e-11, 1e-11)),
            Quantity(
                "shear, largest error", lambda solution: _most(solution.contact.sigma_t / shear + 1.0), (1e-11, 1e-11)
            ),
        ),
    )


def columns() -> Case:
    """Return a column on another one, both heavy."""
    exact = GravityColumn((1.5, 1.0), (2.0, 1.0), (Material(2.0, 0.2), STEEL))

    def column(k: int, *parts: Part) -> Body:
        bottom = sum(exact.heights[:k])
        walls = Part("walls", Roller(), ("left", "right"))
        return Body(
            name=("lower", "upper")[k],
            shape=Rectangle(1.0, exact.heights[k], (0.0, bottom)),
            material=exact.materials[k],
            parts=(walls, *parts),
            body_forces=(Gravity(exact.weights[k], (0.0, -1.0)),),
        )

    floor = Part("floor", Contact(HalfPlane()), ("bottom",))
    scene = Assembly(
        title="two columns between smooth walls under their weight",
        bodies=(column(0, floor), column(1)),
        contacts=(ContactPair(("upper.bottom", "lower.top")),),
        discretisation=QuadraticGalerkin(),
    )

    exactly = (1e-11, 1e-11)

    def settlement(solution: AssemblySolution) -> float:
        boundary = solution.bodies["upper"].boundary
        return -float(boundary.displacement[boundary.points[:, 1] > 2.5 - 1e-9, 1].mean())

    def peak(k: int) -> Callable[[AssemblySolution], float]:
        return lambda solution: solution.contacts[k].peak_pressure

    return Case(
        title=scene.title,
        source="TimoshenkoGoodier1970",
        validity="smooth, rigid walls; exact for every mesh of quadratic elements",
        solve=at_resolution(scene),
        resolutions=(20, 40),
        quantities=(
            Quantity("settlement of the top", settlement, exactly, exact.settlements()[1]),
            Quantity("pressure between", peak(0), exactly, exact.base_pressures()[1]),
            Quantity("pressure on the floor", peak(1), exactly, exact.base_pressures()[0]),
        ),
    )


def shrink_fit() -> Case:
    """Return two rings with an interference; the rim of the outer one is moved as it would move."""
    outer = Material(0.5, 0.2)
    exact = ShrinkFit(0.5, 1.0, 2.0, STEEL, outer, 1e-3)
    stretch = float(LameRing(1.0, 2.0, exact.pressure, 0.0, outer).displacement(2.0)) / 2.0
    held = PrescribedDisplacement(lambda x, y: stretch * x, lambda x, y: stretch * y)
    rings = (
        Body(name="inner", shape=Ring(0.5, 1.0), material=STEEL, parts=(_free("fit", "outer"),)),
        Body(
            name="outer",
            shape=Ring(1.0, 2.0),
            material=outer,
            parts=(_free("fit", "inner"), Part("held", held, ("outer-1", "outer-4"), lambda x, y: x > 1.99)),
        ),
    )
    scene = Assembly(
        title="shrink fit of two rings",
        bodies=rings,
        contacts=(ContactPair(("inner.fit", "outer.fit"), gap=-1e-3),),
        law=Coulomb(0.2),
        discretisation=Galerkin(4),
    )
    return Case(
        title=scene.title,
        source="TimoshenkoGoodier1970",
        validity="plane strain, small strains; rings of different materials",
        solve=at_resolution(scene),
        resolutions=(20, 32, 48),
        quantities=(
            Quantity(
                "pressure, largest error",
                lambda solution: _most(solution.contact.sigma_n / exact.pressure + 1.0),
                (1.2e-2, 6e-4, 1e-5),
                order=5.0,
            ),
        ),
    )


def hertz_cylinders() -> Case:
    """Return two pressed half cylinders."""
    scene = load_scene("two-cylinders")

    def half_width(solution: AssemblySolution) -> float:
        return 0.5 * solution.contacts[0].contact_length / _hertz(solution).half_width

    def peak(solution: AssemblySolution) -> float:
        return solution.contacts[0].peak_pressure / _hertz(solution).peak_pressure

    return Case(
        title="two pressed cylinders",
        source="Johnson1985",
        validity="contact small beside the radius: the finite cylinders differ by 1e-4",
        solve=at_resolution(scene),
        resolutions=(0.02, 0.005),
        quantities=(
            Quantity("half-width over Hertz's", half_width, (2e-3, 2e-3), 1.0),
            Quantity("peak pressure over Hertz's", peak, (8e-3, 2e-3), 1.0),
        ),
        n_quick=1,
    )


def cattaneo_mindlin() -> Case:
    """Return the same cylinders pressed, then sheared: a history of two steps."""
    friction = 0.5
    scene = load_scene("two-cylinders")
    if not isinstance(scene, Assembly):
        raise TypeError("two-cylinders")
    scene = replace(scene, law=Coulomb(friction))

    def under(shift: float) -> Assembly:
        upper, lower = scene.bodies
        pushed = replace(upper.parts[0], condition=PrescribedDisplacement(shift, -0.0022))
        return replace(scene, bodies=(replace(upper, parts=(pushed, *upper.parts[1:])), lower))

    def solve(accuracy: float) -> AssemblySolution:
        fitted = run(with_overrides(under(0.0008), accuracy=accuracy))
        meshes = {name: body.mesh for name, body in fitted.bodies.items()}
        steps = [with_overrides(under(shift), elements=100) for shift in (0.0, 0.0008)]
        return run_assembly_history(steps, meshes=meshes)[-1]

    def sheared(solution: AssemblySolution) -> PartialSlip:
        return PartialSlip(_hertz(solution), abs(solution.contacts[0].force_tangential), friction)

    def stuck(solution: AssemblySolution) -> float:
        places = [place.x for place in solution.transitions if "stick" in (place.from_status, place.to_status)]
        return 0.5 * (places[-1] - places[0]) / sheared(solution).stick_half_width

    def shear(solution: AssemblySolution) -> float:
        table = solution.contact
        expected = sheared(solution).traction(table.x)
        missed = np.abs(table.sigma_t) - expected
        return float(np.sqrt(table.weight @ missed**2 / (table.weight @ expected**2)))

    return Case(
        title="two cylinders pressed, then sheared",
        source="Mindlin1949",
        validity="as of pressed cylinders; incremental law, shear in a second step",
        solve=solve,
        resolutions=(0.016, 0.004),
        quantities=(
            Quantity("stick zone over Mindlin's", stuck, (6e-3, 4e-3), 1.0),
            Quantity("shear traction, L2", shear, (5e-2, 6e-3)),
        ),
        n_quick=1,
    )


def pin_of_the_same() -> Case:
    """Return Persson's pin."""
    return _pin("pin in a hole of the same material", STEEL, "Persson1964")


def pin_of_another() -> Case:
    """Return a pin in a stiffer sheet with another Poisson's ratio."""
    return _pin("pin in a hole of a stiffer material", Material(3.0, 0.15), "CiavarellaDecuzzi2001")


def _pin(title: str, material: Material, source: str) -> Case:
    load, core, clearance = 1e-5, 0.02, 2e-5
    exact = PinInHole(load, 1.0, clearance, STEEL, material)
    push = Part("core", Traction(y=load / (2.0 * np.pi * core)), _quadrants("inner"))
    sheet = Body(
        name="sheet", shape=ExteriorOf(Disk(1.0 + clearance)), material=material, parts=(_free("hole", "arc"),)
    )
    pin = Body(name="pin", shape=Ring(core, 1.0), material=STEEL, parts=(push, _free("surface", "outer")))
    scene = Assembly(
        title=title,
        bodies=(sheet, pin),
        contacts=(ContactPair(("pin.surface", "sheet.hole")),),
        discretisation=QuadraticGalerkin(),
    )
    angle, peak = (3e-2, 1e-2, 3e-3), (1e-2, 1e-3, 3e-4)
    return Case(
        title=title,
        source=source,
        validity="clearance small beside the radius, no friction; pulled at a core of 1/50 radius: 1e-4 of the peak",
        solve=at_resolution(scene),
        resolutions=(0.04, 0.01, 0.0025),
        quantities=(
            Quantity("half-angle", lambda solution: 0.5 * solution.contacts[0].contact_length, angle, exact.half_angle),
            Quantity("peak pressure", lambda solution: solution.contacts[0].peak_pressure, peak, exact.peak_pressure),
        ),
    )


def _hertz(solution: AssemblySolution) -> HertzLine:
    """Return Hertz's solution of the two cylinders of radius 1 under the force that came out."""
    upper, lower = (body.material for body in solution.assembly.bodies)
    return HertzLine(solution.contacts[0].force_normal, 0.5, pair_modulus(upper, lower))


def _free(name: str, sides: str) -> Part:
    return Part(name, Free(), _quadrants(sides))


def _quadrants(name: str) -> tuple[str, ...]:
    return tuple(f"{name}-{number}" for number in (1, 2, 3, 4))


def _most(values: np.ndarray[tuple[int, ...], np.dtype[np.float64]]) -> float:
    return float(np.abs(values).max())
