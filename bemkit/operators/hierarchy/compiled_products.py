"""Products with the layers of straight elements nearby, as loops for numba; import it through `compiled` alone.

The closed forms are those of `compiled_tables`, in the axes of each element and summed at once. Errors count by the
largest term, not by each one, so that constant densities need no series at any distance.
"""

from __future__ import annotations

import math

import numba
import numpy as np

from bemkit.arrays import ComplexArray, FloatArray, IntArray
from bemkit.operators.hierarchy.compiled_functions import MATHEMATICS, OPTIONS, atan2, log

_TINY = 1e-300
_FAR_SQUARED = 1e4
"""Square of the distance, by half the length of an element, from which on three terms of a series are exact."""


@numba.njit(fastmath=MATHEMATICS, **OPTIONS)
def _add(
    constants: FloatArray,
    x: FloatArray,
    y: FloatArray,
    start: complex,
    end: complex,
    traction: complex,
    displacement: complex,
    slope: complex,
    real: FloatArray,
    imaginary: FloatArray,
) -> None:
    """Add T (u + s t) - U t of an element at points none of which is its middle."""
    single, double, nu, log_length = constants
    kappa, of_angle, of_ratio = 3.0 - 4.0 * nu, double * (2.0 - 2.0 * nu), -double * (1.0 - 2.0 * nu)
    start_x, start_y, end_x, end_y = start.real, start.imag, end.real, end.imag
    half = 0.5 * abs(end - start)
    by_half = 1.0 / half
    tangent = 0.5 * by_half * (end - start)
    tangent_x, tangent_y = tangent.real, tangent.imag
    local_t = single * half * traction * tangent.conjugate()
    local_u, local_s = displacement * tangent.conjugate(), slope * tangent.conjugate()
    t_x, t_y, u_x, u_y, s_x, s_y = local_t.real, local_t.imag, local_u.real, local_u.imag, local_s.real, local_s.imag
    constant = 1.0 + kappa * (2.0 + 2.0 * math.log(log_length))
    for i in range(x.size):
        ax, ay, bx, by = x[i] - start_x, y[i] - start_y, x[i] - end_x, y[i] - end_y
        of_start, of_end = ax * ax + ay * ay + _TINY, bx * bx + by * by + _TINY
        plus_x, plus_y = ax * tangent_x + ay * tangent_y, ay * tangent_x - ax * tangent_y
        minus_x, minus_y = bx * tangent_x + by * tangent_y, by * tangent_x - bx * tangent_y
        xi = 0.5 * by_half * (plus_x + minus_x)
        eta = by_half * (plus_y if of_start < of_end else minus_y)
        inverse = 1.0 / (of_start * of_end)
        quotient_x = 2.0 * half * half * inverse * (plus_x * minus_x - plus_y * minus_y)
        quotient_y = -2.0 * half * half * inverse * (plus_x * minus_y + plus_y * minus_x)
        ratio = 0.5 * log(of_start * of_start * inverse)
        turn = -atan2(ax * by - ay * bx, ax * bx + ay * by)
        arm_x, arm_y = xi * ratio - eta * turn, xi * turn + eta * ratio
        # what acts on the densities, and on their conjugates
        of_t = constant - kappa * (0.5 * log(of_start * of_end) + arm_x)
        conjugate_x, conjugate_y = 1.0 + eta * turn, eta * ratio
        moment_x, moment_y = arm_x - 2.0, arm_y
        slope_x = xi * quotient_x - eta * quotient_y - ratio
        slope_y = xi * quotient_y + eta * quotient_x - turn
        # of slopes from afar these are nothing but round-off; v = 1 / (zeta^2 - 1)
        v_x, v_y = 0.5 * quotient_x, 0.5 * quotient_y
        square_x, square_y = v_x * v_x - v_y * v_y, 2.0 * v_x * v_y
        if xi * xi + eta * eta > _FAR_SQUARED:
            factor_x, factor_y = 2.0 / 3.0 - 4.0 / 15.0 * v_x, -4.0 / 15.0 * v_y
            factor_x += 16.0 / 105.0 * square_x
            factor_y += 16.0 / 105.0 * square_y
            moment_x, moment_y = v_x * factor_x - v_y * factor_y, v_x * factor_y + v_y * factor_x
            factor_x, factor_y = 4.0 / 3.0 - 16.0 / 15.0 * v_x, -16.0 / 15.0 * v_y
            arm_square_x, arm_square_y = xi * square_x - eta * square_y, xi * square_y + eta * square_x
            slope_x = arm_square_x * factor_x - arm_square_y * factor_y
            slope_y = arm_square_x * factor_y + arm_square_y * factor_x
        angle_x, angle_y = of_angle * (u_x * turn + s_x * moment_y), of_angle * (u_y * turn + s_y * moment_y)
        ratio_x, ratio_y = of_ratio * (u_x * ratio + s_x * moment_x), of_ratio * (u_y * ratio + s_y * moment_x)
        across = double * eta
        across_x = across * (u_x * quotient_x - u_y * quotient_y + s_x * slope_x - s_y * slope_y)
        across_y = across * (u_x * quotient_y + u_y * quotient_x + s_x * slope_y + s_y * slope_x)
        of_x = angle_x - ratio_y - across_x - of_t * t_x - (conjugate_x * t_x + conjugate_y * t_y)
        of_y = angle_y + ratio_x + across_y - of_t * t_y - (conjugate_y * t_x - conjugate_x * t_y)
        real[i] += of_x * tangent_x - of_y * tangent_y
        imaginary[i] += of_x * tangent_y + of_y * tangent_x


@numba.njit(**OPTIONS)
def _own(
    constants: FloatArray, x: complex, start: complex, end: complex, traction: complex, displacement: complex,
    slope: complex,
) -> complex:  # fmt: skip
    """Return the same in the middle of the element, the angle a principal value."""
    single, double, nu, log_length = constants
    kappa, of_ratio = 3.0 - 4.0 * nu, -double * (1.0 - 2.0 * nu)
    half = 0.5 * abs(end - start)
    turn = ((end - start) / (2.0 * half)) ** 2
    to_start, to_end = math.log(abs(x - start)), math.log(abs(x - end))
    of_t = 1.0 + kappa * (2.0 + 2.0 * math.log(log_length) - to_start - to_end)
    of_u = 1j * of_ratio * (displacement * (to_start - to_end) - 2.0 * slope)
    caused: complex = of_u - single * half * (of_t * traction + turn * traction.conjugate())
    return caused


@numba.njit(**OPTIONS)
def add_nearby(
    constants: FloatArray,
    nodes: ComplexArray,
    ends: IntArray,
    order: IntArray,
    bounds: IntArray,
    traction: ComplexArray,
    displacement: ComplexArray,
    slope: ComplexArray,
    first: IntArray,
    near: IntArray,
    begin: int,
    stop: int,
    result: ComplexArray,
) -> None:
    """Add T (u + s t) - U t in the leaves from `begin` to `stop` - 1; see `FastMultipole`."""
    for leaf in range(begin, stop):
        low, high = bounds[leaf], bounds[leaf + 1]
        x_x, x_y = np.empty(high - low), np.empty(high - low)
        for i in range(low, high):
            start, end = nodes[ends[order[i], 0]], nodes[ends[order[i], 1]]
            x_x[i - low], x_y[i - low] = (
                start.real + 0.5 * (end.real - start.real),
                start.imag + 0.5 * (end.imag - start.imag),
            )
        real, imaginary = np.zeros(high - low), np.zeros(high - low)
        for k in range(first[leaf], first[leaf + 1]):
            for place in range(bounds[near[k]], bounds[near[k] + 1]):
                j, i = order[place], place - low
                start, end = nodes[ends[j, 0]], nodes[ends[j, 1]]
                is_own = near[k] == leaf
                before = complex(real[i], imaginary[i]) if is_own else 0j
                _add(constants, x_x, x_y, start, end, traction[j], displacement[j], slope[j], real, imaginary)
                if is_own:
                    middle = complex(x_x[i], x_y[i])
                    total = before + _own(constants, middle, start, end, traction[j], displacement[j], slope[j])
                    real[i], imaginary[i] = total.real, total.imag
        for i in range(low, high):
            result[order[i]] += complex(real[i - low], imaginary[i - low])
