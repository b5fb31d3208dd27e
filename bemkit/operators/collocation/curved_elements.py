"""Displacements that constant and linear densities on elements of any shape cause anywhere, by quadrature.

Far from an element a Gauss rule on its arc serves, with few points many half lengths away; near it the integrals are
closed forms (`CollocationPoints`). With y on the arc, rho = x - y, f the density and dy = tangent ds:

    U f p = A sum f [(1/2 - kappa log|rho / r0|) p + (rho / conj(rho)) conj(p) / 2] ds,      A = 1 / (8 pi mu (1 - nu))
    T f v = B sum [(2 - 2 nu) Im - i (1 - 2 nu) Re](f dy / rho) v + B sum (rho / conj(rho)) Im(dy / rho) conj(f v),

where f is real in the first and B = 1 / (4 pi (1 - nu)); the slope s means the density s p(t), p the polynomial of
the element (`bemkit.operators.integrals.curved_panels`).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from bemkit.arrays import BoolArray, ComplexArray, FloatArray, IntArray
from bemkit.geometry.quadrature import gauss_legendre
from bemkit.operators import kernels
from bemkit.operators.collocation.layers import Constants
from bemkit.operators.integrals import curved_panels
from bemkit.operators.integrals.inner import inner_integrals, inner_on_element, store
from bemkit.operators.integrals.pairs import Degrees, Inner
from bemkit.operators.integrals.panels import Panels
from bemkit.operators.material import Material

CURVED_DISTANCE = 4.5
"""Curved elements farther than this take a Gauss rule; the distance is measured in the parameter (`Panels.reach`)."""
CURVED_POINTS = 8
"""Points of that rule: its error is about (4.5 + sqrt(4.5^2 - 1))^-16, below 1e-15."""
_FAR, _FEW_POINTS = 30.0, 4
"""From so many half lengths on so few points do: their error is about (2 * 30)^-8, below 1e-14."""


class _Rule(NamedTuple):
    """Points y, steps dy and places p on all elements, (n_elements, n_points) complex arrays."""

    y: ComplexArray
    dy: ComplexArray
    p: ComplexArray


@dataclass(frozen=True, eq=False)
class CurvedElements:
    """Elements in the order of a tree.

    Parameters
    ----------
    constants : Constants
    points : CollocationPoints
        Of the mesh.
    order : (n_elements,) array
        The element of the mesh at each place.
    near, far : (n_elements,) arrays [m]
        Distances from the middle within which no Gauss rule serves, and from which on the smaller one does.
    rule, small_rule : _Rule
        By place.
    """

    constants: Constants
    points: CollocationPoints
    order: IntArray
    near: FloatArray
    far: FloatArray
    rule: _Rule
    small_rule: _Rule

    @classmethod
    def of(cls, panels: Panels, material: Material, order: IntArray, log_length: float) -> CurvedElements:
        """Return the elements of a mesh."""
        constants, points = Constants.of(material, log_length), CollocationPoints(panels, material, log_length)
        near, far = ((panels.half * panels.reach(distance))[order] for distance in (CURVED_DISTANCE, _FAR))
        rules = (_rule(panels, order, n_points) for n_points in (CURVED_POINTS, _FEW_POINTS))
        return cls(constants, points, order, near, far, *rules)

    def factors(self, is_double: bool, x: ComplexArray, places: IntArray, elements: IntArray) -> ComplexArray:
        """Return the factors (n, 2 or 4, n_points) of the densities on some elements; see `layers.straight_factors`.

        Parameters
        ----------
        is_double : bool
        x : (n_points,) complex array
        places : (n_points,) array
            The element in whose middle the point is, or another number; there T is a principal value.
        elements : (n,) array
            By place.
        """
        panels, numbers = self.points.panels, self.order[elements]
        distance = np.abs(x - panels.centre[numbers][:, None])
        is_far = distance.min(axis=1, initial=np.inf) > self.far[elements]
        result = np.empty((elements.size, 4 if is_double else 2, x.size), complex)
        for some, rule in ((np.flatnonzero(~is_far), self.rule), (np.flatnonzero(is_far), self.small_rule)):
            with np.errstate(all="ignore"):  # close pairs may overflow here; they are replaced
                arcs = _Rule(*(of[elements[some]] for of in rule))
                result[some] = _gauss_layer(self.constants, is_double, x, arcs)
        element, point = np.nonzero(distance < self.near[elements][:, None])
        if element.size:
            exact = self.points.at(x[point], numbers[element], places[point] == elements[element])
            result[element, :, point] = (exact[[2, 4, 3, 5]] if is_double else exact[:2]).T
        return result


def _rule(panels: Panels, order: IntArray, n_points: int) -> _Rule:
    """Return the Gauss rule on arcs."""
    polynomials, scale = panels.polynomials(order), (panels.half * panels.tangent)[order]
    slopes = curved_panels.derivative(polynomials)
    y, dy, p = np.empty((3, order.size, n_points), complex)
    for k, (t, weight) in enumerate(zip(*gauss_legendre(n_points), strict=True)):
        place = np.full(order.size, t + 0j)
        p[:, k] = curved_panels.evaluate(polynomials, place)
        y[:, k] = panels.centre[order] + scale * p[:, k]
        dy[:, k] = weight * scale * curved_panels.evaluate(slopes, place)
    return _Rule(y, dy, p)


def _gauss_layer(constants: Constants, is_double: bool, x: ComplexArray, rule: _Rule) -> ComplexArray:
    """Return the factors of the densities by a Gauss rule."""
    nu = constants.poisson_ratio
    result = np.zeros((len(rule.y), 4 if is_double else 2, x.size), complex)
    for y, dy, p in zip(rule.y.T[:, :, None], rule.dy.T[:, :, None], rule.p.T[:, :, None], strict=True):
        rho = x - y
        squared = np.square(rho.real) + np.square(rho.imag)
        turn = rho * rho / squared
        if not is_double:
            ds = constants.single * np.abs(dy)
            result[:, 0] += ds * (0.5 - (1.5 - 2.0 * nu) * np.log(squared / constants.log_length**2))
            result[:, 1] += (0.5 * ds) * turn
            continue
        rate = dy * rho.conj() / squared
        of_density = constants.double * ((2.0 - 2.0 * nu) * rate.imag - 1j * (1.0 - 2.0 * nu) * rate.real)
        of_conjugate = constants.double * turn * rate.imag
        result[:, 0] += of_density
        result[:, 1] += p * of_density
        result[:, 2] += of_conjugate
        result[:, 3] += p.conj() * of_conjugate
    return result


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
