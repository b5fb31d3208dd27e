"""Supports at nodes: frames, fixed directions, corners, conflicts."""

from __future__ import annotations

import numpy as np
import pytest

from bemkit.arrays import FloatArray
from bemkit.geometry import BoundaryMesh, Polygon, Rectangle, Selection, discretise
from bemkit.geometry.spaces import ConstantSpace, LinearSpace
from bemkit.operators.steklov_poincare.nodal_conditions import ConflictingSupportsError, Support, supported


def square() -> BoundaryMesh:
    sides = {name: Selection(sides=(name,)) for name in ("bottom", "right", "top", "left")}
    return discretise(Rectangle(1.0, 1.0).outline(), n_elements=16, parts=sides)


def roller(mesh: BoundaryMesh, part: str) -> Support:
    elements = mesh.part(part)
    return Support(part, elements, mesh.normals[elements][:, None, :])


def clamp(mesh: BoundaryMesh, part: str, value: FloatArray | None = None) -> Support:
    elements = mesh.part(part)
    axes = np.broadcast_to(np.eye(2), (elements.size, 2, 2))
    return Support(part, elements, axes, None if value is None else lambda x: np.broadcast_to(value, x.shape))


def test_roller_fixes_the_normal_and_keeps_the_axes() -> None:
    mesh = square()
    conditions = supported(LinearSpace(mesh), [roller(mesh, "right")])
    on_side = np.isclose(mesh.nodes[:, 0], 1.0)
    np.testing.assert_array_equal(conditions.is_fixed[:, 0], on_side)
    assert not conditions.is_fixed[:, 1].any()
    np.testing.assert_array_equal(conditions.frame, np.broadcast_to(np.eye(2), (16, 2, 2)))
    np.testing.assert_array_equal(conditions.is_free, ~conditions.is_fixed)


def test_two_rollers_fix_their_common_corner_entirely() -> None:
    mesh = square()
    conditions = supported(LinearSpace(mesh), [roller(mesh, "right"), roller(mesh, "bottom")])
    corner = int(np.argmin(np.hypot(*(mesh.nodes - [1.0, 0.0]).T)))
    assert conditions.is_fixed[corner].all()
    assert np.sum(conditions.is_fixed.all(axis=1)) == 1


def test_a_smooth_roller_takes_the_mean_normal_and_a_kinked_one_both() -> None:
    n = 24
    angle = 2 * np.pi * np.arange(n) / n
    circle = Polygon(tuple(zip(np.cos(angle).tolist(), np.sin(angle).tolist(), strict=True)))
    mesh = discretise(circle.outline(), n_elements=n, parts={"all": Selection()})
    conditions = supported(LinearSpace(mesh), [roller(mesh, "all")])
    assert (conditions.is_fixed.sum(axis=1) == 1).all()  # the sides turn by 15 degrees only
    fixed = conditions.frame[conditions.is_fixed]
    np.testing.assert_allclose(np.abs(np.sum(fixed * mesh.nodes, axis=1)), 1.0, rtol=1e-12)
    kinked = discretise(Rectangle(1.0, 1.0).outline(), n_elements=16, parts={"all": Selection()})
    corners = supported(LinearSpace(kinked), [roller(kinked, "all")]).is_fixed.all(axis=1)
    assert corners.sum() == 4


def test_frames_are_orthonormal_and_hold_the_prescribed_value() -> None:
    mesh = discretise(
        Polygon(((0.0, 0.0), (2.0, 0.0), (1.0, 1.0))).outline(), n_elements=12, parts={"slope": Selection(("side-2",))}
    )
    elements = mesh.part("slope")
    normal = mesh.normals[elements[0]]
    support = Support("slope", elements, mesh.normals[elements][:, None, :], lambda x: 0.3 * normal + 0.0 * x)
    conditions = supported(ConstantSpace(mesh), [support])
    np.testing.assert_allclose(
        conditions.frame @ conditions.frame.transpose(0, 2, 1), np.broadcast_to(np.eye(2), (12, 2, 2)), atol=1e-15
    )
    moved = np.einsum("nkc,nk->nc", conditions.frame, conditions.displacement)[elements]
    np.testing.assert_allclose(moved, np.broadcast_to(0.3 * normal, moved.shape), rtol=1e-13)


def test_supports_that_contradict_each_other_name_part_and_point() -> None:
    mesh = square()
    supports = [clamp(mesh, "right", np.array([0.1, 0.0])), clamp(mesh, "top")]
    with pytest.raises(
        ConflictingSupportsError, match=r"part 'right' and a neighbour .* \(1, 1\): give the same displacement"
    ):
        supported(LinearSpace(mesh), supports)
    # element centres are shared by no one
    assert supported(ConstantSpace(mesh), supports).is_fixed.sum() == 16


@pytest.mark.parametrize("space", [ConstantSpace, LinearSpace])
def test_functions_of_given_displacements_are_evaluated_on_their_part_only(
    space: type[ConstantSpace | LinearSpace],
) -> None:
    mesh, seen = square(), []

    def displacement(points: FloatArray) -> FloatArray:
        seen.append(points)
        return np.sqrt(points - [0.0, 1.0])  # undefined below the top

    top = mesh.part("top")
    axes = np.broadcast_to(np.eye(2), (top.size, 2, 2))
    conditions = supported(space(mesh), [Support("top", top, axes, displacement)])
    np.testing.assert_array_equal(np.concatenate(seen)[:, 1], 1.0)
    assert sum(map(len, seen)) == conditions.is_fixed.all(axis=1).sum()
