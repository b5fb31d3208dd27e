"""Bodies whose equations are compressed: the answers, statuses and certificates of dense ones."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import bemkit as bk
from bemkit import threads
from bemkit.contact.body import ContactState, SingularResponse, separated, stick
from bemkit.contact.contact_nodes import NoContactNodesError
from bemkit.contact.hierarchical_body import HierarchicalBody, hierarchical_body
from bemkit.contact.problem import ContactProblem
from bemkit.errors import InputError
from bemkit.model.model import Model, build_model
from bemkit.model.prepared import prepare
from bemkit.operators.hierarchy.factor import Factor
from bemkit.operators.hierarchy.skeletons import Compression
from bemkit.operators.hierarchy.system import HierarchicalSystem, LocalConditions
from bemkit.operators.linear_solvers import DenseCholesky, Hierarchical
from bemkit.operators.steklov_poincare.hierarchical import HierarchicalCollocation
from bemkit.operators.steklov_poincare.nodal_conditions import Support
from bemkit.testing import check_body
from tests.handmade import condensed_body, contact_conditions
from tests.scenes import Perforated, paper, squeezed, wavy
from tests.slow import slow_except

TOLERANCE = 1e-11


def in_both_ways(scene: bk.Scene, n_elements: int, *, slopes: bool = True) -> tuple[bk.Scene, bk.Scene]:
    """Return a scene on compressed and on dense equations of collocation."""
    mesh = replace(scene.mesh, elements=n_elements, accuracy=None)
    scene = replace(scene, discretisation=bk.ConstantCollocation(slopes=slopes), mesh=mesh)
    return replace(scene, linear_solver=Hierarchical(TOLERANCE)), replace(scene, linear_solver=DenseCholesky())


def model_of(scene: bk.Scene) -> Model:
    model = build_model(prepare(scene, scene.build_mesh()))
    assert isinstance(model.body, HierarchicalBody)
    return model


def loose_block(travel: float = 0.0) -> bk.Scene:
    """A block on a floor that lies `travel` below it; friction alone holds it sideways."""
    return bk.Scene(
        title="loose block",
        shape=bk.Rectangle(2.0, 1.0),
        material=bk.Material(100.0, 0.3),
        law=bk.Coulomb(0.4),
        parts=(
            bk.Part("floor", bk.Contact(bk.RigidHalfPlane((0.0, -travel), (0.0, 1.0))), sides=("bottom",)),
            bk.Part("press", bk.Traction(x=0.1, y=-1.0), sides=("top",)),
        ),
    )


def on_floor() -> tuple[bk.Part, ...]:
    """The floor below a plate whose lower side is y = -1, and the press."""
    floor, press = loose_block().parts
    return replace(floor, condition=bk.Contact(bk.RigidHalfPlane((0.0, -1.0), (0.0, 1.0)))), press


def tilted() -> bk.Scene:
    """A quadrilateral on a plane at 20 degrees; a roller along its upper side, which stands in any direction."""
    turn = np.exp(1j * np.radians(20.0))
    corners = tuple((z.real, z.imag) for z in turn * np.array([0.0, 2.0, 2.2 + 1.5j, 0.3 + 1.2j]))
    return bk.Scene(
        title="tilted block",
        shape=bk.Polygon(corners),
        material=bk.Material(1.0, 0.45, bk.Plane.STRAIN),
        law=bk.CohesiveCoulomb(0.6, cohesion=1e-3),
        parts=(
            bk.Part("floor", bk.Contact(bk.RigidHalfPlane((0.0, 0.0), (-turn.imag, turn.real))), sides=("side-1",)),
            bk.Part("roller", bk.Roller(), sides=("side-3",)),
            bk.Part("push", bk.Pressure(0.01), sides=("side-2",)),
            bk.Part("drag", bk.PrescribedDisplacement(x=0.004, y=-0.002), sides=("side-4",)),
        ),
    )


SCENES = {
    "paper-1": paper(1),
    "paper-2": paper(2),
    "wavy obstacle": wavy(),
    "loose block": loose_block(),
    "travelling block": loose_block(5.0),
    "tilted block": tilted(),
    "tresca": replace(paper(1), law=bk.Tresca(0.2)),
    "disc": bk.load_scene("disc-between-plates"),
    "plate with a round hole": replace(loose_block(), shape=bk.PlateWithHole(2.0, 1.5, 0.4)),
    "incompressible": replace(paper(1), material=bk.Material(1.0, 0.5)),
    "twelve holes": replace(loose_block(0.0), shape=Perforated(4, 3), parts=on_floor()),
    "half of a plate with a hole": squeezed(bk.PlateWithHole(2.0, 2.0, 0.4, (-1.0, -1.0)), symmetry=bk.Symmetry(x=0.0)),
    "quarter of a disc": squeezed(bk.Disk(1.0), symmetry=bk.Symmetry(x=0.0, y=0.0)),
    "strip": replace(loose_block(), shape=bk.Rectangle(20.0, 1.0), solver=bk.AugmentedLagrangian()),
    "weight and heat": replace(
        paper(1),
        body_forces=(bk.Gravity(0.5, (0.02, -0.3)), bk.Heating(0.01, bk.Expression("x + 0.5 * y"))),
    ),
    "turning": replace(loose_block(), body_forces=(bk.Rotation(0.2, 1.0, (0.3, 0.2)),)),
    "weight that grows": replace(loose_block(), body_forces=(bk.Gravity(1.0),), load_factors=(0.5, 1.0)),
    "load history": replace(paper(1), load_factors=(0.5, 1.0, 0.7)),
}


QUICK = ("loose block", "incompressible")


@pytest.mark.parametrize("name", slow_except(SCENES, *QUICK))
def test_statuses_and_tractions_are_those_of_dense_equations(name: str) -> None:
    symmetry = SCENES[name].symmetry
    n_elements = (480 if "holes" in name else 200) * (1 if symmetry is None else symmetry.n_images)
    compressed, dense = (bk.run(each) for each in in_both_ways(SCENES[name], n_elements))
    assert compressed.plan.is_compressed
    assert not dense.plan.is_compressed
    assert compressed.status is dense.status is bk.Status.CONVERGED
    assert compressed.linear_solves == dense.linear_solves
    np.testing.assert_array_equal(compressed.contact.status, dense.contact.status)
    stress = np.abs(dense.boundary.traction).max()
    for component in ("sigma_n", "sigma_t"):
        one, two = (getattr(each.contact, component) for each in (compressed, dense))
        np.testing.assert_allclose(one, two, atol=1e-8 * stress)
    size = np.abs(dense.boundary.displacement).max()
    np.testing.assert_allclose(compressed.boundary.displacement, dense.boundary.displacement, atol=1e-9 * size)
    assert compressed.energy == pytest.approx(dense.energy, rel=1e-9)


@pytest.mark.slow
def test_the_paper_s_method_without_slopes_is_the_same() -> None:
    compressed, dense = (bk.run(each) for each in in_both_ways(paper(1), 240, slopes=False))
    np.testing.assert_array_equal(compressed.contact.status, dense.contact.status)
    assert compressed.force_tangential == pytest.approx(dense.force_tangential, rel=1e-9)


def test_without_contact_all_of_the_body_is_solved_for() -> None:
    scene = bk.load_scene("bending")
    compressed, dense = (bk.run(each) for each in in_both_ways(scene, 240))
    assert compressed.plan.is_compressed
    size = np.abs(dense.boundary.displacement).max()
    np.testing.assert_allclose(compressed.boundary.displacement, dense.boundary.displacement, atol=1e-9 * size)
    steps = [bk.run(replace(each, load_factors=(1.0, 0.5))) for each in in_both_ways(scene, 240)]
    assert steps[0].energy == pytest.approx(steps[1].energy, rel=1e-9)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["paper-1", "loose block"])
def test_the_body_keeps_the_promises_of_a_body(name: str) -> None:
    model, loaded = (
        model_of(in_both_ways(replace(SCENES[name], load_factors=(factor,)), 200)[0]) for factor in (1.0, 0.4)
    )
    check_body(model.body, reloaded=loaded.body)


def test_a_response_factors_what_has_changed_alone() -> None:
    model = model_of(in_both_ways(paper(1), 300)[0])
    body, problem = model.body, model.problem
    assert isinstance(body, HierarchicalBody)
    factor, held = body.loaded.system.factor, stick(problem.gap, problem.slip_origin)
    body.respond(held)
    first = factor.n_factored
    one = np.zeros((problem.n_contact, 2), bool)
    one[0] = True
    body.respond(held.replaced(one, separated(problem.n_contact)))
    assert factor.n_factored == 1 < first == factor.compression.tree.n_leaves


def test_a_body_is_compressed_and_factored_once_for_all_load_steps(monkeypatch: pytest.MonkeyPatch) -> None:
    compressed, factored = [], []
    compress, update = Compression.of.__func__, Factor.update  # type: ignore[attr-defined]

    def of(cls: type, *arguments: object) -> Compression:
        compressed.append(compress(cls, *arguments))
        result: Compression = compressed[-1]
        return result

    def updated(factor: Factor, conditions: LocalConditions) -> None:
        update(factor, conditions)
        factored.append(factor.n_factored)

    monkeypatch.setattr(Compression, "of", classmethod(of))
    monkeypatch.setattr(Factor, "update", updated)
    place = "parts.left-load.condition.x"
    steps = bk.Step(1.0, {place: 0.0}), bk.Step(3.0, {place: "0.5*(t - 1)"}, increments=2)
    scenes = [replace(scene, steps=steps) for scene in in_both_ways(paper(1), 240)]
    solution, dense = (bk.run(scene) for scene in scenes)
    assert len(compressed) == 1  # though nothing presses from the left in the first step
    n_leaves = compressed[0].tree.n_leaves
    assert factored[0] == n_leaves
    assert max(factored[1:]) <= 0.5 * n_leaves  # where contact is
    np.testing.assert_array_equal(solution.contact.status, dense.contact.status)
    assert solution.force_tangential == pytest.approx(dense.force_tangential, rel=1e-9)


def test_the_certificate_finds_states_that_are_no_responses() -> None:
    model = model_of(in_both_ways(paper(1), 240)[0])
    state = model.problem.sticking_state
    assert model.body.imbalance(state).is_below(1e-9)
    same = ContactState(state.displacement.copy(), state.traction.copy())
    assert model.body.imbalance(same).worst < 1e-8
    more = ContactState(state.displacement, state.traction + 1e-3 * np.abs(state.traction).max())
    assert not model.body.imbalance(more).is_below(1e-6)
    bump = 1e-3 * np.sin(np.arange(len(state.u_n)))[:, None]
    bent = ContactState(state.displacement + bump, state.traction)
    assert not model.body.imbalance(bent).is_below(1e-6)


def test_a_certificate_asks_for_no_further_response(monkeypatch: pytest.MonkeyPatch) -> None:
    model = model_of(in_both_ways(paper(1), 240)[0])
    body, problem, solved = model.body, model.problem, []
    state = HierarchicalSystem.state
    monkeypatch.setattr(HierarchicalSystem, "state", lambda *asked: [solved.append(asked), state(*asked)][1])
    one = problem.sticking_state
    two = body.respond(stick(problem.gap + 1e-4, problem.slip_origin))
    n_responses = len(solved)
    assert body.imbalance(two).is_below(1e-9)
    assert len(solved) == n_responses
    assert body.imbalance(one).is_below(1e-9)  # an earlier one, whose fields take its conditions again
    assert len(solved) > n_responses


@pytest.mark.slow
def test_two_threads_give_the_bits_of_one(monkeypatch: pytest.MonkeyPatch) -> None:
    solutions = []
    for count in (1, 2):
        monkeypatch.setattr(threads, "n_threads", lambda n_integrals, count=count: count)
        solutions.append(bk.run(in_both_ways(paper(1), 240)[0]))
    one, two = solutions
    assert np.array_equal(one.boundary.displacement, two.boundary.displacement)
    assert np.array_equal(one.contact.sigma_t, two.contact.sigma_t)


def test_a_coarse_tolerance_is_stated_and_seen_in_the_certificate() -> None:
    scene, _ = in_both_ways(paper(1), 240)
    body = model_of(replace(scene, linear_solver=Hierarchical(1e-8))).body
    assert body.accuracy == pytest.approx(1e-7)
    problem = model_of(replace(scene, linear_solver=Hierarchical(1e-8))).problem
    found = problem.body.imbalance(problem.sticking_state).worst
    assert 1e-12 < found < 1e-7


def test_a_free_body_is_singular() -> None:
    model = model_of(in_both_ways(paper(1), 240)[0])
    with pytest.raises(SingularResponse, match="leave a rigid motion free"):
        model.problem.respond(separated(model.problem.n_contact))


@pytest.mark.parametrize(
    "travel", [pytest.param(0.0, marks=pytest.mark.slow), 0.003], ids=["at rest", "moved by its support"]
)
def test_contact_nodes_that_a_support_holds_move_in_its_frame(travel: float) -> None:
    """Five nodes slide along a line that is neither along the contact boundary nor across it."""
    model = model_of(in_both_ways(loose_block(), 240)[0])
    prepared, (elastic,) = model.prepared, model.elastic
    body_data, candidates = prepared.only, prepared.only.candidates
    assert isinstance(elastic, HierarchicalCollocation)
    held = candidates.nodes.nodes[:5]
    across = np.broadcast_to([[0.6, 0.8]], (5, 1, 2))
    support = Support("guide", held, across, lambda x: np.full(x.shape, travel))
    conditions, contact = contact_conditions(body_data.own_space, [support], candidates.nodes)
    body = hierarchical_body(elastic, conditions, contact, body_data.force)
    dense = condensed_body(elastic, conditions, contact, body_data.force)
    np.testing.assert_array_equal(body.tangent_follows, dense.tangent_follows)
    assert body.tangent_follows.sum() == 5
    (law,) = prepared.scene.only.laws.values()
    problems = [ContactProblem(each, candidates.gap, law) for each in (body, dense)]
    ask = stick(0.01 * np.cos(np.arange(body.n_contact)), np.zeros(body.n_contact))
    opened = np.zeros((body.n_contact, 2), bool)
    opened[[3, 40]] = True
    ask = ask.replaced(opened, separated(body.n_contact))
    one, two = (problem.respond(ask) for problem in problems)
    assert np.abs(two.u_t[:5]).min() > 1e-4  # they slide
    for name in ("displacement", "traction"):
        size = np.abs(getattr(two, name)).max()
        np.testing.assert_allclose(getattr(one, name), getattr(two, name), atol=1e-9 * size)
    assert body.imbalance(one).is_below(1e-9)
    for ours, theirs in zip(body.recover(one), dense.recover(two), strict=True):
        np.testing.assert_allclose(ours, theirs, atol=1e-9 * np.abs(theirs).max())
    unknown = stick(np.zeros(body.n_contact), np.zeros(body.n_contact))
    with pytest.raises(InputError, match="contact node 0 follows from a support"):
        body.respond(unknown)


def test_a_contact_boundary_that_supports_fix_is_named() -> None:
    model = model_of(in_both_ways(paper(1), 240)[0])
    body = model.body
    assert isinstance(body, HierarchicalBody)
    with pytest.raises(NoContactNodesError, match="fix every node"):
        hierarchical_body(body.loaded.elastic, body.conditions, body.nodes.take(np.zeros(0, np.intp)), body.force)
