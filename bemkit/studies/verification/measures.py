"""Measured quantities of each problem with a known solution: for each row its measure and its expected value.

Zero should come out of measures that are relative errors themselves.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import Any, TypeAlias, cast

import numpy as np

from bemkit.arrays import FloatArray
from bemkit.contact.laws import Coulomb
from bemkit.errors import InputError
from bemkit.operators.material import Material, Plane
from bemkit.reference import (
    BluntWedge,
    BondedPunch,
    BrazilianDisc,
    FlatPunch,
    GravityColumn,
    HertzLine,
    KirschHole,
    LameRing,
    LineContact,
    PartialSlip,
    PinInHole,
    RecedingLayer,
    RotatingDisc,
    RoundedPunch,
    ShrinkFit,
    SlidingPunch,
    answer_of,
    arch_friction_limit,
    cantilevers_loss,
    closed_cracks_slip,
    errors_of,
    find_reference,
    mindlin_loss,
    pair_modulus,
    spence_stick_ratio,
    static_cylinder_stick_ratio,
    westergaard_half_width,
    westergaard_pressure,
)
from bemkit.results.interior import interior_fields
from bemkit.results.solution import Solution
from bemkit.scene.toml import load_single_body

Measure: TypeAlias = Callable[[Any], float]
Rows: TypeAlias = Mapping[str, tuple[Measure, float]]
"""By the names of rows: measure, and what should come out."""

STEEL = Material(0.91, 0.3)
"""Material of half-planes, with E' = 1."""
FRICTION = 0.3
CYLINDER, ROUNDED = HertzLine(1.0, 1.0, 1.0), RoundedPunch(1.0, 0.5, 1.0, 1.0)


def of_shipped(name: str) -> Rows:
    """Return the errors against the reference of a shipped scene, all that `errors_of` knows."""
    reference = find_reference(load_single_body(name))
    if reference is None:
        raise InputError(f"scene {name!r} has no reference: give it one in bemkit.reference.shipped")
    words = {"sigma_n": "normal traction, L2", "sigma_t": "shear traction, L2", "displacement": "displacement, L2"}

    def of(measure: str) -> Measure:
        return lambda solution: errors_of(answer_of(solution, reference.places), reference)[measure]

    return {words.get(measure, measure): (of(measure), 0.0) for measure in (*words, "energy", "transitions")}


# elasticity without contact


def _lame_ring() -> Rows:
    return _radial(LameRing(1.0, 2.0, 1.3, 0.4, Material(2.0, 0.3)).displacement)


def _rotating_disc() -> Rows:
    return _radial(RotatingDisc(1.5, 0.8, Material(2.0, 0.3, Plane.STRESS)).displacement)


def _radial(exact: Callable[[FloatArray], FloatArray]) -> Rows:
    """Compare the radial displacement of the boundary, relative to its largest value."""

    def error(solution: Solution) -> float:
        points = solution.boundary.points
        radius = np.hypot(*points.T)
        moved = np.sum(solution.boundary.displacement * points, axis=1) / radius
        return _largest_error(moved, exact(radius))

    return {"displacement, largest error": (error, 0.0)}


def _kirsch_hole() -> Rows:
    exact = KirschHole(1.5, 0.7, Material(2.0, 0.3))

    def error(solution: Solution) -> float:
        points = solution.boundary.points
        whole = exact.rim_displacement(np.arctan2(points[:, 1], points[:, 0]))
        return _largest_error(solution.boundary.displacement + exact.far_displacement(points), whole)

    return {"displacement, largest error": (error, 0.0)}


def _brazilian_disc() -> Rows:
    along, across = (float(values[0]) for values in BrazilianDisc(3.0, np.radians(10.0)).stresses(np.zeros(1)))

    def stress(axis: int) -> Measure:
        """Return a function that evaluates a stress beside the centre."""
        return lambda solution: float(interior_fields(solution).stress(np.array([[-1e-9, -1e-9]]))[0, axis, axis])

    return {"compression": (stress(1), along), "tension": (stress(0), across)}


# one body on a rigid obstacle


def _receding_layer() -> Rows:
    exact = RecedingLayer(1.0, 0.5, 1.0)
    return {"half-width": (_length, exact.half_width), "peak pressure": (_peak, exact.peak_pressure)}


def _ring_on_shaft() -> Rows:
    pressure = 1e-3 / float(LameRing(1.0, 2.0, 1.0, 0.0, Material(2.0, 0.3)).displacement(1.0))
    shear = 0.9 * 0.2 * pressure  # friction 0.2, nine tenths of what it can hold
    return {
        "pressure, largest error": (lambda solution: _off(np.abs(solution.contact.sigma_n), pressure), 0.0),
        "shear, largest error": (lambda solution: _off(np.abs(solution.contact.sigma_t), shear), 0.0),
        "nodes that slip": (lambda solution: float(solution.contact.status_words().count("slip")), 0.0),
    }


# two elastic bodies


def _patch() -> Rows:
    return {
        "pressure, largest error": (lambda solution: _off(-solution.contact.sigma_n, 1.0), 0.0),
        "shear, largest error": (lambda solution: _off(-solution.contact.sigma_t, 0.2), 0.0),
    }


def _columns() -> Rows:
    exact = GravityColumn((1.5, 1.0), (2.0, 1.0), (Material(2.0, 0.2), Material(1.0, 0.3)))
    on_floor, between = exact.base_pressures()

    def settlement(solution: Solution) -> float:
        boundary = solution.bodies["upper"].boundary
        return -float(boundary.displacement[boundary.points[:, 1] > 2.5 - 1e-9, 1].mean())

    return {
        "settlement of the top": (settlement, exact.settlements()[1]),
        "pressure between": (_peak, between),
        "pressure on the floor": (lambda solution: float(solution.contacts[1].peak_pressure), on_floor),
    }


def _shrink_fit() -> Rows:
    exact = ShrinkFit(0.5, 1.0, 2.0, Material(1.0, 0.3), Material(0.5, 0.2), 1e-3)
    return {"pressure, largest error": (lambda solution: _off(-solution.contact.sigma_n, exact.pressure), 0.0)}


def _hertz_cylinders() -> Rows:
    return {
        "half-width over Hertz's": (lambda solution: 0.5 * _length(solution) / _hertz(solution).half_width, 1.0),
        "peak pressure over Hertz's": (lambda solution: _peak(solution) / _hertz(solution).peak_pressure, 1.0),
    }


def _cattaneo_mindlin() -> Rows:
    def sheared(solution: Solution) -> PartialSlip:
        return PartialSlip(_hertz(solution), abs(solution.contacts[0].force_tangential), 0.5)

    return {
        "stick zone over Mindlin's": (lambda found: _half_stuck(found) / sheared(found).stick_half_width, 1.0),
        "shear traction, L2": (lambda found: _shear_error(found, sheared(found)), 0.0),
    }


def _hertz(solution: Solution) -> HertzLine:
    """Return Hertz's solution of the two cylinders of radius 1 under the force that came out."""
    upper, lower = (body.material for body in solution.scene.bodies)
    return HertzLine(solution.contacts[0].force_normal, 0.5, pair_modulus(upper, lower))


def _pin(sheet: Material) -> Rows:
    exact = PinInHole(1e-5, 1.0, 2e-5, Material(1.0, 0.3), sheet)
    return {"half-angle": (_half_length, exact.half_angle), "peak pressure": (_peak, exact.peak_pressure)}


def _snug_disc() -> Rows:
    mean, difference = 1.5e-3, 1e-3

    def error(solution: Solution) -> float:
        angle = np.arctan2(solution.contact.y, solution.contact.x)
        return _largest_error(-solution.contact.sigma_n, mean + 0.75 * difference * np.cos(2.0 * angle))

    return {"pressure, largest error": (error, 0.0)}


def _least_friction() -> Rows:
    def friction(solution: Solution) -> float:
        law = solution.scene.law
        return cast("float", law.friction_coefficient) if isinstance(law, Coulomb) else np.nan

    return {"friction coefficient": (friction, arch_friction_limit(21))}


def _receding_pair() -> Rows:
    exact = RecedingLayer(1.0, 0.5, 1.0, 1.0)
    return {
        "half-width": (_half_length, exact.half_width),
        "pressure, L2": (lambda solution: _pressure_error(solution, exact.pressure), 0.0),
    }


# rigid indenters on a half-plane


def _indenter(exact: LineContact, inner: float = 0.0) -> Rows:
    """Compare the zone, and the pressure away from its ends and a sharp middle."""
    a = exact.half_width
    return {"half-width": (lambda solution: _ends(solution)[-1], a), **_pressure(exact.pressure, inner * a, 0.95 * a)}


def _tilted_punch() -> Rows:
    exact = FlatPunch(1.0, 1.0, 1.0, 0.9)
    return {**_pressure(exact.pressure), "start of contact": (lambda found: _ends(found)[0], exact.contact_start)}


def _pressure(exact: Callable[[FloatArray], FloatArray], inner: float = 0.0, outer: float = 0.95) -> Rows:
    """Compare the pressure for inner < |x| < outer, relative to its largest value there."""

    def error(solution: Solution) -> float:
        x, pressure = solution.contact.x, -solution.contact.sigma_n
        rows = (np.abs(x) > inner) & (np.abs(x) < outer)
        return _largest_error(pressure[rows], exact(x[rows]))

    return {"pressure, largest error": (error, 0.0)}


def _bonded_punch() -> Rows:
    def error(component: int) -> Measure:
        def largest(solution: Solution) -> float:
            x, traction = solution.boundary.centres[:, 0], solution.boundary.traction
            exact = BondedPunch(float(-traction[:, 1] @ solution.mesh.lengths), 1.0, STEEL)
            inner = np.abs(x) < 0.95
            pressure = exact.pressure(x[inner])
            expected = -pressure if component else exact.traction(x[inner])
            return float(np.abs((traction[inner, component] - expected) / pressure).max())

        return largest

    return {"pressure, largest error": (error(1), 0.0), "shear, largest error": (error(0), 0.0)}


def _stick(ratio: float) -> Rows:
    """Compare what sticks with the whole zone, which under a flat face has the length 2."""

    def stuck(solution: Solution) -> float:
        zone = _ends(solution)
        return 2.0 * _half_stuck(solution) / (zone[-1] - zone[0] if zone else 2.0)

    return {"share that sticks": (stuck, ratio)}


def _sheared(contact: LineContact) -> Rows:
    exact = PartialSlip(contact, 0.2, FRICTION)
    return {
        "half-width that sticks": (_half_stuck, exact.stick_half_width),
        "shear traction, L2": (lambda solution: _shear_error(solution, exact), 0.0),
    }


def _periodic_wave() -> Rows:
    mean = 0.017261498
    half_width = westergaard_half_width(mean, 0.01, 1.0, 1.0)

    def exact(x: FloatArray) -> FloatArray:
        return westergaard_pressure(x, half_width, mean, 1.0)

    return {"normal traction, L2": (lambda solution: _pressure_error(solution, exact), 0.0)}


def _closed_cracks(length_share: float) -> Rows:
    effective = 2e-4  # shear less what friction bears; E' = 1

    def slip(solution: Solution) -> float:
        return 2.0 * abs(float(solution.contact.weight @ solution.contact.u_t)) / effective  # of both faces

    return {"mean slip": (slip, closed_cracks_slip(length_share))}


def _lost(expected: float) -> Rows:
    """Compare the energy that friction takes up in the steps of the last cycle, all but the first half of them."""

    def lost(solution: Solution) -> float:
        loading = solution.loading
        if loading is None:
            raise InputError("the solution has no load history: give steps")
        return loading.total(1 + (loading.n_steps - 1) // 5).dissipation

    return {"energy lost in a cycle": (lost, expected)}


def _ends(solution: Solution, status: str = "separated") -> list[float]:
    """Return the places [m] along x where a status begins or ends, from left to right."""
    return sorted(place.x for place in solution.transitions if status in (place.from_status, place.to_status))


def _half_stuck(solution: Solution) -> float:
    ends = _ends(solution, "stick")
    return 0.5 * (ends[-1] - ends[0])


def _length(solution: Solution) -> float:
    return float(solution.contacts[0].contact_length)


def _half_length(solution: Solution) -> float:
    return 0.5 * _length(solution)


def _peak(solution: Solution) -> float:
    return float(solution.contacts[0].peak_pressure)


def _off(values: FloatArray, expected: float) -> float:
    """Return the largest relative error of values that should all be the same."""
    return float(np.abs(values / expected - 1.0).max())


def _largest_error(values: FloatArray, expected: FloatArray) -> float:
    return float(np.abs(values - expected).max() / np.abs(expected).max())


def _pressure_error(solution: Solution, exact: Callable[[FloatArray], FloatArray]) -> float:
    return _mean_error(solution, -solution.contact.sigma_n, exact(solution.contact.x))


def _shear_error(solution: Solution, exact: PartialSlip) -> float:
    return _mean_error(solution, np.abs(solution.contact.sigma_t), exact.traction(solution.contact.x))


def _mean_error(solution: Solution, values: FloatArray, expected: FloatArray) -> float:
    """Return the error of values at the contact nodes in the L2 norm."""
    weight = solution.contact.weight
    return float(np.sqrt(weight @ (values - expected) ** 2 / (weight @ expected**2)))


ROWS: Mapping[str, Callable[[], Rows]] = MappingProxyType(
    {
        "lame-ring": _lame_ring,
        "kirsch-hole": _kirsch_hole,
        "brazilian-disc": _brazilian_disc,
        "rotating-disc": _rotating_disc,
        "receding-layer": _receding_layer,
        "ring-on-shaft": _ring_on_shaft,
        "pair-patch": _patch,
        "gravity-columns": _columns,
        "shrink-fit": _shrink_fit,
        "hertz-cylinders": _hertz_cylinders,
        "cattaneo-mindlin": _cattaneo_mindlin,
        "pin-in-hole": lambda: _pin(Material(1.0, 0.3)),
        "pin-in-stiffer-hole": lambda: _pin(Material(3.0, 0.15)),
        "receding-pair": _receding_pair,
        "snug-disc": _snug_disc,
        "stacked-cantilevers": lambda: _lost(cantilevers_loss(FRICTION, 1e-4, 8e-5, 20.0, 1.0)),
        "friction-limit-of-an-arch": _least_friction,
        "hertz-half-plane": lambda: _indenter(CYLINDER),
        "flat-punch": lambda: _pressure(FlatPunch(1.0, 1.0, 1.0).pressure),
        "tilted-punch": _tilted_punch,
        "sliding-punch": lambda: _pressure(SlidingPunch(1.0, 1.0, -FRICTION, STEEL).pressure),
        "bonded-punch": _bonded_punch,
        "blunt-wedge": lambda: _indenter(BluntWedge(1.0, 0.5, 1.0), inner=0.05),
        "rounded-punch": lambda: _indenter(ROUNDED),
        "spence-punch": lambda: _stick(spence_stick_ratio(FRICTION, STEEL)),
        "static-cylinder": lambda: _stick(static_cylinder_stick_ratio(FRICTION, STEEL)),
        "growing-cylinder": lambda: _stick(spence_stick_ratio(FRICTION, STEEL)),
        "sheared-cylinder": lambda: _sheared(CYLINDER),
        "sheared-rounded-punch": lambda: _sheared(ROUNDED),
        "periodic-wave": _periodic_wave,
        "closed-cracks-10": lambda: _closed_cracks(0.1),
        "closed-cracks-25": lambda: _closed_cracks(0.25),
        "closed-cracks-40": lambda: _closed_cracks(0.4),
        "mindlin-cycle": lambda: _lost(mindlin_loss(PartialSlip(CYLINDER, 0.2, FRICTION), 1.0)),
    }
)
"""By the names of cases, each made when it is needed; cases without an entry are shipped scenes with a reference."""
