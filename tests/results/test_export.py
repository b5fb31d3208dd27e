"""Results in the format that the ending of a file name asks for."""

from __future__ import annotations

import json
from base64 import b64decode
from collections.abc import Callable
from importlib.util import find_spec
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest

import bemkit as bk
from bemkit.atomic_files import OutputFileError
from bemkit.cli.main import main
from bemkit.pictures.shown import shown
from bemkit.pictures.stress import draw_stress
from bemkit.results.export import FORMATS, boundary_arrays, export_result
from bemkit.results.solution import Solution
from bemkit.results.stress_measures import STRESSES
from bemkit.results.stress_mesh import stress_mesh
from bemkit.scene.toml import with_overrides
from bemkit.scene.unit_names import amount
from tests.perforated_plate import NOMINAL, plate
from tests.slow import slow_except, slow_only


@pytest.fixture(scope="module")
def solution() -> bk.Solution:
    return bk.run(with_overrides(bk.load_scene("paper-1"), elements=40, degree=2))


@pytest.fixture(scope="module")
def bodies() -> Solution:
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
    path = tmp_path / f"r{ending}"
    for _ in range(2):
        export_result(path, request.getfixturevalue(name))
    assert [file.name for file in tmp_path.iterdir()] == [path.name]


def test_numpy_reads_the_arrays(bodies: Solution, tmp_path: Path) -> None:
    export_result(tmp_path / "r.npz", bodies)
    with np.load(tmp_path / "r.npz") as arrays:
        assert set(arrays) == set(boundary_arrays(bodies))
        np.testing.assert_array_equal(arrays["upper/displacement"], bodies.bodies["upper"].boundary.displacement)
        np.testing.assert_array_equal(arrays["contact/sigma_n"], bodies.contact.sigma_n)


def test_other_programs_read_the_lines(solution: bk.Solution, tmp_path: Path) -> None:
    meshio = pytest.importorskip("meshio")
    export_result(tmp_path / "r.vtu", solution)
    mesh = meshio.read(tmp_path / "r.vtu")
    vertices, lines = mesh.cells
    assert (lines.type, vertices.type) == ("line", "vertex")
    assert len(vertices.data) == solution.contact.n_contact
    assert len(lines.data) % solution.mesh.n_elements == 0
    # pieces join to the closed boundary
    ends = mesh.points[lines.data][:, :, :2]
    assert np.hypot(*(ends[:, 1] - ends[:, 0]).T).sum() == pytest.approx(solution.mesh.lengths.sum(), rel=1e-12)
    at_contact = vertices.data.ravel()
    np.testing.assert_array_equal(mesh.point_data["sigma_n"][at_contact], solution.contact.sigma_n)
    on_lines = np.unique(lines.data)
    corner = on_lines[np.argmin(np.hypot(*(mesh.points[on_lines, :2] - solution.mesh.nodes[0]).T))]
    np.testing.assert_allclose(mesh.point_data["displacement"][corner, :2], solution.boundary.displacement[0])
    assert mesh.cell_data["traction"][1].shape == (len(lines.data), 3)
    slips = mesh.point_data["slip"][at_contact]
    touches = np.array([word != "separated" for word in solution.contact.status_words()])
    np.testing.assert_array_equal(slips, np.where(touches, solution.contact.u_t, np.nan))
    assert {"gap", "clearance", "status"} <= set(mesh.point_data)


def test_stress_inside_goes_with_the_lines(tmp_path: Path) -> None:
    meshio = pytest.importorskip("meshio")
    material = bk.Material(10.0, 0.3)
    parts = (
        bk.Part("floor", bk.Contact(bk.RigidHalfPlane()), sides=("bottom",)),
        bk.Part("wall", bk.Roller(), sides=("left",)),
        bk.Part("load", bk.Pressure(1e-3), sides=("top",)),
    )
    scene = bk.Scene(
        title="t", shape=bk.Rectangle(2.0, 1.0), material=material, parts=parts, mesh=bk.MeshOptions(elements=60)
    )
    export_result(tmp_path / "r.vtu", bk.run(scene), inside=11)
    mesh = meshio.read(tmp_path / "r.vtu")
    assert [block.type for block in mesh.cells] == ["vertex", "line", "triangle"]
    triangles = mesh.cells[2].data
    inner = np.unique(triangles)
    x, y = mesh.points[inner, :2].T
    assert [x.min(), x.max(), y.min(), y.max()] == pytest.approx([0.0, 2.0, 0.0, 1.0], abs=1e-12)
    # uniform pressure in plane strain, which linear elements hold exactly
    expected = np.zeros((3, 3))
    expected[1, 1], expected[2, 2] = -1e-3, -0.3e-3
    np.testing.assert_allclose(
        mesh.point_data["stress"].reshape(-1, 3, 3), np.tile(expected, (len(mesh.points), 1, 1)), atol=1e-12
    )
    displacement = np.column_stack([0.39 * 1e-4 * x, -0.91 * 1e-4 * y, 0.0 * x])
    np.testing.assert_allclose(mesh.point_data["displacement"][inner], displacement, atol=1e-14)
    np.testing.assert_allclose(mesh.point_data["von_mises"], 1e-3 * np.sqrt(1.0 - 0.3 + 0.09), rtol=1e-9)


@pytest.mark.parametrize("is_biaxial", slow_only([True, False], True))
def test_triangles_end_at_the_boundary_and_hold_the_largest_stress(is_biaxial: bool, tmp_path: Path) -> None:
    meshio = pytest.importorskip("meshio")
    scene = plate(is_biaxial=is_biaxial, mesh=bk.MeshOptions(elements=24), discretisation=bk.Galerkin(6))
    solution = bk.run(scene)
    export_result(tmp_path / "r.vtu", solution, inside=13)
    mesh = meshio.read(tmp_path / "r.vtu")
    for name, values in mesh.point_data.items():
        assert np.isfinite(values).all(), name
    largest = (2.0 if is_biaxial else 3.0) * NOMINAL
    assert mesh.point_data["von_mises"].max() == pytest.approx(largest, rel=1e-4)
    # the picture draws the same triangles and values
    size = np.ptp(solution.mesh.whole.nodes, axis=0).max()
    drawn = stress_mesh(solution.body, float(size) / 12, shown(solution).frame)
    assert draw_stress(solution).get_title().startswith(f"Stress up to {amount(largest, 'stress', None)}\n")
    if find_spec("pyvista"):
        import pyvista

        grid = pyvista.read(tmp_path / "r.vtu")
        assert np.isfinite(grid.point_data["von_mises"]).all()
        assert grid.point_data["von_mises"].max() == mesh.point_data["von_mises"].max()
    triangles = next(block.data for block in mesh.cells if block.type == "triangle")
    used = mesh.point_data["von_mises"][-len(drawn.points) :]
    np.testing.assert_allclose(used, STRESSES["von-mises"].of(drawn.stress, scene.material), rtol=1e-9)
    corners = mesh.points[triangles][:, :, :2]
    first, second = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    area = 0.5 * (first[:, 0] * second[:, 1] - first[:, 1] * second[:, 0])
    assert area.min() > 0.0
    assert area.sum() == pytest.approx(solution.mesh.area, rel=1e-3)  # chords of the circles


@pytest.mark.parametrize("name", slow_except(["pin-in-plate", "clamped-angle", "two-cylinders"], "clamped-angle"))
def test_triangles_fill_every_body(name: str) -> None:
    solution = bk.run(bk.load_scene(name))
    for body in solution.bodies.values():
        filled = stress_mesh(body, 0.05 * body.mesh.diameter, shown(solution).frame)
        corners = filled.points[filled.triangles]
        first, second = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
        area = 0.5 * float((first[:, 0] * second[:, 1] - first[:, 1] * second[:, 0]).sum())
        assert area == pytest.approx(body.mesh.area, rel=2e-3)
        assert np.isfinite(filled.stress).all()


def test_inside_is_refused_where_it_cannot_be_held(solution: bk.Solution, tmp_path: Path, capsys) -> None:
    with pytest.raises(OutputFileError, match=r"r.h5: .h5 holds no fields inside the body: give .vtu, or no"):
        export_result(tmp_path / "r.h5", solution, inside=10)
    with pytest.raises(OutputFileError, match=r"r.vtu: inside is 1: give from 2 to 1000 points across the body"):
        export_result(tmp_path / "r.vtu", solution, inside=1)
    assert call("run", "paper-1", "--inside", "10") == 2
    assert "--inside goes into a file: give -o with a name that ends in .vtu" in capsys.readouterr().err


@pytest.mark.usefixtures("here")
def test_the_command_line_goes_by_the_ending(capsys: pytest.CaptureFixture[str]) -> None:
    assert call("run", "paper-1", "--elements", "24", "-q", "-o", "r.h5") == 0
    assert call("show", "r.h5", "-o", "r.json") == 0
    assert json.loads(Path("r.json").read_text("utf-8"))["converged"]
    capsys.readouterr()
    for name, message in (("r.xyz", "the ending '.xyz' names no format"), ("r", "the ending '' names no format")):
        assert call("run", "paper-1", "--elements", "24", "-o", name) == 2
        assert message in capsys.readouterr().err
        assert not Path(name).exists()


def test_pyvista_reads_named_fields_on_the_same_cells(bodies: Solution, tmp_path: Path) -> None:
    pyvista = pytest.importorskip("pyvista")
    export_result(tmp_path / "r.vtu", bodies, inside=9)
    data = pyvista.read(tmp_path / "r.vtu")
    n_contact = bodies.contact.n_contact
    assert data.GetCellType(0) == pyvista.CellType.VERTEX
    assert data.GetCellType(n_contact) == pyvista.CellType.LINE
    assert data.GetCellType(data.n_cells - 1) == pyvista.CellType.TRIANGLE
    of_vertices = [data.get_cell(number).point_ids[0] for number in range(n_contact)]
    for name in ("sigma_n", "sigma_t", "gap", "status"):
        np.testing.assert_array_equal(data.point_data[name][of_vertices], getattr(bodies.contact, name))
    assert set(np.unique(data.cell_data["body"][n_contact:])) == {0.0, 1.0}
    line = data.get_cell(n_contact)
    assert np.isfinite(data.point_data["displacement"][line.point_ids]).all()
    assert np.isfinite(data.cell_data["traction"][n_contact]).all()
    square = data.get_cell(data.n_cells - 1)
    assert np.isfinite(data.point_data["von_mises"][square.point_ids]).all()


def test_arrays_of_a_grid_follow_the_number_of_their_bytes(bodies: Solution, tmp_path: Path) -> None:
    """Read by nothing but the standard library: the number of bytes and the data, in base64."""
    export_result(tmp_path / "r.vtu", bodies)
    entries = ElementTree.parse(tmp_path / "r.vtu").findall(".//DataArray")
    assert {"Points", "displacement", "traction", "connectivity"} <= {entry.get("Name") for entry in entries}
    arrays = [b64decode(entry.text or "") for entry in entries]
    assert all(int.from_bytes(data[:8], "little") == len(data) - 8 for data in arrays)


def test_bodies_without_end_are_cut(tmp_path: Path) -> None:
    meshio = pytest.importorskip("meshio")
    parts = (bk.Part("load", bk.Pressure(1.0)),)
    shape = bk.ExteriorOf(bk.Disk(1.0))
    scene = bk.Scene(
        title="t", shape=shape, material=bk.Material(1e3, 0.3), parts=parts, mesh=bk.MeshOptions(elements=16)
    )
    export_result(tmp_path / "r.vtu", bk.run(scene), inside=10)
    mesh = meshio.read(tmp_path / "r.vtu")
    assert [block.type for block in mesh.cells] == ["line", "triangle"]
    radius = np.hypot(*mesh.points[np.unique(mesh.cells[1].data), :2].T)
    assert radius.min() > 0.99  # a chord of the hole
    assert 2.0 < radius.max() < 4.0


def test_a_grid_of_pyvista_holds_what_the_file_holds() -> None:
    pytest.importorskip("pyvista")
    solution = bk.run(bk.load_scene("paper-1"))
    grid = solution.to_pyvista(inside=20)
    assert {"displacement", "stress", "von_mises", "sigma_n", "status"} <= set(grid.point_data)
    assert {"traction", "body"} <= set(grid.cell_data)
    assert (grid.celltypes == 5).sum() > 100  # triangles
    is_contact = np.isfinite(grid.point_data["sigma_n"])
    np.testing.assert_array_equal(grid.point_data["sigma_n"][is_contact], solution.contact.sigma_n)


def test_a_grid_without_pyvista_names_the_extra(without: Callable[..., None]) -> None:
    without("pyvista")
    with pytest.raises(bk.InputError, match=r'grids of pyvista need it: pip install "bemkit\[viz\]"'):
        bk.run(bk.load_scene("bending")).to_pyvista()
