"""Friction that depends on how far or how fast nodes slip: Coulomb's law whose coefficient changes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bemkit.arrays import FloatArray
from bemkit.contact.body import SlipHistory
from bemkit.contact.coefficients import Coefficient, is_zero, numbers_of
from bemkit.contact.laws import Coulomb, FrictionLaw, LawOfCoefficients
from bemkit.errors import InputError


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
        """Return that before any slip."""
        return Coulomb(self.static_friction).bound(sigma_n)

    def bound_derivative(self, sigma_n: FloatArray) -> FloatArray:
        """Return that before any slip."""
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
        """Return that of slow slip."""
        return Coulomb(self.friction_coefficient).bound(sigma_n)

    def bound_derivative(self, sigma_n: FloatArray) -> FloatArray:
        """Return that of slow slip."""
        return Coulomb(self.friction_coefficient).bound_derivative(sigma_n)
