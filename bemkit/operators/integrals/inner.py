"""Inner integrals over one trial element, seen from a point: closed forms, and what bending adds to them.

With zeta - p(t) = (t0 - t) g(t) (see `curved_panels`) the integrals over a curved element near the point are those of
the straight element seen from t0 = xi + i eta, plus integrals of functions that are smooth on [-1, 1]:

    int P_b log|rho| dt        = straight + int P_b log|g| dt
    int P_b 2 pi k dt          = straight - int P_b Im(g' / g) dt
    int P_b rho / conj(rho) dt = int P_b h dt + 2 i eta (h0 conj(C_b) + int P_b (h - h0) / (conj(t0) - t) dt),

with h = g / conj(g) on the real axis and h0 its value at conj(t0). Nothing is singular or cancels, wherever the point
lies. Far from the element the integrands themselves are smooth and a Gauss rule serves.
"""

from __future__ import annotations

import numpy as np

from bemkit.arrays import BoolArray, ComplexArray, FloatArray, IntArray
from bemkit.geometry.quadrature import gauss_legendre
from bemkit.operators import kernels
from bemkit.operators.integrals import curved_panels
from bemkit.operators.integrals.pairs import Degrees, Inner
from bemkit.operators.integrals.panels import Panels

N_SMOOTH = 16
"""Points for the smooth remainders, and for the integrals themselves outside `curved_panels.ELLIPSE`."""


def inner_integrals(
    panels: Panels, degrees: Degrees, trial: IntArray, from_start: ComplexArray, from_end: ComplexArray
) -> Inner:
    """Integrate over trial elements that are seen from points at any distance, one point for each.

    Parameters
    ----------
    panels : Panels
    degrees : Degrees
    trial : (n,) int array
        Elements.
    from_start, from_end : (n,) complex arrays [m]
        The points relative to either end of their element, each accurate near that end.
    """
    plus, minus = from_start * panels.to_local[trial], from_end * panels.to_local[trial]
    if panels.curved is None or bool(panels.is_straight[trial].all()):
        return _seen_from(degrees, plus, minus)
    result = Inner.zeros(degrees, trial.shape)
    zeta = local_coordinates(panels, trial, from_start)
    near = np.flatnonzero(np.abs(zeta) < panels.reach(curved_panels.ELLIPSE)[trial])
    t_plus, t_minus, is_found = curved_panels.find_parameters(panels.curved, trial[near], plus[near], minus[near])
    near = near[is_found]
    store(result, near, near_inner(degrees, panels.polynomials(trial[near]), t_plus[is_found], t_minus[is_found]))
    is_far = np.ones(trial.size, bool)
    is_far[near] = False
    far = np.flatnonzero(is_far)
    store(result, far, far_inner(degrees, panels.polynomials(trial[far]), zeta[far], N_SMOOTH + degrees.extra_points))
    return result


def local_coordinates(panels: Panels, trial: IntArray, from_start: ComplexArray) -> ComplexArray:
    """Return the local coordinates of points given relative to the start of their element."""
    zeta: ComplexArray = ((panels.start - panels.centre)[trial] + from_start) * panels.to_local[trial]
    return zeta


def inner_on_element(panels: Panels, degrees: Degrees, elements: IntArray, xi: float) -> Inner:
    """Integrate over elements seen from their own points at the local coordinate `xi`; k is a principal value."""
    end: ComplexArray = np.full(elements.size, 1.0 + 0j)
    integrals, log_product = kernels.near_integrals(xi + end, xi - end, degrees.highest_integral)
    principal = integrals.real.astype(complex)
    straight = Inner.straight(degrees, principal, log_product, np.zeros(elements.size))
    if panels.curved is None or bool(panels.is_straight[elements].all()):
        return straight
    return _sum(straight, bending(degrees, panels.polynomials(elements), np.full(elements.size, xi + 0j)))


def store(result: Inner, chosen: IntArray | BoolArray, values: Inner) -> None:
    """Write the integrals of some of the points."""
    result.log[:, chosen] = values.log
    result.quotient[:, chosen] = values.quotient
    result.cauchy[:, chosen] = values.cauchy


def _seen_from(degrees: Degrees, plus: ComplexArray, minus: ComplexArray) -> Inner:
    """Return the closed forms of straight elements; `plus` and `minus` as in `kernels.near_integrals`."""
    integrals, log_product = kernels.near_integrals(plus, minus, degrees.highest_integral)
    return Inner.straight(degrees, integrals, log_product, kernels.local_coordinate(plus, minus).imag)


def near_inner(degrees: Degrees, coefficients: ComplexArray, plus: ComplexArray, minus: ComplexArray) -> Inner:
    """Integrate over curved elements near points with the parameters t0 = plus - 1 = minus + 1.

    Parameters
    ----------
    degrees : Degrees
    coefficients : (n_powers, n) complex array
        The polynomials p of the elements.
    plus, minus : (n,) complex arrays
    """
    integrals, log_product = kernels.near_integrals(plus, minus, degrees.highest_integral)
    root = kernels.local_coordinate(plus, minus)
    straight = Inner.straight(degrees, integrals, log_product, root.imag)
    return _sum(straight, bending(degrees, coefficients, root, root.imag, integrals))


def _sum(straight: Inner, smooth: Inner) -> Inner:
    """Add what bending adds; the quotient of `smooth` is the whole one."""
    return Inner(straight.log + smooth.log, smooth.quotient, straight.cauchy + smooth.cauchy)


def bending(
    degrees: Degrees,
    coefficients: ComplexArray,
    root: ComplexArray,
    eta: FloatArray | None = None,
    integrals: ComplexArray | None = None,
) -> Inner:
    """Return what bending adds to log and double, and the whole quotient, at points with the parameters `root` (n,).

    Points on the elements themselves need neither `eta`, which is zero, nor the integrals C_b.
    """
    n_log, n_double = degrees.n_trial
    divided = curved_panels.divided_difference(coefficients, root)
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
        at_mirror = curved_panels.evaluate(divided, root.conj()) / curved_panels.evaluate(divided, root).conj()
        gap = root.conj() - t[:, None]
        gap[gap == 0.0] = 1.0  # then eta is zero, and with it the whole term
        change = _product(weights_of_log, (ratio - at_mirror) / gap)
        quotient += (2j * eta) * (at_mirror * integrals[:n_log].conj() + change)
    slope = _product(powers[:, :-1], curved_panels.derivative(divided))
    double = kernels.legendre_weights(n_double, n_points) @ (-(slope * g.conj()).imag / size)
    return Inner(log, quotient, 1j * double)


def far_inner(degrees: Degrees, coefficients: ComplexArray, zeta: ComplexArray, n_points: int) -> Inner:
    """Integrate over curved elements far from points by a Gauss rule.

    Parameters
    ----------
    degrees : Degrees
    coefficients : (n_powers, n_trial) complex array
        The polynomials p of the elements.
    zeta : (..., n_trial) complex array
        Local coordinates of the points.
    n_points : int
        Enough for the distance of the points.
    """
    n_log, n_double = degrees.n_trial
    result = Inner.zeros(degrees, zeta.shape)
    slopes = curved_panels.derivative(coefficients)
    factors = kernels.legendre_weights(max(n_log, n_double), n_points)
    for t, factor in zip(gauss_legendre(n_points)[0], factors.T, strict=True):
        place = np.full(coefficients.shape[1], t + 0j)
        rho = zeta - curved_panels.evaluate(coefficients, place)
        size = np.square(rho.real) + np.square(rho.imag)
        if n_log:
            result.log[:] += np.multiply.outer(0.5 * factor[:n_log], np.log(size))
            result.quotient[:] += np.multiply.outer(factor[:n_log], rho * rho / size)
        if n_double:
            angle = (curved_panels.evaluate(slopes, place) * rho.conj()).imag / size
            result.double[:] += np.multiply.outer(factor[:n_double], angle)
    return result


def _product(matrix: FloatArray, values: ComplexArray) -> ComplexArray:
    """Return matrix @ values for a real matrix and complex values by one real product."""
    values = np.ascontiguousarray(values)
    return np.asarray(matrix @ values.view(float)).view(complex)
