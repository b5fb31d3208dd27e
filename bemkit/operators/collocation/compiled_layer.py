"""The layers of straight elements as loops for numba; import it through `compiled`.

The formulas are those of `layers`. A loop without branches, which the compiler runs several points at a time, takes the
series as if all points were far from the element; a second loop replaces the points that are near.
"""

from __future__ import annotations

import math
from typing import Any, TypeAlias

import numba
import numpy as np

from bemkit.arrays import ComplexArray, FloatArray, IntArray
from bemkit.operators.collocation.layers import FAR, REST, SERIES, Constants

_FAST: dict[str, Any] = {"error_model": "numpy", "fastmath": {"contract", "nsz", "nnan", "ninf", "arcp"}}
Ends: TypeAlias = tuple[complex, complex]
_S7, _S6, _S5, _S4, _S3, _S2, _S1 = SERIES
_R7, _R6, _R5, _R4, _R3, _R2, _R1 = REST


@numba.njit(inline="always", error_model="numpy")
def _shape(start: complex, end: complex) -> tuple[float, complex, complex, complex]:
    """Return the half length, the tangent, the middle, and the factor to local coordinates."""
    span = end - start
    half = 0.5 * math.sqrt(span.real * span.real + span.imag * span.imag)
    tangent = span * (0.5 / half)
    return half, tangent, 0.5 * (start + end), tangent.conjugate() * (1.0 / half)


@numba.njit(inline="always", error_model="numpy")
def _far(zeta: complex) -> tuple[complex, complex, complex, complex]:
    """Return 1 / zeta, its square and both series; anything finite where zeta is near."""
    scale = 1.0 / max(zeta.real * zeta.real + zeta.imag * zeta.imag, FAR * FAR)
    inverse = complex(zeta.real * scale, -zeta.imag * scale)
    q = inverse * inverse
    series = ((((((_S7 * q + _S6) * q + _S5) * q + _S4) * q + _S3) * q + _S2) * q + _S1) * q
    rest = ((((((_R7 * q + _R6) * q + _R5) * q + _R4) * q + _R3) * q + _R2) * q + _R1) * q
    return inverse, q, series, rest


@numba.njit(inline="always", error_model="numpy")
def _near(x: complex, ends: Ends, to_local: complex, is_own: bool) -> tuple[complex, complex, float, complex]:
    """Return zeta, L, half the logarithms of both squared distances, and zeta^2 - 1."""
    arm, other = x - ends[0], x - ends[1]
    plus, minus = arm * to_local, other * to_local
    squared, other_squared = arm.real**2 + arm.imag**2, other.real**2 + other.imag**2
    log, other_log = 0.5 * math.log(squared), 0.5 * math.log(other_squared)
    if is_own:
        return 0j, complex(log - other_log, 0.0), log + other_log, -1.0 + 0j
    # near an end the coordinate across the element is known only from there
    zeta = complex(0.5 * (plus.real + minus.real), plus.imag if squared < other_squared else minus.imag)
    turn = arm.conjugate() * other
    return zeta, complex(log - other_log, -math.atan2(turn.imag, turn.real)), log + other_log, plus * minus


@numba.njit(**_FAST)
def _single(
    constants: Constants, x: FloatArray, y: FloatArray, is_own: IntArray, ends: Ends, far: FloatArray, out: ComplexArray
) -> None:
    single, _, nu, log_length = constants
    half, tangent, centre, to_local = _shape(ends[0], ends[1])
    a, kappa = single * half, 3.0 - 4.0 * nu
    constant, turn = 1.0 + kappa * (2.0 + 2.0 * math.log(log_length / half)), tangent * tangent * a
    squares, series_x, turned_x, turned_y = far[0], far[1], far[2], far[3]
    for i in range(x.size):
        zeta = complex(x[i] - centre.real, y[i] - centre.imag) * to_local
        inverse, q, series, _ = _far(zeta)
        log = 2.0 * (inverse + inverse * series)
        squared, rest = zeta.real * zeta.real + zeta.imag * zeta.imag, 1.0 - q.real
        squares[i], series_x[i] = squared * squared * (rest * rest + q.imag * q.imag), 2.0 + 2.0 * series.real
        value = turn * complex(1.0 + zeta.imag * log.imag, zeta.imag * log.real)
        turned_x[i], turned_y[i] = value.real, value.imag
    for i in range(x.size):
        away = complex(x[i] - centre.real, y[i] - centre.imag) * to_local
        if away.real * away.real + away.imag * away.imag <= FAR * FAR:
            zeta, log, logs, _ = _near(complex(x[i], y[i]), ends, to_local, is_own[i])
            logs += (zeta * log).real - 2.0 * math.log(half)
            out[1, i] = turn * complex(1.0 + zeta.imag * log.imag, zeta.imag * log.real)
        else:
            logs = 0.5 * math.log(squares[i]) + series_x[i]
            out[1, i] = complex(turned_x[i], turned_y[i])
        out[0, i] = a * (constant - kappa * logs)


@numba.njit(**_FAST)
def _double(
    constants: Constants, x: FloatArray, y: FloatArray, is_own: IntArray, ends: Ends, far: FloatArray, out: ComplexArray
) -> None:
    _, double, nu, _ = constants
    _, tangent, centre, to_local = _shape(ends[0], ends[1])
    turn, angle, ratio = -double * tangent * tangent, -double * (2.0 - 2.0 * nu), -double * (1.0 - 2.0 * nu)
    v_x, v_y, s_x, s_y, vc_x, vc_y, sc_x, sc_y = far[0], far[1], far[2], far[3], far[4], far[5], far[6], far[7]
    for i in range(x.size):
        zeta = complex(x[i] - centre.real, y[i] - centre.imag) * to_local
        inverse, _, series, rest = _far(zeta)
        log = inverse + inverse * series
        v_x[i], v_y[i] = -2.0 * angle * log.imag, 2.0 * ratio * log.real
        s_x[i], s_y[i] = -2.0 * angle * series.imag, 2.0 * ratio * series.real
        across = 2.0 * turn * zeta.imag
        on_v, on_s = across * (series + rest).conjugate(), across * (inverse * rest).conjugate()
        vc_x[i], vc_y[i], sc_x[i], sc_y[i] = on_v.real, on_v.imag, on_s.real, on_s.imag
    for i in range(x.size):
        away = complex(x[i] - centre.real, y[i] - centre.imag) * to_local
        if away.real * away.real + away.imag * away.imag <= FAR * FAR:
            zeta, log, _, product = _near(complex(x[i], y[i]), ends, to_local, is_own[i])
            scale = 2.0 / (product.real * product.real + product.imag * product.imag)
            quotient, moment = scale * product.conjugate(), zeta * log - 2.0
            out[0, i] = complex(-angle * log.imag, ratio * log.real)
            out[1, i] = complex(-angle * moment.imag, ratio * moment.real)
            out[2, i] = turn * zeta.imag * quotient.conjugate()
            out[3, i] = turn * zeta.imag * (zeta * quotient - log).conjugate()
        else:
            out[0, i], out[1, i] = complex(v_x[i], v_y[i]), complex(s_x[i], s_y[i])
            out[2, i], out[3, i] = complex(vc_x[i], vc_y[i]), complex(sc_x[i], sc_y[i])


@numba.njit(cache=True, nogil=True, **_FAST)
def compiled_layer(
    constants: Constants, is_double: bool, x: ComplexArray, own: IntArray, start: ComplexArray, end: ComplexArray
) -> ComplexArray:
    """Return what `layers.straight_layer` returns."""
    out = np.empty((start.size, 4 if is_double else 2, x.size), np.complex128)
    far, x_x, x_y = np.empty((8, x.size)), x.real.copy(), x.imag.copy()
    for e in range(start.size):
        if is_double:
            _double(constants, x_x, x_y, own == e, (start[e], end[e]), far, out[e])
        else:
            _single(constants, x_x, x_y, own == e, (start[e], end[e]), far, out[e])
    return out
