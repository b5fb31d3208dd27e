"""Estimated errors of elements of high degree against the norms of what their polynomials miss."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.polynomial import legendre
from scipy.special import roots_jacobi

import bemkit as bk
from bemkit.arrays import FloatArray
from bemkit.geometry.spaces import LagrangeSpace
from bemkit.operators.boundary import hypersingular, single_layer
from bemkit.results.coefficient_decay import CoefficientErrors, coefficient_errors, singular_error

MATERIAL = bk.Material(3.0, 0.3)
MESH = bk.discretise(bk.Rectangle(2.0, 2.0).outline(), n_elements=12)
ELEMENT, RATIO, DEGREE, HIGHEST = 1, 0.4, 4, 12
SERIES = RATIO ** np.arange(HIGHEST)
"""Legendre coefficients of a field on one element; the last one is a ten thousandth of the first that is missing."""


def tractions(degree: int) -> LagrangeSpace:
    return LagrangeSpace(MESH, np.ones(MESH.n_nodes, bool), degree=degree)


def field(space: LagrangeSpace, coefficients: FloatArray) -> FloatArray:
    """Return the dofs (n_scalar, 2) of a field along x on `ELEMENT`, zero elsewhere."""
    values = np.zeros((space.n_dofs // 2, 2))
    values[space.element_dofs[ELEMENT], 0] = legendre.legval(space.local_nodes, coefficients)
    return values


def estimated(displacement: FloatArray, traction: FloatArray) -> CoefficientErrors:
    space = tractions(DEGREE - 1)
    at_nodes = traction[space.element_dofs]
    return coefficient_errors(LagrangeSpace(MESH, degree=DEGREE), space, displacement, at_nodes, MATERIAL.plane_modulus)


def test_missing_tractions_have_the_norm_of_the_single_layer() -> None:
    displacement = np.zeros((MESH.n_elements * DEGREE, 2))
    errors = estimated(displacement, field(tractions(DEGREE - 1), SERIES[:DEGREE]))
    space = tractions(HIGHEST)
    missing = field(space, np.where(np.arange(HIGHEST) < DEGREE, 0.0, SERIES))
    norm = missing.ravel() @ single_layer(space, space, MATERIAL).matrix() @ missing.ravel()
    # 0.55 of the estimate for a field on one element alone, which leaves room for the displacements that it causes
    assert 0.5 < norm / errors.energy.sum() < 0.6
    k = np.arange(DEGREE, HIGHEST)
    squared = MESH.lengths[ELEMENT] * np.sum(SERIES[DEGREE:] ** 2 / (2 * k + 1))
    assert errors.traction.sum() == pytest.approx(squared, rel=1e-3)
    assert errors.traction_decay[ELEMENT] == pytest.approx(RATIO)


def test_missing_strains_have_the_norm_of_the_hypersingular_operator() -> None:
    def displacement(degree: int, slopes: FloatArray) -> tuple[LagrangeSpace, FloatArray]:
        space = LagrangeSpace(MESH, degree=degree)
        return space, field(space, legendre.legint(slopes, lbnd=-1) * 0.5 * MESH.lengths[ELEMENT])

    smooth = np.where(np.arange(HIGHEST) < 1, 0.0, SERIES)  # no mean slope: the displacement ends at zero
    errors = estimated(displacement(DEGREE, smooth[:DEGREE])[1], np.zeros((MESH.n_elements * DEGREE, 2)))
    space, missing = displacement(HIGHEST, np.where(np.arange(HIGHEST) < DEGREE, 0.0, SERIES))
    norm = missing.ravel() @ hypersingular(space, space, MATERIAL).matrix() @ missing.ravel()
    assert 0.55 < norm / errors.energy.sum() < 0.7


def estimated_norm(coefficients: FloatArray, degree: int) -> float:
    """Return the estimated error of tractions by their Legendre coefficients (n,) or (n, 2), over sqrt(length)."""
    space, displacement = tractions(degree - 1), np.zeros((MESH.n_elements * degree, 2))
    columns, values = coefficients.reshape(coefficients.shape[0], -1), np.zeros((space.n_dofs // 2, 2))
    values[space.element_dofs[ELEMENT], : columns.shape[1]] = legendre.legval(space.local_nodes, columns[:degree]).T
    spaces, at_nodes = (LagrangeSpace(MESH, degree=degree), space), values[space.element_dofs]
    errors = coefficient_errors(*spaces, displacement, at_nodes, MATERIAL.plane_modulus)
    return float(np.sqrt(errors.traction.sum() / MESH.lengths[ELEMENT]))


def error_over_best(coefficients: FloatArray, degree: int) -> float:
    """Return the estimated error over that of the best polynomials, by coefficients (n,) or (n, 2)."""
    squares = np.sum(coefficients.reshape(coefficients.shape[0], -1)[degree:] ** 2, axis=1)
    missing = squares @ (2.0 * np.arange(degree, coefficients.shape[0]) + 1.0) ** -1.0
    return estimated_norm(coefficients, degree) / float(np.sqrt(missing))


@pytest.mark.parametrize(
    ("first", "degree"),
    [
        (first, degree) for first in (0, 1) for degree in range(3, 9) if (first, degree) != (1, 3)
    ],  # one coefficient only
)
def test_fields_that_are_symmetric_in_an_element_have_estimates(first: int, degree: int) -> None:
    """Every other coefficient is zero: the middle of three, which seemed not to fall, or the last, without error."""
    coefficients = np.zeros(24)
    coefficients[first::2] = 0.6 ** np.arange(first, 24, 2)
    assert 0.4 < error_over_best(coefficients, degree) < 3.0


@given(angle=st.floats(0.1, 0.6), turn=st.floats(0.0, 6.3), degree=st.integers(4, 6))
def test_a_uniform_pressure_on_an_arc_has_no_large_estimate(angle: float, turn: float, degree: int) -> None:
    """On an arc of twice the angle coefficients fall faster and faster."""
    x, weights = legendre.leggauss(30)
    pressure = np.stack([np.cos(turn + angle * x), np.sin(turn + angle * x)], axis=1)
    coefficients = (np.arange(9) + 0.5)[:, None] * (legendre.legvander(x, 8).T @ (weights[:, None] * pressure))
    assert 0.8 < error_over_best(coefficients, degree) < 2.0


@given(place=st.floats(-0.9, 0.9), degree=st.integers(3, 10))
def test_square_roots_inside_an_element_have_no_large_estimates(place: float, degree: int) -> None:
    """Coefficients fall like 1 / k, but the last few known ones may seem not to fall."""
    x, weights = legendre.leggauss(80)
    root = 0.5 * np.sqrt(1.0 - place) * (x + 1.0)  # sqrt(xi - place) from the place on
    weights = np.sqrt(1.0 - place) * weights * root
    odd = 2.0 * np.arange(degree) + 1.0
    coefficients = 0.5 * odd * ((weights * root) @ legendre.legvander(place + root**2, degree - 1))
    best = 0.5 * (1.0 - place) ** 2 - np.sum(2.0 / odd * coefficients**2)
    ratio = estimated_norm(coefficients, degree) * np.sqrt(2.0 / best)
    assert ratio < 2.0  # 1.8 at most; the last ones may be small, for which there is `transition_error`


@given(power=st.floats(-0.3, -0.05) | st.floats(0.05, 0.9), degree=st.integers(3, 10))
def test_powers_of_the_distance_from_a_corner_have_the_error_of_their_missing_coefficients(
    power: float, degree: int
) -> None:
    nodes, weights = roots_jacobi(degree + 2, 0.0, power)  # of the weight (1 + x)**power
    odd = 2.0 * np.arange(degree) + 1.0
    coefficients = 0.5 * odd * (weights @ legendre.legvander(nodes, degree - 1))
    missing = 2.0 ** (2.0 * power + 1.0) / (2.0 * power + 1.0) - np.sum(2.0 / odd * coefficients**2)
    ratio = np.sqrt(singular_error(float(coefficients[-1]), 2.0, degree, power) / missing)
    assert 0.85 < ratio < 1.0 + 1e-6  # 64 coefficients are summed, and for powers below zero they fall slowly
