"""The closed forms of `element_fields` as loops for numba; import it through `compiled` alone."""

from __future__ import annotations

import math

import numba
import numpy as np

from bemkit.arrays import BoolArray, ComplexArray, IntArray
from bemkit.operators.hierarchy.series import FAR, SERIES

_FAR_SQUARED = FAR**2
_options = {"cache": True, "nogil": True, "error_model": "numpy"}


@numba.njit(**_options)
def single_layer_fields(
    single: float,
    poisson_ratio: float,
    log_length: float,
    x: ComplexArray,
    start: ComplexArray,
    end: ComplexArray,
    is_own: BoolArray,
) -> ComplexArray:
    """See `element_fields.single_layer_fields`."""
    kappa = 3.0 - 4.0 * poisson_ratio
    result = np.empty((2, x.size, start.size), np.complex128)
    for j in range(start.size):
        span_x, span_y = end[j].real - start[j].real, end[j].imag - start[j].imag
        half = 0.5 * math.sqrt(span_x * span_x + span_y * span_y)
        tangent_x, tangent_y = 0.5 * span_x / half, 0.5 * span_y / half
        factor = single * half
        turn_x = factor * (tangent_x * tangent_x - tangent_y * tangent_y)
        turn_y = factor * 2.0 * tangent_x * tangent_y
        # 2 log(l / r0) + log|zeta^2 - 1| = log of the distances from both ends by r0
        constant = 1.0 + kappa * (2.0 + 2.0 * math.log(log_length))
        for i in range(x.size):
            ax, ay = x[i].real - start[j].real, x[i].imag - start[j].imag
            bx, by = x[i].real - end[j].real, x[i].imag - end[j].imag
            of_start, of_end = ax * ax + ay * ay, bx * bx + by * by
            log_start, log_end = math.log(of_start), math.log(of_end)
            log_ratio = 0.5 * (log_start - log_end)
            if is_own[i, j]:
                angle, eta = 0.0, 0.0
            else:
                angle = math.atan2(ax * by - ay * bx, ax * bx + ay * by)
                if of_start < of_end:
                    eta = (ay * tangent_x - ax * tangent_y) / half
                else:
                    eta = (by * tangent_x - bx * tangent_y) / half
            xi = 0.5 * ((ax + bx) * tangent_x + (ay + by) * tangent_y) / half
            logs = 0.5 * (log_start + log_end) + xi * log_ratio + eta * angle
            real, imaginary = 1.0 - eta * angle, eta * log_ratio
            result[0, i, j] = factor * (constant - kappa * logs)
            result[1, i, j] = complex(turn_x * real - turn_y * imaginary, turn_x * imaginary + turn_y * real)
    return result


@numba.njit(**_options)
def double_layer_fields(
    double: float,
    poisson_ratio: float,
    x: ComplexArray,
    start: ComplexArray,
    end: ComplexArray,
    is_own: BoolArray,
) -> ComplexArray:
    """See `element_fields.double_layer_fields`."""
    of_angle, of_ratio = -double * (2.0 - 2.0 * poisson_ratio), -double * (1.0 - 2.0 * poisson_ratio)
    result = np.empty((4, x.size, start.size), np.complex128)
    for j in range(start.size):
        span_x, span_y = end[j].real - start[j].real, end[j].imag - start[j].imag
        half = 0.5 * math.sqrt(span_x * span_x + span_y * span_y)
        tangent_x, tangent_y = 0.5 * span_x / half, 0.5 * span_y / half
        turn = complex(-double * (tangent_x * tangent_x - tangent_y * tangent_y), -double * 2.0 * tangent_x * tangent_y)
        for i in range(x.size):
            ax, ay = x[i].real - start[j].real, x[i].imag - start[j].imag
            bx, by = x[i].real - end[j].real, x[i].imag - end[j].imag
            of_start, of_end = ax * ax + ay * ay, bx * bx + by * by
            if is_own[i, j]:
                # zeta is zero: the angle is a principal value, and zeta^2 - 1 is -1
                result[0, i, j] = complex(0.0, 0.5 * of_ratio * math.log(of_start / of_end))
                result[1, i, j] = 0.0
                result[2, i, j] = complex(0.0, -2.0 * of_ratio)
                result[3, i, j] = 0.0
                continue
            if of_start < of_end:
                eta = (ay * tangent_x - ax * tangent_y) / half
            else:
                eta = (by * tangent_x - bx * tangent_y) / half
            zeta = complex(0.5 * ((ax + bx) * tangent_x + (ay + by) * tangent_y) / half, eta)
            # zeta^2 - 1 is the product of the arms from both ends, in local coordinates
            plus = complex(ax * tangent_x + ay * tangent_y, ay * tangent_x - ax * tangent_y)
            minus = complex(bx * tangent_x + by * tangent_y, by * tangent_x - bx * tangent_y)
            product = plus * minus
            scale = 2.0 * half * half / (of_start * of_end)
            quotient = complex(scale * product.real, -scale * product.imag)
            squared = zeta.real * zeta.real + zeta.imag * zeta.imag
            if squared > _FAR_SQUARED:
                inverse = complex(zeta.real / squared, -zeta.imag / squared)
                square = inverse * inverse
                series = complex(0.0, 0.0)
                for factor in SERIES:
                    series = (series + factor) * square
                log, moment = 2.0 * inverse * (1.0 + series), 2.0 * series
                of_moment = 2.0 * inverse * (square / (1.0 - square) - series)
            else:
                angle = math.atan2(ax * by - ay * bx, ax * bx + ay * by)
                log = complex(0.5 * math.log(of_start / of_end), -angle)
                moment, of_moment = zeta * log - 2.0, zeta * quotient - log
            result[0, i, j] = complex(-of_angle * log.imag, of_ratio * log.real)
            result[1, i, j] = turn * eta * quotient.conjugate()
            result[2, i, j] = complex(-of_angle * moment.imag, of_ratio * moment.real)
            result[3, i, j] = turn * eta * of_moment.conjugate()
    return result


@numba.njit(**_options)
def with_slopes(
    fields: ComplexArray, is_own: BoolArray, at: IntArray, slopes: ComplexArray, means: ComplexArray
) -> ComplexArray:
    """Return the factors (2, n_points, n_columns) of displacements with slopes and of their conjugates.

    Parameters
    ----------
    fields : (4, n_points, n_elements) complex array
        What `double_layer_fields` returns, and 1/2 where a point is the middle of the element.
    is_own : (n_points, n_elements) bool array
        Where it is.
    at : (3, n_columns) int array
        The elements on which each displacement acts; itself in the middle.
    slopes, means : (3, n_columns) complex arrays
        Its weights there.
    """
    result = np.empty((2, fields.shape[1], at.shape[1]), np.complex128)
    for i in range(fields.shape[1]):
        for j in range(at.shape[1]):
            on, on_conjugate = fields[0, i, at[1, j]], fields[1, i, at[1, j]]
            for k in range(3):
                element = at[k, j]
                free = fields[0, i, element]
                if is_own[i, element]:
                    free -= 0.5
                on += fields[2, i, element] * slopes[k, j] + free * means[k, j]
                on_conjugate += (
                    fields[3, i, element] * slopes[k, j].conjugate() + fields[1, i, element] * means[k, j].conjugate()
                )
            result[0, i, j] = on
            result[1, i, j] = on_conjugate
    return result
