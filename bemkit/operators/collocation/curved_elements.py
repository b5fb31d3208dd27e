"""Displacements of constant and linear densities on elements of any shape, by quadrature.

Far from an element a Gauss rule on its arc is used, with fewer points at a large distance; near it the integrals are
closed forms (`exact_factors`). With y on the arc, rho = x - y, the density f and dy = tangent ds:

    U f p = A sum f [(1/2 - kappa log|rho / r0|) p + (rho / conj(rho)) conj(p) / 2] ds,      A = 1 / (8 pi mu (1 - nu))
    T f v = B sum [(2 - 2 nu) Im - i (1 - 2 nu) Re](f dy / rho) v + B sum (rho / conj(rho)) Im(dy / rho) conj(f v),

where B = 1 / (4 pi (1 - nu)), and f is real in the first equation. A slope s is the density s p(t) with the polynomial
p of the element (`bemkit.operators.integrals.curved_geometry`).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from bemkit.arrays import BoolArray, ComplexArray, FloatArray, IntArray
from bemkit.geometry.quadrature import gauss_legendre
from bemkit.operators import kernels
from bemkit.operators.collocation.layers import Constants
from bemkit.operators.element_geometry import ElementGeometry
from bemkit.operators.integrals import curved_geometry
from bemkit.operators.integrals.inner import inner_integrals, inner_on_element, store
from bemkit.operators.integrals.pairs import Degrees, Inner
from bemkit.operators.material import Material

CURVED_DISTANCE = 4.5
"""Distance in the parameter (`ElementGeometry.distance_at`) from which on curved elements take a Gauss rule."""
CURVED_POINTS = 8
"""Points of that rule, with an error of about (4.5 + sqrt(4.5^2 - 1))^-16, below 1e-15."""
_FAR, _FEW_POINTS = 30.0, 4
"""Distance from which on a smaller rule is used, with an error of about (2 * 30)^-8, below 1e-14."""


class _Rule(NamedTuple):
    """Points y, steps dy and values of p on all elements, (n_elements, n_points) complex arrays."""

    y: ComplexArray
    dy: ComplexArray
    p: ComplexArray


class CurvedElements:
    """Straight and curved elements in the order of a tree.

    Parameters
    ----------
    geometry : ElementGeometry
    material : Material
    order : (n_elements,) array
        The element of the mesh at each position.
    log_length : float [m]
        Unit of length in the logarithm.
    """

    def __init__(self, geometry: ElementGeometry, material: Material, order: IntArray, log_length: float) -> None:
        self.constants, self.order, self.geometry = Constants.of(material, log_length), order, geometry
        # distances below which closed forms are used, and above which the smaller rule is used
        self.near, self.far = (
            (geometry.half * geometry.distance_at(distance))[order] for distance in (CURVED_DISTANCE, _FAR)
        )
        self.rule, self.small_rule = (_rule(geometry, order, n_points) for n_points in (CURVED_POINTS, _FEW_POINTS))

    def factors(self, is_double: bool, x: ComplexArray, centred_on: IntArray, elements: IntArray) -> ComplexArray:
        """Return the factors (n, 2 or 4, n_points) of densities on some elements; see `layers.straight_factors`.

        Parameters
        ----------
        is_double : bool
        x : (n_points,) complex array
        centred_on : (n_points,) array
            The element whose midpoint is x, where T is a principal value; otherwise any other number.
        elements : (n,) array
        """
        geometry, mesh_elements = self.geometry, self.order[elements]
        distance = np.abs(x - geometry.centre[mesh_elements][:, None])
        is_far = distance.min(axis=1, initial=np.inf) > self.far[elements]
        result = np.empty((elements.size, 4 if is_double else 2, x.size), complex)
        for chosen, rule in ((np.flatnonzero(~is_far), self.rule), (np.flatnonzero(is_far), self.small_rule)):
            with np.errstate(all="ignore"):  # near pairs may overflow here; they are replaced
                arcs = _Rule(*(values[elements[chosen]] for values in rule))
                result[chosen] = _gauss_layer(self.constants, is_double, x, arcs)
        element, point = np.nonzero(distance < self.near[elements][:, None])
        if element.size:
            is_midpoint = centred_on[point] == elements[element]
            exact = exact_factors(geometry, self.constants, x[point], mesh_elements[element], is_midpoint)
            result[element, :, point] = (exact[[2, 4, 3, 5]] if is_double else exact[:2]).T
        return result


def _rule(geometry: ElementGeometry, order: IntArray, n_points: int) -> _Rule:
    """Return the Gauss rule on the arcs of all elements."""
    polynomials, scale = geometry.polynomials(order), (geometry.half * geometry.tangent)[order]
    slopes = curved_geometry.derivative(polynomials)
    y, dy, p = np.empty((3, order.size, n_points), complex)
    for k, (t, weight) in enumerate(zip(*gauss_legendre(n_points), strict=True)):
        parameter = np.full(order.size, t + 0j)
        p[:, k] = curved_geometry.evaluate(polynomials, parameter)
        y[:, k] = geometry.centre[order] + scale * p[:, k]
        dy[:, k] = weight * scale * curved_geometry.evaluate(slopes, parameter)
    return _Rule(y, dy, p)


def _gauss_layer(constants: Constants, is_double: bool, x: ComplexArray, rule: _Rule) -> ComplexArray:
    """Return the factors of densities from a Gauss rule."""
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


def exact_factors(
    geometry: ElementGeometry, constants: Constants, x: ComplexArray, elements: IntArray, is_midpoint: BoolArray
) -> ComplexArray:
    """Return the factors (6, n) of p, conj(p), v, conj(v), s and conj(s) in closed form, exact at any distance.

    Parameters
    ----------
    geometry : ElementGeometry
    constants : Constants
    x : (n,) complex array
    elements : (n,) array
        The element of each point.
    is_midpoint : (n,) bool array
        Whether the point is the midpoint of the element.
    """
    result = np.zeros((6, elements.size), complex)
    is_straight = geometry.is_straight[elements]
    for chosen in (np.flatnonzero(is_straight), np.flatnonzero(~is_straight)):
        if chosen.size:
            result[:, chosen] = _of_one_kind(geometry, constants, x[chosen], elements[chosen], is_midpoint[chosen])
    return result


def _of_one_kind(
    geometry: ElementGeometry, constants: Constants, x: ComplexArray, elements: IntArray, is_midpoint: BoolArray
) -> ComplexArray:
    """Return the factors of pairs whose elements are all straight or all curved."""
    from_start, from_end = x - geometry.start[elements], x - geometry.end[elements]
    plus, minus = from_start * geometry.to_local[elements], from_end * geometry.to_local[elements]
    is_straight = bool(geometry.is_straight[elements[0]])
    polynomials = geometry.polynomials(elements)[: 2 if is_straight else None]
    highest = len(polynomials) - 1
    degrees = Degrees(log=(0, highest - 1), double=(0, highest))
    inner = inner_integrals(geometry, degrees, elements, from_start, from_end)
    if is_midpoint.any():
        store(inner, is_midpoint, inner_on_element(geometry, degrees, elements[is_midpoint], 0.0))
        if is_straight:
            plus[is_midpoint], minus[is_midpoint] = 1.0, -1.0
    # eta is more accurate if measured from the nearer end
    eta = np.where(np.abs(plus) < np.abs(minus), plus.imag, minus.imag)
    log_ratio = np.log(np.abs(plus)) - np.log(np.abs(minus))
    # difference of rho / conj(rho) between the ends, without cancellation
    quotient_change = (plus - minus).real * eta / (plus * minus).conj()
    half, b = geometry.half[elements], -constants.double
    a, kappa = constants.single * half, 3.0 - 4.0 * constants.poisson_ratio
    turn, angle, ratio = geometry.tangent[elements] ** 2, 0.5 / np.pi, b * (1.0 - 2.0 * constants.poisson_ratio)
    double, log_moment, quotient_moment = _moments_by_parts(inner, polynomials, plus, minus)
    return np.array(
        [
            a * (1.0 - 2.0 * kappa * np.log(half / constants.log_length)) - a * kappa * inner.log[0],
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
    """Return the moments of the linear density by partial integration.

    `plus` and `minus` are the local coordinates of the point relative to start and end of the element.
    """
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
