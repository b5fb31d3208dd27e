"""Bodies turned and shifted: points, vectors, meshes and curves."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bemkit import Disk, InputError, Placement, discretise
from bemkit.errors import GeometryError
from bemkit.testing import check_curve

ANGLES = st.floats(-720.0, 720.0)
LENGTHS = st.floats(-10.0, 10.0)
PLACEMENTS = st.builds(Placement, st.tuples(LENGTHS, LENGTHS), ANGLES)


@given(PLACEMENTS)
def test_points_come_back(placement: Placement) -> None:
    points = np.array([[0.0, 0.0], [1.0, 0.0], [-2.0, 3.5]])
    np.testing.assert_allclose(placement.back(placement.forward(points)), points, atol=1e-13)  # coordinates up to 15
    lengths = np.hypot(*placement.turned(points).T)
    np.testing.assert_allclose(lengths, np.hypot(*points.T), rtol=1e-14)


@given(PLACEMENTS, PLACEMENTS)
def test_one_motion_after_another(first: Placement, second: Placement) -> None:
    points = np.array([[0.3, -0.7], [2.0, 1.0]])
    np.testing.assert_allclose(
        second.after(first).forward(points),
        second.forward(first.forward(points)),
        atol=1e-12,  # angles up to 1440
    )


@pytest.mark.parametrize(("turn", "expected"), [(0.0, (1, 0)), (90.0, (0, 1)), (-180.0, (-1, 0)), (630.0, (0, -1))])
def test_quarter_turns_are_exact(turn: float, expected: tuple[int, int]) -> None:
    assert Placement(turn=turn).turned(np.array([1.0, 0.0])).tolist() == list(expected)


def test_a_mesh_is_moved_with_its_curves_and_parts() -> None:
    mesh = discretise(Disk(2.0).outline(), n_elements=12)
    placement = Placement((3.0, -1.0), 30.0)
    moved = placement.mesh(mesh)
    elements, xi = np.arange(12), np.array([-0.3, 0.8])
    np.testing.assert_allclose(moved.points(elements, xi), placement.forward(mesh.points(elements, xi)), atol=1e-14)
    np.testing.assert_allclose(
        moved.normals_at(elements, xi), placement.turned(mesh.normals_at(elements, xi)), atol=1e-14
    )
    assert moved.area == pytest.approx(mesh.area, rel=1e-13)
    assert Placement().mesh(mesh) is mesh
    check_curve(moved.curves[0])


def test_wrong_numbers_are_named() -> None:
    with pytest.raises(InputError, match="turn is nan: give a finite angle in degrees"):
        Placement(turn=float("nan"))
    with pytest.raises(GeometryError, match="Placement: shift"):
        Placement((float("inf"), 0.0))
