"""The statements of a scene: conditions evaluate, and constructors check."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable

import numpy as np
import pytest

from bemkit.contact.obstacle import RigidHalfPlane
from bemkit.errors import GeometryError
from bemkit.formulas import Expression
from bemkit.geometry.shapes import Polygon, Rectangle
from bemkit.operators.material import Material
from bemkit.scene.conditions import Clamped, Contact, Part, PrescribedDisplacement, Pressure, Roller, Traction
from bemkit.scene.discretisation import MeshOptions
from bemkit.scene.scene import Scene

FOUNDATION = Part("foundation", Contact(RigidHalfPlane()), ("bottom",))


def scene(**changes: object) -> Scene:
    given = {"title": "t", "shape": Rectangle(1.0, 1.0), "material": Material(1.0, 0.3), "parts": (FOUNDATION,)}
    return Scene(**{**given, **changes})  # type: ignore[arg-type]


def test_traction_has_the_directions_x_and_y() -> None:
    points, normals = np.array([[2.0, 3.0]]), np.array([[0.0, 1.0]])
    np.testing.assert_array_equal(Traction(Expression("x * y"), -1.0).at(points, normals), [[6.0, -1.0]])


@pytest.mark.parametrize(
    ("normal", "expected"),
    [((0.0, -1.0), (0.5, 2.0)), ((1.0, 0.0), (-2.0, 0.5)), ((0.0, 1.0), (-0.5, -2.0)), ((-1.0, 0.0), (2.0, -0.5))],
)
def test_pressure_pushes_inwards_and_shear_runs_anticlockwise(
    normal: tuple[float, float], expected: tuple[float, float]
) -> None:
    # bottom, right, top, left of a square: anticlockwise means to the right, up, to the left, down
    traction = Pressure(2.0, 0.5).at(np.zeros((1, 2)), np.array([normal]))
    np.testing.assert_allclose(traction, [expected], atol=1e-15)


def test_a_displacement_component_that_is_left_out_is_free() -> None:
    condition = PrescribedDisplacement(y=Expression("-0.1 * x"))
    assert condition.is_prescribed == (False, True)
    np.testing.assert_allclose(condition.at(np.array([[2.0, 0.0]])), [[0.0, -0.2]], rtol=1e-15)


def test_the_mesh_has_the_parts_of_the_scene() -> None:
    top = Part("load", Traction(y=-1.0), ("top",), Expression("x > 0.3"))
    mesh = scene(parts=(FOUNDATION, top), mesh=MeshOptions(40)).build_mesh()
    assert mesh.n_elements == 40
    assert set(mesh.parts) == {"foundation", "load"}
    # the end of a part is a mesh node, to round-off
    assert mesh.lengths[mesh.part("load")].sum() == pytest.approx(0.7, rel=1e-12)


def test_overlapping_parts_are_found_when_the_boundary_is_divided() -> None:
    again = Part("roller", Roller(), ("bottom",), Expression("x > 0.5"))
    with pytest.raises(GeometryError, match=r"foundation.*roller|roller.*foundation"):
        scene(parts=(FOUNDATION, again)).build_mesh()


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: scene(title=""), "title is ''"),
        (lambda: scene(title="two\nlines"), "title is"),
        (lambda: scene(parts=(FOUNDATION, FOUNDATION)), "'foundation' is the name of two parts"),
        (lambda: scene(parts=(dataclasses.replace(FOUNDATION, sides=("floor",)),)), "unknown side 'floor'.*bottom"),
        (lambda: scene(shape=Polygon(((0.0, 0.0), (0.0, 1.0), (1.0, 0.0)))), "anticlockwise"),
        (lambda: Part("", Clamped()), "part name ''"),
        (lambda: Part("a\x1b", Clamped()), "part name"),
        (lambda: Part("a", Clamped(), where=Expression("x")), "where is 'x', which is a number"),
        (lambda: PrescribedDisplacement(), "neither x nor y"),
        (lambda: Traction(x=float("nan")), "x = nan is not finite"),
        (lambda: Traction(y=Expression("x > 1")), "y = 'x > 1' is a condition"),
        (lambda: Pressure(float("inf")), "pressure = inf"),
        (lambda: Pressure(1.0, shear="x"), "shear = 'x' is not a number"),
        (lambda: MeshOptions(2), "elements is 2"),
    ],
)
def test_constructors_name_the_argument_its_value_and_the_remedy(make: Callable[[], object], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        make()
