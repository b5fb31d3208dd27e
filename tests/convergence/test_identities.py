"""Identities of the operators on an ellipse, with observed order: K V = V K', V W = 1/4 - K^2, W V = 1/4 - K'^2."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from bemkit.arrays import FloatArray
from bemkit.geometry import BoundaryMesh, ExteriorOf, Outline, ParametricCurve, Side, discretise
from bemkit.geometry.spaces import BoundarySpace, LinearSpace, QuadraticSpace, dof_points
from bemkit.operators.boundary import assemble, double_layer, hypersingular, mass, single_layer
from bemkit.operators.material import Material
from tests.convergence.fields import observed_order
from tests.slow import slow_except


class Ellipse:
    """An ellipse with the half axes 2 and 1."""

    def outline(self) -> Outline:
        curve = ParametricCurve(
            lambda p: np.column_stack([2 * np.cos(2 * np.pi * p), np.sin(2 * np.pi * p)]),
            lambda p: 2 * np.pi * np.column_stack([-2 * np.sin(2 * np.pi * p), np.cos(2 * np.pi * p)]),
        )
        return Outline(((Side("rim", curve),),))


def residuals(mesh: BoundaryMesh, make_space: Callable[[BoundaryMesh], BoundarySpace]) -> FloatArray:
    """Return the residuals of the three identities for a smooth density, in the mean, relative."""
    space = make_space(mesh)
    material = Material(1.0, 0.3)
    operators = [
        single_layer(space, space, material),
        double_layer(space, space, material),
        hypersingular(space, space, material),
    ]
    assemble(*operators)
    identity = mass(space, space).matrix().toarray()
    single, double, hyper = (np.linalg.solve(identity, operator.matrix()) for operator in operators)
    adjoint = np.linalg.solve(identity, operators[1].matrix().T)
    x, y = dof_points(space).T
    density = np.column_stack([np.sin(x) + y, np.cos(2 * y) * x]).ravel()
    quarter = 0.25 * density
    pairs = [
        (double @ (single @ density), single @ (adjoint @ density)),
        (single @ (hyper @ density), quarter - double @ (double @ density)),
        (hyper @ (single @ density), quarter - adjoint @ (adjoint @ density)),
    ]

    def size(values: FloatArray) -> float:
        return float(np.sqrt(values @ identity @ values))

    return np.array([size(one - other) / size(one) for one, other in pairs])


@pytest.mark.parametrize(
    ("make_space", "orders", "ceiling", "is_exterior"),
    slow_except(
        [
            (LinearSpace, (4, 3, 3), 1e-4, False),
            (LinearSpace, (4, 3, 3), 1e-4, True),
            (QuadraticSpace, (3, 3, 3), 1e-4, False),
            (QuadraticSpace, (3, 3, 3), 1e-4, True),
        ],
        (LinearSpace, (4, 3, 3), 1e-4, True),
    ),
)
def test_identities(
    make_space: Callable[[BoundaryMesh], BoundarySpace], orders: tuple[int, ...], ceiling: float, is_exterior: bool
) -> None:
    shape = ExteriorOf(Ellipse()) if is_exterior else Ellipse()
    errors = [residuals(discretise(shape.outline(), n_elements=n), make_space) for n in (48, 96, 192)]
    assert errors[-1].max() < ceiling
    # nodal values on equal elements of a smooth closed curve: linear functions gain an order over their theory, 2
    np.testing.assert_allclose([observed_order([error[k] for error in errors]) for k in range(3)], orders, atol=0.25)
