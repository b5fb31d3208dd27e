"""Two equal cylinders pressed together, and a partner so stiff that it is rigid."""

from __future__ import annotations

import numpy as np
import pytest

from bemkit.arrays import FloatArray
from bemkit.contact.dense_body import DenseBody
from bemkit.contact.laws import Coulomb, Frictionless
from bemkit.contact.problem import ContactProblem
from bemkit.operators.material import Material
from bemkit.solvers.base import solve
from bemkit.solvers.ssn import SemismoothNewton
from tests.contact.mortar.pairs import ElasticSide, elastic_side, half_disc, in_frames, join
from tests.slow import slow_except

REACH = 0.03
"""Half the angle of the contact sides; the half-width of the contact is 0.022."""


def cylinder(*, is_below: bool, degree: int, length: float, modulus: float = 0.91, down: float = 0.0) -> ElasticSide:
    """Half a disc of radius 1 with equal elements within reach, longer ones beyond it, its flat side displaced."""
    lengths = np.minimum(length * 1.25 ** np.arange(60), 0.12)
    ends = np.concatenate([[0.0], np.cumsum(lengths)])
    ends = ends[: np.searchsorted(ends, 0.5 * np.pi - REACH) + 1]
    far = 0.5 + (REACH + ends * (0.5 * np.pi - REACH) / ends[-1]) / np.pi
    near = 0.5 + np.linspace(-REACH, REACH, 2 * round(REACH / length) + 1) / np.pi

    def displaced(points: FloatArray) -> FloatArray:
        return np.tile([0.0, -down], (len(points), 1))

    mesh = half_disc(is_below=is_below, far=far, near=near)
    return elastic_side(mesh, Material(modulus, 0.3), degree, "contact", [("flat", displaced)])


def spurious_shear(degree: int, length: float, *, swap: bool = False) -> tuple[float, float]:
    """Return the largest shear of pressed cylinders with friction 0.5 by the largest pressure, and the force."""
    upper = cylinder(is_below=False, degree=degree, length=length, down=0.0022)
    lower = cylinder(is_below=True, degree=degree, length=7.0 / 11.0 * length)
    pair = join(lower, upper) if swap else join(upper, lower)
    state = solve(ContactProblem(pair.body, pair.coupling.gap, Coulomb(0.5)), SemismoothNewton()).state
    return float(np.abs(state.sigma_t).max() / -state.sigma_n.min()), float(pair.body.weights @ -state.sigma_n)


@pytest.mark.slow
def test_pressing_alone_leaves_no_shear() -> None:
    """With the normals of one side alone it is 0.04 to 0.11 on any mesh."""
    shear, force = spurious_shear(2, 0.005)
    swapped, other_force = spurious_shear(2, 0.005, swap=True)
    assert max(shear, swapped) <= 0.006
    assert force == pytest.approx(other_force, rel=1e-3)


@pytest.mark.slow
@pytest.mark.parametrize(("degree", "lengths"), [(2, (0.005, 0.00125)), (4, (0.005, 0.0025))])
def test_shear_of_pressed_cylinders_falls_with_the_mesh(degree: int, lengths: tuple[float, float]) -> None:
    coarse, fine = (spurious_shear(degree, length)[0] for length in lengths)
    assert fine <= 0.5 * coarse


@pytest.mark.parametrize("degree", slow_except([1, 2], 1))
def test_a_stiff_partner_is_a_rigid_obstacle(degree: int) -> None:
    one = cylinder(is_below=False, degree=degree, length=0.005, down=0.001)
    pair = join(one, cylinder(is_below=True, degree=degree, length=0.0032, modulus=0.91e8))
    turn = in_frames(pair.coupling.on_non_mortar, one.nodes, pair.coupling.frame)
    assert turn.shape[0] == turn.shape[1]
    back = np.linalg.inv(turn)
    stiffness, load = back.T @ one.condensed.stiffness @ back, back.T @ one.condensed.load
    alone = DenseBody(0.5 * (stiffness + stiffness.T), load, pair.coupling.weights, modulus=1.0)
    states = [
        solve(ContactProblem(body, pair.coupling.gap, Frictionless()), SemismoothNewton()).state
        for body in (pair.body, alone)
    ]
    largest = np.abs(states[1].traction).max()
    assert largest > 0.0
    assert np.abs(states[0].traction - states[1].traction).max() <= 1e-6 * largest
