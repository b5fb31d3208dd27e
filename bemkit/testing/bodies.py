"""Conformance of elastic bodies."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass

import numpy as np

from bemkit.contact.body import ContactState, LinearBody, SingularResponse
from bemkit.contact.conditions import LinearConditions, augmented, separated, slip, stick
from bemkit.contact.laws import Frictionless
from bemkit.contact.problem import ContactProblem
from bemkit.contact.rigid_motions import as_dense
from bemkit.errors import InputError
from bemkit.testing.failure import demand

_MARGIN = 1e3
"""Errors allowed, in units of the accuracy that a body states: what its condition may make of it."""


def check_body(
    body: LinearBody, *, is_symmetric: bool = False, reloaded: LinearBody | None = None, seed: int = 0
) -> None:
    """Check everything that `LinearBody` promises; call it on your own body.

    Parameters
    ----------
    body : LinearBody
        Under some load.
    is_symmetric : bool
        Whether to demand that responses are reciprocal (Betti), as those of Galerkin and finite elements are.
    reloaded : LinearBody, optional
        The same body under another load: it has to answer changes of the conditions alike.
    seed : int
        Of the conditions tried.

    Raises
    ------
    CheckFailed
        Naming the body, the promise broken, and by how much. Errors are measured by the accuracy that the body states.
    """
    _check_numbers(body)
    asked = _Asked.of(body)
    _check_rigid_motions(asked)
    _check_eliminated_tangents(asked)
    random = np.random.default_rng(seed)
    for _ in range(3):
        kind = _conditions(asked, random)
        conditions = [kind, _with_other_values(asked, kind, random)]
        states = [asked.respond(each) for each in conditions]
        other_value = conditions[1].value
        between = LinearConditions(kind.on_displacement, kind.on_traction, 0.75 * kind.value + 0.25 * other_value)
        asked.demand_equal(asked.respond(between), states[0].blended(states[1], 0.25), "is not linear")
        _check_balance(asked, states[0])
        if is_symmetric:
            _check_reciprocity(asked, [*states, asked.respond(_conditions(asked, random))])
        if reloaded is not None:
            _check_reloaded(asked, _Asked.of(reloaded), conditions, states)


@dataclass(frozen=True, eq=False)
class _Asked:
    """A body, and the length [m] of the displacements that it is asked for."""

    body: LinearBody
    problem: ContactProblem
    length: float

    @classmethod
    def of(cls, body: LinearBody) -> _Asked:
        problem = ContactProblem(body, np.zeros(body.n_contact), Frictionless())
        return cls(body, problem, float(np.abs(problem.sticking_state.traction).max()) / body.stiffness_scale or 1.0)

    @property
    def name(self) -> str:
        return type(self.body).__name__

    @property
    def tolerance(self) -> float:
        return _MARGIN * self.body.accuracy

    def respond(self, conditions: LinearConditions) -> ContactState:
        """Return a response that meets its conditions, twice the same."""
        state, again = self.problem.respond(conditions), self.problem.respond(conditions)
        is_same = state.displacement == again.displacement
        is_same &= state.traction == again.traction
        demand(bool(is_same.all()), f"{self.name} gives two answers to one question")
        demand(state.is_finite, f"{self.name} returns numbers that are not finite")
        missed = np.einsum("nij,nj->ni", conditions.on_displacement, state.displacement)
        missed += np.einsum("nij,nj->ni", conditions.on_traction, state.traction) - conditions.value
        missed[self.body.tangent_is_eliminated, 1] = state.sigma_t[self.body.tangent_is_eliminated]
        displacement, traction = self.sizes(state)
        size = np.abs(conditions.on_displacement).max() * displacement + np.abs(conditions.on_traction).max() * traction
        worst = float(np.abs(missed).max() / size)
        demand(worst <= self.tolerance, f"{self.name} misses the conditions it was given by {worst:.1e}")
        return state

    def sizes(self, *states: ContactState) -> tuple[float, float]:
        """Return the largest displacement [m] and traction [Pa], each at least what the other one causes."""
        displacement = max(float(np.abs(state.displacement).max()) for state in states)
        traction = max(float(np.abs(state.traction).max()) for state in states)
        stiffness = self.body.stiffness_scale
        return displacement + traction / stiffness, traction + stiffness * displacement

    def demand_equal(self, one: ContactState, other: ContactState, complaint: str) -> None:
        """Compare what is no tangential displacement that follows the others."""
        displacement, traction = self.sizes(one, other)
        off = np.abs(one.displacement - other.displacement) / displacement
        off[self.body.tangent_is_eliminated, 1] = 0.0
        worst = max(float(off.max()), float(np.abs(one.traction - other.traction).max()) / traction)
        demand(worst <= self.tolerance, f"{self.name} {complaint} (by {worst:.1e})")


def _check_numbers(body: LinearBody) -> None:
    name, weights, scale = type(body).__name__, np.asarray(body.weights), body.stiffness_scale
    is_good = weights.ndim == 1 and weights.size > 0 and bool(np.all(np.isfinite(weights) & (weights > 0.0)))
    demand(is_good, f"{name}.weights is not an array of positive numbers, one for each contact node")
    demand(bool(np.isfinite(scale)) and scale > 0.0, f"{name}.stiffness_scale is {scale}; it is positive")
    demand(0.0 < body.accuracy <= 1e-4, f"{name}.accuracy is {body.accuracy}; it lies between 0 and 1e-4")
    motions, load, eliminated = (
        as_dense(body.rigid_motions(), body.n_contact),
        body.rigid_load(),
        body.tangent_is_eliminated,
    )
    for word, array, shape in (
        ("rigid_motions", motions, (len(motions), len(weights), 2)),
        ("rigid_load", load, (len(motions),)),
        ("tangent_is_eliminated", eliminated, weights.shape),
    ):
        demand(np.shape(array) == shape, f"{name}.{word} has the shape {np.shape(array)}; give {shape}")


def _check_rigid_motions(asked: _Asked) -> None:
    body, name, motions = asked.body, asked.name, as_dense(asked.body.rigid_motions(), asked.body.n_contact)
    try:
        asked.problem.respond(separated(body.n_contact))
        responds = True
    except SingularResponse:
        responds = False
    demand(responds or len(motions) > 0, f"{name} has no rigid motions, but does not respond without contact")
    demand(not responds or len(motions) == 0, f"{name} has rigid motions, but responds without contact")
    if responds:
        return
    rank = np.linalg.matrix_rank(motions.reshape(len(motions), -1))
    demand(rank == len(motions), f"{name}.rigid_motions are linearly dependent")
    rest = asked.problem.sticking_state
    forces = body.weights[:, None] * rest.traction
    for motion, load in zip(motions, body.rigid_load(), strict=True):
        moved = rest.displacement + motion * asked.length / np.abs(motion).max()
        shifted = ContactState(moved, rest.traction)
        asked.demand_equal(asked.respond(stick(*moved.T)), shifted, "changes its tractions when it moves rigidly")
        work = float((forces * motion).sum()) + float(load)
        size = asked.sizes(rest)[1] * float(body.weights @ np.abs(motion).sum(axis=1))
        complaint = f"{name}.rigid_load and the tractions of a held body do the work {work:.1e} on a rigid motion"
        demand(abs(work) <= asked.tolerance * size, complaint)


def _check_eliminated_tangents(asked: _Asked) -> None:
    if asked.body.tangent_is_eliminated.any():
        none = np.zeros(asked.body.n_contact)
        with suppress(InputError):
            asked.body.respond(stick(none, none))
            demand(False, f"{asked.name} takes a tangential condition where it has eliminated the tangent")


def _conditions(asked: _Asked, random: np.random.Generator) -> LinearConditions:
    """Return conditions that hold the body: of every kind, mixed at random."""
    n_contact, stiffness = asked.body.n_contact, asked.body.stiffness_scale
    gap, origin = asked.length * random.normal(size=(2, n_contact))
    bound = asked.length * stiffness * random.random(n_contact)
    multiplier = asked.length * stiffness * random.normal(size=(n_contact, 2))
    conditions = held = stick(gap, origin)
    for kind in (
        separated(n_contact),
        slip(gap, random.choice(np.array([-1.0, 1.0]), n_contact), np.full(n_contact, -0.2), bound),
        augmented(gap, origin, multiplier, 3.0 * stiffness, 2.0 * stiffness),
    ):
        rows = np.repeat(random.random((n_contact, 1)) < 0.25, 2, axis=1)
        conditions = conditions.replaced(rows, kind)
    conditions = asked.problem.without_eliminated(conditions)
    return (
        held if len(conditions.free_motions(as_dense(asked.body.rigid_motions(), asked.body.n_contact))) else conditions
    )


def _with_other_values(asked: _Asked, kind: LinearConditions, random: np.random.Generator) -> LinearConditions:
    change = asked.length * (
        kind.on_displacement.sum(axis=2) + asked.body.stiffness_scale * kind.on_traction.sum(axis=2)
    )
    return LinearConditions(
        kind.on_displacement, kind.on_traction, kind.value + change * random.normal(size=kind.value.shape)
    )


def _check_balance(asked: _Asked, state: ContactState) -> None:
    body, name = asked.body, asked.name
    imbalance = body.imbalance(state)
    complaint = f"{name}.imbalance of a response of its own is {imbalance.worst:.1e}"
    demand(imbalance.is_below(asked.tolerance), complaint)
    pushed = state.traction + asked.sizes(state)[1] * np.eye(2)[0]
    off = body.imbalance(ContactState(state.displacement, pushed)).force
    # of tractions that are of the size of all others at every node
    demand(off >= 1e-2, f"{name}.imbalance does not see tractions that hold no such displacements ({off:.1e})")


def _check_reciprocity(asked: _Asked, states: list[ContactState]) -> None:
    """Compare the works of two changes of the tractions, each on the displacements of the other."""
    rest, one, other = states
    works = [
        float((asked.body.weights[:, None] * (a.traction - rest.traction) * (b.displacement - rest.displacement)).sum())
        for a, b in ((one, other), (other, one))
    ]
    displacement, traction = asked.sizes(*states)
    off = abs(works[0] - works[1]) / (displacement * traction * float(asked.body.weights.sum()))
    demand(off <= asked.tolerance, f"{asked.name} is not symmetric: the works of two states differ by {off:.1e}")


def _check_reloaded(
    asked: _Asked, reloaded: _Asked, conditions: list[LinearConditions], states: list[ContactState]
) -> None:
    before, after = (
        ContactState(other.displacement - one.displacement, other.traction - one.traction)
        for one, other in (states, [reloaded.respond(each) for each in conditions])
    )
    asked.demand_equal(before, after, "answers changes of the conditions otherwise under another load")
