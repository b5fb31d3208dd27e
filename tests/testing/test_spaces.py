"""All spaces and curves conform, and broken ones are caught."""

from __future__ import annotations

import inspect
from dataclasses import dataclass, field
from types import ModuleType
from typing import Any

import numpy as np
import pytest

from bemkit.geometry import Arc, Disk, ParametricCurve, PlateWithHole, Polygon, Segment, curves, discretise, spaces
from bemkit.geometry.curves import TransformedCurve
from bemkit.geometry.mesh import BoundaryMesh
from bemkit.geometry.neighbours import corner_nodes
from bemkit.geometry.spaces import ConstantSpace, ElementwiseSpace, LagrangeSpace, LinearSpace, QuadraticSpace
from bemkit.testing import CheckFailed, check_curve, check_space

MESHES = [
    discretise(PlateWithHole(2.0, 1.0, 0.3).outline(), n_elements=24),
    discretise(Polygon(((5.0, 0.0), (6.0, 0.0), (5.3, 0.8))).outline(), n_elements=7),
]
CURVES = [
    Segment((0.0, 1.0), (2.0, 1e3)),
    Arc((3.0, 1.0), 2.0, 1.0, -2.0),
    ParametricCurve(lambda s: np.column_stack([s, np.exp(s)]), lambda s: np.column_stack([np.ones_like(s), np.exp(s)])),
    TransformedCurve(Segment((0.0, 0.0), (1.0, 2.0)), (3.0, 3.0), ((2.0, 0.0), (0.0, 2.0)), is_reversed=True),
]


def spaces_on(mesh: BoundaryMesh) -> list[Any]:
    corners = corner_nodes(mesh)
    return [
        ConstantSpace(mesh),
        LinearSpace(mesh),
        LinearSpace(mesh, corners),
        QuadraticSpace(mesh),
        QuadraticSpace(mesh, corners),
        QuadraticSpace(mesh, np.zeros(mesh.n_nodes, bool)),
        ElementwiseSpace(QuadraticSpace(mesh)),
        *(LagrangeSpace(mesh, degree=degree) for degree in (3, 8, 12)),
        LagrangeSpace(mesh, corners, degree=5),
    ]


def public_classes(module: ModuleType, member: str) -> set[type]:
    """Concrete public classes of a module that have a member."""
    return {
        value
        for name, value in vars(module).items()
        if inspect.isclass(value)
        and value.__module__ == module.__name__
        and not name.startswith("_")
        and hasattr(value, member)
        and not inspect.isabstract(value)
        and not getattr(value, "_is_protocol", False)
    }


@pytest.mark.parametrize("mesh", MESHES, ids=["plate", "triangle"])
@pytest.mark.parametrize("number", range(7))
def test_spaces_conform(mesh: BoundaryMesh, number: int) -> None:
    check_space(spaces_on(mesh)[number])


@pytest.mark.parametrize("shape", CURVES, ids=lambda curve: type(curve).__name__)
def test_curves_conform(shape: curves.Curve) -> None:
    check_curve(shape)


def test_every_public_space_and_curve_is_checked() -> None:
    assert public_classes(spaces, "basis") == {type(one) for one in spaces_on(MESHES[0])}
    assert public_classes(curves, "derivative") == {type(one) for one in CURVES}


@dataclass
class Broken:
    """A linear space of which single members can be replaced."""

    changes: dict[str, Any] = field(default_factory=dict)

    def __getattr__(self, name: str) -> Any:
        value = self.changes.get(name, getattr(LinearSpace(MESHES[0]), name))
        return value


LINEAR = LinearSpace(MESHES[0])
DOFS = LINEAR.element_dofs
SWAPPED = DOFS.copy()
SWAPPED[3] = SWAPPED[3, ::-1]
ROLLED = np.column_stack([DOFS[:, 0], np.roll(DOFS[:, 1], 1)])
DOUBLED = DOFS.copy()
DOUBLED[2, 0] = DOUBLED[1, 0]


def spoilt(xi: np.ndarray) -> np.ndarray:
    xi *= 1.0
    xi += 0.125
    return LINEAR.basis(xi)


def averaging(xi: np.ndarray) -> np.ndarray:
    return LINEAR.basis(xi if xi.size == 2 else xi - xi.mean())


@pytest.mark.parametrize(
    ("changes", "complaint"),
    [
        ({"mesh": None}, "mesh is a NoneType, not a BoundaryMesh"),
        ({"degree": 1.0}, "degree is 1.0, not an int"),
        ({"degree": 2}, "degree is 2, but no basis function reaches it"),
        ({"degree": 0}, "does not consist of polynomials of degree 0: it misses them by"),
        ({"is_continuous": 1}, "is_continuous is 1, not a bool"),
        ({"is_continuous": False}, "says it is not continuous, but none of its functions jumps"),
        ({"n_dofs": 50}, "n_dofs is 50, but"),
        ({"n_dofs": 46}, "n_dofs is 46, but element_dofs runs from 0 to 23"),
        ({"element_dofs": DOFS[:, :1]}, r"element_dofs has the shape \(24, 1\), not \(24, 2\)"),
        ({"element_dofs": DOFS.astype(float)}, "element_dofs holds float64, not integers"),
        ({"element_dofs": DOUBLED}, r"element_dofs repeats dof \d+ in its column 0"),
        ({"element_dofs": ROLLED}, "element_dofs repeats a dof in element"),
        ({"element_dofs": SWAPPED}, "element_dofs repeats dof|shared with an element where it is the value at another"),
        ({"local_nodes": np.array([-2.0, 1.0])}, r"local_nodes leaves \[-1, 1\]"),
        ({"local_nodes": np.array([1.0, -1.0])}, "basis at local_nodes is not the identity: it misses by 1"),
        ({"basis": lambda xi: LINEAR.basis(xi).T}, r"basis returns the shape \(7, 2\) for 7 points, not \(2, 7\)"),
        ({"basis": lambda xi: LINEAR.basis(xi) / 0.0}, "basis is not finite"),
        ({"basis": lambda xi: 2.0 * LINEAR.basis(xi)}, "basis at local_nodes is not the identity"),
        ({"basis": lambda xi: np.abs(LINEAR.basis(xi)) ** 1.5}, "does not contain constants"),
        ({"basis": spoilt}, "basis changes its argument"),
        ({"basis": averaging}, "basis at one point depends on the others"),
        ({"basis": lambda xi: LINEAR.basis(xi) + np.random.default_rng().normal()}, "gives two answers"),
    ],
)
@pytest.mark.filterwarnings("ignore:divide by zero:RuntimeWarning")
@pytest.mark.filterwarnings("ignore:invalid value:RuntimeWarning")
def test_broken_spaces_are_caught(changes: dict[str, Any], complaint: str) -> None:
    with pytest.raises(CheckFailed, match=complaint):
        check_space(Broken(changes))


def test_a_space_that_jumps_is_caught() -> None:
    jumping = LinearSpace(MESHES[0], corner_nodes(MESHES[0]))
    changes = {name: getattr(jumping, name) for name in ("element_dofs", "n_dofs")}
    with pytest.raises(CheckFailed, match=r"says it is continuous, but jumps by [\d.]+ at node"):
        check_space(Broken(changes))


def test_dofs_shared_at_different_points_are_caught() -> None:
    # constants whose dof belongs to two elements at once
    mesh = discretise(Disk(1.0).outline(), n_elements=8)
    ends = np.column_stack([np.arange(8), (np.arange(8) + 2) % 8])
    with pytest.raises(CheckFailed, match=r"value at another point, [\d.]+ away"):
        check_space(Broken({"mesh": mesh, "element_dofs": ends, "n_dofs": 16}))


@dataclass
class BrokenCurve:
    changes: dict[str, Any]

    def __getattr__(self, name: str) -> Any:
        return self.changes.get(name, getattr(ARC, name))


ARC = Arc((3.0, 1.0), 2.0, 0.0, 1.0)


def shifted(s: np.ndarray) -> np.ndarray:
    s *= 0.5
    return ARC.point(s)


def named(name: str, function: Any) -> dict[str, Any]:
    function.__name__ = name
    return {name: function}


@pytest.mark.parametrize(
    ("changes", "complaint"),
    [
        ({"is_straight": 0}, "is_straight is 0, not a bool"),
        ({"is_straight": True}, r"says it is straight, but strays by 0.\d+ at s"),
        (
            named("point", lambda s: ARC.point(s).T),
            r"BrokenCurve.point returns the shape \(2, 42\) for .*, not \(42, 2\)",
        ),
        (named("point", lambda s: ARC.point(s) * np.nan), "point is not finite"),
        (named("point", shifted), "point changes its argument"),
        (named("point", lambda s: ARC.point(s - s.mean())), "point at one parameter depends on the others"),
        (named("point", lambda s: ARC.point(s) + np.random.default_rng().normal()), "point gives two answers"),
        (named("derivative", lambda s: ARC.derivative(s) * s[:, None]), "derivative vanishes at s = 0"),
        (named("derivative", lambda s: -ARC.derivative(s)), "differences of point give"),
        (named("derivative", lambda s: 1.001 * ARC.derivative(s)), "differences of point give"),
    ],
)
def test_broken_curves_are_caught(changes: dict[str, Any], complaint: str) -> None:
    with pytest.raises(CheckFailed, match=complaint):
        check_curve(BrokenCurve(changes))
