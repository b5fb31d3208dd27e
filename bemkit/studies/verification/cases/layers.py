"""Layers that lift off what they are pressed on."""

from __future__ import annotations

import numpy as np

from bemkit.formulas import Expression
from bemkit.geometry.shapes import HalfPlaneBody, Rectangle
from bemkit.operators.material import Material
from bemkit.reference import RecedingLayer
from bemkit.results.assembly_solution import AssemblySolution
from bemkit.scene.assembly import Assembly, ContactPair
from bemkit.scene.body import Body
from bemkit.scene.conditions import Part, Pressure
from bemkit.scene.toml import load_single_body, with_overrides
from bemkit.studies.verification.case import Case, Quantity, at_resolution

STEEL = Material(1.0, 0.3)


def receding_layer() -> Case:
    """Return a layer that lifts off a rigid base."""
    exact = RecedingLayer(1.0, 0.5, 1.0)
    scene = with_overrides(load_single_body("receding-layer"), accuracy=1e-2, degree="hp")
    half_width, peak = (3e-3, 1e-5, 1e-6), (3e-4, 1e-6, 1e-8)
    return Case(
        title=scene.title,
        source="KeerDundursTsai1972",
        validity="no friction, no weight; any load and material",
        solve=at_resolution(scene),
        resolutions=(1e-2, 2e-5, 1e-6),
        quantities=(
            Quantity("half-width", lambda solution: solution.contacts[0].contact_length, half_width, exact.half_width),
            Quantity("peak pressure", lambda solution: solution.contacts[0].peak_pressure, peak, exact.peak_pressure),
        ),
    )


def receding_pair() -> Case:
    """Return a layer on a half-plane of the same material."""
    exact = RecedingLayer(1.0, 0.5, 1.0, 1.0)
    load = Part("load", Pressure(1.0), ("top",), Expression("abs(x) < 0.5"))
    scene = Assembly(
        title="layer pressed on a half-plane by a strip load",
        bodies=(
            Body(name="base", shape=HalfPlaneBody(-2.5, 2.5), material=STEEL, parts=()),
            Body(name="layer", shape=Rectangle(10.0, 1.0, (-5.0, 0.0)), material=STEEL, parts=(load,)),
        ),
        contacts=(ContactPair(("layer.bottom", "base.surface")),),
    )

    def pressure(solution: AssemblySolution) -> float:
        table, expected = solution.contact, exact.pressure(solution.contact.x)
        return float(np.sqrt(table.weight @ (table.sigma_n + expected) ** 2 / (table.weight @ expected**2)))

    return Case(
        title=scene.title,
        source="KeerDundursTsai1972",
        validity="no friction, no weight; any load; the layer ends at five thicknesses, long lifted off",
        solve=at_resolution(scene),
        resolutions=(0.05, 0.01, 0.003),
        quantities=(
            Quantity(
                "half-width",
                lambda solution: 0.5 * solution.contacts[0].contact_length,
                (6e-2, 1e-2, 2e-3),
                exact.half_width,
            ),
            Quantity("pressure, L2", pressure, (6e-2, 2.5e-2, 1.2e-2), order=0.9),
        ),
    )
