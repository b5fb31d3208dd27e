"""Further friction laws: cohesion and a cap, dependence on slip or slip rate, and different laws at different nodes."""

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
        c, not negative; acts only at closed nodes.
    cap : Coefficient [Pa]
        tau_max, not below the cohesion; infinite by default.

    Notes
    -----
    Cohesion drops to zero when a node opens. So a problem with ``c > 0`` and a moving contact edge may have no
    solution; the status of the solver then reports that it found none.
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
                f"cap = {np.min(self.cap):g} is less than cohesion = {np.max(self.cohesion):g}; "
                "the cap bounds the sum of cohesion and friction, so give cap >= cohesion"
            )

    @property
    def is_frictionless(self) -> bool:
        """Whether friction coefficient and cohesion are zero, or the cap is zero."""
        return is_zero(self.cap) or (is_zero(self.friction_coefficient) and is_zero(self.cohesion))

    def bound(self, sigma_n: FloatArray) -> FloatArray:
        """Return ``min(c + s |sigma_n|, tau_max)``."""
        return np.minimum(self._uncapped(sigma_n), numbers_of("cap", self.cap))

    def bound_derivative(self, sigma_n: FloatArray) -> FloatArray:
        """Return ``-s`` below the cap, and zero at the cap and under tension."""
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
        s_s at rest, and s_k <= s_s after the slip D.
    slip_distance : Coefficient [m]
        D, positive. The slip d is accumulated from the beginning of the load history.
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
                f"kinetic_friction = {np.max(last):g} is larger than static_friction = {np.min(first):g}; friction "
                "decreases with slip, so give kinetic_friction <= static_friction"
            )

    @property
    def is_frictionless(self) -> bool:
        """Whether the static friction is zero."""
        return is_zero(self.static_friction)

    @property
    def needs_history(self) -> bool:
        """True: friction decreases with slip."""
        return True

    def at_slip(self, motion: SlipHistory) -> FrictionLaw:
        """Return Coulomb's law with the coefficients at the present slip."""
        first, last = (numbers_of(name, getattr(self, name)) for name in ("static_friction", "kinetic_friction"))
        share = np.maximum(1.0 - motion.slip / numbers_of("slip_distance", self.slip_distance), 0.0)
        return Coulomb(last + (np.asarray(first) - last) * share)

    def bound(self, sigma_n: FloatArray) -> FloatArray:
        """Return the value without slip; `at_slip` gives the law of a load step."""
        return Coulomb(self.static_friction).bound(sigma_n)

    def bound_derivative(self, sigma_n: FloatArray) -> FloatArray:
        """Return the value without slip; `at_slip` gives the law of a load step."""
        return Coulomb(self.static_friction).bound_derivative(sigma_n)


@dataclass(frozen=True, eq=False)
class RateStrengthening(LawOfCoefficients):
    """Coulomb friction that increases with the slip rate: ``s = s_0 + a log(1 + v / v_0)``.

    Parameters
    ----------
    friction_coefficient : Coefficient [-]
        s_0, for slow slip.
    rate_coefficient : Coefficient [-]
        a, not negative.
    reference_rate : Coefficient [m/s]
        v_0, positive.

    Notes
    -----
    This is the direct effect of rate-and-state friction [Dieterich1979], regularised at rest.
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
        """True: friction depends on the slip rate."""
        return True

    def at_slip(self, motion: SlipHistory) -> FrictionLaw:
        """Return Coulomb's law with the coefficients at the present slip rate."""
        slow, a, v_0 = (numbers_of(name, value) for name, value in self.coefficients.items())
        return Coulomb(slow + a * np.log1p(motion.rate / v_0))

    def bound(self, sigma_n: FloatArray) -> FloatArray:
        """Return the value for slow slip; `at_slip` gives the law of a load step."""
        return Coulomb(self.friction_coefficient).bound(sigma_n)

    def bound_derivative(self, sigma_n: FloatArray) -> FloatArray:
        """Return the value for slow slip; `at_slip` gives the law of a load step."""
        return Coulomb(self.friction_coefficient).bound_derivative(sigma_n)


@dataclass(frozen=True, eq=False)
class PiecewiseLaw(FrictionLaw):
    """Different laws at different contact nodes.

    Parameters
    ----------
    laws : sequence of FrictionLaw
        Each law is called with the tractions of its nodes.
    nodes : sequence of (m,) int arrays
        The contact nodes of each law; each contact node has exactly one law.

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
        """Whether a law depends on the history."""
        return any(law.needs_history for law in self.laws)

    def at_slip(self, motion: SlipHistory) -> PiecewiseLaw:
        """Return the laws for one load step."""
        return PiecewiseLaw([law.at_slip(motion.of(nodes)) for law, nodes in self._pairs], self.nodes)

    @cached_property
    def acts_across_gap(self) -> BoolArray:
        """(n_contact,) bool array: property of the law of each node."""
        values = [np.broadcast_to(law.acts_across_gap, nodes.shape) for law, nodes in self._pairs]
        return self._assembled(values).astype(bool)

    def bound(self, sigma_n: FloatArray) -> FloatArray:
        """Return the bound of the law of each node."""
        return self._assembled([law.bound(sigma_n[nodes]) for law, nodes in self._pairs])

    def bound_derivative(self, sigma_n: FloatArray) -> FloatArray:
        """Return the derivative of the law of each node."""
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
    """Return the class name of a law for messages; for rescaled laws that of the original, for several laws all."""
    if isinstance(law, RescaledLaw):
        return law_name(law.law)
    if isinstance(law, PiecewiseLaw):
        return " or ".join(dict.fromkeys(law_name(part) for part in law.laws))
    return type(law).__name__
