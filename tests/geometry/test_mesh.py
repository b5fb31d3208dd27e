import pickle

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bemkit.errors import UnknownPartError
from bemkit.geometry.curves import Arc
from bemkit.geometry.mesh import BoundaryMesh
from bemkit.geometry.meshing.discretise import Geometric, discretise
from bemkit.geometry.outline import Selection
from bemkit.geometry.shapes import Disk, ExteriorOf, PlateWithHole, Polygon, Rectangle, Ring

from .strategies import angles, closed, polygon_area, rotation, sizes, star_polygons

EVERY = np.array([-1.0, -0.3, 0.0, 0.8, 1.0])


def plate(n_elements: int = 60) -> BoundaryMesh:
    parts = {"support": Selection(("bottom",)), "hole": Selection(("hole-1", "hole-2"))}
    return discretise(PlateWithHole(2.0, 1.0, 0.25).outline(), n_elements=n_elements, parts=parts)


def divided(vertices, n_per_side: int):
    """Return points that divide each side of a polygon evenly."""
    steps = np.arange(n_per_side)[:, None] / n_per_side
    following = np.roll(vertices, -1, axis=0)
    return np.concatenate([(1 - steps) * a + steps * b for a, b in zip(vertices, following, strict=True)])


@given(star_polygons(), sizes, angles, st.floats(-1e3, 1e3), st.integers(1, 4), st.randoms(use_true_random=False))
def test_any_numbering_of_a_polygon_has_its_area_and_closes(vertices, size, angle, shift, n_per_side, random) -> None:
    nodes = size * (divided(vertices, n_per_side) @ rotation(angle).T + shift)
    n = len(nodes)
    place, order = list(range(n)), list(range(n))
    random.shuffle(place)
    random.shuffle(order)
    shuffled = np.empty_like(nodes)
    shuffled[place] = nodes
    mesh = BoundaryMesh(shuffled, np.array(place)[closed(n)][order])
    # a body a thousand diameters away loses three digits of its coordinates
    assert mesh.area == pytest.approx(size**2 * polygon_area(vertices), rel=0.0, abs=1e-11 * size**2)
    assert np.allclose((mesh.lengths[:, None] * mesh.normals).sum(axis=0), 0.0, rtol=0.0, atol=1e-11 * size)
    assert np.allclose((mesh.normals * mesh.tangents).sum(axis=1), 0.0, rtol=0.0, atol=1e-15)
    (loop,) = mesh.loops
    assert loop[0] == 0
    assert np.array_equal(mesh.elements[loop, 1], mesh.elements[np.roll(loop, -1), 0])
    assert np.array_equal(mesh.elements[mesh.node_elements[:, 1], 0], np.arange(n))
    assert np.array_equal(mesh.elements[mesh.node_elements[:, 0], 1], np.arange(n))


@pytest.mark.parametrize("make", [Disk(1.0), Ring(0.5, 1.0), PlateWithHole(2, 1, 0.25), ExteriorOf(Disk(1.0))])
def test_curved_elements_close_and_their_normals_leave_the_body(make) -> None:
    mesh = discretise(make.outline(), n_elements=24)
    xi, weights = np.polynomial.legendre.leggauss(12)
    everyone = np.arange(mesh.n_elements)
    normals, jacobian = mesh.normals_at(everyone, xi), mesh.jacobian(everyone, xi)
    x = mesh.points(everyone, xi)
    assert np.allclose(np.einsum("eq,eqk,q->k", jacobian, normals, weights), 0.0, rtol=0.0, atol=1e-13)
    # divergence theorem: the integral of x . n is twice the area
    flux = np.einsum("eq,eqk,eqk,q->", jacobian, normals, x, weights)
    assert flux == pytest.approx(2.0 * mesh.loop_areas.sum(), rel=1e-13)
    assert np.allclose(jacobian @ weights, mesh.lengths, rtol=1e-13)


def test_points_run_from_start_to_end_and_derivatives_are_theirs() -> None:
    mesh = plate()
    everyone = np.arange(mesh.n_elements)
    x = mesh.points(everyone, EVERY)
    assert x.shape == (60, 5, 2)
    assert np.allclose(x[:, 0], mesh.start, rtol=0.0, atol=1e-15)
    assert np.allclose(x[:, -1], mesh.end, rtol=0.0, atol=1e-15)
    assert np.array_equal(x[:, 2], mesh.centres)
    step = 1e-5
    differences = (mesh.points(everyone, EVERY + step) - mesh.points(everyone, EVERY - step)) / (2 * step)
    assert np.allclose(mesh.derivatives(everyone, EVERY), differences, rtol=0.0, atol=1e-10)  # round-off over step


def test_some_elements_in_any_order() -> None:
    mesh = plate()
    chosen = np.array([59, 0, 45, 0])
    assert np.array_equal(mesh.points(chosen, EVERY), mesh.points(np.arange(60), EVERY)[chosen])
    assert np.array_equal(mesh.normals_at(chosen, EVERY), mesh.normals_at(np.arange(60), EVERY)[chosen])


def test_straight_elements_have_constant_normals_out_of_the_body() -> None:
    mesh = discretise(Rectangle(2.0, 1.0).outline(), n_elements=6)
    assert mesh.normals.tolist() == [[0, -1], [0, -1], [1, 0], [0, 1], [0, 1], [-1, 0]]
    assert np.array_equal(mesh.normals_at(np.arange(6), EVERY), np.repeat(mesh.normals[:, None], 5, axis=1))
    assert mesh.jacobian(np.array([0]), EVERY).tolist() == [[0.5] * 5]
    assert mesh.is_straight.all()
    assert mesh.diameter == np.hypot(2.0, 1.0)
    assert mesh.centre.tolist() == [1.0, 0.5]


def test_loops_and_their_areas() -> None:
    mesh = discretise(Ring(1.0, 2.0).outline(), n_elements=30)
    assert [len(loop) for loop in mesh.loops] == [20, 10]
    assert np.allclose(mesh.loop_areas, [4 * np.pi, -np.pi], rtol=1e-14)
    assert not mesh.is_straight.any()
    assert discretise(ExteriorOf(Disk(1.0)).outline(), n_elements=8).area == np.inf


def test_arrays_are_read_only_and_not_the_callers() -> None:
    nodes = np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]])
    mesh = BoundaryMesh(nodes, closed(3), {"part": [2, 0]})
    nodes[0] = 5.0
    assert mesh.nodes[0].tolist() == [0.0, 0.0]
    assert mesh.part("part").tolist() == [0, 2]
    for array in (
        mesh.nodes,
        mesh.elements,
        mesh.part("part"),
        mesh.lengths,
        mesh.centres,
        mesh.normals,
        mesh.loops[0],
    ):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 0
    with pytest.raises(TypeError, match="does not support item assignment"):
        mesh.parts["other"] = np.array([1])


def test_unknown_part_lists_the_parts() -> None:
    with pytest.raises(UnknownPartError, match=r"there is no part 'top': the parts are 'support', 'hole'"):
        plate().part("top")
    with pytest.raises(UnknownPartError, match=r"the parts are none"):
        discretise(Disk(1.0).outline(), n_elements=8).part("top")


def test_mesh_survives_pickling() -> None:
    mesh = plate()
    copy = pickle.loads(pickle.dumps(mesh))
    assert np.array_equal(copy.points(np.arange(60), EVERY), mesh.points(np.arange(60), EVERY))
    assert list(copy.parts) == list(mesh.parts)
    assert not copy.nodes.flags.writeable


@given(star_polygons(), sizes, angles)
def test_sides_a_millionth_of_an_element_apart_are_legal(vertices, size, angle) -> None:
    # a slit from the first vertex towards the inside, with faces 1e-6 of its length apart at the mouth
    first, before = vertices[0], vertices[-1]
    inner = 0.5 * first
    lip = first + 1e-6 * np.linalg.norm(inner) / np.linalg.norm(before - first) * (before - first)
    nodes = size * np.concatenate([[first], vertices[1:], [lip, inner]]) @ rotation(angle).T
    mesh = BoundaryMesh(nodes, closed(len(nodes)))
    assert mesh.area < size**2 * polygon_area(vertices)


@pytest.mark.parametrize("corner", [(0.0, 0.0), (0.4, -0.3)])
@pytest.mark.parametrize("scale", [1e-9, 1.0, 1e9])
@pytest.mark.parametrize("angle", [0.0, 0.3])
def test_grading_by_1e12_is_legal(corner, scale: float, angle: float) -> None:
    points = scale * np.array([[0.0, 0.0], [1.0, 0.0], [0.7, 0.2], [0.0, 1.0]]) @ rotation(angle).T + scale * np.array(
        corner
    )
    outline = Polygon(tuple(map(tuple, points.tolist()))).outline()
    mesh = discretise(outline, n_elements=400, grading=Geometric(0.5, 40))
    assert mesh.lengths.max() / mesh.lengths.min() > 1e12
    assert mesh.lengths.sum() == pytest.approx(np.hypot(*(np.roll(points, -1, axis=0) - points).T).sum(), rel=1e-13)


def test_curved_mesh_graded_by_1e10_is_legal() -> None:
    mesh = discretise(Ring(1.0, 1.0 + 1e-6).outline(), n_elements=600, grading=Geometric(0.5, 32))
    assert mesh.lengths.max() / mesh.lengths.min() > 1e9
    # parameters next to 1 are known to 1e-16, elements of 1e-10 to 1e-6; they add up without loss
    assert mesh.lengths.sum() == pytest.approx(2 * np.pi * (2.0 + 1e-6), rel=1e-13)


@given(star_polygons(), sizes, st.floats(-1.0, 1.0), st.floats(-1.0, 1.0))
def test_transformed(vertices, factor, x, y) -> None:
    mesh = BoundaryMesh(vertices, closed(len(vertices)), {"first": [0]})
    moved = mesh.transformed((x, y), factor)
    assert np.array_equal(moved.nodes, (vertices - [x, y]) * factor)
    assert moved.area == pytest.approx(mesh.area * factor**2, rel=0.0, abs=1e-14 * factor**2)
    assert moved.part("first").tolist() == [0]
    assert np.allclose(moved.normals, mesh.normals, rtol=0.0, atol=1e-14)  # coordinates near 1, elements above 0.1


@pytest.mark.parametrize("distance", [0.0, 1.0, 1e6])
def test_transformed_curves_follow(distance: float) -> None:
    mesh = discretise(PlateWithHole(2, 1, 0.25, (distance, -distance)).outline(), n_elements=60)
    moved = mesh.transformed((distance, -distance), 1e-3)
    assert moved.is_exterior == mesh.is_exterior
    assert np.array_equal(moved.is_straight, mesh.is_straight)
    # the digits of coordinates that were 1e6 away are lost for good: 1e-10
    tolerance = 1e-16 * max(distance, 1.0) * 10
    expected = (mesh.points(np.arange(60), EVERY) - [distance, -distance]) * 1e-3
    assert np.allclose(moved.points(np.arange(60), EVERY), expected, rtol=0.0, atol=tolerance)
    assert moved.area == pytest.approx(1e-6 * (2 - np.pi / 16), rel=1e-15 * max(distance, 1.0) * 10)
    again = moved.transformed((0.0, 0.0), 1e3).refined(np.arange(60))
    assert again.area == pytest.approx(2 - np.pi / 16, rel=1e-15 * max(distance, 1.0) * 10)


def test_exterior_stays_exterior() -> None:
    mesh = discretise(ExteriorOf(Rectangle(1, 1)).outline(), n_elements=8)
    assert mesh.is_exterior
    assert mesh.refined(np.array([0])).is_exterior
    assert mesh.transformed((1.0, 1.0), 2.0).is_exterior
    assert mesh.normals[0].tolist() == [1.0, 0.0]  # on the left side of the hole, out of the body, into the hole


def test_two_half_circles_are_a_mesh() -> None:
    arcs = (Arc((0, 0), 1, 0, np.pi), Arc((0, 0), 1, np.pi, 2 * np.pi))
    mesh = BoundaryMesh([[1, 0], [-1, 0]], closed(2), {}, arcs, [0, 1], [[0, 1], [0, 1]])
    assert mesh.area == pytest.approx(np.pi, rel=1e-14)
    assert mesh.diameter == pytest.approx(np.sqrt(8))
