"""Deformed bodies: enlarged by a factor that is told, and nothing is drawn that is not so."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from matplotlib.figure import Figure
from matplotlib.quiver import Quiver

import bemkit as bk
from bemkit.geometry.shapes import ElasticHalfPlane
from bemkit.geometry.spaces import dof_points
from bemkit.pictures import draw_deformation, draw_scene, draw_stress, draw_zoom
from bemkit.pictures.contact_map import is_short
from bemkit.pictures.magnification import LINE, exaggeration, magnification
from bemkit.pictures.shown import at_mesh_nodes, shown
from bemkit.results.solution import Solution
from bemkit.results.solved_scene import interior_fields
from bemkit.results.stress_mesh import stress_mesh
from bemkit.runs.run import run
from bemkit.scene.plane_motion import FarField
from bemkit.scene.toml import load_scene, with_overrides
from bemkit.scene.unit_names import UnitNames
from tests.slow import slow_except
from tests.solutions import changed

STEEL = bk.Material(1.0, 0.3)
INNER = tuple(f"inner-{number}" for number in (1, 2, 3, 4))


def pressed(obstacle: bk.Obstacle, *parts: bk.Part) -> bk.Scene:
    """A block, clamped below, with an obstacle pressed into its upper side."""
    return bk.Scene(
        title="pressed block",
        shape=bk.Rectangle(2.0, 1.0),
        material=STEEL,
        parts=(bk.Part("bottom", bk.Clamped(), ("bottom",)), bk.Part("top", bk.Contact(obstacle), ("top",)), *parts),
        law=bk.Coulomb(0.3),
        mesh=bk.MeshOptions(elements=80),
        discretisation=bk.Galerkin(2),
    )


def ring(interference: float) -> bk.Scene:
    return bk.Scene(
        title="ring on a mandrel",
        shape=bk.Ring(1.0, 2.0),
        material=STEEL,
        parts=(bk.Part("hole", bk.Contact(bk.RigidCircle((0.0, 0.0), 1.0 + interference)), INNER),),
        law=bk.Coulomb(0.3),
        mesh=bk.MeshOptions(elements=48),
        discretisation=bk.Galerkin(2),
    )


SCENES = {
    "wedge": pressed(bk.RigidPolygon(((1.0, 0.97), (2.2, 1.37), (-0.2, 1.37)))),
    "rounded punch": pressed(bk.RigidCircle((1.0, 3.999), 3.0)),
    "deep punch": pressed(bk.RigidCircle((1.0, 3.95), 3.0)),
    "thin ring": ring(1e-4),
    "ring": ring(0.02),
    "disc": with_overrides(load_scene("disc-between-plates"), elements=60),
}


@pytest.fixture(scope="module", params=["linear", "constant"])
def solution(request: pytest.FixtureRequest) -> Solution:
    return run(with_overrides(load_scene("paper-1"), elements=40, discretisation=request.param))


@pytest.mark.parametrize("name", slow_except(SCENES, "deep punch", "thin ring", "wedge"))
@pytest.mark.parametrize("draw", slow_except([draw_deformation, draw_zoom], draw_zoom))
def test_no_contact_node_is_drawn_beyond_its_obstacle_nor_apart_from_it(name: str, draw: object) -> None:
    """Measured on what is drawn, against the obstacle's own distance: not by more than a line is thick."""
    solution = run(SCENES[name])
    (body,) = shown(solution).bodies
    axes = draw(solution)  # type: ignore[operator]
    line = next(line for line in axes.lines if str(line.get_label()).startswith("deformed"))
    # curves are drawn at 8 points of an element, its ends and its middle, the nodes, among them
    deformed = np.concatenate([line.get_xydata() for line in axes.lines if line.get_linewidth() == 1.6])
    initial = np.concatenate([line.get_xydata() for line in axes.lines if line.get_linestyle() == "--"])
    contact = solution.contact
    places = np.stack([contact.x, contact.y], axis=1)
    drawn = np.array([deformed[np.argmin(np.hypot(*(initial - place).T))] for place in places])
    (condition,) = (part.condition for part, _ in body.parts if isinstance(part.condition, bk.Contact))
    gap = condition.obstacle.gap(drawn, np.zeros_like(drawn))
    size = np.ptp(axes.get_xlim()) if draw is draw_zoom else shown(solution).size
    assert gap.min() >= -1.1 * LINE * size
    closed = np.array(contact.status_words()) != "separated"
    assert closed.any()
    assert np.abs(gap[closed]).max() <= 1.1 * LINE * size
    assert len(line.get_xydata()) > 1


def test_small_displacements_beside_small_gaps_are_enlarged() -> None:
    """Or the tests above would pass on pictures of the undeformed body."""
    assert magnification(shown(run(SCENES["thin ring"]))) >= 20.0
    assert magnification(shown(run(SCENES["deep punch"]))) == 1.0


def test_the_factor_minds_obstacles_that_displacements_along_the_contact_reach() -> None:
    """What the table of normal displacements does not know: a body that is drawn inside its shaft anyway."""
    solution = run(SCENES["thin ring"])
    scene = shown(solution)
    (body,) = scene.bodies
    inward = dataclasses.replace(body, displacement=body.displacement - 4e-4 * dof_points(body.space))
    sunk = dataclasses.replace(scene, bodies=(inward,))
    assert 1.0 < magnification(sunk) < exaggeration(sunk.size, inward.displacement, solution.contact)


def test_the_deformation_tells_its_factor_and_its_units(solution: Solution) -> None:
    axes = draw_deformation(
        dataclasses.replace(solution, scene=dataclasses.replace(solution.scene, units=UnitNames("mm", "MPa")))
    )
    legend = [text.get_text() for text in axes.get_legend().get_texts()]
    scene = shown(solution)
    factor = magnification(scene)
    assert f"deformed, displacements \u00d7 {factor:g}" in legend
    assert {"obstacle", "roller", "load"} <= {*legend}
    assert (axes.get_xlabel(), axes.get_ylabel()) == ("$x$ [mm]", "$y$ [mm]")
    (body,) = scene.bodies
    (expected,) = body.outlines(factor)
    np.testing.assert_allclose(axes.lines[1].get_xydata(), expected, atol=1e-15)
    at_nodes = solution.mesh.nodes + factor * at_mesh_nodes(body.space, body.displacement)
    for node in at_nodes:  # every corner of an element is drawn
        assert np.hypot(*(expected - node).T).min() < 1e-14


def test_axes_that_are_given_are_drawn_into_and_returned(solution: Solution) -> None:
    given = Figure().add_subplot()
    assert draw_deformation(solution, given, factor=3.0) is given
    assert "deformed, displacements \u00d7 3" in [text.get_text() for text in given.get_legend().get_texts()]


def test_loads_are_arrows_with_their_heads_on_the_boundary_where_they_press() -> None:
    parts = (
        bk.Part("left", bk.Traction(x=2.0), ("left",)),
        bk.Part("right", bk.Pressure(bk.Expression("-1 * y")), ("right",)),
    )
    axes = draw_scene(pressed(bk.RigidHalfPlane((0.0, 1.5), (0.0, -1.0)), *parts))
    push, pull = (each for each in axes.collections if isinstance(each, Quiver))
    np.testing.assert_allclose(push.X + push.U, 0.0, atol=1e-12)
    np.testing.assert_allclose(pull.X, 2.0, atol=1e-12)
    np.testing.assert_allclose([push.V, pull.V[: push.V.size]], 0.0, atol=1e-12)
    assert np.all(push.U > 0.0)
    # half as long as the largest load where the pressure is half of it, in proportion to y
    np.testing.assert_allclose(pull.U, 0.5 * pull.Y * push.U[0], rtol=1e-9)


def test_rigid_connections_are_bars_with_their_resultant_in_the_middle() -> None:
    parts = (
        bk.Part("left", bk.Force(x=2.0, y=-2.0, is_rigid=True), ("left",)),
        bk.Part("right", bk.Force(moment=1.0, is_rigid=True), ("right",)),
    )
    axes = draw_scene(pressed(bk.RigidHalfPlane((0.0, 1.5), (0.0, -1.0)), *parts))
    legend = [text.get_text() for text in axes.get_legend().get_texts()]
    assert legend == ["clamped", "rigid connection", "resultant", "obstacle"]
    bars = [each for each in axes.collections if each.get_label() == "rigid connection"]
    assert np.all(np.concatenate(bars[0].get_segments())[:, 0] == 0.0)
    (arrow,) = (each for each in axes.collections if isinstance(each, Quiver))
    np.testing.assert_allclose([arrow.X + arrow.U, arrow.Y + arrow.V], [[0.0], [0.5]], atol=1e-12)
    np.testing.assert_allclose(arrow.U, -arrow.V)
    turned = [line for line in axes.lines if line.get_marker() == r"$\circlearrowleft$"]
    np.testing.assert_allclose(turned[0].get_xydata(), [[2.0, 0.5]])


def test_supports_have_their_symbols_outside_of_the_body() -> None:
    parts = (
        bk.Part("left", bk.Roller(), ("left",)),
        bk.Part("right", bk.PrescribedDisplacement(x=0.0, y=-0.1), ("right",)),
    )
    axes = draw_scene(pressed(bk.RigidHalfPlane((0.0, 1.5), (0.0, -1.0)), *parts))
    legend = [text.get_text() for text in axes.get_legend().get_texts()]
    assert legend == ["clamped", "roller", "given displacement", "obstacle"]
    circles = next(each for each in axes.collections if type(each).__name__ == "EllipseCollection")
    assert np.all(circles.get_offsets()[:, 0] < 0.0)
    (arrows,) = (each for each in axes.collections if isinstance(each, Quiver))
    np.testing.assert_allclose(arrows.X, 2.0, atol=1e-12)
    assert np.all(arrows.V < 0.0)
    hatching = axes.collections[0].get_segments()
    assert all(start[1] == pytest.approx(0.0, abs=1e-12) and end[1] < 0.0 for start, end in hatching)


def test_the_weight_of_many_bodies_is_drawn_once() -> None:
    few, many = (draw_scene(load_scene(name)) for name in ("gravity-column", "masonry-arch"))
    for axes in (few, many):
        (arrow,) = (each for each in axes.collections if isinstance(each, Quiver))
        assert (arrow.U[0], arrow.V[0] < 0.0) == (0.0, True)
        assert "weight" in [text.get_text() for text in axes.get_legend().get_texts()]


def test_bodies_without_an_end_fill_the_frame() -> None:
    scene = bk.Scene(
        title="hole",
        shape=bk.ExteriorOf(bk.Disk(1.0)),
        material=STEEL,
        parts=(bk.Part("wall", bk.Pressure(0.01)),),
        mesh=bk.MeshOptions(elements=16),
    )
    axes = draw_deformation(run(scene))
    path = axes.patches[0].get_path()
    assert axes.get_xlim()[1] > 1.5
    assert path.contains_point((1.4, 1.4))


def test_a_half_plane_is_filled_below_its_surface() -> None:
    scene = bk.Scene(
        title="half-plane",
        shape=ElasticHalfPlane(-0.08, 0.08),
        material=STEEL,
        parts=(bk.Part("zone", bk.Contact(bk.Gap(bk.Expression("x**2 / 2")))),),
        far=FarField(force_y=1e-3, x=0.0, turn=0.0),
        mesh=bk.MeshOptions(elements=60),
    )
    solution = run(scene)
    path = draw_deformation(solution).patches[0].get_path()
    assert path.contains_point((0.05, -0.02))
    assert not path.contains_point((0.05, 0.02))


def test_the_stress_of_a_half_plane_fills_a_rectangle_below_its_surface() -> None:
    solution = bk.run(with_overrides(load_scene("cylinder-on-half-plane"), elements=60))
    frame = shown(solution).frame
    length, depth = np.ptp(frame[0]), -frame[1, 0]
    filled = stress_mesh(solution.body, length / 30, frame)
    first, second, third = np.moveaxis(filled.points[filled.triangles], 1, 0)
    area = 0.5 * np.sum((second - first)[:, 0] * (third - first)[:, 1] - (second - first)[:, 1] * (third - first)[:, 0])
    assert area == pytest.approx(length * depth, rel=1e-12)  # without gaps and overlaps
    below = filled.points[:, 1] < 0.0
    expected = interior_fields(solution).stress(filled.points[below])
    np.testing.assert_array_equal(filled.stress[below], expected)
    pressed = np.abs(filled.points[:, 0]) < 0.02
    peak = -solution.contact.sigma_n.min()
    # Hertz: the pressure at the middle of the surface, from elements a fortieth of the contact wide
    assert -filled.stress[pressed & ~below, 1, 1].min() == pytest.approx(peak, rel=0.02)
    axes = draw_stress(solution)
    assert axes.get_ylim()[0] < -0.9 * depth


@pytest.mark.slow
def test_a_flat_relief_is_drawn_across_the_whole_height() -> None:
    solution = bk.run(with_overrides(load_scene("cylinder-on-half-plane"), elements=60))
    axes = draw_deformation(solution)
    height = np.ptp(axes.get_ylim())
    assert axes.get_aspect() == "auto"
    assert height < 0.1 * np.ptp(axes.get_xlim())
    surface = axes.lines[1].get_ydata()
    assert np.ptp(surface) > 0.2 * height
    assert draw_deformation(run(SCENES["rounded punch"])).get_aspect() == 1.0
    gentle = bk.Scene(
        title="half-plane",
        shape=ElasticHalfPlane(-0.08, 0.08),
        material=STEEL,
        parts=(bk.Part("zone", bk.Contact(bk.Gap(bk.Expression("x**2 / 40")))),),
        far=FarField(force_y=1e-5, x=0.0, turn=0.0),
        mesh=bk.MeshOptions(elements=60),
    )
    solution = run(gentle)
    assert magnification(shown(solution)) > 1.0
    (label,) = (text.get_text() for text in draw_deformation(solution).get_legend().get_texts()[1:2])
    assert label == "deformed, displacements \u00d7 1"


def test_a_zoom_shows_a_short_zone_and_says_what_touches() -> None:
    punch, square = run(SCENES["rounded punch"]), run(with_overrides(load_scene("paper-1"), elements=40))
    assert is_short(punch)
    assert not is_short(square)
    axes = draw_zoom(punch)
    assert np.ptp(axes.get_xlim()) < 1.0
    legend = [text.get_text() for text in axes.get_legend().get_texts()]
    assert {"slip", "traction on the body", "obstacle"} <= {*legend}
    (arrows,) = (each for each in axes.collections if isinstance(each, Quiver))
    longest = np.argmax(np.hypot(arrows.U, arrows.V))
    assert arrows.V[longest] < 0.0  # the punch presses downwards


def test_displacements_at_nodes_are_those_of_a_linear_field(solution: Solution) -> None:
    points = solution.boundary.points
    gradient = np.array([[0.5, -2.0], [3.0, 0.25]])
    linear = dataclasses.replace(solution.boundary, displacement=points @ gradient)
    (body,) = shown(changed(solution, boundary=linear)).bodies
    before, after = solution.mesh.node_elements.T
    is_corner = np.sum(solution.mesh.tangents[before] * solution.mesh.tangents[after], axis=1) < 0.5
    assert is_corner.sum() == 4
    error = np.abs(at_mesh_nodes(body.space, body.displacement) - solution.mesh.nodes @ gradient).max(axis=1)
    assert error[~is_corner].max() < 1e-14  # values up to 5
    assert error.max() < solution.mesh.lengths.max() * np.abs(gradient).max()  # corners are cut by half an element


@pytest.mark.parametrize(
    ("largest", "factor"), [(1.0, 0.05), (0.08, 1.0), (0.03, 2.0), (1e-5, 5e3), (0.0, 1.0), (np.nan, 1.0)]
)
def test_the_exaggeration_is_a_round_number(largest: float, factor: float) -> None:
    displacement = np.array([[0.0, 0.0], [0.0, -largest]])
    nothing = run(with_overrides(load_scene("clamped-angle"), elements=12)).contact
    assert exaggeration(1.0, displacement, nothing) == pytest.approx(factor, rel=1e-12)
