"""Factors of constant densities, and of their slopes, at points near elements or in their middle, in closed form."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bemkit.arrays import BoolArray, ComplexArray, FloatArray, IntArray
from bemkit.operators import kernels
from bemkit.operators.integrals.inner import inner_integrals, inner_on_element, store
from bemkit.operators.integrals.pairs import Degrees, Inner
from bemkit.operators.integrals.panels import Panels
from bemkit.operators.material import Material

CURVED_DISTANCE = 4.5
"""Curved elements farther than this take a Gauss rule; the distance is measured in the parameter (`Panels.reach`)."""
CURVED_POINTS = 8
"""Points of that rule: its error is about (4.5 + sqrt(4.5^2 - 1))^-16, below 1e-15."""


@dataclass(frozen=True, eq=False)
class CollocationPoints:
    """Evaluates listed pairs of points and elements, exactly at any distance.

    Parameters
    ----------
    panels : Panels
    material : Material
    r0 : float [m]
        Unit of length of the logarithm.
    """

    panels: Panels
    material: Material
    r0: float

    def at(self, x: ComplexArray, elements: IntArray, is_own: BoolArray) -> ComplexArray:
        """Return the factors (6, n) of p, conj(p), v, conj(v), s and conj(s) for pairs of points and elements.

        Parameters
        ----------
        x : (n,) complex array
        elements : (n,) array
        is_own : (n,) bool array
            Whether the point is the middle of the element.
        """
        result = np.zeros((6, elements.size), complex)
        is_straight = self.panels.is_straight[elements]
        for chosen in (np.flatnonzero(is_straight), np.flatnonzero(~is_straight)):
            if chosen.size:
                result[:, chosen] = self._factors(x[chosen], elements[chosen], is_own[chosen])
        return result

    def _factors(self, x: ComplexArray, elements: IntArray, is_own: BoolArray) -> ComplexArray:
        """Return the factors of pairs whose elements are all straight or all curved."""
        panels, nu, kappa = self.panels, self.material.effective_poisson_ratio, self.material.kappa
        from_start, from_end = x - panels.start[elements], x - panels.end[elements]
        plus, minus = from_start * panels.to_local[elements], from_end * panels.to_local[elements]
        is_straight = bool(panels.is_straight[elements[0]])
        polynomials = panels.polynomials(elements)[: 2 if is_straight else None]
        highest = len(polynomials) - 1
        degrees = Degrees(log=(0, highest - 1), double=(0, highest))
        inner = inner_integrals(panels, degrees, elements, from_start, from_end)
        if is_own.any():
            store(inner, is_own, inner_on_element(panels, degrees, elements[is_own], 0.0))
            if is_straight:
                plus[is_own], minus[is_own] = 1.0, -1.0
        # the shorter arm knows the coordinate across the element better
        eta = np.where(np.abs(plus) < np.abs(minus), plus.imag, minus.imag)
        log_ratio = np.log(np.abs(plus)) - np.log(np.abs(minus))
        # the difference of rho / conj(rho) between the ends, without cancellation
        quotient_change = (plus - minus).real * eta / (plus * minus).conj()
        half, b = panels.half[elements], -1.0 / (4.0 * np.pi * (1.0 - nu))
        a = half / (8.0 * np.pi * self.material.shear_modulus * (1.0 - nu))
        turn, angle, ratio = panels.tangent[elements] ** 2, 0.5 / np.pi, b * (1.0 - 2.0 * nu)
        double, log_moment, quotient_moment = _moments_by_parts(inner, polynomials, plus, minus)
        return np.array(
            [
                a * (1.0 - 2.0 * kappa * np.log(half / self.r0)) - a * kappa * inner.log[0],
                a * turn * (0.5 * inner.quotient[0]),
                angle * inner.double[0] + 1j * ratio * log_ratio,
                b * turn * quotient_change,
                angle * double + 1j * ratio * log_moment,
                b * turn * quotient_moment,
            ]
        )


def _moments_by_parts(
    inner: Inner, polynomials: ComplexArray, plus: ComplexArray, minus: ComplexArray
) -> tuple[FloatArray | ComplexArray, FloatArray | ComplexArray, ComplexArray]:
    """Return the moments from inner integrals and what the end points `plus` and `minus` away give."""
    coefficients = kernels.legendre_of_monomials(len(polynomials) - 1).T @ polynomials
    slopes = np.polynomial.legendre.legder(coefficients)
    signs = (-1.0) ** np.arange(len(coefficients))  # P_k at the start; it is one at the end
    at_start, at_end = signs @ coefficients, coefficients.sum(axis=0)
    double = sum(factor * value for factor, value in zip(coefficients, inner.double, strict=False))
    log_ratio = at_start * np.log(np.abs(plus)) - at_end * np.log(np.abs(minus))
    quotient_change = at_end.conj() * (minus / minus.conj()) - at_start.conj() * (plus / plus.conj())
    for slope, log, quotient in zip(slopes, inner.log, inner.quotient, strict=False):
        log_ratio = log_ratio + slope * log
        quotient_change -= slope.conj() * quotient
    return double, log_ratio, -0.5j * quotient_change
