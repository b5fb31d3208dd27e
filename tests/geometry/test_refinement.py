import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bemkit.geometry.mesh import BoundaryMesh
from bemkit.geometry.meshing.discretise import discretise
from bemkit.geometry.outline import Selection
from bemkit.geometry.shapes import PlateWithHole, Rectangle

from .strategies import closed, star_polygons

PARTS = {"left": Selection(("left",)), "hole": Selection(("hole-2", "hole-3")), "low": Selection(("bottom",))}
PLATE = discretise(PlateWithHole(2.0, 1.0, 0.25).outline(), n_elements=40, parts=PARTS)


@given(st.sets(st.integers(0, 39)))
def test_refinement_keeps_body_parts_and_order(marked: set[int]) -> None:
    refined = PLATE.refined(np.array(sorted(marked), dtype=int))
    assert refined.n_elements == 40 + len(marked)
    assert refined.area == pytest.approx(PLATE.area, rel=1e-14)
    assert refined.lengths.sum() == pytest.approx(PLATE.lengths.sum(), rel=1e-14)
    for name, members in PLATE.parts.items():
        length = PLATE.lengths[members].sum()
        assert refined.lengths[refined.part(name)].sum() == pytest.approx(length, rel=1e-14)
        assert len(refined.part(name)) == len(members) + len(marked & set(members.tolist()))
    # node i still starts element i, and elements still run along each loop
    assert np.array_equal(refined.elements[:, 0], np.arange(refined.n_elements))
    assert np.array_equal(np.concatenate(refined.loops), np.arange(refined.n_elements))
    # points of the old mesh stay nodes
    kept = {tuple(node) for node in refined.nodes.tolist()}
    assert {tuple(node) for node in PLATE.nodes.tolist()} <= kept


@given(star_polygons(), st.randoms(use_true_random=False))
def test_refinement_of_any_numbering(vertices, random) -> None:
    n = len(vertices)
    place, order = list(range(n)), list(range(n))
    random.shuffle(place)
    random.shuffle(order)
    nodes = np.empty_like(vertices)
    nodes[place] = vertices
    mesh = BoundaryMesh(nodes, np.array(place)[closed(n)][order], {"some": order[: n // 2]})
    marked = np.array(order[::2])
    refined = mesh.refined(marked)
    assert refined.area == pytest.approx(mesh.area, rel=0.0, abs=1e-15)
    # each element, whole or in halves, stands where it stood
    source = np.repeat(np.arange(n), 1 + np.isin(np.arange(n), marked))
    lengths = np.bincount(source, weights=refined.lengths)
    assert np.allclose(lengths, mesh.lengths, rtol=1e-13)
    assert sorted(set(source[refined.part("some")].tolist())) == mesh.part("some").tolist()


def test_halves_of_straight_and_curved_elements() -> None:
    mesh = discretise(Rectangle(2.0, 1.0).outline(), n_elements=4)
    refined = mesh.refined(np.array([0, 0]))
    assert refined.nodes.tolist() == [[0, 0], [1, 0], [2, 0], [2, 1], [0, 1]]
    assert refined.elements.tolist() == [[0, 1], [1, 2], [2, 3], [3, 4], [4, 0]]
    everyone = PLATE.refined(np.arange(40))
    curved = ~everyone.is_straight
    radii = np.hypot(*(everyone.nodes[everyone.elements[curved]] - [1.0, 0.5]).T)
    assert np.allclose(radii, 0.25, rtol=1e-14)
    assert np.allclose(everyone.lengths[::2], 0.5 * PLATE.lengths, rtol=1e-14)


def test_refining_towards_a_corner_at_the_origin_never_ends_early() -> None:
    mesh = discretise(Rectangle(1.0, 1.0).outline(), n_elements=4)
    for _ in range(60):  # down to 1e-18: the digits at the origin are fine enough
        mesh = mesh.refined(mesh.node_elements[0])
    assert mesh.lengths.min() == 2.0**-60
    assert mesh.area == 1.0
