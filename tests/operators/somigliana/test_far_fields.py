"""Fields from series of clusters of elements: those of all pairs of points and elements."""

from __future__ import annotations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from bemkit.arrays import FloatArray
from bemkit.geometry import BoundaryMesh, Rectangle, discretise
from bemkit.geometry.spaces import ConstantSpace, LinearSpace, QuadraticSpace, dof_points
from bemkit.operators.material import Material
from bemkit.operators.somigliana.fields import InteriorFields
from tests.geometry.proximity.test_location import SHAPES

SPACES = (ConstantSpace, LinearSpace, QuadraticSpace)


def fields_of(mesh: BoundaryMesh, degree: int, poisson_ratio: float) -> InteriorFields:
    """Data that vary smoothly, with a rigid motion three times as large."""
    space, tractions = SPACES[degree](mesh), ConstantSpace(mesh)
    x, y = dof_points(space), dof_points(tractions)
    u = np.column_stack([np.sin(x[:, 0] + 2.0 * x[:, 1]) + 3.0, np.cos(1.0 - 2.0 * x[:, 0] * x[:, 1])])
    t = np.column_stack([np.sin(3.0 * y[:, 0]), y[:, 1]])
    return InteriorFields(mesh, Material(2.0, poisson_ratio), space, u, tractions, t)


def points_of(fields: InteriorFields, seed: int, n: int) -> FloatArray:
    """Points all over the body and in distances of ten to a hundredth of an element length from its boundary."""
    rng, mesh = np.random.default_rng(seed), fields.mesh
    low, size = mesh.nodes.min(axis=0) - 1.0 * mesh.is_exterior, np.ptp(mesh.nodes, axis=0) + 2.0 * mesh.is_exterior
    elements, xi = rng.integers(0, mesh.n_elements, n), np.array([rng.uniform(-0.8, 0.8)])
    depth = 10.0 ** rng.uniform(-2.0, 1.0, (n, 1)) * mesh.lengths[elements, None]
    beside = mesh.points(elements, xi)[:, 0] - depth * mesh.normals_at(elements, xi)[:, 0]
    points = np.concatenate([low + size * rng.random((n, 2)), beside])
    return points[fields.is_inside(points)]


@settings(max_examples=settings.default.max_examples // 12)
@given(
    name=st.sampled_from(sorted(SHAPES)),
    degree=st.integers(0, 2),
    poisson_ratio=st.sampled_from([-0.5, 0.3, 0.5]),
    n_elements=st.integers(301, 500),
    seed=st.integers(0, 1000),
)
def test_fields_are_those_of_all_pairs(
    name: str, degree: int, poisson_ratio: float, n_elements: int, seed: int
) -> None:
    fields = fields_of(discretise(SHAPES[name].outline(), n_elements=n_elements), degree, poisson_ratio)
    points = points_of(fields, seed, 40)
    few = np.array_split(points, 4)
    kinds = fields.displacement, fields.displacement_gradient, fields.stress
    exact = [np.concatenate([kind(each) for each in few]) for kind in kinds]
    assert "_far" not in vars(fields)
    found = [kind(points) for kind in kinds]
    assert "_far" in vars(fields)
    for one, other in zip(found, exact, strict=True):
        size = np.abs(other).reshape(len(points), -1).max(axis=1)
        # 1e-13 of each cluster, and the round-off of displacements over the shortest element
        assert (np.abs(one - other).reshape(len(points), -1).max(axis=1) < 1e-11 * (size + size.mean())).all()


def test_many_points_of_many_elements_take_series_and_few_do_not() -> None:
    fields = fields_of(discretise(Rectangle(2.0, 1.0).outline(), n_elements=600), 1, 0.3)
    points = np.random.default_rng(0).uniform(0.1, 0.9, (100, 2))
    fields.stress(points[:20])
    assert "_far" not in vars(fields)
    fields.stress(points)
    assert "_far" in vars(fields)
