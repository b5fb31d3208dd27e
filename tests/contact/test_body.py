import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bemkit.contact.body import ContactState, SingularResponse, augmented, separated, slip, stick
from bemkit.contact.dense_body import DenseBody
from bemkit.contact.equilibrium import Imbalance
from bemkit.contact.laws import Coulomb
from bemkit.contact.problem import ContactProblem
from bemkit.operators.boundary_equations import LinearConditions
from tests.handmade import block_body, random_body


def body_and_data(seed):
    random = np.random.default_rng(seed)
    body = random_body(random, int(random.integers(1, 12)))
    return body, random


def residual(conditions, state):
    left = np.einsum("nij,nj->ni", conditions.on_displacement, state.displacement)
    return left + np.einsum("nij,nj->ni", conditions.on_traction, state.traction) - conditions.value


@settings(max_examples=50)
@given(st.integers(0, 10**6))
def test_a_response_meets_its_conditions_and_the_stiffness(seed):
    body, random = body_and_data(seed)
    n = body.n_contact
    gap, reference = random.normal(size=n), random.normal(size=n)
    direction = random.choice([-1.0, 1.0], n)
    kinds = [
        separated(n),
        stick(gap, reference),
        slip(gap, direction, np.full(n, -0.2), random.uniform(0.0, 1.0, n)),
        augmented(gap, reference, random.normal(size=(n, 2)), 3.0, 7.0),
    ]
    conditions = kinds[0]
    for kind in kinds[1:]:
        conditions = conditions.replaced(np.repeat(random.random((n, 1)) < 0.4, 2, axis=1), kind)
    state = body.respond(conditions)
    size = np.abs(state.traction).max() + np.abs(body.load).max()
    assert np.abs(residual(conditions, state)).max() <= 1e-11 * size
    assert body.imbalance(state).force <= 1e-12


def test_prescribed_values_are_met_exactly():
    body, random = body_and_data(3)
    n = body.n_contact
    gap = random.normal(size=n)
    is_open = np.arange(n) % 3 == 0
    slides = np.arange(n) % 3 == 1
    conditions = stick(gap, gap).replaced(np.repeat(is_open[:, None], 2, axis=1), separated(n))
    sliding = slip(gap, np.ones(n), np.full(n, -0.3), np.zeros(n))
    conditions = conditions.replaced(np.repeat(slides[:, None], 2, axis=1), sliding)
    state = body.respond(conditions)
    assert np.array_equal(state.traction[is_open], np.zeros((is_open.sum(), 2)))
    assert np.array_equal(state.u_n[~is_open], gap[~is_open])
    assert np.array_equal(state.u_t[~is_open & ~slides], gap[~is_open & ~slides])
    assert np.array_equal(state.sigma_t[slides], 0.3 * state.sigma_n[slides])


def test_a_floating_body_without_contact_does_not_respond():
    body = block_body()
    with pytest.raises(SingularResponse, match="leave a rigid motion free"):
        body.respond(separated(body.n_contact))
    unnamed = DenseBody(body.stiffness, body.load, body.weights)
    with pytest.raises(SingularResponse, match="do not hold the body"):
        unnamed.respond(separated(body.n_contact))
    with pytest.raises(SingularResponse, match="neither displacement nor stiffness"):
        DenseBody(np.zeros((2, 2)), np.zeros(2), np.ones(1)).respond(separated(1))


def test_springs_hold_a_floating_body_where_it_is():
    body = block_body()
    place = np.stack([np.full(body.n_contact, 0.3), np.zeros(body.n_contact)], axis=1)
    # With stiff springs the body is lifted by load / (spring * length) only; the load is 0.5 on a length of about 1.
    state = body.respond(separated(body.n_contact).regularised(place, 1e6))
    assert np.allclose(state.displacement, place, atol=1e-4)
    assert body.weights @ state.sigma_n == pytest.approx(-0.5)


def test_rigid_work_and_imbalance():
    body = block_body()
    assert body.rigid_load() == pytest.approx([0.5])  # pressed on half of its top, towards the obstacle
    assert block_body(is_held_sideways=False, push=0.2).rigid_load() == pytest.approx([0.5, 0.1, 0.2])
    held = body.respond(stick(np.zeros(body.n_contact), np.zeros(body.n_contact)))
    assert body.imbalance(held).worst < 1e-12
    wrong = ContactState(held.displacement, 1.1 * held.traction)
    off = body.imbalance(wrong)
    assert min(off.force, off.moment) > 1e-2
    none = DenseBody(np.eye(2), np.zeros(2), np.ones(1))
    assert none.imbalance(ContactState(np.zeros((1, 2)), np.zeros((1, 2)))) == Imbalance(0.0, 0.0)


def test_stiffness_scale_ignores_nodes_without_stiffness():
    assert DenseBody(np.diag([2.0, 9.0, 0.0, 9.0]), np.zeros(4), np.array([0.5, 1.0])).stiffness_scale == 4.0
    assert DenseBody(np.array([[0.0, 3.0], [-3.0, 1.0]]), np.zeros(2), np.ones(1)).stiffness_scale == 3.0
    assert DenseBody(np.zeros((2, 2)), np.zeros(2), np.ones(1)).stiffness_scale == 1.0
    stretched = np.diag([1e-13, 4.0, -1e-13, 4.0])  # two nodes of a free body: only their distance is resisted
    assert DenseBody(stretched, np.zeros(4), np.ones(2), np.ones((3, 2, 2))).stiffness_scale == 4.0
    assert DenseBody(stretched, np.zeros(4), np.array([0.1, 0.5]), modulus=6.0).stiffness_scale == 20.0


def test_states_blend():
    one, other = ContactState(np.zeros((1, 2)), np.ones((1, 2))), ContactState(np.ones((1, 2)), np.zeros((1, 2)))
    assert np.array_equal(one.blended(other, 0.25).displacement, [[0.25, 0.25]])
    assert np.array_equal(one.blended(other, 0.25).traction, [[0.75, 0.75]])
    assert one.blended(other, 1.0) is other


@pytest.mark.parametrize(
    ("make", "complaint"),
    [
        (lambda: DenseBody(np.eye(3), np.zeros(2), np.ones(1)), r"stiffness has the shape \(3, 3\); 1 contact nodes"),
        (lambda: DenseBody(np.eye(2), np.zeros(3), np.ones(1)), r"load has the shape \(3,\)"),
        (lambda: DenseBody(np.eye(2) * np.nan, np.zeros(2), np.ones(1)), "stiffness contains nan"),
        (lambda: DenseBody(np.eye(2), np.zeros(2), np.zeros(1)), "weights has the entry 0"),
        (lambda: DenseBody(np.zeros((0, 0)), np.zeros(0), np.zeros(0)), "weights is empty"),
        (lambda: DenseBody(np.eye(2), np.zeros(2), np.ones(1), np.ones((1, 2))), r"motions has the shape \(1, 2\)"),
        (
            lambda: DenseBody(np.eye(2), np.zeros(2), np.ones(1), np.ones((2, 1, 2))),
            "a stiffness of 2 unknowns with 2 rigid motions",
        ),
        (
            lambda: DenseBody(np.eye(2), np.zeros(2), np.ones(1), modulus=0.0),
            "modulus = 0; give the E' of the material",
        ),
        (lambda: DenseBody(np.eye(2), np.zeros(2), np.ones(1), modulus=np.inf), "modulus = inf; give the E'"),
        (lambda: ContactState(np.zeros((2, 2)), np.zeros((1, 2))), r"traction has the shape \(1, 2\); give \(2, 2\)"),
        (lambda: ContactState(np.zeros(2), np.zeros((1, 2))), "displacement has the shape"),
        (lambda: LinearConditions(np.zeros((1, 2, 2)), np.zeros((2, 2, 2)), np.zeros((1, 2))), "on_traction has"),
        (lambda: LinearConditions(np.zeros((1, 2, 2)), np.zeros((1, 2, 2)), np.zeros(2)), "value has the shape"),
        (lambda: problem(gap=np.zeros(2)), r"gap has the shape \(2,\); the body has 1 contact nodes"),
        (lambda: problem(gap=np.array([np.nan])), "gap is nan at contact node 0"),
        (lambda: problem(gap=np.array([-np.inf])), "gap is -inf at contact node 0"),
        (lambda: problem(slip=np.array([np.inf])), "reference_slip is inf at contact node 0"),
    ],
)
def test_refusals(make, complaint):
    with pytest.raises(ValueError, match=complaint):
        make()


def problem(gap=None, slip=None):
    body = DenseBody(np.eye(2), np.zeros(2), np.ones(1))
    return ContactProblem(body, np.zeros(1) if gap is None else gap, Coulomb(0.1), slip)
