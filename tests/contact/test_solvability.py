import tracemalloc
from dataclasses import replace

import numpy as np
import pytest

from bemkit.contact.body import ContactState, LinearBody
from bemkit.contact.dense_body import DenseBody
from bemkit.contact.further_laws import CohesiveCoulomb
from bemkit.contact.laws import Coulomb, Frictionless, Tresca
from bemkit.contact.problem import ContactProblem
from bemkit.contact.solvability import find_unsolvable_load, needs_contact
from bemkit.solvers.newton import contact_free_response
from tests.handmade import block_problem


def test_a_held_body_bears_any_load():
    assert (
        find_unsolvable_load(
            ContactProblem(DenseBody(np.eye(2), np.full(2, -5.0), np.ones(1)), np.zeros(1), Coulomb(0))
        )
        is None
    )


def test_pushed_away():
    escape = find_unsolvable_load(block_problem(Coulomb(0.5), press=-1.0))
    assert escape.description.startswith("the load pushes the body away from the obstacle (work 0.5 ")
    assert np.allclose(escape.motion, [-1.0, 0.0], atol=1e-12)
    assert escape.work == pytest.approx(0.5)


# The block is pressed by 0.5 at x = 3/4 and pushed by push/2 at y = 3/4: it tips about its right corner from
# push = 1/3 on.
@pytest.mark.parametrize(
    ("law", "push", "word"),
    [
        (Coulomb(0.5), 0.3, None),
        (Coulomb(0.5), 0.34, "tips"),
        (Coulomb(0.2), 0.21, "slides"),
        (Coulomb(0.2), 0.19, None),
        (Frictionless(), 0.01, "slides"),
        (Frictionless(), 0.0, None),
        (Tresca(0.1), 0.19, None),
        (Tresca(0.1), 0.21, "slides"),
        (CohesiveCoulomb(0.1, 0.05), 0.19, None),
        (CohesiveCoulomb(0.1, 0.05), 0.21, "slides"),
        (CohesiveCoulomb(0.5, 0.0, 0.1), 0.19, None),
        (CohesiveCoulomb(0.5, 0.0, 0.1), 0.21, "slides"),
    ],
    ids=repr,
)
def test_a_free_block(law, push, word):
    escape = find_unsolvable_load(block_problem(law, is_held_sideways=False, push=push))
    assert (escape is None) == (word is None)
    if escape is not None:
        assert f"the load {word} the body" in escape.description
        assert escape.work > 0.0


def test_the_edge_of_sliding_is_left_to_the_driver():
    assert find_unsolvable_load(block_problem(Coulomb(0.2), is_held_sideways=False, push=0.2)) is None


def test_an_obstacle_that_is_nowhere():
    problem = block_problem(Coulomb(0.5))
    nowhere = replace(problem, gap=np.full(problem.n_contact, np.inf))
    assert "moves the body where no obstacle stops it" in find_unsolvable_load(nowhere).description


def test_no_load_is_no_trouble():
    problem = block_problem(Coulomb(0.5), press=0.0, push=0.0)
    assert find_unsolvable_load(problem) is None


@pytest.mark.parametrize(
    ("press", "push", "travel"), [(1.0, 0.0, 0.0), (0.0, 1e-2, 0.0), (0.0, 0.0, 0.0), (0.0, 0.0, 3.0)]
)
def test_where_a_load_plainly_needs_contact_no_response_without_it_balances(press, push, travel):
    problem = block_problem(Coulomb(0.5), is_held_sideways=False, press=press, push=push)
    problem = replace(problem, gap=problem.gap - travel)  # carried by the obstacle, which leaves round-off of forces
    assert needs_contact(problem) == bool(press or push)
    assert (contact_free_response(problem.body) is None) == bool(press or push)


def test_a_held_body_needs_no_contact():
    body = DenseBody(np.eye(2), np.full(2, -5.0), np.ones(1))
    assert not needs_contact(ContactProblem(body, np.zeros(1), Coulomb(0)))


def memory_of_the_programme(n_contact):
    """Return what the search for an unsolvable load allocates at most, in bytes, for a body on many nodes."""
    x = np.linspace(-1.0, 1.0, n_contact)
    zero, one = np.zeros(n_contact), np.ones(n_contact)
    motions = np.stack([np.stack(pair, axis=1) for pair in ((one, zero), (zero, one), (x, zero))])
    body = Sliding(np.full(n_contact, 1.0 / n_contact), motions, np.array([1.0, 0.1, 0.0]))
    problem = ContactProblem(body, zero, Coulomb(0.2))
    assert find_unsolvable_load(problem) is None  # loads the modules, and the friction is enough
    slippery = ContactProblem(body, zero, Coulomb(0.05))
    tracemalloc.start()
    escape = find_unsolvable_load(slippery)
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert escape.is_sliding
    return peak


class Sliding(LinearBody):
    """A loaded rigid body."""

    stiffness_scale = 1.0

    def __init__(self, weights, motions, load):
        self.weights, self.motions, self.load = weights, motions, load

    def respond(self, conditions):
        traction = np.broadcast_to([-1.0, -0.1], (self.n_contact, 2))
        return ContactState(np.zeros((self.n_contact, 2)), traction)

    def rigid_motions(self):
        return self.motions

    def rigid_load(self):
        return self.load


@pytest.mark.slow
def test_the_linear_programme_takes_memory_in_proportion_to_the_nodes():
    few, many = memory_of_the_programme(400), memory_of_the_programme(1600)
    assert many < 6.0 * few  # four times the nodes; dense blocks would take sixteen times
    assert many < 1600 * 4096  # bytes a node: about a hundred numbers for each of thirty arrays
