"""Displacements of constant and linear densities on straight elements at any point, in closed form.

Complex notation: the element runs from a to b with centre c, tangent tau and half length l. A point x has the local
coordinate zeta = (x - c) / (l tau) = xi + i eta. With lambda = log(|x - a| / |x - b|), the angle theta from x - a to
x - b, and L = lambda - i theta, the displacements are

    U p = A l ([1 - kappa (2 log(l / r0) + J)] p + tau^2 [1 + i eta conj(L)] conj(p)),     A = 1 / (8 pi mu (1 - nu))
    T v = -B ([(2 - 2 nu) theta + i (1 - 2 nu) lambda] v + tau^2 eta conj(G) conj(v)),     B = 1 / (4 pi (1 - nu))

with J = log|zeta^2 - 1| - 2 + xi lambda + eta theta and G = 2 / (zeta^2 - 1). For a density s times the local
coordinate, zeta L - 2 replaces L, and -L + 2 zeta / (zeta^2 - 1) replaces G.

Far from the element the difference of logarithms would lose digits, and skeletons of small tolerance would resolve the
round-off. There L = 2 sum zeta^-(2k+1) / (2k+1), and the other functions follow from the same sum.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple, TypeAlias, TypeVar

import numpy as np

from bemkit.arrays import ComplexArray, FloatArray, IntArray, Run, consecutive_runs
from bemkit.operators.material import Material

Values = TypeVar("Values", FloatArray, ComplexArray)
_PAIRS = 8192
"""Pairs of points and elements that are evaluated at a time, to stay in the cache."""
FAR = 16.0
"""Distance in half lengths of the element from which on the series is used."""
_ORDERS = range(7, 0, -1)
SERIES = tuple(1.0 / (2 * k + 1) for k in _ORDERS)
"""Factors of the series of L, highest order first; the remainder is below 10^-20."""
REST = tuple(2.0 * k / (2 * k + 1) for k in _ORDERS)
"""Factors of a geometric series minus those of L, for the moments."""


class Constants(NamedTuple):
    """Constants of the closed forms.

    Parameters
    ----------
    single : float [1/Pa]
        A = 1 / (8 pi mu (1 - nu)).
    double : float [-]
        B = 1 / (4 pi (1 - nu)).
    poisson_ratio : float [-]
        Poisson's ratio in plane strain.
    log_length : float [m]
        r0, the unit of length in the logarithm.
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
    """Complex unknowns, each a density on k elements, and the columns that are their components.

    Parameters
    ----------
    elements : (n, k) array
        Elements of each unknown.
    weights : (n, k, 1 or 2) complex array
        Density of a unit unknown on each of them: a constant and, for the double layer, a slope.
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
    constants: Constants, is_double: bool, x: ComplexArray, centred_on: IntArray, elements: Elements, unknowns: Unknowns
) -> ComplexArray:
    """Return the complex displacements (n_columns, n_points) of unit unknowns on straight elements.

    Parameters
    ----------
    constants, is_double, x, centred_on, elements
        See `straight_factors`.
    unknowns : Unknowns
    """
    return combined(
        lambda points: straight_factors(constants, is_double, x[points], centred_on[points], *elements),
        (elements[0].size, x.size),
        unknowns,
    )


def combined(factors: Callable[[slice], ComplexArray], shape: tuple[int, int], unknowns: Unknowns) -> ComplexArray:
    """Return the displacements (n_columns, n_points) of unit unknowns from the factors of elements.

    Parameters
    ----------
    factors : callable
        Slice of the points -> factors (n_elements, 2 or 4, n_points_of_slice), see `straight_factors`.
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
    for points in (slice(begin, begin + step) for begin in range(0, n_points, step)):
        direct, conjugate = _summed(factors(points), unknowns, runs)
        result[x_columns, points] = direct[x_unknowns] + conjugate[x_unknowns]
        # a unit along y is the number i
        difference = direct[y_unknowns] - conjugate[y_unknowns]
        result.real[y_columns, points], result.imag[y_columns, points] = -difference.imag, difference.real
    return result


def _summed(values: ComplexArray, unknowns: Unknowns, runs: list[list[Run]]) -> tuple[ComplexArray, ComplexArray]:
    """Return the factors of unknowns and of their conjugates, (n, n_points) each.

    Parameters
    ----------
    values : (n_elements, 2 or 4, n_points) complex array
    unknowns : Unknowns
    runs : list
        For each of the k elements of an unknown: consecutive unknowns with consecutive elements. Empty if few
        unknowns act on many elements.
    """
    weights, n_densities = unknowns.weights, unknowns.weights.shape[2]
    direct, conjugate = np.zeros((2, len(weights), values.shape[2]), complex)
    if not runs:
        for unknown, elements in enumerate(unknowns.elements):
            weight, factors = weights[unknown].ravel(), values[elements]
            direct[unknown] = weight @ factors[:, :n_densities].reshape(weight.size, -1)
            conjugate[unknown] = weight.conj() @ factors[:, n_densities:].reshape(weight.size, -1)
    for position, pairs in enumerate(runs):
        for chosen, elements in pairs:
            for density in range(n_densities):
                weight = weights[chosen, position, density, None]
                direct[chosen] += weight * values[elements, density]
                conjugate[chosen] += weight.conj() * values[elements, n_densities + density]
    return direct, conjugate


def straight_factors(
    constants: Constants, is_double: bool, x: ComplexArray, centred_on: IntArray, start: ComplexArray, end: ComplexArray
) -> ComplexArray:
    """Return the factors of densities on straight elements in the displacements at points.

    Parameters
    ----------
    constants : Constants
    is_double : bool
        Whether the layer is the double layer T (v + s t) instead of the single layer U p.
    x : (n_points,) complex array
    centred_on : (n_points,) array
        Index of the element whose midpoint is x, where T is a principal value; otherwise any other number.
    start, end : (n_elements,) complex arrays

    Returns
    -------
    (n_elements, 2 or 4, n_points) complex array
        Factors of p and conj(p) with the constant traction p; or of v, s, conj(v) and conj(s) with the displacement
        v + s t in the local coordinate t from -1 to 1.
    """
    near = _Near(x, start, end, centred_on)
    half = 0.5 * np.abs(end - start)[:, None]
    tangent = (end - start)[:, None] / (2.0 * half)
    zeta = (x - 0.5 * (start + end)[:, None]) * (tangent.conj() / half)
    zeta[near.pairs] = FAR  # any far value: near pairs are replaced
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
    geometric: ComplexArray = square / (1.0 - square)  # geometric - series is the series of `REST`
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
    """Return f1 q + f2 q^2 + ...; the factor of the highest power comes first."""
    result = factors[0] * q
    for factor in factors[1:]:
        result += factor
        result *= q
    return result


class _Near:
    """Closed forms for near pairs of elements and points.

    `pairs` are the indices of element and point. The arrays `zeta`, `log` (L), `moment` (zeta L - 2), `quotient` (G),
    `of_moment` (-L + zeta G) and `logs` (log|zeta^2 - 1| + Re(zeta L)) have one value for each pair.
    """

    def __init__(self, x: ComplexArray, start: ComplexArray, end: ComplexArray, centred_on: IntArray) -> None:
        away, span = x - 0.5 * (start + end)[:, None], end - start
        of_span = np.square(span.real) + np.square(span.imag)
        is_near = np.square(away.real) + np.square(away.imag) <= (0.25 * FAR**2) * of_span[:, None]
        self.pairs = np.nonzero(is_near)
        element, point = self.pairs
        is_midpoint, span = centred_on[point] == element, span[element]
        half = 0.5 * np.abs(span)
        to_start, to_end = x[point] - start[element], x[point] - end[element]
        to_local = (span / (2.0 * half)).conj() / half
        # eta is accurate only if measured from the nearer end node
        plus, minus = to_start * to_local, to_end * to_local
        self.zeta = 0.5 * (plus + minus)
        squared_start = np.square(to_start.real) + np.square(to_start.imag)
        squared_end = np.square(to_end.real) + np.square(to_end.imag)
        self.zeta.imag = np.where(squared_start < squared_end, plus.imag, minus.imag)
        self.zeta.imag[is_midpoint] = 0.0
        turn = to_start.conj() * to_end
        angle = np.where(is_midpoint, 0.0, np.arctan2(turn.imag, turn.real))
        log_start, log_end = np.log(squared_start), np.log(squared_end)
        self.log: ComplexArray = 0.5 * (log_start - log_end) - 1j * angle
        product = self.zeta * self.log
        self.moment: ComplexArray = product - 2.0
        self.quotient = np.asarray(2.0 / np.where(is_midpoint, -1.0, plus * minus), complex)  # there eta is zero
        self.of_moment = self.zeta * self.quotient - self.log
        self.logs = 0.5 * (log_start + log_end) - 2.0 * np.log(half) + product.real

    def put(self, values: Values, of_pairs: Values) -> Values:
        """Replace the values of near pairs in an array (n_elements, n_points)."""
        values[self.pairs] = of_pairs
        return values
