"""The closed forms of `element_fields` as loops for numba; import it through `compiled` alone.

The inner loops run over points, without a branch, so that the compiler takes several points at a time. What one element
causes at all points stands in a table whose rows are the numbers named by `_U` ... `_TS`, complex ones as two rows.
"""

from __future__ import annotations

import math
from typing import Any

import numba
import numpy as np

from bemkit.arrays import ComplexArray, FloatArray, IntArray
from bemkit.operators.hierarchy.compiled_functions import MATHEMATICS, atan2, log
from bemkit.operators.hierarchy.series import FAR, SERIES

_FAR_SQUARED = FAR**2
_S9, _S8, _S7, _S6, _S5, _S4, _S3, _S2, _S1 = SERIES
_U, _UC, _T, _TC, _TS, _TSC = 0, 1, 3, 5, 7, 9
_N_ROWS = 11
"""U p (real) and its conjugate part; T v, its conjugate part; the same of slopes."""
_SLOTS = 4
"""Tables that are kept: of an element, of its two neighbours along the boundary, and one that is free."""
_TINY = 1e-300
_options: dict[str, Any] = {"cache": True, "nogil": True, "error_model": "numpy"}


@numba.njit(inline="always", error_model="numpy")
def _next(real: float, imaginary: float, factor: float, square_x: float, square_y: float) -> tuple[float, float]:
    real += factor
    return real * square_x - imaginary * square_y, real * square_y + imaginary * square_x


@numba.njit(fastmath=MATHEMATICS, **_options)
def _tabulate(
    constants: FloatArray, x: FloatArray, y: FloatArray, start: complex, end: complex, table: FloatArray
) -> None:
    """Fill a table (11, n_points) with what an element causes at points none of which is its middle."""
    single, double, nu, log_length = constants
    kappa, of_angle, of_ratio = 3.0 - 4.0 * nu, -double * (2.0 - 2.0 * nu), -double * (1.0 - 2.0 * nu)
    start_x, start_y, end_x, end_y = start.real, start.imag, end.real, end.imag
    span_x, span_y = end_x - start_x, end_y - start_y
    half = 0.5 * math.sqrt(span_x * span_x + span_y * span_y)
    by_half = 1.0 / half
    tangent_x, tangent_y = 0.5 * span_x * by_half, 0.5 * span_y * by_half
    turn_x, turn_y = tangent_x * tangent_x - tangent_y * tangent_y, 2.0 * tangent_x * tangent_y
    factor = single * half
    # 2 log(l / r0) + log|zeta^2 - 1| = log of the distances from both ends by r0
    constant = 1.0 + kappa * (2.0 + 2.0 * math.log(log_length))
    u, u_x, u_y, t_x, t_y, tc_x, tc_y, ts_x, ts_y, tsc_x, tsc_y = (
        table[0], table[1], table[2], table[3], table[4], table[5], table[6], table[7], table[8], table[9], table[10],
    )  # fmt: skip
    for i in range(x.size):
        ax, ay, bx, by = x[i] - start_x, y[i] - start_y, x[i] - end_x, y[i] - end_y
        of_start, of_end = ax * ax + ay * ay + _TINY, bx * bx + by * by + _TINY
        log_start, log_end = log(of_start), log(of_end)
        # arms from both ends in local coordinates; across the element the shorter one is known better
        plus_x, plus_y = ax * tangent_x + ay * tangent_y, ay * tangent_x - ax * tangent_y
        minus_x, minus_y = bx * tangent_x + by * tangent_y, by * tangent_x - bx * tangent_y
        xi = 0.5 * by_half * (plus_x + minus_x)
        eta = by_half * (plus_y if of_start < of_end else minus_y)
        scale = 2.0 * half * half / (of_start * of_end)
        quotient_x = scale * (plus_x * minus_x - plus_y * minus_y)
        quotient_y = -scale * (plus_x * minus_y + plus_y * minus_x)
        # the series, also where it is not taken
        squared = xi * xi + eta * eta
        is_far = squared > _FAR_SQUARED
        by_squared = 1.0 / max(squared, _FAR_SQUARED)
        inverse_x, inverse_y = xi * by_squared, -eta * by_squared
        square_x, square_y = inverse_x * inverse_x - inverse_y * inverse_y, 2.0 * inverse_x * inverse_y
        series_x, series_y = _next(0.0, 0.0, _S9, square_x, square_y)
        series_x, series_y = _next(series_x, series_y, _S8, square_x, square_y)
        series_x, series_y = _next(series_x, series_y, _S7, square_x, square_y)
        series_x, series_y = _next(series_x, series_y, _S6, square_x, square_y)
        series_x, series_y = _next(series_x, series_y, _S5, square_x, square_y)
        series_x, series_y = _next(series_x, series_y, _S4, square_x, square_y)
        series_x, series_y = _next(series_x, series_y, _S3, square_x, square_y)
        series_x, series_y = _next(series_x, series_y, _S2, square_x, square_y)
        series_x, series_y = _next(series_x, series_y, _S1, square_x, square_y)
        rest_x, rest_y = 1.0 - square_x, -square_y
        by_rest = 1.0 / (rest_x * rest_x + rest_y * rest_y)
        left_x = (square_x * rest_x + square_y * rest_y) * by_rest - series_x
        left_y = (square_y * rest_x - square_x * rest_y) * by_rest - series_y
        far_x = 2.0 * (inverse_x + inverse_x * series_x - inverse_y * series_y)
        far_y = 2.0 * (inverse_y + inverse_x * series_y + inverse_y * series_x)
        ratio = far_x if is_far else 0.5 * (log_start - log_end)
        turn = far_y if is_far else -atan2(ax * by - ay * bx, ax * bx + ay * by)
        moment_x = 2.0 * series_x if is_far else xi * ratio - eta * turn - 2.0
        moment_y = 2.0 * series_y if is_far else xi * turn + eta * ratio
        slope_x = (
            2.0 * (inverse_x * left_x - inverse_y * left_y) if is_far else xi * quotient_x - eta * quotient_y - ratio
        )
        slope_y = (
            2.0 * (inverse_x * left_y + inverse_y * left_x) if is_far else xi * quotient_y + eta * quotient_x - turn
        )
        u[i] = factor * (constant - kappa * (0.5 * (log_start + log_end) + xi * ratio - eta * turn))
        real, imaginary = 1.0 + eta * turn, eta * ratio
        u_x[i] = factor * (turn_x * real - turn_y * imaginary)
        u_y[i] = factor * (turn_x * imaginary + turn_y * real)
        t_x[i], t_y[i] = -of_angle * turn, of_ratio * ratio
        ts_x[i], ts_y[i] = -of_angle * moment_y, of_ratio * moment_x
        across_x, across_y = -double * eta * turn_x, -double * eta * turn_y
        tc_x[i], tc_y[i] = across_x * quotient_x + across_y * quotient_y, across_y * quotient_x - across_x * quotient_y
        tsc_x[i], tsc_y[i] = across_x * slope_x + across_y * slope_y, across_y * slope_x - across_x * slope_y


@numba.njit(**_options)
def _correct(constants: FloatArray, x: complex, start: complex, end: complex, table: FloatArray, i: int) -> None:
    """Replace the values at a point that is the middle of the element: zeta is zero, the angle a principal value."""
    single, double, nu, log_length = constants
    kappa, of_ratio = 3.0 - 4.0 * nu, -double * (1.0 - 2.0 * nu)
    half = 0.5 * abs(end - start)
    turn = ((end - start) / (2.0 * half)) ** 2
    table[:, i] = 0.0
    logs = math.log(abs(x - start)) + math.log(abs(x - end))
    table[_U, i] = single * half * (1.0 + kappa * (2.0 + 2.0 * math.log(log_length) - logs))
    table[_UC, i], table[_UC + 1, i] = single * half * turn.real, single * half * turn.imag
    table[_T + 1, i] = of_ratio * (math.log(abs(x - start)) - math.log(abs(x - end)))
    table[_TS + 1, i] = -2.0 * of_ratio


@numba.njit(**_options)
def element_fields(
    constants: FloatArray, x: ComplexArray, places: IntArray, start: ComplexArray, end: ComplexArray
) -> ComplexArray:
    """See `element_fields.element_fields`."""
    table = np.empty((_N_ROWS, x.size))
    x_x, x_y = x.real.copy(), x.imag.copy()
    result = np.empty((6, x.size, start.size), np.complex128)
    for j in range(start.size):
        _tabulate(constants, x_x, x_y, start[j], end[j], table)
        for i in range(x.size):
            if places[i] == j:
                _correct(constants, x[i], start[j], end[j], table, i)
            result[0, i, j] = table[_U, i]
            for k in range(1, 6):
                result[k, i, j] = complex(table[2 * k - 1, i], table[2 * k, i])
    return result


@numba.njit(**_options)
def _slot_of(element: int, wanted: IntArray, held: IntArray) -> int:
    """Return the slot that holds an element, else one that holds none of the wanted ones."""
    for slot in range(_SLOTS):
        if held[slot] == element:
            return slot
    for slot in range(_SLOTS):
        if held[slot] != wanted[0] and held[slot] != wanted[1] and held[slot] != wanted[2]:
            return slot
    return 0


@numba.njit(fastmath=MATHEMATICS, **_options)
def _add(real: FloatArray, imaginary: FloatArray, of: FloatArray, row: int, factor: complex) -> None:
    """Add a row of complex numbers times a factor."""
    of_x, of_y, factor_x, factor_y = of[row], of[row + 1], factor.real, factor.imag
    for i in range(real.size):
        real[i] += factor_x * of_x[i] - factor_y * of_y[i]
        imaginary[i] += factor_x * of_y[i] + factor_y * of_x[i]


@numba.njit(fastmath=MATHEMATICS, **_options)
def _store(on: FloatArray, component: int, result: FloatArray) -> None:
    """Store what a unit along x or y causes, from the factors of it and of its conjugate; rows of `on` are parts."""
    on_x, on_y, conjugate_x, conjugate_y = on[0], on[1], on[2], on[3]
    for i in range(on_x.size):
        if component == 0:
            result[2 * i], result[2 * i + 1] = on_x[i] + conjugate_x[i], on_y[i] + conjugate_y[i]
        else:
            result[2 * i], result[2 * i + 1] = conjugate_y[i] - on_y[i], on_x[i] - conjugate_x[i]


@numba.njit(**_options)
def columns(
    constants: FloatArray,
    x: ComplexArray,
    places: IntArray,
    start: ComplexArray,
    end: ComplexArray,
    neighbours: IntArray,
    slopes: ComplexArray,
    means: ComplexArray,
    wanted: IntArray,
) -> FloatArray:
    """Return what columns cause at points, (n_columns, 2 n_points); see `BoundaryColumns.fields`.

    Without slopes `slopes` and `means` are empty. Columns of one element that follow each other are evaluated at once.
    """
    n_around = slopes.shape[0]
    x_x, x_y = x.real.copy(), x.imag.copy()
    tables, held = np.empty((_SLOTS, _N_ROWS, x.size)), np.full(_SLOTS, -2)
    result, on = np.empty((wanted.size, 2 * x.size)), np.empty((2, 4, x.size))
    needed, ready, slots = np.empty(3, np.int64), np.full(2, -2), np.zeros(3, np.int64)
    for c in range(wanted.size):
        element, kind, component = wanted[c] >> 2, (wanted[c] >> 1) & 1, wanted[c] & 1
        if ready[kind] != element:
            needed[:] = element
            if kind == 1 and n_around:
                needed[:] = neighbours[:, element]
            for k in range(3):
                slot = _slot_of(needed[k], needed, held)
                slots[k] = slot
                if held[slot] != needed[k]:
                    held[slot] = needed[k]
                    _tabulate(constants, x_x, x_y, start[needed[k]], end[needed[k]], tables[slot])
                    for i in range(x.size):
                        if places[i] == needed[k]:
                            _correct(constants, x[i], start[needed[k]], end[needed[k]], tables[slot], i)
            _combine(tables, slots, kind, on[kind])
            for k in range(n_around if kind == 1 else 0):
                # an element is the one after its predecessor, itself, and the one before its successor
                slope, mean = slopes[2 - k, needed[k]], means[2 - k, needed[k]]
                table = tables[slots[k]]
                _add(on[1, 0], on[1, 1], table, _TS, slope)
                _add(on[1, 0], on[1, 1], table, _T, mean)
                _add(on[1, 2], on[1, 3], table, _TSC, slope.conjugate())
                _add(on[1, 2], on[1, 3], table, _TC, mean.conjugate())
            if kind == 1:
                for i in range(x.size):
                    if places[i] == element:
                        on[1, 0, i] += 0.5
            ready[kind] = element
        _store(on[kind], component, result[c])
    return result


@numba.njit(**_options)
def _combine(tables: FloatArray, slots: IntArray, kind: int, on: FloatArray) -> None:
    """Take over what a traction (kind 0, with its sign in the equations) or a constant displacement causes."""
    table = tables[slots[1]]
    if kind == 0:
        on[0], on[1] = -table[_U], 0.0
        on[2], on[3] = -table[_UC], -table[_UC + 1]
    else:
        on[0], on[1], on[2], on[3] = table[_T], table[_T + 1], table[_TC], table[_TC + 1]


@numba.njit(fastmath=MATHEMATICS, **_options)
def point_forces(kappa: float, log_length: float, x: ComplexArray, sources: ComplexArray) -> FloatArray:
    """See `proxies.point_forces`; (2 n_sources, 2 n_points), components of points side by side."""
    n = sources.size
    result, x_x, x_y = np.empty((2 * n, 2 * x.size)), x.real.copy(), x.imag.copy()
    constant = kappa * math.log(log_length)
    for s in range(n):
        along_x, along_y, source_x, source_y = result[2 * s], result[2 * s + 1], sources[s].real, sources[s].imag
        for i in range(x_x.size):
            dx, dy = x_x[i] - source_x, x_y[i] - source_y
            squared = dx * dx + dy * dy + _TINY
            of_log, inverse = constant - 0.5 * kappa * log(squared), 1.0 / squared
            mixed = dx * dy * inverse
            along_x[2 * i], along_x[2 * i + 1] = of_log + dx * dx * inverse, mixed
            along_y[2 * i], along_y[2 * i + 1] = mixed, of_log + dy * dy * inverse
    return result


@numba.njit(**_options)
def applied(
    constants: FloatArray,
    x: ComplexArray,
    places: IntArray,
    start: ComplexArray,
    end: ComplexArray,
    traction: ComplexArray,
    displacement: ComplexArray,
    slope: ComplexArray,
) -> ComplexArray:
    """Return T (u + s t) - U t at points (n,), all elements together; see `BoundaryColumns.applied`."""
    table, x_x, x_y = np.empty((_N_ROWS, x.size)), x.real.copy(), x.imag.copy()
    real, imaginary = np.zeros(x.size), np.zeros(x.size)
    for j in range(start.size):
        _tabulate(constants, x_x, x_y, start[j], end[j], table)
        for i in range(x.size):
            if places[i] == j:
                _correct(constants, x[i], start[j], end[j], table, i)
        t, u, s = traction[j], displacement[j], slope[j]
        real -= t.real * table[_U]
        imaginary -= t.imag * table[_U]
        _add(real, imaginary, table, _UC, -t.conjugate())
        _add(real, imaginary, table, _T, u)
        _add(real, imaginary, table, _TC, u.conjugate())
        _add(real, imaginary, table, _TS, s)
        _add(real, imaginary, table, _TSC, s.conjugate())
    return real + 1j * imaginary
