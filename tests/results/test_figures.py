"""Figures: they say what they must, and the files are complete."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import matplotlib.image
import numpy as np
import pytest

from bemkit.atomic_files import OutputFileError
from bemkit.results.figures import (
    STATUS_COLOURS,
    at_mesh_nodes,
    draw_contact_displacement,
    draw_contact_status,
    draw_contact_traction,
    draw_deformation,
    exaggeration,
    outlines,
    save_figures,
    whole_displacement,
)
from bemkit.results.solution import BoundaryFields, Solution
from bemkit.runs.run import run
from bemkit.scene.toml import load_scene, with_overrides
from bemkit.scene.unit_names import UnitNames


@pytest.fixture(scope="module", params=["linear", "constant"])
def solution(request: pytest.FixtureRequest) -> Solution:
    return run(with_overrides(load_scene("paper-1"), elements=40, discretisation=request.param))


@pytest.fixture(scope="module")
def figures(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("figures")


@pytest.mark.parametrize("title", ["plain", "costs $5 and \\frac{ more_ than $"])
def test_all_figures_are_complete_pictures(solution: Solution, title: str, figures: Path) -> None:
    """Whatever the title; the second time they replace the first."""
    scene = dataclasses.replace(solution.scene, title=title)
    paths = save_figures(dataclasses.replace(solution, scene=scene), figures)
    names = ["deformation", "contact-displacement", "contact-traction", "contact-status"]
    assert [path.stem for path in paths] == names
    assert sorted(path.name for path in figures.iterdir()) == sorted(f"{name}.png" for name in names)
    for path in paths:
        picture = matplotlib.image.imread(path)
        assert min(picture.shape[:2]) > 500
        assert picture[..., :3].std() > 0.05  # not blank


def test_the_deformation_tells_its_factor_and_its_units(solution: Solution) -> None:
    figure = draw_deformation(solution, units=UnitNames("mm", "MPa"))
    axes = figure.axes[0]
    legend = [text.get_text() for text in figure.legends[0].get_texts()]
    space, displacement = whole_displacement(solution)
    factor = exaggeration(solution.mesh.diameter, displacement, solution.contact)
    assert f"deformed, displacements \u00d7 {factor:g}" in legend
    assert "obstacle" in legend
    assert (axes.get_xlabel(), axes.get_ylabel()) == ("$x$ [mm]", "$y$ [mm]")
    drawn = axes.lines[1].get_xydata()[:-1]
    (expected,) = outlines(space, displacement, factor)
    np.testing.assert_allclose(drawn, expected[:-1], atol=1e-15)
    at_nodes = solution.mesh.nodes + factor * at_mesh_nodes(space, displacement)
    for node in at_nodes:  # every corner of an element is drawn
        assert np.hypot(*(drawn - node).T).min() < 1e-14


def test_no_contact_node_is_drawn_beyond_its_obstacle() -> None:
    """Neither the wavy obstacle, which closes gaps, nor a disc: not by more than a line is thick."""
    for name in ("wavy-obstacle", "disc-between-plates"):
        solution = run(with_overrides(load_scene(name), elements=60))
        space, displacement = whole_displacement(solution)
        factor = exaggeration(space.mesh.diameter, displacement, solution.contact)
        depth = factor * solution.contact.u_n - solution.contact.gap
        assert depth.max() <= 0.0031 * space.mesh.diameter


@pytest.mark.parametrize(
    ("draw", "label"),
    [
        (draw_contact_displacement, "displacement"),
        (draw_contact_traction, "traction"),
        (draw_contact_status, "pressure"),
    ],
)
def test_contact_figures_have_labels_curves_and_a_status_strip(solution: Solution, draw: object, label: str) -> None:
    axes, strip, *_ = draw(solution, "foundation").axes  # type: ignore[operator]
    assert axes.get_ylabel() == label
    assert strip.get_xlabel() == "arc length $s$ along 'foundation'"
    assert axes.get_title()
    assert len(axes.get_legend().get_texts()) >= 2
    bars = [(patch.get_x(), patch.get_x() + patch.get_width(), patch.get_facecolor()) for patch in strip.patches]
    places = [transition.s for transition in solution.transitions]
    np.testing.assert_allclose([end for _, end, _ in bars], [*places, 1.0], rtol=1e-12)
    colours = [matplotlib.colors.to_hex(colour).upper() for _, _, colour in bars]
    assert colours == [STATUS_COLOURS[word].upper() for word in ("separated", "slip", "stick")]


def test_a_uniform_pressure_is_drawn_with_zero_and_not_scaled_to_its_round_off() -> None:
    solution = run(with_overrides(load_scene("uniform-slip"), elements=24))
    bottom, top = draw_contact_status(solution, "floor").axes[0].get_ylim()
    assert bottom <= 0.0 < 1.0 < top  # the pressure is 1 Pa


def test_displacements_at_nodes_are_those_of_a_linear_field(solution: Solution) -> None:
    points, centres = solution.boundary.points, solution.boundary.centres
    gradient = np.array([[0.5, -2.0], [3.0, 0.25]])
    linear = BoundaryFields(points.copy(), points @ gradient, centres.copy(), np.zeros_like(centres))
    changed = dataclasses.replace(solution, boundary=linear)
    before, after = solution.mesh.node_elements.T
    is_corner = np.sum(solution.mesh.tangents[before] * solution.mesh.tangents[after], axis=1) < 0.5
    assert is_corner.sum() == 4
    error = np.abs(at_mesh_nodes(*whole_displacement(changed)) - solution.mesh.nodes @ gradient).max(axis=1)
    assert error[~is_corner].max() < 1e-14  # values up to 5
    assert error.max() < solution.mesh.lengths.max() * np.abs(gradient).max()  # corners are cut by half an element


@pytest.mark.parametrize(
    ("largest", "factor"), [(1.0, 0.05), (0.08, 1.0), (0.03, 2.0), (1e-5, 5e3), (0.0, 1.0), (np.nan, 1.0)]
)
def test_the_exaggeration_is_a_round_number(largest: float, factor: float) -> None:
    displacement = np.array([[0.0, 0.0], [0.0, -largest]])
    nothing = run(with_overrides(load_scene("clamped-angle"), elements=12)).contact
    assert exaggeration(1.0, displacement, nothing) == pytest.approx(factor, rel=1e-12)


def test_files_of_others_are_left_alone(solution: Solution, tmp_path: Path) -> None:
    (tmp_path / "contact-traction.png").write_text("mine", "utf-8")
    with pytest.raises(OutputFileError, match=r"contact-traction\.png: exists and is not a figure"):
        save_figures(solution, tmp_path)
    (tmp_path / "file").write_text("mine", "utf-8")
    with pytest.raises(OutputFileError, match="the folder cannot be made"):
        save_figures(solution, tmp_path / "file")
