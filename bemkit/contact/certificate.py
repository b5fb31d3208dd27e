"""The certificate of a solution: violations of contact, friction and equilibrium, numbers anyone can check."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bemkit.arrays import FloatArray
from bemkit.contact.body import ContactState
from bemkit.contact.problem import ContactProblem

_ROUND_OFF = 1e-13
"""Tractions below this share of those of the sticking state are round-off (450 eps) of the sums they come from. Larger
ones count, however small they are."""
_LARGEST_STICKING_RATIO = 100.0
"""The tractions of the sticking state measure a state only up to this multiple of its own tractions. These are then
known to 1e-7 at a tolerance of 1e-9, and to 1e-6 (the mean of an element) where few nodes carry all."""
DEFORMED = 1e-3
"""Share of its displacement that counts as deformation of a body without contact tractions. It lies above the round-off
of the displacement at a tolerance of 1e-9, and below the deformation by a load under which the body gives way to an
overlap."""


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
        The smaller of traction and distance to the obstacle, positive if an open node carries traction.
    cone_excess : float
        ``|sigma_t| - bound(sigma_n)`` where positive, the bound taken at the *present* normal traction.
    slip_opposition : float
        The smaller of ``|slip|`` and ``|sigma_t + bound(sigma_n) sign(slip)|``: slip without full, opposing friction.
    force_imbalance, moment_imbalance : float
        Distance of all forces on the body from equilibrium, see `LinearBody.imbalance`.
    round_off : float
        No violation: how much of the two imbalances may be round-off, at most 1e-6.
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
        """The measured violations by name: all entries but `round_off`."""
        return {name: value for name, value in self.as_dict().items() if name != "round_off"}

    @property
    def worst(self) -> float:
        """The largest violation, round-off included; ``nan`` if any violation is."""
        return float(np.max(list(self.violations.values())))

    def is_below(self, tolerance: float) -> bool:
        """Whether violations are at most `tolerance`, imbalances at most `tolerance + round_off`; never for ``nan``."""
        allowed = {name: tolerance for name in self.violations}
        for name in ("force_imbalance", "moment_imbalance"):
            allowed[name] += self.round_off
        return all(value <= allowed[name] for name, value in self.violations.items())

    def as_dict(self) -> dict[str, float]:
        """Return all numbers by name."""
        return dict(vars(self))


def certify(problem: ContactProblem, state: ContactState) -> Certificate:
    """Measure how far a state violates conditions (6) to (8) of the paper and the equilibrium of the body.

    Parameters
    ----------
    problem : ContactProblem
    state : ContactState
        Of any origin: it need not be a response of the body.

    Returns
    -------
    Certificate

    Raises
    ------
    LawError
        If the friction law fails.

    Notes
    -----
    Tractions are divided by a stress, distances and slips by a length; see `Scales`.
    """
    scales = Scales.of(problem, state)
    stress, length = scales.stresses(problem.body.weights), scales.lengths
    clearance = problem.gap - state.u_n
    slip = state.u_t - problem.slip_origin
    # friction given across the gap is not a sign of contact
    shear = np.where(problem.law.acts_across_gap, 0.0, np.abs(state.sigma_t))
    traction, distance = np.maximum(np.abs(state.sigma_n), shear) / stress, np.abs(clearance) / length
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


@dataclass(frozen=True, eq=False)
class Scales:
    """Scales of the certificate.

    ===================  ===========================================  ===================================
    regime               stress [Pa]                                  length [m]
    ===================  ===========================================  ===================================
    contact carries      the largest traction of the state, or that   what the largest nodal force causes
    something            of the sticking state where it is larger,    at its node: force / E', at least
                         up to 100 times the former                   1e-6 of the largest displacement
    nothing, but moved   the sticking state                           1e-3 of the largest displacement
    nothing, at rest     the sticking state, or one                   force / E' of the sticking state,
                                                                      else the gaps, else one
    ===================  ===========================================  ===================================

    Parameters
    ----------
    stress : float [Pa]
        The sticking state (all nodes held) takes part so that a nearly lifted body is judged by its load.
    force : float [N/m]
        The largest nodal force, chosen like the stress. At a node the stress is at most this force by the weight of the
        node, so that the high tractions of tiny elements in a corner do not loosen the test elsewhere.
    length, least_length : float [m]
        Digits beyond the least length are round-off of the displacements. A far obstacle or a long rigid motion does
        not loosen the test until it exceeds the length a million times.
    share : (n_contact,) array [-]
        Each contact is measured by the partner that carries less, down to a thousandth of what the others carry; see
        `LinearBody.shares`.
    """

    stress: float
    force: float
    length: float
    least_length: float
    share: FloatArray

    def stresses(self, weights: FloatArray) -> FloatArray:
        """Return the stress (n_contact,) [Pa] of each node."""
        return np.asarray(np.minimum(self.stress, self.force / weights) * self.share)

    @property
    def lengths(self) -> FloatArray:
        """(n_contact,) array [m]: the length of each node."""
        return np.asarray(np.maximum(self.length * self.share, self.least_length))

    @classmethod
    def of(cls, problem: ContactProblem, state: ContactState) -> Scales:
        """Return the scales of a state of any origin."""
        present, sticking = (np.abs(each.traction).max(axis=1) for each in (state, problem.sticking_state))
        # Without tractions, friction that needs no pressure is one to be met, however small beside those of the
        # sticking state. Tractions that are there are no larger because a law would allow more.
        is_loaded = present.max() > _ROUND_OFF * sticking.max()
        required = present if is_loaded else np.maximum(present, problem.cohesion)
        if required.max() > _ROUND_OFF * sticking.max() and max(present.max(), sticking.max()) > 0.0:
            return cls._of_contact(problem, state, present, required)
        return cls._of_motion(problem, state)

    @classmethod
    def _of_contact(
        cls, problem: ContactProblem, state: ContactState, present: FloatArray, required: FloatArray
    ) -> Scales:
        """Return the scales where contact carries something; `required` (n_contact,) [Pa] includes cohesion."""
        weights, sticking = problem.body.weights, np.abs(problem.sticking_state.traction).max(axis=1)
        # Holding a nearly incompressible body may take a million times the tractions of the solution. Measured by
        # those, errors of the solution would not be seen.
        stress, force = (
            max(
                float((factor * present).max()),
                min(float((factor * sticking).max()), _LARGEST_STICKING_RATIO * float((factor * required).max())),
            )
            for factor in (1.0, weights)
        )
        least_length = 1e-6 * float(np.abs(state.displacement).max())
        tractions = np.maximum(present, np.minimum(sticking, _LARGEST_STICKING_RATIO * required))
        share = problem.body.shares(weights * tractions)
        return cls(stress, force, max(force / problem.modulus, least_length), least_length, share)

    @classmethod
    def _of_motion(cls, problem: ContactProblem, state: ContactState) -> Scales:
        """Return the scales where contact carries nothing, so that the displacement is the only length there is.

        A body that has not moved is measured by the force that would hold it or, if that is zero, by the gaps.
        """
        weights, sticking = problem.body.weights, np.abs(problem.sticking_state.traction).max(axis=1)
        gaps = np.abs(problem.gap[np.isfinite(problem.gap)])
        force = float((weights * sticking).max())
        length = DEFORMED * float(np.abs(state.displacement).max()) or force / problem.modulus
        length = length or float(gaps.max(initial=0.0)) or 1.0
        shares = np.ones(len(weights))
        return cls(float(sticking.max()) or 1.0, force or float(weights.max()), length, length, shares)


def _largest(values: FloatArray) -> float:
    return float(np.maximum(values, 0.0).max())
