"""The layers of straight elements as loops for numba; import them through `compiled`.

The formulas are those of `layers`. A vectorised loop without branches evaluates the far series at all points; a second
loop replaces the values at near points.
"""

from __future__ import annotations

import math
from typing import Any, TypeAlias

import numba
import numpy as np

from bemkit.arrays import ComplexArray, FloatArray, IntArray
from bemkit.operators.collocation.layers import FAR, REST, SERIES, Constants, Elements, Unknowns

_FAST: dict[str, Any] = {"error_model": "numpy", "fastmath": {"contract", "nsz", "nnan", "ninf", "arcp"}}
Ends: TypeAlias = tuple[complex, complex]
BLOCK = 32
"""Points whose factors are in the cache together."""
_S7, _S6, _S5, _S4, _S3, _S2, _S1 = SERIES
_R7, _R6, _R5, _R4, _R3, _R2, _R1 = REST


@numba.njit(inline="always", error_model="numpy")
def _shape(start: complex, end: complex) -> tuple[float, complex, complex, complex]:
    """Return the half length, the tangent, the midpoint, and the factor to local coordinates."""
    span = end - start
    half = 0.5 * math.sqrt(span.real * span.real + span.imag * span.imag)
    tangent = span * (0.5 / half)
    return half, tangent, 0.5 * (start + end), tangent.conjugate() * (1.0 / half)


@numba.njit(inline="always", error_model="numpy")
def _far(zeta: complex) -> tuple[complex, complex, complex, complex]:
    """Return 1 / zeta, its square and both series; at near points any finite values."""
    scale = 1.0 / max(zeta.real * zeta.real + zeta.imag * zeta.imag, FAR * FAR)
    inverse = complex(zeta.real * scale, -zeta.imag * scale)
    q = inverse * inverse
    series = ((((((_S7 * q + _S6) * q + _S5) * q + _S4) * q + _S3) * q + _S2) * q + _S1) * q
    rest = ((((((_R7 * q + _R6) * q + _R5) * q + _R4) * q + _R3) * q + _R2) * q + _R1) * q
    return inverse, q, series, rest


@numba.njit(inline="always", error_model="numpy")
def _near(x: complex, ends: Ends, to_local: complex, is_midpoint: bool) -> tuple[complex, complex, float, complex]:
    """Return zeta, L, the sum of the logarithms of both distances, and zeta^2 - 1."""
    arm, other = x - ends[0], x - ends[1]
    plus, minus = arm * to_local, other * to_local
    squared, other_squared = arm.real**2 + arm.imag**2, other.real**2 + other.imag**2
    log, other_log = 0.5 * math.log(squared), 0.5 * math.log(other_squared)
    if is_midpoint:
        return 0j, complex(log - other_log, 0.0), log + other_log, -1.0 + 0j
    # eta is accurate only if measured from the nearer end node
    zeta = complex(0.5 * (plus.real + minus.real), plus.imag if squared < other_squared else minus.imag)
    turn = arm.conjugate() * other
    return zeta, complex(log - other_log, -math.atan2(turn.imag, turn.real)), log + other_log, plus * minus


@numba.njit(**_FAST)
def _is_near(x: FloatArray, y: FloatArray, ends: Ends) -> bool:
    """Whether any of some points is near an element."""
    centre, span, nearest = 0.5 * (ends[0] + ends[1]), ends[1] - ends[0], np.inf
    for i in range(x.size):
        away_x, away_y = x[i] - centre.real, y[i] - centre.imag
        nearest = min(nearest, away_x * away_x + away_y * away_y)
    return nearest <= 0.25 * FAR * FAR * (span.real * span.real + span.imag * span.imag)


@numba.njit(**_FAST)
def _single(
    constants: Constants,
    x: FloatArray,
    y: FloatArray,
    centred_on: IntArray,
    element: int,
    ends: Ends,
    table: FloatArray,
) -> None:
    """Write the factors of p and conj(p), real and imaginary parts, at a block of points into a table (4 BLOCK,)."""
    single, _, nu, log_length = constants
    half, tangent, centre, to_local = _shape(ends[0], ends[1])
    a, kappa = single * half, 3.0 - 4.0 * nu
    constant, turn = 1.0 + kappa * (2.0 + 2.0 * math.log(log_length / half)), tangent * tangent * a
    for i in range(BLOCK):
        zeta = complex(x[i] - centre.real, y[i] - centre.imag) * to_local
        inverse, q, series, _ = _far(zeta)
        log = 2.0 * (inverse + inverse * series)
        squared, rest = zeta.real * zeta.real + zeta.imag * zeta.imag, 1.0 - q.real
        value = turn * complex(1.0 + zeta.imag * log.imag, zeta.imag * log.real)
        table[i] = squared * squared * (rest * rest + q.imag * q.imag)
        table[i + BLOCK] = a * (constant - kappa * (2.0 + 2.0 * series.real))
        table[i + 2 * BLOCK], table[i + 3 * BLOCK] = value.real, value.imag
    for i in range(BLOCK):
        table[i] = table[i + BLOCK] - 0.5 * a * kappa * math.log(table[i])
        table[i + BLOCK] = 0.0
    for i in range(BLOCK if _is_near(x, y, ends) else 0):
        away = complex(x[i] - centre.real, y[i] - centre.imag) * to_local
        if away.real * away.real + away.imag * away.imag <= FAR * FAR:
            zeta, log, logs, _ = _near(complex(x[i], y[i]), ends, to_local, centred_on[i] == element)
            logs += (zeta * log).real - 2.0 * math.log(half)
            value = turn * complex(1.0 + zeta.imag * log.imag, zeta.imag * log.real)
            table[i] = a * (constant - kappa * logs)
            table[i + 2 * BLOCK], table[i + 3 * BLOCK] = value.real, value.imag


@numba.njit(**_FAST)
def _double(
    constants: Constants,
    x: FloatArray,
    y: FloatArray,
    centred_on: IntArray,
    element: int,
    ends: Ends,
    table: FloatArray,
) -> None:
    """Write the factors of v, s, conj(v) and conj(s) at a block of points into a table (8 BLOCK,)."""
    _, double, nu, _ = constants
    _, tangent, centre, to_local = _shape(ends[0], ends[1])
    turn, angle, ratio = -double * tangent * tangent, -double * (2.0 - 2.0 * nu), -double * (1.0 - 2.0 * nu)
    for i in range(BLOCK):
        zeta = complex(x[i] - centre.real, y[i] - centre.imag) * to_local
        inverse, _, series, rest = _far(zeta)
        log, across = inverse + inverse * series, 2.0 * turn * zeta.imag
        table[i], table[i + BLOCK] = -2.0 * angle * log.imag, 2.0 * ratio * log.real
        table[i + 2 * BLOCK], table[i + 3 * BLOCK] = -2.0 * angle * series.imag, 2.0 * ratio * series.real
        on_v, on_s = across * (series + rest).conjugate(), across * (inverse * rest).conjugate()
        table[i + 4 * BLOCK], table[i + 5 * BLOCK] = on_v.real, on_v.imag
        table[i + 6 * BLOCK], table[i + 7 * BLOCK] = on_s.real, on_s.imag
    for i in range(BLOCK if _is_near(x, y, ends) else 0):
        away = complex(x[i] - centre.real, y[i] - centre.imag) * to_local
        if away.real * away.real + away.imag * away.imag <= FAR * FAR:
            zeta, log, _, product = _near(complex(x[i], y[i]), ends, to_local, centred_on[i] == element)
            scale = 2.0 / (product.real * product.real + product.imag * product.imag)
            quotient, moment = scale * product.conjugate(), zeta * log - 2.0
            on_v = turn * zeta.imag * quotient.conjugate()
            on_s = turn * zeta.imag * (zeta * quotient - log).conjugate()
            table[i], table[i + BLOCK] = -angle * log.imag, ratio * log.real
            table[i + 2 * BLOCK], table[i + 3 * BLOCK] = -angle * moment.imag, ratio * moment.real
            table[i + 4 * BLOCK], table[i + 5 * BLOCK] = on_v.real, on_v.imag
            table[i + 6 * BLOCK], table[i + 7 * BLOCK] = on_s.real, on_s.imag


@numba.njit(**_FAST)
def _add(weights: ComplexArray, table: FloatArray, total: FloatArray) -> None:
    """Add weights times the factors of the densities at a block of points to the sums of an unknown (4 BLOCK,)."""
    a, b = weights[0].real, weights[0].imag
    if weights.size == 1:
        for i in range(BLOCK):
            total[i] += a * table[i] - b * table[i + BLOCK]
            total[i + BLOCK] += a * table[i + BLOCK] + b * table[i]
            total[i + 2 * BLOCK] += a * table[i + 2 * BLOCK] + b * table[i + 3 * BLOCK]
            total[i + 3 * BLOCK] += a * table[i + 3 * BLOCK] - b * table[i + 2 * BLOCK]
        return
    c, d = weights[1].real, weights[1].imag
    for i in range(BLOCK):
        v_x, v_y, s_x, s_y = table[i], table[i + BLOCK], table[i + 2 * BLOCK], table[i + 3 * BLOCK]
        total[i] += a * v_x - b * v_y + c * s_x - d * s_y
        total[i + BLOCK] += a * v_y + b * v_x + c * s_y + d * s_x
        v_x, v_y = table[i + 4 * BLOCK], table[i + 5 * BLOCK]
        s_x, s_y = table[i + 6 * BLOCK], table[i + 7 * BLOCK]
        total[i + 2 * BLOCK] += a * v_x + b * v_y + c * s_x + d * s_y
        total[i + 3 * BLOCK] += a * v_y - b * v_x + c * s_y - d * s_x


@numba.njit(**_FAST)
def _store(total: FloatArray, is_y: int, out: ComplexArray) -> None:
    """Store the displacement of a unit unknown: 1 along x, or i along y."""
    for i in range(out.size):
        on, conjugate = complex(total[i], total[i + BLOCK]), complex(total[i + 2 * BLOCK], total[i + 3 * BLOCK])
        if is_y:
            on, conjugate = complex(-on.imag, on.real), complex(conjugate.imag, -conjugate.real)
        out[i] = on + conjugate


@numba.njit(cache=True, nogil=True, **_FAST)
def compiled_layer(
    constants: Constants, is_double: bool, x: ComplexArray, centred_on: IntArray, elements: Elements, unknowns: Unknowns
) -> ComplexArray:
    """Return the same as `layers.straight_layer`."""
    start, end = elements
    n_densities = 2 if is_double else 1
    out = np.empty((unknowns.columns.size, x.size), np.complex128)
    tables, total = np.empty((start.size, 4 * n_densities * BLOCK)), np.empty(4 * BLOCK)
    block_x, block_y, block_centred_on = np.empty(BLOCK), np.empty(BLOCK), np.empty(BLOCK, np.int64)
    for begin in range(0, x.size, BLOCK):
        # the last point is repeated to fill a block
        for i in range(BLOCK):
            at = min(begin + i, x.size - 1)
            block_x[i], block_y[i], block_centred_on[i] = x[at].real, x[at].imag, centred_on[at]
        for e in range(start.size):
            if is_double:
                _double(constants, block_x, block_y, block_centred_on, e, (start[e], end[e]), tables[e])
            else:
                _single(constants, block_x, block_y, block_centred_on, e, (start[e], end[e]), tables[e])
        ready = -1
        for c in range(unknowns.columns.size):
            unknown = unknowns.columns[c] // 2
            if unknown != ready:
                ready, total[:] = unknown, 0.0
                for k in range(unknowns.elements.shape[1]):
                    _add(unknowns.weights[unknown, k], tables[unknowns.elements[unknown, k]], total)
            _store(total, unknowns.columns[c] % 2, out[c, begin : begin + BLOCK])
    return out
