"""Bodies on as few contact nodes as they have free motions: their condensed stiffness is round-off."""

import numpy as np
import pytest

import bemkit as bk
from bemkit.contact.body import ContactState
from bemkit.contact.certificate import certify
from bemkit.contact.dense_body import DenseBody
from bemkit.contact.laws import Coulomb
from bemkit.contact.problem import ContactProblem
from bemkit.solvers.active_sets import NodeStatus, contact_sets
from bemkit.testing.independent_check import violations_of
from tests.slow import slow_except

FEET = {
    "one foot in a guide": "x > 0.97",
    "two feet": "x < 0.03 or x > 0.97",
    "three feet": "x < 0.03 or x > 0.97 or (x > 0.47 and x < 0.53)",
    "two wide feet": "x < 0.06 or x > 0.94",
}
ELEMENTS = [bk.ConstantCollocation(), bk.Galerkin(1), bk.Galerkin(2)]
DRIVERS = [bk.SemismoothNewton(), bk.AugmentedLagrangian(), bk.FixedPoint()]


def block(discretisation, solver, feet, friction_coefficient, gap, height):
    guide = (bk.Part("guide", bk.Roller(), sides=("right",)),) if feet == "one foot in a guide" else ()
    return bk.Scene(
        title="block on few nodes",
        shape=bk.Rectangle(1.0, height),
        material=bk.Material(1e4, 0.3),
        law=bk.Coulomb(friction_coefficient),
        mesh=bk.MeshOptions(40),
        discretisation=discretisation,
        solver=solver,
        parts=(
            bk.Part("feet", bk.Contact(bk.RigidHalfPlane(point=(0.0, -gap))), ("bottom",), bk.Expression(FEET[feet])),
            bk.Part("load", bk.Traction(y=-1.0), sides=("top",)),
            *guide,
        ),
    )


@pytest.mark.parametrize("solver", slow_except(DRIVERS, DRIVERS[1]), ids=lambda solver: type(solver).__name__)
@pytest.mark.parametrize("feet", slow_except(FEET, "two wide feet"))
def test_no_node_hovers_and_no_slipping_node_is_called_stick(feet, solver):
    for discretisation, *values in zip(ELEMENTS, (0.5, 0.1, 2.0), (1e-3, 0.0, 1.0), (1.0, 0.3, 0.3), strict=True):
        friction_coefficient, gap, height = values
        solution = bk.run(block(discretisation, solver, feet, friction_coefficient, gap, height))
        assert solution.is_converged
        assert violations_of(solution).is_good
        assert solution.force_normal == pytest.approx(1.0, rel=1e-9)  # the certificate asks for that much
        table = solution.contact
        carries = np.abs(table.sigma_n) > 1e-6
        assert carries.any()
        # the load moves a node by about 1e-4 and more
        assert np.abs(table.clearance[carries]).max() <= 1e-12
        sticks = table.status == NodeStatus.STICK
        assert np.abs(table.u_t[sticks]).max(initial=0.0) <= 1e-12
        slips = carries & ~sticks & (table.status != NodeStatus.SEPARATED)
        bound = friction_coefficient * np.abs(table.sigma_n[slips])
        assert np.abs(table.sigma_t[slips]) == pytest.approx(bound, rel=1e-6)


@pytest.mark.parametrize("left_over", [0.0, 1e-18, 1e-15, -1e-15, 1e-11])
def test_what_round_off_leaves_of_a_stiffness_is_no_scale(left_over):
    """One node in a guide, loaded by one newton and ten of its own deformations above the floor."""
    motions = np.eye(2).reshape(2, 1, 2)
    body = DenseBody(left_over * np.eye(2), np.array([1.0, 0.0]), np.array([0.01]), motions, modulus=1.0)
    problem = ContactProblem(body, np.array([10.0]), Coulomb(0.5))
    hovering = ContactState(np.zeros((1, 2)), np.array([[-100.0, 0.0]]))
    assert certify(problem, hovering).complementarity == 1.0
    assert contact_sets(problem, hovering).is_closed.tolist() == [False]  # rho is not round-off either
    resting = ContactState(np.array([[10.0, 0.0]]), np.array([[-100.0, 0.0]]))
    assert certify(problem, resting).is_below(1e-9)


def test_lengths_are_those_of_forces_however_small_an_element_is():
    """A tiny node of a large traction excuses no distance of the node that carries the load."""
    weights = np.array([1e-9, 1.0])
    body = DenseBody(np.eye(4), np.zeros(4), weights, modulus=1.0)
    traction = np.array([[-1e9, 0.0], [-1.0, 0.0]])  # one newton each
    state = ContactState(np.zeros((2, 2)), traction)
    problem = ContactProblem(body, np.array([0.0, 1.0]), Coulomb(0.5))
    # both bear half of it, and the one that hovers does so by its whole deformation
    assert certify(problem, state).complementarity == 1.0
    assert certify(problem, ContactState(np.zeros((2, 2)), -traction)).tension == pytest.approx(1.0)
