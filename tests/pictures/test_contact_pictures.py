"""Pictures along contacts: tractions as what they are, flat lines without round-off, the status, the friction cone."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import matplotlib.colors
import numpy as np
import pytest
from matplotlib.axes import Axes
from matplotlib.collections import PathCollection
from matplotlib.figure import Figure
from matplotlib.quiver import Quiver

import bemkit as bk
from bemkit.pictures import (
    draw_contact_clearance,
    draw_contact_displacement,
    draw_contact_map,
    draw_contact_traction,
    draw_convergence,
    draw_friction_cone,
    draw_zoom,
)
from bemkit.pictures.contact_axes import STATUS_COLOURS
from bemkit.pictures.crowds import marked
from bemkit.pictures.drawing import ignore_round_off
from bemkit.pictures.traction_curves import traction_curve
from bemkit.results.solution import Solution
from bemkit.runs.run import run
from bemkit.scene.toml import load_scene, with_overrides
from tests.slow import slow_only

Draw = Callable[[Solution, str], Axes]


@pytest.fixture(scope="module", params=slow_only(["quadratic", "linear", "constant"], "linear"))
def solution(request: pytest.FixtureRequest) -> Solution:
    return run(with_overrides(load_scene("paper-1"), elements=40, discretisation=request.param))


@pytest.mark.parametrize(
    ("draw", "label"),
    [
        (draw_contact_displacement, "displacement"),
        (draw_contact_traction, "traction"),
        (draw_contact_clearance, "pressure"),
    ],
)
def test_contact_pictures_have_labels_curves_and_a_status_strip(solution: Solution, draw: Draw, label: str) -> None:
    axes = draw(solution, "foundation")
    (strip,) = axes.child_axes
    assert axes.get_ylabel() == label
    assert strip.get_xlabel() == "$x$ along 'foundation'"
    assert axes.get_title()
    assert len(axes.get_legend().get_texts()) >= 2
    bars = [(patch.get_x(), patch.get_x() + patch.get_width(), patch.get_facecolor()) for patch in strip.patches]
    places = [transition.s for transition in solution.transitions]
    np.testing.assert_allclose([end for _, end, _ in bars], [*places, 1.0], rtol=1e-12)
    colours = [matplotlib.colors.to_hex(colour).upper() for _, _, colour in bars]
    assert colours == [STATUS_COLOURS[word].upper() for word in ("separated", "slip", "stick")]


def test_they_draw_into_axes_that_are_given(solution: Solution) -> None:
    first, second = Figure().subplots(1, 2)
    assert draw_contact_traction(solution, "foundation", first) is first
    assert draw_friction_cone(solution, "foundation", second) is second


@pytest.mark.parametrize(
    ("degree", "points_of_element", "variation"), [("constant", 2, 0), ("linear", 2, 0), ("quadratic", 2, 1), (4, 9, 3)]
)
def test_tractions_are_drawn_as_polynomials_of_their_degree(
    degree: str | int, points_of_element: int, variation: int
) -> None:
    discretisation = bk.Galerkin(degree=degree) if isinstance(degree, int) else degree
    overrides = {"degree": degree} if isinstance(degree, int) else {"discretisation": discretisation}
    solution = run(with_overrides(load_scene("paper-1"), elements=24, **overrides))  # type: ignore[arg-type]
    curve = traction_curve(solution, "foundation")
    n = solution.mesh.part("foundation").size
    assert curve.s.size == points_of_element * n
    values = curve.normal.reshape(n, points_of_element)
    nodes = np.linspace(-1.0, 1.0, points_of_element)
    size = np.abs(values).max()
    fitted = np.array(
        [np.polynomial.Polynomial.fit(nodes, row, min(variation, points_of_element - 1))(nodes) for row in values]
    )
    np.testing.assert_allclose(values, fitted, atol=1e-9 * size)  # of no higher degree
    if variation:
        assert np.ptp(values, axis=1).max() > 1e-3 * size  # and not of a lower one
    # as the force that the contact feels says
    force = np.sum(np.diff(curve.s.reshape(n, -1)) * 0.5 * (values[:, 1:] + values[:, :-1]))
    assert -force == pytest.approx(solution.force_normal, rel=0.01)  # trapezoids of 8 points of an element


@pytest.mark.slow
def test_tractions_between_bodies_are_those_of_the_side_with_the_nodes() -> None:
    solution = run(load_scene("two-cylinders"))
    (part,) = solution.contact.parts
    curve = traction_curve(solution, part)
    # quadratic elements: the tractions at the ends of elements are those of neighbours, too
    assert curve.normal.min() == pytest.approx(solution.contact.sigma_n.min(), rel=0.05)
    assert np.abs(curve.normal[-1]) < 0.01 * np.abs(curve.normal).max()


def test_a_uniform_pressure_is_drawn_as_a_flat_line() -> None:
    """And a clearance that is nothing but round-off as zero."""
    solution = run(with_overrides(load_scene("uniform-slip"), elements=24))
    axes = draw_contact_clearance(solution, "floor")
    bottom, top = axes.get_ylim()
    assert bottom <= 0.0 < 1.0 < top  # the pressure is 1 Pa
    (right,) = (other for other in axes.get_figure().axes if other.get_ylabel() == "clearance")
    assert np.ptp(right.get_ylim()) > 0.01 * np.abs(solution.contact.u_t).max()
    assert np.abs(solution.contact.clearance).max() < 1e-9 * np.abs(solution.contact.u_t).max()


def test_axes_are_as_wide_as_the_scale_where_nothing_varies() -> None:
    axes = Figure().add_subplot()
    axes.plot([0.0, 1.0, 2.0], [96.0, 96.0 + 1e-10, 96.0 - 2e-10])
    ignore_round_off(axes, 96.0)
    assert axes.get_ylim() == pytest.approx((91.2, 100.8))
    axes.clear()
    axes.plot([0.0, 1.0], [96.0, 96.001])  # more than round-off
    ignore_round_off(axes, 96.0)
    assert np.ptp(axes.get_ylim()) < 0.01


def test_the_friction_cone_holds_all_nodes_and_slip_lies_on_its_bounds() -> None:
    solution = run(with_overrides(load_scene("paper-1"), elements=80, discretisation="linear"))
    axes = draw_friction_cone(solution, "foundation")
    upper = axes.lines[0].get_xydata()
    np.testing.assert_allclose(upper[:, 1], 0.5 * np.maximum(upper[:, 0], 0.0), atol=1e-12)
    points = {each.get_label(): each.get_offsets() for each in axes.collections}
    scale = np.abs(solution.contact.sigma_n).max()
    slipping, sticking = points["slip"], points["stick"]
    np.testing.assert_allclose(np.abs(slipping[:, 1]), 0.5 * slipping[:, 0], atol=1e-9 * scale)
    assert np.all(np.abs(sticking[:, 1]) < 0.5 * sticking[:, 0])


def test_the_map_draws_each_contact_node_of_one_body_once(solution: Solution) -> None:
    axes = draw_contact_map(solution)
    drawn = sum(len(each.get_offsets()) for each in axes.collections if hasattr(each, "get_sizes"))
    assert drawn == solution.contact.n_contact
    teeth = np.concatenate([each.get_segments() for each in axes.collections if hasattr(each, "get_segments")])
    assert teeth[..., 1].min() > -1e-12  # into the body, away from the obstacle below
    assert teeth[..., 1].max() > 0.05


def test_teeth_of_a_small_body_do_not_cross_it() -> None:
    steel = bk.Material(1.0, 0.3)
    base, load = bk.Part("base", bk.Clamped(), ("bottom",)), bk.Part("load", bk.Pressure(1e-3), ("top",))
    block = bk.Body(name="block", shape=bk.Rectangle(20.0, 10.0), material=steel, parts=(base,))
    cube = bk.Body(
        name="cube", shape=bk.Rectangle(1.0, 1.0), material=steel, parts=(load,), placement=bk.Placement((9.0, 10.0))
    )
    scene = bk.Scene(
        title="A small cube on a large block",
        bodies=(block, cube),
        contacts=(bk.ContactPair(("cube.bottom", "block.top")),),
        law=bk.Coulomb(0.5),
        mesh=bk.MeshOptions(elements=24),
    )
    axes = draw_contact_map(run(scene))
    teeth = np.concatenate([each.get_segments() for each in axes.collections if hasattr(each, "get_segments")])
    assert 0.5 < np.hypot(*(teeth[:, 1] - teeth[:, 0]).T).max() < 1.0  # 3 % of the picture, not more than the cube


@pytest.mark.parametrize(
    ("draw", "peak"),
    slow_only(
        [(draw_contact_traction, "down to -0.0"), (draw_contact_clearance, "up to 0.0")],
        (draw_contact_clearance, "up to 0.0"),
    ),
)
def test_peaks_at_the_edges_of_a_punch_are_cut_and_told(draw: Callable[..., Axes], peak: str) -> None:
    solution = run(load_scene("tilted-punch"))
    (part,) = solution.contact.parts
    axes = draw(solution, part)
    assert np.abs(axes.get_ylim()).max() < 0.2 * -solution.contact.sigma_n.min()
    (note,) = (text.get_text() for text in axes.texts)
    assert note.startswith("peaks ")
    assert peak in note


def test_a_clearance_of_nothing_but_zeros_is_drawn_on_the_scale_of_the_displacements() -> None:
    solution = run(with_overrides(load_scene("uniform-slip"), elements=24))
    still = replace(solution.contact, gap=solution.contact.u_n.copy())
    assert not still.clearance.any()
    axes = draw_contact_clearance(replace(solution, contact=still), "floor")
    (right,) = (other for other in axes.get_figure().axes if other.get_ylabel() == "clearance")
    assert np.ptp(right.get_ylim()) < np.abs([still.u_n, still.u_t]).max()


def test_a_body_far_from_its_obstacle_or_out_of_reach_is_drawn() -> None:
    solution = run(with_overrides(load_scene("uniform-slip"), elements=24))
    for distance in (1.0, np.inf):
        away = replace(
            solution.contact, gap=solution.contact.u_n + distance, clearance=solution.contact.u_n * 0.0 + distance
        )
        axes = draw_contact_clearance(replace(solution, contact=away), "floor")
        (right,) = (other for other in axes.get_figure().axes if other.get_ylabel() == "clearance")
        assert np.isfinite(right.get_ylim()).all()
        assert np.isfinite(right.lines[0].get_ydata()).all() == np.isfinite(distance)


def test_the_convergence_ends_where_the_certificate_is(solution: Solution) -> None:
    axes = draw_convergence(solution)
    worst = axes.lines[0].get_ydata()
    assert len(worst) == len(solution.history)
    assert worst[-1] == pytest.approx(max(solution.history[-1].certificate.worst, 1e-300))


@pytest.mark.parametrize("draw", [draw_contact_displacement, draw_contact_traction])
def test_many_nodes_have_no_dots(draw: Draw, monkeypatch: pytest.MonkeyPatch) -> None:
    solution = run(with_overrides(load_scene("paper-1"), elements=40))
    few = draw(solution, "foundation")
    monkeypatch.setattr("bemkit.pictures.contact_curves.MANY", solution.contact.n_contact - 1)
    many = draw(solution, "foundation")
    assert any(line.get_marker() == "o" for line in few.lines)
    assert all(line.get_marker() != "o" for line in many.lines)


def test_of_a_crowd_of_points_the_largest_of_those_that_hide_each_other_are_marked() -> None:
    points = np.column_stack([np.linspace(0.0, 1.0, 1000), np.zeros(1000)])
    sizes = np.tile([1.0, 2.0], 500)
    rows = marked(points, sizes, 1.0)
    assert 70 < len(rows) < 90  # 80 across the width
    assert (sizes[rows] == 2.0).all()
    assert len(marked(points[:300], sizes[:300], 1.0)) == 300


def test_images_by_symmetry_are_marked_like_the_solved_side() -> None:
    block = bk.Scene(
        title="block",
        shape=bk.Rectangle(1.0, 1.0),
        material=bk.Material(10.0, 0.2),
        law=bk.Coulomb(0.5),
        symmetry=bk.Symmetry(x=0.5),
        parts=(
            bk.Part("base", bk.Contact(bk.RigidHalfPlane()), ("bottom",)),
            bk.Part("load", bk.Traction(y=-1.0), ("top",), bk.Expression("abs(x - 0.5) < 0.2")),
        ),
        mesh=bk.MeshOptions(elements=40),
    )
    solution = run(block)
    n_nodes = 2 * solution.contact.n_contact - 1  # the node on the line is its own image
    dots = [each for each in draw_contact_map(solution).collections if isinstance(each, PathCollection)]
    x = np.sort(np.concatenate([np.asarray(each.get_offsets())[:, 0] for each in dots]))
    assert x.size == n_nodes
    np.testing.assert_allclose(x + x[::-1], 1.0, atol=1e-12)
    axes = draw_zoom(solution)
    np.testing.assert_allclose(np.mean(axes.get_xlim()), 0.5, atol=1e-12)
    (arrows,) = [each for each in axes.collections if isinstance(each, Quiver)]
    order = np.argsort(arrows.X + arrows.U)
    np.testing.assert_allclose((arrows.U + arrows.U[order[::-1]][np.argsort(order)]), 0.0, atol=1e-12)
    assert np.abs(arrows.U).max() > 0.01
