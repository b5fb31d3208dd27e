"""The axes of the stability sweeps."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from math import radians

import numpy as np

from bemkit.contact.laws import Coulomb
from bemkit.contact.obstacle import HalfPlane
from bemkit.geometry.grading import Uniform
from bemkit.geometry.shapes import Rectangle
from bemkit.results.solution import Solution
from bemkit.scene.conditions import Contact, Part, Pressure, Traction
from bemkit.scene.mesh_options import MeshOptions
from bemkit.scene.scene import Scene
from bemkit.scene.transform import AffineMap, transformed_scene, with_gap_offset, with_turned_loads
from bemkit.solvers.alm import AugmentedLagrangian
from bemkit.solvers.base import ContactSolver
from bemkit.solvers.ssn import SemismoothNewton
from bemkit.studies.stability.cases import PRECISION, Axis, Case, Similarity
from bemkit.studies.stability.degenerate import degenerate_diameters

_BLOCK_FRICTION = 0.5
_REFERENCE_GRADING = 1e6


def all_axes() -> tuple[Axis, ...]:
    """Return every axis, in the order of the report."""
    return (*_unit_axes(), *_physical_axes(), *_numerical_axes())


def _unit_axes() -> tuple[Axis, ...]:
    units = "same sets, same linear solves, results equal to 1e-9 after scaling"
    decades = tuple(10.0**k for k in (-12, -9, -6, -3, 3, 6, 9, 12, 15))
    return (
        Axis("youngs-modulus", "factor of Young's modulus", units, decades, partial(_similar, factor="modulus")),
        Axis("load", "factor of all loads and gaps", units, decades, partial(_similar, factor="stress")),
        Axis(
            "size",
            "factor of all lengths",
            units,
            tuple(10.0**k for k in range(-9, 10, 3) if k),
            partial(_similar, factor="length"),
        ),
        Axis(
            "position",
            "distance from the origin / diameter",
            "results equal up to the round-off of gaps, 4 eps distance; refused beyond 1e7",
            (1.0, 1e2, 1e4, 1e6, 1e8, 1e12),
            _moved,
        ),
        Axis(
            "degenerate-size",
            "diameter / diameter at which V with log|r| is singular",
            units,
            (0.5, 0.99, 1.0 - 1e-6, 1.0, 1.0 + 1e-6, 1.01, 2.0),
            _degenerate,
        ),
    )


def _physical_axes() -> tuple[Axis, ...]:
    free = "right answer or named error"
    friction = (0.0, 0.01, 0.1, 0.3, 0.5, 1.0, 2.0, 3.0, 5.0, 10.0, 30.0, 100.0, 1000.0)
    incompressible = (-0.5, 0.0, 0.2, 0.3, 0.4, 0.45, 0.49, 0.499, 0.4999, 0.49999, 0.499999, 0.4999999, 0.5)
    offsets = (-1e3, -1.0, -1e-3, -1e-6, 0.0, 1e-6, 1e-3, 0.5, 0.999999, 1.0, 1.000001, 2.0, 1e3)
    ratios = (0.0, 0.5, 0.9, 0.99, 1.0 - 1e-4, 1.0, 1.0 + 1e-4, 1.01, 1.1, 2.0, 100.0)
    return (
        Axis(
            "poisson-ratio",
            "Poisson's ratio",
            f"{free}; drift proportional to 1/2 - nu near 1/2",
            incompressible,
            _poisson,
            0.5,
        ),
        Axis("friction", "friction coefficient", free, friction, _friction),
        Axis("gap", "gap added / largest displacement", free, offsets, _gap),
        Axis(
            "load-direction",
            "turn of all loads [degrees]",
            free,
            (0.0, 1.0, 15.0, 30.0, 45.0, 60.0, 75.0, 90.0, 135.0, 180.0, -15.0, -45.0, -90.0),
            _turned,
        ),
        Axis(
            "sliding", "push / friction available, loose block", "solved below 1, refused above", ratios, _pushed, 0.0
        ),
        Axis("aspect-ratio", "stretch along x", free, tuple(10.0**k for k in (-3, -2, -1, 0, 1, 2, 3)), _stretched),
    )


def _numerical_axes() -> tuple[Axis, ...]:
    rho = tuple(10.0**k for k in range(-8, 13, 2))
    independent = "same answer for every rho, or named status"
    return (
        Axis("rho-newton", "rho / (E'/L), semismooth Newton", independent, rho, partial(_solver, make=_newton)),
        Axis(
            "rho-augmented", "rho / (E'/L), augmented Lagrangian", independent, rho, partial(_solver, make=_augmented)
        ),
        Axis(
            "elements",
            "number of elements / that of the scene",
            "right answer; drift is the discretisation error",
            (0.125, 0.25, 0.5, 1.0, 2.0),
            _elements,
        ),
        Axis(
            "grading",
            "largest / smallest element",
            "solution unchanged to 1e-6 from 1e6 on",
            (1e2, 1e4, _REFERENCE_GRADING, 1e8, 1e10, 1e12),
            _graded,
            _REFERENCE_GRADING,
        ),
    )


def _similar(baseline: Solution, value: float, *, factor: str) -> Case:
    length, modulus, stress = (value if name == factor else 1.0 for name in ("length", "modulus", "stress"))
    return _similar_case(baseline, value, Similarity(length, modulus, stress), PRECISION)


def _moved(baseline: Solution, value: float) -> Case:
    distance = value * baseline.mesh.diameter
    # gaps are differences of coordinates, known to eps * distance; displacements are a small part of the size, and
    # rough gaps make tractions as rough as E' times the roughness over the length of an element
    longest = float(np.abs(baseline.boundary.displacement).max())
    pressure = float(np.abs(baseline.contact.sigma_n).max())
    rough = baseline.scene.material.plane_modulus / (float(baseline.mesh.lengths.min()) * pressure) if pressure else 0.0
    precision = PRECISION + 4.0 * np.finfo(float).eps * distance * max(1.0 / longest, rough)
    return _similar_case(baseline, value, Similarity(shift=(0.8 * distance, -0.6 * distance)), precision)


def _degenerate(baseline: Solution, value: float) -> Case:
    critical = degenerate_diameters(baseline.mesh, baseline.scene.material)[0]
    similarity = Similarity(length=value * float(critical) / baseline.mesh.diameter)
    return _similar_case(baseline, value, similarity, PRECISION)


def _similar_case(baseline: Solution, value: float, similarity: Similarity, precision: float) -> Case:
    scene = similarity.apply(baseline.scene)
    return Case(
        value, scene, similarity, precision=precision, drift_limit=precision, keeps_steps=precision == PRECISION
    )


def _poisson(baseline: Solution, value: float) -> Case:
    material = replace(baseline.scene.material, poisson_ratio=value)
    # short of 1/2 the bulk modulus, 1 / (1 - 2 nu) times the shear modulus, multiplies round-off
    precision = PRECISION + (8.0 * np.finfo(float).eps / (0.5 - value) if value < 0.5 else 0.0)
    return Case(value, replace(baseline.scene, material=material), precision=precision)


def _friction(baseline: Solution, value: float) -> Case:
    def plain(part: Part) -> Part:
        return (
            replace(part, condition=Contact(part.condition.obstacle)) if isinstance(part.condition, Contact) else part
        )

    scene = replace(baseline.scene, parts=tuple(map(plain, baseline.scene.parts)), law=Coulomb(value))
    return Case(value, scene)


def _gap(baseline: Solution, value: float) -> Case:
    displacement = float(np.abs(baseline.boundary.displacement).max())
    # clearances are differences of gaps and displacements that both grow with the offset
    precision = PRECISION * max(1.0, abs(value))
    return Case(value, with_gap_offset(baseline.scene, value * displacement), precision=precision)


def _turned(baseline: Solution, value: float) -> Case:
    return Case(value, with_turned_loads(baseline.scene, radians(value)))


def _pushed(baseline: Solution, value: float) -> Case:
    """Press a loose block, twice as wide as high, onto the floor and push it from the left."""
    scene = baseline.scene
    parts = (
        Part("floor", Contact(HalfPlane()), sides=("bottom",)),
        Part("press", Traction(y=-1.0), sides=("top",)),
        Part("push", Pressure(2.0 * _BLOCK_FRICTION * value), sides=("left",)),
    )
    block = Scene(
        title="loose block",
        shape=Rectangle(2.0, 1.0),
        material=scene.material,
        parts=parts,
        law=Coulomb(_BLOCK_FRICTION),
        discretisation=scene.discretisation,
        mesh=MeshOptions(min(scene.mesh.n_elements, 96), Uniform()),
        solver=scene.solver,
    )
    return Case(value, block, is_solvable=None if value == 1.0 else value < 1.0)


def _stretched(baseline: Solution, value: float) -> Case:
    # stiffnesses of thin bodies differ by the third power of their slenderness
    precision = PRECISION + np.finfo(float).eps * max(value, 1.0 / value) ** 3
    return Case(
        value, transformed_scene(baseline.scene, AffineMap((value, 1.0)), displacement=1.0), precision=precision
    )


def _newton(rho: float) -> ContactSolver:
    return SemismoothNewton(rho=rho)


def _augmented(rho: float) -> ContactSolver:
    return AugmentedLagrangian(rho_n=rho, rho_t=rho)


def _solver(baseline: Solution, value: float, *, make: Callable[[float], ContactSolver]) -> Case:
    # answers with a certificate of 1e-9 differ by that times the compliance of what is certified
    return Case(value, replace(baseline.scene, solver=make(value)), drift_limit=1e-6)


def _elements(baseline: Solution, value: float) -> Case:
    options = replace(baseline.scene.mesh, elements=max(3, round(value * baseline.mesh.whole.n_elements)))
    return Case(value, replace(baseline.scene, mesh=options))


def _graded(baseline: Solution, value: float) -> Case:
    lengths = baseline.mesh.lengths
    levels = max(0, round(float(np.log2(value * lengths.min() / lengths.max()))))
    # The ends of the smallest elements are coordinates like all others: their lengths are known to 64 eps value only,
    # which the tractions on these very elements feel, and nothing else.
    return Case(
        value,
        baseline.scene,
        levels=levels,
        precision=1e-6,
        drift_limit=1e-6 if value >= _REFERENCE_GRADING else np.inf,
    )
