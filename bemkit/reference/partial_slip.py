"""Pressed and then sheared contacts in partial slip: Cattaneo and Mindlin, and Ciavarella and Jaeger for any zone.

Valid where normal and tangential contact do not influence each other: two bodies alike in elasticity, or an
incompressible one on a rigid one. The load is applied in two steps, under the incremental law: pressed first, then
sheared at constant pressing force. Friction that is judged by the whole displacement in one step gives other answers.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bemkit.arrays import FloatArray
from bemkit.errors import InputError
from bemkit.reference.hertz import HertzLine, LineContact, check_positive


@dataclass(frozen=True)
class PartialSlip:
    """A line contact that is sheared.

    Parameters
    ----------
    contact : LineContact
        Under its pressing force P.
    tangential_load : float [N/m]
        Q, positive along x, less than friction times P.
    friction : float [-]

    Raises
    ------
    InputError
        If the contact slides as a whole.

    Notes
    -----
    q(x) = s (p(x; P) - p(x; P - Q / s)): of the pressure of the zone less that of the zone which sticks. For cylinders
    c / a = sqrt(1 - Q / (s P)).

    References
    ----------
    [Cattaneo1938], [Mindlin1949]; [Jaeger1998] and [Ciavarella1998] for any zone.
    """

    contact: LineContact
    tangential_load: float
    friction: float

    def __post_init__(self) -> None:
        check_positive(tangential_load=self.tangential_load, friction=self.friction)
        most = self.friction * self.contact.load
        if self.tangential_load >= most:
            raise InputError(f"tangential_load is {self.tangential_load}: all slides from {most:g} on: give less")

    @property
    def sticking(self) -> LineContact:
        """The same bodies under the load P - Q / s, whose zone is the one that sticks."""
        return self.contact.under(self.contact.load - self.tangential_load / self.friction)

    @property
    def stick_half_width(self) -> float:
        """C [m]: what sticks is -c < x < c."""
        return self.sticking.half_width

    def traction(self, x: FloatArray) -> FloatArray:
        """Return the tangential traction [Pa] on the body that is pushed back, along x and positive."""
        return np.asarray(self.friction * (self.contact.pressure(x) - self.sticking.pressure(x)))


def hertz_slip(sheared: PartialSlip, x: FloatArray) -> FloatArray:
    """Return the relative slip [m] of two sheared cylinders, positive, zero where they stick; nan outside of the zone.

    s p0 / (E* a) (|x| sqrt(x^2 - c^2) - c^2 arcosh(|x| / c)), the integral of the difference of the surface strains.

    Raises
    ------
    InputError
        If the contact is not that of cylinders.
    """
    contact = sheared.contact
    if not isinstance(contact, HertzLine):
        raise InputError(f"contact is a {type(contact).__name__}: this slip is that of a HertzLine")
    a, c = contact.half_width, sheared.stick_half_width
    distance = np.abs(np.asarray(x, dtype=float))
    ratio = np.maximum(distance / c, 1.0)
    shape = c**2 * (ratio * np.sqrt(ratio**2 - 1.0) - np.arccosh(ratio))
    slip = sheared.friction * contact.peak_pressure / (contact.modulus * a) * shape
    return np.asarray(np.where(distance <= a, slip, np.nan))
