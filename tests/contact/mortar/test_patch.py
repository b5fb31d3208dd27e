"""Uniform pressure and shear pass exactly from one block to another whose mesh does not match."""

from __future__ import annotations

import numpy as np
import pytest

from bemkit.arrays import FloatArray
from bemkit.contact.laws import Coulomb
from bemkit.contact.problem import ContactProblem
from bemkit.operators.material import Material
from bemkit.solvers.base import solve
from bemkit.solvers.ssn import SemismoothNewton
from tests.contact.mortar.pairs import Pair, block, elastic_side, join

NU = 0.3
STEEL = Material(1.0, NU)


def pressed_blocks(degree: int, shear: float, *, is_held: bool, angle: float = 0.0, swap: bool = False) -> Pair:
    """Two unit blocks under the pressure 1 and a shear, the lower one held, with `is_held` both left sides as well."""
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    gradient = np.array([[NU * (1 + NU), 0.0], [2 * (1 + NU) * shear, NU**2 - 1]])
    stress = np.array([[0.0, shear], [shear, -1.0]])

    def exact(points: FloatArray) -> FloatArray:
        return np.asarray(points @ turn @ gradient @ turn.T)

    def load(points: FloatArray, normals: FloatArray) -> FloatArray:
        return np.asarray(normals @ turn @ stress @ turn.T)

    left = [("left", exact)] if is_held else []
    free = [("right", load)] if is_held else [("right", load), ("left", load)]
    upper, lower = block((0.0, 0.0), (1.0, 1.0), 3, 2, turn=turn), block((0.0, -1.0), (1.0, 0.0), 5, 2, turn=turn)
    bodies = [
        elastic_side(upper, STEEL, degree, "bottom", left, [*free, ("top", load)]),
        elastic_side(lower, STEEL, degree, "top", [*left, ("bottom", exact)], free),
    ]
    return join(*(bodies[::-1] if swap else bodies))


@pytest.mark.parametrize("swap", [False, True], ids=["upper", "lower"])
@pytest.mark.parametrize("is_held", [False, True], ids=["free corners", "held corners"])
@pytest.mark.parametrize("shear", [0.0, 0.2])
@pytest.mark.parametrize("degree", [1, 2, 4])
def test_uniform_tractions_pass(degree: int, shear: float, is_held: bool, swap: bool) -> None:
    pair = pressed_blocks(degree, shear, is_held=is_held, angle=0.4, swap=swap)
    assert not pair.coupling.gap.any()
    solution = solve(ContactProblem(pair.body, pair.coupling.gap, Coulomb(0.5)), SemismoothNewton())
    # both bodies move along the tangent of the non-mortar one, which runs the other way on the other body
    np.testing.assert_allclose(solution.state.traction, np.tile([-1.0, -shear], (pair.body.n_contact, 1)), atol=1e-10)
