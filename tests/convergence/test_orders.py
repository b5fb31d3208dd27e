"""Orders of convergence: of smooth fields, at corners, on graded and on adapted meshes; slopes from both sides."""

from __future__ import annotations

import dataclasses
from functools import lru_cache
from typing import Any

import numpy as np
import pytest

import bemkit as bk
from bemkit.arrays import FloatArray
from bemkit.reference import find_reference
from bemkit.runs.adaptive import run_adaptive
from tests.scenes import angle, contact_error, paper, reference_values
from tests.slow import slow_except

ELEMENTS: dict[str, Any] = {"linear": bk.Galerkin(1), "quadratic": bk.Galerkin(2)}


def slope(sizes: list[int], errors: list[float]) -> float:
    """Order of the last three meshes, by least squares."""
    return float(-np.polyfit(np.log(sizes[-3:]), np.log(errors[-3:]), 1)[0])


@lru_cache
def energy_of_the_angle() -> float:
    """Energy of the L on a mesh whose estimated error is 3e-4: the energy is wrong by less than 1e-6."""
    scene = dataclasses.replace(angle(), mesh=bk.MeshOptions(accuracy=3e-4))
    return bk.run(scene).energy


@pytest.mark.slow
@pytest.mark.parametrize(
    ("word", "exponent", "order", "ceiling"),
    [
        # limited by the corners: 1.1 in the end, not yet reached
        ("linear", 1.0, (1.4, 2.2), 4e-4),
        ("linear", 3.0, (2.7, 3.3), 3e-5),  # that of smooth solutions: 3
        ("quadratic", 1.0, (1.0, 1.8), 6e-5),  # limited by the corners
    ],
)
def test_energy_of_a_clamped_angle(word: str, exponent: float, order: tuple[float, float], ceiling: float) -> None:
    sizes, errors = [40, 80, 160, 320], []
    for n_elements in sizes:
        options = bk.MeshOptions(elements=n_elements, grading=bk.Algebraic(exponent))
        solution = bk.run(dataclasses.replace(angle(), discretisation=ELEMENTS[word], mesh=options))
        errors.append(abs(solution.energy / energy_of_the_angle() - 1.0))
    assert order[0] <= slope(sizes, errors) <= order[1]
    assert errors[-1] <= ceiling


@pytest.mark.slow
@pytest.mark.parametrize("example", [1, 2])
@pytest.mark.parametrize(
    ("word", "accuracy", "energy_order", "traction_order"),
    # orders of smooth solutions: 3 and 5 in the energy, 1.5 and 2 in the tractions; these are seen on short sequences,
    # in which errors fall faster while meshes find the points where the status changes
    [("linear", 8e-4, (2.5, 5.5), (1.4, 3.5)), ("quadratic", 1e-4, (3.0, 7.0), (1.7, 6.5))],
)
def test_adapted_meshes_keep_the_orders_of_smooth_solutions(
    example: int, word: str, accuracy: float, energy_order: tuple[float, float], traction_order: tuple[float, float]
) -> None:
    solutions = run_adaptive(paper(example, ELEMENTS[word], bk.MeshOptions(accuracy=accuracy)))
    reference = find_reference(bk.load_scene(f"paper-{example}"))  # energies to 1e-11; those of finite elements to 3e-8
    assert reference is not None
    sizes = [solution.mesh.n_elements for solution in solutions]
    energies = [abs(solution.energy / reference.answer.energy - 1.0) for solution in solutions]
    tractions = [contact_error(solution, example, "sigma_n", "sigma_t") for solution in solutions]
    assert energy_order[0] <= slope(sizes, energies) <= energy_order[1]
    assert traction_order[0] <= slope(sizes, tractions) <= traction_order[1]


def bending(points: FloatArray) -> FloatArray:
    """Displacement of pure bending, sigma_xx = c y with E' = 1, nu = 0.3 and c = 1."""
    x, y = points.T
    return np.stack([x * y, -0.5 * (x**2 + 0.3 / 0.7 * y**2)], axis=1)


@pytest.mark.parametrize("exponent", [1.0, 3.0])
def test_quadratic_displacements_hold_pure_bending_exactly(exponent: float) -> None:
    material = bk.Material(1.0 - 0.3**2, 0.3)
    load = bk.Traction(x=bk.Expression("y"))
    scene = bk.Scene(
        title="bending",
        shape=bk.Rectangle(2.0, 1.0, (0.0, -0.5)),
        material=material,
        parts=(
            bk.Part("floor", bk.Contact(bk.Gap(9.0)), sides=("bottom",)),
            bk.Part("end", load, sides=("right",)),
            bk.Part(
                "wall",
                bk.PrescribedDisplacement(x=0.0, y=bk.Expression("-0.5 * 0.3 / 0.7 * y**2")),
                sides=("left",),
            ),
        ),
        discretisation=bk.Galerkin(2),
        mesh=bk.MeshOptions(elements=24, grading=bk.Algebraic(exponent)),
    )
    solution = bk.run(scene)
    expected = bending(solution.boundary.points)
    # round-off times the condition of the graded mesh
    np.testing.assert_allclose(solution.boundary.displacement, expected, rtol=0.0, atol=1e-10)
    assert solution.energy == pytest.approx(2.0 / 12.0 / 2.0, rel=1e-10)
    assert solution.estimated_error is not None
    assert solution.estimated_error < 1e-9


def test_quadratic_elements_pass_the_contact_patch_test() -> None:
    # nu = 0: a block shortened by 1e-3 of its height presses with E times that everywhere
    scene = bk.Scene(
        title="patch",
        shape=bk.Rectangle(2.0, 1.0),
        material=bk.Material(5.0, 0.0),
        law=bk.Coulomb(0.3),
        parts=(
            bk.Part("floor", bk.Contact(bk.RigidHalfPlane()), sides=("bottom",)),
            bk.Part("lid", bk.PrescribedDisplacement(y=-1e-3), sides=("top",)),
            bk.Part("wall", bk.Roller(), sides=("left",)),
        ),
        discretisation=bk.Galerkin(2),
        mesh=bk.MeshOptions(elements=26, grading=bk.Algebraic(2.0)),
    )
    contact = bk.run(scene).contact
    np.testing.assert_allclose(contact.sigma_n, -5e-3, rtol=1e-9)
    np.testing.assert_allclose(contact.sigma_t, 0.0, atol=1e-11)


@pytest.mark.parametrize("example", slow_except([1, 2], 1))
def test_uniform_quadratic_elements_beat_linear_ones(example: int) -> None:
    errors = {}
    for word, elements in ELEMENTS.items():
        solution = bk.run(paper(example, elements, bk.MeshOptions(elements=160)))
        values, _ = reference_values(example)
        assert solution.force_tangential == pytest.approx(values["Ft"], rel=1e-2)
        errors[word] = contact_error(solution, example, "sigma_n")
    assert errors["quadratic"] <= 0.7 * errors["linear"]
    assert errors["quadratic"] <= 1e-2
