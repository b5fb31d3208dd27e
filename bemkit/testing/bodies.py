"""Conformance of elastic bodies."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass

import numpy as np

from bemkit.contact.body import ContactState, LinearBody, SingularResponse, augmented, separated, slip, stick
from bemkit.contact.laws import Frictionless
from bemkit.contact.problem import ContactProblem
from bemkit.errors import InputError
from bemkit.operators.boundary_equations import LinearConditions
from bemkit.operators.rigid_modes import as_dense
from bemkit.testing.failure import demand

_MARGIN = 1e3
"""Allowed errors, in units of the stated accuracy of a body: the condition of a response may magnify its errors."""


def check_body(body: LinearBody, *, is_symmetric: bool = False, reloaded: LinearBody | None = None) -> None:
    """Check everything that `LinearBody` promises; call it on your own body.

    Parameters
    ----------
    body : LinearBody
        Under some load.
    is_symmetric : bool
        Whether to demand that responses are reciprocal (Betti), as those of Galerkin and finite elements are.
    reloaded : LinearBody, optional
        The same body under another load. Its responses must change by as much when the conditions change.

    Raises
    ------
    CheckFailed
        Naming the body, the promise broken, and by how much. Errors are measured by the accuracy that the body states.
    """
    _check_numbers(body)
    tested = _TestedBody.of(body)
    _check_rigid_motions(tested)
    _check_following_tangents(tested)
    random = np.random.default_rng(0)
    for _ in range(3):
        kind = _conditions(tested, random)
        conditions = [kind, _with_other_values(tested, kind, random)]
        states = [tested.respond(each) for each in conditions]
        other_value = conditions[1].value
        between = LinearConditions(kind.on_displacement, kind.on_traction, 0.75 * kind.value + 0.25 * other_value)
        tested.demand_equal(tested.respond(between), states[0].blended(states[1], 0.25), "is not linear")
        _check_balance(tested, states[0])
        if is_symmetric:
            _check_reciprocity(tested, [*states, tested.respond(_conditions(tested, random))])
        if reloaded is not None:
            _check_reloaded(tested, _TestedBody.of(reloaded), conditions, states)


@dataclass(frozen=True, eq=False)
class _TestedBody:
    """A body with a contact problem on it, and the size [m] of the displacements that conditions prescribe."""

    body: LinearBody
    problem: ContactProblem
    length: float

    @classmethod
    def of(cls, body: LinearBody) -> _TestedBody:
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
        conditions = self.problem.possible(conditions)
        state, again = self.body.respond(conditions), self.body.respond(conditions)
        is_same = state.displacement == again.displacement
        is_same &= state.traction == again.traction
        demand(bool(is_same.all()), f"{self.name} gives two answers to one question")
        demand(state.is_finite, f"{self.name} returns numbers that are not finite")
        residual = np.einsum("nij,nj->ni", conditions.on_displacement, state.displacement)
        residual += np.einsum("nij,nj->ni", conditions.on_traction, state.traction) - conditions.value
        displacement, traction = self.sizes(state)
        size = np.abs(conditions.on_displacement).max() * displacement + np.abs(conditions.on_traction).max() * traction
        worst = float(np.abs(residual).max() / size)
        demand(worst <= self.tolerance, f"{self.name} misses the conditions it was given by {worst:.1e}")
        return state

    def sizes(self, *states: ContactState) -> tuple[float, float]:
        """Return the largest displacement [m] and traction [Pa], each at least what the other one causes."""
        displacement = max(float(np.abs(state.displacement).max()) for state in states)
        traction = max(float(np.abs(state.traction).max()) for state in states)
        stiffness = self.body.stiffness_scale
        return displacement + traction / stiffness, traction + stiffness * displacement

    def demand_equal(self, one: ContactState, other: ContactState, complaint: str) -> None:
        """Compare displacements and tractions."""
        displacement, traction = self.sizes(one, other)
        off = np.abs(one.displacement - other.displacement) / displacement
        worst = max(float(off.max()), float(np.abs(one.traction - other.traction).max()) / traction)
        demand(worst <= self.tolerance, f"{self.name} {complaint} (by {worst:.1e})")


def _check_numbers(body: LinearBody) -> None:
    name, weights, scale = type(body).__name__, np.asarray(body.weights), body.stiffness_scale
    is_good = weights.ndim == 1 and weights.size > 0 and bool(np.all(np.isfinite(weights) & (weights > 0.0)))
    demand(is_good, f"{name}.weights is not an array of positive numbers, one for each contact node")
    demand(bool(np.isfinite(scale)) and scale > 0.0, f"{name}.stiffness_scale is {scale}; it is positive")
    demand(0.0 < body.accuracy <= 1e-4, f"{name}.accuracy is {body.accuracy}; it lies between 0 and 1e-4")
    motions, load, follows = (
        as_dense(body.rigid_motions(), body.n_contact),
        body.rigid_load(),
        body.tangent_follows,
    )
    for word, array, shape in (
        ("rigid_motions", motions, (len(motions), len(weights), 2)),
        ("rigid_load", load, (len(motions),)),
        ("tangent_follows", follows, weights.shape),
    ):
        demand(np.shape(array) == shape, f"{name}.{word} has the shape {np.shape(array)}; give {shape}")


def _check_rigid_motions(tested: _TestedBody) -> None:
    body, name, motions = tested.body, tested.name, as_dense(tested.body.rigid_motions(), tested.body.n_contact)
    try:
        tested.problem.respond(separated(body.n_contact))
        responds = True
    except SingularResponse:
        responds = False
    demand(responds or len(motions) > 0, f"{name} has no rigid motions, but does not respond without contact")
    demand(not responds or len(motions) == 0, f"{name} has rigid motions, but responds without contact")
    if responds:
        return
    rank = np.linalg.matrix_rank(motions.reshape(len(motions), -1))
    demand(rank == len(motions), f"{name}.rigid_motions are linearly dependent")
    sticking = tested.problem.sticking_state
    forces = body.weights[:, None] * sticking.traction
    for motion, load in zip(motions, body.rigid_load(), strict=True):
        moved = sticking.displacement + motion * tested.length / np.abs(motion).max()
        shifted = ContactState(moved, sticking.traction)
        tested.demand_equal(tested.respond(stick(*moved.T)), shifted, "changes its tractions when it moves rigidly")
        work = float((forces * motion).sum()) + float(load)
        size = tested.sizes(sticking)[1] * float(body.weights @ np.abs(motion).sum(axis=1))
        complaint = f"{name}.rigid_load and the tractions of a held body do the work {work:.1e} on a rigid motion"
        demand(abs(work) <= tested.tolerance * size, complaint)


def _check_following_tangents(tested: _TestedBody) -> None:
    if tested.body.tangent_follows.any():
        none = np.zeros(tested.body.n_contact)
        with suppress(InputError):
            tested.body.respond(stick(none, none))
            demand(False, f"{tested.name} takes a tangential condition where its tangent follows")


def _conditions(tested: _TestedBody, random: np.random.Generator) -> LinearConditions:
    """Return conditions that hold the body: of every kind, mixed at random."""
    n_contact, stiffness = tested.body.n_contact, tested.body.stiffness_scale
    gap, origin = tested.length * random.normal(size=(2, n_contact))
    bound = tested.length * stiffness * random.random(n_contact)
    multiplier = tested.length * stiffness * random.normal(size=(n_contact, 2))
    conditions = sticking = stick(gap, origin)
    for kind in (
        separated(n_contact),
        slip(gap, random.choice(np.array([-1.0, 1.0]), n_contact), np.full(n_contact, -0.2), bound),
        augmented(gap, origin, multiplier, 3.0 * stiffness, 2.0 * stiffness),
    ):
        rows = np.repeat(random.random((n_contact, 1)) < 0.25, 2, axis=1)
        conditions = conditions.replaced(rows, kind)
    conditions = tested.problem.possible(conditions)
    motions = as_dense(tested.body.rigid_motions(), tested.body.n_contact)
    return sticking if len(conditions.free_motions(motions)) else conditions


def _with_other_values(tested: _TestedBody, kind: LinearConditions, random: np.random.Generator) -> LinearConditions:
    change = tested.length * (
        kind.on_displacement.sum(axis=2) + tested.body.stiffness_scale * kind.on_traction.sum(axis=2)
    )
    return LinearConditions(
        kind.on_displacement, kind.on_traction, kind.value + change * random.normal(size=kind.value.shape)
    )


def _check_balance(tested: _TestedBody, state: ContactState) -> None:
    body, name = tested.body, tested.name
    imbalance = body.imbalance(state)
    complaint = f"{name}.imbalance of a response of its own is {imbalance.worst:.1e}"
    demand(imbalance.is_below(tested.tolerance), complaint)
    pushed = state.traction + tested.sizes(state)[1] * np.eye(2)[0]
    off = body.imbalance(ContactState(state.displacement, pushed)).force
    # the traction added at every node is as large as the largest one
    demand(off >= 1e-2, f"{name}.imbalance does not see tractions that hold no such displacements ({off:.1e})")


def _check_reciprocity(tested: _TestedBody, states: list[ContactState]) -> None:
    """Compare the work of each of two changes of the tractions on the displacements of the other (Betti)."""
    base, one, other = states
    weights = tested.body.weights[:, None]
    works = [
        float((weights * (a.traction - base.traction) * (b.displacement - base.displacement)).sum())
        for a, b in ((one, other), (other, one))
    ]
    displacement, traction = tested.sizes(*states)
    off = abs(works[0] - works[1]) / (displacement * traction * float(weights.sum()))
    demand(off <= tested.tolerance, f"{tested.name} is not symmetric: the works of two states differ by {off:.1e}")


def _check_reloaded(
    tested: _TestedBody, reloaded: _TestedBody, conditions: list[LinearConditions], states: list[ContactState]
) -> None:
    before, after = (
        ContactState(other.displacement - one.displacement, other.traction - one.traction)
        for one, other in (states, [reloaded.respond(each) for each in conditions])
    )
    tested.demand_equal(before, after, "answers changes of the conditions otherwise under another load")
