"""Several bodies as one: promises of a body, what drivers find, and what is refused."""

from dataclasses import replace

import numpy as np
import pytest
from scipy import sparse

from bemkit.contact.body import ContactState, SingularResponse, separated, slip, stick
from bemkit.contact.certificate import certify
from bemkit.contact.joined.joined_bodies import JoinedBodies
from bemkit.contact.joined.member import Member
from bemkit.contact.laws import Coulomb
from bemkit.contact.problem import ContactProblem
from bemkit.errors import InputError
from bemkit.operators.boundary_equations import LinearConditions
from bemkit.operators.linear_solvers import SingularMatrixError
from bemkit.solvers.alm import AugmentedLagrangian
from bemkit.solvers.base import solve
from bemkit.solvers.fixed_point import FixedPoint
from bemkit.solvers.ssn import SemismoothNewton
from bemkit.testing import check_body
from tests.contact.joined.blocks import joined, rectangle, row_of_blocks
from tests.slow import slow_only

FORMS = pytest.mark.parametrize("is_dense", [True, False])


@pytest.mark.parametrize("is_dense", slow_only([True, False], False))
def test_floating_blocks_keep_the_promises_of_a_body(is_dense):
    body = row_of_blocks((1.0, 3.0, 0.5), is_dense=is_dense)
    assert body.responses_are_expensive is not is_dense
    reloaded = body.under([1.3 * member.load for member in body.members], body.prescribed + 0.1)
    check_body(body, is_symmetric=True, reloaded=reloaded)
    assert reloaded.shapes is body.shapes  # with all that is factored
    assert reloaded.load is not body.load


def mixed_conditions(body):
    """Conditions of every kind, friction that follows the pressure included."""
    random = np.random.default_rng(2)
    gap, n = 0.1 * random.normal(size=body.n_contact), body.n_contact
    sliding = slip(gap, random.choice([-1.0, 1.0], n), np.full(n, -0.3), np.zeros(n))
    conditions = stick(gap, gap)
    conditions = conditions.replaced(np.repeat((np.arange(n) % 5 == 1)[:, None], 2, axis=1), separated(n))
    return conditions.replaced(np.repeat((np.arange(n) % 3 == 0)[:, None], 2, axis=1), sliding)


def test_both_forms_answer_alike():
    dense, large = (row_of_blocks((1.0, 3.0, 0.5), is_dense=is_dense) for is_dense in (True, False))
    conditions = mixed_conditions(dense)
    one, other = dense.respond(conditions), large.respond(conditions)
    assert np.abs(one.traction - other.traction).max() <= 1e-11 * np.abs(one.traction).max()
    assert np.abs(one.displacement - other.displacement).max() <= 1e-11 * np.abs(one.displacement).max()
    members = zip(dense.member_displacements(one), large.member_displacements(other), strict=True)
    assert max(np.abs(u - v).max() for u, v in members) <= 1e-11


@FORMS
def test_what_is_prescribed_is_met_exactly(is_dense):
    body = row_of_blocks((1.0, 3.0, 0.5), is_dense=is_dense)
    conditions = mixed_conditions(body)
    state = body.respond(conditions)
    slides = np.arange(body.n_contact) % 3 == 0
    is_open = (np.arange(body.n_contact) % 5 == 1) & ~slides
    assert np.array_equal(state.traction[is_open], np.zeros((is_open.sum(), 2)))
    assert np.array_equal(state.u_n[~is_open], conditions.value[~is_open, 0])
    assert np.array_equal(state.u_t[~is_open & ~slides], conditions.value[~is_open & ~slides, 1])
    assert np.array_equal(np.abs(state.sigma_t[slides]), np.abs(0.3 * state.sigma_n[slides]))


@FORMS
def test_displacements_of_the_members_go_with_the_state(is_dense):
    body = row_of_blocks((1.0, 3.0, 0.5), is_dense=is_dense)
    body = body.under([member.load for member in body.members], np.linspace(-0.1, 0.1, 2 * body.n_contact))
    state = body.respond(mixed_conditions(body))
    u = body.member_displacements(state)
    relative = body.gap_operator @ np.concatenate(u) + body.prescribed
    assert relative == pytest.approx(state.displacement.ravel(), abs=1e-12)  # displacements of 0.1
    forces = [member.stiffness @ moved - member.load for member, moved in zip(body.members, u, strict=True)]
    contact = body.gap_operator.T @ (body.weights[:, None] * state.traction).ravel()
    assert np.concatenate(forces) == pytest.approx(contact, abs=1e-12)


@FORMS
def test_tied_blocks_are_one_block(is_dense):
    """Two squares tied along a side, and the rectangle they make: equal forces at their feet for linear fields."""
    square, long = rectangle(1.0, 1.0, 4), rectangle(2.0, 1.0, 4)
    heights = [(r / 4, (1.0 if r % 4 else 0.5) / 4) for r in range(5)]
    left = [(0, square.node(0, y), -1, -1, -1, 0, weight) for y, weight in heights]
    between = [(1, square.node(0, y), 0, square.node(1, y), -1, 0, weight) for y, weight in heights]
    right = [(1, square.node(1, y), -1, -1, 1, 0, weight) for y, weight in heights]
    two = joined([square.member(), square.member()], np.zeros(2), left + between + right, is_dense=is_dense)
    near = [(0, long.node(0, y), -1, -1, -1, 0, weight) for y, weight in heights]
    far = [(0, long.node(2, y), -1, -1, 1, 0, weight) for y, weight in heights]
    one = joined([long.member()], np.zeros(1), near + far)
    # stretched by a linear field: u_x = x / 100 with free contraction is uniform stress along x, uniform shear none
    modulus = square.modulus
    y = np.linspace(0, 1, 5)
    contraction = -0.25 * 0.01 * (y - 0.5)  # nu / (1 - nu) = 1/4 in plane strain
    zero = np.zeros(5)
    states = two.respond(stick(np.r_[zero, zero, zero + 0.02], np.r_[-contraction, zero, contraction]))
    other = one.respond(stick(np.r_[zero, zero + 0.02], np.r_[-contraction, contraction]))
    assert states.sigma_n == pytest.approx(0.01 * modulus, rel=1e-10)
    assert other.sigma_n == pytest.approx(0.01 * modulus, rel=1e-10)
    assert np.abs(states.sigma_t).max() <= 1e-12


@pytest.mark.parametrize("friction_coefficient", [0.3, 0.6])
@pytest.mark.parametrize("moduli", [pytest.param((1.0, 1.0), marks=pytest.mark.slow), (1.0, 3.0, 0.5)])
def test_drivers_agree_on_blocks_between_others(moduli, friction_coefficient):
    body = row_of_blocks(moduli, lift=0.01)
    problem = ContactProblem(body, np.full(body.n_contact, -0.2), Coulomb(friction_coefficient))
    states = [solve(problem, solver).state for solver in (SemismoothNewton(), AugmentedLagrangian(), FixedPoint())]
    for state in states[1:]:
        assert np.abs(state.traction - states[0].traction).max() <= 1e-7  # certificates of 1e-9, tractions of 0.2
        assert np.abs(state.displacement - states[0].displacement).max() <= 1e-7


@FORMS
def test_each_member_is_judged_by_its_own_forces(is_dense):
    """A block that carries a hundredth of the others, and forces on it that are off by a hundredth of those."""
    body = row_of_blocks((1.0, 1.0, 1.0), press=0.0, is_dense=is_dense)
    loads = [share * member.load for share, member in zip((1.0, 0.01, 1.0), body.members, strict=True)]
    body = body.under(loads, body.prescribed)
    state = body.respond(stick(np.zeros(body.n_contact), np.zeros(body.n_contact)))
    assert body.imbalance(state).is_below(1e-12)
    light = np.flatnonzero(body.owners[0::2].toarray()[:, 1] > 0.0)
    traction = state.traction.copy()
    traction[light] *= 1.01
    assert body.imbalance(ContactState(state.displacement, traction)).worst > 1e-3
    moved = state.displacement + 1e-3 * np.eye(len(state.displacement))[:, [3, 4]]
    assert body.imbalance(ContactState(moved, state.traction)).worst > 1e-3


def test_a_contact_is_certified_by_the_partner_that_carries_less():
    """A wall presses the first of three blocks; the others carry a hundredth of that, or next to nothing."""
    body = row_of_blocks((1.0, 1.0, 1.0))
    is_alone = np.arange(body.n_contact) % 4 == 0  # wall and first block; then those of the first and the second, ...
    for little, share in ((1e-2, 1e-2), (1e-9, 1e-3)):
        np.testing.assert_allclose(body.shares(np.where(is_alone, 3.0, 3.0 * little)), np.where(is_alone, 1.0, share))

    # friction of 1e-5 more than its bound, where contact carries a thousandth of the largest traction
    problem = ContactProblem(body, np.zeros(body.n_contact), Coulomb(0.5))
    traction = np.column_stack([np.where(is_alone, -1e3, -1.0), np.zeros(body.n_contact)])
    traction[5, 1] = 0.5 + 1e-5
    certificate = certify(problem, ContactState(np.zeros_like(traction), traction))
    assert certificate.cone_excess == pytest.approx(1e-5, rel=1e-6)


def test_the_compliant_partner_gives_the_scale_of_stiffness():
    body = row_of_blocks((1.0, 1e8, 1.0))
    assert body.modulus == pytest.approx(1.0 / (1.0 - 0.2**2))
    assert body.stiffness_scale == pytest.approx(body.modulus / 0.25)


def test_where_two_stiff_bodies_meet_their_own_stiffness_judges():
    """A displacement of 1e-6 is little beside soft bodies, and far from equilibrium between two 1e6 times stiffer."""
    body = row_of_blocks((1.0, 1e6, 1e6, 1.0))
    state = body.respond(stick(np.zeros(body.n_contact), np.zeros(body.n_contact)))
    assert body.imbalance(state).worst < 1e-8
    owners = body.owners[0::2].toarray() > 0.0
    for where, share in ((owners[:, 1] & owners[:, 2], 1.0), (owners[:, 0] & owners[:, 1], 1e-6)):
        moved = state.displacement + 1e-6 * where[:, None] * [1.0, 0.0] * np.cos(np.arange(body.n_contact))[:, None]
        assert 0.1 * share < body.imbalance(ContactState(moved, state.traction)).worst < 100.0 * share


@FORMS
def test_a_free_motion_is_singular(is_dense):
    body = row_of_blocks((1.0, 3.0, 0.5), is_dense=is_dense)
    touches = body.owners[0::2].toarray()[:, 1] > 0.0
    conditions = stick(np.zeros(20), np.zeros(20)).replaced(np.repeat(touches[:, None], 2, axis=1), separated(20))
    assert conditions.free_motions(body.rigid_motions()).shape[0] == 3
    with pytest.raises(
        SingularResponse, match="leave a rigid motion free: hold body 'block 2' by a support, or start with"
    ):
        body.respond(conditions)


def test_a_body_without_contact_is_named():
    square = rectangle(1.0, 1.0, 2)
    pairs = [(0, square.node(x, 0.0), -1, -1, 0, -1, 0.5) for x in (0.0, 0.5, 1.0)]
    with pytest.raises(InputError, match="nothing holds body 'lost'"):
        joined([square.member(), square.member(name="lost")], np.zeros(2), pairs)
    each_other = [(1, square.node(x, 0.0), 2, square.node(x, 1.0), 0, -1, 0.5) for x in (0.0, 0.5, 1.0)]
    members = [square.member(), square.member(name="up"), square.member(name="down")]
    with pytest.raises(InputError, match="nothing holds bodies 'up', 'down'"):
        joined(members, np.zeros(3), pairs + each_other)


def test_wrong_input_is_named():
    square = rectangle(1.0, 1.0, 2)
    good = square.member(name="a")
    for change, words in (
        ({"load": np.zeros(3)}, "stiffness has the shape"),
        ({"load": np.full(16, np.nan)}, "load contains nan"),
        ({"modulus": 0.0}, "modulus = 0"),
        ({"motions": np.zeros((4, 16))}, "three at most"),
    ):
        with pytest.raises(InputError, match=f"body 'a': .*{words}"):
            replace(good, **change)
    coupling = sparse.csr_array((np.ones(2), ([0, 1], [0, 1])), (2, 16))
    for member, words in (
        (replace(good, motions=good.motions[[0, 1, 1]]), "linearly dependent"),
        (replace(good, motions=np.eye(16)[:1]), "resists the rigid motions"),
        (replace(good, motions=good.motions[:2]), "free to move in more ways"),
    ):
        with pytest.raises(InputError, match=words):
            JoinedBodies((member,), coupling, np.zeros(2), np.ones(1)).respond(stick(np.zeros(1), np.zeros(1)))
    held = Member(np.eye(2), np.zeros(2), np.zeros((0, 2)), 1.0)
    for change, words in (
        ({"prescribed": np.zeros(3)}, "prescribed has the shape"),
        ({"weights": np.zeros(1)}, "weights has the entry 0"),
        ({"prescribed": np.full(2, np.inf)}, "prescribed contains inf"),
        ({"members": ()}, "gap_operator has the shape"),
    ):
        with pytest.raises(InputError, match=words):
            replace(JoinedBodies((held,), sparse.csr_array(np.eye(2)), np.zeros(2), np.ones(1)), **change)


def test_a_tie_that_others_imply_is_refused():
    square = rectangle(1.0, 1.0, 2)
    pairs = [(0, square.node(x, 0.0), -1, -1, 0, -1, 0.5) for x in (0.0, 0.5, 1.0, 1.0)]
    dense, large = (joined([square.member()], [0.0], pairs, is_dense=is_dense) for is_dense in (True, False))
    everywhere = stick(np.zeros(4), np.zeros(4))
    with pytest.raises(SingularMatrixError, match="tied to each other at all contact nodes"):
        dense.respond(everywhere)
    with pytest.raises(SingularResponse, match="do not hold the bodies"):
        large.respond(everywhere)
    once = everywhere.replaced(np.repeat((np.arange(4) == 3)[:, None], 2, axis=1), separated(4))
    assert large.respond(once).is_finite


def test_conditions_that_say_nothing_are_singular():
    body = row_of_blocks((1.0, 1.0), is_dense=False)
    nothing = LinearConditions(np.zeros((15, 2, 2)), np.zeros((15, 2, 2)), np.zeros((15, 2)))
    first = np.zeros((15, 2), bool)
    first[0, 1] = True
    conditions = stick(np.zeros(15), np.zeros(15)).replaced(first, nothing)
    with pytest.raises(SingularResponse, match="neither displacement nor traction"):
        body.respond(conditions)


@FORMS
def test_a_body_at_rest_that_an_obstacle_approaches_is_in_balance(is_dense):
    """Nothing acts, so that there is no force to which round-off of the relative displacements could be compared."""
    random = np.random.default_rng(5)
    root = random.normal(size=(8, 8))
    member = Member(root @ root.T + np.eye(8), np.zeros(8), np.zeros((0, 8)), 1.0)
    coupling = sparse.csr_array(random.normal(size=(8, 8)))
    body = JoinedBodies((member,), coupling, random.normal(size=8), np.ones(4), is_dense=is_dense)
    state = body.respond(separated(4))
    assert np.abs(state.displacement.ravel() - body.prescribed).max() < 1e-12
    nudged = replace(state, displacement=state.displacement * (1.0 + 1e-15))  # round-off of another processor
    assert body.imbalance(nudged).worst == 0.0
    assert body.imbalance(replace(state, displacement=state.displacement + 1e-9)).worst == np.inf
