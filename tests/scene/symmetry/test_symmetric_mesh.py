"""Meshes of one side of symmetry lines: what they know of the whole body, and what they refuse."""

from __future__ import annotations

import pickle

import numpy as np
import pytest

import bemkit as bk
from bemkit.errors import GeometryError
from bemkit.geometry.files.meshio_files import read_mesh, write_mesh
from bemkit.geometry.neighbours import along_boundary, break_nodes, corner_nodes
from bemkit.geometry.outline import Selection
from bemkit.geometry.spaces import BoundarySpace, ConstantSpace, LinearSpace, QuadraticSpace

PLATE = bk.PlateWithHole(2.0, 3.0, 0.3, (5.0, -1.0))
CASES = [
    (bk.Rectangle(1.0, 2.0), bk.Symmetry(x=0.5)),
    (bk.Rectangle(1.0, 2.0), bk.Symmetry(x=0.5, y=1.0)),
    (bk.Disk(1.3, (5.0, 0.1)), bk.Symmetry(y=0.1)),
    (bk.Ring(0.5, 1.0), bk.Symmetry(x=0.0, y=0.0)),
    (PLATE, bk.Symmetry(x=6.0)),
    (PLATE, bk.Symmetry(x=6.0, y=0.5)),
]
WHOLE = pytest.mark.parametrize(("shape", "symmetry"), CASES, ids=lambda value: str(value))


def halved(shape: bk.Rectangle, symmetry: bk.Symmetry, n_elements: int = 48) -> bk.BoundaryMesh:
    return bk.discretise(shape.outline(), n_elements=n_elements, symmetry=symmetry)


@WHOLE
def test_it_knows_the_whole_body(shape: bk.Rectangle, symmetry: bk.Symmetry) -> None:
    mesh, whole = halved(shape, symmetry), bk.discretise(shape.outline(), n_elements=48)
    n = mesh.n_elements
    assert n * symmetry.n_images == mesh.whole.n_elements == whole.n_elements
    assert mesh.area == pytest.approx(whole.area, rel=1e-14)
    assert mesh.diameter == pytest.approx(whole.diameter, rel=1e-14)
    assert np.allclose(mesh.centre, whole.centre, rtol=1e-15)
    assert np.allclose(mesh.loop_areas, whole.loop_areas, rtol=1e-14)
    assert np.array_equal(mesh.whole.nodes[: mesh.n_nodes], mesh.nodes)
    for g, signs in enumerate(symmetry.images):
        centres = mesh.whole.centres[g * n : g * n + n]
        assert np.allclose(centres, symmetry.reflected(mesh.centres, signs), rtol=0.0, atol=1e-14)
        normals = mesh.whole.normals[g * n : g * n + n]
        assert np.allclose(normals, signs * mesh.normals, rtol=0.0, atol=1e-13)
    assert not symmetry.is_beyond(mesh.centres).any()


@WHOLE
def test_moved_refined_and_pickled_meshes_keep_it(shape: bk.Rectangle, symmetry: bk.Symmetry) -> None:
    mesh = halved(shape, symmetry)
    moved = mesh.transformed((3.0, -4.0), 0.1)
    assert moved.area == pytest.approx(0.01 * mesh.area, rel=1e-13)
    assert moved.symmetry == symmetry.transformed((3.0, -4.0), 0.1)
    refined = mesh.refined(np.arange(1, mesh.n_elements, 2))
    assert refined.area == pytest.approx(mesh.area, rel=1e-13)
    assert refined.symmetry == symmetry
    assert refined.n_elements == mesh.n_elements + mesh.n_elements // 2
    copy = pickle.loads(pickle.dumps(mesh))
    assert copy.symmetry == symmetry
    assert np.array_equal(copy.whole.nodes, mesh.whole.nodes)


@WHOLE
def test_loops_run_from_line_to_line(shape: bk.Rectangle, symmetry: bk.Symmetry) -> None:
    mesh = halved(shape, symmetry)
    assert sorted(np.concatenate(mesh.loops).tolist()) == list(range(mesh.n_elements))
    for loop in mesh.loops:
        assert np.array_equal(mesh.elements[loop[1:], 0], mesh.elements[loop[:-1], 1])
        assert mesh.on_symmetry_lines[mesh.elements[loop[[0, -1]], [0, 1]]].any(axis=1).all()
    assert np.array_equal(np.sort(along_boundary(mesh, np.arange(mesh.n_elements))), np.arange(mesh.n_elements))


def test_a_hole_beside_the_line_stands_for_two() -> None:
    outer = bk.Rectangle(4.0, 2.0, (-2.0, -1.0)).outline().loops[0]
    holes = [
        tuple(
            bk.geometry.Side(f"{name}-{side.name}", side.curve) for side in bk.Ring(0.3, 0.5, centre).outline().loops[1]
        )
        for name, centre in (("west", (-1.0, 0.0)), ("east", (1.0, 0.0)))
    ]
    outline = bk.geometry.Outline((outer, *holes))
    mesh = bk.discretise(outline, n_elements=80, symmetry=bk.Symmetry(x=0.0))
    assert [float(np.round(area, 12)) for area in mesh.loop_areas] == [8.0, float(np.round(-np.pi * 0.09, 12))]
    assert mesh.area == pytest.approx(8.0 - 2.0 * np.pi * 0.09, rel=1e-14)


@WHOLE
def test_spaces_number_every_dof_once(shape: bk.Rectangle, symmetry: bk.Symmetry) -> None:
    mesh = halved(shape, symmetry)
    spaces: list[BoundarySpace] = [ConstantSpace(mesh), LinearSpace(mesh), QuadraticSpace(mesh)]
    spaces += [LinearSpace(mesh, break_nodes(mesh)), QuadraticSpace(mesh, np.ones(mesh.n_nodes, bool))]
    for space in spaces:
        assert np.array_equal(np.unique(space.element_dofs), np.arange(space.n_dofs // 2))


def test_parts_beyond_the_line_are_empty() -> None:
    parts = {"left": Selection(("left",)), "right": Selection(("right",)), "top": Selection(("top",))}
    outline = bk.Rectangle(1.0, 1.0).outline()
    mesh = bk.discretise(outline, n_elements=40, parts=parts, symmetry=bk.Symmetry(x=0.5))
    assert mesh.part("right").size == 0
    assert mesh.part("left").size == 10
    assert mesh.whole.part("left").size == 20
    assert mesh.whole.part("top").size == 10


def half_square(**changes: object) -> bk.BoundaryMesh:
    nodes = np.array([[0.5, 1.0], [0.0, 1.0], [0.0, 0.0], [0.5, 0.0]])
    arguments = {"nodes": nodes, "elements": np.array([[0, 1], [1, 2], [2, 3]]), "symmetry": bk.Symmetry(x=0.5)}
    return bk.BoundaryMesh(**(arguments | changes))  # type: ignore[arg-type]


def test_elements_follow_the_boundary_however_they_are_numbered() -> None:
    mesh = half_square(elements=np.array([[2, 3], [1, 2], [0, 1]]))
    assert along_boundary(mesh, np.arange(3)).tolist() == [2, 1, 0]
    assert along_boundary(mesh, np.array([0, 1])).tolist() == [1, 0]


def test_a_line_through_a_corner_leaves_it_one() -> None:
    rhombus = bk.Polygon(((1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0)))
    for shape, is_corner in ((rhombus, True), (bk.Disk(1.0), False)):
        mesh = bk.discretise(shape.outline(), n_elements=32, symmetry=bk.Symmetry(x=0.0))
        assert (corner_nodes(mesh)[mesh.on_symmetry_lines[:, 0]] == is_corner).all()
        assert mesh.on_symmetry_lines.sum() == 2


def test_nodes_meet_the_line_to_the_last_digit() -> None:
    nodes = half_square().nodes + np.array([[1e-16, 0.0], [0.0, 0.0], [0.0, 0.0], [-1e-16, 0.0]])
    assert (half_square(nodes=nodes).nodes[[0, 3], 0] == 0.5).all()
    assert half_square(nodes=nodes).area == 1.0


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"symmetry": bk.Symmetry(x=0.6)}, "or lie on the symmetry line"),
        ({"elements": np.array([[0, 1], [1, 2], [2, 3], [3, 0]])}, "element 3 lies on the symmetry line"),
        ({"is_exterior": True}, "of an exterior is not supported"),
        ({"nodes": np.array([[0.5, 1.0], [0.0, 1.0], [0.6, 0.0], [0.5, 0.0]])}, "cross, touch or fold back"),
    ],
)
def test_what_is_no_half_of_a_body_is_refused(changes: dict[str, object], message: str) -> None:
    with pytest.raises(GeometryError, match=message):
        half_square(**changes)


def test_mesh_files_hold_the_whole_body(tmp_path: object) -> None:
    pytest.importorskip("meshio")
    path = f"{tmp_path}/half.msh"
    write_mesh(path, half_square())
    assert read_mesh(path).area == pytest.approx(1.0, rel=1e-14)
