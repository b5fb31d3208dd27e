"""Frictionless contact along one smooth zone, symmetric about its middle, to round-off.

The pressure is sqrt(1 - (x/a)^2) times a sum of even Chebyshev polynomials, and the contact condition is an integral
equation for their coefficients. It shares no code with the boundary elements that it verifies.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from bemkit.arrays import FloatArray
from bemkit.geometry.quadrature import gauss_legendre

Kernel = Callable[[FloatArray], FloatArray]
"""Displacement at a distance (signed) from a unit line force; may have a logarithm or a jump at zero."""

N_TERMS = 24
"""Coefficients. On a straight boundary a dozen leave round-off; a curved one makes the pressure less smooth, and the
error then falls like the fourth power of their number."""
_N_PANELS = 36
"""Number of intervals on either side of a point, each half as long as the one before it towards the point."""
_N_POINTS = 10


@dataclass(frozen=True, eq=False)
class EvenPressure:
    """A pressure on |x| < a.

    Parameters
    ----------
    half_width : float [m]
        a, along the boundary.
    coefficients : (n_terms,) array [Pa]
        Of the even Chebyshev polynomials T_0, T_2, ...
    """

    half_width: float
    coefficients: FloatArray

    def at(self, x: FloatArray) -> FloatArray:
        """Return the pressure [Pa] at places [m], zero outside of the zone."""
        inside = np.clip(np.asarray(x) / self.half_width, -1.0, 1.0)
        return np.asarray(np.sqrt(1.0 - inside**2) * self._polynomial(inside))

    def integral(self, weight: Callable[[FloatArray], FloatArray]) -> float:
        """Integrate the pressure times a smooth function over the zone [N/m for the function 1]."""
        step = np.pi / 200  # the midpoint rule in the angle
        angle = (np.arange(200) - 99.5) * step
        x = self.half_width * np.sin(angle)
        return float(np.sum(self.at(x) * weight(x) * np.cos(angle))) * self.half_width * step

    def displacement(self, kernel: Kernel, x: FloatArray) -> FloatArray:
        """Return the displacements [m] that it causes at places [m] through a kernel."""
        places, weights = _rule(kernel, self.half_width, np.asarray(x))
        return np.asarray(np.sum(weights * self._polynomial(places), axis=1))

    def _polynomial(self, x: FloatArray) -> FloatArray:
        """Evaluate the sum of T_2j(x) = T_j(2 x^2 - 1)."""
        return np.asarray(np.polynomial.chebyshev.chebval(2.0 * x**2 - 1.0, self.coefficients))


def solve_pressure(
    kernel: Kernel,
    half_width: float,
    unknown: Callable[[FloatArray], FloatArray],
    given: Callable[[FloatArray], FloatArray],
    n_terms: int = N_TERMS,
) -> tuple[EvenPressure, float]:
    """Find the pressure p on a zone and the size c of one more field, an even function of the place.

    Solves ``integral of kernel(x - y) p(y) dy + c unknown(x) = given(x)`` at the zeros of a Chebyshev polynomial; p has
    `n_terms` coefficients on a zone of a half-width [m].
    """
    n = n_terms
    x = half_width * np.cos((np.arange(n + 1) + 0.5) * np.pi / (2 * n + 2))
    places, weights = _rule(kernel, half_width, x)
    even_chebyshev = np.polynomial.chebyshev.chebvander(2.0 * places**2 - 1.0, n - 1)
    system = np.column_stack([np.einsum("pq,pqn->pn", weights, even_chebyshev), unknown(x)])
    solution = np.asarray(np.linalg.solve(system, given(x)), dtype=np.float64)
    return EvenPressure(half_width, solution[:n]), float(solution[n])


def half_width_for(load: float, load_of: Callable[[float], float], near: float) -> float:
    """Find the half-width [m] of contact under a load, which grows with it, from a first guess."""
    from scipy.optimize import brentq

    low = high = near
    while load_of(low) > load:
        low /= 1.1
    while load_of(high) < load:
        high *= 1.1
    return float(brentq(lambda a: load_of(a) - load, low, high, xtol=1e-15, rtol=1e-14))


def places_along(length: float, ends: tuple[float, ...]) -> tuple[FloatArray, FloatArray]:
    """Return places on (0, length) and their weights [m], crowded at both sides of given points in it."""
    cuts = [0.0, *ends, length]
    fractions, weights = _graded_rule(11, 6)
    places, lengths = [], []
    for begin, end in pairwise(cuts):
        half = 0.5 * (end - begin)
        places += [begin + half * fractions, (end - half * fractions)[::-1]]
        lengths += [half * weights, half * weights[::-1]]
    return np.concatenate(places), np.concatenate(lengths)


def _graded_rule(n_panels: int, n_points: int) -> tuple[FloatArray, FloatArray]:
    """Gauss points and weights on (0, 1), on intervals each half as long as the next one towards zero."""
    xi, weights = gauss_legendre(n_points)
    edges: FloatArray = np.concatenate([[0.0], 0.5 ** np.arange(n_panels - 1, -1, -1)])
    half: FloatArray = 0.5 * np.diff(edges)[:, None]
    return (edges[:-1, None] + half * (1.0 + xi)).ravel(), (half * weights).ravel()


def _rule(kernel: Kernel, half_width: float, x: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return places y / a and weights (n_points, n_places) that integrate kernel(x - y) sqrt(1 - (y/a)^2) over a zone.

    With y = a sin(phi) the integrand is smooth except for the kernel at the point itself, towards which intervals are
    graded.
    """
    fraction, weight = _graded_rule(_N_PANELS, _N_POINTS)
    angles = np.arcsin(np.clip(x / half_width, -1.0, 1.0))[:, None]
    places, weights = [], []
    for end in (-0.5 * np.pi, 0.5 * np.pi):
        turn = (end - angles) * fraction
        # from the own place on, so that short distances keep their digits
        distance = half_width * (2.0 * np.sin(0.5 * turn) * np.cos(angles + 0.5 * turn) + np.sin(angles)) - x[:, None]
        is_apart = distance != 0.0
        values = np.where(is_apart, kernel(np.where(is_apart, -distance, half_width)), 0.0)
        places.append(np.sin(angles + turn))
        weights.append(np.abs(end - angles) * weight * values * half_width * np.cos(angles + turn) ** 2)
    return np.concatenate(places, axis=1), np.concatenate(weights, axis=1)
