"""A resultant force by a rigid connection: the part moves as a rigid body, and tractions follow."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import bemkit as bk
from bemkit.model.model import build_model
from bemkit.model.prepared import prepare_steps
from bemkit.operators.rigid_modes import rigid_motions
from bemkit.testing import check_solution

STEEL = bk.Material(1e4, 0.3)
BASE = bk.Part("base", bk.Clamped(), ("bottom",))
FLOOR = bk.Part("floor", bk.Contact(bk.RigidHalfPlane((0.0, 0.0), (0.0, 1.0))), ("bottom",))
FORCE = bk.Force(0.4, -3.0, 0.7, is_rigid=True)
WEIGHT = bk.Gravity(density=1.0, acceleration=(0.0, -2.0))


def block(*parts: bk.Part, **changes) -> bk.Scene:
    scene = bk.Scene(
        title="Block",
        shape=bk.Rectangle(2.0, 1.0),
        material=STEEL,
        parts=parts,
        discretisation=bk.Galerkin(2),
        mesh=bk.MeshOptions(elements=36),
    )
    return replace(scene, **changes)


def top(condition) -> bk.Part:
    return bk.Part("top", condition, ("top",))


def fitted(solution: bk.Solution) -> tuple[list[float], float]:
    """Return the motion (3,) of the top nearest to its displacements, and how far these are from it, relatively."""
    points, moved = solution.boundary.points, solution.boundary.displacement
    nodes = np.flatnonzero(np.abs(points[:, 1] - 1.0) < 1e-12)
    motions = rigid_motions(points[nodes], np.array([1.0, 1.0]), 1.0).reshape(-1, 3)
    amounts = np.linalg.lstsq(motions, moved[nodes].ravel(), rcond=None)[0]
    return amounts.tolist(), float(np.abs(motions @ amounts - moved[nodes].ravel()).max() / np.abs(moved[nodes]).max())


def resultant(solution: bk.Solution, name: str) -> list[float]:
    (found,) = (force for force in solution.part_forces if force.name == name)
    return [found.force_x, found.force_y, found.moment]


SCENES = {
    "clamped": block(BASE, top(FORCE)),
    "linear": block(BASE, top(FORCE), discretisation=bk.Galerkin(1)),
    "degree 5": block(BASE, top(FORCE), discretisation=bk.Galerkin(5), mesh=bk.MeshOptions(elements=16)),
    "contact": block(FLOOR, top(FORCE), law=bk.Coulomb(0.3)),
    "weight": block(FLOOR, top(FORCE), law=bk.Coulomb(0.3), body_forces=(WEIGHT,)),
}


@pytest.mark.parametrize("name", SCENES)
def test_it_is_the_motion_whose_reaction_is_the_force(name: str) -> None:
    """As a given rigid displacement of the part: the same fields, and reactions with the given resultants."""
    scene = SCENES[name]
    solution = bk.run(scene)
    assert solution.is_certified
    (x, y, turn), miss = fitted(solution)
    assert miss < 1e-10
    given = bk.PrescribedDisplacement(bk.Expression(f"{x!r}"), bk.Expression(f"{y!r} + {turn!r} * (x - 1)"))
    other = bk.run(replace(scene, parts=(scene.parts[0], top(given))))
    scale = np.abs(other.boundary.displacement).max()
    np.testing.assert_allclose(solution.boundary.displacement, other.boundary.displacement, atol=1e-8 * scale)
    np.testing.assert_allclose(solution.boundary.traction, other.boundary.traction, atol=1e-6)
    # the moment about the origin of a force at the middle (1, 1) of the part
    expected = [FORCE.x, FORCE.y, FORCE.moment + FORCE.y - FORCE.x]
    assert resultant(other, "top") == pytest.approx(expected, rel=1e-7)
    assert resultant(solution, "top") == pytest.approx(expected, rel=1e-12)
    weight = np.array([0.0, 4.0, 4.0]) if scene.body_forces else np.zeros(3)
    assert resultant(solution, scene.parts[0].name) == pytest.approx(weight - expected, rel=1e-9)


def test_the_tractions_are_not_those_of_a_uniform_load() -> None:
    rigid, uniform = bk.run(SCENES["clamped"]), bk.run(block(BASE, top(replace(FORCE, is_rigid=False))))
    assert not rigid.boundary.reaction[np.abs(rigid.boundary.points[:, 1] - 1.0) < 1e-12].any()
    assert fitted(uniform)[1] > 1e-3
    elements = rigid.mesh.part("top")
    assert np.ptp(rigid.boundary.traction[elements, 0]) > 2.0 * np.ptp(uniform.boundary.traction[elements, 0])
    assert rigid.work == rigid.plan.work


def test_free_directions_follow_as_the_fields_say() -> None:
    """Of a body under its weight, whose particular solution the connection carries too."""
    model = build_model(prepare_steps([SCENES["weight"]])[0])
    condensed, conditions = model.condensed_map(0), model.body.conditions
    assert condensed is not None
    directions = np.flatnonzero(conditions.is_free)
    retained = 1e-4 * np.random.default_rng(1).standard_normal(len(condensed.load))
    response, at_rest = condensed.follow(directions)
    displacement, force = condensed.recover(retained)
    along = conditions.in_frames(displacement).ravel()[directions]
    np.testing.assert_allclose(at_rest + response @ retained, along, atol=1e-12)
    pressed = conditions.in_frames(force)[conditions.is_retained]
    np.testing.assert_allclose(condensed.stiffness @ retained - condensed.load, pressed, atol=1e-9)


@pytest.mark.parametrize("name", ["clamped", "contact"])
def test_the_independent_check_agrees(name: str) -> None:
    check_solution(bk.run(SCENES[name]))


def test_a_load_history_in_a_file() -> None:
    scene = replace(SCENES["contact"], steps=(bk.Step(1.0, load_factor=0.5), bk.Step(2.0, load_factor=1.0)))
    text = bk.scene_to_toml(scene)
    assert "is_rigid = true" in text
    assert bk.scene_from_toml(text) == scene
    solution = bk.run(bk.scene_from_toml(text))
    forces = [resultant(solution.at_step(step), "top")[1] for step in (1, 2)]
    assert forces == pytest.approx([-1.5, -3.0], rel=1e-12)
    assert solution.loading.total().external_work == pytest.approx(
        solution.energy + solution.loading.total().dissipation + solution.loading.total().increment_work, rel=1e-9
    )
    changed = replace(scene, steps=(bk.Step(1.0), bk.Step(2.0, {"parts.top.condition.is_rigid": False})))
    with pytest.raises(bk.InputError, match="part 'top' changes its place or its kind"):
        bk.run(changed)


@pytest.mark.slow
@pytest.mark.parametrize("turn", [0.0, 30.0])
def test_a_pin_on_a_stiff_core_presses_its_hole(turn: float) -> None:
    """Several bodies, turned: copies and bodies that are joined see the same connection."""
    plane = bk.Material(1e4, 0.3, bk.Plane.STRESS)
    ring = bk.Body(
        name="pin",
        shape=bk.Ring(0.4, 1.0),
        material=plane,
        parts=(bk.Part("bore", bk.Force(3.0, 5.0, is_rigid=True), ("inner",)),),
    )
    lug = bk.Body(
        name="lug",
        shape=bk.PlateWithHole(8.0, 8.0, 1.001, (-4.0, -4.0)),
        material=plane,
        parts=(bk.Part("base", bk.Clamped(), ("bottom",)),),
        placement=bk.Placement(turn=turn),
    )
    scene = bk.Scene(
        title="Pin",
        bodies=(lug, replace(ring, placement=bk.Placement(turn=turn))),
        contacts=(bk.ContactPair(("pin.outer", "lug.hole")),),
        law=bk.Coulomb(0.2),
        mesh=bk.MeshOptions(elements=48),
    )
    solution = bk.run(scene)
    assert solution.is_certified
    forces = {f"{name}.{force.name}": force for name, body in solution.bodies.items() for force in body.part_forces}
    assert (forces["lug.base"].force_x, forces["lug.base"].force_y) == pytest.approx((-3.0, -5.0), rel=1e-9)
    pin = solution.bodies["pin"]
    nodes = np.flatnonzero(np.hypot(*pin.boundary.points.T) < 0.5)
    motions = rigid_motions(pin.boundary.points[nodes], np.zeros(2), 1.0).reshape(-1, 3)
    moved = pin.boundary.displacement[nodes].ravel()
    assert np.abs(motions @ np.linalg.lstsq(motions, moved, rcond=None)[0] - moved).max() < 1e-10 * np.abs(moved).max()
    check_solution(solution)


def test_what_cannot_have_a_connection_is_refused() -> None:
    left = bk.Part("left", bk.Clamped(), ("left",))
    with pytest.raises(bk.InputError, match="part 'top' is rigid and meets part 'left': leave a piece of the boundary"):
        bk.run(block(left, top(FORCE)))
    with pytest.raises(bk.InputError, match=r"the map of discretisation .* is not symmetric: choose 'linear'"):
        bk.run(block(BASE, top(FORCE), discretisation=bk.ConstantCollocation()))
    with pytest.raises(bk.InputError, match="part 'top' is a rigid connection, which a symmetric body cannot have"):
        block(BASE, top(bk.Force(y=-1.0, is_rigid=True)), symmetry=bk.Symmetry(x=1.0))
    free = block(bk.Part("side", bk.Free(), ("bottom",)), top(FORCE))
    with pytest.raises(bk.BemkitError, match="nothing holds the body"):
        bk.run(free)
