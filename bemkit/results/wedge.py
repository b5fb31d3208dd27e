"""How fast fields grow towards a corner of a body, by what is given on its two sides, after [Williams1952].

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
    """Return the exponent of the displacements where tractions grow without bound like a power of the distance.

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
        The smallest real part of all roots lambda between 0 and 1; None if there is none, so that tractions stay
        bounded but for logarithms where loads jump. Roots closer to 1 than 0.005, which hardly let anything grow, may
        be missed.
    """

    def determinant(exponent: ComplexArray) -> ComplexArray:
        rows = (*_conditions(exponent, 0.0, outgoing, kappa), *_conditions(exponent, angle, incoming, kappa))
        # less the roots of the functions themselves, which at 0 and 1 do not differ
        return np.asarray(np.linalg.det(np.stack(rows, axis=-2)) / (exponent * (exponent - 1.0)))

    roots = _roots_near(determinant, _STARTS.ravel())
    between = roots.real[(roots.real > _MARGIN) & (roots.real < 1.0 - _MARGIN)]
    return float(between.min()) if between.size else None


def _conditions(exponent: ComplexArray, theta: float, side: WedgeSide, kappa: float) -> tuple[ComplexArray, ...]:
    """Return the two conditions of a side, (n, 4) each, on the coefficients of F.

    With G the part of F of lambda - 1, H its harmonic conjugate: sigma_theta = (lambda + 1) F and sigma_r_theta = -F',
    both over lambda r^(lambda - 1); u_theta = (kappa + 1) H - F' and u_r = (kappa + 1) G - (lambda + 1) F, both over
    r^lambda / (2 mu).
    """
    order = exponent[:, None] + _SHIFTS
    cosine, sine = np.cos(order * theta), np.sin(order * theta)
    function = np.where(_IS_COSINE, cosine, sine)
    slope = order * np.where(_IS_COSINE, -sine, cosine)
    conjugate = np.where(_IS_COSINE, sine, -cosine)
    harmonic = (kappa + 1.0) * (_SHIFTS < 0.0)
    scaled = (exponent[:, None] + 1.0) * function
    normal = harmonic * conjugate - slope if side.holds_normal else scaled
    tangent = harmonic * function - scaled if side.holds_tangent else side.friction * scaled - slope
    return normal, tangent


def _roots_near(function: Callable[[ComplexArray], ComplexArray], starts: ComplexArray) -> ComplexArray:
    """Return the roots that Newton's method finds from some starts."""
    points: ComplexArray = starts.astype(np.complex128)
    step = np.zeros_like(points)
    with np.errstate(all="ignore"):  # what leaves the region finds nothing
        for _ in range(_MOST_STEPS):
            after, before = function(points + _DIFFERENCE), function(points - _DIFFERENCE)
            step = function(points) * (2.0 * _DIFFERENCE) / (after - before)
            step *= np.minimum(1.0, _LONGEST_STEP / np.maximum(np.abs(step), _IS_ROOT))
            points = points - step
    return points[np.abs(step) < _IS_ROOT]
