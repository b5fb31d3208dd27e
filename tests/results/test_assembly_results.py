"""Results of several bodies: files, tables, JSON, pictures, the command line and the plan."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import h5py
import numpy as np
import pytest

import bemkit as bk
from bemkit.cli.main import main
from bemkit.hdf5 import ResultFileError
from bemkit.pictures import figures as pictures_of
from bemkit.pictures.catalogue import default_pictures
from bemkit.plan.plan import make_plan
from bemkit.results.solution import Solution
from bemkit.results.tables import to_csv, to_json
from bemkit.scene.toml import with_overrides
from tests.sealed import seal
from tests.slow import slow_except

pytest.importorskip("matplotlib")

CYLINDERS = replace(bk.load_scene("two-cylinders"), mesh=bk.MeshOptions(elements=48))
ARCH = with_overrides(bk.load_scene("masonry-arch"), elements=8)
SMALL = ("--elements", "48")


@pytest.fixture(scope="module")
def solution() -> Solution:
    return bk.run(CYLINDERS)


@pytest.fixture(scope="module")
def arch() -> Solution:
    """Copies that are turned, and obstacles."""
    return bk.run(ARCH)


def call(*arguments: str) -> int:
    with pytest.raises(SystemExit) as caught:
        main(list(arguments))
    return int(caught.value.code or 0)


@pytest.mark.parametrize("name", slow_except(["solution", "arch"], "solution"))
def test_a_file_gives_everything_back(name: str, tmp_path: Path, request: pytest.FixtureRequest) -> None:
    solution: Solution = request.getfixturevalue(name)
    bk.write_result(tmp_path / "r.h5", solution)
    copy = bk.read_result(tmp_path / "r.h5")
    assert isinstance(copy, Solution)
    assert copy.scene == solution.scene
    said, again = solution.summary(), copy.summary()
    # round-off: copies share the points of the first pair that stands alike, bodies from a file have their own
    assert again.pop("between_nodes") == pytest.approx(said.pop("between_nodes"), rel=1e-9, abs=1e-9)
    assert again == said
    assert copy.contacts == solution.contacts
    np.testing.assert_array_equal(copy.contact_directions, solution.contact_directions)
    np.testing.assert_array_equal(copy.friction_bound, solution.friction_bound)
    for key, body in solution.bodies.items():
        for field in ("points", "displacement", "traction_dofs"):
            np.testing.assert_array_equal(getattr(copy.bodies[key].boundary, field), getattr(body.boundary, field))
        np.testing.assert_array_equal(copy.bodies[key].mesh.points(np.arange(3), np.zeros(1)),
                                      body.mesh.points(np.arange(3), np.zeros(1)))  # fmt: skip
        assert copy.bodies[key].part_forces == body.part_forces


def test_any_program_reads_the_bodies_by_number(solution: Solution, tmp_path: Path) -> None:
    bk.write_result(tmp_path / "r.h5", solution)
    with h5py.File(tmp_path / "r.h5") as file:
        assert file["bodies"]["name"].tolist() == [b"upper", b"lower"]
        upper = solution.bodies["upper"].boundary
        n_points = file["bodies"]["n_points"][0]
        assert n_points == len(upper.points)
        assert np.array_equal(file["last/displacement"][:n_points], upper.displacement)
        assert json.loads(file["derived"][()])["contacts"][0]["force_normal"] == solution.contacts[0].force_normal


@pytest.mark.parametrize("name", slow_except(["solution", "arch"], "solution"))
def test_the_side_with_the_nodes_is_stored(name: str, tmp_path: Path, request: pytest.FixtureRequest) -> None:
    solution: Solution = request.getfixturevalue(name)
    bk.write_result(tmp_path / "r.h5", solution)
    again = bk.read_result(tmp_path / "r.h5")
    assert isinstance(again, Solution)
    assert again.contact_sides == solution.contact_sides
    for contact, (side, *_) in solution.contact_sides.items():
        body, rows = solution.bodies[side.body], solution.contact.rows(contact)
        space = body.scene.discretisation.displacement_space(body.mesh)
        nodes = body.boundary.points[np.unique(space.element_dofs[body.mesh.part(side.part)])]
        points = np.column_stack([solution.contact.x, solution.contact.y])[rows]
        distances = np.linalg.norm(points[:, None] - nodes, axis=2).min(axis=1)
        assert distances.max(initial=0.0) <= 1e-9 * body.mesh.diameter


def test_a_file_without_a_body_is_damaged(solution: Solution, tmp_path: Path) -> None:
    bk.write_result(tmp_path / "r.h5", solution)
    with h5py.File(tmp_path / "r.h5", "r+") as file:
        del file["meshes/1"]
    seal(tmp_path / "r.h5")
    with pytest.raises(ResultFileError, match="meshes/1/parts is missing"):
        bk.read_result(tmp_path / "r.h5")


def test_tables_name_the_body(solution: Solution) -> None:
    lines = to_csv(solution, "boundary").splitlines()
    assert lines[0].startswith("body,element,part,")
    assert len(lines) == 1 + solution.n_elements
    assert {line.split(",")[0] for line in lines[1:]} == {"upper", "lower"}
    contact = to_csv(solution, "contact").splitlines()
    assert contact[1].endswith("upper.tip / lower.tip")
    summary = json.loads(to_json(solution))
    assert summary["n_bodies"] == 2
    assert summary["contacts"][0]["name"] == "upper.tip / lower.tip"
    assert [force["name"] for force in summary["parts"] if force["body"] == "upper"] == ["pushed", "tip"]


@pytest.mark.slow
def test_pictures_show_all_bodies_and_each_contact_once(solution: Solution, arch: Solution) -> None:
    names = [[picture.name for picture in default_pictures(each)] for each in (solution, arch)]
    assert names[0] == ["deformation", "zoom", "contacts", "displacement", "traction", "status", "von-mises"]
    (axes,) = pictures_of(solution, ["contacts"])["contacts"].axes
    drawn = sum(len(collection.get_offsets()) for collection in axes.collections if hasattr(collection, "get_sizes"))
    assert drawn == solution.contact.n_contact
    assert names[1] == ["deformation", "contacts", "von-mises"]  # too many contacts for figures of each
    assert len(pictures_of(arch, ["deformation"])["deformation"].axes[0].patches) >= len(arch.bodies)


def test_fields_inside_are_those_of_a_body(solution: Solution) -> None:
    fields = bk.interior_fields(solution.bodies["upper"])
    stress = fields.stress(np.array([[0.0, 0.9]]))
    assert stress[0, 1, 1] < 0.0  # pressed


def test_the_plan_foresees_the_counts_and_says_what_is_left_out(arch: Solution) -> None:
    plan = make_plan(ARCH)
    assert plan.work == arch.work == arch.plan.work
    items = {item.name: item for item in plan.items}
    assert items["copies"].is_needed
    assert "18 bodies share" in items["copies"].reason
    assert not items["further meshes"].is_needed
    assert items["rigid obstacles"].is_needed


@pytest.mark.usefixtures("here", "undrawn")
def test_the_command_line_takes_assemblies(capsys: pytest.CaptureFixture[str]) -> None:
    files = ("-o", "r.h5", "--json", "r.json", "--csv", "c.csv", "--plot", "p", "--what", "contacts")
    assert call("run", "two-cylinders", *SMALL, *files) == 0
    shown = capsys.readouterr().out
    assert "2, with 96 elements" in " ".join(shown.split())
    assert json.loads(Path("r.json").read_text())["converged"]
    assert sorted(path.name for path in Path("p").iterdir()) == ["contacts.png"]
    assert call("show", "r.h5", "--csv", "-", "--table", "boundary") == 0
    assert capsys.readouterr().out.startswith("body,element")
    assert call("show", "r.h5", "--scene") == 0
    assert "[bodies.upper" in capsys.readouterr().out
    assert call("plan", "two-cylinders") == 0
    assert "contacts between bodies" in capsys.readouterr().out
    assert call("run", "two-cylinders", *SMALL, "--cascade", "--explain", "-q") == 0
    assert call("study", "errors", "two-cylinders") == 2
    assert "only scenes of one body can do this" in capsys.readouterr().err


def test_words_of_the_command_line_reach_bodies_with_options_of_their_own() -> None:
    changed = with_overrides(ARCH, elements=12, degree=2)
    assert {changed.scene_of(body).mesh.elements for body in changed.placed_bodies} == {12}
    assert changed.scene_of(changed.placed_bodies[0]).discretisation == bk.Galerkin(2)
