"""Walls and arches of blocks: what stands, what falls, and which blocks move."""

from dataclasses import replace
from itertools import product

import numpy as np
import pytest

from bemkit.contact.laws import Coulomb, Tresca
from bemkit.contact.limit_load import largest_factor
from bemkit.contact.problem import ContactProblem
from bemkit.contact.solvability import find_unsolvable_load, friction_envelopes
from bemkit.operators.rigid_modes import as_rows
from bemkit.solvers.base import Status, solve
from bemkit.solvers.fallbacks import Fallbacks
from tests.contact.joined.blocks import arch, joined, rectangle, wall
from tests.slow import slow_except

# t/R of semicircular arches of N equal voussoirs at collapse by five hinges, block by block in limit analysis
THICKNESS = {15: 0.106265824, 25: 0.107030497}


def on_foundation(body, friction_coefficient=0.6):
    return ContactProblem(body, np.zeros(body.n_contact), Coulomb(friction_coefficient))


@pytest.mark.parametrize(("n", "is_dense"), slow_except(product((15, 25), (True, False)), (15, True), (15, False)))
def test_an_arch_stands_and_falls_at_the_thickness_of_limit_analysis(n, is_dense):
    stands = solve(on_foundation(arch(n, 1.02 * THICKNESS[n], is_dense=is_dense), 0.7), Fallbacks())
    assert stands.is_converged
    falls = solve(on_foundation(arch(n, 0.98 * THICKNESS[n], is_dense=is_dense), 0.7), Fallbacks(), throw=False)
    assert falls.status is Status.UNSOLVABLE_LOAD
    assert "voussoir" in falls.message


@pytest.mark.parametrize("is_dense", [True, False])
def test_a_wall_carries_its_weight(is_dense):
    body = wall(4, 5, 4, gravity=(0.0, -1e-3), is_dense=is_dense)
    found = solve(on_foundation(body), Fallbacks())
    foot = np.diff(body.owners[0::2].indptr) == 1  # nodes of one block only
    assert body.weights[foot] @ found.state.sigma_n[foot] == pytest.approx(-1e-3 * 4 * 10, rel=1e-11)
    assert found.certificate.worst <= 1e-11


@pytest.mark.slow
@pytest.mark.parametrize("is_dense", [True, False])
def test_a_push_beyond_what_friction_holds_moves_the_uppermost_course(is_dense):
    """Friction 0.6 under a course of weight 10 holds 6, on a side of unit height."""
    below, above = (wall(4, 5, 4, gravity=(0.0, -1e-3), push=6e-3 * share, is_dense=is_dense) for share in (0.98, 1.02))
    assert solve(on_foundation(below), Fallbacks()).is_converged
    falls = solve(on_foundation(above), Fallbacks(), throw=False)
    assert falls.status is Status.UNSOLVABLE_LOAD
    assert "'block 16'" in falls.message


@pytest.mark.parametrize("is_dense", [True, False])
@pytest.mark.parametrize("bound", slow_except((1e-4, 3e-4), 1e-4))
def test_friction_of_all_nodes_counts_where_it_needs_no_pressure(bound, is_dense):
    """A course of length 4 under friction of a given size, pushed on its side of unit height."""

    def escape(share):
        body = wall(2, 2, 4, gravity=(0.0, -1e-2), push=4.0 * bound * share, is_dense=is_dense)
        return find_unsolvable_load(ContactProblem(body, np.zeros(body.n_contact), Tresca(bound)))

    assert escape(0.99) is None
    moves = escape(1.01)
    assert moves is not None
    assert "'block 2', 'block 3', 'block 4'" in moves.description


@pytest.mark.parametrize("is_dense", [True, False])
def test_the_order_of_the_contact_nodes_decides_nothing(is_dense):
    """A square pressed beside the middle of its foot, whose outermost nodes are neither first nor last."""
    square = rectangle(1.0, 1.0, 4)
    pairs = [(0, square.node(x, 0.0), -1, -1, 0, -1, 0.25) for x in (0.25, 0.0, 1.0, 0.5, 0.75)]

    def escape(x):
        load = np.zeros_like(square.points)
        load[square.node(0.0, 1.0), 1], load[square.node(1.0, 1.0), 1] = x - 1.0, -x
        return find_unsolvable_load(
            on_foundation(joined([square.member(load=load.ravel())], [0.0], pairs, is_dense=is_dense))
        )

    assert escape(0.02) is None
    assert escape(0.98) is None
    assert "tips" in escape(-0.02).description
    assert "tips" in escape(1.02).description


def test_the_one_block_that_slips_out_is_named():
    body = wall(2, 2, 4, gravity=(0.0, -1.0))
    loads = [member.load for member in body.members]
    last = body.members[-1]
    upwards = last.motions[1] / len(loads[-1]) * 2
    loads[-1] = loads[-1] + 3.0 * upwards  # three times the weight of a half block
    lifted = find_unsolvable_load(on_foundation(body.under(loads, body.prescribed), 0.0))
    assert lifted is not None
    assert "'block 4'" in lifted.description


@pytest.mark.slow
def test_a_leaning_wall_stands_in_steps_up_to_its_limit():
    """On ground that slopes by q the wall slides at q = 0.6; a jump to 98 % of that stalls, four steps get there."""
    upright, sideways = (wall(5, 4, 4, gravity=gravity, is_dense=False) for gravity in ((0.0, -1e-4), (1e-4, 0.0)))

    def leaning(share):
        pairs = zip(upright.members, sideways.members, strict=True)
        return on_foundation(upright.under([a.load + 0.6 * share * b.load for a, b in pairs], upright.prescribed))

    falls = solve(leaning(1.02), Fallbacks(), throw=False)
    assert falls.status is Status.UNSOLVABLE_LOAD
    assert "bodies 'block 0'" in falls.message
    state = None
    for share in (0.5, 0.74, 0.86, 0.98):
        slip = None if state is None else state.u_t
        state = solve(replace(leaning(share), reference_slip=slip), Fallbacks(), start=state).state
    foot = np.diff(upright.owners[0::2].indptr) == 1
    assert upright.weights[foot] @ state.sigma_t[foot] == pytest.approx(-0.98 * 0.6e-4 * 40, rel=1e-9)


def growing_push(body, courses, per_course, push=1e-4, **options):
    """Work of a push on the rigid motions of a wall, as the difference of two loads."""
    pushed = wall(courses, per_course, 4, gravity=(0.0, -1e-3), push=push, **options)
    return pushed.rigid_load() - body.rigid_load()


def factor_of(problem, growing):
    """The largest factor of a load that grows, besides that of the problem."""
    body = problem.body
    friction = [(body.weights * cohesion, slope) for cohesion, slope in friction_envelopes(problem)]
    return largest_factor(as_rows(body.rigid_motions()), body.rigid_load(), growing, friction)


@pytest.mark.parametrize("is_dense", [True, False])
def test_the_largest_push_is_what_friction_holds(is_dense):
    """Friction 0.6 under a course of weight 6; a cohesion of 2e-4 on its length of 6 besides; a cap of 4e-4 instead."""
    body = wall(3, 3, 4, gravity=(0.0, -1e-3), is_dense=is_dense)
    growing = growing_push(body, 3, 3, is_dense=is_dense)
    assert factor_of(on_foundation(body), growing) == pytest.approx(36.0, rel=1e-6)
    given = ContactProblem(body, np.zeros(body.n_contact), Tresca(2e-4))
    assert factor_of(given, growing) == pytest.approx(12.0, rel=1e-6)
    assert factor_of(on_foundation(body), 0.0 * growing) == np.inf
    assert factor_of(on_foundation(body, 0.0), growing) == pytest.approx(0.0, abs=1e-6)


def test_no_factor_helps_where_the_constant_load_falls():
    body = wall(3, 3, 4, gravity=(1e-3, -1e-3), is_dense=False)  # slides at 0.6 of this slope
    weight = wall(3, 3, 4, gravity=(1e-3, -2e-3), is_dense=False).rigid_load() - body.rigid_load()
    pull = -weight
    assert factor_of(on_foundation(body), pull) == pytest.approx(1.0 - 1.0 / 0.6, rel=1e-6)
    assert factor_of(on_foundation(body), 0.0 * pull + growing_push(body, 3, 3, is_dense=False) * 0.0) == np.inf


@pytest.mark.slow
def test_a_wall_of_a_thousand_blocks_carries_its_weight_and_a_push():
    body = wall(20, 50, 8, gravity=(0.0, -1e-4), push=6e-4)
    found = solve(on_foundation(body), Fallbacks())
    foot = np.diff(body.owners[0::2].indptr) == 1
    assert body.weights[foot] @ found.state.sigma_n[foot] == pytest.approx(-1e-4 * 20 * 100, rel=1e-10)
    assert -(body.weights[foot] @ found.state.sigma_t[foot]) == pytest.approx(6e-4, rel=1e-8)
    assert found.certificate.worst <= 1e-10
    assert found.linear_solves <= 12  # tens at most: each takes seconds
