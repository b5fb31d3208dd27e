"""Rigid indenters on a half-plane, of which only the strip that may touch has elements; E' is 1."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from bemkit.contact.laws import Coulomb, FrictionLaw, Frictionless
from bemkit.contact.obstacle import Gap
from bemkit.formulas import Expression
from bemkit.geometry.shapes import ElasticHalfPlane, PeriodicHalfPlane
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
    closed_cracks_slip,
    mindlin_loss,
    spence_stick_ratio,
    static_cylinder_stick_ratio,
    westergaard_half_width,
    westergaard_pressure,
)
from bemkit.results.solution import Solution
from bemkit.runs.run import run
from bemkit.scene.conditions import Contact, Part, PrescribedDisplacement
from bemkit.scene.discretisation import MeshOptions
from bemkit.scene.plane_motion import FarField
from bemkit.scene.scene import Scene
from bemkit.scene.steps import Step
from bemkit.studies.verification.case import Case, Measure, Quantity
from bemkit.studies.verification.cases.friction import to_and_fro
from bemkit.studies.verification.measures import (
    Exact,
    half_stuck,
    largest_error,
    lost_in_last_cycle,
    pressure_error,
    shear_error,
    status_ends,
)

_STEEL, _INCOMPRESSIBLE = Material(0.91, 0.3), Material(0.75, 0.5)
"""Both with E' = 1."""
_SMOOTH, _FRICTION = Frictionless(), Coulomb(0.3)
_DOWN, _SHEARABLE = FarField(force_y=1.0, x=0.0, turn=0.0), FarField(force_x=0.0, force_y=1.0, turn=0.0)
_CYLINDER, _ROUNDED = HertzLine(1.0, 1.0, 1.0), RoundedPunch(1.0, 0.5, 1.0, 1.0)
_CYLINDER_GAP, _FLAT_GAP = "x**2 / 2", "0 * x"
_ROUNDED_GAP = "where(abs(x) > 0.5, (abs(x) - 0.5)**2 / 2, 0 * x)"
_PERIOD = PeriodicHalfPlane(1.0, -0.5)
_ACCURACIES = (1e-2, 1e-3, 3e-4)
_VALIDITY = "small strains; a rigid indenter, the half-plane has no end here, too; {} on the middle 95 %"
_SHEARED = "an incompressible half-plane on a rigid body; "


def _half_plane(
    title: str,
    half_strip: float,
    gap: str,
    law: FrictionLaw = _SMOOTH,
    material: Material = _STEEL,
    far: FarField = _DOWN,
) -> Scene:
    """Return a half-plane against which an indenter with a gap is pressed, by a force of 1 if no other is given."""
    strip = ElasticHalfPlane(-half_strip, half_strip)
    zone = Part("zone", Contact(Gap(Expression(gap))))
    return Scene(title=title, shape=strip, material=material, far=far, parts=(zone,), law=law)


def _pressure(exact: Exact, bounds: tuple[float, ...], inner: float = 0.0, outer: float = 0.95) -> Quantity:
    """Compare the pressure for inner < |x| < outer, relative to its largest value there."""

    def error(solution: Solution) -> float:
        x, pressure = solution.contact.x, -solution.contact.sigma_n
        rows = (np.abs(x) > inner) & (np.abs(x) < outer)
        return largest_error(pressure[rows], exact(x[rows]))

    return Quantity("pressure, largest error", error, bounds)


def _indenter(scene: Scene, source: str, exact: LineContact, bounds: tuple[float, ...], inner: float = 0.0) -> Case:
    """Compare the zone, and the pressure away from its ends and a sharp middle."""
    a = exact.half_width
    width = Quantity("half-width", lambda found: status_ends(found)[-1], (3e-3, 3e-4, 1e-4), a)
    quantities = (width, _pressure(exact.pressure, bounds, inner * a, 0.95 * a))
    return Case(scene, source, _VALIDITY.format("pressure"), _ACCURACIES, quantities)


def hertz_half_plane() -> Case:
    """Press a cylinder of radius 1."""
    scene = _half_plane("cylinder", 1.5 * _CYLINDER.half_width, _CYLINDER_GAP)
    return _indenter(scene, "Johnson1985", _CYLINDER, (1e-2, 2.5e-3, 8e-4))


def blunt_wedge() -> Case:
    """Exclude the middle, where the pressure has no bound."""
    exact = BluntWedge(1.0, 0.5, 1.0)
    return _indenter(
        _half_plane("blunt wedge", 3.0, "0.5 * abs(x)"), "Johnson1985", exact, (1e-2, 1.6e-3, 8e-4), inner=0.05
    )


def rounded_punch() -> Case:
    """Press a punch that is flat for |x| < 0.5."""
    scene = _half_plane("punch with rounded edges", 1.5 * _ROUNDED.half_width, _ROUNDED_GAP)
    return _indenter(scene, "CiavarellaHillsMonno1998", _ROUNDED, (1.2e-2, 4e-3, 2.5e-3))


def flat_punch() -> Case:
    """Press without friction."""
    quantities = (_pressure(FlatPunch(1.0, 1.0, 1.0).pressure, (8e-3, 1.5e-3, 4e-4)),)
    scene = _half_plane("flat punch", 1.0, _FLAT_GAP)
    return Case(scene, "Johnson1985", _VALIDITY.format("pressure"), _ACCURACIES, quantities)


def tilted_punch() -> Case:
    """Turn the punch so far that one end lifts off."""
    exact = FlatPunch(1.0, 1.0, 1.0, 0.9)
    scene = _half_plane("tilted punch that lifts off", 1.0, _FLAT_GAP, far=FarField(force_y=1.0, x=0.0, turn=0.9))
    quantities = (
        _pressure(exact.pressure, (1.5e-2, 2e-3, 8e-4)),
        Quantity("start of contact", lambda found: status_ends(found)[0], (1e-3, 2e-5, 1e-5), exact.contact_start),
    )
    return Case(scene, "Muskhelishvili1953", _VALIDITY.format("pressure"), _ACCURACIES, quantities)


def sliding_punch() -> Case:
    """Slide the punch to the left."""
    exact = SlidingPunch(1.0, 1.0, -0.3, _STEEL)
    scene = _half_plane("sliding punch", 1.0, _FLAT_GAP, _FRICTION, far=FarField(force_y=1.0, x=10.0, turn=0.0))
    quantities = (_pressure(exact.pressure, (8e-3, 1.5e-3, 6e-4)),)
    return Case(scene, "Johnson1985", _VALIDITY.format("pressure"), _ACCURACIES, quantities)


def bonded_punch() -> Case:
    """Give the displacement; compare under the force that comes out."""
    punch = Part("punch", PrescribedDisplacement(0.0, -0.1))
    scene = Scene(title="bonded punch", shape=ElasticHalfPlane(-1.0, 1.0), material=_STEEL, parts=(punch,))

    def error(component: int) -> Measure:
        def largest(solution: Solution) -> float:
            x, traction = solution.boundary.centres[:, 0], solution.boundary.traction
            exact = BondedPunch(float(-traction[:, 1] @ solution.mesh.lengths), 1.0, _STEEL)
            inner = np.abs(x) < 0.95
            pressure = exact.pressure(x[inner])
            expected = -pressure if component else exact.traction(x[inner])
            return float(np.abs((traction[inner, component] - expected) / pressure).max())

        return largest

    bounds = (1.2e-2, 2e-3, 1.5e-3)
    names = ("pressure, largest error", "shear, largest error")
    quantities = tuple(Quantity(name, error(number), bounds) for name, number in zip(names, (1, 0), strict=True))
    return Case(scene, "Johnson1985", _VALIDITY.format("compared"), _ACCURACIES, quantities)


def _share_that_sticks(bounds: tuple[float, ...], ratio: float) -> tuple[Quantity, ...]:
    """Compare the stick zone with the whole zone, which under a flat face has the length 2."""

    def share(solution: Solution) -> float:
        zone = status_ends(solution)
        return 2.0 * half_stuck(solution) / (zone[-1] - zone[0] if zone else 2.0)

    return (Quantity("share that sticks", share, bounds, ratio),)


def spence_punch() -> Case:
    """Press with friction; static and incremental law agree."""
    scene = _half_plane("flat punch with friction", 1.0, _FLAT_GAP, _FRICTION)
    quantities = _share_that_sticks((1.2e-3, 1.5e-5, 1e-5), spence_stick_ratio(0.3, _STEEL))
    return Case(scene, "Spence1973", "static or incremental law, pressed only", _ACCURACIES, quantities)


def static_cylinder() -> Case:
    """Press a cylinder in one step."""
    scene = _half_plane("cylinder with friction, static law", 1.5 * _CYLINDER.half_width, _CYLINDER_GAP, _FRICTION)
    quantities = _share_that_sticks((1.5e-2, 3e-4, 2e-4), static_cylinder_stick_ratio(0.3, _STEEL))
    validity = "one step, static law; by panels in bemkit.reference.spence"
    return Case(scene, "Johnson1985", validity, _ACCURACIES, quantities)


def growing_cylinder() -> Case:
    """Let the half-width grow equally in each step; the share is that under a flat punch."""
    scene = _half_plane("cylinder with friction, incremental law", 1.1 * _CYLINDER.half_width, _CYLINDER_GAP, _FRICTION)

    def solve(scene: Scene, n_steps: float) -> Solution:
        factors = (np.arange(1.0, n_steps + 1.0) / n_steps) ** 2
        return run(replace(scene, load_factors=tuple(factors)))

    quantities = _share_that_sticks((6e-2, 3e-2, 1.5e-2), spence_stick_ratio(0.3, _STEEL))
    validity = "incremental law, load in 20, 40, 80 steps on 160 elements"
    scene = replace(scene, mesh=MeshOptions(elements=160))
    return Case(scene, "Spence1975", validity, (20, 40, 80), quantities, solve)


def _sheared(title: str, source: str, contact: LineContact, gap: str) -> Case:
    """Press an incompressible half-plane, then shear it by a force of 0.2."""
    exact = PartialSlip(contact, 0.2, 0.3)
    scene = _half_plane(title, 1.2 * contact.half_width, gap, _FRICTION, _INCOMPRESSIBLE, _SHEARABLE)
    quantities = (
        Quantity("half-width that sticks", half_stuck, (4e-3, 5e-4, 2e-4), exact.stick_half_width),
        Quantity("shear traction, L2", lambda found: shear_error(found, exact), (1.5e-2, 1.5e-3, 8e-4)),
    )
    scene = replace(scene, steps=(Step(1.0), Step(2.0, {"far.force_x": 0.2})))
    return Case(scene, source, _SHEARED + "incremental law, shear in a second step", _ACCURACIES, quantities)


def sheared_cylinder() -> Case:
    """Shear under constant pressing force."""
    return _sheared("cylinder pressed, then sheared", "Mindlin1949", _CYLINDER, _CYLINDER_GAP)


def sheared_rounded_punch() -> Case:
    """Shear under constant pressing force."""
    return _sheared("rounded punch pressed, then sheared", "Ciavarella1998", _ROUNDED, _ROUNDED_GAP)


def mindlin_cycle() -> Case:
    """Take the number of increments from the mean of the shear to its largest value as the resolution."""
    title = "cylinder pressed, then sheared to and fro"
    scene = _half_plane(title, 1.2 * _CYLINDER.half_width, _CYLINDER_GAP, _FRICTION, _INCOMPRESSIBLE, _SHEARABLE)
    scene = replace(scene, mesh=MeshOptions(elements=120))

    def solve(scene: Scene, n_quarter: float) -> Solution:
        return run(to_and_fro(scene, {"far.force_x": 0.2}, int(n_quarter)))

    expected = mindlin_loss(PartialSlip(_CYLINDER, 0.2, 0.3), 1.0)
    lost = Quantity("energy lost in a cycle", lost_in_last_cycle, (3e-2, 7e-3), expected)
    validity = _SHEARED + "shear to and fro under constant pressing force"
    return Case(scene, "Mindlin1949", validity, (4, 8), (lost,), solve, n_quick=1)


def periodic_wave() -> Case:
    """Press a wave of the amplitude 0.01."""
    mean = 0.017261498
    half_width = westergaard_half_width(mean, 0.01, 1.0, 1.0)
    far = FarField(force_y=mean, x=0.0)
    scene = _half_plane("periodic wave on a half-plane", 0.5, "0.02 * sin(pi * x)**2", far=far)

    def error(solution: Solution) -> float:
        return pressure_error(solution, lambda x: westergaard_pressure(x, half_width, mean, 1.0))

    quantity = Quantity("normal traction, L2", error, (2.5e-3, 1e-3, 2.5e-4), order=1.2)
    return Case(
        replace(scene, shape=_PERIOD), "Westergaard1939", "gentle slopes, no friction", (256, 512, 1024), (quantity,)
    )


def closed_cracks(half_length: float, bounds: tuple[float, ...]) -> Case:
    """Model one face of cracks in a line: beside them everything sticks."""
    effective = 2e-4  # shear less friction on the faces; E' = 1
    law = Coulomb(Expression(f"where(abs(x) < {half_length}, 0.1, 100)"))
    far = FarField(force_x=3e-4, force_y=1e-3)
    scene = _half_plane(f"row of closed cracks, a/W = {half_length}", 0.5, _FLAT_GAP, law, _INCOMPRESSIBLE, far)

    def slip(solution: Solution) -> float:
        return 2.0 * abs(float(solution.contact.weight @ solution.contact.u_t)) / effective  # of both faces

    quantity = Quantity("mean slip", slip, bounds, closed_cracks_slip(half_length), order=0.9)
    validity = "antisymmetric: an incompressible half-plane on a rigid body moves like one face of the cracks"
    return Case(replace(scene, shape=_PERIOD), "Westergaard1939", validity, (200, 400, 800), (quantity,))
