"""Rigid indenters on a half-plane, of which only the strip that may touch has elements; the material has E' = 1."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from bemkit.arrays import FloatArray
from bemkit.contact.laws import Coulomb, FrictionLaw, Frictionless
from bemkit.contact.obstacle import Gap
from bemkit.formulas import Expression
from bemkit.geometry.shapes import HalfPlaneBody, PeriodicHalfPlaneBody
from bemkit.operators.material import Material
from bemkit.reference import (
    BluntWedge,
    BondedPunch,
    FlatPunch,
    HertzLine,
    LineContact,
    PartialSlip,
    RoundedPunch,
    SlidingPunch,
    spence_stick_ratio,
    static_cylinder_stick_ratio,
    westergaard_half_width,
    westergaard_pressure,
)
from bemkit.results.solution import Solution
from bemkit.runs.run import run
from bemkit.scene.conditions import Contact, Part, PrescribedDisplacement
from bemkit.scene.plane_motion import FarField
from bemkit.scene.scene import Scene
from bemkit.scene.steps import Step
from bemkit.scene.toml import with_overrides
from bemkit.studies.verification.case import Case, Quantity, at_resolution

STEEL, RUBBER = Material(0.91, 0.3), Material(0.75, 0.5)
FRICTION = 0.3
PRESSED = FarField(force_y=1.0, x=0.0, turn=0.0)
PARABOLA, FLAT, WEDGE = "x**2 / 2", "0 * x", "0.5 * abs(x)"
ROUNDED = "where(abs(x) > 0.5, (abs(x) - 0.5)**2 / 2, 0 * x)"
ACCURACIES = (1e-2, 1e-3, 3e-4)
_RIGID = "small strains; a rigid indenter, the half-plane has no end here, too"


def hertz() -> Case:
    """Return a cylinder without friction."""
    return _frictionless("cylinder", "Johnson1985", PARABOLA, HertzLine(1.0, 1.0, 1.0), (1e-2, 2.5e-3, 8e-4))


def flat_punch() -> Case:
    """Return a level punch without friction."""
    return _under_punch("flat punch", FlatPunch(1.0, 1.0, 1.0), PRESSED, Frictionless(), (8e-3, 1.5e-3, 4e-4))


def tilted_punch() -> Case:
    """Return a punch so tilted that one side lifts off."""
    exact, turned = FlatPunch(1.0, 1.0, 1.0, 0.9), replace(PRESSED, turn=0.9)
    case = _under_punch("tilted punch that lifts off", exact, turned, Frictionless(), (1.5e-2, 2e-3, 8e-4))
    start = Quantity("start of contact", lambda solution: _ends(solution)[0], (1e-3, 2e-5, 1e-5), exact.contact_start)
    return replace(case, source="Muskhelishvili1953", quantities=(*case.quantities, start))


def sliding_punch() -> Case:
    """Return a level punch that slides to the left on the half-plane."""
    exact, moved = SlidingPunch(1.0, 1.0, -FRICTION, STEEL), replace(PRESSED, x=10.0)
    return _under_punch("sliding punch", exact, moved, Coulomb(FRICTION), (8e-3, 1.5e-3, 6e-4))


def bonded_punch() -> Case:
    """Return a punch that holds the surface; its load follows from what it is pushed down."""
    part = Part("punch", PrescribedDisplacement(x=0.0, y=-0.1))
    scene = Scene(title="bonded punch", shape=HalfPlaneBody(-1.0, 1.0), material=STEEL, parts=(part,))

    def error(component: int) -> Callable[[Solution], float]:
        def largest(solution: Solution) -> float:
            x, traction = solution.boundary.centres[:, 0], solution.boundary.traction
            exact = BondedPunch(float(-traction[:, 1] @ solution.mesh.lengths), 1.0, STEEL)
            inner = np.abs(x) < 0.95
            pressure = exact.pressure(x[inner])
            expected = -pressure if component else exact.traction(x[inner])
            return float(np.abs((traction[inner, component] - expected) / pressure).max())

        return largest

    bounds = (1.2e-2, 2e-3, 1.5e-3)
    return Case(
        title="bonded punch",
        source="Johnson1985",
        validity=f"{_RIGID}; compared on the middle 95 %",
        solve=at_resolution(scene),
        resolutions=ACCURACIES,
        quantities=(
            Quantity("pressure, largest error", error(1), bounds),
            Quantity("shear, largest error", error(0), bounds),
        ),
    )


def blunt_wedge() -> Case:
    """Return a wedge without friction; the pressure under its edge is infinite."""
    exact = BluntWedge(1.0, 0.5, 1.0)
    return _frictionless("blunt wedge", "Johnson1985", WEDGE, exact, (1e-2, 1.6e-3, 8e-4), inner=0.05)


def rounded_punch() -> Case:
    """Return a punch with rounded edges."""
    exact = RoundedPunch(1.0, 0.5, 1.0, 1.0)
    bounds = (1.2e-2, 4e-3, 2.5e-3)
    return _frictionless("punch with rounded edges", "CiavarellaHillsMonno1998", ROUNDED, exact, bounds)


def spence_punch() -> Case:
    """Return what sticks under a level punch."""
    ratio = spence_stick_ratio(FRICTION, STEEL)
    scene = _scene(FLAT, 1.0, PRESSED, Coulomb(FRICTION))
    return _stick(
        "flat punch with friction",
        "Spence1973",
        "static or incremental law, pressed only",
        scene,
        ratio,
        (1.2e-3, 1.5e-5, 1e-5),
    )


def static_cylinder() -> Case:
    """Return what sticks under a cylinder that comes at once."""
    ratio = static_cylinder_stick_ratio(FRICTION, STEEL)
    scene = _scene(PARABOLA, 1.5 * HertzLine(1.0, 1.0, 1.0).half_width, PRESSED, Coulomb(FRICTION))
    return _stick(
        "cylinder with friction, static law",
        "Johnson1985",
        "one step, static law; by panels in bemkit.reference.spence",
        scene,
        ratio,
        (1.5e-2, 3e-4, 2e-4),
    )


def growing_cylinder() -> Case:
    """Return what sticks under a cylinder whose load grows: the same share as under a punch."""
    half_width = HertzLine(1.0, 1.0, 1.0).half_width
    scene = with_overrides(_scene(PARABOLA, 1.1 * half_width, PRESSED, Coulomb(FRICTION)), elements=160)

    def solve(n: float) -> Solution:
        # equal steps of the half-width
        return run(replace(scene, load_factors=tuple((np.arange(1.0, n + 1.0) / n) ** 2)))

    ratio = spence_stick_ratio(FRICTION, STEEL)
    validity = "incremental law, load in 20, 40, 80 steps on 160 elements"
    case = _stick("cylinder with friction, incremental law", "Spence1975", validity, scene, ratio, (6e-2, 3e-2, 1.5e-2))
    return replace(case, solve=solve, resolutions=(20, 40, 80))


def sheared_cylinder() -> Case:
    """Return a cylinder on an incompressible half-plane that is pressed, then sheared: a history of two steps."""
    return _sheared("cylinder pressed, then sheared", "Mindlin1949", PARABOLA, HertzLine(1.0, 1.0, 1.0))


def sheared_rounded_punch() -> Case:
    """Return the same with a flat face."""
    return _sheared("rounded punch pressed, then sheared", "Ciavarella1998", ROUNDED, RoundedPunch(1.0, 0.5, 1.0, 1.0))


def periodic_wave() -> Case:
    """Return Westergaard's wave on a periodic half-plane."""
    mean, amplitude = 0.017261498, 0.01
    half_width = westergaard_half_width(mean, amplitude, 1.0, 1.0)
    part = Part("zone", Contact(Gap(Expression("0.02 * sin(pi * x)**2"))))
    scene = Scene(
        title="wave",
        shape=PeriodicHalfPlaneBody(1.0, -0.5),
        material=STEEL,
        parts=(part,),
        far=FarField(force_y=mean, x=0.0),
    )

    def error(solution: Solution) -> float:
        table = solution.contact
        exact = westergaard_pressure(table.x, half_width, mean, 1.0)
        return float(np.sqrt(table.weight @ (table.sigma_n + exact) ** 2 / (table.weight @ exact**2)))

    return Case(
        title="periodic wave on a half-plane",
        source="Westergaard1939",
        validity="gentle slopes, no friction",
        solve=at_resolution(scene),
        resolutions=(256, 512, 1024),
        quantities=(Quantity("normal traction, L2", error, (2.5e-3, 1e-3, 2.5e-4), order=1.2),),
    )


def _scene(gap: str, half_width: float, far: FarField, law: FrictionLaw, material: Material = STEEL) -> Scene:
    part = Part("zone", Contact(Gap(Expression(gap))))
    shape = HalfPlaneBody(-half_width, half_width)
    return Scene(title="indenter", shape=shape, material=material, parts=(part,), far=far, law=law)


def _frictionless(
    title: str, source: str, gap: str, exact: LineContact, bounds: tuple[float, ...], inner: float = 0.0
) -> Case:
    """Return an indenter whose zone and pressure are compared, the latter away from ends and a sharp middle."""
    a = exact.half_width
    return Case(
        title=title,
        source=source,
        validity=f"{_RIGID}; pressure on the middle 95 %",
        solve=at_resolution(_scene(gap, 1.5 * a, PRESSED, Frictionless())),
        resolutions=ACCURACIES,
        quantities=(
            Quantity("half-width", lambda solution: _ends(solution)[-1], (3e-3, 3e-4, 1e-4), a),
            Quantity("pressure, largest error", _pressure_error(exact.pressure, inner * a, 0.95 * a), bounds),
        ),
    )


def _under_punch(
    title: str, exact: FlatPunch | SlidingPunch, far: FarField, law: FrictionLaw, bounds: tuple[float, ...]
) -> Case:
    return Case(
        title=title,
        source="Johnson1985",
        validity=f"{_RIGID}; pressure on the middle 95 %",
        solve=at_resolution(_scene(FLAT, 1.0, far, law)),
        resolutions=ACCURACIES,
        quantities=(Quantity("pressure, largest error", _pressure_error(exact.pressure, 0.0, 0.95), bounds),),
    )


def _stick(title: str, source: str, validity: str, scene: Scene, ratio: float, bounds: tuple[float, ...]) -> Case:
    def stuck(solution: Solution) -> float:
        ends = _ends(solution, "stick")
        return (ends[-1] - ends[0]) / (_ends(solution)[-1] - _ends(solution)[0] if _ends(solution) else 2.0)

    quantity = Quantity("share that sticks", stuck, bounds, ratio)
    return Case(title, source, validity, at_resolution(scene), ACCURACIES, (quantity,))


def _sheared(title: str, source: str, gap: str, contact: LineContact) -> Case:
    exact = PartialSlip(contact, 0.2, FRICTION)
    pressed = _scene(gap, 1.2 * contact.half_width, replace(PRESSED, x=None, force_x=0.0), Coulomb(FRICTION), RUBBER)
    scene = replace(pressed, steps=(Step(1.0), Step(2.0, {"far.force_x": 0.2})))

    def shear(solution: Solution) -> float:
        table, expected = solution.contact, exact.traction(solution.contact.x)
        missed = np.abs(table.sigma_t) - expected
        return float(np.sqrt(table.weight @ missed**2 / (table.weight @ expected**2)))

    def stuck(solution: Solution) -> float:
        ends = _ends(solution, "stick")
        return 0.5 * (ends[-1] - ends[0])

    return Case(
        title=title,
        source=source,
        validity="an incompressible half-plane on a rigid body; incremental law, shear in a second step",
        solve=at_resolution(scene),
        resolutions=ACCURACIES,
        quantities=(
            Quantity("half-width that sticks", stuck, (4e-3, 5e-4, 2e-4), exact.stick_half_width),
            Quantity("shear traction, L2", shear, (1.5e-2, 1.5e-3, 8e-4)),
        ),
    )


def _ends(solution: Solution, status: str = "separated") -> list[float]:
    """Return the places [m] along x where a status begins or ends, from left to right."""
    return sorted(place.x for place in solution.transitions if status in (place.from_status, place.to_status))


def _pressure_error(
    exact: Callable[[FloatArray], FloatArray], inner: float, outer: float
) -> Callable[[Solution], float]:
    """Return what measures the largest error of the pressure for inner < |x| < outer, relative to its mean there."""

    def largest(solution: Solution) -> float:
        x, pressure = solution.contact.x, -solution.contact.sigma_n
        rows = (np.abs(x) > inner) & (np.abs(x) < outer)
        expected = exact(x[rows])
        return float(np.abs(pressure[rows] - expected).max() / np.abs(expected).max())

    return largest
