"""Which obstacle each node may touch, in which direction, and what is reported where supports hold contact nodes."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import bemkit as bk
from bemkit.errors import ResultWarning
from bemkit.model.contact_data import find_contact
from bemkit.model.model import Model, build_model
from bemkit.model.prepared import prepare
from bemkit.model.solved_contact import contact_warnings
from bemkit.solvers.base import solve
from tests.slow import slow_except

FLOOR = bk.RigidHalfPlane()
ELEMENTS = [bk.ConstantCollocation(), bk.Galerkin(1), bk.Galerkin(2)]


def block(
    *parts: bk.Part,
    law: bk.FrictionLaw | None = None,
    elements: int = 40,
    shape: bk.Shape | None = None,
    **options: Any,
) -> bk.Scene:
    """Return a unit square, or another shape, with some parts, on 40 elements."""
    return bk.Scene(
        title="block",
        shape=bk.Rectangle(1.0, 1.0) if shape is None else shape,
        material=bk.Material(1e4, 0.2),
        law=bk.Frictionless() if law is None else law,
        parts=parts,
        mesh=bk.MeshOptions(elements=elements),
        **options,
    )


def contact_of(scene: bk.Scene) -> Any:
    mesh = scene.build_mesh()
    return find_contact(scene.only, mesh, scene.discretisation.displacement_space(mesh.unit))


FLOOR_PART = bk.Part("floor", bk.Contact(FLOOR), sides=("bottom",))
WALL_PART = bk.Part("wall", bk.Contact(bk.RigidHalfPlane((1.0, 0.0), (-1.0, 0.0))), sides=("right",))


@pytest.mark.parametrize("discretisation", ELEMENTS)
def test_every_length_of_the_contact_boundary_belongs_to_a_node(discretisation: bk.Discretisation) -> None:
    contact = contact_of(block(FLOOR_PART, WALL_PART, discretisation=discretisation))
    weights = contact.nodes.weights
    assert weights.sum() * np.sqrt(2.0) == pytest.approx(2.0, rel=1e-12)  # the diameter is the unit of length
    for part, direction in (("floor", (0.0, -1.0)), ("wall", (1.0, 0.0))):
        own = np.array(contact.parts) == part
        np.testing.assert_array_equal(contact.nodes.directions[own], np.broadcast_to(direction, (own.sum(), 2)))
        assert weights[own].sum() * np.sqrt(2.0) == pytest.approx(1.0, rel=1e-12)


@pytest.mark.parametrize(("distance", "owner"), [(0.0, "floor"), (0.1, "floor"), (-0.1, "wall")])
def test_a_corner_node_touches_the_nearer_obstacle_or_the_first(distance: float, owner: str) -> None:
    wall = bk.Part("wall", bk.Contact(bk.RigidHalfPlane((1.0 + distance, 0.0), (-1.0, 0.0))), sides=("right",))
    contact = contact_of(block(FLOOR_PART, wall, law=bk.Coulomb(0.5)))
    right = np.isclose(contact.nodes.points[:, 0], contact.nodes.points[:, 0].max())
    low = np.isclose(contact.nodes.points[:, 1], contact.nodes.points[:, 1].min())
    corner = np.flatnonzero(right & low)
    assert [contact.parts[k] for k in corner] == [owner]


@pytest.mark.parametrize("discretisation", ELEMENTS[1:])  # constant elements have no node there
@pytest.mark.parametrize("smooth", [(FLOOR_PART, WALL_PART), (FLOOR_PART,), ()])
def test_a_corner_node_touches_both_obstacles_without_friction(
    smooth: tuple[bk.Part, ...], discretisation: bk.Discretisation
) -> None:
    rough = (replace(part, condition=replace(part.condition, law=bk.Coulomb(0.5))) for part in (FLOOR_PART, WALL_PART))
    parts = [part if part in smooth else other for part, other in zip((FLOOR_PART, WALL_PART), rough, strict=True)]
    contact = contact_of(block(*parts, discretisation=discretisation))
    nodes = contact.nodes
    shared = nodes.nodes[nodes.is_second]
    assert shared.size == (1 if len(smooth) == 2 else 0)
    rows = np.flatnonzero(np.isin(nodes.nodes, shared))
    assert [contact.parts[row] for row in rows] == ["floor", "wall"][: rows.size]
    np.testing.assert_array_equal(nodes.is_shared, np.isin(np.arange(nodes.nodes.size), rows))
    assert nodes.weights.sum() * np.sqrt(2.0) == pytest.approx(2.0, rel=1e-12)  # the diameter is the unit of length


@pytest.mark.parametrize("discretisation", ELEMENTS[1:])  # constant elements have no node at corners
def test_a_corner_node_hands_its_share_to_the_same_piece_of_a_part(discretisation: bk.Discretisation) -> None:
    roof = bk.Part(
        "roof", bk.Contact(bk.RigidHalfPlane((0.0, 1.0), (0.0, -1.0))), sides=("top",), where=bk.Expression("x > 0.5")
    )
    walls = bk.Part("walls", bk.Contact(bk.RigidCavity((0.5, 0.5), 2.0)), sides=("right", "left"))
    contact = contact_of(block(roof, walls, law=bk.Coulomb(0.5), discretisation=discretisation))
    own = np.array(contact.parts) == "walls"
    weights, x = contact.nodes.weights[own] * np.sqrt(2.0), contact.points[own, 0]
    for place in (0.0, 1.0):  # the upper corner of the right wall belongs to the roof
        assert weights[np.isclose(x, place)].sum() == pytest.approx(1.0, rel=1e-12)


def test_parts_that_go_on_in_one_line_share_their_node() -> None:
    left = bk.Part("left", bk.Contact(FLOOR), sides=("bottom",), where=bk.Expression("x < 0.5"))
    right = bk.Part("right", bk.Contact(FLOOR), sides=("bottom",), where=bk.Expression("x > 0.5"))
    contact = contact_of(block(left, right))
    middle = int(np.argmin(np.abs(contact.nodes.points[:, 0])))
    assert contact.parts[middle] == "left"
    assert contact.nodes.weights[middle] == pytest.approx(0.1 / np.sqrt(2.0), rel=1e-12)


def test_sides_that_face_away_never_touch() -> None:
    contact = contact_of(block(bk.Part("all", bk.Contact(FLOOR))))
    y = contact.nodes.points[:, 1]
    is_low = np.isclose(y, y.min())
    assert np.isfinite(contact.gap[is_low]).all()
    assert np.isinf(contact.gap[~is_low]).all()


@pytest.mark.parametrize("discretisation", ELEMENTS)
@pytest.mark.parametrize("degrees", [-35.0, 10.0, 60.0])
def test_a_smooth_floor_pushes_a_tilted_block_straight_up(degrees: float, discretisation: bk.Discretisation) -> None:
    angle = np.radians(degrees)
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    corners = tuple(tuple(turn @ corner) for corner in ([0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]))
    lowest = min(y for _, y in corners)
    scene = block(
        bk.Part("floor", bk.Contact(bk.RigidHalfPlane((0.0, lowest))), sides=("bottom", "right", "left")),
        # so deep that the middle of the lowest element touches, which is where constants may touch
        bk.Part("press", bk.PrescribedDisplacement(y=-0.05), sides=("top",)),
        discretisation=discretisation,
        shape=bk.Polygon(corners, side_names=("bottom", "right", "top", "left")),
    )
    model = build_model(prepare(scene, scene.build_mesh()))
    result = solve(model.problem, scene.solver)
    force = np.einsum(
        "n,nk,nkc->c", model.prepared.contact_nodes.weights, result.state.traction, model.prepared.contact_nodes.frame
    )
    assert force[1] > 0.0
    assert abs(force[0]) <= 1e-14 * force[1]  # only round-off of the frames
    _, forces = model.body.recover(result.state)
    assert abs(forces.sum(axis=0)[0]) <= 1e-9 * force[1]  # the certificate


@pytest.mark.parametrize("discretisation", ELEMENTS[1:])  # constant elements have no node there
def test_no_corner_sinks_into_the_floor(discretisation: bk.Discretisation) -> None:
    corners, names = ((0.0, 0.0), (1.0, 0.3), (1.0, 1.0), (-0.1, 1.0)), ("flank", "right", "top", "left")
    scene = block(
        bk.Part("floor", bk.Contact(FLOOR), sides=("flank", "left")),
        bk.Part("press", bk.PrescribedDisplacement(x=0.0, y=-1e-3), sides=("top",)),
        discretisation=discretisation,
        elements=160,
        shape=bk.Polygon(corners, side_names=names),
    )
    solution = bk.run(scene)
    boundary = solution.boundary
    depth = boundary.points[:, 1] + boundary.displacement[:, 1]
    assert depth.min() >= -1e-12  # gaps are exact distances; displacements are 1e-3


def moved_wall(law: bk.FrictionLaw, u_x: float, discretisation: bk.Discretisation) -> bk.Scene:
    return block(
        FLOOR_PART,
        bk.Part("wall", bk.PrescribedDisplacement(x=u_x), sides=("right",)),
        bk.Part("load", bk.Traction(y=-1.0), sides=("top",), where=bk.Expression("x > 0.5")),
        law=law,
        discretisation=discretisation,
    )


@pytest.mark.parametrize("discretisation", slow_except(ELEMENTS[1:], ELEMENTS[2]))
@pytest.mark.parametrize("law", [bk.Coulomb(0.5), bk.Tresca(0.1), bk.Frictionless()])
@pytest.mark.parametrize("u_x", [-1e-4, 1e-4, 0.0])
def test_tables_tell_what_the_body_does_where_a_support_holds_a_contact_node(
    u_x: float, law: bk.FrictionLaw, discretisation: bk.Discretisation
) -> None:
    solution = bk.run(moved_wall(law, u_x, discretisation))
    table, boundary = solution.contact, solution.boundary
    corner = int(np.argmax(table.x))
    at = int(np.argmin(np.hypot(boundary.points[:, 0] - 1.0, boundary.points[:, 1])))
    size = np.abs(boundary.displacement).max()
    # along the floor the tangent is x, and contact acts against y
    assert table.u_t[corner] == pytest.approx(boundary.displacement[at, 0], abs=1e-14 * size)
    assert table.u_n[corner] == pytest.approx(-boundary.displacement[at, 1], abs=1e-14 * size)
    bound = {bk.Coulomb: -0.5 * table.sigma_n[corner], bk.Tresca: 0.1, bk.Frictionless: 0.0}[type(law)]
    assert table.sigma_t[corner] == pytest.approx(-np.sign(u_x) * bound, rel=1e-12)
    words = table.status_words()[corner]
    assert words == ("slip" if u_x or isinstance(law, bk.Frictionless) else "stick")
    assert not any(transition.s > table.s[corner] - 1e-9 for transition in solution.transitions)


def test_a_moved_corner_that_slips_like_its_neighbours_is_no_transition() -> None:
    solution = bk.run(moved_wall(bk.Coulomb(0.5), -1e-4, bk.Galerkin(1)))
    assert set(solution.contact.status_words()) == {"slip"}
    assert solution.transitions == ()
    assert solution.force_tangential == pytest.approx(0.5 * solution.force_normal, rel=1e-9)  # Coulomb's law


@pytest.mark.parametrize("discretisation", ELEMENTS)
@pytest.mark.parametrize("density", slow_except([1.0, 4.0, 10.0], 4.0))
def test_pressure_beside_a_roller_is_as_good_as_elsewhere(density: float, discretisation: bk.Discretisation) -> None:
    scene = bk.load_scene("wavy-obstacle")
    mesh = bk.MeshOptions(elements=200, density={"bottom": density})
    table = bk.run(replace(scene, mesh=mesh, discretisation=discretisation)).contact
    pressure = -table.sigma_n[int(np.argmin(table.x))]
    assert pressure == pytest.approx(0.048824, rel=0.01)  # Westergaard; the error of the meshes is 0.1 to 0.8 %


def test_obstacles_may_turn_their_directions_from_step_to_step() -> None:
    def seat(x: float) -> bk.Scene:
        circle = bk.RigidCircle((x, -2.0), 2.0)
        press = bk.Part("press", bk.PrescribedDisplacement(x=0.0, y=-0.01), sides=("top",))
        return block(bk.Part("seat", bk.Contact(circle), sides=("bottom",)), press)

    first, second = bk.run([seat(0.3), seat(0.6)])
    alone = bk.run(seat(0.6))
    assert first.is_converged
    np.testing.assert_allclose(second.contact.sigma_n, alone.contact.sigma_n, atol=1e-9 * 1e4)  # E, certificate


def warnings_of(scene: bk.Scene) -> tuple[ResultWarning, ...]:
    model: Model = build_model(prepare(scene, scene.build_mesh()))
    result = solve(model.problem, scene.solver)
    ((displacement, _, _),) = model.boundary_fields(result.state)
    return contact_warnings(model, [displacement], result.node_status)


def test_contact_at_a_large_angle_is_warned_of() -> None:
    press = bk.Part("press", bk.PrescribedDisplacement(y=-1e-3), sides=("top",))
    steep = bk.Contact(bk.RigidHalfPlane((1.0, 0.0), (-1.0, 1.0)))
    (warning,) = warnings_of(
        block(bk.Part("chamfer", steep, sides=("bottom",)), press, bk.Part("guide", bk.Roller(), sides=("left",)))
    )
    assert "Part 'chamfer' touches its obstacle at up to 45 degrees to its own normal" in warning.text
    assert (warning.kind, warning.subject, warning.number) == ("oblique contact", "chamfer", pytest.approx(45.0))
    assert warnings_of(block(FLOOR_PART, press)) == ()


def test_solutions_carry_these_warnings() -> None:
    press = bk.Part("press", bk.PrescribedDisplacement(x=1e-3, y=0.0), sides=("top",))
    assert any("Supports push part 'wall'" in warning for warning in map(str, bk.run(block(WALL_PART, press)).warnings))


def test_a_support_that_drives_the_body_into_an_obstacle_is_warned_of() -> None:
    press = bk.Part("press", bk.PrescribedDisplacement(x=1e-3, y=0.0), sides=("top",))
    (warning,) = warnings_of(block(WALL_PART, press))
    assert "Supports push part 'wall' 0.001 into its obstacle at (1, 1)" in warning.text
