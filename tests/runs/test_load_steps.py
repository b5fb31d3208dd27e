"""Load histories solved: work, friction loops, smaller increments, steps that are kept, laws that remember."""

from __future__ import annotations

from dataclasses import replace
from itertools import count
from typing import Any

import numpy as np
import pytest

import bemkit as bk
from bemkit.contact.further_laws import SlipWeakening
from bemkit.model.model import build_model
from bemkit.model.prepared import prepare_steps
from bemkit.results.load_history import LoadHistory, StepWork
from bemkit.runs.step_errors import StepErrors
from bemkit.scene.load_history import load_steps
from bemkit.solvers.base import Status
from bemkit.testing import check_solution
from bemkit.testing.independent_check import violations_of
from tests.failing_solver import Failing
from tests.runs.test_rigid_bodies import driven
from tests.slow import slow_only

LOOP = replace(bk.load_scene("friction-loop"), mesh=bk.MeshOptions(elements=40))
SHEAR = "parts.top.condition.x"


def solved(scene: bk.Scene | bk.Scene) -> LoadHistory:
    solution = bk.run(scene)
    assert solution.is_converged, solution.message
    assert solution.loading is not None
    assert solution.loading.is_complete
    return solution.loading


def check_balance(loading: LoadHistory, tolerance: float) -> None:
    """The loads' work is elastic energy, friction, and what increments leave: two sums over different nodes."""
    energy = 0.0
    for step in loading.steps:
        work = step.work
        rest = work.external_work - (step.elastic_energy - energy) - work.dissipation - work.increment_work
        size = max(abs(value) for value in (step.elastic_energy, *vars(work).values()))
        assert abs(rest) <= tolerance * size
        assert work.dissipation >= 0.0
        assert 0.0 <= work.friction_gain <= tolerance * size
        energy = step.elastic_energy


@pytest.mark.parametrize(
    ("discretisation", "friction"),
    slow_only([(bk.Galerkin(1), 0.3), (bk.Galerkin(3), 0.2)], (bk.Galerkin(3), 0.2)),  # so little that no edge lifts
    ids=["linear", "degree 3"],
)
def test_over_a_closed_cycle_friction_takes_what_the_push_gives(
    discretisation: bk.Discretisation, friction: float
) -> None:
    loading = solved(replace(LOOP, discretisation=discretisation, law=bk.Coulomb(friction)))
    check_balance(loading, 1e-12)  # round-off of symmetric matrices
    first, last = (int(np.argmin(np.abs(loading.times - time))) for time in (2.0, 6.0))
    cycle = loading.total(first + 1, last + 1)
    assert cycle.dissipation == pytest.approx(cycle.external_work, rel=1e-10)  # asked for: 1e-8
    # the loop is closed, and slides with the whole friction there is both ways
    one, other = loading.steps[first], loading.steps[last]
    assert other.force_tangential == pytest.approx(one.force_tangential, rel=1e-10)
    assert one.force_tangential == pytest.approx(-friction * one.force_normal, rel=1e-10)
    np.testing.assert_allclose(other.contact.u_t, one.contact.u_t, rtol=1e-9)
    assert cycle.external_work > one.elastic_energy


@pytest.mark.slow
def test_collocation_balances_up_to_its_error() -> None:
    check_balance(solved(replace(LOOP, discretisation=bk.ConstantCollocation())), 3e-2)  # of 40 constant elements


def test_obstacles_that_move_do_work() -> None:
    """The floor comes up instead of the top coming down: the same state, and the floor has done the work."""
    top = {"parts.top.condition.y": 0.0, "parts.floor.condition.obstacle.point[1]": "0.01*t"}
    held = replace(LOOP, steps=(bk.Step(1.0, top, increments=2),), discretisation=bk.Galerkin(1))
    loading, pressed = solved(held), solved(replace(LOOP, steps=LOOP.steps[:1]))
    assert loading.steps[-1].force_normal == pytest.approx(pressed.steps[-1].force_normal, rel=1e-10)
    assert loading.total().external_work == pytest.approx(pressed.total().external_work, rel=1e-10)
    check_balance(loading, 1e-12)


def test_what_contact_exerts_on_a_held_node_is_not_its_reaction() -> None:
    """A side that is pushed ends in a corner that presses obliquely onto a slope."""
    slope = bk.Contact(bk.RigidHalfPlane(normal=(0.3, 1.0)))
    pushed = bk.Part("left", bk.PrescribedDisplacement(x=0.01, y=None), ("left",))
    top = bk.Part("top", bk.Traction(y=-0.1), ("top",))
    steps = tuple(
        bk.Step(t, {"parts.left.condition.x": "0.01*t", "parts.top.condition.y": "-0.1*t"}) for t in (1.0, 2.0)
    )
    scene = replace(LOOP, law=bk.Coulomb(0.3), parts=(pushed, bk.Part("foot", slope, ("bottom",)), top), steps=steps)
    check_balance(solved(scene), 1e-12)


def _block(name: str, y: float, given: dict[str, bk.PrescribedDisplacement]) -> bk.Body:
    parts = tuple(bk.Part(side, condition, (side,)) for side, condition in given.items())
    shape, placement = bk.Rectangle(1.0, 0.5), bk.Placement((0.0, y))
    return bk.Body(name=name, shape=shape, material=bk.Material(1.0, 0.3), parts=parts, placement=placement)


@pytest.mark.slow
def test_nor_is_what_a_body_exerts_on_a_held_node_of_its_partner() -> None:
    """The lower block is pushed along at a side whose corner the upper one rubs, by nodes of its own."""
    given = {"left": (0.0, None), "bottom": (None, 0.0)}
    lower = _block("lower", 0.0, {name: bk.PrescribedDisplacement(*xy) for name, xy in given.items()})
    upper = _block("upper", 0.5, {"top": bk.PrescribedDisplacement(0.0, -0.01)})
    pair = bk.ContactPair(("upper.bottom", "lower.top"), multipliers_on="upper.bottom")
    steps = tuple(bk.Step(time, {"bodies.lower.parts.left.condition.x": "0.02*t"}) for time in (1.0, 2.0))
    assembly = bk.Scene(title="Rubbed", bodies=(lower, upper), contacts=(pair,), law=bk.Coulomb(0.3), steps=steps)
    loading = solved(assembly)
    assert loading.total().dissipation > 0.0
    check_balance(loading, 1e-10)


@pytest.mark.slow
def test_bodies_and_a_punch_balance_too() -> None:
    """A punch is pressed down by a force and moved to and fro."""
    steps = (
        bk.Step(1.0, {"rigid.punch.force_y": "-1e-3*t"}, increments=2),
        bk.Step(3.0, {"rigid.punch.x": "1e-3*sin(pi*(t - 1))"}, increments=4),
    )
    assembly = replace(driven(x=0.0, force_y=-1e-3), law=bk.Coulomb(0.3), steps=steps)
    loading = solved(assembly)
    check_balance(loading, 1e-10)
    assert loading.total().dissipation > 0.0


HALF_PLANE = bk.Scene(
    title="Cylinder on a half-plane",
    shape=bk.ElasticHalfPlane(-0.07, 0.07),
    material=bk.Material(1.0, 0.3),
    law=bk.Coulomb(0.3),
    far=bk.FarField(x=0.0, force_y=1e-3, turn=0.0),
    parts=(bk.Part("zone", bk.Contact(bk.Gap(bk.Expression("x**2 / 2")))),),
    mesh=bk.MeshOptions(elements=60),
)


def test_a_half_plane_is_pressed_and_sheared_from_far_away() -> None:
    """What drives it there does the work; the shear is too small to slide, and slips in an annulus."""
    press = bk.Step(1.0, {"far.force_y": "1e-3*t"}, increments=3)
    shear = bk.Step(3.0, {"far.x": "3e-4*sin(pi/2*(t - 1))"}, increments=4)
    loading = solved(replace(HALF_PLANE, steps=(press, shear)))
    check_balance(loading, 1e-11)
    sheared = loading.steps[4]
    assert 0.0 < abs(sheared.force_tangential) < 0.3 * sheared.force_normal
    counts = sheared.as_dict()
    assert counts["n_slip"] > 0
    assert counts["n_stick"] > 0


@pytest.mark.parametrize(
    "scene",
    [
        replace(LOOP, steps=(), body_forces=(bk.Gravity(1e-2, (0.0, -1.0)),)),
        replace(HALF_PLANE, far=bk.FarField(x=1e-4, force_y=1e-3, turn=1e-4)),
    ],
    ids=["block", "half-plane"],
)
def test_what_is_given_is_interpolated_between_two_steps(scene: bk.Scene) -> None:
    """Loads, weight, prescribed displacements, motions far away: halfway they are those of the step halfway."""
    prepared = prepare_steps(load_steps(replace(scene, load_factors=(1.0, 2.0, 3.0))), scene.build_mesh())
    before = build_model(prepared[0])
    halfway, after = (before.under(each) for each in prepared[1:])
    expected = halfway.problem.sticking_state.traction
    found = after.between(before, 0.5).sticking_state.traction
    assert np.abs(expected).max() > 0.0
    np.testing.assert_allclose(found, expected, atol=1e-12 * np.abs(expected).max())


def test_with_weight_the_external_work_follows_from_the_balance() -> None:
    weight = bk.Gravity(1e-3, (0.0, -1.0), is_constant=True)
    loading = solved(replace(LOOP, body_forces=(weight,), steps=LOOP.steps[:1]))
    check_balance(loading, 1e-12)
    assert loading.steps[0].work.external_work > 0.0


def test_a_step_that_fails_is_gone_in_halves() -> None:
    """Two full steps settle small increments of one body and no large ones."""
    impatient = bk.SemismoothNewton(max_steps=2)
    jump = (bk.Step(1.0, {"parts.top.condition.y": "-0.01*t"}), bk.Step(2.0, {SHEAR: 0.01}))
    patient, halved = (solved(replace(LOOP, steps=jump, solver=each)) for each in (LOOP.solver, impatient))
    assert patient.steps[1].n_increments == 1
    assert halved.steps[1].n_increments > 1
    assert halved.steps[1].time == 2.0
    check_balance(halved, 1e-12)
    assert halved.steps[1].force_tangential == pytest.approx(patient.steps[1].force_tangential, rel=1e-9)  # it slides


def test_finished_steps_are_kept_and_named() -> None:
    n_solves = count(1)
    hopeless = Failing(fails=lambda problem, start: next(n_solves) > 2)
    steps = (
        bk.Step(1.0, {"parts.top.condition.y": "-0.01*t"}),
        bk.Step(1.5),
        bk.Step(2.0, {SHEAR: 0.006}),
        bk.Step(3.0),
    )
    solution = bk.run(replace(LOOP, steps=steps, solver=hopeless))
    assert solution.status is Status.LOAD_NOT_REACHED
    assert solution.message.startswith("load step 3 of 4: ")
    assert "Finished: 2 of 4 steps, up to t = 1.5. The fields are those of the step before." in solution.message
    assert solution.loading is not None
    assert [step.time for step in solution.loading.steps] == [1.0, 1.5]
    assert not solution.is_certified
    assert solution.scene.steps == (bk.Step(1.5),)


def test_a_single_step_is_static() -> None:
    """Slip counts from rest, as without steps: a step alone changes nothing but the time."""
    at_once = replace(LOOP, steps=(bk.Step(7.0, {SHEAR: 0.005}),))
    parts = tuple(
        replace(part, condition=bk.PrescribedDisplacement(0.005, -0.01)) if part.name == "top" else part
        for part in LOOP.parts
    )
    plain = bk.run(replace(LOOP, steps=(), parts=parts))
    np.testing.assert_array_equal(bk.run(at_once).contact.sigma_t, plain.contact.sigma_t)
    assert plain.loading is None


def sliding(law: bk.FrictionLaw, increments: int, duration: float = 1.0) -> LoadHistory:
    """A block is pressed on a floor and dragged along it by its top."""
    top = {SHEAR: f"0.05*(t - 1)/{duration}"}
    press = bk.Step(1.0, {"parts.top.condition.y": "-0.01*t"})
    steps = (press, bk.Step(1.0 + duration, top, increments=increments))
    return solved(replace(LOOP, law=law, steps=steps))


def test_friction_falls_with_the_slip() -> None:
    """At the end every node has slipped farther than D; on the way each carries what its own slip has left."""
    law = SlipWeakening(0.3, 0.1, 0.03)
    loading = sliding(law, 5)
    last = loading.steps[-1]
    assert last.slip.min() > 0.03
    assert last.force_tangential == pytest.approx(-0.1 * last.force_normal, rel=1e-9)
    for step in loading.steps:
        slips = np.array(step.contact.status_words()) == "slip"
        left = np.maximum(1.0 - step.slip / 0.03, 0.0)
        bound = (0.1 + 0.2 * left) * np.abs(step.contact.sigma_n)
        np.testing.assert_allclose(np.abs(step.contact.sigma_t)[slips], bound[slips], rtol=1e-8)
        assert np.all(np.abs(step.contact.sigma_t) <= bound * (1.0 + 1e-8) + 1e-12)
    check_balance(loading, 1e-11)


@pytest.mark.slow
@pytest.mark.parametrize("duration", [1.0, 0.5])
def test_friction_grows_with_the_speed(duration: float) -> None:
    """Twice as fast, all nodes sliding: the coefficients are those of the law at the speed of the top."""
    last = sliding(bk.RateStrengthening(0.1, 0.02, 0.01), 10, duration).steps[-1]
    speed = 0.05 / duration  # of the top, and of every node of a block that slides as a whole
    expected = 0.1 + 0.02 * np.log1p(speed / 0.01)
    assert -last.force_tangential / last.force_normal == pytest.approx(expected, rel=1e-9)


@pytest.mark.slow
def test_a_bound_in_the_result_is_that_of_the_slip() -> None:
    law = bk.RateStrengthening(0.1, 0.02, 0.01)
    steps = (LOOP.steps[0], bk.Step(2.0, {SHEAR: "0.05*(t - 1)"}, increments=4))
    solution = bk.run(replace(LOOP, law=law, steps=steps))
    assert solution.friction_bound is not None
    np.testing.assert_allclose(solution.friction_bound, np.abs(solution.contact.sigma_t), rtol=1e-8)
    assert solution.between_nodes is not None
    assert solution.between_nodes.cone_excess < 1e-3  # of products of interpolants; 0.03 with the bound of slow slip
    check = violations_of(solution)
    assert check.is_good, check.faults


@pytest.mark.slow
def test_a_law_that_never_agrees_with_its_slip_is_named() -> None:
    """A bound that all but vanishes at the first slip, under a load: the block snaps forward without end."""
    brittle = SlipWeakening(0.4, 0.0, 1e-6)
    parts = tuple(replace(p, condition=bk.Traction(y=-1.0)) if p.name == "top" else p for p in LOOP.parts)
    steps = (bk.Step(1.0), bk.Step(2.0, {SHEAR: 0.35}))
    solution = bk.run(replace(LOOP, law=brittle, parts=parts, steps=steps))
    assert solution.status in (Status.STALLED, Status.UNSOLVABLE_LOAD, Status.CYCLING)
    assert "Finished: 1 of 2 steps" in solution.message


@pytest.mark.slow
@pytest.mark.parametrize("accuracy", [2e-2, 5e-3])
def test_histories_with_an_accuracy(accuracy: float) -> None:
    steps = (LOOP.steps[0], replace(LOOP.steps[1], increments=6))
    options: dict[str, Any] = {"mesh": bk.MeshOptions(accuracy=accuracy), "discretisation": bk.Galerkin(2)}
    solution = bk.run(replace(LOOP, steps=steps, **options))
    assert solution.is_converged, solution.message
    assert solution.loading is not None
    assert solution.loading.is_complete
    assert solution.estimated_error is not None
    assert solution.estimated_error <= accuracy
    fine = replace(LOOP, steps=steps, mesh=bk.MeshOptions(elements=int(2.0 / accuracy)), discretisation=bk.Galerkin(2))
    for one, other in zip(solution.loading.steps, solved(fine).steps, strict=True):
        assert one.elastic_energy == pytest.approx(other.elastic_energy, rel=accuracy)  # the square of it, in theory


@pytest.mark.slow
def test_histories_of_bodies_with_an_accuracy() -> None:
    """Two cylinders are pressed more and less: the meshes do for the step that needs most."""
    cylinders = replace(bk.load_scene("two-cylinders"), mesh=bk.MeshOptions(accuracy=0.05))
    solution = bk.run(replace(cylinders, load_factors=(0.3, 1.0, 0.0)))
    assert solution.is_converged, solution.message
    assert solution.loading is not None
    assert solution.loading.is_complete
    single = bk.run(cylinders)
    pressed = solution.loading.steps[1]
    assert pressed.elastic_energy == pytest.approx(single.energy, rel=5e-3)  # twice the square of the accuracy
    check_balance(solution.loading, 1e-9)


def test_the_worst_step_guides_the_mesh() -> None:
    """Errors are the largest of all steps on every element, measured by the largest energy."""
    steps = bk.run([replace(LOOP, steps=(LOOP.steps[0], replace(LOOP.steps[1], increments=3)))])
    guide, errors = StepErrors(steps), np.array([step.body.element_errors for step in steps])
    unit = max(step.error_unit for step in steps)
    assert guide.unit == unit
    np.testing.assert_array_equal(guide.required(), [errors.max(axis=0)])
    assert guide.energy == pytest.approx(np.sqrt(errors.max(axis=0).sum() / unit), rel=1e-14)
    assert guide.energy >= max(np.sqrt(own.sum() / unit) for own in errors)
    assert guide.worst is steps[int(np.argmax(errors.sum(axis=1)))]


def test_degrees_do_not_rise_in_histories() -> None:
    mesh = bk.MeshOptions(accuracy=1e-2, rising_degrees=True)
    with pytest.raises(bk.InputError, match="32 load steps: degrees rise only for single loads"):
        bk.run(replace(LOOP, mesh=mesh, discretisation=bk.Galerkin(2)))


def test_work_adds_up() -> None:
    assert StepWork(1.0, 2.0, 3.0) + StepWork(0.5, 0.25, 0.125) == StepWork(1.5, 2.25, 3.125)


@pytest.mark.slow
def test_laws_that_depend_on_slip_share_what_does_not_depend_on_the_law(monkeypatch: pytest.MonkeyPatch) -> None:
    """Each law of an increment is another problem; the body is asked for little more than the counted solves."""
    from bemkit.contact.dense_body import DenseBody

    n_responses, respond = 0, DenseBody.respond

    def counted(self: DenseBody, conditions: Any) -> Any:
        nonlocal n_responses
        n_responses += 1
        return respond(self, conditions)

    monkeypatch.setattr(DenseBody, "respond", counted)
    press, shear = LOOP.steps
    loading = solved(replace(LOOP, law=SlipWeakening(0.6, 0.3, 0.05), steps=(press, replace(shear, increments=10))))
    n_solves = sum(step.linear_solves for step in loading.steps)
    assert n_solves > 2 * len(loading.steps)
    assert n_responses <= 1.3 * n_solves


def slider(*steps: bk.Step) -> LoadHistory:
    """Push a half-plane on a rigid floor: a spring of the compliance 1 / (pi E') that slips as a whole."""
    return solved(
        bk.Scene(
            title="slider",
            shape=bk.PeriodicHalfPlane(1.0),
            material=bk.Material(100.0, 0.0),
            law=bk.Coulomb(0.4),
            far=bk.FarField(x=0.0, force_y=2.0),
            parts=(bk.Part("floor", bk.Contact(bk.Gap())),),
            steps=steps,
            mesh=bk.MeshOptions(8),
        )
    )


@pytest.mark.parametrize(("n_increments", "tolerance"), [(1, 0.1), (2, 0.1), (8, 0.01)])
def test_the_dissipation_that_coarse_increments_miss_is_estimated(n_increments: int, tolerance: float) -> None:
    """A closed cycle of a slider of the friction F and the compliance c takes 4 F (A - c F)."""
    loading = slider(bk.Step(5.0, {"far.x": "0.01 * sin(pi / 2 * t)"}, increments=5 * n_increments))
    friction, compliance = 0.8, 1.0 / (100.0 * np.pi)
    cycle = loading.total(n_increments)
    exact = 4.0 * friction * (0.01 - compliance * friction)
    assert cycle.dissipation + cycle.missed_dissipation == pytest.approx(exact, rel=tolerance)
    assert len(list(loading.warnings())) == (n_increments < 4)
    if n_increments == 1:
        assert cycle.dissipation < 0.8 * exact


def test_slip_under_a_rising_bound_misses_little() -> None:
    """Friction of 0.785 rises with its bound from 0.8 to 1.6; its mean is that of the slip to 1 %."""
    first = bk.Step(1.0, {"far.x": 0.0025})
    work = slider(first, bk.Step(2.0, {"far.x": 0.0125, "far.force_y": 4.0})).total(1)
    assert 0.0 < work.missed_dissipation < 0.01 * work.dissipation


def test_slip_under_a_falling_bound_misses_nothing() -> None:
    """The bound meets a friction of 0.63 and falls to 0.2: the mean of both is that of the slip."""
    loading = slider(bk.Step(1.0, {"far.x": 0.002}), bk.Step(2.0, {"law.friction_coefficient": 0.1}))
    work = loading.total(1)
    slip = (0.002 * 100.0 * np.pi - 0.2) / (100.0 * np.pi)
    assert work.dissipation == pytest.approx(0.5 * (0.002 * 100.0 * np.pi + 0.2) * slip, rel=1e-9)
    assert work.missed_dissipation <= 1e-9 * work.dissipation


def on_plate(law: bk.FrictionLaw, **changes: Any) -> bk.Scene:
    """Return a block on a plate, which a rigid plane without friction presses."""
    plate = bk.Body(
        name="plate",
        shape=bk.Rectangle(4.0, 1.0, (-2.0, -1.0)),
        material=bk.Material(1.0, 0.3),
        parts=(bk.Part("base", bk.Clamped(), ("bottom",)),),
        mesh=bk.MeshOptions(elements=80),
    )
    block = bk.Body(name="block", shape=bk.Rectangle(1.0, 0.5, (-0.5, 0.0)), material=bk.Material(1.0, 0.3))
    plane = bk.RigidBody(name="plane", obstacle=bk.RigidHalfPlane((0.0, 0.5), (0.0, -1.0)), y=-2e-3, x=0.0)
    pairs = bk.ContactPair(("plate.top", "block.bottom"), law=law), bk.ContactPair(("block.top", "plane"))
    stated = {"bodies": (plate, block), "rigid": (plane,), "contacts": pairs, "mesh": bk.MeshOptions(elements=40)}
    return bk.Scene(**{"title": "block", **stated, **changes})


def test_friction_of_the_first_step_dissipates() -> None:
    """Under loads in proportion all works grow with the square of the load factor."""
    plain = on_plate(bk.Coulomb(0.2))
    pressed = bk.Part("top", bk.Pressure(1e-3), ("top",))
    block = replace(plain.bodies[1], parts=(pressed,))
    rest = {"bodies": (plain.bodies[0], block), "rigid": (), "contacts": plain.contacts[:1]}
    loading = bk.run(replace(plain, **rest, load_factors=(1.0, 2.0))).loading
    assert loading is not None
    first, second = (step.work for step in loading.steps)
    assert first.dissipation > 1e-3 * first.external_work
    assert first.dissipation == pytest.approx(second.dissipation / 3.0, rel=1e-9)
    assert abs(first.increment_work) < 1e-9 * first.external_work
    assert not loading.total().missed_dissipation > 1e-9 * second.dissipation


def test_friction_that_rises_steeply_with_the_rate_agrees_with_the_slip() -> None:
    """In short steps a small slip makes a large rate: the slip of one solve makes a law under which the next rests."""
    steps = (bk.Step(1.0), bk.Step(1.2, {"rigid.plane.y": -2.5e-3}, increments=2))
    solution = bk.run(on_plate(bk.RateStrengthening(0.1, 0.02, 1e-4), steps=steps))
    assert solution.is_converged, solution.message
    assert "slip" in solution.contact.status_words()
    check_solution(solution, solution.at_step(2))
