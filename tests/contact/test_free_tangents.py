"""Contact nodes without friction have one unknown, not two, and nothing else changes."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

import bemkit as bk
from bemkit.contact.condensation.nodes import retained_tangents
from bemkit.contact.conditions import separated, stick
from bemkit.contact.problem import ContactState, LawError
from bemkit.model.contact_model import Model, build_model
from bemkit.model.prepared import nodal_forces, prepare, supports_on
from bemkit.runs.run import UnsolvableSceneError
from bemkit.scene.discretisation import Discretisation
from bemkit.solvers.base import ContactSolver, Status, solve
from bemkit.solvers.homotopy import AffineBound, follow_path
from bemkit.solvers.lemke import LemkePivoting
from tests.handmade import condense

FLOOR = bk.HalfPlane()
NEWTON = bk.SemismoothNewton()
SMOOTH = bk.Frictionless()


def shipped(name: str) -> bk.Scene:
    scene = bk.load_scene(name)
    own = tuple(
        replace(part, condition=replace(part.condition, law=None)) if isinstance(part.condition, bk.Contact) else part
        for part in scene.parts
    )
    return replace(scene, parts=own, law=SMOOTH, mesh=bk.MeshOptions(elements=40))


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


def mixed() -> bk.Scene:
    """Return a block whose floor is rough on the left and smooth on the right."""
    parts = (
        bk.Part("rough", bk.Contact(FLOOR, bk.Coulomb(0.4)), sides=("bottom",), where=bk.Expression("x < 0.9")),
        bk.Part("smooth", bk.Contact(FLOOR), sides=("bottom",), where=bk.Expression("x > 0.9")),
        bk.Part("load", bk.Traction(x=0.12, y=bk.Expression("-1 - 0.3 * x")), sides=("top",)),
    )
    return replace(block(), parts=parts)


def disc_in_cavity() -> bk.Scene:
    """Return a disc in a cavity of nearly its own radius: no normal holds it against turning."""
    return bk.Scene(
        title="disc in a cavity",
        shape=bk.Disk(1.0),
        material=bk.Material(1.0, 0.3),
        parts=(
            bk.Part("seat", bk.Contact(bk.Cavity((0.0, 0.05), 1.05)), where=bk.Expression("y < 0.3")),
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


def dropped() -> bk.Scene:
    """Return a block above a floor, which it reaches held by springs."""
    scene = block()
    floor = bk.Part("floor", bk.Contact(bk.HalfPlane((0.0, -50.0))), sides=("bottom",))
    return replace(scene, parts=(floor, *scene.parts[1:]))


def pushed() -> bk.Scene:
    """Return a block whose side, moved by a support, meets the contact."""
    move = bk.Part("push", bk.PrescribedDisplacement(x=bk.Expression("0.05 + 0.02 * y")), sides=("right",))
    return block(move)


SCENES: dict[str, Callable[[], bk.Scene]] = {
    "paper-1": lambda: shipped("paper-1"),
    "paper-2": lambda: shipped("paper-2"),
    "receding layer": lambda: shipped("receding-layer"),
    "wavy obstacle": lambda: shipped("wavy-obstacle"),
    "held block": lambda: held(block()),
    "incompressible block": lambda: held(block(poisson_ratio=0.5)),
    "rough and smooth": mixed,
    "disc in a cavity": disc_in_cavity,
    "oblique roller": oblique,
    "moved wall": pushed,
    "dropped block": dropped,
}
CASES = [(name, bk.Galerkin(1)) for name in SCENES]
CASES += [(name, bk.Galerkin(2)) for name in ("paper-2", "rough and smooth", "moved wall")]
CASES += [(name, bk.ConstantCollocation()) for name in ("paper-1", "rough and smooth", "receding layer")]


def with_all_tangents(model: Model) -> Model:
    """Return the model with two unknowns at every contact node."""
    space = model.elastic.displacement_space
    supports = supports_on(model.scene, model.mesh, model.units, space)
    force = nodal_forces(model.scene, model.mesh, space, model.units)
    candidates = replace(model.nodes, is_frictionless=np.zeros(model.nodes.nodes.size, bool))
    body = condense(model.elastic, supports, candidates, force)
    return replace(model, body=body, problem=replace(model.problem, body=body))


def relative(one: np.ndarray, other: np.ndarray) -> float:
    return float(np.abs(one - other).max() / np.abs(other).max())


def differences(model: Model, full: Model, solver: ContactSolver) -> tuple[float, ...]:
    one, other = (solve(each.problem, solver, throw=False) for each in (model, full))
    assert one.is_converged
    assert other.is_converged
    assert np.array_equal(one.node_status != 0, other.node_status != 0)
    assert not one.state.sigma_t[model.body.tangent_is_eliminated].any()
    # a rigid motion that nothing holds is where the driver left it, here and there
    u, v = one.state.displacement - other.state.displacement, other.state.displacement
    motions = model.body.rigid_motions()
    if motions.size:
        # combinations that move no normal, such as the turn of a disc about the centre of its cavity
        _, sizes, directions = np.linalg.svd(motions[:, :, 0].T)
        motions = np.tensordot(directions[np.append(sizes, np.zeros(len(motions) - len(sizes))) < 1e-2], motions, 1)
    if len(motions):
        basis = np.linalg.qr(motions.reshape(len(motions), -1).T)[0]
        u = u - (basis @ (basis.T @ u.ravel())).reshape(u.shape)
    fields, others = model.body.recover(one.state)[1], full.body.recover(other.state)[1]
    u = u[model.body.moves]  # along tangents that a support holds, the small system knows more; see below
    stress = np.abs(other.state.traction).max()
    gone = np.abs(one.state.traction - other.state.traction).max()
    return float(np.abs(u).max() / np.abs(v).max()), float(gone / stress), relative(fields, others)


@pytest.mark.parametrize(("name", "discretisation"), CASES, ids=lambda value: getattr(value, "__name__", str(value)))
def test_the_small_system_gives_what_the_full_one_gives(name: str, discretisation: Discretisation) -> None:
    scene = replace(SCENES[name](), discretisation=discretisation)
    model = build_model(prepare(scene, scene.build_mesh()))
    full = with_all_tangents(model)
    n_held = int(model.body.is_held.sum())  # where a support holds the tangent there never is a second unknown
    assert full.body.n_unknowns == 2 * model.problem.n_contact - n_held > model.body.n_unknowns
    # round-off grows with the condition of the bodies: at nu = 1/2 and for thin layers that is up to 1e4 and 1e6
    assert max(differences(model, full, NEWTON)) < 1e-10


@pytest.mark.parametrize(
    "solver", [bk.AugmentedLagrangian(), bk.FixedPoint(), LemkePivoting()], ids=lambda value: type(value).__name__
)
@pytest.mark.parametrize("name", ["paper-1", "rough and smooth", "oblique roller"])
def test_every_driver_solves_the_small_system(name: str, solver: ContactSolver) -> None:
    scene = SCENES[name]()
    model = build_model(prepare(scene, scene.build_mesh()))
    # drivers stop at a certificate of 1e-9, of tractions that are up to 1e2 times those of the answer
    assert max(differences(model, with_all_tangents(model), solver)) < 1e-6


def test_the_path_of_solutions_passes_over_free_tangents() -> None:
    scene = mixed()
    model = build_model(prepare(scene, scene.build_mesh()))
    lengths = set()
    for factor in np.linspace(1.0, 2.0, 40).tolist():
        load = bk.Traction(x=0.12 * factor, y=bk.Expression(f"{factor!r} * (-1 - 0.3 * x)"))
        loaded = replace(scene, parts=(*scene.parts[:2], replace(scene.parts[2], condition=load)))
        problem = model.under(model.prepared.under(loaded)).problem
        end = follow_path(problem, AffineBound.tangent(problem, np.zeros(problem.n_contact)))
        lengths.add(end.n_segments)
        assert end.state is not None
    # the friction bound of these nodes is reached all along the path; round-off must not make that a joint of it
    assert lengths == {3}
    answer = solve(problem, NEWTON).state
    assert relative(end.state.traction, answer.traction) < 1e-10  # exact on each piece, conditions of about 1e3


def test_a_frictionless_scene_has_half_the_unknowns() -> None:
    scene = replace(bk.load_scene("paper-2"), law=SMOOTH, mesh=bk.MeshOptions(elements=60))
    body = build_model(prepare(scene, scene.build_mesh())).body
    assert body.n_unknowns == body.n_contact
    assert body.condensed.stiffness.shape == (body.n_contact, body.n_contact)
    assert body.tangent_is_eliminated.all()


def test_friction_brings_its_own_tangents_back() -> None:
    scene = mixed()
    model = build_model(prepare(scene, scene.build_mesh()))
    n_rough = sum(part == "rough" for part in model.contact.parts)
    assert 0 < n_rough < model.problem.n_contact
    assert model.body.n_unknowns == model.problem.n_contact + n_rough


@pytest.mark.parametrize(("scene", "n_kept"), [(block(), 1), (disc_in_cavity(), 1), (held(block()), 0), (pushed(), 0)])
def test_what_is_eliminated_is_held(scene: bk.Scene, n_kept: int) -> None:
    model = build_model(prepare(scene, scene.build_mesh()))
    assert model.body.n_unknowns == model.problem.n_contact + n_kept


def test_tangents_are_kept_for_motions_that_normals_hardly_feel() -> None:
    angle = np.linspace(-0.2, 0.2, 9)
    # along x, along y and turning, at nodes of a shallow arc about (0, 1): a turn about there moves no normal
    normals = np.stack([np.sin(angle), -np.cos(angle)], axis=1)
    tangents = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    points = np.array([0.0, 1.0]) + normals
    turn = np.stack([-points[:, 1], points[:, 0]], axis=1)
    fields = [np.broadcast_to([1.0, 0.0], turn.shape), np.broadcast_to([0.0, 1.0], turn.shape), turn]
    motions = np.array([[(field * normals).sum(axis=1), (field * tangents).sum(axis=1)] for field in fields])
    motions = motions.transpose(0, 2, 1)
    smooth, free = np.ones(9, bool), np.zeros(9, bool)
    assert retained_tangents(motions, smooth, free).sum() == 1
    assert retained_tangents(motions[:0], smooth, free).sum() == 0
    assert retained_tangents(motions, ~smooth, free).all()
    assert retained_tangents(motions[:, :1], smooth[:1], ~free[:1]).sum() == 0  # a support holds its tangent


def test_a_block_on_a_smooth_floor_keeps_its_place_and_slides_under_the_smallest_push() -> None:
    resting = bk.run(block())
    assert resting.is_converged
    assert resting.force_normal == pytest.approx(2.6, rel=1e-12)  # the integral of 1 + 0.3 x over the top
    push = bk.Part("push", bk.Traction(x=-1e-3), sides=("right",))
    with pytest.raises(UnsolvableSceneError, match=r"the load slides the body to the left with 0\.001"):
        bk.run(block(push))


@pytest.mark.parametrize("radius", [0.3, 1e-3, 1e-6])
def test_a_smooth_pin_may_be_small_against_the_plate_it_holds(radius: float) -> None:
    push = bk.Part("push", bk.Traction(x=1.0), sides=("right",))
    pull = bk.Part("hole", bk.Contact(bk.Circle((0.0, 0.0), radius)), sides=tuple(f"hole-{k}" for k in range(1, 5)))
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
    corner = int(np.argmax(model.nodes.points[:, 0]))
    # the tangent of the floor points to the right, and the wall moves by 0.05 at y = 0
    assert solution.state.u_t[corner] * model.units.displacement == pytest.approx(0.05, rel=1e-12)


@pytest.mark.parametrize("scene", [pushed(), oblique(), block(), mixed()])
def test_tangential_displacements_are_those_of_the_body(scene: bk.Scene) -> None:
    model = build_model(prepare(scene, scene.build_mesh()))
    n_contact = model.problem.n_contact
    state = model.problem.respond(stick(np.random.default_rng(3).normal(size=n_contact), np.zeros(n_contact)))
    recovered, _ = model.body.recover(state)
    own = np.einsum("nkc,nc->nk", model.nodes.frame, recovered[model.nodes.nodes])
    assert np.abs(own - state.displacement)[model.body.tangent_is_eliminated].max() < 1e-12 * np.abs(own).max()


def test_the_only_tangential_condition_is_no_traction() -> None:
    scene = held(block())
    problem = build_model(prepare(scene, scene.build_mesh())).problem
    none = np.zeros(problem.n_contact)
    with pytest.raises(ValueError, match=r"contact node 0 is without friction.*ask ContactProblem\.respond"):
        problem.body.respond(stick(none, none))
    assert not problem.respond(stick(none, none)).sigma_t.any()
    coupled = separated(problem.n_contact)
    on_traction = coupled.on_traction.copy()
    on_traction[3, 1] = (0.5, 1.0)
    with pytest.raises(ValueError, match="contact node 3 is without friction"):
        problem.body.respond(replace(coupled, on_traction=on_traction))


def test_a_state_that_does_not_follow_is_out_of_balance() -> None:
    scene = held(block())
    problem = build_model(prepare(scene, scene.build_mesh())).problem
    state = solve(problem, NEWTON).state
    assert problem.body.imbalance(state).worst < 1e-12
    moved = np.stack([np.zeros(problem.n_contact), np.full(problem.n_contact, 1e-4)], axis=1)
    assert problem.body.imbalance(ContactState(state.displacement + moved, state.traction)).force > 1e-6
    assert problem.body.imbalance(ContactState(state.displacement, state.traction + moved)).force > 1e-6


def test_a_law_with_friction_asks_for_another_body() -> None:
    scene = held(block())
    model = build_model(prepare(scene, scene.build_mesh()))
    rough = replace(scene, law=bk.Tresca(0.1))
    with pytest.raises(LawError, match=r"Tresca allows 0\.1 at contact node 0, where the body was condensed without"):
        replace(model.problem, law=bk.Tresca(0.1))
    fresh = build_model(prepare(rough, model.mesh))
    changed = model.under(model.prepared.under(rough))
    assert changed.body.n_unknowns == fresh.body.n_unknowns
    one, other = (solve(each.problem, NEWTON).state for each in (changed, fresh))
    assert relative(one.traction, other.traction) < 1e-12
    # friction zero is still a law; at the corner the wall holds the tangent
    assert fresh.under(fresh.prepared.under(scene)).body.n_unknowns == 2 * changed.problem.n_contact - 1


def test_a_history_may_begin_without_friction() -> None:
    scene = held(block())
    smooth, rough = bk.run_history([scene, replace(scene, law=bk.Coulomb(0.3))])
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
    one, other = (
        solve(model.under(model.prepared.under(harder)).problem, NEWTON),
        solve(build_model(prepare(harder, model.mesh, model.units)).problem, NEWTON),
    )
    assert relative(one.state.displacement, other.state.displacement) < 1e-12


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
