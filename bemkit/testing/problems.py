"""Small contact problems with known answers, without boundary elements."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np

from bemkit.arrays import FloatArray
from bemkit.contact.laws import Coulomb, Frictionless, Tresca
from bemkit.contact.problem import ContactProblem, DenseBody


@dataclass(frozen=True, eq=False)
class KnownProblem:
    """A contact problem and all its solutions.

    Parameters
    ----------
    problem : ContactProblem
    solutions : tuple of (n_contact, 2, 2) arrays
        Of each solution the displacements [m] and the tractions [Pa]: axes (node, which of the two, component).
        Empty if there is none.
    """

    problem: ContactProblem
    solutions: tuple[FloatArray, ...]


def _one_node(stiffness: FloatArray, load: FloatArray, friction: float, gap: float = 0.0) -> ContactProblem:
    body = DenseBody(np.asarray(stiffness, dtype=float), np.asarray(load, dtype=float), np.ones(1))
    return ContactProblem(body, np.array([gap]), Coulomb(friction))


def _states(*pairs: tuple[tuple[float, float], tuple[float, float]]) -> tuple[FloatArray, ...]:
    """Return one-node states from pairs of displacement (n, t) and traction (n, t)."""
    return tuple(np.array([pair]) for pair in pairs)


def three_solutions() -> KnownProblem:
    """Return one node with coupled stiffness and s = 3: it may stick, slip or open."""
    problem = _one_node(np.array([[1.0, 0.5], [0.5, 1.0]]), np.array([1.0, 2.5]), 3.0)
    states = _states(((0.0, 0.0), (-1.0, -2.5)), ((0.0, 1.0), (-0.5, -1.5)), ((-1.0 / 3.0, 8.0 / 3.0), (0.0, 0.0)))
    return KnownProblem(problem, states)


def nothing_to_do() -> KnownProblem:
    """Return three nodes without load or gap, which stay where they are."""
    body = DenseBody(np.eye(6) + 0.1, np.zeros(6), np.ones(3))
    return KnownProblem(ContactProblem(body, np.zeros(3), Coulomb(0.5)), (np.zeros((3, 2, 2)),))


def overlap() -> KnownProblem:
    """Return one node that is pressed back from an obstacle inside the body, without any load."""
    return KnownProblem(_one_node(np.eye(2), np.zeros(2), 0.5, gap=-0.3), _states(((-0.3, 0.0), (-0.3, 0.0))))


def out_of_reach() -> KnownProblem:
    """Return one node that is pulled away and pushed sideways, and carries nothing."""
    return KnownProblem(_one_node(np.eye(2), np.array([-1.0, 0.4]), 0.5), _states(((-1.0, 0.4), (0.0, 0.0))))


def tie() -> KnownProblem:
    """Return one node that is pulled by exactly as much as friction can hold."""
    return KnownProblem(_one_node(np.eye(2), np.array([2.0, 1.0]), 0.5), _states(((0.0, 0.0), (-2.0, -1.0))))


def slide_backward() -> KnownProblem:
    """Return one node that slips against the tangent."""
    return KnownProblem(_one_node(np.eye(2), np.array([2.0, -3.0]), 0.5), _states(((0.0, -2.0), (-2.0, 1.0))))


def incremental() -> KnownProblem:
    """Return the same node with its slip counted from -2.5: it stays there, pushed back, below the bound."""
    problem = _one_node(np.eye(2), np.array([2.0, -3.0]), 0.5)
    moved = ContactProblem(problem.body, problem.gap, problem.law, np.array([-2.5]))
    return KnownProblem(moved, _states(((0.0, -2.5), (-2.0, 0.5))))


def smooth_floor() -> KnownProblem:
    """Return two nodes without friction, one pressed and one lifted."""
    body = DenseBody(np.diag([2.0, 1.0, 2.0, 1.0]), np.array([3.0, 0.2, -1.0, 0.1]), np.array([0.5, 0.5]))
    state = np.array([[[0.0, 0.2], [-6.0, 0.0]], [[-0.5, 0.1], [0.0, 0.0]]])
    return KnownProblem(ContactProblem(body, np.zeros(2), Frictionless()), (state,))


def given_friction() -> KnownProblem:
    """Return Tresca's law, which acts on an open node too."""
    body = DenseBody(np.eye(4), np.array([-1.0, 0.2, -1.0, 2.0]), np.ones(2))
    state = np.array([[[-1.0, 0.0], [0.0, -0.2]], [[-1.0, 1.5], [0.0, -0.5]]])
    return KnownProblem(ContactProblem(body, np.zeros(2), Tresca(0.5)), (state,))


def _floating_problem(direction: float) -> ContactProblem:
    spring = np.array([[1.0, -1.0], [-1.0, 1.0]])
    stiffness = np.zeros((4, 4))
    stiffness[0::2, 0::2], stiffness[1::2, 1::2] = spring, np.eye(2)
    load = direction * np.array([1.0, 0.1, 2.0, 0.1])
    body = DenseBody(stiffness, load, np.ones(2), np.array([[[1.0, 0.0], [1.0, 0.0]]]))
    return ContactProblem(body, np.zeros(2), Coulomb(0.3))


def floating() -> KnownProblem:
    """Return two nodes of a body that only contact holds against vertical motion."""
    state = np.array([[[0.0, 0.0], [-1.0, -0.1]], [[0.0, 0.0], [-2.0, -0.1]]])
    return KnownProblem(_floating_problem(1.0), (state,))


def lifted() -> KnownProblem:
    """Return the same body pulled off: there is no solution, and a driver must not find one."""
    return KnownProblem(_floating_problem(-1.0), ())


KNOWN_PROBLEMS: Mapping[str, Callable[[], KnownProblem]] = MappingProxyType(
    {
        make.__name__.replace("_", " "): make
        for make in (
            *(three_solutions, nothing_to_do, overlap, out_of_reach, tie, slide_backward, incremental),
            *(smooth_floor, given_friction, floating, lifted),
        )
    }
)
"""By name; each call makes a new problem."""
