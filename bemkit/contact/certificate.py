"""The certificate: how well a state satisfies contact and friction, in numbers anyone can check."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from bemkit.arrays import FloatArray
from bemkit.contact.problem import ContactProblem, ContactState

_ROUND_OFF = 1e-13
"""Tractions below this share of those of the sticking state are round-off (450 eps) of the sums they come from. Larger
ones mean something, however small they are."""
_HELD = 100.0
"""Tractions of the sticking state measure those in a state that are so many times smaller at most: to 1e-9 of them
these are known to 1e-7, and where few nodes carry all, by the mean of an element, to 1e-6."""
DEFORMED = 1e-3
"""Share of its displacement by which a body counts as deformed that contact does not touch: more than round-off of the
displacement leaves to a tolerance of 1e-9, less than the load may deform a body that has given way to an overlap."""


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
    weights = problem.body.weights
    modulus = problem.body.stiffness_scale * float(np.median(weights))
    furthest = float(np.abs(state.displacement).max())
    # friction without pressure is a traction to be met as well, however small beside those of the sticking state
    resisted = problem.cohesion
    present, sticking = (np.abs(held.traction).max(axis=1) for held in (state, problem.sticking_state))
    at_hand = np.maximum(present, resisted)
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
