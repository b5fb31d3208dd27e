"""Displacements that constant and linear densities on straight elements cause anywhere, in closed form.

In complex notation, with the element from a to b, its tangent tau and half length l, zeta = (x - c) / (l tau) = xi + i
eta, lambda = log(|x - a| / |x - b|), theta the angle from x - a to x - b and L = lambda - i theta:

    U p = A l ([1 - kappa (2 log(l / r0) + J)] p + tau^2 [1 + i eta conj(L)] conj(p)),     A = 1 / (8 pi mu (1 - nu))
    T v = -B ([(2 - 2 nu) theta + i (1 - 2 nu) lambda] v + tau^2 eta conj(G) conj(v)),     B = 1 / (4 pi (1 - nu))

with J = log|zeta^2 - 1| - 2 + xi lambda + eta theta and G = 2 / (zeta^2 - 1). For a density s times the local
coordinate, zeta L - 2 takes the place of L, and -L + 2 zeta / (zeta^2 - 1) that of G.

Far from the element differences of logarithms would lose their digits, which tight skeletons mistake for structure:
there L = 2 sum zeta^-(2k+1) / (2k+1), and the others follow from the same sum.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple, TypeAlias, TypeVar

import numpy as np

from bemkit.arrays import ComplexArray, FloatArray, IntArray, Run, consecutive_runs
from bemkit.operators.material import Material

Values = TypeVar("Values", FloatArray, ComplexArray)
_PAIRS = 8192
"""Pairs of points and elements that are evaluated at a time, so that they stay in the cache."""
FAR = 16.0
"""Half lengths of the element from which on the series is taken."""
_ORDERS = range(7, 0, -1)
SERIES = tuple(1.0 / (2 * k + 1) for k in _ORDERS)
"""Factors of the series of L, the last one first: what follows is below 10^-20."""
REST = tuple(2.0 * k / (2 * k + 1) for k in _ORDERS)
"""Differences of a geometric series from it, for the moments."""


class Constants(NamedTuple):
    """Constants of the closed forms.

    Parameters
    ----------
    single : float [1/Pa]
        A = 1 / (8 pi mu (1 - nu)).
    double : float [-]
        B = 1 / (4 pi (1 - nu)).
    poisson_ratio : float [-]
        Of plane strain.
    log_length : float [m]
        r0, the unit of length of the logarithm.
    """

    single: float
    double: float
    poisson_ratio: float
    log_length: float

    @classmethod
    def of(cls, material: Material, log_length: float) -> Constants:
        """Return the constants of a material."""
        nu = material.effective_poisson_ratio
        double = 1.0 / (4.0 * np.pi * (1.0 - nu))
        return cls(0.5 * double / material.shear_modulus, double, nu, log_length)


class Unknowns(NamedTuple):
    """Complex unknowns, each a density on k elements, and the components of them that are columns.

    Parameters
    ----------
    elements : (n, k) array
        The elements on which each unknown acts.
    weights : (n, k, 1 or 2) complex array
        The density that a unit of the unknown is there: a constant and, in the double layer, a slope.
    columns : (n_columns,) array
        2 * unknown + component.
    """

    elements: IntArray
    weights: ComplexArray
    columns: IntArray


Elements: TypeAlias = tuple[ComplexArray, ComplexArray]
"""Start and end points (n_elements,) of straight elements."""
Layer: TypeAlias = Callable[[Constants, bool, ComplexArray, IntArray, Elements, Unknowns], ComplexArray]
"""The signature of `straight_layer` and of its compiled version."""


def straight_layer(
    constants: Constants, is_double: bool, x: ComplexArray, own: IntArray, elements: Elements, unknowns: Unknowns
) -> ComplexArray:
    """Return the displacements (n_columns, n_points), complex, that unit unknowns on straight elements cause at points.

    Parameters
    ----------
    constants, is_double, x, own, elements
        As of `straight_factors`.
    unknowns : Unknowns
    """
    return combined(
        lambda some: straight_factors(constants, is_double, x[some], own[some], *elements),
        (elements[0].size, x.size),
        unknowns,
    )


def combined(factors: Callable[[slice], ComplexArray], shape: tuple[int, int], unknowns: Unknowns) -> ComplexArray:
    """Return the displacements (n_columns, n_points) that unknowns cause, from the factors of elements.

    Parameters
    ----------
    factors : callable
        Some of the points to the factors (n_elements, 2 or 4, n_some) of `straight_factors`.
    shape : (n_elements, n_points)
    unknowns : Unknowns
    """
    n_elements, n_points = shape
    n, k, _ = unknowns.weights.shape
    of_column, component = unknowns.columns // 2, unknowns.columns % 2
    along_x, along_y = np.flatnonzero(component == 0), np.flatnonzero(component)
    is_complete = of_column.size == 2 * n and bool(np.all(unknowns.columns == np.arange(2 * n)))
    x_columns, y_columns = (slice(0, None, 2), slice(1, None, 2)) if is_complete else (along_x, along_y)
    x_unknowns, y_unknowns = (slice(None), slice(None)) if is_complete else (of_column[along_x], of_column[along_y])
    result = np.empty((of_column.size, n_points), complex)
    step = max(1, _PAIRS // max(n_elements, 1))
    runs = [consecutive_runs(elements) for elements in unknowns.elements.T] if k <= n else []
    for some in (slice(begin, begin + step) for begin in range(0, n_points, step)):
        one, conjugate = _summed(factors(some), unknowns, runs)
        result[x_columns, some] = one[x_unknowns] + conjugate[x_unknowns]
        # a unit along y is the number i
        turned = one[y_unknowns] - conjugate[y_unknowns]
        result.real[y_columns, some], result.imag[y_columns, some] = -turned.imag, turned.real
    return result


def _summed(values: ComplexArray, unknowns: Unknowns, runs: list[list[Run]]) -> tuple[ComplexArray, ComplexArray]:
    """Return the factors of unknowns and of their conjugates, (n, n_points) each, from those of the elements.

    Parameters
    ----------
    values : (n_elements, 2 or 4, n_points) complex array
    unknowns : Unknowns
    runs : list
        For each of the elements on which the unknowns act: which unknowns, and which elements. Empty if unknowns are
        few that act on many elements.
    """
    weights, n_densities = unknowns.weights, unknowns.weights.shape[2]
    one, conjugate = np.zeros((2, len(weights), values.shape[2]), complex)
    if not runs:
        for number, elements in enumerate(unknowns.elements):
            own, factors = weights[number].ravel(), values[elements]
            one[number] = own @ factors[:, :n_densities].reshape(own.size, -1)
            conjugate[number] = own.conj() @ factors[:, n_densities:].reshape(own.size, -1)
    for number, pairs in enumerate(runs):
        for own, elements in pairs:
            for density in range(n_densities):
                weight = weights[own, number, density, None]
                one[own] += weight * values[elements, density]
                conjugate[own] += weight.conj() * values[elements, n_densities + density]
    return one, conjugate


def straight_factors(
    constants: Constants, is_double: bool, x: ComplexArray, own: IntArray, start: ComplexArray, end: ComplexArray
) -> ComplexArray:
    """Return the factors of the densities on straight elements in the displacements at points.

    Parameters
    ----------
    constants : Constants
    is_double : bool
        The double layer T (v + s t), else the single layer U p.
    x : (n_points,) complex array
    own : (n_points,) array
        Index of the element in whose middle the point is, where the integral T is a principal value; any other number
        elsewhere.
    start, end : (n_elements,) complex arrays

    Returns
    -------
    (n_elements, 2 or 4, n_points) complex array
        Factors of p, conj(p); or of v, s, conj(v), conj(s): p is a constant traction, v a constant displacement and s
        its slope by the coordinate t, from -1 to 1.
    """
    near = _Near(x, start, end, own)
    half = 0.5 * np.abs(end - start)[:, None]
    tangent = (end - start)[:, None] / (2.0 * half)
    zeta = (x - 0.5 * (start + end)[:, None]) * (tangent.conj() / half)
    zeta[near.pairs] = FAR  # anything far: these are replaced
    inverse = 1.0 / zeta
    square = inverse * inverse
    series: ComplexArray = _power_series(SERIES, square)
    nu = constants.poisson_ratio
    log: ComplexArray = near.put(2.0 * (inverse + inverse * series), near.log)
    eta = near.put(zeta.imag.copy(), near.zeta.imag)
    if not is_double:
        # log|zeta^2 - 1| + Re(zeta L)
        squared = (np.square(zeta.real) + np.square(zeta.imag)) * np.abs(1.0 - square)
        logs = near.put(np.log(squared) + 2.0 + 2.0 * series.real, near.logs)
        result = np.empty((start.size, 2, x.size), complex)
        a, kappa = constants.single * half, 3.0 - 4.0 * nu
        result[:, 0] = a * (1.0 + kappa * (2.0 + 2.0 * np.log(constants.log_length / half) - logs))
        result[:, 1].real, result[:, 1].imag = 1.0 + eta * log.imag, eta * log.real
        result[:, 1] *= a * tangent**2
        return result
    geometric: ComplexArray = square / (1.0 - square)  # its difference from the series is that of `REST`
    moment = near.put(2.0 * series, near.moment)
    quotient: ComplexArray = near.put(2.0 * geometric, near.quotient)
    of_moment = near.put(2.0 * inverse * (geometric - series), near.of_moment)
    result = np.empty((start.size, 4, x.size), complex)
    rates = -constants.double * (2.0 - 2.0 * nu), -constants.double * (1.0 - 2.0 * nu)
    result[:, 0].real, result[:, 0].imag = -rates[0] * log.imag, rates[1] * log.real
    result[:, 1].real, result[:, 1].imag = -rates[0] * moment.imag, rates[1] * moment.real
    across = (-constants.double * tangent**2) * eta
    np.multiply(across, quotient.conj(), out=result[:, 2])
    np.multiply(across, of_moment.conj(), out=result[:, 3])
    return result


def _power_series(factors: tuple[float, ...], q: ComplexArray) -> ComplexArray:
    """Return f1 q + f2 q^2 + ...; the last factor comes first."""
    result = factors[0] * q
    for factor in factors[1:]:
        result += factor
        result *= q
    return result


class _Near:
    """Closed forms of all pairs of elements and points that are not far from each other.

    `pairs` are their indices; all other arrays are by pair: zeta, L, zeta L - 2, G, -L + zeta G, and log|zeta^2 - 1|
    with Re(zeta L).
    """

    def __init__(self, x: ComplexArray, start: ComplexArray, end: ComplexArray, own: IntArray) -> None:
        away, span = x - 0.5 * (start + end)[:, None], end - start
        of_span = np.square(span.real) + np.square(span.imag)
        is_near = np.square(away.real) + np.square(away.imag) <= (0.25 * FAR**2) * of_span[:, None]
        self.pairs = np.nonzero(is_near)
        element, point = self.pairs
        is_own, span = own[point] == element, span[element]
        half = 0.5 * np.abs(span)
        to_start, to_end = x[point] - start[element], x[point] - end[element]
        to_local = (span / (2.0 * half)).conj() / half
        # near an end node the coordinate across the element is known only from there
        plus, minus = to_start * to_local, to_end * to_local
        self.zeta = 0.5 * (plus + minus)
        squared_start = np.square(to_start.real) + np.square(to_start.imag)
        squared_end = np.square(to_end.real) + np.square(to_end.imag)
        self.zeta.imag = np.where(squared_start < squared_end, plus.imag, minus.imag)
        self.zeta.imag[is_own] = 0.0
        turn = to_start.conj() * to_end
        angle = np.where(is_own, 0.0, np.arctan2(turn.imag, turn.real))
        log_start, log_end = np.log(squared_start), np.log(squared_end)
        self.log: ComplexArray = 0.5 * (log_start - log_end) - 1j * angle
        turned = self.zeta * self.log
        self.moment: ComplexArray = turned - 2.0
        self.quotient = np.asarray(2.0 / np.where(is_own, -1.0, plus * minus), complex)  # on the element eta is zero
        self.of_moment = self.zeta * self.quotient - self.log
        self.logs = 0.5 * (log_start + log_end) - 2.0 * np.log(half) + turned.real

    def put(self, values: Values, of_pairs: Values) -> Values:
        """Replace the values of these pairs in an array (n_elements, n_points)."""
        values[self.pairs] = of_pairs
        return values
