"""Particular solutions: equilibrium, Hooke's law with heat, single values, and the energy of known bodies."""

from __future__ import annotations

import numpy as np
import pytest

from bemkit.arrays import FloatArray
from bemkit.geometry import discretise
from bemkit.geometry.shapes import Disk, Rectangle, Ring
from bemkit.operators.material import Material, Plane
from bemkit.operators.particular_solutions import (
    CentrifugalForce,
    HarmonicExpansion,
    LogarithmicExpansion,
    ParticularSolution,
    Source,
    UniformForce,
)

MATERIALS = [Material(2.0, 0.3), Material(2.0, 0.3, Plane.STRESS), Material(2.0, 0.5), Material(2.0, -0.4)]
POINTS = np.random.default_rng(3).uniform(-1.0, 1.0, (7, 2))
STEP = 1e-4
SOURCES: dict[str, tuple[Source, FloatArray]] = {
    "uniform": (UniformForce(0.7 - 0.4j), np.tile([0.7, -0.4], (7, 1))),
    "centrifugal": (CentrifugalForce(1.3), 1.3 * POINTS),
    "harmonic": (HarmonicExpansion((0.2, 0.1 - 0.3j, 0.4j)), np.zeros((7, 2))),
    "logarithmic": (LogarithmicExpansion(0.6, 3.0 + 0.5j, (1.2, 4.5)), np.zeros((7, 2))),
}


def slope(field: object, axis: int) -> FloatArray:
    """Differentiate a function of points; polynomials up to degree 2 exactly, others to 1e-8."""
    shift = STEP * np.eye(2)[axis]
    return np.asarray((field(POINTS + shift) - field(POINTS - shift)) / (2.0 * STEP))  # type: ignore[operator]


@pytest.mark.parametrize("material", MATERIALS)
@pytest.mark.parametrize("kind", SOURCES)
def test_stresses_balance_the_forces(kind: str, material: Material) -> None:
    source, force = SOURCES[kind]
    solution = ParticularSolution((source,), material)
    divergence = slope(solution.stress, 0)[:, :, 0] + slope(solution.stress, 1)[:, :, 1]
    np.testing.assert_allclose(divergence + force, 0.0, atol=3e-8)


@pytest.mark.parametrize("material", MATERIALS)
@pytest.mark.parametrize("kind", SOURCES)
def test_strains_are_those_of_stresses_and_heat(kind: str, material: Material) -> None:
    solution = ParticularSolution((SOURCES[kind][0],), material)
    gradient, stress = solution.displacement_gradient(POINTS), solution.stress(POINTS)
    for axis in range(2):
        np.testing.assert_allclose(gradient[:, :, axis], slope(solution.displacement, axis), atol=3e-8)
    mean = 0.5 * np.trace(stress, axis1=1, axis2=2)[:, None, None] * np.eye(2)
    elastic = material.plane_compressibility * mean + (stress - mean) / (2.0 * material.shear_modulus)
    strain = 0.5 * (gradient + gradient.transpose(0, 2, 1))
    np.testing.assert_allclose(strain, elastic + solution.expansion(POINTS)[:, None, None] * np.eye(2), atol=1e-14)


def test_heat_without_holes_leaves_no_stress() -> None:
    solution = ParticularSolution((SOURCES["harmonic"][0],), MATERIALS[0])
    assert not solution.stress(POINTS).any()
    np.testing.assert_allclose(solution.expansion(POINTS), 0.2 + POINTS @ [0.1, 0.3] - 0.8 * POINTS.prod(axis=1))


def test_the_parts_add_up() -> None:
    sources = tuple(source for source, _ in SOURCES.values())
    solution = ParticularSolution(sources, MATERIALS[0])
    both = solution.forces.stress(POINTS) + solution.expansions.stress(POINTS)
    np.testing.assert_allclose(solution.stress(POINTS), both, rtol=1e-13)
    assert not solution.forces.expansion(POINTS).any()
    normals = POINTS / np.hypot(*POINTS.T)[:, None]
    expected = np.einsum("nij,nj->ni", both, normals)
    np.testing.assert_allclose(solution.traction(POINTS, normals), expected, rtol=1e-13)


def test_energies_of_known_bodies() -> None:
    """Hydrostatic stress -y in a square: the integral of beta y^2; log r in a ring, by its own quadrature."""
    material = MATERIALS[0]
    square = discretise(Rectangle(2.0, 2.0, (-1.0, -1.0)).outline(), n_elements=8)
    weight = ParticularSolution((UniformForce(1j),), material)
    assert weight.energy(square) == pytest.approx(material.plane_compressibility * 4.0 / 3.0, rel=1e-13)
    disc = discretise(Disk(1.0).outline(), n_elements=16)
    spin = ParticularSolution((CentrifugalForce(1.0),), material)
    freedom, mu = 1.0 - material.effective_poisson_ratio, material.shear_modulus
    beta = material.plane_compressibility
    c = -0.125 * beta / freedom
    expected = 2.0 * np.pi * (beta / (16.0 * freedom**2) + 2.0 * mu * c**2) / 6.0
    assert spin.energy(disc) == pytest.approx(expected, rel=1e-10)
    ring = discretise(Ring(0.5, 1.0).outline(), n_elements=32)
    heat = ParticularSolution((LogarithmicExpansion(1.0, 0j, (0.5, 1.0)),), material)
    r, weights = np.polynomial.legendre.leggauss(30)
    r = 0.75 + 0.25 * r
    radial, hoop = free_ring(r, 0.5, 1.0, material)
    density = beta * (0.5 * (radial + hoop)) ** 2 + (0.5 * (radial - hoop)) ** 2 / (2.0 * mu)
    assert heat.energy(ring) == pytest.approx(2.0 * np.pi * 0.25 * float(weights @ (density * r)), rel=1e-10)


def free_ring(r: FloatArray, a: float, b: float, material: Material) -> tuple[FloatArray, FloatArray]:
    """Return radial and hoop stresses of a ring with the thermal strain log r [TimoshenkoGoodier1970]."""

    def moment(r: FloatArray | float) -> FloatArray:
        return np.asarray(0.5 * r**2 * (np.log(r) - 0.5) - 0.5 * a**2 * (np.log(a) - 0.5))

    factor = 2.0 * material.shear_modulus / (1.0 - material.effective_poisson_ratio) / r**2
    mean = moment(b) / (b**2 - a**2)
    radial = factor * ((r**2 - a**2) * mean - moment(r))
    return radial, factor * ((r**2 + a**2) * mean + moment(r) - r**2 * np.log(r))


@pytest.mark.parametrize("material", MATERIALS)
@pytest.mark.parametrize("thickness", [0.5, 0.1, 0.001])
def test_the_state_of_a_heated_ring_is_that_of_a_free_one(thickness: float, material: Material) -> None:
    """However thin it is: nothing that its elements would have to cancel."""
    inner = 1.0 - thickness
    heat = ParticularSolution((LogarithmicExpansion(1.0, 0j, (inner, 1.0)),), material)
    r = np.linspace(inner, 1.0, 5)
    points = np.column_stack([r, np.zeros(5)])
    radial, hoop = free_ring(r, inner, 1.0, material)
    round_off = 1e-14 / thickness**2 * material.shear_modulus  # of the differences in both expressions
    np.testing.assert_allclose(heat.stress(points)[:, 0, 0], radial, atol=round_off)
    np.testing.assert_allclose(heat.stress(points)[:, 1, 1], hoop, atol=round_off)
