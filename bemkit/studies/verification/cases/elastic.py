"""Elasticity without contact."""

from __future__ import annotations

import numpy as np

from bemkit.formulas import Expression
from bemkit.geometry.shapes import Disk, ExteriorOf, Ring
from bemkit.geometry.symmetry.lines import Symmetry
from bemkit.operators.material import Material, Plane
from bemkit.reference import BrazilianDisc, KirschHole, LameRing, RotatingDisc
from bemkit.results.solution import Solution
from bemkit.results.solved_scene import interior_fields
from bemkit.scene.body_forces import Rotation
from bemkit.scene.conditions import Part, Pressure, Traction
from bemkit.scene.discretisation import Galerkin
from bemkit.scene.scene import Scene
from bemkit.studies.verification.case import Case, Measure, Quantity
from bemkit.studies.verification.measures import largest_error, radial_error

_MATERIAL = Material(2.0, 0.3)
_QUARTER = Symmetry(x=0.0, y=0.0)
_DISPLACEMENT = "displacement, largest error"


def lame_ring() -> Case:
    """Compare the displacements of the boundary of a ring."""
    exact = LameRing(1.0, 2.0, 1.3, 0.4, _MATERIAL)
    scene = Scene(
        title="ring under pressures",
        shape=Ring(1.0, 2.0),
        material=_MATERIAL,
        parts=(Part("hole", Pressure(1.3), ("inner",)), Part("rim", Pressure(0.4), ("outer",))),
        symmetry=_QUARTER,
        discretisation=Galerkin(2),
    )
    bounds = (1.2e-3, 2e-4, 2.5e-5)
    error = Quantity(_DISPLACEMENT, lambda found: radial_error(found, exact.displacement), bounds, order=2.5)
    return Case(scene, "TimoshenkoGoodier1970", "small strains", (48, 96, 192), (error,))


def kirsch_hole() -> Case:
    """Remove the tractions of the sheet without a hole from its rim."""
    exact = KirschHole(1.5, 0.7, _MATERIAL)
    scene = Scene(
        title="hole in an infinite sheet under tension",
        shape=ExteriorOf(Disk(0.7)),
        material=_MATERIAL,
        parts=(Part("rim", Traction(x=Expression("1.5 * x / 0.7")), ("arc",)),),
        discretisation=Galerkin(2),
    )

    def error(solution: Solution) -> float:
        points = solution.boundary.points
        whole = exact.rim_displacement(np.arctan2(points[:, 1], points[:, 0]))
        return largest_error(solution.boundary.displacement + exact.far_displacement(points), whole)

    quantity = Quantity(_DISPLACEMENT, error, (3e-4, 4e-5, 5e-6), order=2.5)
    return Case(scene, "Kirsch1898", "small strains; the sheet is infinite here, too", (24, 48, 96), (quantity,))


def brazilian_disc() -> Case:
    """Compare stresses beside the centre; the jaws take 10 degrees on either side."""
    along, across = (float(values[0]) for values in BrazilianDisc(3.0, np.radians(10.0)).stresses(np.zeros(1)))
    scene = Scene(
        title="disc pressed on two opposite arcs",
        shape=Disk(1.0),
        material=_MATERIAL,
        parts=(Part("jaws", Pressure(3.0), where=Expression("abs(y) > 0.984807753012208")),),
        symmetry=_QUARTER,
        discretisation=Galerkin(2),
    )

    def stress(axis: int) -> Measure:
        return lambda solution: float(interior_fields(solution).stress(np.array([[-1e-9, -1e-9]]))[0, axis, axis])

    quantities = (
        Quantity("compression", stress(1), (1.5e-5, 1e-6, 5e-8), along, order=3.5),
        Quantity("tension", stress(0), (5e-5, 3e-6, 2e-7), across, order=3.5),
    )
    return Case(scene, "Hondros1959", "any radius, any material", (32, 64, 128), quantities)


def rotating_disc() -> Case:
    """Turn a disc; the particular solution of the body force is nearly the whole field."""
    material = Material(2.0, 0.3, Plane.STRESS)
    exact = RotatingDisc(1.5, 0.8, material)
    scene = Scene(
        title="rotating disc",
        shape=Disk(1.5),
        material=material,
        body_forces=(Rotation(density=0.8, angular_velocity=1.0),),
        symmetry=_QUARTER,
        discretisation=Galerkin(2),
    )
    error = Quantity(_DISPLACEMENT, lambda found: radial_error(found, exact.displacement), (1e-12, 1e-12))
    return Case(scene, "TimoshenkoGoodier1970", "plane stress, small strains", (16, 32), (error,))
