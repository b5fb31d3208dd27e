"""Further friction laws: with cohesion and a cap, dependent on slip or its speed, different from part to part."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from bemkit.arrays import BoolArray, FloatArray, IntArray
from bemkit.contact.body import SlipHistory
from bemkit.contact.laws import Coefficient, Coulomb, FrictionLaw, LawOfCoefficients, RescaledLaw, is_zero, numbers_of
from bemkit.errors import InputError


@dataclass(frozen=True, eq=False)
class CohesiveCoulomb(LawOfCoefficients):
    """Coulomb's law with cohesion and cap: ``bound = min(c + s |sigma_n|, tau_max)``.

    Parameters
    ----------
    friction_coefficient : Coefficient [-]
        s, not negative.
    cohesion : Coefficient [Pa]
        c, not negative; acts while the node is closed and ends when it opens.
    cap : Coefficient [Pa]
        tau_max, not below the cohesion; infinite by default.

    Notes
    -----
    Cohesion drops to zero at once when a node opens. So a problem with ``c > 0`` and a moving edge of contact need not
    have a solution; the status of a solver then says that it has found none.
    """

    friction_coefficient: Coefficient
    cohesion: Coefficient = 0.0
    cap: Coefficient = float("inf")
    stresses = ("cohesion", "cap")
    may_be_infinite = ("cap",)

    def __post_init__(self) -> None:
        super().__post_init__()
        if not (callable(self.cap) or callable(self.cohesion)) and np.any(self.cap < np.asarray(self.cohesion)):
            raise InputError(
                f"cap = {np.min(self.cap):g} lies below cohesion = {np.max(self.cohesion):g}; "
                "the cap bounds cohesion and friction together, so give cap >= cohesion"
            )

    @property
    def is_frictionless(self) -> bool:
        """Whether friction coefficient and cohesion are zero, or the cap is."""
        return is_zero(self.cap) or (is_zero(self.friction_coefficient) and is_zero(self.cohesion))

    def bound(self, sigma_n: FloatArray) -> FloatArray:
        """Return ``min(c + s |sigma_n|, tau_max)``."""
        return np.minimum(self._uncapped(sigma_n), numbers_of("cap", self.cap))

    def bound_derivative(self, sigma_n: FloatArray) -> FloatArray:
        """Return ``-s`` below the cap and zero from the cap on (and under tension)."""
        is_rising = (self._uncapped(sigma_n) < numbers_of("cap", self.cap)) & (sigma_n <= 0.0)
        return np.where(is_rising, -np.asarray(numbers_of("friction_coefficient", self.friction_coefficient)), 0.0)

    def _uncapped(self, sigma_n: FloatArray) -> FloatArray:
        s = numbers_of("friction_coefficient", self.friction_coefficient)
        return np.asarray(numbers_of("cohesion", self.cohesion) + s * np.maximum(-sigma_n, 0.0))


@dataclass(frozen=True, eq=False)
class SlipWeakening(LawOfCoefficients):
    """Coulomb friction that falls with the slip: ``s = s_k + (s_s - s_k) max(1 - d / D, 0)`` [Ida1972].

    Parameters
    ----------
    static_friction, kinetic_friction : Coefficient [-]
        s_s at rest, and s_k, not above it, after the slip D.
    slip_distance : Coefficient [m]
        D, positive. The slip d is the length of the path since the beginning of the load history.
    """

    static_friction: Coefficient
    kinetic_friction: Coefficient
    slip_distance: Coefficient

    def __post_init__(self) -> None:
        super().__post_init__()
        distance, first, last = self.slip_distance, self.static_friction, self.kinetic_friction
        if not callable(distance) and np.min(distance) <= 0.0:
            raise InputError(f"slip_distance = {np.min(distance):g}: give a positive length")
        if not (callable(first) or callable(last)) and np.any(np.subtract(last, first) > 0.0):
            raise InputError(
                f"kinetic_friction = {np.max(last):g} lies above static_friction = {np.min(first):g}; friction that "
                "falls with the slip begins with the larger one"
            )

    @property
    def is_frictionless(self) -> bool:
        """Whether there is no friction even at rest."""
        return is_zero(self.static_friction)

    @property
    def needs_history(self) -> bool:
        """True: friction falls with the slip."""
        return True

    def at_slip(self, motion: SlipHistory) -> FrictionLaw:
        """Return Coulomb's law with the coefficients that the slip has left."""
        first, last = (numbers_of(name, getattr(self, name)) for name in ("static_friction", "kinetic_friction"))
        share = np.maximum(1.0 - motion.slip / numbers_of("slip_distance", self.slip_distance), 0.0)
        return Coulomb(last + (np.asarray(first) - last) * share)

    def bound(self, sigma_n: FloatArray) -> FloatArray:
        """Return that of Coulomb's law before any slip; `at_slip` gives the law of a load step."""
        return Coulomb(self.static_friction).bound(sigma_n)

    def bound_derivative(self, sigma_n: FloatArray) -> FloatArray:
        """Return that of Coulomb's law before any slip; `at_slip` gives the law of a load step."""
        return Coulomb(self.static_friction).bound_derivative(sigma_n)


@dataclass(frozen=True, eq=False)
class RateStrengthening(LawOfCoefficients):
    """Coulomb friction that grows with the speed of slip: ``s = s_0 + a log(1 + v / v_0)``.

    Parameters
    ----------
    friction_coefficient : Coefficient [-]
        s_0, of slow slip.
    rate_coefficient : Coefficient [-]
        a, not negative.
    reference_rate : Coefficient [m/s]
        v_0, positive.

    Notes
    -----
    The direct effect of rate-and-state friction [Dieterich1979], regularised at rest.
    """

    friction_coefficient: Coefficient
    rate_coefficient: Coefficient
    reference_rate: Coefficient

    def __post_init__(self) -> None:
        super().__post_init__()
        rate = self.reference_rate
        if not callable(rate) and np.min(rate) <= 0.0:
            raise InputError(f"reference_rate = {np.min(rate):g}: give a positive speed")

    @property
    def needs_history(self) -> bool:
        """True: friction depends on the speed of slip."""
        return True

    def at_slip(self, motion: SlipHistory) -> FrictionLaw:
        """Return Coulomb's law with the coefficients at the speeds of slip."""
        slow, a, v_0 = (numbers_of(name, value) for name, value in self.coefficients.items())
        return Coulomb(slow + a * np.log1p(motion.rate / v_0))

    def bound(self, sigma_n: FloatArray) -> FloatArray:
        """Return that of Coulomb's law under slow slip; `at_slip` gives the law of a load step."""
        return Coulomb(self.friction_coefficient).bound(sigma_n)

    def bound_derivative(self, sigma_n: FloatArray) -> FloatArray:
        """Return that of Coulomb's law under slow slip; `at_slip` gives the law of a load step."""
        return Coulomb(self.friction_coefficient).bound_derivative(sigma_n)


@dataclass(frozen=True, eq=False)
class PiecewiseLaw(FrictionLaw):
    """Different laws at different contact nodes.

    Parameters
    ----------
    laws : sequence of FrictionLaw
        Each sees the tractions of its own nodes only.
    nodes : sequence of (m,) int arrays
        The contact nodes of each law; together every contact node exactly once.

    Raises
    ------
    ValueError
        If a node is missing or has two laws.
    """

    laws: Sequence[FrictionLaw]
    nodes: Sequence[IntArray]

    def __post_init__(self) -> None:
        numbers = np.sort(np.concatenate(list(self.nodes)))
        if len(self.laws) != len(self.nodes) or not np.array_equal(numbers, np.arange(numbers.size)):
            raise InputError(f"nodes = {self.nodes}; give every contact node to exactly one of {len(self.laws)} laws")

    @property
    def is_frictionless(self) -> bool:
        """Whether all laws are frictionless."""
        return all(law.is_frictionless for law in self.laws)

    @property
    def needs_history(self) -> bool:
        """Whether one of the laws needs a history."""
        return any(law.needs_history for law in self.laws)

    def at_slip(self, motion: SlipHistory) -> PiecewiseLaw:
        """Return the laws for one load step."""
        return PiecewiseLaw([law.at_slip(motion.of(nodes)) for law, nodes in self._pairs], self.nodes)

    @cached_property
    def acts_across_gap(self) -> BoolArray:
        """(n_contact,) bool array: as of the law of each node."""
        values = [np.broadcast_to(law.acts_across_gap, nodes.shape) for law, nodes in self._pairs]
        return self._assembled(values).astype(bool)

    def bound(self, sigma_n: FloatArray) -> FloatArray:
        """Return the bound by the law of each node."""
        return self._assembled([law.bound(sigma_n[nodes]) for law, nodes in self._pairs])

    def bound_derivative(self, sigma_n: FloatArray) -> FloatArray:
        """Return the derivative by the law of each node."""
        return self._assembled([law.bound_derivative(sigma_n[nodes]) for law, nodes in self._pairs])

    def scaled(self, stress_scale: float) -> PiecewiseLaw:
        """Return the laws in units of `stress_scale`."""
        return PiecewiseLaw([law.scaled(stress_scale) for law in self.laws], self.nodes)

    @property
    def _pairs(self) -> list[tuple[FrictionLaw, IntArray]]:
        return list(zip(self.laws, self.nodes, strict=True))

    def _assembled(self, values: Sequence[FloatArray | BoolArray]) -> FloatArray:
        result = np.empty(sum(nodes.size for nodes in self.nodes))
        for value, (_, nodes) in zip(values, self._pairs, strict=True):
            result[nodes] = value
        return result


def law_name(law: FrictionLaw) -> str:
    """Return the class name of a law for messages: the original of a rescaled law, all names of several laws."""
    if isinstance(law, RescaledLaw):
        return law_name(law.law)
    if isinstance(law, PiecewiseLaw):
        return " or ".join(dict.fromkeys(law_name(part) for part in law.laws))
    return type(law).__name__
