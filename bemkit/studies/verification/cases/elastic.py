"""Elasticity without contact."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from bemkit.arrays import FloatArray
from bemkit.formulas import Expression
from bemkit.geometry.shapes import Disk, ExteriorOf, Ring, Shape
from bemkit.geometry.symmetry import Symmetry
from bemkit.operators.material import Material, Plane
from bemkit.reference import BrazilianDisc, KirschHole, LameRing, RotatingDisc
from bemkit.results.interior import interior_fields
from bemkit.results.solution import Solution
from bemkit.scene.body_forces import Rotation
from bemkit.scene.conditions import Part, Pressure, Traction
from bemkit.scene.discretisation import QuadraticGalerkin
from bemkit.scene.scene import Scene
from bemkit.studies.verification.case import Case, Quantity, at_resolution

STEEL = Material(2.0, 0.3)
INNER, OUTER, ARCS = (tuple(f"{name}-{k}" for k in range(1, 5)) for name in ("inner", "outer", "arc"))
_CENTRED = Symmetry(x=0.0, y=0.0)


def lame_ring() -> Case:
    """Return a ring under pressures from both sides."""
    exact = LameRing(1.0, 2.0, 1.3, 0.4, STEEL)
    parts = (Part("hole", Pressure(1.3), INNER), Part("rim", Pressure(0.4), OUTER))

    def error(solution: Solution) -> float:
        return _radial_error(solution, exact.displacement)

    return Case(
        title="ring under pressures",
        source="TimoshenkoGoodier1970",
        validity="small strains",
        solve=at_resolution(_scene(Ring(1.0, 2.0), parts)),
        resolutions=(48, 96, 192),
        quantities=(Quantity("displacement, largest error", error, (1.2e-3, 2e-4, 2.5e-5), order=2.5),),
    )


def kirsch_hole() -> Case:
    """Return a hole in an infinite sheet: what the tension leaves on its rim is taken away."""
    exact = KirschHole(1.5, 0.7, STEEL)
    parts = (Part("rim", Traction(x=Expression("1.5 * x / 0.7")), ARCS),)

    def error(solution: Solution) -> float:
        points = solution.boundary.points
        whole = exact.rim_displacement(np.arctan2(points[:, 1], points[:, 0]))
        missed = solution.boundary.displacement + exact.far_displacement(points) - whole
        return float(np.abs(missed).max() / np.abs(whole).max())

    return Case(
        title="hole in an infinite sheet under tension",
        source="Kirsch1898",
        validity="small strains; the sheet is infinite here, too",
        solve=at_resolution(_scene(ExteriorOf(Disk(0.7)), parts, symmetry=None)),
        resolutions=(24, 48, 96),
        quantities=(Quantity("displacement, largest error", error, (3e-4, 4e-5, 5e-6), order=2.5),),
    )


def brazilian_disc() -> Case:
    """Return stresses at the middle of a disc that two arcs press."""
    exact = BrazilianDisc(3.0, np.radians(10.0))
    along, across = (float(values[0]) for values in exact.stresses(np.zeros(1)))
    jaws = Part("jaws", Pressure(3.0), where=Expression(f"abs(y) > {float(np.cos(np.radians(10.0)))!r}"))

    def stress(axis: int) -> Callable[[Solution], float]:
        return lambda solution: float(interior_fields(solution).stress(np.array([[-1e-9, -1e-9]]))[0, axis, axis])

    return Case(
        title="disc pressed on two opposite arcs",
        source="Hondros1959",
        validity="any radius, any material",
        solve=at_resolution(_scene(Disk(1.0), (jaws,))),
        resolutions=(32, 64, 128),
        quantities=(
            Quantity("compression", stress(1), (1.5e-5, 1e-6, 5e-8), along, 3.5),
            Quantity("tension", stress(0), (5e-5, 3e-6, 2e-7), across, 3.5),
        ),
    )


def rotating_disc() -> Case:
    """Return a rotating disc in plane stress."""
    sheet = Material(2.0, 0.3, Plane.STRESS)
    exact = RotatingDisc(1.5, 0.8, sheet)

    def error(solution: Solution) -> float:
        return _radial_error(solution, exact.displacement)

    scene = replace(_scene(Disk(1.5), ()), material=sheet, body_forces=(Rotation(0.8, 1.0),))
    return Case(
        title="rotating disc",
        source="TimoshenkoGoodier1970",
        validity="plane stress, small strains",
        solve=at_resolution(scene),
        resolutions=(16, 32),
        quantities=(Quantity("displacement, largest error", error, (1e-12, 1e-12)),),
    )


def _scene(shape: Shape, parts: tuple[Part, ...], symmetry: Symmetry | None = _CENTRED) -> Scene:
    return Scene(
        title="verification",
        shape=shape,
        material=STEEL,
        parts=parts,
        symmetry=symmetry,
        discretisation=QuadraticGalerkin(),
    )


def _radial_error(solution: Solution, exact: Callable[[FloatArray], FloatArray]) -> float:
    """Return the largest error of the radial displacement of the boundary, relative to its largest value."""
    points = solution.boundary.points
    radius = np.hypot(*points.T)
    expected = exact(radius)
    missed = np.sum(solution.boundary.displacement * points, axis=1) / radius - expected
    return float(np.abs(missed).max() / np.abs(expected).max())
