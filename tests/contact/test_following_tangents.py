"""Nodes that supports hold have one unknown and their friction; nodes without friction slip."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

import bemkit as bk
from bemkit.contact.body import ContactState, SingularResponse, slip, stick
from bemkit.contact.held_friction import HeldFriction
from bemkit.model.model import build_model
from bemkit.model.prepared import prepare
from bemkit.runs.run import UnsolvableSceneError
from bemkit.solvers.base import ContactSolver, Status, solve
from tests.slow import slow_except

FLOOR = bk.RigidHalfPlane()
NEWTON = bk.SemismoothNewton()
SMOOTH = bk.Frictionless()


def block(*parts: bk.Part, poisson_ratio: float = 0.3, law: bk.FrictionLaw = SMOOTH) -> bk.Scene:
    """Return a 2 x 1 block on a floor, pressed unevenly from above."""
    load = bk.Part("load", bk.Traction(y=bk.Expression("-1 - 0.3 * x")), sides=("top",))
    return bk.Scene(
        title="block",
        shape=bk.Rectangle(2.0, 1.0),
        material=bk.Material(1.0, poisson_ratio),
        parts=(bk.Part("floor", bk.Contact(FLOOR), sides=("bottom",)), load, *parts),
        law=law,
        mesh=bk.MeshOptions(elements=40),
    )


def held(scene: bk.Scene) -> bk.Scene:
    return replace(scene, parts=(*scene.parts, bk.Part("wall", bk.Roller(), sides=("right",))))


def disc_in_cavity() -> bk.Scene:
    """Return a disc in a cavity of nearly its own radius: no normal holds it against turning."""
    return bk.Scene(
        title="disc in a cavity",
        shape=bk.Disk(1.0),
        material=bk.Material(1.0, 0.3),
        parts=(
            bk.Part("seat", bk.Contact(bk.RigidCavity((0.0, 0.05), 1.05)), where=bk.Expression("y < 0.3")),
            bk.Part("load", bk.Traction(y=-0.02), where=bk.Expression("y > 0.8")),
        ),
        mesh=bk.MeshOptions(elements=40),
    )


def oblique() -> bk.Scene:
    """Return a triangle whose contact meets a support that moves it along an oblique direction."""
    parts = (
        bk.Part("floor", bk.Contact(FLOOR), sides=("side-1",)),
        bk.Part("wall", bk.Roller(), sides=("side-2",)),
        bk.Part("load", bk.Traction(x=0.3, y=-1.0), sides=("side-3",)),
    )
    return replace(block(), shape=bk.Polygon(((0.0, 0.0), (2.0, 0.0), (1.0, 3.0**0.5))), parts=parts)


def pushed() -> bk.Scene:
    """Return a block whose side, moved by a support, meets the contact."""
    move = bk.Part("push", bk.PrescribedDisplacement(x=bk.Expression("0.05 + 0.02 * y")), sides=("right",))
    return block(move)


SCENES: dict[str, Callable[[], bk.Scene]] = {
    "held block": lambda: held(block()),
    "disc in a cavity": disc_in_cavity,
    "oblique roller": oblique,
    "moved wall": pushed,
}


def relative(one: np.ndarray, other: np.ndarray) -> float:
    return float(np.abs(one - other).max() / np.abs(other).max())


def test_a_block_on_a_smooth_floor_keeps_its_place_and_slides_under_the_smallest_push() -> None:
    resting = bk.run(block())
    assert resting.is_converged
    assert resting.force_normal == pytest.approx(2.6, rel=1e-12)  # the integral of 1 + 0.3 x over the top
    push = bk.Part("push", bk.Traction(x=-1e-3), sides=("right",))
    with pytest.raises(UnsolvableSceneError, match=r"the load slides the body to the left with 0\.001"):
        bk.run(block(push))


@pytest.mark.parametrize("radius", slow_except([0.3, 1e-3, 1e-6], 1e-6))
def test_a_smooth_pin_may_be_small_against_the_plate_it_holds(radius: float) -> None:
    push = bk.Part("push", bk.Traction(x=1.0), sides=("right",))
    pull = bk.Part(
        "hole", bk.Contact(bk.RigidCircle((0.0, 0.0), radius)), sides=tuple(f"hole-{k}" for k in range(1, 5))
    )
    plate = bk.PlateWithHole(width=2.0, height=2.0, radius=radius, corner=(-1.0, -1.0))
    scene = replace(
        block(),
        shape=plate,
        parts=(push, pull),
        mesh=bk.MeshOptions(elements=96, density=dict.fromkeys(pull.sides, 1.0 / radius)),
    )
    solution = bk.run(scene)
    assert solution.is_converged
    table = solution.contact
    pushed = table.weight @ (table.sigma_n[:, None] * -np.column_stack([table.x, table.y])) / radius
    # what pulls on the right side, along the normals of the pin; at nodes by the trapezoidal rule exact up to the mesh
    np.testing.assert_allclose(pushed, [-2.0, 0.0], atol=1e-9)


def test_a_disc_in_a_smooth_cavity_cannot_be_turned() -> None:
    scene = disc_in_cavity()
    twist = bk.Part("twist", bk.Pressure(0.0, shear=0.01), where=bk.Expression("0.4 < y < 0.6"))
    with pytest.raises(UnsolvableSceneError, match="turns the body anticlockwise"):
        bk.run(replace(scene, parts=(*scene.parts, twist)))


def test_a_node_that_a_support_pushes_goes_with_it() -> None:
    model = build_model(prepare(pushed(), pushed().build_mesh()))
    solution = solve(model.problem, NEWTON)
    corner = int(np.argmax(model.prepared.contact_nodes.points[:, 0]))
    # the tangent of the floor points to the right, and the wall moves by 0.05 at y = 0
    assert solution.state.u_t[corner] * model.units.displacement == pytest.approx(0.05, rel=1e-12)


@pytest.mark.parametrize("scene", [pushed(), oblique()])
def test_tangential_displacements_are_those_of_the_body(scene: bk.Scene) -> None:
    model = build_model(prepare(scene, scene.build_mesh()))
    n_contact = model.problem.n_contact
    state = model.problem.respond(stick(np.random.default_rng(3).normal(size=n_contact), np.zeros(n_contact)))
    recovered, _ = model.body.recover(state)
    own = np.einsum("nkc,nc->nk", model.prepared.contact_nodes.frame, recovered[model.prepared.contact_nodes.nodes])
    assert np.abs(own - state.displacement)[model.body.tangent_follows].max() < 1e-12 * np.abs(own).max()


def test_a_tangent_that_follows_takes_conditions_on_tractions_only() -> None:
    scene = held(block())
    problem = build_model(prepare(scene, scene.build_mesh())).problem
    none, node = np.zeros(problem.n_contact), int(np.flatnonzero(problem.body.tangent_follows)[0])
    with pytest.raises(ValueError, match=rf"contact node {node} follows from a support.*ask ContactProblem\.respond"):
        problem.body.respond(stick(none, none))
    assert problem.respond(stick(none, none)).sigma_t[node] == 0.0


def test_a_state_that_does_not_follow_is_out_of_balance() -> None:
    scene = held(block())
    problem = build_model(prepare(scene, scene.build_mesh())).problem
    state = solve(problem, NEWTON).state
    assert problem.body.imbalance(state).worst < 1e-12
    moved = np.stack([np.zeros(problem.n_contact), np.full(problem.n_contact, 1e-4)], axis=1)
    assert problem.body.imbalance(ContactState(state.displacement + moved, state.traction)).force > 1e-6
    assert problem.body.imbalance(ContactState(state.displacement, state.traction + moved)).force > 1e-6


def test_a_history_may_begin_without_friction() -> None:
    scene = held(block())
    smooth, rough = bk.run([scene, replace(scene, law=bk.Coulomb(0.3))])
    assert smooth.is_converged
    assert rough.is_converged
    assert not smooth.contact.sigma_t.any()
    # the block has spread without friction first, and is held where it is then
    assert np.abs(rough.contact.u_t - smooth.contact.u_t).max() < 1e-12 * np.abs(smooth.contact.u_t).max()


def test_the_body_under_another_load_follows_as_if_built_anew() -> None:
    scene = pushed()
    harder = replace(
        scene, parts=(*scene.parts[:1], replace(scene.parts[1], condition=bk.Traction(y=-2.0)), scene.parts[2])
    )
    model = build_model(prepare(scene, scene.build_mesh()))
    models = model.under(model.prepared.under(harder)), build_model(prepare(harder, model.prepared.only.mesh))
    one, other = (solve(each.problem, NEWTON).state.displacement * each.units.displacement for each in models)
    assert relative(one, other) < 1e-12


def test_nodes_without_friction_never_stick() -> None:
    solution = bk.run(bk.load_scene("wavy-obstacle"))
    assert set(solution.contact.status_words()) == {"separated", "slip"}
    # the node at the roller rests, and used to count as stick: a transition at s = 0 that is none
    assert [(item.from_status, item.to_status) for item in solution.transitions] == [("slip", "separated")]
    assert solution.transitions[0].s == pytest.approx(0.25, abs=2e-3)  # Westergaard; elements of 1/300 there
    assert solution.contact.u_t[0] == 0.0


def test_a_coefficient_of_zero_makes_a_node_slip_too() -> None:
    rest = bk.run(held(block(law=bk.Coulomb(bk.Expression("0 * x")))))
    assert rest.status is Status.CONVERGED
    assert "stick" not in rest.contact.status_words()


def slanted(friction_coefficient: float = 0.5, solver: ContactSolver = NEWTON) -> bk.Scene:
    """Return a block whose left side leans outwards and slides along a roller while its foot is pressed down."""
    corners = ((0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (-0.5, 1.0))
    return bk.Scene(
        title="block on a slanted roller",
        shape=bk.Polygon(corners, side_names=("bottom", "right", "top", "left")),
        material=bk.Material(1.0, 0.3),
        law=bk.Coulomb(friction_coefficient),
        parts=(
            bk.Part("floor", bk.Contact(bk.RigidHalfPlane((0.0, -1e-4))), sides=("bottom",)),
            bk.Part("load", bk.Traction(y=-1e-3), sides=("top",)),
            bk.Part("guide", bk.Roller(), sides=("left",)),
        ),
        mesh=bk.MeshOptions(elements=32),
        solver=solver,
    )


def assembled(scene: bk.Scene) -> bk.Scene:
    body = bk.Body(name="body", shape=scene.shape, material=scene.material, parts=scene.parts)
    return bk.Scene(title=scene.title, bodies=(body,), law=scene.law, mesh=scene.mesh, solver=scene.solver)


@pytest.mark.parametrize(
    "solver", [NEWTON, bk.AugmentedLagrangian(), bk.FixedPoint()], ids=lambda value: type(value).__name__
)
def test_friction_at_a_node_on_a_slanted_roller_acts_on_the_body(solver: ContactSolver) -> None:
    solution = bk.run(slanted(solver=solver))
    total = sum(np.array([part.force_x, part.force_y]) for part in solution.part_forces)
    np.testing.assert_allclose(total, 0.0, atol=1e-10 * 1.5e-3)  # of a load of 1.5e-3; drivers stop at 1e-9
    table = solution.contact
    assert table.status_words()[0] == "slip"
    assert table.sigma_t[0] == pytest.approx(
        -0.5 * np.abs(table.sigma_n[0]) * np.sign(table.u_t[0]), rel=1e-8
    )  # lagged bounds
    # the displacement along the roller is given by the floor, and carries both tractions: P = sigma_n + slope sigma_t
    smooth = bk.run(slanted(0.0, solver)).contact
    assert abs(table.sigma_n[0]) < abs(smooth.sigma_n[0])


def test_it_acts_alike_on_a_body_of_an_assembly() -> None:
    one, many = bk.run(slanted()), bk.run(assembled(slanted()))
    for name in ("u_n", "u_t", "sigma_n", "sigma_t"):
        mine, other = getattr(one.contact, name), getattr(many.contact, name)
        np.testing.assert_allclose(other, mine, rtol=0.0, atol=1e-11 * np.abs(mine).max())
    assert many.contact.status_words() == one.contact.status_words()


def test_a_moving_support_drags_its_contact_node_along_in_both() -> None:
    scene = replace(pushed(), law=bk.Coulomb(0.5))
    one, many = bk.run(scene), bk.run(assembled(scene))
    corner = int(np.argmax(one.contact.x))
    assert one.contact.sigma_t[corner] == pytest.approx(0.5 * one.contact.sigma_n[corner], rel=1e-12)  # it moves to +x
    np.testing.assert_allclose(many.contact.sigma_t, one.contact.sigma_t, atol=1e-11)
    forces = sum(part.force_x for part in one.part_forces)
    assert abs(forces) < 1e-12


def test_a_node_on_a_straight_support_rests_and_carries_no_friction() -> None:
    solution = bk.run(held(block(law=bk.Coulomb(0.4))))
    corner = int(np.argmax(solution.contact.x))
    assert solution.contact.status_words()[corner] == "stick"
    assert solution.contact.sigma_t[corner] == 0.0
    assert solution.friction_bound[corner] > 0.0


def test_friction_that_jams_a_support_is_named() -> None:
    friction = HeldFriction(np.array([True]), np.array([2.0]))
    jammed = slip(np.zeros(1), np.ones(1), np.array([0.5]), np.zeros(1))
    with pytest.raises(SingularResponse, match="contact node 0 jams the support"):
        friction.substituted(jammed)
    between = HeldFriction(np.array([True]), np.array([np.nan]))
    with pytest.raises(ValueError, match="contact node 0 follows from a support or from two obstacles"):
        between.substituted(jammed)
