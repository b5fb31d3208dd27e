"""Critical friction of systems small enough to be solved by hand."""

from __future__ import annotations

import numpy as np
import pytest

from bemkit.contact.body import SingularResponse
from bemkit.contact.critical_friction import critical_coefficient, sliding_response
from bemkit.contact.dense_body import DenseBody
from bemkit.contact.laws import Coulomb
from bemkit.contact.problem import ContactProblem
from bemkit.solvers.multistart import probe
from bemkit.solvers.ssn import SemismoothNewton

FORWARD, BACKWARD = np.ones(1), -np.ones(1)
CLOSED = np.ones(1, bool)


def node(coupling: float) -> DenseBody:
    """One node: a unit stiffness along both axes, a coupling, and a push onto the obstacle and along it."""
    return DenseBody(np.array([[1.0, coupling], [coupling, 1.0]]), np.array([1.0, 2.5]), np.ones(1), modulus=1.0)


@pytest.mark.parametrize("coupling", [-0.5, 0.25])
def test_one_node_loses_uniqueness_at_the_ratio_of_its_stiffnesses(coupling: float) -> None:
    """Klarbring's model: s = K_tt / |K_nt|, in the direction that presses the node onto the obstacle."""
    normal, tangential = sliding_response(node(coupling), CLOSED, CLOSED)
    found = critical_coefficient(normal, tangential, FORWARD), critical_coefficient(normal, tangential, BACKWARD)
    assert found == ((np.inf, 2.0) if coupling < 0.0 else (4.0, np.inf))


def test_one_node_has_several_solutions_above_and_one_below() -> None:
    for friction, expected in ((1.9, 1), (3.0, 3)):
        found = probe(ContactProblem(node(0.5), np.zeros(1), Coulomb(friction)), SemismoothNewton())
        assert len(found) == expected


def test_nodes_of_their_own_lose_uniqueness_one_by_one() -> None:
    """Two nodes that do not feel each other, at 2 backwards and at 4 forwards; open and sticking ones play no part."""
    stiffness = np.zeros((6, 6))
    for k, coupling in enumerate((-0.5, 0.25, -2.0)):
        stiffness[2 * k : 2 * k + 2, 2 * k : 2 * k + 2] = [[8.0, coupling], [coupling, 1.0]]
    body = DenseBody(stiffness, np.zeros(6), np.array([1.0, 0.5, 2.0]), modulus=1.0)
    is_closed = np.array([True, True, False])
    normal, tangential = sliding_response(body, is_closed, is_closed)
    assert critical_coefficient(normal, tangential, np.array([1.0, 1.0])) == pytest.approx(4.0, rel=1e-14)
    assert critical_coefficient(normal, tangential, np.array([-1.0, -1.0])) == pytest.approx(2.0, rel=1e-14)
    assert critical_coefficient(normal, tangential, np.array([1.0, -1.0])) == np.inf
    one = np.ix_([1], [1])
    assert critical_coefficient(normal[one], tangential[one], FORWARD) == pytest.approx(4.0, rel=1e-14)
    assert critical_coefficient(np.zeros((0, 0)), np.zeros((0, 0)), np.zeros(0)) == np.inf


def test_beyond_any_friction_there_is_none() -> None:
    assert critical_coefficient(np.full((1, 1), 1.1e-3), np.eye(1), FORWARD) == pytest.approx(1.0 / 1.1e-3)
    assert critical_coefficient(np.full((1, 1), 0.9e-3), np.eye(1), FORWARD) == np.inf


def test_complex_eigenvalues_are_no_critical_friction() -> None:
    turning = np.array([[0.0, 1.0], [-1.0, 0.0]])
    assert critical_coefficient(np.eye(2) + turning, np.eye(2), np.ones(2)) == np.inf
    # a small part of them is real: round-off of two equal ones
    assert critical_coefficient(np.eye(2) + 1e-11 * turning, np.eye(2), np.ones(2)) == pytest.approx(1.0, rel=1e-9)


def test_open_nodes_give_way() -> None:
    """A node that is open takes its share of the stiffness away along both axes: K_tt - sum of K_to^2 / K_oo."""
    stiffness = np.diag([1.0, 1.25, 1.0, 2.0])
    stiffness[0, 1] = stiffness[1, 0] = -0.5
    stiffness[1, 3] = stiffness[3, 1] = 1.0
    stiffness[1, 2] = stiffness[2, 1] = 0.5
    body = DenseBody(stiffness, np.zeros(4), np.ones(2), modulus=1.0)
    is_closed = np.array([True, False])
    normal, tangential = sliding_response(body, is_closed, is_closed)
    assert critical_coefficient(normal, tangential, BACKWARD) == pytest.approx(0.5 / 0.5, rel=1e-14)


def test_a_body_that_is_free_to_slide_has_none() -> None:
    stiffness = np.diag([1.0, 0.0])
    body = DenseBody(stiffness, np.zeros(2), np.ones(1), np.array([[[0.0, 1.0]]]), modulus=1.0)
    with pytest.raises(SingularResponse, match="only friction keeps the body from sliding"):
        sliding_response(body, CLOSED, CLOSED)
