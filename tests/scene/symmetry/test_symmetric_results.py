"""Results of symmetric scenes: files, pictures, and what independent evidence says of them."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import bemkit as bk
from bemkit.cli.console import print_summary
from bemkit.pictures import draw_deformation
from bemkit.pictures.shown import at_mesh_nodes, shown
from bemkit.scene.toml import scene_from_toml, scene_to_toml
from bemkit.studies.stability.transform import AffineMap, transformed_scene
from bemkit.testing.independent_check import violations_of
from tests.scenes import DISCRETISATIONS, square, squeezed, whole_mesh
from tests.slow import slow_except

BOTH = bk.Symmetry(x=0.0, y=0.0)
RING = squeezed(bk.Ring(0.5, 1.0), symmetry=BOTH)
SQUARE = replace(square(), symmetry=bk.Symmetry(x=0.5))


@pytest.mark.parametrize(
    "symmetry", slow_except([bk.Symmetry(x=0.0), bk.Symmetry(y=0.0), BOTH], bk.Symmetry(y=0.0)), ids=str
)
def test_scene_and_result_files_keep_the_lines(symmetry: bk.Symmetry, tmp_path: Path) -> None:
    scene = replace(RING, symmetry=symmetry)
    assert scene_from_toml(scene_to_toml(scene)) == scene
    solution = bk.run(scene)
    path = tmp_path / "ring.h5"
    bk.write_result(path, solution)
    copy = bk.read_result(path)
    assert copy.scene == scene
    assert copy.mesh.symmetry == symmetry
    assert np.array_equal(copy.mesh.whole.nodes, solution.mesh.whole.nodes)
    assert np.array_equal(copy.boundary.traction, solution.boundary.traction)
    assert copy.estimated_error == solution.estimated_error
    points = np.array([[-0.7, 0.2], [0.1, -0.8]])
    stress = bk.interior_fields(solution).stress(points)
    assert np.array_equal(bk.interior_fields(copy).stress(points), stress)


@pytest.mark.parametrize(
    "discretisation", slow_except(DISCRETISATIONS, DISCRETISATIONS[1]), ids=lambda value: type(value).__name__
)
def test_pictures_show_the_whole_body(discretisation: object) -> None:
    pytest.importorskip("matplotlib")
    scene = replace(RING, discretisation=discretisation)
    solution = bk.run(scene)
    whole = bk.run(replace(scene, symmetry=None), mesh=whole_mesh(scene, solution.mesh))
    (body,), (expected,) = shown(solution).bodies, shown(whole).bodies
    displacement = at_mesh_nodes(expected.space, expected.displacement)
    # the whole ring is held sideways by the friction of a few nodes alone
    assert np.allclose(
        at_mesh_nodes(body.space, body.displacement), displacement, rtol=0.0, atol=1e-9 * np.abs(displacement).max()
    )
    axes = draw_deformation(solution)
    drawn = np.concatenate([line.get_xydata() for line in axes.get_lines() if line.get_linestyle() == "--"])
    assert np.allclose([drawn.min(axis=0), drawn.max(axis=0)], [[-1.0, -1.0], [1.0, 1.0]], rtol=0.0, atol=1e-12)
    lines = [line.get_xydata() for line in axes.get_lines() if line.get_linestyle() == "-."]
    assert [np.asarray(line)[:, k].tolist() for k, line in enumerate(lines)] == [[0.0, 0.0], [0.0, 0.0]]


@pytest.mark.parametrize("discretisation", DISCRETISATIONS, ids=lambda value: type(value).__name__)
@pytest.mark.parametrize("scene", slow_except([SQUARE, RING], SQUARE), ids=["square", "ring"])
def test_independent_evidence_says_of_the_half_what_it_says_of_the_whole(
    scene: bk.Scene, discretisation: object
) -> None:
    scene = replace(scene, discretisation=discretisation)
    half = bk.run(scene)
    whole = bk.run(replace(scene, symmetry=None), mesh=whole_mesh(scene, half.mesh))
    check, expected = violations_of(half), violations_of(whole)
    assert check.is_good
    assert check.worst <= 1e-12
    # the discretisation error, which shear does not enter by symmetry
    assert check.reciprocity == pytest.approx(expected.reciprocity, rel=1e-6, abs=1e-12)
    tilted = replace(half.contact, sigma_n=1.01 * half.contact.sigma_n)
    if len(scene.symmetry.rigid_motions):  # type: ignore[union-attr]
        assert violations_of(replace(half, contact=tilted)).equilibrium > 1e-4  # 1 % of one of many forces


def test_the_plan_counts_what_is_left() -> None:
    plan = bk.make_plan(RING, RING.build_mesh())
    items = {item.name: item for item in plan.items}
    assert items["symmetry"].is_needed
    assert items["symmetry"].reason == "about x = 0 and y = 0: 10 of 40 elements carry unknowns"
    assert "exterior domain" not in items
    assert not items["rigid motions as unknowns"].is_needed
    solution = bk.run(RING)
    assert plan.work.element_pairs == solution.work.element_pairs == 10 * 40


def test_the_summary_says_which_values_it_shows(capsys: pytest.CaptureFixture[str]) -> None:
    print_summary(bk.run(RING))
    lines = [line.strip().split(maxsplit=1) for line in capsys.readouterr().out.splitlines()]
    assert ["symmetry", "about x = 0 and y = 0: values of one side, 10 of 40 elements"] in lines


def test_moved_scenes_take_their_lines_along() -> None:
    scene = replace(square(), symmetry=bk.Symmetry(x=0.5))
    moved = transformed_scene(scene, AffineMap((2.0, 2.0), (7.0, 1.0)))
    assert moved.symmetry == bk.Symmetry(x=8.0)
    assert bk.run(moved).force_normal == pytest.approx(2.0 * bk.run(scene).force_normal, rel=1e-12)
