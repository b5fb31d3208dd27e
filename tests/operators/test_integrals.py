"""Element-pair integrals against adaptive quadrature in extended precision."""

from __future__ import annotations

import mpmath
import numpy as np
import pytest

from bemkit.geometry import BoundaryMesh
from bemkit.operators.integrals import PairSweep
from bemkit.operators.pairs import Degrees

DEGREES = Degrees(log=(1, 1), double=(1, 2))


def mesh_of(points: list[tuple[float, float]]) -> BoundaryMesh:
    n = len(points)
    return BoundaryMesh(np.array(points), np.column_stack([np.arange(n), np.roll(np.arange(n), -1)]))


def quadrature(mesh: BoundaryMesh, i: int, j: int, power: tuple[int, int], kernel: str) -> complex:
    """One pair of elements by nested tanh-sinh quadrature, split where the elements are closest."""
    with mpmath.workdps(25):
        a, b = (mpmath.mpc(*map(float, mesh.start[k])) for k in (i, j))
        step_a, step_b = (mpmath.mpc(*map(float, mesh.end[k] - mesh.start[k])) / 2 for k in (i, j))
        normal = -1j * step_b / abs(step_b)

        def value(xi: mpmath.mpf, t: mpmath.mpf) -> mpmath.mpc:
            rho = (a + step_a * (1 + xi)) - (b + step_b * (1 + t))
            if rho == 0:
                return mpmath.mpc(0)
            weight = xi ** power[0] * t ** power[1] * abs(step_a) * abs(step_b)
            if kernel == "log":
                return weight * mpmath.log(abs(rho))
            if kernel == "quotient":
                return weight * rho / mpmath.conj(rho)
            return weight * mpmath.re(normal / rho) / (2 * mpmath.pi)

        return complex(mpmath.quad(lambda xi: mpmath.quad(lambda t: value(xi, t), [-1, 0, 1]), [-1, 0, 1]))


# a corner of 60 degrees with elements of very different lengths, a reflex corner, collinear neighbours, a near miss
OUTLINE = [(0.0, 0.0), (1.0, 0.0), (1.2, 0.0), (1.2, 0.02), (0.5, 0.03), (0.6, 0.8), (0.1, 0.9)]


@pytest.mark.parametrize(
    ("i", "j"),
    [(0, 1), (1, 0), (2, 1), (1, 2), (0, 3), (3, 0), (0, 6), (6, 0), (5, 0), (2, 5), (4, 3), (3, 4)],
)
def test_pairs_agree_with_adaptive_quadrature(i: int, j: int) -> None:
    mesh = mesh_of(OUTLINE)
    integrals = PairSweep(mesh, DEGREES).chunk(slice(0, mesh.n_elements))
    size = 0.25 * mesh.lengths[i] * mesh.lengths[j]
    for a, b in [(0, 0), (1, 1), (0, 1)]:
        # tanh-sinh reaches about 1e-10 on the logarithmic corner of touching elements
        assert integrals.log[a, b, i, j] == pytest.approx(quadrature(mesh, i, j, (a, b), "log").real, abs=1e-9 * size)
        quotient = quadrature(mesh, i, j, (a, b), "quotient")
        assert integrals.quotient[a, b, i, j] == pytest.approx(quotient, abs=1e-9 * size)


@pytest.mark.parametrize(("i", "j", "power"), [(0, 3, (0, 0)), (3, 0, (1, 1)), (6, 2, (0, 2)), (2, 5, (1, 2))])
def test_double_layer_pairs_agree_with_adaptive_quadrature(i: int, j: int, power: tuple[int, int]) -> None:
    mesh = mesh_of(OUTLINE)
    integrals = PairSweep(mesh, DEGREES).chunk(slice(0, mesh.n_elements))
    expected = quadrature(mesh, i, j, power, "double").real
    assert integrals.double[(*power, i, j)] == pytest.approx(expected, rel=1e-9, abs=1e-12)


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
    points = [(x, 0.0) for x in side] + [(1.0, x) for x in side] + [(1 - x, 1.0) for x in side] + [(0.0, 1 - x) for x in side]
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
            # eight points are exact to round-off ten lengths away; products of odd powers are small differences
            assert integrals.log[a, b, i, j] == pytest.approx(np.sum(p * np.log(np.abs(rho))), rel=1e-10, abs=1e-19)
            assert integrals.quotient[a, b, i, j] == pytest.approx(np.sum(p * rho / np.conj(rho)), rel=1e-10, abs=1e-19)
            double = np.sum(p * (normal / rho).real) / (2 * np.pi)
            assert integrals.double[a, b, i, j] == pytest.approx(double, rel=1e-10, abs=1e-19)


def test_rows_and_columns_can_be_chosen() -> None:
    mesh = mesh_of(OUTLINE)
    whole = PairSweep(mesh, DEGREES).chunk(slice(0, mesh.n_elements))
    rows, columns = np.array([5, 2]), np.array([0, 1, 4])
    part = PairSweep(mesh, DEGREES, rows, columns).chunk(slice(0, 2))
    np.testing.assert_allclose(part.log, whole.log[:, :, rows][..., columns], rtol=1e-13)
    np.testing.assert_allclose(part.double, whole.double[:, :, rows][..., columns], rtol=1e-13, atol=1e-16)
