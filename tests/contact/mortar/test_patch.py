"""Uniform pressure and shear pass exactly from one block to another whose mesh does not match."""

from __future__ import annotations

import numpy as np
import pytest

from bemkit.contact.laws import Coulomb
from bemkit.contact.problem import ContactProblem
from bemkit.geometry.quadrature import gauss_legendre
from bemkit.operators.material import Material
from bemkit.solvers.base import solve
from bemkit.solvers.ssn import SemismoothNewton
from tests.contact.mortar.pairs import Field, Load, Pair, block, elastic_side, join, space_of
from tests.geometry.strategies import rotation
from tests.slow import slow_except

NU = 0.3
STEEL = Material(1.0, NU)


def uniform_field(shear: float, angle: float) -> tuple[Field, Load]:
    """Return displacements and tractions under a unit pressure and a shear on planes turned by an angle."""
    turn = rotation(angle)
    gradient = turn @ np.array([[NU * (1 + NU), 0.0], [2 * (1 + NU) * shear, NU**2 - 1]]) @ turn.T
    stress = turn @ np.array([[0.0, shear], [shear, -1.0]]) @ turn.T
    return lambda points: np.asarray(points @ gradient), lambda points, normals: np.asarray(normals @ stress)


def assert_uniform(pair: Pair, shear: float) -> None:
    solution = solve(ContactProblem(pair.body, pair.coupling.gap, Coulomb(0.5)), SemismoothNewton())
    np.testing.assert_allclose(solution.state.traction, np.tile([-1.0, -shear], (pair.body.n_contact, 1)), atol=1e-10)


@pytest.mark.parametrize("swap", [False, True], ids=["upper", "lower"])
@pytest.mark.parametrize("is_held", [False, True], ids=["free corners", "held corners"])
@pytest.mark.parametrize("shear", [0.0, 0.2])
@pytest.mark.parametrize("degree", slow_except((1, 2, 4), 2))
def test_uniform_tractions_pass(degree: int, shear: float, is_held: bool, swap: bool) -> None:
    """Two inclined unit blocks, the lower one on its base; held corners are those of both left sides."""
    exact, load = uniform_field(shear, 0.4)
    upper, lower = (block((0.0, y), (1.0, y + 1.0), n, 2, turn=rotation(0.4)) for y, n in ((0.0, 3), (-1.0, 5)))
    left = [("left", exact)] if is_held else []
    free = [("right", load)] if is_held else [("right", load), ("left", load)]
    bodies = [
        elastic_side(upper, STEEL, degree, "bottom", left, [*free, ("top", load)]),
        elastic_side(lower, STEEL, degree, "top", [*left, ("bottom", exact)], free),
    ]
    pair = join(*(bodies[::-1] if swap else bodies))
    assert not pair.coupling.gap.any()
    assert_uniform(pair, shear)


@pytest.mark.parametrize("degree", [1, 2, 4])
def test_uniform_tractions_pass_where_elements_are_covered_in_part(degree: int) -> None:
    """The lower block is wider than the upper one and carries the multipliers; its bare top is loaded alike."""
    exact, load = uniform_field(0.2, 0.0)
    upper, lower = block((0.0, 0.0), (1.0, 1.0), 3, 2), block((-0.37, -1.0), (1.41, 0.0), 5, 3)
    space = space_of(lower, degree)
    elements = lower.part("top")
    force = np.zeros((space.n_dofs // 2, 2))
    gauss, weights = gauss_legendre(8)
    for element in elements:
        right, left = lower.start[element, 0], lower.end[element, 0]
        for low, high in ((left, min(right, 0.0)), (max(left, 1.0), right)):
            if low < high:
                x = 0.5 * (low + high) + 0.5 * (high - low) * gauss
                basis = space.basis((right + left - 2.0 * x) / (right - left))
                integrals = basis @ weights * 0.5 * (high - low)
                force[space.element_dofs[element]] += np.outer(integrals, load(np.zeros((1, 2)), np.array([0.0, 1.0])))
    sides = [("left", load), ("right", load)]
    pair = join(
        elastic_side(lower, STEEL, degree, "top", [("bottom", exact)], sides, force),
        elastic_side(upper, STEEL, degree, "bottom", [], [*sides, ("top", load)]),
    )
    assert pair.coupling.on_non_mortar.nnz > pair.coupling.nodes.size
    assert_uniform(pair, 0.2)
