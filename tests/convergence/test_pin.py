"""Contact on an exterior: a rigid pin, too thick or pushed, in the round hole of an infinite plate."""

from __future__ import annotations

import numpy as np
import pytest

from bemkit.contact.laws import Coulomb, Frictionless
from bemkit.contact.obstacle import RigidCircle
from bemkit.contact.problem import ContactProblem
from bemkit.geometry import Disk, ExteriorOf, discretise
from bemkit.operators.material import Material
from bemkit.operators.steklov_poincare.collocation import CollocationElasticity
from bemkit.operators.steklov_poincare.galerkin import GalerkinElasticity
from bemkit.solvers.base import solve
from bemkit.solvers.ssn import SemismoothNewton
from tests.handmade import condense, contact_along_normals

RADIUS = 0.7
MATERIAL = Material(2.0, 0.3)


@pytest.mark.parametrize(("kind", "tolerance"), [(GalerkinElasticity, 2e-3), (CollocationElasticity, 1.5e-2)])
def test_shrink_fit(kind: type[GalerkinElasticity | CollocationElasticity], tolerance: float) -> None:
    # the hole widens by the interference d everywhere: p = 2 mu d / a
    interference = 1e-3
    mesh = discretise(ExteriorOf(Disk(RADIUS)).outline(), n_elements=64)
    elastic = kind(mesh, MATERIAL)
    body = condense(elastic, [], contact_along_normals(elastic.displacement_space, np.arange(64)), np.zeros((64, 2)))
    nodes = body.nodes
    gap = RigidCircle((0.0, 0.0), RADIUS + interference).gap(nodes.points, nodes.directions)
    np.testing.assert_allclose(gap, -interference, rtol=1e-12)
    solution = solve(ContactProblem(body, gap, Coulomb(0.3)), SemismoothNewton())
    pressure = -solution.state.traction[:, 0]
    expected = 2 * MATERIAL.shear_modulus * interference / RADIUS
    # an error of (pi / 64)^2 for linear, of pi / 64 for constant elements, the same at every node
    np.testing.assert_allclose(pressure, expected, rtol=tolerance)


def test_a_pushed_pin_separates_from_the_other_side_and_the_plate_carries_it() -> None:
    mesh = discretise(ExteriorOf(Disk(RADIUS)).outline(), n_elements=64)
    elastic = GalerkinElasticity(mesh, MATERIAL)
    body = condense(elastic, [], contact_along_normals(elastic.displacement_space, np.arange(64)), np.zeros((64, 2)))
    nodes = body.nodes
    gap = RigidCircle((1e-3, 0.0), RADIUS).gap(nodes.points, nodes.directions)
    solution = solve(ContactProblem(body, gap, Frictionless()), SemismoothNewton())
    traction = np.einsum("nk,nkc->nc", solution.state.traction, nodes.frame)
    force = nodes.weights @ traction
    assert force[0] > 1e-4  # pushed along x, without anything else to balance it
    assert abs(force[1]) < 1e-12
    assert not solution.state.traction[nodes.points[:, 0] < -0.5 * RADIUS].any()
