"""Exponents of the fields at a corner of a body from the conditions on its two sides, after [Williams1952].

Near a corner displacements without loads are sums of r^lambda times functions of the angle theta. With Airy's function
r^(lambda + 1) F(theta), where F combines cosines and sines of (lambda + 1) theta and (lambda - 1) theta, the four
conditions on the two sides leave a solution for the roots lambda of a determinant of order four. Tractions behave like
r^(lambda - 1): they have no bound if a root has a real part between 0 and 1. Friction makes the conditions of a side
that slides depend on the direction of slip.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from bemkit.arrays import ComplexArray, read_only

_STARTS = np.append(np.arange(0.08, 0.9, 0.12), (0.93, 0.975, 0.995))[:, None] + 1j * np.array([0.0, 0.07, 0.2, 0.5])
"""Start values of the search for roots: oscillating fields have imaginary parts below 1/2."""
_MOST_STEPS, _LONGEST_STEP = 25, 0.15
_DIFFERENCE = 1e-6
_IS_ROOT = 1e-8
"""Length of the last step at a root."""
_MARGIN = 1e-6
"""Real parts closer to 0 or 1 are those of rigid motions and of uniform stresses."""
# of cos (lambda + 1) theta, sin (lambda + 1) theta, cos (lambda - 1) theta, sin (lambda - 1) theta
_SHIFTS = read_only(np.array([1.0, 1.0, -1.0, -1.0]))
_IS_COSINE = read_only(np.array([True, False, True, False]))


@dataclass(frozen=True)
class WedgeSide:
    """Conditions on one side of a corner: in each direction the displacement or the traction is given.

    Parameters
    ----------
    holds_normal, holds_tangent : bool
        Whether the displacement along the normal and along the tangent is given. Neither is on a free or loaded side,
        both are on a clamped or sticking one, that along the normal is on a roller and where a contact slides.
    friction : float
        Of a side that slides: the tangential traction is ``friction * sigma_n``, both along the anticlockwise tangent
        and the outward normal. For Coulomb's law the friction coefficient times the sign of the slip.
    """

    holds_normal: bool = False
    holds_tangent: bool = False
    friction: float = 0.0


FREE, ROLLER, HELD = WedgeSide(), WedgeSide(holds_normal=True), WedgeSide(holds_normal=True, holds_tangent=True)
"""A free or loaded side, one that slides without friction, and a clamped or sticking one."""


@lru_cache(maxsize=256)
def leading_exponent(angle: float, outgoing: WedgeSide, incoming: WedgeSide, kappa: float) -> float | None:
    """Return the exponent of the displacements if tractions are singular like a power of the distance.

    Parameters
    ----------
    angle : float [rad]
        Of the body at the corner, between 0 and 2 pi; pi where its boundary goes straight on.
    outgoing, incoming : WedgeSide
        The sides that start and end at the corner, with the body on their left.
    kappa : float
        Kolosov's constant of the material.

    Returns
    -------
    float or None
        The smallest real part of all roots lambda between 0 and 1. None if there is none: tractions are then bounded,
        or logarithmic where loads jump. Roots within 0.005 of 1, nearly regular, may be missed.
    """

    def conditions(exponent: ComplexArray) -> ComplexArray:
        at_start, at_end = (_Fields.at(exponent, theta, kappa) for theta in (0.0, angle))
        return np.concatenate([at_start.conditions(outgoing), at_end.conditions(incoming)], axis=1)

    return _smallest_root(conditions)


@dataclass(frozen=True)
class JoinedWedge:
    """One of two bodies that meet at a corner.

    Parameters
    ----------
    angle : float [rad]
        Of the body at the corner.
    kappa : float
        Kolosov's constant of the material.
    stiffness : float
        Shear modulus, in any unit that both bodies share.
    other_side : WedgeSide
        The side that does not touch the other body.
    """

    angle: float
    kappa: float
    stiffness: float
    other_side: WedgeSide = FREE


@lru_cache(maxsize=256)
def joined_exponent(first: JoinedWedge, second: JoinedWedge, contact: WedgeSide) -> float | None:
    """Return the exponent of the displacements at a corner where two elastic bodies touch along one side of each.

    The bodies stick and form one wedge of two materials, or slide on each other.

    Parameters
    ----------
    first, second : JoinedWedge
        Anticlockwise about the corner: the touching side of the first one ends there, that of the second one starts.
    contact : WedgeSide
        `HELD` where they stick. Where they slide, `friction` is the friction coefficient times the sign of the slip of
        either body against the other along its own tangent, which is the same.

    Returns
    -------
    float or None
        As for `leading_exponent`.
    """

    def conditions(exponent: ComplexArray) -> ComplexArray:
        start, of_first = (_Fields.at(exponent, theta, first.kappa) for theta in (0.0, first.angle))
        of_second, end = (_Fields.at(exponent, theta, second.kappa) for theta in (0.0, second.angle))
        outer, nothing = start.conditions(first.other_side), np.zeros((exponent.size, 2, 4))
        inner = of_first.joined(of_second, first.stiffness / second.stiffness, contact)
        last = end.conditions(second.other_side)
        rows = [np.concatenate([outer, nothing], axis=2), inner, np.concatenate([nothing, last], axis=2)]
        return np.concatenate(rows, axis=1)

    return _smallest_root(conditions)


class _Fields(NamedTuple):
    """Tractions and displacements along one direction, (n, 4) each, by the coefficients of F.

    With G the part of F of lambda - 1, H its harmonic conjugate: sigma_theta = (lambda + 1) F and sigma_r_theta = -F',
    both over lambda r^(lambda - 1); u_theta = (kappa + 1) H - F' and u_r = (kappa + 1) G - (lambda + 1) F, both over
    r^lambda / (2 mu).
    """

    sigma_theta: ComplexArray
    sigma_r_theta: ComplexArray
    u_theta: ComplexArray
    u_r: ComplexArray

    @classmethod
    def at(cls, exponent: ComplexArray, theta: float, kappa: float) -> _Fields:
        """Return those at an angle [rad]."""
        order = exponent[:, None] + _SHIFTS
        cosine, sine = np.cos(order * theta), np.sin(order * theta)
        function = np.where(_IS_COSINE, cosine, sine)
        slope = order * np.where(_IS_COSINE, -sine, cosine)
        conjugate = np.where(_IS_COSINE, sine, -cosine)
        harmonic = (kappa + 1.0) * (_SHIFTS < 0.0)
        scaled = (exponent[:, None] + 1.0) * function
        return cls(scaled, -slope, harmonic * conjugate - slope, harmonic * function - scaled)

    def conditions(self, side: WedgeSide) -> ComplexArray:
        """Return the two conditions of a side, (n, 2, 4)."""
        normal = self.u_theta if side.holds_normal else self.sigma_theta
        tangent = self.u_r if side.holds_tangent else self.sliding(side)
        return np.stack([normal, tangent], axis=1)

    def sliding(self, side: WedgeSide) -> ComplexArray:
        """Return the condition on the shear of a side that slides."""
        return side.friction * self.sigma_theta + self.sigma_r_theta

    def joined(self, other: _Fields, softness: float, side: WedgeSide) -> ComplexArray:
        """Return the four conditions between two bodies, (n, 4, 8); `softness` is that of the other relative to this.

        Equal normal tractions and displacements, and the same along the tangent, or friction on either body.
        """
        rows = [(self.sigma_theta, -other.sigma_theta), (self.u_theta, -softness * other.u_theta)]
        if side.holds_tangent:
            rows += [(self.sigma_r_theta, -other.sigma_r_theta), (self.u_r, -softness * other.u_r)]
        else:
            nothing = np.zeros_like(self.u_r)
            rows += [(self.sliding(side), nothing), (nothing, other.sliding(side))]
        return np.stack([np.concatenate(row, axis=1) for row in rows], axis=1)


def _smallest_root(conditions: Callable[[ComplexArray], ComplexArray]) -> float | None:
    """Return the smallest real part between 0 and 1 of all roots of the determinant of (n, 4 m, 4 m) conditions."""

    def determinant(exponent: ComplexArray) -> ComplexArray:
        matrices = conditions(exponent)
        # less the roots of the functions themselves, which at 0 and 1 do not differ
        scale = (exponent * (exponent - 1.0)) ** (matrices.shape[1] // 4)
        return np.asarray(np.linalg.det(matrices) / scale)

    roots = _roots_near(determinant, _STARTS.ravel())
    between = roots.real[(roots.real > _MARGIN) & (roots.real < 1.0 - _MARGIN)]
    return float(between.min()) if between.size else None


def _roots_near(function: Callable[[ComplexArray], ComplexArray], starts: ComplexArray) -> ComplexArray:
    """Return the roots that Newton's method finds from some starts."""
    points: ComplexArray = starts.astype(np.complex128)
    step = np.zeros_like(points)
    with np.errstate(all="ignore"):  # what leaves the region finds nothing
        for _ in range(_MOST_STEPS):
            around = np.concatenate([points, points + _DIFFERENCE, points - _DIFFERENCE])
            values, after, before = np.split(function(around), 3)
            step = values * (2.0 * _DIFFERENCE) / (after - before)
            step *= np.minimum(1.0, _LONGEST_STEP / np.maximum(np.abs(step), _IS_ROOT))
            points = points - step
    return points[np.abs(step) < _IS_ROOT]
