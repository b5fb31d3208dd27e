import contextlib
import io
import random
import types
import warnings
from pathlib import Path

import meshio
import numpy as np
import pytest

from bemkit.errors import GeometryError
from bemkit.geometry.files.meshio_files import plane_mesh_of, read_mesh, write_mesh
from bemkit.geometry.mesh import BoundaryMesh
from bemkit.geometry.meshing.discretise import discretise
from bemkit.geometry.outline import Selection
from bemkit.geometry.shapes import ExteriorOf, Polygon, Rectangle
from tests.geometry.strategies import closed

OUTER = np.array([[0, 0], [3, 0], [3, 2], [0, 2]]) / 3.0
INNER = np.array([[0.25, 0.25], [0.25, 0.5], [0.5, 0.5], [0.5, 0.25]])


@pytest.fixture
def mesh() -> BoundaryMesh:
    parts = {"left side": [3], "hole": [4, 5, 6, 7]}
    return BoundaryMesh(np.vstack([OUTER, INNER]), np.vstack([closed(4), closed(4, 4)]), parts)


def test_round_trip_keeps_every_digit(mesh: BoundaryMesh, tmp_path) -> None:
    write_mesh(tmp_path / "body.msh", mesh)
    copy = read_mesh(tmp_path / "body.msh")
    assert np.array_equal(copy.nodes, mesh.nodes)
    assert np.array_equal(copy.elements, mesh.elements)
    assert {name: part.tolist() for name, part in copy.parts.items()} == {"left side": [3], "hole": [4, 5, 6, 7]}


def test_round_trip_of_an_exterior(tmp_path) -> None:
    mesh = discretise(ExteriorOf(Polygon(((0, 0), (1, 0), (0, 1)))).outline(), n_elements=9)
    write_mesh(tmp_path / "cavity.msh", mesh)
    copy = read_mesh(tmp_path / "cavity.msh", is_exterior=True)
    assert copy.is_exterior
    assert np.allclose(copy.loop_areas, -0.5, rtol=1e-15)


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("is_exterior", [False, True])
def test_lines_in_any_order_and_direction(mesh: BoundaryMesh, tmp_path, seed: int, is_exterior: bool) -> None:
    random = np.random.default_rng(seed)
    nodes, elements = (mesh.nodes[:4], mesh.elements[:4]) if is_exterior else (mesh.nodes, mesh.elements)
    # with a stray node, triangles, two blocks of lines, and a constant third coordinate
    place = random.permutation(len(nodes)) + 1
    points = np.full((len(nodes) + 1, 3), 7.0)
    points[place, :2] = nodes
    order = random.permutation(len(elements))
    lines = place[elements][order]
    flipped = random.random(len(lines)) < 0.5
    lines[flipped] = lines[flipped][:, ::-1]
    cells = [("line", lines[:2]), ("triangle", [[1, 2, 3]]), ("line", lines[2:])]
    is_left = order == 3
    tags = [is_left[:2] * 5, np.array([5]), is_left[2:] * 5]
    meshio.Mesh(
        points,
        cells,
        cell_data={"gmsh:physical": tags, "gmsh:geometrical": [np.ones_like(tag) for tag in tags]},
        field_data={"left": np.array([5, 1]), "body": np.array([5, 2]), "no line": np.array([6, 1])},
    ).write(tmp_path / "body.msh", file_format="gmsh22")
    copy = read_mesh(tmp_path / "body.msh", is_exterior=is_exterior)
    assert list(copy.parts) == ["left"]
    (left,) = copy.part("left")
    assert copy.centres[left].tolist() == [0.0, 1.0 / 3.0]
    assert copy.normals[left].tolist() == ([1.0, 0.0] if is_exterior else [-1.0, 0.0])
    assert copy.loop_areas.sum() == pytest.approx(-2 / 3 if is_exterior else 2 / 3 - 1 / 16, rel=1e-14)
    assert np.array_equal(copy.elements[:, 0], np.arange(copy.n_elements))


def test_cell_sets_become_parts(tmp_path) -> None:
    sets = {"low": [np.array([0]), np.array([], dtype=int)], "inside": [np.array([], dtype=int), np.array([0])]}
    cells = [("line", closed(4)), ("quad", [[0, 1, 2, 3]])]
    meshio.Mesh(OUTER, cells, cell_sets=sets).write(tmp_path / "body.inp")
    copy = read_mesh(tmp_path / "body.inp")
    assert {name: part.tolist() for name, part in copy.parts.items()} == {"low": [0]}


def test_curved_elements_are_written_as_chords(tmp_path) -> None:
    from bemkit.geometry.shapes import Disk

    write_mesh(tmp_path / "disk.msh", discretise(Disk(1.0).outline(), n_elements=12))
    copy = read_mesh(tmp_path / "disk.msh")
    assert copy.is_straight.all()
    assert copy.area == pytest.approx(3.0, rel=1e-15)  # the regular polygon of twelve sides


def test_file_of_a_scene_keeps_its_parts(tmp_path) -> None:
    parts = {"contact": Selection(("bottom",)), "load": Selection(("top",), lambda x, y: x < 0.5)}
    mesh = discretise(Rectangle(1, 1).outline(), n_elements=20, parts=parts)
    write_mesh(tmp_path / "block.msh", mesh)
    copy = read_mesh(tmp_path / "block.msh")
    assert {name: part.tolist() for name, part in copy.parts.items()} == {
        name: part.tolist() for name, part in mesh.parts.items()
    }


def line_mesh(points, lines, cell: str = "line") -> meshio.Mesh:
    return meshio.Mesh(np.array(points, dtype=float), [(cell, np.array(lines))])


REFUSED = {
    "branch": (
        line_mesh([[0, 0, 0], [1, 0, 0], [0, 1, 0], [-1, 0, 0]], [[0, 1], [1, 2], [2, 0], [0, 3]]),
        r"body.vtk: 3 lines of its boundary meet at \(0, 0\): the boundary must be closed and simple",
    ),
    "open": (
        line_mesh([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1], [1, 2]]),
        r"1 lines of its boundary meet at \(0, 0\)",
    ),
    "not plane": (
        line_mesh([[0, 0, 0], [1, 0, 0], [0, 1, 2]], closed(3)),
        r"three-dimensional, with z from 0 to 2: .* give a plane mesh",
    ),
    "no lines": (
        line_mesh([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]], "triangle"),
        r"has no line cells: export the",
    ),
    "second order": (
        line_mesh([[0, 0, 0], [1, 0, 0], [0.5, 0, 0]], [[0, 1, 2]], "line3"),
        r"has curved lines: write a mesh of first order",
    ),
    "two bodies": (
        line_mesh(
            [[0, 0, 0], [1, 0, 0], [0, 1, 0], [5, 0, 0], [6, 0, 0], [5, 1, 0]], np.vstack([closed(3), closed(3, 3)])
        ),
        r"is a hole that lies outside of the outer loop",
    ),
}


@pytest.mark.parametrize(("file_mesh", "message"), REFUSED.values(), ids=REFUSED)
def test_refused(file_mesh: meshio.Mesh, message: str, tmp_path) -> None:
    file_mesh.write(tmp_path / "body.vtk")
    with pytest.raises(GeometryError, match=message):
        read_mesh(tmp_path / "body.vtk")


@pytest.mark.parametrize(
    ("name", "content", "message"),
    [
        (
            "body.msh",
            None,
            r"body.msh: it cannot be read \(ReadError: File .* not found.\): give a mesh file of a format",
        ),
        ("body.txt", "hello", r"cannot be read \(ReadError: Could not deduce file format"),
        ("body.msh", "hello\n", r"cannot be read \(.*Couldn't read file"),
        ("body.vtk", "# vtk DataFile Version 4.2\n", r"cannot be read"),
    ],
)
def test_unreadable_file_is_named_and_nothing_is_printed(name, content, message: str, tmp_path, capsys) -> None:
    if content is not None:
        (tmp_path / name).write_text(content)
    with pytest.raises(GeometryError, match=message):
        read_mesh(tmp_path / name)
    assert capsys.readouterr() == ("", "")


def test_other_endings_are_not_written(mesh: BoundaryMesh, tmp_path) -> None:
    with pytest.raises(GeometryError, match=r"body.vtk is not a name for a Gmsh file: end it in .msh"):
        write_mesh(tmp_path / "body.vtk", mesh)
    assert not list(tmp_path.iterdir())


def test_missing_meshio_says_what_to_install(mesh: BoundaryMesh, tmp_path, without) -> None:
    without("meshio")
    for act in (lambda: read_mesh(tmp_path / "a.msh"), lambda: write_mesh(tmp_path / "a.msh", mesh)):
        with pytest.raises(GeometryError, match=r'meshio is not installed: pip install "bemkit\[mesh\]"'):
            act()


FORMATS = ("msh", "vtk", "vtu", "inp", "mesh", "bdf", "su2")
INSERTED = (b"nan", b"inf", b"-1", b"1e400", b"\n", b" 99999999 ", b"\x1b[31m", b"0", b"\xff")


def damaged(content: bytes, chooser: random.Random) -> bytes:
    """Return a file with some damage: cut, changed, shortened, with something inserted, or lines out of order."""
    lines, place = content.split(b"\n"), chooser.randrange(len(content))
    one, other = chooser.randrange(len(lines)), chooser.randrange(len(lines))
    match chooser.randrange(6):
        case 0:
            return content[:place]
        case 1:
            return content[:place] + bytes([chooser.randrange(256)]) + content[place + 1 :]
        case 2:
            return content[:place] + content[place + chooser.randrange(1, 20) :]
        case 3:
            return content[:place] + chooser.choice(INSERTED) + content[place:]
        case 4:
            lines[one], lines[other] = lines[other], lines[one]
        case _:
            lines.insert(one, lines[other])
    return b"\n".join(lines)


def read_damaged_files(mesh: BoundaryMesh, folder: Path, n_files: int, seed: int) -> None:
    write_mesh(folder / "body.msh", mesh)
    stored, chooser = meshio.read(folder / "body.msh"), random.Random(seed)
    for ending in FORMATS:
        path = folder / f"file.{ending}"
        with contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(io.StringIO()):
            meshio.write(path, stored, **({"file_format": "gmsh22", "binary": False} if ending == "msh" else {}))
        content = path.read_bytes()
        for _ in range(n_files):
            path.write_bytes(damaged(content, chooser))
            with warnings.catch_warnings(), contextlib.suppress(GeometryError):
                warnings.simplefilter("ignore")  # of meshio
                assert isinstance(read_mesh(path), BoundaryMesh)


def test_damaged_files_are_read_or_refused(mesh: BoundaryMesh, tmp_path: Path) -> None:
    read_damaged_files(mesh, tmp_path, 40, seed=1)


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(2, 7))
def test_thousands_of_damaged_files_are_read_or_refused(mesh: BoundaryMesh, tmp_path: Path, seed: int) -> None:
    read_damaged_files(mesh, tmp_path, 300, seed)


SQUARE = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"points": np.zeros(4)}, "its points are not finite coordinates.*: export it again"),
        (
            {"points": np.where(SQUARE > 0.5, np.nan, SQUARE)},
            "its points are not finite coordinates.*: export it again",
        ),
        ({"points": [["a", "b"]]}, "its points are not finite coordinates.*: export it again"),
        ({"lines": np.array([[0, 1], [1, 9]])}, "its cells do not join its 4 points.*: export it again"),
        ({"lines": np.array([[0, -1]])}, "its cells do not join.*: export it again"),
        ({"lines": np.array([0, 1, 2])}, "its cells do not join.*: export it again"),
        (
            {"cell_sets": {"top\x1b[31m": [[0]]}},
            r"the group 'top\\x1b\[31m' has a name that is not printable.*: export it again",
        ),
        ({"cell_sets": {"top": [[7]]}}, "its groups cannot be read.*: export it again"),
        ({"cell_sets": {"top": [["x"]]}}, "its groups cannot be read.*: export it again"),
    ],
)
def test_contents_that_make_no_sense_are_named(change: dict[str, object], message: str) -> None:
    content = {"points": SQUARE, "lines": closed(4), "cell_sets": {}} | change
    stored = types.SimpleNamespace(
        points=content["points"],
        cells=[types.SimpleNamespace(type="line", data=content["lines"])],
        cell_data={},
        cell_sets=content["cell_sets"],
    )
    with pytest.raises(GeometryError, match=rf"^it is damaged: .*{message}$") as caught:
        plane_mesh_of(stored)
    assert str(caught.value).isprintable()


def test_what_meshio_says_is_printable(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def complain(path: Path) -> None:
        raise ValueError("bad \x1b[31m tag")

    monkeypatch.setattr(meshio, "read", complain)
    with pytest.raises(GeometryError, match=r"cannot be read \(ValueError: bad \?\[31m tag\)"):
        read_mesh(tmp_path / "x.msh")


def test_surfaces_have_no_boundary_lines(tmp_path: Path) -> None:
    with pytest.raises(GeometryError, match="such files hold only surfaces: export the lines"):
        read_mesh(tmp_path / "x.ply")
