"""The circle: complete discrete symbols to round-off on arcs, observed orders of the maps on arcs and on polygons."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.special import zeta

from bemkit.arrays import FloatArray
from bemkit.geometry import BoundaryMesh, Disk, discretise
from bemkit.geometry.spaces import BoundarySpace, ConstantSpace, LinearSpace, QuadraticSpace, dof_points
from bemkit.operators.boundary import SteklovPoincareOperator, assemble, double_layer, hypersingular, single_layer
from bemkit.operators.material import Material
from bemkit.operators.steklov_poincare import SteklovPoincare
from bemkit.operators.steklov_poincare.collocation import CollocationElasticity
from bemkit.operators.steklov_poincare.galerkin import GalerkinElasticity
from tests.slow import slow_except, slow_only

RADIUS = 1.3
MATERIAL = Material(2.0, 0.3)
MODES = range(-8, 9)


class Symbols:
    """Eigenvalues of the operators on the complex modes u_x + i u_y = exp(i k theta) of a circle, with log(r / r0)."""

    def __init__(self, r0: float, k: int, is_imaginary: bool = False) -> None:
        mu, kappa = MATERIAL.shear_modulus, MATERIAL.kappa
        n = abs(k)
        if k == 0:
            v, w, d, s = (1 - 2 * kappa * np.log(RADIUS / r0)) / (2 * mu * (kappa + 1)), 0.0, -0.5, 0.0
        elif k == 1 and is_imaginary:
            v, w, d, s = 1 / (2 * mu), 0.0, -0.5, 0.0
        elif k == 1:
            v, w = (kappa - 1) / (2 * mu * (kappa + 1)), 4 * mu / (kappa + 1)
            d, s = (3 - kappa) / (2 * (kappa + 1)), 4 * mu / (kappa - 1)
        else:
            v, w = kappa / (2 * mu * n * (kappa + 1)), 2 * mu * n / (kappa + 1)
            d, s = (1 - kappa) / (2 * (kappa + 1)), 2 * mu * n / kappa
            if k < 0:
                d, s = -d, 2 * mu * n
        self.single, self.double, self.hyper, self.map = v * RADIUS, d, w / RADIUS, s / RADIUS


def circle(n: int) -> BoundaryMesh:
    return discretise(Disk(RADIUS).outline(), n_elements=n)


def mode(space: BoundarySpace, k: int, is_imaginary: bool = False) -> FloatArray:
    x, y = dof_points(space).T
    values = np.exp(1j * k * np.arctan2(y, x)) * (1j if is_imaginary else 1.0)
    return np.column_stack([values.real, values.imag]).ravel()


def aliases(k: int, n: int, decay: int) -> tuple[float, float]:
    """Return the sums of |m|**-decay over m = k + n j, j > 0 and j < 0."""
    return zeta(decay, 1 + k / n) / n**decay, zeta(decay, 1 - k / n) / n**decay


@pytest.mark.parametrize("k", slow_except(MODES, -2, 0, 5))
@pytest.mark.parametrize("is_imaginary", [False, True])
def test_complete_discrete_symbols_on_arcs(k: int, is_imaginary: bool) -> None:
    # A spline of degree p through exp(i k theta) at n equal steps has the Fourier coefficients (s / m)^(p + 1) with
    # s = n sin(pi k / n) / pi at m = k + n j, each of which the operators multiply by its symbol (j alternates the
    # sign for p = 0, but squares it): Hurwitz zeta functions sum what the aliases add, to round-off.
    n = 20
    mesh = circle(n)
    here, up, down = (Symbols(mesh.diameter, m, is_imaginary) for m in (k, n, -n))
    s = n * np.sin(np.pi * k / n) / np.pi

    def total(own: float, up: float, down: float, degree: int, growth: int) -> float:
        """Sum the symbols `own` at m = k and those like up, down |m / n|**growth at the aliases."""
        power = 2 * degree + 2
        above, below = aliases(k, n, power - growth)
        first = own * (s / k) ** power if k else own
        return float(first + s**power * (up * above + down * below) / float(n) ** growth)

    perimeter = 2 * np.pi * RADIUS
    for space, degree in ((ConstantSpace(mesh), 0), (LinearSpace(mesh), 1)):
        u = mode(space, k, is_imaginary)
        v = single_layer(space, space, MATERIAL).matrix()
        expected = total(here.single, up.single, down.single, degree, -1)
        # the whole perimeter is one sum of n^2 pair integrals, each exact to a few eps
        assert u @ v @ u / perimeter == pytest.approx(expected, rel=1e-13)
    space = LinearSpace(mesh)
    u = mode(space, k, is_imaginary)
    operators = double_layer(space, space, MATERIAL), hypersingular(space, space, MATERIAL)
    assemble(*operators)
    for operator, name, growth in zip(operators, ("double", "hyper"), (0, 1), strict=True):
        expected = total(*(getattr(symbols, name) for symbols in (here, up, down)), 1, growth)
        assert u @ operator.matrix() @ u / perimeter == pytest.approx(expected, rel=1e-12, abs=1e-14)


def symbol_errors(elastic: SteklovPoincare, modes: tuple[int, ...]) -> FloatArray:
    """Return the relative errors of the energies of some modes."""
    errors = []
    for k in modes:
        u = mode(elastic.displacement_space, k)
        energy = u @ SteklovPoincareOperator(elastic).matrix() @ u
        errors.append(abs(energy / (2 * np.pi * RADIUS * Symbols(1.0, k).map) - 1.0))
    return np.array(errors)


def polygon(n: int) -> BoundaryMesh:
    nodes = circle(n).nodes
    return BoundaryMesh(nodes, np.column_stack([np.arange(n), np.roll(np.arange(n), -1)]))


def quadratic(mesh: BoundaryMesh, material: Material) -> GalerkinElasticity:
    return GalerkinElasticity(mesh, material, QuadraticSpace(mesh), LinearSpace(mesh))


def linear(mesh: BoundaryMesh, material: Material) -> GalerkinElasticity:
    return GalerkinElasticity(mesh, material, LinearSpace(mesh), LinearSpace(mesh))


CASES = {
    "galerkin, arcs": (GalerkinElasticity, circle, 2.0, 1.5e-2),
    "galerkin, polygons": (GalerkinElasticity, polygon, 2.0, 1.5e-2),
    "linear, arcs": (linear, circle, 2.0, 1.5e-2),
    "quadratic, arcs": (quadratic, circle, 4.0, 1e-4),
    "collocation, arcs": (CollocationElasticity, circle, 2.0, 5e-3),
}


@pytest.mark.parametrize("name", slow_only(CASES, "collocation, arcs", "linear, arcs"))
def test_energies_of_modes_converge(name: str) -> None:
    make, mesh_of, order, ceiling = CASES[name]
    errors = np.array([symbol_errors(make(mesh_of(n), MATERIAL), (-3, -1, 1, 2, 4)) for n in (24, 48, 96)])
    assert errors[-1].max() < ceiling
    observed = np.log2(errors[-2] / errors[-1])
    assert observed.min() > order - 0.25
    assert observed.max() < order + 0.25
