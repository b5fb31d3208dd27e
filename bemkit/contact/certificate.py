"""The certificate of a solution: violations of contact, friction and equilibrium."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bemkit.arrays import FloatArray
from bemkit.contact.body import ContactState
from bemkit.contact.problem import ContactProblem

_ROUND_OFF = 1e-13
"""Tractions relative to those of the sticking state below which they are round-off (450 eps)."""
_LARGEST_STICKING_RATIO = 100.0
"""Largest ratio of the stress scale, from the sticking state, to the tractions of the state. At a tolerance of 1e-9
tractions are then accurate to 1e-7, or to 1e-6 (mean of an element) if few nodes carry the load."""
_LONGEST = 1e5
"""Largest length scale relative to the displacement. Where a volume hardly changes, forces do not cause force / E',
which would hide any distance."""
_SHORTEST = 1e-5
"""Smallest length scale relative to force / E': displacements have a round-off of 1e-16 times that."""
DEFORMED = 1e-3
"""Length scale of a body without contact tractions, relative to its displacement. It is larger than round-off at a
tolerance of 1e-9, and smaller than the deformation by a load that lets the body recede from an overlap."""


@dataclass(frozen=True)
class Certificate:
    """Largest violation of each condition over all contact nodes; dimensionless, zero for an exact solution.

    Parameters
    ----------
    penetration : float
        ``u_n - g`` where positive.
    tension : float
        ``sigma_n`` where positive.
    complementarity : float
        The smaller of normal traction and distance to the obstacle; positive if an open node carries traction.
    cone_excess : float
        ``|sigma_t| - bound(sigma_n)`` where positive, with the bound at the present normal traction.
    slip_opposition : float
        The smaller of ``|slip|`` and ``|sigma_t + bound(sigma_n) sign(slip)|``; positive for slip without full,
        opposing friction.
    force_imbalance, moment_imbalance : float
        Residual of the equilibrium of all forces on the body, see `LinearBody.imbalance`.
    round_off : float
        Part of the two imbalances that may be round-off, at most 1e-6; not a violation.
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
        """The violations by name, without `round_off`."""
        return {name: value for name, value in self.as_dict().items() if name != "round_off"}

    @property
    def worst(self) -> float:
        """The largest violation, including round-off; ``nan`` if any violation is ``nan``."""
        return float(np.max(list(self.violations.values())))

    def is_below(self, tolerance: float) -> bool:
        """Whether violations are at most `tolerance`, imbalances at most `tolerance + round_off`; not for ``nan``."""
        allowed = {name: tolerance for name in self.violations}
        for name in ("force_imbalance", "moment_imbalance"):
            allowed[name] += self.round_off
        return all(value <= allowed[name] for name, value in self.violations.items())

    def as_dict(self) -> dict[str, float]:
        """Return all numbers by name."""
        return dict(vars(self))


def certify(problem: ContactProblem, state: ContactState) -> Certificate:
    """Return the violations of conditions (6) to (8) of the paper and of the equilibrium of the body.

    Parameters
    ----------
    problem : ContactProblem
    state : ContactState
        Any state; it need not be a response of the body.

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
    # friction that acts across the gap is no contact
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
    """Scales of stress and length in the certificate.

    ===================  ===========================================  ===================================
    regime               stress [Pa]                                  length [m]
    ===================  ===========================================  ===================================
    contact carries      the largest traction of the state, or that   what the largest nodal force causes
    something            of the sticking state where it is larger,    at its node: force / E', within 1e-6
                         up to 100 times the former                   and 1e5 of the largest displacement
    nothing, but moved   the sticking state                           1e-3 of the largest displacement
    nothing, at rest     the sticking state, or one                   force / E' of the sticking state,
                                                                      else the gaps, else one
    ===================  ===========================================  ===================================

    Parameters
    ----------
    stress : float [Pa]
        It includes the sticking state (all nodes held), so that the scale of a nearly lifted body is its load.
    force : float [N/m]
        The largest nodal force, chosen like the stress. The stress of a node is at most this force divided by its
        weight, so that high tractions of tiny elements in a corner do not weaken the test of other nodes.
    length, least_length : float [m]
        Differences below the least length are round-off of the displacements. A far obstacle or a long rigid motion
        weakens the test only if it is more than a million times the length.
    share : (n_contact,) array [-]
        Relative scale of each node: that of the partner with less load, at least a thousandth; see `LinearBody.shares`.
    """

    stress: float
    force: float
    length: float
    least_length: float
    share: FloatArray

    def stresses(self, weights: FloatArray) -> FloatArray:
        """Return the stress scale (n_contact,) [Pa] of each node."""
        return np.asarray(np.minimum(self.stress, self.force / weights) * self.share)

    @property
    def lengths(self) -> FloatArray:
        """(n_contact,) array [m]: length scale of each node."""
        return np.asarray(np.maximum(self.length * self.share, self.least_length))

    @classmethod
    def of(cls, problem: ContactProblem, state: ContactState) -> Scales:
        """Return the scales of any state."""
        present, sticking = (np.abs(known.traction).max(axis=1) for known in (state, problem.sticking_state))
        # without tractions, cohesion is a requirement however small it is; it does not increase present tractions
        is_loaded = present.max() > _ROUND_OFF * sticking.max()
        required = present if is_loaded else np.maximum(present, problem.cohesion)
        if required.max() > _ROUND_OFF * sticking.max() and max(present.max(), sticking.max()) > 0.0:
            return cls._of_contact(problem, state, present, required)
        return cls._of_motion(problem, state)

    @classmethod
    def _of_contact(
        cls, problem: ContactProblem, state: ContactState, present: FloatArray, required: FloatArray
    ) -> Scales:
        """Return the scales of a state with contact tractions; `required` (n_contact,) [Pa] includes cohesion."""
        weights, sticking = problem.body.weights, np.abs(problem.sticking_state.traction).max(axis=1)
        # the sticking state of a nearly incompressible body may have tractions a million times larger, which would hide
        # errors of the solution
        stress, force = (
            max(
                float((factor * present).max()),
                min(float((factor * sticking).max()), _LARGEST_STICKING_RATIO * float((factor * required).max())),
            )
            for factor in (1.0, weights)
        )
        moved = float(np.abs(state.displacement).max())
        length, least_length = force / problem.modulus, 1e-6 * moved
        length = max(min(length, _LONGEST * moved), _SHORTEST * length, least_length)
        tractions = np.maximum(present, np.minimum(sticking, _LARGEST_STICKING_RATIO * required))
        share = problem.body.shares(weights * tractions)
        return cls(stress, force, length, least_length, share)

    @classmethod
    def _of_motion(cls, problem: ContactProblem, state: ContactState) -> Scales:
        """Return the scales of a state without contact tractions: the length is a share of the displacement.

        For a body at rest the scale is the force of the sticking state or, if that is zero, the gaps.
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
