"""The contact problem: a body, a gap, a friction law; and the certificate of a solution, numbers anyone can check."""

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from bemkit.arrays import BoolArray, FloatArray, read_only
from bemkit.contact.body import ContactState, LinearBody, SingularResponse
from bemkit.contact.condensation.dense_body import DenseBody
from bemkit.contact.conditions import LinearConditions, separated, stick
from bemkit.contact.further_laws import law_name
from bemkit.contact.laws import FrictionLaw, LawError
from bemkit.errors import InputError

__all__ = [
    "Certificate",
    "ContactProblem",
    "ContactState",
    "DenseBody",
    "LawError",
    "LinearBody",
    "SingularResponse",
    "certificate_scales",
    "certify",
]

_ROUND_OFF = 1e-13
"""Tractions below this share of those of the sticking state are round-off (450 eps) of the sums they come from. Larger
ones mean something, however small they are."""
_HELD = 100.0
"""Tractions of the sticking state measure those in a state that are so many times smaller at most: to 1e-9 of them
these are known to 1e-7, and where few nodes carry all, by the mean of an element, to 1e-6."""
DEFORMED = 1e-3
"""Share of its displacement by which a body counts as deformed that contact does not touch: more than round-off of the
displacement leaves to a tolerance of 1e-9, less than the load may deform a body that has given way to an overlap."""


@dataclass(frozen=True, eq=False)
class ContactProblem:
    """Find ``u_n <= g``, ``sigma_n <= 0``, ``sigma_n (u_n - g) = 0`` and friction by the law, for one loaded body.

    Parameters
    ----------
    body : LinearBody
    gap : (n_contact,) array [m]
        Distance to the obstacle along the normal; negative where body and obstacle overlap before the load acts,
        ``inf`` where the node can never touch.
    law : FrictionLaw
    reference_slip : (n_contact,) array [m], optional
        Slip is ``u_t - reference_slip``. Zero (the default) is the static law of the paper; the tangential
        displacement of the last load step gives the incremental law.

    Raises
    ------
    ValueError
        If a shape does not fit the body, or an entry is not a number.
    LawError
        If the law fails or returns bounds of another shape, negative or not finite.
    """

    body: LinearBody
    gap: FloatArray
    law: FrictionLaw
    reference_slip: FloatArray | None = None

    def __post_init__(self) -> None:
        _check_members(self.body, self.law)
        n_contact = self.body.n_contact
        slip = np.zeros(n_contact) if self.reference_slip is None else self.reference_slip
        for name, given in (("gap", self.gap), ("reference_slip", slip)):
            array = np.array(given, dtype=float)
            if array.shape != (n_contact,):
                raise InputError(f"{name} has the shape {array.shape}; the body has {n_contact} contact nodes")
            is_wrong = np.isnan(array) | (np.isneginf(array) if name == "gap" else np.isinf(array))
            if is_wrong.any():
                node = int(np.argmax(is_wrong))
                raise InputError(f"{name} is {array[node]} at contact node {node}; give a number")
            object.__setattr__(self, name, read_only(array))
        _ = self.cohesion  # a law that fails does so at once

    @property
    def n_contact(self) -> int:
        """Number of contact nodes."""
        return self.body.n_contact

    @property
    def slip_origin(self) -> FloatArray:
        """(n_contact,) array [m], the reference slip (zeros for the static law)."""
        return np.zeros(self.n_contact) if self.reference_slip is None else self.reference_slip

    @cached_property
    def sticking_state(self) -> ContactState:
        """Response with all nodes sticking and none overlapping: the cold start, and the measure of the load.

        Nodes are held at ``u_n = min(g, 0)`` and ``u_t = reference_slip``, or ``sigma_t = 0`` where the body has
        eliminated the tangent.
        """
        return self.respond(stick(np.minimum(self.gap, 0.0), self.slip_origin))

    @cached_property
    def modulus(self) -> float:
        """Force by which a typical node resists its displacement [Pa]: about E' of the material."""
        return self.body.stiffness_scale * float(np.median(self.body.weights))

    @cached_property
    def of_body(self) -> dict[str, Any]:
        """What drivers have found out of the body and its load, to be kept under other laws; see `with_law`."""
        return {}

    def respond(self, conditions: LinearConditions) -> ContactState:
        """Return the response of the body; where it has eliminated the tangent, ``sigma_t = 0`` whatever is asked.

        Drivers ask this instead of the body itself, and need not know where there is no friction. Raises
        `SingularResponse` if the conditions do not determine the response.
        """
        return self.body.respond(self.without_eliminated(conditions))

    def without_eliminated(self, conditions: LinearConditions) -> LinearConditions:
        """Return the conditions with ``sigma_t = 0`` wherever the body has eliminated the tangent."""
        rows = self.body.tangent_is_eliminated
        if not rows.any():
            return conditions
        return conditions.replaced(np.stack([np.zeros_like(rows), rows], axis=1), separated(self.n_contact))

    def with_law(self, law: FrictionLaw) -> "ContactProblem":
        """Return the problem under another law."""
        other = replace(self, law=law)
        other.__dict__["of_body"] = self.of_body
        if "sticking_state" in self.__dict__:  # it does not depend on the law
            other.__dict__["sticking_state"] = self.sticking_state
        return other

    @cached_property
    def cohesion(self) -> FloatArray:
        """(n_contact,) array [Pa]: the friction bound without pressure."""
        return self.friction_bound(np.zeros(self.n_contact))

    def friction_bound(self, sigma_n: FloatArray, is_closed: BoolArray | None = None) -> FloatArray:
        """Return the bound of the tangential traction at every node.

        Parameters
        ----------
        sigma_n : (n_contact,) array [Pa]
            Normal tractions; tension is read as zero.
        is_closed : (n_contact,) bool array, optional
            Open nodes have the bound zero unless the law acts across the gap. All closed by default.

        Returns
        -------
        (n_contact,) array [Pa]

        Raises
        ------
        LawError
            If the law fails, or returns a wrong shape or negative or non-finite bounds.
        """
        bound = self._ask_law("bound", np.minimum(sigma_n, 0.0))
        if np.any(bound < 0.0):
            node = int(np.argmin(bound))
            raise LawError(
                f"friction law {law_name(self.law)}.bound is {bound[node]:g} at contact node {node} "
                f"(sigma_n = {sigma_n[node]:g}); a bound is zero or positive"
            )
        if np.any(bound[self.body.tangent_is_eliminated] > 0.0):
            node = int(np.flatnonzero(self.body.tangent_is_eliminated & (bound > 0.0))[0])
            raise LawError(
                f"friction law {law_name(self.law)} allows {bound[node]:g} at contact node {node}, where the body was "
                "condensed without friction: condense it again for this law"
            )
        return self._where_acting(bound, is_closed)

    def friction_slope(self, sigma_n: FloatArray, is_closed: BoolArray | None = None) -> FloatArray:
        """Return the derivative of the bound by the normal traction at every node; see `friction_bound`."""
        return self._where_acting(self._ask_law("bound_derivative", np.minimum(sigma_n, 0.0)), is_closed)

    def _where_acting(self, values: FloatArray, is_closed: BoolArray | None) -> FloatArray:
        if is_closed is None:
            return values
        return np.where(is_closed | np.asarray(self.law.acts_across_gap), values, 0.0)

    def _ask_law(self, method: str, sigma_n: FloatArray) -> FloatArray:
        try:
            values = np.asarray(getattr(self.law, method)(sigma_n), dtype=float)
        except Exception as error:  # whatever an own law raises must surface with the law's name
            raise LawError(f"{self._name(method)} failed: {type(error).__name__}: {error}") from error
        if values.shape != sigma_n.shape:
            shapes = f"the shape {values.shape} for {sigma_n.shape}"
            raise LawError(f"{self._name(method)} returned {shapes}; give one value a node")
        # A state that is not finite is the driver's to report; finite tractions must give finite bounds.
        if not np.isfinite(values).all() and np.isfinite(sigma_n).all():
            node = int(np.argmin(np.isfinite(values)))
            at = f"at contact node {node} (sigma_n = {sigma_n[node]:g})"
            raise LawError(f"{self._name(method)} is {values[node]} {at}")
        return values

    def _name(self, method: str) -> str:
        return f"friction law {law_name(self.law)}.{method}"


def _check_members(body: LinearBody, law: FrictionLaw) -> None:
    """Refuse a body or a law that lacks what drivers ask of it."""
    absent = [name for name in _BODY_MEMBERS if not hasattr(body, name)]
    if absent:
        raise InputError(
            f"body {type(body).__name__} has no {', '.join(absent)}; "
            "derive it from bemkit.contact.body.LinearBody and write weights, stiffness_scale and respond"
        )
    absent = [name for name in _LAW_MEMBERS if not hasattr(law, name)]
    if absent:
        raise LawError(
            f"friction law {law_name(law)} has no {', '.join(absent)}; "
            "derive it from bemkit.contact.laws.FrictionLaw and write bound and bound_derivative"
        )


_BODY_MEMBERS = (
    *("weights", "n_contact", "stiffness_scale", "accuracy", "is_costly", "tangent_is_eliminated"),
    *("respond", "rigid_motions", "rigid_load", "moving_bodies", "partners_of", "shares", "imbalance"),
)
_LAW_MEMBERS = ("bound", "bound_derivative", "is_frictionless", "acts_across_gap", "scaled")


@dataclass(frozen=True)
class Certificate:
    """Largest violation of each condition over all contact nodes; all numbers are dimensionless and zero is perfect.

    Parameters
    ----------
    penetration : float
        ``u_n - g`` where positive.
    tension : float
        ``sigma_n`` where positive.
    complementarity : float
        The smaller of traction and distance where both exist: a node that is open and carries traction.
    cone_excess : float
        ``|sigma_t| - bound(sigma_n)`` where positive, the bound taken at the *present* normal traction.
    slip_opposition : float
        The smaller of ``|slip|`` and ``|sigma_t + bound(sigma_n) sign(slip)|``: slip without full, opposing friction.
    force_imbalance, moment_imbalance : float
        What the body says about equilibrium, see `LinearBody.imbalance`.
    round_off : float
        No violation, but how much of the two imbalances round-off alone may leave, at most 1e-6.
    """

    penetration: float
    tension: float
    complementarity: float
    cone_excess: float
    slip_opposition: float
    force_imbalance: float
    moment_imbalance: float
    round_off: float = 0.0

    @property
    def violations(self) -> dict[str, float]:
        """What was measured, by name: all but `round_off`."""
        return {name: value for name, value in self.as_dict().items() if name != "round_off"}

    @property
    def worst(self) -> float:
        """The largest violation, whatever it is put down to; ``nan`` if any is."""
        return float(np.max(list(self.violations.values())))

    def is_below(self, tolerance: float) -> bool:
        """Whether every violation is at most `tolerance`, an imbalance `round_off` more (never true for ``nan``)."""
        allowed = {name: tolerance for name in self.violations}
        for name in ("force_imbalance", "moment_imbalance"):
            allowed[name] += self.round_off
        return all(value <= allowed[name] for name, value in self.violations.items())

    def as_dict(self) -> dict[str, float]:
        """Return all numbers by name."""
        return dict(vars(self))


def certify(problem: ContactProblem, state: ContactState) -> Certificate:
    """Measure a state against conditions (6) to (8), whoever produced it.

    Notes
    -----
    Tractions are measured by the largest traction in the state or in the sticking state (all nodes held), whichever is
    larger, so that a nearly lifted body is judged by its load; but by no more than a hundred times those in the state.
    Of several bodies each contact is measured so by the one of its partners that carries less, down to a thousandth of
    what the others carry: a light block is not judged by the heaviest; see `LinearBody.shares`.
    A node to which that would give more than the largest nodal force is measured by this force, so that tractions of
    tiny elements in a corner excuse nothing. Lengths are measured by the displacement which the largest nodal force
    causes at its node, ``force / E'``, however few nodes or small elements carry it: a far obstacle or a long rigid
    motion does not loosen the test until it exceeds 1e6 times that displacement, where round-off would speak instead. A
    state without tractions, such as that of a loose body which has given way to an overlap, has no length but its
    displacement: a thousandth of it is what counts as deformation.
    """
    scales = _scales(problem, state)
    stress = np.minimum(scales.stress, scales.force / problem.body.weights) * scales.share
    length = np.maximum(scales.length * scales.share, scales.least_length)
    clearance = problem.gap - state.u_n
    slip = state.u_t - problem.slip_origin
    # friction given across the gap is no sign of contact
    shear = np.where(problem.law.acts_across_gap, 0.0, np.abs(state.sigma_t))
    held = np.maximum(np.abs(state.sigma_n), shear)
    traction, distance = held / stress, np.abs(clearance) / length
    bound = problem.friction_bound(state.sigma_n, is_closed=traction > distance)
    against_slip = np.where(slip > 0.0, state.sigma_t + bound, state.sigma_t - bound)
    imbalance = problem.body.imbalance(state)
    return Certificate(
        penetration=_largest(-clearance / length),
        tension=_largest(state.sigma_n / stress),
        complementarity=_largest(np.minimum(traction, distance)),
        cone_excess=_largest((np.abs(state.sigma_t) - bound) / stress),
        slip_opposition=_largest(np.minimum(np.abs(slip) / length, np.abs(against_slip) / stress)),
        force_imbalance=imbalance.force,
        moment_imbalance=imbalance.moment,
        round_off=imbalance.round_off,
    )


def certificate_scales(problem: ContactProblem, state: ContactState) -> tuple[float, float]:
    """Return the largest traction [Pa] and the length [m] by which `certify` measures; see its notes."""
    scales = _scales(problem, state)
    return scales.stress, scales.length


class _Scales(NamedTuple):
    stress: float
    force: float
    length: float
    least_length: float
    share: FloatArray


def _scales(problem: ContactProblem, state: ContactState) -> _Scales:
    weights, modulus = problem.body.weights, problem.modulus
    furthest = float(np.abs(state.displacement).max())
    present, sticking = (np.abs(held.traction).max(axis=1) for held in (state, problem.sticking_state))
    # Without any traction friction without pressure is one to be met, however small beside those of the sticking state.
    # Tractions that are there are no smaller than they are because a law would allow more.
    at_hand = present if present.max() > _ROUND_OFF * sticking.max() else np.maximum(present, problem.cohesion)
    if at_hand.max() > _ROUND_OFF * sticking.max() and max(present.max(), sticking.max()) > 0.0:
        # Holding a nearly incompressible body may take a million times the tractions of the answer, which these must
        # not excuse.
        stress, force = (
            max(float((by * present).max()), min(float((by * sticking).max()), _HELD * float((by * at_hand).max())))
            for by in (1.0, weights)
        )
        least = 1e-6 * furthest
        share = problem.body.shares(weights * np.maximum(present, np.minimum(sticking, _HELD * at_hand)))
        return _Scales(stress, force, max(force / modulus, least), least, share)
    # Contact does nothing here, so the displacement is the only length there is. A body that has not moved is measured
    # by what would hold it or, if even that is nothing, by the gaps.
    gaps = np.abs(problem.gap[np.isfinite(problem.gap)])
    force = float((weights * sticking).max())
    length = DEFORMED * furthest or force / modulus or float(gaps.max(initial=0.0)) or 1.0
    return _Scales(float(sticking.max()) or 1.0, force or float(weights.max()), length, length, np.ones(len(weights)))


def _largest(values: FloatArray) -> float:
    return float(np.maximum(values, 0.0).max())
