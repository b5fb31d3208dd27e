"""What the mortar matrices promise, for every degree, straight and curved, wholly and partly covered."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bemkit.arrays import FloatArray
from bemkit.contact.mortar.coupling import MortarCoupling, NotFacingError, couple
from bemkit.contact.mortar.sides import ContactSide
from bemkit.errors import GeometryError
from bemkit.geometry.curves import Arc, Segment
from bemkit.geometry.local_values import dof_weights
from bemkit.geometry.mesh import BoundaryMesh
from bemkit.geometry.spaces import dof_points
from bemkit.geometry.vectors import cross
from tests.contact.mortar.pairs import block, chain, quadrangle, space_of
from tests.geometry.strategies import angles, rotation

degrees = st.integers(0, 8)
counts = st.integers(1, 9)
ROUND_OFF = 1e-13
"""Of means over at most a hundred nodes of degree 8."""


def side_of(mesh: BoundaryMesh, degree: int, part: str) -> ContactSide:
    return ContactSide(space_of(mesh, degree), mesh.part(part))


def stacked(
    degrees: tuple[int, int],
    n: tuple[int, int],
    *,
    shift: float = 0.0,
    lift: float = 0.0,
    turn: FloatArray | None = None,
) -> tuple[ContactSide, ContactSide]:
    """The bottom of an upper block of width 1, and the top of a lower one of width 1 that is shifted to the right."""
    upper = block((0.0, lift), (1.0, lift + 1.0), n[0], 2, turn=turn)
    lower = block((shift, -1.0), (shift + 1.0, 0.0), n[1], 2, turn=turn)
    return side_of(upper, degrees[0], "bottom"), side_of(lower, degrees[1], "top")


def cradle(degrees: tuple[int, int], n: tuple[int, int], half_angle: float) -> tuple[ContactSide, ContactSide]:
    """A sector of a disc of radius 1 and a groove of the same radius, half an angle to both sides of the bottom."""
    low, high = 1.5 * np.pi - half_angle, 1.5 * np.pi + half_angle
    arc = Arc((0.0, 0.0), 1.0, low, high)
    (left, right), top = arc.point(np.array([0.0, 1.0])), (0.0, 0.5)
    sector = chain(
        ("pin", arc, np.linspace(0.0, 1.0, n[0] + 1)),
        ("right", Segment(tuple(right), top), np.linspace(0.0, 1.0, 3)),
        ("left", Segment(top, tuple(left)), np.linspace(0.0, 1.0, 3)),
    )
    groove, below = Arc((0.0, 0.0), 1.0, high, low), (0.0, -3.0)
    base = chain(
        ("groove", groove, np.linspace(0.0, 1.0, n[1] + 1)),
        ("left", Segment(tuple(left), below), np.linspace(0.0, 1.0, 3)),
        ("right", Segment(below, tuple(right)), np.linspace(0.0, 1.0, 3)),
    )
    return side_of(sector, degrees[0], "pin"), side_of(base, degrees[1], "groove")


def assert_sums_are_exact(coupling: MortarCoupling, covered: float, lost: float = 0.0) -> None:
    np.testing.assert_allclose(coupling.on_non_mortar.sum(axis=1), 1.0, atol=ROUND_OFF)
    np.testing.assert_allclose(coupling.on_mortar.sum(axis=1), 1.0, atol=ROUND_OFF)
    assert coupling.weights.min() > 0.0
    assert coupling.weights.sum() == pytest.approx(covered, rel=ROUND_OFF, abs=lost)
    assert np.all(np.diff(coupling.arc_length) > 0.0)
    turned = np.stack([-coupling.frame[:, 0, 1], coupling.frame[:, 0, 0]], axis=1)
    np.testing.assert_array_equal(coupling.frame[:, 1], turned)
    np.testing.assert_allclose(np.hypot(*coupling.frame[:, 0].T), 1.0, rtol=1e-14)


def assert_is_dual(side: ContactSide, coupling: MortarCoupling) -> None:
    """Every node of a side that is wholly covered has a multiplier, D is diagonal, weights are those of the basis."""
    off_diagonal = coupling.on_non_mortar.toarray()
    assert sorted(coupling.nodes) == sorted(set(side.dofs.ravel()))
    off_diagonal[np.arange(coupling.nodes.size), coupling.nodes] -= 1.0
    assert np.abs(off_diagonal).max() <= ROUND_OFF
    np.testing.assert_allclose(coupling.weights, dof_weights(side.space, side.elements)[coupling.nodes], rtol=1e-12)
    np.testing.assert_allclose(coupling.points, dof_points(side.space)[coupling.nodes], atol=1e-14)


@given(st.tuples(degrees, degrees), st.tuples(counts, counts), angles)
def test_straight_sides_that_cover_each_other(degree: tuple[int, int], n: tuple[int, int], angle: float) -> None:
    one, two = stacked(degree, n, turn=rotation(angle))
    coupling = couple(one, two)
    assert_sums_are_exact(coupling, 1.0)
    assert_is_dual(one, coupling)
    assert not coupling.gap.any()
    down = rotation(angle) @ np.array([0.0, -1.0])
    np.testing.assert_allclose(coupling.frame[:, 0], np.tile(down, (coupling.nodes.size, 1)), atol=1e-13)


@given(st.tuples(degrees, degrees), st.tuples(counts, counts), st.floats(0.2, 1.2))
@settings(max_examples=settings.default.max_examples // 3)
def test_arcs_that_cover_each_other(degree: tuple[int, int], n: tuple[int, int], half_angle: float) -> None:
    one, two = cradle(degree, n, half_angle)
    coupling = couple(one, two)
    assert_sums_are_exact(coupling, 2.0 * half_angle)
    assert_is_dual(one, coupling)
    assert not coupling.gap.any()
    np.testing.assert_allclose(coupling.frame[:, 0], coupling.points, atol=1e-2 if degree[0] == 0 else 1e-13)


@given(st.tuples(degrees.filter(bool), degrees.filter(bool)), st.tuples(counts, counts), st.floats(0.2, 1.2))
@settings(max_examples=settings.default.max_examples // 3)
def test_arcs_about_one_point_turn_without_a_gap(
    degree: tuple[int, int], n: tuple[int, int], half_angle: float
) -> None:
    one, two = cradle(degree, n, half_angle)
    for pair in ((one, two), (two, one)):
        coupling = couple(*pair)
        normal = coupling.frame[:, 0]
        for side, matrix in zip(pair, (coupling.on_non_mortar, coupling.on_mortar), strict=True):
            assert np.abs(cross(normal, matrix @ dof_points(side.space))).max() <= ROUND_OFF


@given(st.tuples(degrees, degrees), st.tuples(counts, counts), st.floats(-0.85, 0.85), angles)
def test_sides_that_cover_each_other_in_part(
    degree: tuple[int, int], n: tuple[int, int], shift: float, angle: float
) -> None:
    one, two = stacked(degree, n, shift=shift, turn=rotation(angle))
    coupling = couple(one, two)
    # pieces of 1e-10 belong to their neighbours; constants have no other node that would take a sliver
    assert_sums_are_exact(coupling, 1.0 - abs(shift), 1e-10 if degree[0] else 0.01 / n[0])
    # multipliers are means, not extrapolations
    assert np.abs(coupling.on_non_mortar).max() <= 1.0 + 1e-12
    assert np.linalg.matrix_rank(coupling.on_non_mortar.toarray()) == coupling.nodes.size


@given(degrees, st.tuples(counts, counts), st.floats(0.0, 0.9), st.data())
def test_nodes_without_multiplier_hand_it_over(
    degree: int, n: tuple[int, int], shift: float, data: st.DataObject
) -> None:
    one, two = stacked((degree, 1), (n[0] + 1, n[1]), shift=-shift)
    alone = couple(one, two).nodes
    # an element keeps at least one of its nodes
    without = data.draw(st.lists(st.sampled_from(alone.tolist()), max_size=min(degree, 4), unique=True))
    coupling = couple(one, two, without=np.array(without, np.intp))
    assert not set(without) & set(coupling.nodes)
    # a sliver is lost that no other node of its element can take
    assert_sums_are_exact(coupling, 1.0 - shift, 0.01 / (n[0] + 1))


def test_an_element_without_multipliers_is_left_out() -> None:
    one, two = stacked((1, 1), (4, 3))
    coupling = couple(one, two, without=one.dofs[0])
    assert coupling.weights.sum() == pytest.approx(0.75, rel=1e-14)
    assert coupling.nodes.tolist() == [2, 3, 4]


@pytest.mark.parametrize("degree", [1, 2, 5])
def test_means_of_polynomials_are_their_values_at_the_nodes(degree: int) -> None:
    """The mean by a dual function of what the basis represents is the nodal value; so the slope of a gap is exact."""
    wedge = quadrangle(np.array([[0.0, -1.0], [1.0, -1.0], [1.0, -0.3], [0.0, -0.1]]), [np.linspace(0, 1, 4)] * 4)
    upper = block((0.0, 0.0), (1.0, 1.0), 5, 2)
    one, two = side_of(upper, degree, "bottom"), side_of(wedge, degree, "top")
    coupling = couple(one, two)
    half = 0.5 * np.arctan(0.2)
    direction = np.array([-np.sin(half), -np.cos(half)])
    np.testing.assert_allclose(coupling.frame[:, 0], np.tile(direction, (coupling.nodes.size, 1)), atol=1e-14)
    is_dual = coupling.points[:, 0] > 0.21  # the first of five elements is partly ahead of the end of the wedge
    points = coupling.points[is_dual]
    gap = (0.1 + 0.2 * points[:, 0]) / (np.cos(half) + 0.2 * np.sin(half))
    np.testing.assert_allclose(coupling.gap[is_dual], gap, rtol=1e-12)
    partners = (coupling.on_mortar @ dof_points(two.space))[is_dual]
    np.testing.assert_allclose(partners, points + gap[:, None] * direction, atol=1e-13)


@given(st.tuples(degrees, degrees), st.floats(-0.5, 0.5), st.floats(-9.0, 9.0), st.floats(-3.0, 3.0))
@settings(max_examples=settings.default.max_examples // 3)
def test_units_and_place_do_not_matter(degree: tuple[int, int], shift: float, exponent: float, far: float) -> None:
    first = couple(*stacked(degree, (4, 7), shift=shift, lift=0.125))
    factor = 10.0**exponent
    meshes = [side.mesh.transformed((far, 1.0), factor) for side in stacked(degree, (4, 7), shift=shift, lift=0.125)]
    second = couple(*(side_of(m, p, part) for m, p, part in zip(meshes, degree, ("bottom", "top"), strict=True)))
    np.testing.assert_array_equal(second.nodes, first.nodes)
    np.testing.assert_allclose(second.weights, factor * first.weights, rtol=1e-11)
    np.testing.assert_allclose(second.gap, factor * first.gap, rtol=1e-12)
    np.testing.assert_allclose(second.on_mortar.toarray(), first.on_mortar.toarray(), atol=1e-11)
    np.testing.assert_allclose(second.on_non_mortar.toarray(), first.on_non_mortar.toarray(), atol=1e-11)


@pytest.mark.parametrize("degree", [0, 1, 2, 4])
@pytest.mark.parametrize("depth", [0.125, 1e-3, -1e-3, -0.125])
def test_gaps_and_overlaps(degree: int, depth: float) -> None:
    coupling = couple(*stacked((degree, degree), (3, 5), lift=depth))
    np.testing.assert_allclose(coupling.gap, depth, rtol=1e-12)


@pytest.mark.parametrize("degree", [1, 4])
def test_both_sides_see_the_same_gap_and_directions(degree: int) -> None:
    one, two = cradle((degree, degree), (5, 5), 0.8)
    forth, back = couple(one, two), couple(two, one)
    np.testing.assert_allclose(forth.points, back.points[::-1], atol=1e-14)
    np.testing.assert_allclose(forth.frame, -back.frame[::-1], atol=1e-13)
    np.testing.assert_allclose(forth.weights, back.weights[::-1], rtol=1e-13)


def test_elements_of_any_size() -> None:
    """Elements of 1e-10 at the end of a side, opposite elements of ordinary size."""
    graded = np.concatenate([[0.0], 10.0 ** np.arange(-10.0, 0.5)])
    corners = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
    upper = quadrangle(corners, [graded, *[np.linspace(0, 1, 3)] * 3])
    for degree in (1, 3):
        one, two = side_of(upper, degree, "bottom"), side_of(block((0.0, -1.0), (1.0, 0.0), 7, 2), degree, "top")
        for pair in ((one, two), (two, one)):
            coupling = couple(*pair)
            assert_sums_are_exact(coupling, 1.0)
            assert_is_dual(pair[0], coupling)


@pytest.mark.parametrize("shift", [1e-12, -1e-12])
def test_ends_that_agree_but_for_round_off(shift: float) -> None:
    one, two = stacked((2, 2), (4, 7), shift=shift)
    coupling = couple(one, two)
    assert_sums_are_exact(coupling, 1.0)
    assert_is_dual(one, coupling)


def test_far_from_the_origin() -> None:
    one, two = (
        side_of(side.mesh.transformed((-1e6, 3e5)), 2, part)
        for side, part in zip(stacked((2, 2), (4, 7)), ("bottom", "top"), strict=True)
    )
    coupling = couple(one, two)
    assert_sums_are_exact(coupling, 1.0)
    assert_is_dual(one, coupling)
    assert not coupling.gap.any()


def test_a_side_around_a_whole_disc() -> None:
    disc = chain(("rim", Arc((0.0, 0.0), 1.0, 0.3, 0.3 + 2.0 * np.pi), np.linspace(0.0, 1.0, 13)))
    ring_angles = 1.0 + 2.0 * np.pi, 1.0
    hole = BoundaryMesh(
        Arc((0.0, 0.0), 1.01, *ring_angles).point(np.linspace(0.0, 1.0, 18)[:-1]),
        np.column_stack([np.arange(17), (np.arange(17) + 1) % 17]),
        {"hole": np.arange(17)},
        (Arc((0.0, 0.0), 1.01, *ring_angles),),
        np.zeros(17, np.intp),
        np.column_stack([np.linspace(0.0, 1.0, 18)[:-1], np.linspace(0.0, 1.0, 18)[1:]]),
        is_exterior=True,
    )
    one, two = side_of(disc, 4, "rim"), side_of(hole, 3, "hole")
    for pair, circumference in ((one, two), 2.0 * np.pi), ((two, one), 2.02 * np.pi):
        coupling = couple(*pair)
        assert_sums_are_exact(coupling, circumference)
        assert_is_dual(pair[0], coupling)
        # directions are interpolated on elements that turn by half a radian
        np.testing.assert_allclose(coupling.gap, 0.01, rtol=1e-4)


def test_elements_too_long_for_a_short_reach_are_named() -> None:
    upper, lower = block((0.0, 0.2), (1.0, 1.2), 2, 2), block((0.0, -1.0), (1.0, 0.0), 4, 2)
    with pytest.raises(NotFacingError, match=r"or elements shorter than 0\.5, which are judged by their middles"):
        couple(side_of(upper, 2, "bottom"), side_of(lower, 2, "top"), reach=0.1)


@pytest.mark.parametrize(
    ("parts", "lift"),
    [(("bottom", "bottom"), 0.0), (("top", "bottom"), 0.0), (("left", "top"), 0.0), (("bottom", "top"), 5.0)],
)
def test_sides_that_face_away(parts: tuple[str, str], lift: float) -> None:
    upper, lower = block((0.0, lift), (1.0, lift + 1.0), 3, 2), block((0.0, -1.0), (1.0, 0.0), 4, 2)
    with pytest.raises(NotFacingError, match=r"face each other nowhere within the distance 2: choose sides"):
        couple(side_of(upper, 1, parts[0]), side_of(lower, 1, parts[1]), reach=2.0)


def test_no_node_may_carry() -> None:
    one, two = stacked((1, 1), (2, 3))
    with pytest.raises(NotFacingError, match="only where no node can carry a multiplier"):
        couple(one, two, without=np.unique(one.dofs))


def test_a_sliver_carries_nothing() -> None:
    with pytest.raises(NotFacingError, match="only where no node can carry a multiplier"):
        couple(*stacked((2, 2), (4, 4), shift=1.0 - 1e-5))


@pytest.mark.parametrize("elements", [[], [0, 0], [0, 99], [-1]])
def test_wrong_elements(elements: list[int]) -> None:
    space = space_of(block((0.0, 0.0), (1.0, 1.0), 3, 2), 1)
    with pytest.raises(GeometryError, match="ContactSide: elements"):
        ContactSide(space, np.array(elements, np.intp))


def test_a_short_cover_in_the_middle_of_an_element() -> None:
    """The node next to it takes it alone, however short it is beside an element, as long as it is not a sliver."""
    narrow = block((0.6, -1.0), (0.61, 0.0), 1, 2)
    one, two = side_of(block((0.0, 0.0), (1.0, 1.0), 1, 2), 6, "bottom"), side_of(narrow, 1, "top")
    coupling = couple(one, two)
    assert_sums_are_exact(coupling, 0.01)
    nearest = np.argmin(np.abs(dof_points(one.space)[one.dofs[0], 0] - 0.605))
    assert coupling.nodes.tolist() == [one.dofs[0, nearest]]
