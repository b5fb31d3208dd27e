"""Contact without pressure: what cohesion alone holds is closed, and sticks or slips."""

import numpy as np
import pytest

import bemkit as bk
from bemkit.contact.body import ContactState
from bemkit.contact.dense_body import DenseBody
from bemkit.contact.further_laws import CohesiveCoulomb
from bemkit.contact.laws import Coulomb, Tresca
from bemkit.contact.problem import ContactProblem
from bemkit.solvers.active_sets import NodeStatus, contact_sets
from bemkit.solvers.base import solve
from bemkit.solvers.ssn import SemismoothNewton
from tests.scenes import FLOOR, block

COHESION = 0.1
STATES = {
    NodeStatus.STICK: ((0.0, 0.0), (0.0, 0.05)),
    NodeStatus.SLIP_FORWARD: ((0.0, 0.2), (0.0, -COHESION)),
    NodeStatus.SLIP_BACKWARD: ((0.0, -0.2), (0.0, COHESION)),
    NodeStatus.SEPARATED: ((-0.3, 0.2), (0.0, 0.0)),
}


def problem_of(state: ContactState, law: bk.FrictionLaw) -> ContactProblem:
    """Give nodes of unit stiffness on a floor the load under which they are in this state."""
    load = (state.displacement - state.traction).ravel()
    return ContactProblem(DenseBody(np.eye(load.size), load, np.ones(load.size // 2)), np.zeros(load.size // 2), law)


@pytest.mark.parametrize("friction_coefficient", [0.0, 0.3, 10.0])
@pytest.mark.parametrize("pull", [0.0, 1e-16])
def test_the_status_says_what_cohesion_does(friction_coefficient: float, pull: float) -> None:
    displacement, traction = (np.array(rows) for rows in zip(*STATES.values(), strict=True))
    traction[:3, 0] = pull  # round-off of no pressure
    state = ContactState(displacement, traction)
    problem = problem_of(state, CohesiveCoulomb(friction_coefficient, COHESION))
    solution = solve(problem, SemismoothNewton(), start=state)
    assert solution.node_status.tolist() == list(STATES)
    np.testing.assert_allclose(solution.state.displacement, displacement, atol=1e-15)
    assert (solution.history[-1].n_separated, solution.history[-1].n_stick, solution.history[-1].n_slip) == (1, 1, 2)


@pytest.mark.parametrize("law", [Coulomb(0.5), Tresca(COHESION)], ids=["coulomb", "tresca"])
def test_other_friction_does_not_close_a_node(law: bk.FrictionLaw) -> None:
    """Friction that a law gives across a gap shows no contact, and what is left without pressure is round-off."""
    shear = COHESION if law.acts_across_gap else 1e-17
    state = ContactState(np.array([[0.0, 0.2]]), np.array([[0.0, -shear]]))
    assert contact_sets(problem_of(state, law), state).node_status.tolist() == [NodeStatus.SEPARATED]


def test_a_sheared_block_that_cohesion_holds_sticks_everywhere() -> None:
    """Simple shear has no pressure on any side; round-off of either sign must not tell the nodes apart."""
    shear = 1e-3
    sides = {"top": (shear, 0.0), "right": (0.0, shear), "left": (0.0, -shear)}
    loads = (bk.Part(name, bk.Traction(*load), sides=(name,)) for name, load in sides.items())
    solution = bk.run(block(FLOOR, *loads, law=CohesiveCoulomb(0.3, 2.0 * shear)))
    assert solution.contact.status_words() == ["stick"] * solution.contact.n_contact
    assert solution.transitions == ()
    np.testing.assert_allclose(solution.contact.sigma_t, -shear, rtol=1e-9)
