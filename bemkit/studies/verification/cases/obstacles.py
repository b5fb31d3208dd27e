"""One body on a rigid obstacle."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from bemkit.contact.laws import Coulomb
from bemkit.contact.obstacle import Gap
from bemkit.errors import InputError
from bemkit.geometry.shapes import Ring
from bemkit.operators.material import Material
from bemkit.reference import LameRing, find_reference
from bemkit.results.solution import Solution
from bemkit.scene.conditions import Contact, Part, Pressure
from bemkit.scene.discretisation import QuadraticGalerkin
from bemkit.scene.scene import Scene
from bemkit.scene.toml import load_single_body, with_overrides
from bemkit.studies.verification.case import Case, Quantity, at_resolution, field_errors

INNER, OUTER = (tuple(f"{name}-{k}" for k in range(1, 5)) for name in ("inner", "outer"))


RISING = (1e-2, 5e-5, 1e-6)
"""Accuracies asked of elements of rising degree."""


def _shipped(
    name: str, source: str, validity: str, resolutions: tuple[float, ...], **bounds: tuple[float, ...]
) -> Case:
    """Return a shipped scene with a reference, and the bounds of its errors by the names of measures."""
    scene = load_single_body(name)
    if resolutions is RISING:
        scene = with_overrides(scene, accuracy=RISING[0], degree="hp")
    reference = find_reference(scene)
    if reference is None:
        raise InputError(f"scene {name!r} has no reference: give it one in bemkit.reference.shipped")
    return Case(scene.title, source, validity, at_resolution(scene), resolutions, field_errors(reference, **bounds))


def uniform_slip() -> Case:
    """Return a block that slips under uniform stresses."""
    exact = (1e-12, 1e-12)
    validity = "exact for every mesh"
    return _shipped(
        "uniform-slip", "Wriggers2006", validity, (30, 60), displacement=exact, sigma_n=exact, sigma_t=exact
    )


def gravity_column() -> Case:
    """Return a column that presses on its floor by its weight."""
    exact = (1e-11, 1e-11)
    validity = "between smooth walls; exact for every mesh"
    return _shipped("gravity-column", "TimoshenkoGoodier1970", validity, (24, 48), sigma_n=exact, energy=exact)


def westergaard() -> Case:
    """Return a block on a wave."""
    return _shipped(
        "wavy-obstacle",
        "Westergaard1939",
        "gentle slopes; the finite height of the block is taken into account",
        RISING,
        sigma_n=(1.5e-3, 2e-4, 1e-6),
        energy=(4e-6, 2e-8, 1e-11),
        transitions=(5e-4, 3e-5, 1e-6),
    )


def disc_between_plates() -> Case:
    """Return a quarter of a disc between smooth plates."""
    return _shipped(
        "disc-between-plates",
        "Johnson1985",
        "small strains; the half-angle may be large",
        RISING,
        sigma_n=(2e-2, 5e-5, 1e-6),
        energy=(2e-4, 1e-10, 1e-11),
        transitions=(2e-3, 1e-6, 1e-7),
    )


def paper_1() -> Case:
    """Return example 1 of the source paper."""
    return _shipped(
        "paper-1",
        "Paper",
        "static law, friction 0.5; a fine solution that finite elements confirm to 1e-7",
        RISING,
        sigma_n=(1.5e-3, 1e-4, 1e-6),
        sigma_t=(1e-2, 1e-3, 2e-6),
        energy=(2e-5, 1e-8, 1e-12),
        transitions=(2e-3, 1e-4, 1e-6),
    )


def paper_2() -> Case:
    """Return example 2 of the source paper."""
    return _shipped(
        "paper-2",
        "Paper",
        "static law, friction 0.1; a fine solution that finite elements confirm to 1e-7",
        RISING,
        sigma_n=(1e-3, 5e-5, 1e-6),
        sigma_t=(1e-3, 1e-4, 6e-6),
        energy=(1e-8, 2e-10, 1e-12),
        transitions=(1e-4, 1e-5, 1e-6),
    )


def ring_on_shaft() -> Case:
    """Return a ring, shrunk onto a rigid shaft, that a torque of nine tenths of its limit cannot turn."""
    material, friction, interference = Material(2.0, 0.3), 0.2, 1e-3
    pressure = interference / float(LameRing(1.0, 2.0, 1.0, 0.0, material).displacement(1.0))
    shear = 0.9 * friction * pressure
    scene = Scene(
        title="ring on a rigid shaft under a torque",
        shape=Ring(1.0, 2.0),
        material=material,
        law=Coulomb(friction),
        parts=(
            Part("shaft", Contact(Gap(-interference)), INNER),
            Part("torque", Pressure(0.0, shear / 4.0), OUTER),
        ),
        discretisation=QuadraticGalerkin(),
    )

    def off(name: str, expected: float) -> Callable[[Solution], float]:
        return lambda solution: float(np.abs(np.abs(getattr(solution.contact, name)) / expected - 1.0).max())

    errors = (4e-2, 1.3e-2, 3e-3)

    def slipping(solution: Solution) -> float:
        return float(solution.contact.status_words().count("slip"))

    return Case(
        title=scene.title,
        source="TimoshenkoGoodier1970",
        validity="small strains; torque below 2 pi a^2 s p",
        solve=at_resolution(scene),
        resolutions=(32, 64, 128),
        quantities=(
            Quantity("pressure, largest error", off("sigma_n", pressure), errors, order=1.2),
            Quantity("shear, largest error", off("sigma_t", shear), errors, order=1.2),
            Quantity("nodes that slip", slipping, (0.0, 0.0, 0.0)),
        ),
    )
