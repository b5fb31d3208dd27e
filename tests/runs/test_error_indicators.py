"""The error estimate against true errors, on problems with known answers."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from itertools import product

import numpy as np
import pytest

import bemkit as bk
from bemkit.geometry.spaces import LinearSpace, QuadraticSpace
from bemkit.results.error_indicators import element_errors, ky_fan_distance
from tests.scenes import angle, disc, paper, true_error, wavy
from tests.slow import slow_except

PROBLEMS: dict[str, Callable[[], bk.Scene]] = {
    "paper-1": lambda: paper(1),
    "paper-2": lambda: paper(2),
    "wavy": wavy,
    "disc": disc,
    "L": angle,
}
ELEMENTS = {"linear": bk.Galerkin(1), "quadratic": bk.Galerkin(2)}


@pytest.mark.parametrize(
    ("problem", "word"),
    slow_except(
        product(PROBLEMS, ELEMENTS),
        ("L", "linear"),
    ),
)
@pytest.mark.parametrize("exponent", slow_except((1.0, 2.0), 2.0))
def test_effectivity(problem: str, word: str, exponent: float) -> None:
    mesh = bk.MeshOptions(elements=48, grading=bk.Algebraic(exponent))
    scene = dataclasses.replace(PROBLEMS[problem](), discretisation=ELEMENTS[word], mesh=mesh)
    solution = bk.run(scene)
    assert solution.estimated_error is not None
    effectivity = solution.estimated_error / true_error(solution)
    assert 0.3 <= effectivity <= 5.0


@pytest.mark.slow
@pytest.mark.parametrize("word", ELEMENTS)
def test_effectivity_of_adapted_meshes(word: str) -> None:
    scene = paper(1, ELEMENTS[word], bk.MeshOptions(accuracy=4e-3))
    solution = bk.run(scene)
    assert solution.estimated_error is not None
    assert 0.3 <= solution.estimated_error / true_error(solution, 1) <= 5.0


@pytest.mark.parametrize("space", [LinearSpace, QuadraticSpace])
def test_what_the_space_holds_has_no_error(space: type[LinearSpace]) -> None:
    mesh = bk.discretise(bk.Rectangle(2.0, 1.0).outline(), n_elements=30, grading=bk.Algebraic(2.0))
    functions = space(mesh)
    points = np.empty((functions.n_dofs // 2, 2))
    points[functions.element_dofs] = mesh.points(np.arange(30), functions.local_nodes)
    linear = points @ np.array([[1.0, 0.3], [-0.2, 0.5]])
    # round-off of differences over the shortest elements, which are 1e-2 long
    assert element_errors(functions, linear, 1.0).sum() < 1e-24


def test_the_estimate_scales_with_stiffness_and_squared_displacement() -> None:
    mesh = bk.discretise(bk.Rectangle(2.0, 1.0).outline(), n_elements=30)
    displacement = np.sin(3.0 * mesh.nodes)
    once = element_errors(LinearSpace(mesh), displacement, 2.0)
    assert once.min() >= 0.0
    assert once.max() > 0.0
    np.testing.assert_allclose(element_errors(LinearSpace(mesh), 3.0 * displacement, 4.0), 18.0 * once, rtol=1e-12)


def test_collocation_has_no_estimate() -> None:
    solution = bk.run(dataclasses.replace(bk.load_scene("paper-1"), mesh=bk.MeshOptions(elements=40)))
    assert solution.body.element_errors is None
    assert solution.summary()["estimated_error"] is None


def test_a_body_at_rest_has_no_error() -> None:
    parts = (
        bk.Part("floor", bk.Contact(bk.RigidHalfPlane()), sides=("bottom",)),
        bk.Part("lid", bk.Clamped(), sides=("top",)),
    )
    scene = bk.Scene(
        title="rest", shape=bk.Rectangle(1.0, 1.0), material=bk.Material(1.0, 0.3), parts=parts,
        mesh=bk.MeshOptions(elements=12),
    )  # fmt: skip
    assert bk.run(scene).estimated_error == 0.0


@pytest.mark.parametrize("degree", slow_except([1, 2, 6], 1))
@pytest.mark.parametrize("motion", [(0.0, 1e-3), (0.3, 1.0)])
def test_a_body_that_only_moves_as_a_whole_has_no_error(degree: int, motion: tuple[float, float]) -> None:
    parts = (
        bk.Part("floor", bk.Contact(bk.RigidHalfPlane((0.0, 2.0))), sides=("bottom",)),
        bk.Part("lid", bk.PrescribedDisplacement(*motion), sides=("top",)),
    )
    scene = bk.Scene(
        title="lifted", shape=bk.Rectangle(1.0, 1.0, (3.0, 2.0)), material=bk.Material(2e11, 0.3), parts=parts,
        discretisation=bk.Galerkin(degree), mesh=bk.MeshOptions(elements=24),
    )  # fmt: skip
    solution = bk.run(scene)
    assert abs(solution.energy) < 1e-6 * 2e11 * motion[1] ** 2  # of round-off, by which an error must not be measured
    assert solution.estimated_error == 0.0
    assert not solution.warnings
    pressed = dataclasses.replace(scene, parts=(parts[0], bk.Part("lid", bk.PrescribedDisplacement(y=-1e-9), ("top",))))
    assert bk.run(pressed).estimated_error > 0.0


def test_an_accuracy_needs_no_finer_mesh_for_a_body_that_only_moves_as_a_whole() -> None:
    parts = (
        bk.Part("floor", bk.Contact(bk.RigidHalfPlane()), sides=("bottom",)),
        bk.Part("lid", bk.PrescribedDisplacement(x=0.002, y=bk.Expression("0.01 + 0.06 * x")), sides=("top",)),
    )
    scene = bk.Scene(
        title="lifted", shape=bk.Rectangle(1.0, 0.7), material=bk.Material(100.0, 0.3), parts=parts,
        mesh=bk.MeshOptions(accuracy=0.02, most_elements=100),
    )  # fmt: skip
    solution = bk.run(scene)
    assert solution.is_converged, solution.message
    assert solution.estimated_error == 0.0


def test_a_graded_mesh_of_a_body_that_turns_has_no_error() -> None:
    """Round-off of displacements is strain over the shortest elements, and grows with the number of elements."""
    lid = bk.PrescribedDisplacement(x=0.002, y=bk.Expression("-0.01 + 0.06 * x"))
    scene = bk.Scene(
        title="turned", shape=bk.Rectangle(1.0, 0.7, (1.0, 1.0)), material=bk.Material(100.0, 0.3),
        parts=(bk.Part("lid", lid, sides=("top",)),), discretisation=bk.Galerkin(2),
        mesh=bk.MeshOptions(elements=400, grading=bk.Geometric(levels=20)),
    )  # fmt: skip
    solution = bk.run(scene)
    assert solution.is_converged, solution.message  # though its reactions, round-off, are not in equilibrium
    assert solution.estimated_error == 0.0


def test_the_largest_error_leaves_out_an_equally_small_share() -> None:
    lengths = np.array([0.5, 0.3, 0.19, 0.01])
    assert ky_fan_distance(np.array([0.1, 0.2, 0.15, 0.05]), lengths) == 0.2
    assert ky_fan_distance(np.array([0.1, 0.2, 0.15, 9.0]), lengths) == 0.2  # a hundredth may be as wrong as it is
    assert ky_fan_distance(np.array([0.1, 0.02, 9.0, 9.0]), lengths) == pytest.approx(0.2)
    # elements without tractions have no error, and are not shares of anything
    assert ky_fan_distance(np.array([0.0, 0.0, 0.1, 9.0]), lengths) == 0.1
    assert ky_fan_distance(np.zeros(4), lengths) == 0.0
