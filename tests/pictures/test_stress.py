"""Stresses inside: true at every point that is drawn, the boundary among them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from matplotlib.figure import Figure
from scipy.spatial import KDTree

import bemkit as bk
from bemkit.geometry import Rectangle, discretise
from bemkit.pictures import draw_stress
from bemkit.pictures.shown import shown
from bemkit.pictures.stress import largest_shown
from bemkit.results.solved_scene import interior_fields
from bemkit.results.stress_measures import STRESSES
from bemkit.results.stress_mesh import StressMesh, _inner_points, stress_mesh
from bemkit.scene.toml import with_overrides
from tests.slow import slow_except

INNER = tuple(f"inner-{number}" for number in (1, 2, 3, 4))
STRESS_MATERIAL = bk.Material(100.0, 0.3, bk.Plane.STRESS)
MATERIALS = bk.Material(100.0, 0.3), bk.Material(100.0, 0.5)


def points_of(solution: bk.Solution) -> StressMesh:
    return stress_mesh(solution.body, 0.1, shown(solution).frame)


@pytest.mark.slow
def test_points_stay_as_far_from_short_elements_as_a_picture_shows() -> None:
    scene = replace(bk.load_scene("bending"), mesh=bk.MeshOptions(elements=400), discretisation=bk.Galerkin(1))
    solution = bk.run(scene)
    spacing = 20.0 * float(solution.mesh.lengths.max())
    low, high = solution.mesh.nodes.min(axis=0), solution.mesh.nodes.max(axis=0)
    found = stress_mesh(solution.body, spacing, shown(solution).frame).points
    distance = np.minimum(found - low, high - found).min(axis=1)
    inner = distance > 1e-9
    assert inner.sum() > 20
    assert distance[inner].min() >= 0.999 * spacing / 8.0


@pytest.mark.slow
def test_beside_constant_elements_stresses_have_no_kinks() -> None:
    """Along the wall of Example 1, beside fields of degrees up to 6: there 0.7 lengths away they were off by 0.03."""
    scene = bk.load_scene("paper-1")
    true = bk.run(
        replace(scene, discretisation=bk.Galerkin(2), mesh=bk.MeshOptions(rising_degrees=True, accuracy=1e-4))
    )
    found = stress_mesh(bk.run(scene).body, 0.02, shown(true).frame)
    x, y = found.points.T
    beside = (x > 0.9) & (x < 0.999) & (y > 0.1) & (y < 0.9)
    assert beside.sum() > 100
    expected = interior_fields(true).stress(found.points[beside])
    np.testing.assert_allclose(found.stress[beside], expected, atol=0.005)  # 0.003 of elements that are a fiftieth


def test_of_many_elements_few_points_are_measured_from_the_boundary(monkeypatch: pytest.MonkeyPatch) -> None:
    """From far away nearly all elements are equally near, and each search takes long."""
    mesh, measured = discretise(Rectangle(1.0, 1.0).outline(), n_elements=8000), []

    class Counting(KDTree):
        def query(self, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:  # type: ignore[override]
            measured.append(len(x))
            distance, nearest = super().query(x)
            return distance, nearest

    monkeypatch.setattr("bemkit.results.stress_mesh.KDTree", Counting)
    frame = np.array([[0.0, 1.0], [0.0, 1.0]])
    found = _inner_points(mesh.centres, mesh.normals, mesh.lengths, 0.1, frame, is_exterior=False)
    assert 400 < len(found)
    assert max(measured) < 0.3 * mesh.n_elements


@pytest.mark.slow
@pytest.mark.parametrize(
    ("discretisation", "accuracy"),
    [("constant", 0.06), ("linear", 0.04), ("quadratic", 0.01)],
)
def test_a_ring_under_pressure_has_lames_stresses_everywhere(discretisation: str, accuracy: float) -> None:
    """A quarter of a ring of radii 1 and 2 with a pressure of 3 inside: errors of 20 to 48 elements."""
    scene = bk.Scene(
        title="ring",
        shape=bk.Ring(1.0, 2.0),
        material=bk.Material(100.0, 0.3),
        parts=(bk.Part("hole", bk.Pressure(3.0), INNER),),
        symmetry=bk.Symmetry(x=0.0, y=0.0),
        mesh=bk.MeshOptions(elements=96),
        discretisation=bk.scene_from_toml(SCENE_TEXT.format(word=discretisation)).discretisation,  # type: ignore[union-attr]
    )
    found = points_of(bk.run(scene))
    radius = np.hypot(*found.points.T)
    radial = found.points / radius[:, None]
    hoop = np.stack([-radial[:, 1], radial[:, 0]], axis=1)
    pressure, a = 3.0, 3.0 * 1.0 / (4.0 - 1.0)  # p a^2 / (b^2 - a^2)
    exact_radial, exact_hoop = a * (1.0 - 4.0 / radius**2), a * (1.0 + 4.0 / radius**2)
    for direction, exact in ((radial, exact_radial), (hoop, exact_hoop)):
        value = np.einsum("ni,nij,nj->n", direction, found.stress, direction)
        assert np.abs(value - exact).max() < accuracy * (pressure + 2.0)
    assert radius.min() < 1.001
    assert radius.max() > 1.999
    assert len(found.points) > 600


SCENE_TEXT = """
title = "any"
discretisation = "{word}"
[shape]
kind = "rectangle"
width = 1.0
height = 1.0
[material]
youngs_modulus = 1.0
poisson_ratio = 0.3
[parts.all]
condition = "clamped"
"""


@pytest.mark.parametrize("material", slow_except((*MATERIALS, STRESS_MATERIAL), STRESS_MATERIAL))
def test_uniform_stresses_are_exact(material: bk.Material) -> None:
    parts = (
        bk.Part("left", bk.Roller(), ("left",)),
        bk.Part("bottom", bk.Roller(), ("bottom",)),
        bk.Part("pull", bk.Traction(x=2.0), ("right",)),
    )
    scene = bk.Scene(title="bar", shape=bk.Rectangle(2.0, 1.0), material=material, parts=parts)
    found = points_of(bk.run(scene))
    np.testing.assert_allclose(found.stress, np.broadcast_to([[2.0, 0.0], [0.0, 0.0]], found.stress.shape), atol=1e-7)


def test_the_weight_counts() -> None:
    """The column between smooth walls: sigma_yy = -density g depth."""
    solution = bk.run(bk.load_scene("gravity-column"))
    found = points_of(solution)
    (weight,) = solution.scene.body_forces
    expected = -weight.density * 9.81 * (10.0 - found.points[:, 1])  # type: ignore[union-attr]
    # at corners the stresses beside them stand for those in them
    np.testing.assert_allclose(found.stress[:, 1, 1], expected, atol=0.03 * np.abs(expected).max())
    np.testing.assert_allclose(
        np.median(np.abs(found.stress[:, 1, 1] - expected)), 0.0, atol=1e-6 * np.abs(expected).max()
    )


@pytest.mark.slow
def test_bodies_without_an_end_are_drawn_as_far_as_the_frame() -> None:
    scene = bk.Scene(
        title="hole",
        shape=bk.ExteriorOf(bk.Disk(1.0)),
        material=STRESS_MATERIAL,
        parts=(bk.Part("wall", bk.Pressure(1.0)),),
        mesh=bk.MeshOptions(elements=24),
        discretisation=bk.Galerkin(2),
    )
    found = points_of(bk.run(scene))
    radius = np.hypot(*found.points.T)
    value = np.einsum("nij,nij->n", found.stress, found.stress)
    np.testing.assert_allclose(np.sqrt(value), np.sqrt(2.0) / radius**2, atol=0.02)
    assert radius.max() > 2.5


@pytest.mark.parametrize("measure", slow_except(STRESSES, "stress-xy"))
def test_each_measure_has_a_scale_and_a_largest_value(measure: str) -> None:
    solution = bk.run(replace(bk.load_scene("bending"), units=bk.UnitNames("mm", "MPa")))
    axes = draw_stress(solution, measure=measure)
    assert axes.collections
    assert axes.get_title().splitlines()[0].endswith("MPa")
    (scale,) = axes.child_axes
    assert STRESSES[measure].symbol in scale.get_ylabel()
    assert (scale.get_ylim()[0] == 0.0) == STRESSES[measure].is_positive
    assert not draw_stress(replace(solution, scene=replace(solution.scene, title="5 $"))).title.get_parse_math()


def test_several_bodies_share_a_scale_and_the_axes_are_returned() -> None:
    given = Figure().add_subplot()
    solution = bk.run(with_overrides(bk.load_scene("two-cylinders"), elements=24))
    assert draw_stress(solution, given) is given
    assert len(given.child_axes) == 1


def test_an_unknown_measure_is_refused() -> None:
    with pytest.raises(bk.InputError, match="measure is 'tresca': give one of von-mises"):
        draw_stress(bk.run(bk.load_scene("bending")), measure="tresca")


def test_points_that_crowd_in_a_corner_do_not_stretch_the_colours() -> None:
    """A thousand squares with stresses up to one, and in one more square as many points with a hundred."""
    grid = np.stack(np.meshgrid(np.arange(40.0), np.arange(25.0)), axis=2).reshape(-1, 2) + 0.5
    corner = np.array([40.5, 0.5]) + 1e-3 * grid / 40.0
    values = np.concatenate([np.linspace(-1.0, 1.0, 1000), np.full(1000, 100.0)])
    points = np.concatenate([grid, corner])
    assert 0.99 < largest_shown(points, values, 1.0) <= 1.0
    # where they fill a tenth of the picture they count
    spread = np.concatenate([grid, 10.0 * (corner - 40.5) + np.arange(1000)[:, None] % 100 + 100.0])
    assert largest_shown(spread, values, 1.0) == 100.0


def test_a_body_that_is_seen_to_move_is_drawn_where_its_obstacle_ends() -> None:
    disc = replace(bk.load_scene("disc-between-plates"), mesh=bk.MeshOptions(elements=32))
    axes = draw_stress(bk.run(disc))
    lowest = min(float(np.min(line.get_ydata())) for line in axes.lines)
    assert lowest == pytest.approx(-0.98397, abs=2e-3)  # the plate; coarse arcs hang through between nodes
