"""Element-pair integrals against adaptive quadrature in extended precision."""

from __future__ import annotations

from functools import lru_cache

import mpmath
import numpy as np
import pytest

from bemkit.geometry import BoundaryMesh, Geometric, Rectangle, discretise
from bemkit.operators.integrals.pairs import Degrees, PairIntegrals
from bemkit.operators.integrals.sweep import PairSweep
from tests.slow import slow_except

DEGREES = Degrees(log=(1, 1), double=(1, 2))


def mesh_of(points: list[tuple[float, float]]) -> BoundaryMesh:
    n = len(points)
    return BoundaryMesh(np.array(points), np.column_stack([np.arange(n), np.roll(np.arange(n), -1)]))


def exact(mesh: BoundaryMesh, i: int, j: int) -> tuple[float, complex, float]:
    """Log, quotient and double layer of constants on two different elements: double primitives with 60 digits.

    With rho = x - y, the sums run over the four pairs of end points; logarithms are taken relative to the direction of
    the centres, which is continuous because the set of all rho is convex and does not contain zero.
    """
    with mpmath.workdps(60):
        ends = [[mpmath.mpc(*map(float, p)) for p in (mesh.start[k], mesh.end[k])] for k in (i, j)]
        (a_i, b_i), (a_j, b_j) = ends
        length_i, length_j = abs(b_i - a_i), abs(b_j - a_j)
        tau_i, tau_j = (b_i - a_i) / length_i, (b_j - a_j) / length_j
        d = (a_i + b_i - a_j - b_j) / 2
        direction = d / abs(d)
        beta_of = {
            0: mpmath.conj(tau_i) * (-length_i / 2) + mpmath.conj(d),
            1: mpmath.conj(tau_i) * length_i / 2 + mpmath.conj(d),
        }
        sum_log = sum_x0 = sum_x1 = mpmath.mpc(0)
        for p, z_i in enumerate(ends[0]):
            for q, z_j in enumerate(ends[1]):
                r = z_i - z_j
                if r == 0:
                    continue
                sign = 1 if p == q else -1
                log = mpmath.log(r / direction)
                sum_log += sign * r**2 * log
                sum_x0 += sign * mpmath.conj(r) * mpmath.conj(log)
                sum_x1 += sign * (beta_of[p] * mpmath.conj(r) - mpmath.conj(r) ** 2 / 2) * mpmath.conj(log)
        area = length_i * length_j
        log = mpmath.re(-sum_log / (2 * tau_i * tau_j)) - mpmath.mpf(3) / 2 * area
        x0 = -tau_i * tau_j * sum_x0
        x1 = -tau_i * tau_j**2 * (sum_x1 + area * mpmath.conj(tau_i * tau_j) / 2)
        gamma, delta = d - tau_i**2 * mpmath.conj(d), tau_j - tau_i**2 * mpmath.conj(tau_j)
        quotient = tau_i**2 * area + gamma * x0 - delta * x1
        normal = -1j * tau_j
        return float(log), complex(quotient), float(mpmath.re(mpmath.conj(normal) * x0) / (2 * mpmath.pi))


# a corner of 60 degrees with elements of very different lengths, a reflex corner, collinear neighbours, a near miss
OUTLINE = [(0.0, 0.0), (1.0, 0.0), (1.2, 0.0), (1.2, 0.02), (0.5, 0.03), (0.6, 0.8), (0.1, 0.9)]


def check_constants(mesh: BoundaryMesh, tolerance: float) -> None:
    """Compare all pairs with the exact ones, relative to what an element at that distance contributes at most."""
    integrals = PairSweep(mesh, DEGREES).chunk(slice(0, mesh.n_elements))
    for i in range(mesh.n_elements):
        for j in range(mesh.n_elements):
            if i == j:
                continue
            log, quotient, double = exact(mesh, i, j)
            area = mesh.lengths[i] * mesh.lengths[j]
            assert integrals.log[0, 0, i, j] == pytest.approx(log, rel=tolerance, abs=tolerance * area)
            assert integrals.quotient[0, 0, i, j] == pytest.approx(quotient, abs=tolerance * area)
            distance = np.hypot(*(mesh.centres[i] - mesh.centres[j])) + mesh.lengths[[i, j]].max()
            assert integrals.double[0, 0, i, j] == pytest.approx(double, abs=tolerance * area / distance)


def test_pairs_agree_with_exact_double_integrals() -> None:
    check_constants(mesh_of(OUTLINE), 1e-13)  # round-off of about a hundred outer points


@lru_cache(maxsize=2)
def graded_integrals(ratio: float) -> tuple[BoundaryMesh, PairIntegrals]:
    """Return the integrals of a graded mesh by rules of ten points more than linear elements take."""
    mesh = discretise(Rectangle(1.0, 1.0).outline(), n_elements=40, grading=Geometric(ratio, 6))
    return mesh, PairSweep(mesh, Degrees(log=(20, 20), double=(20, 20))).chunk(slice(0, mesh.n_elements))


@pytest.mark.parametrize("degree", range(1, 13))
@pytest.mark.parametrize("ratio", slow_except((0.1, 0.2), 0.1))
def test_rules_suffice_for_odd_and_even_degrees_on_graded_meshes(ratio: float, degree: int) -> None:
    # of far pairs either element may take the outer rule, with polynomials up to the degree of the displacements
    mesh, expected = graded_integrals(ratio)
    sweep = PairSweep(mesh, Degrees(log=(degree - 1, degree - 1), double=(degree - 1, degree)))
    integrals = sweep.chunk(slice(0, mesh.n_elements))
    area = np.multiply.outer(mesh.lengths, mesh.lengths)
    distance = np.linalg.norm(mesh.centres[:, None] - mesh.centres, axis=2) + np.sqrt(area)
    for name, size in (("log", area), ("quotient", area), ("double", area / distance)):
        values = getattr(integrals, name)
        n_test, n_trial = values.shape[:2]
        # an odd degree costs one digit of the base of the error estimate; see GAUSS_LEVELS
        assert np.abs((values - getattr(expected, name)[:n_test, :n_trial]) / size).max() < 1e-13, name


@pytest.mark.parametrize("ratio", [1e-2, 1e-6, 1e-10, 1e-12])
def test_pairs_stay_exact_when_lengths_differ_by_orders(ratio: float) -> None:
    outline = [(0.0, 0.0), (1.0 - ratio, 0.0), (1.0, 0.0), (1.0, ratio), (1.0, 0.7), (0.3, 1.0)]
    check_constants(mesh_of(outline), 1e-12)  # coordinates near 1 lose eps / ratio, which the reference loses, too


@pytest.mark.parametrize("gap", [1e-2, 1e-4, 1e-6])
def test_pairs_stay_exact_on_nearly_touching_sides(gap: float) -> None:
    # a slit of width gap between two parallel sides whose elements overlap by halves
    outline = [
        (0.0, 0.0),
        (3.0, 0.0),
        (3.0, 2.0),
        (0.0, 2.0),
        (0.0, 1.0 + gap),
        (1.0, 1.0 + gap),
        (2.0, 1.0 + gap),
        (2.0, 1.0),
    ]
    outline += [(1.5, 1.0), (0.5, 1.0), (0.0, 1.0)]
    check_constants(mesh_of(outline), 1e-12)


def test_same_element_has_its_closed_form() -> None:
    mesh = mesh_of(OUTLINE)
    integrals = PairSweep(mesh, DEGREES).chunk(slice(0, mesh.n_elements))
    same = np.arange(mesh.n_elements)
    length = mesh.lengths
    tangent = mesh.tangents[:, 0] + 1j * mesh.tangents[:, 1]
    np.testing.assert_allclose(integrals.log[0, 0, same, same], length**2 * (np.log(length) - 1.5), rtol=1e-14)
    np.testing.assert_allclose(integrals.quotient[0, 0, same, same], tangent**2 * length**2, rtol=1e-14)
    assert not integrals.double[:, :, same, same].any()


def test_far_pairs_agree_with_a_tensor_rule() -> None:
    # two squares far apart in one loop: pairs at 1e2 to 1e4 element lengths, where plain logarithms lose digits
    side = np.linspace(0.0, 1.0, 65)[:-1]
    points = (
        [(x, 0.0) for x in side]
        + [(1.0, x) for x in side]
        + [(1 - x, 1.0) for x in side]
        + [(0.0, 1 - x) for x in side]
    )
    mesh = mesh_of(points)
    integrals = PairSweep(mesh, DEGREES).chunk(slice(0, mesh.n_elements))
    xi, weight = np.polynomial.legendre.leggauss(8)
    places = mesh.points(np.arange(mesh.n_elements), xi)
    z = places[..., 0] + 1j * places[..., 1]
    rng = np.random.default_rng(7)
    for i, j in rng.integers(0, mesh.n_elements, (200, 2)):
        if abs(z[i].mean() - z[j].mean()) < 10 * mesh.lengths[0]:
            continue
        rho = z[i][:, None] - z[j][None, :]
        w = np.outer(weight, weight) * 0.25 * mesh.lengths[i] * mesh.lengths[j]
        normal = mesh.normals[j][0] + 1j * mesh.normals[j][1]
        for a, b in [(0, 0), (1, 1), (0, 1), (1, 0)]:
            p = w * xi[:, None] ** a * xi[None, :] ** b
            # eight points are exact to round-off ten lengths away; odd powers are differences of even ones
            size = float(np.sum(w))
            log, quotient = np.sum(p * np.log(np.abs(rho))), np.sum(p * rho / np.conj(rho))
            double = np.sum(p * (normal / rho).real) / (2 * np.pi)
            assert integrals.log[a, b, i, j] == pytest.approx(log, abs=1e-13 * size)
            assert integrals.quotient[a, b, i, j] == pytest.approx(quotient, abs=1e-13 * size)
            assert integrals.double[a, b, i, j] == pytest.approx(double, abs=1e-13 * size / np.abs(rho).min())


def test_rows_and_columns_can_be_chosen() -> None:
    mesh = mesh_of(OUTLINE)
    whole = PairSweep(mesh, DEGREES).chunk(slice(0, mesh.n_elements))
    rows, columns = np.array([5, 2]), np.array([0, 1, 4])
    part = PairSweep(mesh, DEGREES, rows, columns).chunk(slice(0, 2))
    np.testing.assert_allclose(part.log, whole.log[:, :, rows][..., columns], rtol=1e-13)
    np.testing.assert_allclose(part.double, whole.double[:, :, rows][..., columns], rtol=1e-13, atol=1e-16)
