"""The error estimate where displacements are given: on clamped, displaced and bonded sides."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

import bemkit as bk
from bemkit.geometry.outline import Selection
from bemkit.geometry.spaces import QuadraticSpace, dof_points
from bemkit.operators.rigid_modes import rigid_motions, without_motion
from bemkit.results.error_indicators import blind_elements, element_errors, traction_errors
from bemkit.runs.adaptive import run_adaptive
from tests.runs.truth import cauchy_error
from tests.slow import slow_except

FLOOR = bk.Contact(bk.RigidHalfPlane())
LOAD = bk.Traction(x=bk.Expression("x"), y=-1.0)


def block(
    top: bk.Traction | bk.PrescribedDisplacement, *others: bk.Part, law: bk.FrictionLaw | None = None
) -> bk.Scene:
    parts = (*others, bk.Part("top", top, ("top",)))
    scene = bk.Scene(title="block", shape=bk.Rectangle(2.0, 1.0), material=bk.Material(1.0, 0.3), parts=parts)
    return scene if law is None else dataclasses.replace(scene, law=law)


CLAMPED = bk.Part("foot", bk.Clamped(), ("bottom",))
FOOT = bk.Part("foot", FLOOR, ("bottom",))
SCENES = {
    "clamped": block(LOAD, CLAMPED),
    "displaced": block(bk.PrescribedDisplacement(x=0.001, y=-0.01), CLAMPED),
    "bonded": block(bk.PrescribedDisplacement(x=0.0, y=-0.01), FOOT, law=bk.Coulomb(10.0)),
    "mixed": block(
        bk.PrescribedDisplacement(x=None, y=-0.01), FOOT, bk.Part("wall", bk.Roller(), ("left",)), law=bk.Coulomb(0.3)
    ),
}
ELEMENTS = {"linear": bk.Galerkin(1), "quadratic": bk.Galerkin(2)}


def solved(name: str, word: str, exponent: float = 1.0, n_elements: int = 40) -> bk.Solution:
    mesh = bk.MeshOptions(elements=n_elements, grading=bk.Algebraic(exponent))
    return bk.run(dataclasses.replace(SCENES[name], discretisation=ELEMENTS[word], mesh=mesh))


@pytest.mark.parametrize(
    ("name", "word", "exponent"),
    [
        ("clamped", "linear", 1.0),
        ("displaced", "quadratic", 3.0),
        *[
            pytest.param(name, word, exponent, marks=pytest.mark.slow)
            for name in SCENES
            for word in ELEMENTS
            for exponent in (1.0, 2.0, 3.0)
        ],
    ],
)
def test_effectivity(name: str, word: str, exponent: float) -> None:
    solution = solved(name, word, exponent)
    assert solution.estimated_error is not None
    # 0.6 to 2.1 was measured on these and other blocks and rings of 32 and 64 elements
    assert 0.4 <= solution.estimated_error / cauchy_error(solution) <= 3.0


@pytest.mark.slow
@pytest.mark.parametrize("word", ["linear", pytest.param("quadratic", marks=pytest.mark.slow)])
def test_a_coarse_clamped_side_of_a_fine_mesh_is_seen(word: str) -> None:
    """All elements but those of the foot are cut: displacements know little of the error that is left."""
    mesh = solved("clamped", word, n_elements=24).mesh
    for _ in range(3):
        mesh = mesh.refined(np.flatnonzero(~np.isin(np.arange(mesh.n_elements), mesh.part("foot"))))
    solution = bk.run(solved("clamped", word, n_elements=24).scene, mesh=mesh)
    assert solution.estimated_error is not None
    true = cauchy_error(solution, n_graded=3)
    assert 0.2 <= solution.estimated_error / true <= 5.0
    space = solution.scene.discretisation.displacement_space(mesh)
    strains = element_errors(space, solution.boundary.displacement, solution.scene.material.plane_modulus).sum()
    assert np.sqrt(strains / (2.0 * solution.energy)) < 0.7 * solution.estimated_error


def test_adaptive_meshes_refine_a_clamped_side() -> None:
    options = bk.MeshOptions(accuracy=1e-3)
    solutions = run_adaptive(dataclasses.replace(SCENES["clamped"], discretisation=ELEMENTS["quadratic"], mesh=options))
    feet = [solution.mesh.part("foot").size for solution in solutions]
    assert feet[-1] >= 1.5 * feet[0]


@pytest.mark.slow
@pytest.mark.parametrize("word", ELEMENTS)
def test_a_clamped_block_reaches_its_accuracy(word: str) -> None:
    shape, options = bk.Rectangle(2.0, 0.5), bk.MeshOptions(accuracy=1e-3 if word == "linear" else 3e-4)
    scene = dataclasses.replace(SCENES["clamped"], shape=shape, discretisation=ELEMENTS[word], mesh=options)
    solution = bk.run(scene)
    assert solution.is_converged
    assert options.accuracy is not None
    assert cauchy_error(solution) <= 2.0 * options.accuracy


@pytest.mark.parametrize("degree", [0, 1])
def test_what_the_tractions_hold_has_no_error(degree: int) -> None:
    mesh = bk.discretise(bk.Rectangle(2.0, 1.0).outline(), n_elements=30, grading=bk.Algebraic(2.0))
    constant = mesh.normals @ np.array([[2.0, 0.5], [0.5, -1.0]])
    linear = constant * (1.0 + mesh.centres[:, :1] - 2.0 * mesh.centres[:, 1:])
    # round-off of second differences of numbers of size one
    assert traction_errors(mesh, constant if degree == 0 else linear, degree, 1.0).sum() < 1e-28


def test_the_estimate_of_tractions_has_its_closed_form_for_saw_teeth() -> None:
    """A traction with a constant slope g on equal elements of a circle's perimeter L: L h^3 g^2 / (100 E')."""
    mesh = bk.discretise(bk.Disk(1.0).outline(), n_elements=64)
    angle = np.arctan2(mesh.centres[:, 1], mesh.centres[:, 0])
    traction = np.stack([np.sin(angle), np.cos(angle)], axis=1)  # slope 1 everywhere
    h, perimeter = mesh.lengths[0], mesh.lengths.sum()
    found = traction_errors(mesh, traction, 0, 2.0).sum()
    assert found == pytest.approx(perimeter * h**3 / (100.0 * 2.0), rel=1e-2)  # chords are shorter than arcs


def test_steps_towards_a_corner_are_continued() -> None:
    """Tractions like d**-0.3 weigh far more in the last element than tractions with the same first step and no more."""
    mesh = bk.discretise(bk.Rectangle(1.0, 1.0).outline(), n_elements=40)
    side = np.flatnonzero(mesh.centres[:, 1] == 0.0)
    distance = np.arange(side.size + 1) / side.size
    singular, straight = np.zeros((40, 2)), np.zeros((40, 2))
    singular[side, 1] = np.diff(distance**0.7) / np.diff(distance) / 0.7
    straight[side, 1] = (singular[side[0], 1] - singular[side[1], 1]) * -np.arange(side.size)
    for degree in (0, 1):
        errors = traction_errors(mesh, singular, degree, 1.0)
        assert errors[side[0]] > 5.0 * errors[side[1]]
    even = traction_errors(mesh, straight, 0, 1.0)
    np.testing.assert_allclose(even[side][1:-1], even[side[1]], rtol=1e-12)
    assert even[side[0]] == pytest.approx(
        1.5 * even[side[1]]
    )  # half a step on one side, the continued one on the other


def test_rigid_motions_have_no_error() -> None:
    mesh = bk.discretise(bk.PlateWithHole(2.0, 1.0, 0.2).outline(), n_elements=48)
    space = QuadraticSpace(mesh)
    motions = rigid_motions(dof_points(space), mesh.centre, mesh.diameter)
    moved = motions @ np.array([3.0, -2.0, 5.0])
    assert np.abs(without_motion(mesh, dof_points(space), moved)).max() < 1e-13
    # round-off of differences over elements of length 0.03; a rotation left in gives 1e-5
    assert element_errors(space, moved, 1.0).sum() < 1e-24
    outside = bk.discretise(bk.ExteriorOf(bk.Disk(1.0)).outline(), n_elements=16)
    turned = np.ones((16, 2))
    np.testing.assert_array_equal(without_motion(outside, outside.nodes, turned), turned)


@pytest.mark.parametrize("word", slow_except(ELEMENTS, "quadratic"))
def test_a_plate_that_falls_and_turns_keeps_its_estimate(word: str) -> None:
    """The plate is pulled, and its left side moved along rigidly by a thousand times its strains."""
    plate = bk.PlateWithHole(2.0, 1.0, 0.2, corner=(-1.0, -0.5))
    pulled = bk.Part("right", bk.Traction(x=1e-6), ("right",))
    estimates, energies = [], []
    for turn in (0.0, 1e-2):
        x, y = bk.Expression(f"-{turn} * y"), bk.Expression(f"{turn} * (x + 1)")
        held = bk.Part("left", bk.PrescribedDisplacement(x=x, y=y), ("left",))
        scene = bk.Scene(
            title="plate", shape=plate, material=bk.Material(1.0, 0.3), parts=(held, pulled),
            discretisation=ELEMENTS[word], mesh=bk.MeshOptions(elements=48),
        )  # fmt: skip
        solution = bk.run(scene)
        estimates.append(solution.estimated_error)
        energies.append(solution.energy)
    # displacements of 1e-2 know strains of 1e-6 to 1e-10
    assert estimates[1] == pytest.approx(estimates[0], rel=1e-4)
    assert energies[1] == pytest.approx(energies[0], rel=1e-6)


def test_pieces_of_too_few_elements_are_blind() -> None:
    parts = {"two": Selection(("left",)), "rest": Selection(("top", "bottom", "right"))}
    mesh = bk.discretise(bk.Rectangle(4.0, 1.0).outline(), n_elements=10, parts=parts)
    is_upright = np.abs(mesh.normals[:, 0]) > 0.5
    assert int(is_upright.sum()) == 2  # one element each, and four on the others
    for degree in (0, 1):
        np.testing.assert_array_equal(blind_elements(mesh, degree), is_upright)
    halved = mesh.refined(mesh.part("two"))
    assert not blind_elements(halved, 0)[halved.part("two")].any()
    assert blind_elements(halved, 1)[halved.part("two")].all()
