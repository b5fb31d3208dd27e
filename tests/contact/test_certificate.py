from dataclasses import replace

import numpy as np
import pytest

from bemkit.contact.body import ContactState
from bemkit.contact.certificate import Certificate, certify
from bemkit.contact.dense_body import DenseBody
from bemkit.contact.further_laws import CohesiveCoulomb
from bemkit.contact.laws import Coulomb, Tresca
from bemkit.contact.problem import ContactProblem
from bemkit.solvers.base import solve
from bemkit.solvers.ssn import SemismoothNewton
from tests.handmade import block_body, block_problem

SOLVED = block_problem(Coulomb(0.5))
SOLUTION = solve(SOLVED, SemismoothNewton())


def spoiled(displacement=None, traction=None):
    """The solution with something added at one node each: node 0 is open, 4 slips backward, -1 sticks."""
    u, t = SOLUTION.state.displacement.copy(), SOLUTION.state.traction.copy()
    for node, component, amount in displacement or ():
        u[node, component] += amount
    for node, component, amount in traction or ():
        t[node, component] += amount
    return certify(SOLVED, ContactState(u, t)).as_dict()


def test_a_solution_is_certified():
    assert SOLUTION.certificate.worst < 1e-12
    assert SOLUTION.certificate.is_below(1e-12)
    assert SOLUTION.certificate.worst > 0.0  # what round-off leaves is shown, not subtracted
    assert SOLUTION.node_status[[0, 4, -1]].tolist() == [0, 3, 1]


# Stiffness and load of the block are of order one, so an error of 1e-3 must show as about 1e-3.
@pytest.mark.parametrize(
    ("entry", "displacement", "traction"),
    [
        ("penetration", [(-1, 0, 1e-3)], None),
        ("tension", None, [(0, 0, 1e-3)]),
        ("complementarity", None, [(0, 0, -1e-3)]),
        ("complementarity", [(-1, 0, -1e-3)], None),
        ("complementarity", None, [(0, 1, 1e-3)]),
        ("cone_excess", None, [(4, 1, 1e-3)]),
        ("slip_opposition", None, [(4, 1, -1e-3)]),
        ("slip_opposition", [(-1, 1, 1e-3)], None),
        ("slip_opposition", None, [(4, 0, -1e-3)]),
        ("cone_excess", None, [(4, 0, 1e-3)]),
        ("force_imbalance", None, [(-1, 0, -1e-3)]),
        ("force_imbalance", [(-1, 0, -1e-3)], None),
        ("moment_imbalance", None, [(-1, 0, -1e-3)]),
    ],
)
def test_each_entry_sees_its_violation(entry, displacement, traction):
    assert 1e-5 < spoiled(displacement, traction)[entry] < 1e-2


def test_the_bound_is_taken_at_the_present_pressure():
    """A frozen cone would certify this: tractions on the cone of a pressure that is not there any more."""
    u, t = SOLUTION.state.displacement, SOLUTION.state.traction.copy()
    t[:, 0] *= 0.5
    assert certify(SOLVED, ContactState(u, t)).cone_excess > 0.05


def test_nan_is_never_certified():
    state = ContactState(np.full_like(SOLUTION.state.displacement, np.nan), SOLUTION.state.traction)
    assert np.isnan(certify(SOLVED, state).worst)
    assert not certify(SOLVED, state).is_below(1e300)


def test_as_dict_and_worst():
    certificate = Certificate(1.0, 2.0, 3.0, 4.0, 7.0, 5.0, 6.0)
    assert certificate.worst == 7.0
    assert certificate.is_below(7.0)
    assert not certificate.is_below(6.9)
    assert list(certificate.as_dict()) == [
        "penetration",
        "tension",
        "complementarity",
        "cone_excess",
        "slip_opposition",
        "force_imbalance",
        "moment_imbalance",
        "round_off",
    ]


def test_round_off_excuses_imbalances_alone_and_is_no_violation():
    entries = [0.0] * 7
    for k in range(7):
        entries[k] = 1e-7
        certificate = Certificate(*entries, round_off=2e-7)
        assert certificate.worst == 1e-7
        assert certificate.is_below(1e-9) == (
            list(certificate.violations)[k] in ("force_imbalance", "moment_imbalance")
        )
        assert not replace(certificate, round_off=0.0).is_below(1e-9)
        entries[k] = 0.0
    assert Certificate(*entries, round_off=1e-7).worst == 0.0


@pytest.mark.parametrize("length", [1e-12, 1.0, 1e12])
@pytest.mark.parametrize("stress", [1e-12, 1.0, 1e12])
def test_units_do_not_matter(length, stress):
    body = SOLVED.body
    scaled = DenseBody(body.stiffness * stress / length, body.load * stress, body.weights, body.motions)
    problem = ContactProblem(scaled, SOLVED.gap * length, SOLVED.law)
    u, t = SOLUTION.state.displacement.copy(), SOLUTION.state.traction.copy()
    u[0] += 1e-3
    t[4] += 1e-3
    expected = certify(SOLVED, ContactState(u, t)).as_dict()
    assert certify(problem, ContactState(u * length, t * stress)).as_dict() == pytest.approx(expected, rel=1e-9)


@pytest.mark.parametrize("law", [Coulomb(0.3), Tresca(0.3)], ids=["coulomb", "tresca"])
def test_nothing_loaded_nothing_moved_is_perfect(law):
    body = DenseBody(np.eye(4), np.zeros(4), np.ones(2))
    rest = ContactState(np.zeros((2, 2)), np.zeros((2, 2)))
    for gap in (np.zeros(2), np.ones(2), np.full(2, np.inf)):
        assert certify(ContactProblem(body, gap, law), rest).worst == 0.0


def test_open_nodes_carry_shear_only_under_friction_given_across_the_gap():
    body = DenseBody(np.eye(2), np.array([-1.0, 0.4]), np.ones(1))
    u = np.array([[-1.0, 0.1]])
    state = ContactState(u, np.array([[0.0, -0.3]]))  # open by one, slips, resisted by 0.3
    given = ContactProblem(body, np.zeros(1), Tresca(0.3))
    assert certify(given, state).worst < 1e-15
    for law in (Coulomb(0.3), CohesiveCoulomb(0.0, 0.3)):
        assert certify(replace(given, law=law), state).worst > 0.1
    free = ContactState(np.array([[-1.0, 0.4]]), np.zeros((1, 2)))
    assert certify(replace(given, law=CohesiveCoulomb(0.0, 0.3)), free).worst < 1e-15
    assert certify(given, free).slip_opposition > 0.1


def test_what_is_left_of_tractions_is_measured_by_itself_not_by_those_that_would_hold_the_body():
    """A loose body lifted out of an overlap of one: 1e-9 of the tractions of the sticking state are not round-off."""
    body = block_body(press=0.0, push=0.0, is_held_sideways=False)
    problem = ContactProblem(body, np.full(body.n_contact, -1.0), Coulomb(0.5))
    lifted = -body.motions[0]
    sticking = np.abs(problem.sticking_state.traction).max()
    clean = ContactState(lifted, np.zeros_like(lifted))
    assert certify(problem, clean).worst < 1e-12
    left = clean.traction.copy()
    left[4, 0] = 1e-9 * sticking
    assert certify(problem, ContactState(lifted, left)).tension == pytest.approx(1e-2)
    left[4, 0] = 1e-14 * sticking  # the round-off of sums of terms as large as the tractions of the sticking state
    assert certify(problem, ContactState(lifted, left)).tension == pytest.approx(1e-14)


def test_lengths_without_tractions_are_measured_by_a_thousandth_of_the_displacement():
    body = block_body(press=0.0, push=0.0, is_held_sideways=False)
    for size in (1e-9, 1.0, 1e9):
        problem = ContactProblem(body, np.full(body.n_contact, -size), Coulomb(0.5))
        lifted = -(1.0 - 1e-6) * size * body.motions[0]
        certificate = certify(problem, ContactState(lifted, np.zeros_like(lifted)))
        assert certificate.penetration == pytest.approx(1e-3, rel=1e-5)


def test_pressures_that_move_nothing_do_not_hide_distances():
    """A stiffness of 1e12 on the only node, as of a closed volume, while the modulus of the material is one."""
    body = DenseBody(1e12 * np.eye(2), np.zeros(2), np.ones(1), modulus=1.0)
    problem = ContactProblem(body, np.array([-1e-2]), Coulomb(0.0))
    state = ContactState(np.array([[-2e-2, 0.0]]), np.array([[-2e10, 0.0]]))
    certificate = certify(problem, state)  # pressed at a distance of 0.01 from the obstacle
    assert certificate.force_imbalance == 0.0
    assert certificate.complementarity > 1e-8  # 5e-13 if compared with the force


def test_friction_without_pressure_is_not_excused_by_the_tractions_that_would_hold_the_body():
    body = block_body(press=0.0, push=0.0, is_held_sideways=False)
    problem = ContactProblem(body, np.full(body.n_contact, -1.0), Tresca(0.0))
    sticking = np.abs(problem.sticking_state.traction).max()
    slid = -2.0 * body.motions[0] + body.motions[1]
    state = ContactState(slid, np.zeros_like(slid))
    assert certify(problem, state).worst < 1e-12
    resisted = problem.with_law(Tresca(1e-10 * sticking))
    assert certify(resisted, state).slip_opposition == pytest.approx(1e-2)


def test_tractions_are_not_excused_by_the_friction_that_cohesion_would_allow():
    """Two nodes that carry a millionth of their cohesion, under a load that would hold the body by far more."""
    body = DenseBody(np.eye(4), np.array([-1e3, 1e3, -1e3, -1e3]), np.ones(2))
    state = ContactState(np.array([[0.0, 1e-6], [0.0, -1e-6]]), np.array([[-1e-3, 1e-3], [-1e-3, -1e-3]]))
    known = certify(ContactProblem(body, np.zeros(2), Coulomb(1e3)), state).slip_opposition
    assert known == pytest.approx(1e-5)  # the slip of 1e-6 beside a hundred times the tractions
    for cohesion in (1e-9, 1.0, 1e3):
        cohesive = ContactProblem(body, np.zeros(2), CohesiveCoulomb(1e3, cohesion))
        assert certify(cohesive, state).slip_opposition == pytest.approx(known)
