"""What one straight element causes at many points, as loops that numba vectorises; import it through `compiled` alone.

The loops run over points, without a branch, so that the compiler takes several of them at a time. Points come in
blocks: where all of one are far from the element, the series of `element_fields` alone is evaluated. Tables have a row
for each real number, complex ones two.
"""

from __future__ import annotations

import math

import numba
import numpy as np

from bemkit.arrays import FloatArray, IntArray
from bemkit.operators.hierarchy.compiled_functions import MATHEMATICS, OPTIONS, atan2, log
from bemkit.operators.hierarchy.series import FAR, REST, SERIES

_FAR_SQUARED = FAR**2
U, UC, N_SINGLE = 0, 1, 3
"""Rows of a traction: U p, which is real, and its conjugate part."""
T, TC, TS, TSC, N_DOUBLE = 0, 2, 4, 6, 8
"""Rows of a displacement: T v and its conjugate part, and the same of slopes."""
_TINY = 1e-300
BLOCK = 32
"""Points that are looked at together. Loops over whole blocks leave no single points behind, which take longest."""


@numba.njit(inline="always", error_model="numpy")
def _power_series(
    factors: tuple[float, float, float, float, float, float, float], q_x: float, q_y: float
) -> tuple[float, float]:
    """Return f1 q + f2 q^2 + ... of a complex number q; the last factor comes first."""
    f7, f6, f5, f4, f3, f2, f1 = factors
    x, y = f7 * q_x, f7 * q_y
    x, y = (x + f6) * q_x - y * q_y, (x + f6) * q_y + y * q_x
    x, y = (x + f5) * q_x - y * q_y, (x + f5) * q_y + y * q_x
    x, y = (x + f4) * q_x - y * q_y, (x + f4) * q_y + y * q_x
    x, y = (x + f3) * q_x - y * q_y, (x + f3) * q_y + y * q_x
    x, y = (x + f2) * q_x - y * q_y, (x + f2) * q_y + y * q_x
    return (x + f1) * q_x - y * q_y, (x + f1) * q_y + y * q_x


@numba.njit(inline="always", error_model="numpy")
def _inverse(xi: float, eta: float) -> tuple[float, float, float, float]:
    """Return 1 / zeta and its square; anything finite where zeta is not far."""
    by_squared = 1.0 / max(xi * xi + eta * eta, _FAR_SQUARED)
    x, y = xi * by_squared, -eta * by_squared
    return x, y, x * x - y * y, 2.0 * x * y


@numba.njit(inline="always", error_model="numpy")
def _arms(
    ax: float, ay: float, bx: float, by: float, tangent_x: float, tangent_y: float, by_half: float
) -> tuple[float, float, float, float, float, float]:
    """Return the squared distances from both ends, xi, eta, and zeta^2 - 1 by 4 / l^2."""
    of_start, of_end = ax * ax + ay * ay + _TINY, bx * bx + by * by + _TINY
    plus_x, plus_y = (ax * tangent_x + ay * tangent_y) * by_half, (ay * tangent_x - ax * tangent_y) * by_half
    minus_x, minus_y = (bx * tangent_x + by * tangent_y) * by_half, (by * tangent_x - bx * tangent_y) * by_half
    # across the element the shorter arm is known better
    eta = plus_y if of_start < of_end else minus_y
    product_x, product_y = plus_x * minus_x - plus_y * minus_y, plus_x * minus_y + plus_y * minus_x
    return of_start, of_end, 0.5 * (plus_x + minus_x), eta, product_x, product_y


@numba.njit(**OPTIONS)
def _shape(start: complex, end: complex) -> tuple[float, float, float, float, float, float]:
    """Return the half length of an element, its inverse, the tangent, and the square of that."""
    span_x, span_y = end.real - start.real, end.imag - start.imag
    half = 0.5 * math.sqrt(span_x * span_x + span_y * span_y)
    by_half = 1.0 / half
    x, y = 0.5 * span_x * by_half, 0.5 * span_y * by_half
    return half, by_half, x, y, x * x - y * y, 2.0 * x * y


@numba.njit(**OPTIONS)
def _is_far(x: FloatArray, y: FloatArray, start: complex, end: complex) -> bool:
    """Whether all of some points are far from an element."""
    centre_x, centre_y = 0.5 * (start.real + end.real), 0.5 * (start.imag + end.imag)
    span_x, span_y = end.real - start.real, end.imag - start.imag
    nearest = np.inf
    for i in range(x.size):
        away_x, away_y = x[i] - centre_x, y[i] - centre_y
        nearest = min(nearest, away_x * away_x + away_y * away_y)
    return nearest > 0.25 * _FAR_SQUARED * (span_x * span_x + span_y * span_y)


@numba.njit(fastmath=MATHEMATICS, **OPTIONS)
def _single_far(
    constants: FloatArray, x: FloatArray, y: FloatArray, begin: int, start: complex, end: complex, table: FloatArray
) -> None:
    single, _, nu, log_length = constants
    half, by_half, tangent_x, tangent_y, turn_x, turn_y = _shape(start, end)
    centre_x, centre_y = 0.5 * (start.real + end.real), 0.5 * (start.imag + end.imag)
    kappa, factor = 3.0 - 4.0 * nu, single * half
    constant = 1.0 + 2.0 * kappa * math.log(log_length / half)
    own = slice(begin, begin + x.size)
    u, u_x, u_y = table[U, own], table[UC, own], table[UC + 1, own]
    for i in range(x.size):
        away_x, away_y = (x[i] - centre_x) * by_half, (y[i] - centre_y) * by_half
        xi, eta = away_x * tangent_x + away_y * tangent_y, away_y * tangent_x - away_x * tangent_y
        inverse_x, inverse_y, square_x, square_y = _inverse(xi, eta)
        s_x, s_y = _power_series(SERIES, square_x, square_y)
        ratio = 2.0 * (inverse_x + inverse_x * s_x - inverse_y * s_y)
        turn = 2.0 * (inverse_y + inverse_x * s_y + inverse_y * s_x)
        squared, rest = xi * xi + eta * eta, 1.0 - square_x
        logs = 0.5 * log(squared * squared * (rest * rest + square_y * square_y))
        u[i] = factor * (constant - kappa * (logs + 2.0 * s_x))
        real, imaginary = 1.0 + eta * turn, eta * ratio
        u_x[i] = factor * (turn_x * real - turn_y * imaginary)
        u_y[i] = factor * (turn_x * imaginary + turn_y * real)


@numba.njit(fastmath=MATHEMATICS, **OPTIONS)
def _single_near(
    constants: FloatArray, x: FloatArray, y: FloatArray, begin: int, start: complex, end: complex, table: FloatArray
) -> None:
    single, _, nu, log_length = constants
    half, by_half, tangent_x, tangent_y, turn_x, turn_y = _shape(start, end)
    start_x, start_y, end_x, end_y = start.real, start.imag, end.real, end.imag
    kappa, factor = 3.0 - 4.0 * nu, single * half
    # 2 log(l / r0) + log|zeta^2 - 1| = log of the distances from both ends by r0
    constant = 1.0 + kappa * (2.0 + 2.0 * math.log(log_length))
    own = slice(begin, begin + x.size)
    u, u_x, u_y = table[U, own], table[UC, own], table[UC + 1, own]
    for i in range(x.size):
        ax, ay, bx, by = x[i] - start_x, y[i] - start_y, x[i] - end_x, y[i] - end_y
        of_start, of_end, xi, eta, _, _ = _arms(ax, ay, bx, by, tangent_x, tangent_y, by_half)
        inverse_x, inverse_y, square_x, square_y = _inverse(xi, eta)
        s_x, s_y = _power_series(SERIES, square_x, square_y)
        is_far = xi * xi + eta * eta > _FAR_SQUARED
        log_start, log_end = log(of_start), log(of_end)
        ratio, turn = 0.5 * (log_start - log_end), -atan2(ax * by - ay * bx, ax * bx + ay * by)
        ratio = 2.0 * (inverse_x + inverse_x * s_x - inverse_y * s_y) if is_far else ratio
        turn = 2.0 * (inverse_y + inverse_x * s_y + inverse_y * s_x) if is_far else turn
        u[i] = factor * (constant - kappa * (0.5 * (log_start + log_end) + xi * ratio - eta * turn))
        real, imaginary = 1.0 + eta * turn, eta * ratio
        u_x[i] = factor * (turn_x * real - turn_y * imaginary)
        u_y[i] = factor * (turn_x * imaginary + turn_y * real)


@numba.njit(fastmath=MATHEMATICS, **OPTIONS)
def _double_far(
    constants: FloatArray, x: FloatArray, y: FloatArray, begin: int, start: complex, end: complex, table: FloatArray
) -> None:
    _, double, nu, _ = constants
    _, by_half, tangent_x, tangent_y, turn_x, turn_y = _shape(start, end)
    centre_x, centre_y = 0.5 * (start.real + end.real), 0.5 * (start.imag + end.imag)
    of_angle, of_ratio = -double * (2.0 - 2.0 * nu), -double * (1.0 - 2.0 * nu)
    own = slice(begin, begin + x.size)
    t_x, t_y, tc_x, tc_y = table[T, own], table[T + 1, own], table[TC, own], table[TC + 1, own]
    ts_x, ts_y, tsc_x, tsc_y = table[TS, own], table[TS + 1, own], table[TSC, own], table[TSC + 1, own]
    for i in range(x.size):
        away_x, away_y = (x[i] - centre_x) * by_half, (y[i] - centre_y) * by_half
        xi, eta = away_x * tangent_x + away_y * tangent_y, away_y * tangent_x - away_x * tangent_y
        inverse_x, inverse_y, square_x, square_y = _inverse(xi, eta)
        s_x, s_y = _power_series(SERIES, square_x, square_y)
        r_x, r_y = _power_series(REST, square_x, square_y)
        t_x[i] = -2.0 * of_angle * (inverse_y + inverse_x * s_y + inverse_y * s_x)
        t_y[i] = 2.0 * of_ratio * (inverse_x + inverse_x * s_x - inverse_y * s_y)
        ts_x[i], ts_y[i] = -2.0 * of_angle * s_y, 2.0 * of_ratio * s_x
        across_x, across_y = -2.0 * double * eta * turn_x, -2.0 * double * eta * turn_y
        of_x, of_y = s_x + r_x, s_y + r_y
        tc_x[i], tc_y[i] = across_x * of_x + across_y * of_y, across_y * of_x - across_x * of_y
        of_x, of_y = inverse_x * r_x - inverse_y * r_y, inverse_x * r_y + inverse_y * r_x
        tsc_x[i], tsc_y[i] = across_x * of_x + across_y * of_y, across_y * of_x - across_x * of_y


@numba.njit(fastmath=MATHEMATICS, **OPTIONS)
def _double_near(
    constants: FloatArray, x: FloatArray, y: FloatArray, begin: int, start: complex, end: complex, table: FloatArray
) -> None:
    _, double, nu, _ = constants
    half, by_half, tangent_x, tangent_y, turn_x, turn_y = _shape(start, end)
    start_x, start_y, end_x, end_y = start.real, start.imag, end.real, end.imag
    of_angle, of_ratio = -double * (2.0 - 2.0 * nu), -double * (1.0 - 2.0 * nu)
    squared_half = half * half
    own = slice(begin, begin + x.size)
    t_x, t_y, tc_x, tc_y = table[T, own], table[T + 1, own], table[TC, own], table[TC + 1, own]
    ts_x, ts_y, tsc_x, tsc_y = table[TS, own], table[TS + 1, own], table[TSC, own], table[TSC + 1, own]
    for i in range(x.size):
        ax, ay, bx, by = x[i] - start_x, y[i] - start_y, x[i] - end_x, y[i] - end_y
        of_start, of_end, xi, eta, product_x, product_y = _arms(ax, ay, bx, by, tangent_x, tangent_y, by_half)
        inverse_x, inverse_y, square_x, square_y = _inverse(xi, eta)
        s_x, s_y = _power_series(SERIES, square_x, square_y)
        r_x, r_y = _power_series(REST, square_x, square_y)
        is_far = xi * xi + eta * eta > _FAR_SQUARED
        ratio, turn = 0.5 * (log(of_start) - log(of_end)), -atan2(ax * by - ay * bx, ax * bx + ay * by)
        ratio = 2.0 * (inverse_x + inverse_x * s_x - inverse_y * s_y) if is_far else ratio
        turn = 2.0 * (inverse_y + inverse_x * s_y + inverse_y * s_x) if is_far else turn
        moment_x = 2.0 * s_x if is_far else xi * ratio - eta * turn - 2.0
        moment_y = 2.0 * s_y if is_far else xi * turn + eta * ratio
        scale = 2.0 * squared_half * squared_half / (of_start * of_end)
        quotient_x, quotient_y = scale * product_x, -scale * product_y
        t_x[i], t_y[i] = -of_angle * turn, of_ratio * ratio
        ts_x[i], ts_y[i] = -of_angle * moment_y, of_ratio * moment_x
        across_x, across_y = -double * eta * turn_x, -double * eta * turn_y
        tc_x[i] = across_x * quotient_x + across_y * quotient_y
        tc_y[i] = across_y * quotient_x - across_x * quotient_y
        of_x, of_y = xi * quotient_x - eta * quotient_y - ratio, xi * quotient_y + eta * quotient_x - turn
        of_x = 2.0 * (inverse_x * r_x - inverse_y * r_y) if is_far else of_x
        of_y = 2.0 * (inverse_x * r_y + inverse_y * r_x) if is_far else of_y
        tsc_x[i], tsc_y[i] = across_x * of_x + across_y * of_y, across_y * of_x - across_x * of_y


@numba.njit(**OPTIONS)
def _run(x: FloatArray, y: FloatArray, begin: int, start: complex, end: complex) -> tuple[int, bool]:
    """Return where a run of blocks ends that are all far from an element, or all not, and which."""
    is_far = _is_far(x[begin : begin + BLOCK], y[begin : begin + BLOCK], start, end)
    begin += BLOCK
    while begin < x.size and _is_far(x[begin : begin + BLOCK], y[begin : begin + BLOCK], start, end) == is_far:
        begin += BLOCK
    return begin, is_far


@numba.njit(**OPTIONS)
def _correct_single(constants: FloatArray, x: complex, start: complex, end: complex, table: FloatArray, i: int) -> None:
    """Replace the values at a point that is the middle of the element: zeta is zero."""
    single, _, nu, log_length = constants
    half, _, _, _, turn_x, turn_y = _shape(start, end)
    kappa, logs = 3.0 - 4.0 * nu, math.log(abs(x - start)) + math.log(abs(x - end))
    table[U, i] = single * half * (1.0 + kappa * (2.0 + 2.0 * math.log(log_length) - logs))
    table[UC, i], table[UC + 1, i] = single * half * turn_x, single * half * turn_y


@numba.njit(**OPTIONS)
def _correct_double(constants: FloatArray, x: complex, start: complex, end: complex, table: FloatArray, i: int) -> None:
    """Do the same for a displacement and its slope: the angle is a principal value."""
    _, double, nu, _ = constants
    of_ratio = -double * (1.0 - 2.0 * nu)
    table[:, i] = 0.0
    table[T + 1, i] = of_ratio * (math.log(abs(x - start)) - math.log(abs(x - end)))
    table[TS + 1, i] = -2.0 * of_ratio


@numba.njit(**OPTIONS)
def tabulate_single(
    constants: FloatArray, x: FloatArray, y: FloatArray, places: IntArray, number: int, start: complex, end: complex,
    table: FloatArray,
) -> None:  # fmt: skip
    """Fill a table (N_SINGLE, n_points) with what a traction on the element of a number causes at points.

    `places` are the numbers of the elements in whose middle the first points are, those behind in none.
    """
    following = 0
    while following < x.size:
        begin = following
        following, is_far = _run(x, y, begin, start, end)
        if is_far:
            _single_far(constants, x[begin:following], y[begin:following], begin, start, end, table)
        else:
            _single_near(constants, x[begin:following], y[begin:following], begin, start, end, table)
    for i in range(places.size):
        if places[i] == number:
            _correct_single(constants, complex(x[i], y[i]), start, end, table, i)


@numba.njit(**OPTIONS)
def tabulate_double(
    constants: FloatArray, x: FloatArray, y: FloatArray, places: IntArray, number: int, start: complex, end: complex,
    table: FloatArray,
) -> None:  # fmt: skip
    """Fill a table (N_DOUBLE, n_points) with what a displacement and its slope cause; see `tabulate_single`."""
    following = 0
    while following < x.size:
        begin = following
        following, is_far = _run(x, y, begin, start, end)
        if is_far:
            _double_far(constants, x[begin:following], y[begin:following], begin, start, end, table)
        else:
            _double_near(constants, x[begin:following], y[begin:following], begin, start, end, table)
    for i in range(places.size):
        if places[i] == number:
            _correct_double(constants, complex(x[i], y[i]), start, end, table, i)
