"""`check_body` passes what keeps its promises, and names each promise that is broken."""

from dataclasses import replace

import numpy as np
import pytest

import bemkit as bk
from bemkit.contact.body import ContactState, LinearBody
from bemkit.contact.dense_body import DenseBody
from bemkit.contact.equilibrium import Imbalance
from bemkit.contact.problem import ContactProblem
from bemkit.model.model import build_model
from bemkit.model.prepared import prepare
from bemkit.testing import CheckFailed, check_body
from tests.contact.test_following_tangents import SCENES
from tests.handmade import Inexact, block_body, random_body
from tests.slow import slow_except

HELD = random_body(np.random.default_rng(1), 6)
LOOSE = block_body(n=6, is_held_sideways=False)


@pytest.mark.parametrize("body", [HELD, LOOSE, block_body(n=6), Inexact(LOOSE, 1e-11, accuracy=1e-10)])
def test_bodies_given_by_a_stiffness(body):
    check_body(body, is_symmetric=not isinstance(body, Inexact))


def test_a_body_with_another_load():
    check_body(HELD, is_symmetric=True, reloaded=replace(HELD, load=np.zeros(12)))
    with pytest.raises(CheckFailed, match="answers changes of the conditions otherwise under another load"):
        check_body(HELD, reloaded=replace(HELD, stiffness=1.1 * HELD.stiffness))


@pytest.mark.parametrize("name", ["held block", "disc in a cavity", "oblique roller", "moved wall"])
@pytest.mark.parametrize(
    "discretisation",
    slow_except([bk.Galerkin(1), bk.ConstantCollocation()], bk.Galerkin(1)),
    ids=["linear", "constant"],
)
def test_bodies_of_scenes(name, discretisation):
    scene = replace(SCENES[name](), discretisation=discretisation)
    model = build_model(prepare(scene, scene.build_mesh()))
    nodes, (elastic,) = model.body.conditions.displacement, model.elastic
    reloaded = model.body.under(np.ones((elastic.displacement_space.n_dofs // 2, 2)), 0.5 * nodes)
    check_body(model.body, is_symmetric=isinstance(discretisation, bk.Galerkin), reloaded=reloaded)


class Broken(Inexact):
    """A body with one promise broken; the class attributes or methods of its subclasses say which."""

    def __init__(self, body=LOOSE):
        super().__init__(body)


class Weightless(Broken):
    weights = property(lambda self: 0.0 * self.body.weights, lambda self, value: None)


class Shapeless(Broken):
    def rigid_load(self):
        return np.zeros(7)


class Stiffless(Broken):
    stiffness_scale = 0.0


class Careless(Broken):
    def __init__(self):
        super().__init__()
        self.accuracy = 0.5


class Restless(Broken):
    def respond(self, conditions):
        state = super().respond(conditions)
        return ContactState(state.displacement, (1.0 + 1e-9 * self.n_responses) * state.traction)


class Infinite(Broken):
    def respond(self, conditions):
        state = super().respond(conditions)
        return ContactState(state.displacement, np.inf * state.traction) if conditions.on_traction.any() else state


class Deaf(Broken):
    def respond(self, conditions):
        return super().respond(replace(conditions, value=1.001 * conditions.value))


class Bent(Broken):
    def respond(self, conditions):
        state = super().respond(conditions)
        return ContactState(state.displacement, state.traction + 1e-3 * state.displacement**2)


class Unmoved(Broken):
    def rigid_motions(self):
        return np.zeros((0, self.n_contact, 2))

    def rigid_load(self):
        return np.zeros(0)


class Loaded(Broken):
    def rigid_load(self):
        return 1.1 * self.body.rigid_load()


class Doubled(Broken):
    def rigid_motions(self):
        return self.body.rigid_motions()[[0, 1, 2, 2]]

    def rigid_load(self):
        return self.body.rigid_load()[[0, 1, 2, 2]]


class Strained(Broken):
    def rigid_motions(self):
        return self.body.rigid_motions() ** 3


class Contented(Broken):
    def imbalance(self, state):
        return Imbalance(0.0, 0.0)


class Discontented(Broken):
    def imbalance(self, state):
        return Imbalance(1e-3, 0.0)


class Invented(Broken):
    def __init__(self):
        super().__init__(HELD)

    def rigid_motions(self):
        return np.ones((1, self.n_contact, 2))

    def rigid_load(self):
        return np.zeros(1)


@pytest.mark.parametrize(
    ("broken", "complaint"),
    [
        (Weightless, "weights is not an array of positive numbers"),
        (Shapeless, r"rigid_load has the shape \(7,\); give \(3,\)"),
        (Stiffless, "stiffness_scale is 0.0; it is positive"),
        (Careless, "accuracy is 0.5; it lies between"),
        (Restless, "gives two answers to one question"),
        (Infinite, "returns numbers that are not finite"),
        (Deaf, "misses the conditions it was given by"),
        (Unmoved, "has no rigid motions, but does not respond without contact"),
        (Invented, "has rigid motions, but responds without contact"),
        (Loaded, "rigid_load and the tractions of a held body do the work"),
        (Doubled, "rigid_motions are linearly dependent"),
        (Strained, "changes its tractions when it moves rigidly"),
        (Contented, "imbalance does not see tractions"),
        (Discontented, "imbalance of a response of its own is 1.0e-03"),
    ],
)
def test_broken_promises_are_named(broken, complaint):
    with pytest.raises(CheckFailed, match=f"{broken.__name__}.*{complaint}"):
        check_body(broken())


def test_a_body_that_is_not_linear():
    bent = Bent(HELD)
    with pytest.raises(CheckFailed, match=r"Bent (is not linear|misses the conditions)"):
        check_body(bent)


def test_symmetry_is_demanded_on_request():
    turned = np.eye(12)
    turned[0, 1], turned[1, 0] = 0.4, -0.4
    body = DenseBody(HELD.stiffness @ turned, HELD.load, HELD.weights)
    check_body(body)
    with pytest.raises(CheckFailed, match="DenseBody is not symmetric: the works of two states differ"):
        check_body(body, is_symmetric=True)


def test_a_body_that_lacks_what_drivers_ask_for():
    class Half:
        weights = np.ones(2)

        def respond(self, conditions):
            raise NotImplementedError

    with pytest.raises(ValueError, match=r"body Half has no n_contact, stiffness_scale, .*derive it from .*LinearBody"):
        ContactProblem(Half(), np.zeros(2), bk.Coulomb(0.1))


def test_a_tangent_that_follows_takes_no_displacement():
    class Lenient(Inexact):
        @property
        def tangent_follows(self):
            return np.arange(self.n_contact) == 0

    assert LinearBody.tangent_follows.fget(HELD).sum() == 0
    with pytest.raises(CheckFailed, match="takes a tangential condition where its tangent follows"):
        check_body(Lenient(HELD))
