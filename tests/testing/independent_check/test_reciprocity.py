"""The states of stress of the independent check are elastic, by differences and by balance."""

from __future__ import annotations

import numpy as np
import pytest

import bemkit as bk
from bemkit.testing.independent_check.reciprocity import (
    State,
    centre_of_dilatation,
    point_force,
    uniform_stress,
)

MATERIALS = (bk.Material(2.0, 0.3), bk.Material(2.0, 0.3, bk.Plane.STRESS), bk.Material(2.0, -0.4))
SOURCE = np.array([0.2, -0.1])


def states(material: bk.Material) -> dict[str, State]:
    return {
        "force": point_force(SOURCE, np.array([0.6, 0.8]), 3.0, material),
        "dilatation": centre_of_dilatation(SOURCE, material),
        "uniform": uniform_stress(np.array([[1.0, 0.3], [0.3, -2.0]]), SOURCE, material),
    }


def stress_of(state: State, point: np.ndarray, material: bk.Material) -> np.ndarray:
    """Hooke's law on central differences of the displacement."""
    step = 1e-5
    normals = np.array([[1.0, 0.0]])
    columns = [
        (state(point[None] + step * e, normals)[0] - state(point[None] - step * e, normals)[0])[0] / (2.0 * step)
        for e in np.eye(2)
    ]
    gradient = np.column_stack(columns)
    mu, nu = material.shear_modulus, material.effective_poisson_ratio
    strain = 0.5 * (gradient + gradient.T)
    return np.asarray(2.0 * mu * (strain + nu / (1.0 - 2.0 * nu) * np.trace(strain) * np.eye(2)))


@pytest.mark.parametrize("material", MATERIALS)
@pytest.mark.parametrize("name", ["force", "dilatation", "uniform"])
def test_tractions_follow_from_displacements_by_hookes_law(name: str, material: bk.Material) -> None:
    state = states(material)[name]
    for point, angle in ((np.array([1.0, 0.7]), 0.3), (np.array([-0.5, 0.4]), 2.0)):
        normal = np.array([np.cos(angle), np.sin(angle)])
        traction = state(point[None], normal[None])[1][0]
        # central differences with a step of 1e-5 leave 1e-9
        assert traction == pytest.approx(stress_of(state, point, material) @ normal, abs=1e-7)


@pytest.mark.parametrize("material", MATERIALS)
def test_a_circle_around_the_source_carries_its_force(material: bk.Material) -> None:
    angles = 2.0 * np.pi * np.arange(64) / 64
    normals = np.column_stack([np.cos(angles), np.sin(angles)])
    for name, force in (("force", np.array([-0.6, -0.8])), ("dilatation", np.zeros(2))):
        tractions = states(material)[name](SOURCE + 0.5 * normals, normals)[1]
        assert tractions.sum(axis=0) * np.pi / 64 == pytest.approx(force, abs=1e-12)  # the trapezoidal rule is exact


@pytest.mark.parametrize("material", MATERIALS)
def test_a_centre_of_dilatation_changes_no_volume(material: bk.Material) -> None:
    gradient_trace = np.trace(stress_of(states(material)["dilatation"], np.array([1.0, 0.7]), material))
    assert gradient_trace == pytest.approx(0.0, abs=1e-7)
