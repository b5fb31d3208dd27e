"""Meshes and geometries: the boundary of one part, however its file holds it."""

from __future__ import annotations

import importlib.util
import re
import subprocess
import sys
import types
from pathlib import Path

import meshio
import numpy as np
import pytest

from bemkit.errors import GeometryError
from bemkit.geometry.files.gmsh_files import why_no_gmsh
from bemkit.geometry.files.shape_file import DrawingFile, MeshFile
from bemkit.geometry.free_form.drawn import ArcTo, LineTo, SplineTo
from bemkit.geometry.meshing.discretise import discretise

from .parts import AREA, DATA, MESHES

needs_gmsh = pytest.mark.skipif(bool(why_no_gmsh()), reason=why_no_gmsh())
ONLY_GMSH = ("saveall.msh", "part.geo")
"""meshio reads neither .geo files, nor those of SaveAll that have groups for some of their cells only."""
UNNAMED = ("untagged.msh", "quadratic.msh")


@pytest.fixture(params=["gmsh", "meshio"])
def reader(request, without) -> str:
    if request.param == "meshio":
        without("gmsh")
    elif why_no_gmsh():
        pytest.skip(why_no_gmsh())
    return request.param


@pytest.mark.parametrize("name", MESHES)
def test_every_file_is_the_same_part(name: str, reader: str) -> None:
    if reader == "meshio" and name in ONLY_GMSH:
        pytest.skip("meshio cannot read it")
    shape = MeshFile(str(DATA / name)).shape
    # arcs are those through points of 16 digits
    assert discretise(shape.outline(), n_elements=100).area == pytest.approx(AREA, rel=1e-12)
    kinds = [[type(side) for side in loop.sides] for loop in shape.loops]
    assert kinds == [[LineTo, LineTo, ArcTo, LineTo, LineTo], [ArcTo] * (1 if name in UNNAMED else 2)]
    names = [[side.name for side in loop.sides] for loop in shape.loops]
    if name in UNNAMED:
        assert names == [[f"side-{k}" for k in range(1, 6)], ["side-6"]]
        assert "its curves are not in the file" in shape.notes[0]
    else:
        assert names == [["foot", "wall-1", "side-3", "side-4", "wall-2"], ["hole-1", "hole-2"]]
        assert shape.outline().selectable_names[:2] == ("wall", "hole")


def square(nodes: list[int], cells: dict[str, list[list[int]]], points: object = None) -> meshio.Mesh:
    corners = np.array([[0, 0], [1, 0], [1, 1], [0, 1]], float) if points is None else np.array(points, float)
    return meshio.Mesh(corners[nodes] if nodes else corners, [(kind, np.array(own)) for kind, own in cells.items()])


def stored(mesh: meshio.Mesh, folder: Path, name: str = "body.vtk") -> str:
    mesh.write(folder / name)
    return str(folder / name)


@needs_gmsh
def test_a_pipe_that_breaks_afterwards_is_an_error_as_ever() -> None:
    code = f"""
import os
from bemkit.geometry.files.shape_file import MeshFile
MeshFile({str(DATA / ONLY_GMSH[1])!r}).shape
read, write = os.pipe()
os.close(read)
try:
    os.write(write, b"x")
except BrokenPipeError:
    print("an error")
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert (done.stdout, done.returncode) == ("an error\n", 0)


def test_clockwise_triangles_and_mixed_lines_are_turned_and_said(tmp_path) -> None:
    clockwise = square([], {"triangle": [[0, 2, 1], [0, 3, 2]]})
    shape = MeshFile(stored(clockwise, tmp_path)).shape
    assert any("run clockwise: turned" in note for note in shape.notes)
    assert discretise(shape.outline(), n_elements=8).area == pytest.approx(1.0, rel=1e-15)
    mixed = square([], {"line": [[0, 1], [2, 1], [2, 3], [0, 3]]})
    shape = MeshFile(stored(mixed, tmp_path)).shape
    assert any("do not all run the same way round: turned" in note for note in shape.notes)
    assert discretise(shape.outline(), n_elements=8).area == pytest.approx(1.0, rel=1e-15)


def polygon_mesh(n: int) -> meshio.Mesh:
    angles = 2.0 * np.pi * np.arange(n) / n
    corners = np.column_stack([np.cos(angles), np.sin(angles)])
    return square([], {"line": [[k, (k + 1) % n] for k in range(n)]}, corners)


@pytest.mark.parametrize(
    ("n", "corner_angle", "is_round"), [(24, 25.0, True), (12, 25.0, False), (12, 31.0, True), (24, 0.0, False)]
)
def test_corner_angle_tells_circles_from_polygons(n: int, corner_angle: float, is_round: bool, tmp_path) -> None:
    shape = MeshFile(stored(polygon_mesh(n), tmp_path), corner_angle=corner_angle).shape
    assert len(shape.outline().sides) == (1 if is_round else n)


def test_chords_of_a_smooth_curve_become_a_spline(tmp_path) -> None:
    angles = 2.0 * np.pi * np.arange(60) / 60
    ellipse = np.column_stack([2.0 * np.cos(angles), np.sin(angles)])
    mesh = square([], {"line": [[k, (k + 1) % 60] for k in range(60)]}, ellipse)
    shape = MeshFile(stored(mesh, tmp_path)).shape
    assert [type(side) for side in shape.loops[0].sides] == [SplineTo]
    assert shape.notes == ("1 spline through the ends of straight pieces of the mesh",)
    # the polygon itself is 0.2 % off
    assert discretise(shape.outline(), n_elements=60).area == pytest.approx(2.0 * np.pi, rel=2e-6)


def test_smooth_joints_of_lines_and_arcs_are_found(tmp_path) -> None:
    bow = np.pi * (np.arange(21) / 20 - 0.5)
    right = np.column_stack([2.0 + np.cos(bow), np.sin(bow)])
    stadium = np.vstack([right, [[1.0, 1.0]], -right, [[-1.0, -1.0]]])
    n = len(stadium)
    mesh = square([], {"line": [[k, (k + 1) % n] for k in range(n)]}, stadium)
    shape = MeshFile(stored(mesh, tmp_path)).shape
    assert sorted(type(side).__name__ for side in shape.loops[0].sides) == ["ArcTo", "ArcTo", "LineTo", "LineTo"]
    assert discretise(shape.outline(), n_elements=60).area == pytest.approx(8.0 + np.pi, rel=1e-12)


def test_only_chooses_surfaces(tmp_path) -> None:
    points = [[0, 0], [1, 0], [1, 1], [0, 1], [2, 0], [2, 1]]
    mesh = square([], {"quad": [[0, 1, 2, 3], [1, 4, 5, 2]]}, points)
    mesh.cell_sets = {"left": [np.array([0])], "right": [np.array([1])]}
    name = stored(mesh, tmp_path, "two.inp")
    for only, width in ((), 2.0), (("left",), 1.0), (("left", "right"), 2.0):
        shape = MeshFile(name, only=only).shape
        assert discretise(shape.outline(), n_elements=8).area == pytest.approx(width, rel=1e-15)
    with pytest.raises(GeometryError, match=r"two.inp: only names 'middle': the names of its surfaces are left, right"):
        _ = MeshFile(name, only=("middle",)).shape


def test_scale(tmp_path) -> None:
    shape = MeshFile(stored(polygon_mesh(24), tmp_path), scale=1e-3).shape
    assert discretise(shape.outline(), n_elements=24).area == pytest.approx(np.pi * 1e-6, rel=1e-12)


REFUSED = {
    "three-dimensional": (
        square([], {"triangle": [[0, 1, 2]]}, [[0, 0, 0], [1, 0, 0], [0, 1, 2]]),
        r"body.vtk: it is three-dimensional, with z from 0 to 2: bemkit solves plane problems; give a plane mesh",
    ),
    "solid": (
        square([], {"tetra": [[0, 1, 2, 3]]}, np.zeros((4, 3))),
        r"it has cells of type 'tetra': bemkit solves plane problems",
    ),
    "empty": (
        square([], {"vertex": [[0]]}),
        r"it is empty, without lines, triangles or quadrilaterals: mesh the surface",
    ),
    "open": (
        square([], {"line": [[0, 1], [1, 2]]}),
        r"1 lines of its boundary meet at \(0, 0\): the boundary must be closed",
    ),
    "crowded": (
        square([], {"triangle": [[0, 1, 2], [0, 1, 3], [1, 0, 2]]}),
        r"three or more of its cells share the side at \(.*\): mesh the surface once",
    ),
    "crossing": (
        square([], {"line": [[0, 1], [1, 3], [3, 2], [2, 0]]}),
        r"side 'side-\d' and side 'side-\d' cross, touch or fold back",
    ),
}


@pytest.mark.parametrize("case", REFUSED)
def test_refused(case: str, tmp_path) -> None:
    mesh, message = REFUSED[case]
    with pytest.raises(GeometryError, match=message):
        _ = MeshFile(stored(mesh, tmp_path)).shape


def test_cells_of_other_types_are_named(tmp_path, without) -> None:
    without("gmsh")
    mesh = meshio.Mesh(np.random.default_rng(0).random((25, 2)), [("quad25", np.arange(25)[None])])
    mesh.write(tmp_path / "body.msh", file_format="gmsh22")
    with pytest.raises(GeometryError, match=r"it has cells of type 'quad25': give lines, triangles and quadrilaterals"):
        _ = MeshFile(str(tmp_path / "body.msh")).shape


def test_files_that_are_none(tmp_path) -> None:
    with pytest.raises(GeometryError, match=r"nowhere.msh: no such file: give the path of a mesh or drawing"):
        _ = MeshFile(str(tmp_path / "nowhere.msh")).shape
    for name in ("part.dxf", "body.vtk"):
        (tmp_path / name).write_text("hello")
    with pytest.raises(GeometryError, match=r"part.dxf: it is a drawing: write kind = 'drawing'"):
        _ = MeshFile(str(tmp_path / "part.dxf")).shape
    with pytest.raises(
        GeometryError, match=r"body.vtk: it cannot be read \(.*\): give a mesh file of a format that meshio"
    ):
        _ = MeshFile(str(tmp_path / "body.vtk")).shape


def test_numbers_out_of_range() -> None:
    for wrong, message in (
        ({"scale": 0.0}, r"file: scale is 0.0: give a positive"),
        ({"corner_angle": 180.0}, r"corner_angle is 180.0: give degrees from 0 to less than 180"),
    ):
        with pytest.raises(GeometryError, match=message):
            MeshFile("part.msh", **wrong)
    with pytest.raises(GeometryError, match=r"file: tolerance is -1.0: give a positive"):
        DrawingFile("part.dxf", tolerance=-1.0)


def test_missing_packages_say_what_to_install(without) -> None:
    without("gmsh", "meshio")
    with pytest.raises(
        GeometryError, match=r'meshio is not installed: .*"bemkit\[mesh\]"; .*gmsh is not installed: .*"bemkit\[mesh\]"'
    ):
        _ = MeshFile(str(DATA / "version-4.msh")).shape
    with pytest.raises(GeometryError, match=r'part.geo: gmsh is not installed: pip install "bemkit\[mesh\]"'):
        _ = MeshFile(str(DATA / "part.geo")).shape


def test_library_of_gmsh_that_cannot_be_loaded_is_named(monkeypatch) -> None:
    class Broken:
        def find_spec(self, name: str, path: object = None, target: object = None) -> None:
            if name == "gmsh":
                raise OSError("libGLU.so.1: cannot open shared object file")

    monkeypatch.setattr(importlib.util, "find_spec", lambda name: types.SimpleNamespace())
    monkeypatch.delitem(sys.modules, "gmsh", raising=False)
    monkeypatch.setattr(sys, "meta_path", [Broken(), *sys.meta_path])
    assert re.match(r"gmsh cannot be loaded \(libGLU.so.1: .*\): install that library", why_no_gmsh())
    shape = MeshFile(str(DATA / "version-4.msh")).shape  # meshio takes its place
    assert shape.loops[0].sides[0].name == "foot"


@needs_gmsh
@pytest.mark.parametrize("call", ['SystemCall "touch x";', 'Include "other.geo";', "Merge 'a.step';", "Plugin(X).Run;"])
def test_geo_files_that_call_others_are_not_run(call: str, tmp_path) -> None:
    (tmp_path / "part.geo").write_text(f"// no SystemCall here\n{call}\n")
    with pytest.raises(GeometryError, match=rf"it says {call.split()[0].split('(')[0]}: .geo files that call programs"):
        _ = MeshFile(str(tmp_path / "part.geo")).shape


@needs_gmsh
def test_msh_files_that_are_none_are_not_run_as_geo_files(tmp_path) -> None:
    (tmp_path / "part.msh").write_text("Point(1) = {0, 0, 0};\n")
    with pytest.raises(GeometryError, match=r"it cannot be read: a .msh file begins with \$MeshFormat"):
        _ = MeshFile(str(tmp_path / "part.msh")).shape


@needs_gmsh
def test_gmsh_is_left_as_it_was() -> None:
    import gmsh

    gmsh.initialize([], readConfigFiles=False, interruptible=False)
    try:
        gmsh.model.add("mine")
        gmsh.model.geo.addPoint(0.0, 0.0, 0.0)
        _ = MeshFile(str(DATA / "part.geo")).shape
        assert gmsh.model.getCurrent() == "mine"
        assert gmsh.model.list().count("part") == 0
    finally:
        gmsh.finalize()


@needs_gmsh
def test_geometries_that_are_no_plane_body(tmp_path) -> None:
    for text, message in (
        ("Point(1) = {0, 0, 0};\n", r"it is empty, without curves: draw a closed outline"),
        (
            'SetFactory("OpenCASCADE"); Box(1) = {0, 0, 0, 1, 1, 1};\n',
            r"it holds a solid: bemkit solves plane problems",
        ),
        ('SetFactory("OpenCASCADE"); Rectangle(1) = {0, 0, 0, 1, 1};\n', ""),
        ("Point(1) = {0, 0\n", r"gmsh cannot read it \(.*\): export it again"),
    ):
        (tmp_path / "part.geo").write_text(text)
        if not message:
            assert MeshFile(str(tmp_path / "part.geo")).shape.unit == ""
            with pytest.raises(GeometryError, match=r"only names 'steel': the names of its surfaces are none"):
                _ = MeshFile(str(tmp_path / "part.geo"), only=("steel",)).shape
            continue
        with pytest.raises(GeometryError, match=message):
            _ = MeshFile(str(tmp_path / "part.geo")).shape


OLD_SAVE_ALL = """$MeshFormat
2.2 0 8
$EndMeshFormat
$PhysicalNames
2
1 1 "floor"
2 2 "body"
$EndPhysicalNames
$Nodes
4
1 0 0 0
2 1 0 0
3 1 1 0
4 0 1 0
$EndNodes
$Elements
6
1 1 2 0 1 1 2
2 1 2 0 2 2 3
3 1 2 0 3 3 4
4 1 2 0 4 4 1
5 2 2 0 1 1 2 3
6 2 2 0 1 1 3 4
$EndElements
"""


def test_groups_that_a_file_names_without_saying_what_is_in_them_are_told(reader: str, tmp_path: Path) -> None:
    path = tmp_path / "old.msh"
    path.write_text(OLD_SAVE_ALL, "utf-8")
    shape = MeshFile(str(path)).shape
    assert [side.name for side in shape.loops[0].sides] == ["side-1", "side-2", "side-3", "side-4"]
    (note,) = (note for note in shape.notes if "groups" in note)
    assert note == (
        "its groups floor, body have no cells, as gmsh writes version 2 with SaveAll: save it as version 4, or without "
        "SaveAll"
    )
    path.write_text(OLD_SAVE_ALL.replace("1 1 2 0 1 1 2", "1 1 2 1 1 1 2"), "utf-8")
    assert not any("groups" in note for note in MeshFile(str(path)).shape.notes)
