"""The Gauss rules of `element_pairs` as loops for numba; import it where `compiled` says that numba works.

The inner loops run over the elements of the second set, without a branch, so that the compiler takes several at a time.
"""

from __future__ import annotations

import math

import numba
import numpy as np

from bemkit.arrays import ComplexArray, FloatArray, IntArray
from bemkit.operators.hierarchy.compiled_functions import MATHEMATICS, OPTIONS, log


@numba.njit(fastmath=MATHEMATICS, **OPTIONS)
def _kernels(x: float, y: float, of_x: float, of_y: float, points: FloatArray, n: int, values: FloatArray) -> None:
    """Fill (5, n) values of the five kernels at one point, with its tangent, and points (4, n) with theirs."""
    to_x, to_y, tangent_x, tangent_y = points[0], points[1], points[2], points[3]
    logs, real, imaginary, to, fro = values[0], values[1], values[2], values[3], values[4]
    for c in range(n):
        dx, dy = x - to_x[c], y - to_y[c]
        squared = dx * dx + dy * dy
        inverse = 1.0 / squared
        logs[c] = 0.5 * log(squared)
        real[c] = (dx * dx - dy * dy) * inverse
        imaginary[c] = 2.0 * dx * dy * inverse
        to[c] = (tangent_y[c] * dx - tangent_x[c] * dy) * inverse
        fro[c] = (of_x * dy - of_y * dx) * inverse


@numba.njit(fastmath=MATHEMATICS, **OPTIONS)
def _add(target: FloatArray, values: FloatArray, factor: float, n: int) -> None:
    for c in range(n):
        target[c] += factor * values[c]


@numba.njit(**OPTIONS)
def _sum_of_rule(
    i: int, own: IntArray, begin: int, end: int, point: ComplexArray, tangent: ComplexArray, polynomials: FloatArray,
    points: FloatArray, values: FloatArray, inner: FloatArray, sums: FloatArray,
) -> None:  # fmt: skip
    """Sum one rule on an element and on some others into (n_channels, n) sums."""
    n, p = own.size, polynomials.shape[0] - 1
    sums[:, :n] = 0.0
    for k in range(begin, end):
        for c in range(n):
            j = own[c]
            points[0, c], points[1, c] = point[k, j].real, point[k, j].imag
            points[2, c], points[3, c] = tangent[k, j].real, tangent[k, j].imag
        inner[:, :, :n] = 0.0  # sums over the points of the first element, by its polynomials
        for g in range(begin, end):
            x, of = point[g, i], tangent[g, i]
            _kernels(x.real, x.imag, of.real, of.imag, points, n, values)
            for a in range(p):
                for kind in range(4):
                    _add(inner[kind, a], values[kind], polynomials[a, g], n)
            for a in range(p + 1):
                _add(inner[4, a], values[4], polynomials[a, g], n)
        channel = 0
        for kind in range(5):
            for a in range(p if kind < 4 else p + 1):
                for b in range(p + 1 if kind == 3 else p):
                    _add(sums[channel], inner[kind, a], polynomials[b, k], n)
                    channel += 1


@numba.njit(**OPTIONS)
def integrals(
    rows: IntArray, columns: IntArray, centre: ComplexArray, half: FloatArray, reach: FloatArray, point: ComplexArray,
    tangent: ComplexArray, polynomials: FloatArray, begins: IntArray, near_begins: IntArray, near_columns: IntArray,
    near: FloatArray,
) -> FloatArray:  # fmt: skip
    """See `element_pairs.ElementPairs.integrals`."""
    n_rules, n, p = reach.shape[0], columns.size, polynomials.shape[0] - 1
    n_log, n_channels = p * p, near.shape[1]
    result = np.empty((n_channels, rows.size, n))
    points, values, inner = np.empty((4, n)), np.empty((5, n)), np.empty((5, p + 1, n))
    sums, level, chosen = np.empty((n_channels, n)), np.empty(n, np.int64), np.empty(n, np.int64)
    places = np.empty(n, np.int64)
    for r in range(rows.size):
        i = rows[r]
        for c in range(n):
            j = columns[c]
            away = centre[i] - centre[j]
            distance = math.sqrt(away.real * away.real + away.imag * away.imag)
            level[c] = 0
            for number in range(n_rules - 1):
                if distance < max(reach[number, i] + half[j], reach[number, j] + half[i]):
                    level[c] = number + 1
        c = 0
        for k in range(near_begins[i], near_begins[i + 1]):
            while c < n and columns[c] < near_columns[k]:
                c += 1
            if c < n and columns[c] == near_columns[k]:
                level[c] = -1
                for channel in range(n_channels):
                    result[channel, r, c] = near[k, channel]
        for number in range(n_rules):
            count = 0
            for c in range(n):
                if level[c] == number:
                    places[count], chosen[count] = c, columns[c]
                    count += 1
            if count == 0:
                continue
            _sum_of_rule(
                i, chosen[:count], begins[number], begins[number + 1], point, tangent, polynomials, points, values,
                inner, sums,
            )  # fmt: skip
            for channel in range(n_channels):
                factor = half[i] if channel < 3 * n_log else half[i] / (2.0 * math.pi)
                for c in range(count):
                    result[channel, r, places[c]] = factor * half[chosen[c]] * sums[channel, c]
    return result
