"""The Gauss rules of `curved_elements` as loops for numba; import it where `compiled` says that numba works."""

from __future__ import annotations

import math

import numba
import numpy as np

from bemkit.arrays import ComplexArray, FloatArray
from bemkit.operators.hierarchy.compiled_functions import OPTIONS


@numba.njit(**OPTIONS)
def gauss_fields(
    single: float,
    double: float,
    poisson_ratio: float,
    log_length: float,
    x: ComplexArray,
    centre: ComplexArray,
    near: FloatArray,
    far: FloatArray,
    y: ComplexArray,
    dy: ComplexArray,
    p: ComplexArray,
    few_y: ComplexArray,
    few_dy: ComplexArray,
    few_p: ComplexArray,
) -> ComplexArray:
    """Return the factors (6, n_points, n_elements) of `curved_elements.CurvedElements.fields`; near pairs are zero.

    Parameters
    ----------
    single, double, poisson_ratio, log_length : float
        Of `element_fields.Constants`.
    x : (n_points,) complex array
    centre : (n_elements,) complex array
    near, far : (n_elements,) arrays
    y, dy, p, few_y, few_dy, few_p : (n_elements, ...) complex arrays
        The two Gauss rules.
    """
    of_log, of_angle = 1.5 - 2.0 * poisson_ratio, double * (2.0 - 2.0 * poisson_ratio)
    of_ratio = -double * (1.0 - 2.0 * poisson_ratio)
    log_squared = 2.0 * math.log(log_length)
    result = np.zeros((6, x.size, centre.size), np.complex128)
    for j in range(centre.size):
        near_squared, far_squared = near[j] * near[j], far[j] * far[j]
        for i in range(x.size):
            away = x[i] - centre[j]
            distance = away.real * away.real + away.imag * away.imag
            if distance < near_squared:
                continue
            is_far = distance > far_squared
            places, steps, local = (few_y[j], few_dy[j], few_p[j]) if is_far else (y[j], dy[j], p[j])
            on_p, on_p_conjugate = 0.0, 0j
            on_v, on_v_conjugate, on_s, on_s_conjugate = 0j, 0j, 0j, 0j
            for k in range(places.size):
                rho, step = x[i] - places[k], steps[k]
                squared = rho.real * rho.real + rho.imag * rho.imag
                by_squared = 1.0 / squared
                rate = step * complex(rho.real * by_squared, -rho.imag * by_squared)
                turn = complex(
                    (rho.real * rho.real - rho.imag * rho.imag) * by_squared, 2.0 * rho.real * rho.imag * by_squared
                )
                ds = math.sqrt(step.real * step.real + step.imag * step.imag)
                on_p += ds * (0.5 - of_log * (math.log(squared) - log_squared))
                on_p_conjugate += ds * turn
                of_density = complex(of_angle * rate.imag, of_ratio * rate.real)
                of_conjugate = turn * rate.imag
                on_v += of_density
                on_v_conjugate += of_conjugate
                on_s += local[k] * of_density
                on_s_conjugate += local[k].conjugate() * of_conjugate
            result[0, i, j] = single * on_p
            result[1, i, j] = 0.5 * single * on_p_conjugate
            result[2, i, j] = on_v
            result[3, i, j] = double * on_v_conjugate
            result[4, i, j] = on_s
            result[5, i, j] = double * on_s_conjugate
    return result
