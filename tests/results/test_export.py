"""Results in the format that the ending of a file name asks for."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

import bemkit as bk
from bemkit.atomic_files import OutputFileError
from bemkit.cli.main import main
from bemkit.results.export import FORMATS, boundary_arrays
from bemkit.scene.toml import with_overrides


@pytest.fixture(scope="module")
def solution() -> bk.Solution:
    return bk.run(with_overrides(bk.load_scene("paper-1"), elements=40, degree=2))


@pytest.fixture(scope="module")
def bodies() -> bk.AssemblySolution:
    return bk.run(with_overrides(bk.load_scene("two-cylinders"), elements=40))


def call(*arguments: str) -> int:
    with pytest.raises(SystemExit) as caught:
        main(list(arguments))
    return int(caught.value.code or 0)


@pytest.mark.parametrize("ending", FORMATS)
@pytest.mark.parametrize("name", ["solution", "bodies"])
def test_every_ending_writes_and_replaces_its_own(
    ending: str, name: str, tmp_path: Path, request: pytest.FixtureRequest
) -> None:
    if ending == ".vtu":
        pytest.importorskip("meshio")
    path = tmp_path / f"r{ending}"
    for _ in range(2):
        bk.export_result(path, request.getfixturevalue(name))
    assert [file.name for file in tmp_path.iterdir()] == [path.name]
    path.write_text("mine", "utf-8")
    with pytest.raises(OutputFileError, match="exists and is not a"):
        bk.export_result(path, request.getfixturevalue(name))
    assert path.read_text("utf-8") == "mine"


def test_numpy_reads_the_arrays(bodies: bk.AssemblySolution, tmp_path: Path) -> None:
    bk.export_result(tmp_path / "r.npz", bodies)
    with np.load(tmp_path / "r.npz") as arrays:
        assert set(arrays) == set(boundary_arrays(bodies))
        np.testing.assert_array_equal(arrays["upper/displacement"], bodies.bodies["upper"].boundary.displacement)
        np.testing.assert_array_equal(arrays["contact/sigma_n"], bodies.contact.sigma_n)


def test_other_programs_read_the_lines(solution: bk.Solution, tmp_path: Path) -> None:
    meshio = pytest.importorskip("meshio")
    bk.export_result(tmp_path / "r.vtu", solution)
    mesh = meshio.read(tmp_path / "r.vtu")
    lines, vertices = mesh.cells
    assert (lines.type, vertices.type) == ("line", "vertex")
    assert len(vertices.data) == solution.contact.n_contact
    assert len(lines.data) % solution.mesh.n_elements == 0
    # pieces join to the closed boundary
    ends = mesh.points[lines.data][:, :, :2]
    assert np.hypot(*(ends[:, 1] - ends[:, 0]).T).sum() == pytest.approx(solution.mesh.lengths.sum(), rel=1e-12)
    at_contact = vertices.data.ravel()
    np.testing.assert_array_equal(mesh.point_data["sigma_n"][at_contact], solution.contact.sigma_n)
    corner = np.argmin(np.hypot(*(mesh.points[:, :2] - solution.mesh.nodes[0]).T))
    np.testing.assert_allclose(mesh.point_data["displacement"][corner, :2], solution.boundary.displacement[0])
    assert mesh.cell_data["traction"][0].shape == (len(lines.data), 3)


def test_the_command_line_goes_by_the_ending(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    assert call("run", "paper-1", "--elements", "24", "-q", "-o", "r.h5") == 0
    assert call("show", "r.h5", "-o", "r.json") == 0
    assert json.loads(Path("r.json").read_text("utf-8"))["converged"]
    capsys.readouterr()
    for name, message in (("r.xyz", "the ending '.xyz' names no format"), ("r", "the ending '' names no format")):
        assert call("run", "paper-1", "--elements", "24", "-o", name) == 2
        assert message in capsys.readouterr().err
        assert not Path(name).exists()


def test_a_missing_package_is_named(monkeypatch: pytest.MonkeyPatch, solution: bk.Solution, tmp_path: Path) -> None:
    monkeypatch.setattr("bemkit.results.export.find_spec", lambda name: None)
    with pytest.raises(OutputFileError, match=r'need meshio: pip install "bemkit\[mesh\]"'):
        bk.export_result(tmp_path / "r.vtu", solution)
