"""A disc pressed by two opposite arcs of pressure (the Brazilian test), against the closed form of Hondros."""

from __future__ import annotations

import numpy as np
import pytest

import bemkit as bk
from bemkit.arrays import FloatArray
from bemkit.scene.discretisation import Discretisation
from tests.convergence.fields import observed_order
from tests.slow import slow_only

HALF_ANGLE = np.radians(10.0)
PRESSURE = 3.0
RADIUS = 0.5
PLACES = np.array([0.0, 0.2, 0.4, 0.6])
"""Distances from the centre, in radii, along the loaded diameter."""


def stresses(discretisation: Discretisation, n_elements: int) -> FloatArray:
    """Return (4, 2) stresses across and along the loaded diameter; two lines of symmetry hold the disc."""
    edge = bk.Expression(f"abs(y - 2) > {RADIUS * float(np.cos(HALF_ANGLE))!r}")
    scene = bk.Scene(
        title="Brazilian test",
        shape=bk.Disk(RADIUS, (1.0, 2.0)),
        material=bk.Material(7.0, 0.3),
        parts=(bk.Part("jaws", bk.Pressure(PRESSURE), where=edge),),
        symmetry=bk.Symmetry(x=1.0, y=2.0),
        discretisation=discretisation,
        mesh=bk.MeshOptions(elements=n_elements),
    )
    solution = bk.run(scene)
    assert solution.is_converged
    # a little beside the diameter, which is where the images of the elements begin
    points = np.array([1.0, 2.0]) - RADIUS * np.column_stack([np.full(4, 1e-9), PLACES + 1e-9])
    return np.einsum("nii->ni", bk.interior_fields(solution).stress(points))


def hondros() -> FloatArray:
    """Return the same in closed form: G. Hondros, Austral. J. Appl. Sci. 10 (1959) 243-268."""
    inner, outer = 1.0 - PLACES**2, 1.0 + PLACES**2
    near = inner * np.sin(2.0 * HALF_ANGLE) / (1.0 - 2.0 * PLACES**2 * np.cos(2.0 * HALF_ANGLE) + PLACES**4)
    far = np.arctan(outer / inner * np.tan(HALF_ANGLE))
    return 2.0 * PRESSURE / np.pi * np.column_stack([near - far, -near - far])


def error(discretisation: Discretisation, n_elements: int) -> float:
    exact = hondros()
    return float(np.abs(stresses(discretisation, n_elements) - exact).max() / np.abs(exact[0, 0]))


@pytest.mark.parametrize(
    ("discretisation", "ceiling"),
    slow_only([(bk.Galerkin(1), 6e-4), (bk.ConstantCollocation(), 9e-3)], (bk.Galerkin(1), 6e-4)),
)
def test_stress_along_the_loaded_diameter(discretisation: Discretisation, ceiling: float) -> None:
    # the pressure jumps: tractions, known to the order of the elements there, leave an error of order two inside
    errors = [error(discretisation, n) for n in (32, 64, 128)]
    assert errors[-1] < ceiling
    assert abs(observed_order(errors) - 2.0) < 0.5


def test_narrow_jaws_split_the_disc_like_point_loads() -> None:
    # P / (pi R) across the middle and three times that along it, for the forces P = 2 p R sin(alpha)
    across, along = stresses(bk.Galerkin(1), 64)[0]
    split = 2.0 * PRESSURE * np.sin(HALF_ANGLE) / np.pi
    # jaws of a finite width change this by a share of about alpha^2, which is 0.03
    assert across == pytest.approx(split, rel=2.0 * HALF_ANGLE**2)
    assert along == pytest.approx(-3.0 * split, rel=2.0 * HALF_ANGLE**2)
