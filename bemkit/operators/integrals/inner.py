"""Inner integrals over one trial element for a point: closed forms, and the contributions of curvature.

With zeta - p(t) = (t0 - t) g(t) (see `curved_geometry`) the integrals over a curved element near the point are those of
the straight element for the point t0 = xi + i eta, plus integrals of functions that are smooth on [-1, 1]:

    int P_b log|rho| dt        = straight + int P_b log|g| dt
    int P_b 2 pi k dt          = straight - int P_b Im(g' / g) dt
    int P_b rho / conj(rho) dt = int P_b h dt + 2 i eta (h0 conj(C_b) + int P_b (h - h0) / (conj(t0) - t) dt),

with h = g / conj(g) on the real axis and its value h0 at conj(t0). The remainders are not singular and lose no digits
for any point. Far from the element the integrands themselves are smooth, and a Gauss rule is used.
"""

from __future__ import annotations

import numpy as np

from bemkit.arrays import ComplexArray, FloatArray, IntArray
from bemkit.geometry.quadrature import gauss_legendre
from bemkit.operators import kernels
from bemkit.operators.element_geometry import ElementGeometry
from bemkit.operators.integrals import curved_geometry
from bemkit.operators.integrals.pairs import Degrees, Inner

N_SMOOTH = 16
"""Gauss points of the smooth remainders, and of the integrals themselves outside of `curved_geometry.ELLIPSE`."""


def inner_integrals(
    geometry: ElementGeometry, degrees: Degrees, trial: IntArray, from_start: ComplexArray, from_end: ComplexArray
) -> Inner:
    """Integrate over trial elements for points at any distance, one point for each element.

    Parameters
    ----------
    geometry : ElementGeometry
    degrees : Degrees
    trial : (n,) int array
        Indices of elements.
    from_start, from_end : (n,) complex arrays [m]
        The points relative to the start and end of their element, each accurate near that end.
    """
    plus, minus = from_start * geometry.to_local[trial], from_end * geometry.to_local[trial]
    if geometry.curved is None or bool(geometry.is_straight[trial].all()):
        return near_inner(degrees, None, plus, minus)
    result = Inner.zeros(degrees, trial.shape)
    zeta = local_coordinates(geometry, trial, from_start)
    near = np.flatnonzero(np.abs(zeta) < geometry.distance_at(curved_geometry.ELLIPSE)[trial])
    t_plus, t_minus, is_found = curved_geometry.find_parameters(geometry.curved, trial[near], plus[near], minus[near])
    near, parameters = near[is_found], (t_plus[is_found], t_minus[is_found])
    far = np.setdiff1d(np.arange(trial.size), near, assume_unique=True)
    n_points = N_SMOOTH + degrees.extra_points
    for chosen, values in (
        (near, near_inner(degrees, geometry.polynomials(trial[near]), *parameters)),
        (far, far_inner(degrees, geometry.polynomials(trial[far]), zeta[far], n_points)),
    ):
        result.log[:, chosen], result.quotient[:, chosen] = values.log, values.quotient
        result.cauchy[:, chosen] = values.cauchy
    return result


def local_coordinates(geometry: ElementGeometry, trial: IntArray, from_start: ComplexArray) -> ComplexArray:
    """Return the local coordinates of points from their position relative to the start of their element."""
    zeta: ComplexArray = ((geometry.start - geometry.centre)[trial] + from_start) * geometry.to_local[trial]
    return zeta


def near_inner(degrees: Degrees, coefficients: ComplexArray | None, plus: ComplexArray, minus: ComplexArray) -> Inner:
    """Integrate over elements near points with the parameters t0 = plus - 1 = minus + 1.

    Parameters
    ----------
    degrees : Degrees
    coefficients : (n_powers, n) complex array
        The polynomials p of the elements; None if all are straight, which have closed forms at any distance.
    plus, minus : (n,) complex arrays
    """
    integrals, log_product = kernels.near_integrals(plus, minus, degrees.highest_integral)
    root = kernels.local_coordinate(plus, minus)
    straight = Inner.straight(degrees, integrals, log_product, root.imag)
    if coefficients is None:
        return straight
    smooth = bending(degrees, coefficients, root, root.imag, integrals)  # its quotient is complete
    return Inner(straight.log + smooth.log, smooth.quotient, straight.cauchy + smooth.cauchy)


def bending(
    degrees: Degrees,
    coefficients: ComplexArray,
    root: ComplexArray,
    eta: FloatArray | None = None,
    integrals: ComplexArray | None = None,
) -> Inner:
    """Return the smooth remainders of log and double, and the complete quotient, at the parameters `root` (n,).

    For points on the elements themselves omit `eta`, which is zero, and the integrals C_b.
    """
    n_log, n_double = degrees.n_trial
    divided = curved_geometry.divided_difference(coefficients, root)
    n_points = N_SMOOTH + degrees.extra_points
    t, _ = gauss_legendre(n_points)
    powers = np.vander(t, divided.shape[0], increasing=True)
    g = _product(powers, divided)
    size = np.square(g.real) + np.square(g.imag)
    ratio = g * g / size
    weights_of_log = kernels.legendre_weights(n_log, n_points)
    log = weights_of_log @ (0.5 * np.log(size))
    quotient = _product(weights_of_log, ratio)
    if n_log and eta is not None and integrals is not None:
        at_mirror = curved_geometry.evaluate(divided, root.conj()) / curved_geometry.evaluate(divided, root).conj()
        gap = root.conj() - t[:, None]
        gap[gap == 0.0] = 1.0  # eta, a factor of the term, is zero then
        change = _product(weights_of_log, (ratio - at_mirror) / gap)
        quotient += (2j * eta) * (at_mirror * integrals[:n_log].conj() + change)
    slope = _product(powers[:, :-1], curved_geometry.derivative(divided))
    double = kernels.legendre_weights(n_double, n_points) @ (-(slope * g.conj()).imag / size)
    return Inner(log, quotient, 1j * double)


def far_inner(degrees: Degrees, coefficients: ComplexArray, zeta: ComplexArray, n_points: int) -> Inner:
    """Integrate over curved elements for far points by a Gauss rule.

    Parameters
    ----------
    degrees : Degrees
    coefficients : (n_powers, n_trial) complex array
        The polynomials p of the elements.
    zeta : (..., n_trial) complex array
        Local coordinates of the points.
    n_points : int
        Number of Gauss points, which must suit the distance of the points.
    """
    n_log, n_double = degrees.n_trial
    result = Inner.zeros(degrees, zeta.shape)
    slopes = curved_geometry.derivative(coefficients)
    factors = kernels.legendre_weights(max(n_log, n_double), n_points)
    for t, factor in zip(gauss_legendre(n_points)[0], factors.T, strict=True):
        parameter = np.full(coefficients.shape[1], t + 0j)
        rho = zeta - curved_geometry.evaluate(coefficients, parameter)
        size = np.square(rho.real) + np.square(rho.imag)
        if n_log:
            result.log[:] += np.multiply.outer(0.5 * factor[:n_log], np.log(size))
            result.quotient[:] += np.multiply.outer(factor[:n_log], rho * rho / size)
        if n_double:
            angle = (curved_geometry.evaluate(slopes, parameter) * rho.conj()).imag / size
            result.double[:] += np.multiply.outer(factor[:n_double], angle)
    return result


def _product(matrix: FloatArray, values: ComplexArray) -> ComplexArray:
    """Return the product of a real matrix and complex values."""
    values = np.ascontiguousarray(values)
    return np.asarray(matrix @ values.view(float)).view(complex)
