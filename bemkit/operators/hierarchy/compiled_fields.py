"""Columns of the boundary equations as loops for numba; import it through `compiled` alone.

What one element causes at all points stands in the tables of `compiled_tables`, from which columns are put together.
"""

from __future__ import annotations

import math

import numba
import numpy as np

from bemkit.arrays import ComplexArray, FloatArray, IntArray
from bemkit.operators.hierarchy.compiled_functions import MATHEMATICS, OPTIONS, log
from bemkit.operators.hierarchy.compiled_tables import (
    BLOCK,
    N_DOUBLE,
    N_SINGLE,
    TC,
    TS,
    TSC,
    UC,
    T,
    U,
    tabulate_double,
    tabulate_single,
)

_SLOTS = 4
"""Tables that are kept: of an element, of its two neighbours along the boundary, and one that is free."""
_TINY = 1e-300


@numba.njit(**OPTIONS)
def _in_blocks(x: ComplexArray) -> tuple[FloatArray, FloatArray]:
    """Return the coordinates of points, the last one repeated up to whole blocks."""
    n = BLOCK * ((x.size + BLOCK - 1) // BLOCK)
    x_x, x_y = np.empty(n), np.empty(n)
    for i in range(n):
        point = x[min(i, x.size - 1)]
        x_x[i], x_y[i] = point.real, point.imag
    return x_x, x_y


@numba.njit(**OPTIONS)
def _slot_of(element: int, wanted: IntArray, held: IntArray) -> int:
    """Return the slot that holds an element, else one that holds none of the wanted ones."""
    for slot in range(_SLOTS):
        if held[slot] == element:
            return slot
    for slot in range(_SLOTS):
        if held[slot] != wanted[0] and held[slot] != wanted[1] and held[slot] != wanted[2]:
            return slot
    return 0


@numba.njit(fastmath=MATHEMATICS, **OPTIONS)
def _add(
    real: FloatArray, imaginary: FloatArray, one: FloatArray, factor: complex, two: FloatArray, other: complex
) -> None:
    """Add two arrays (2, n) of complex numbers times factors."""
    one_x, one_y, factor_x, factor_y = one[0], one[1], factor.real, factor.imag
    two_x, two_y, other_x, other_y = two[0], two[1], other.real, other.imag
    for i in range(real.size):
        real[i] += factor_x * one_x[i] - factor_y * one_y[i] + other_x * two_x[i] - other_y * two_y[i]
        imaginary[i] += factor_x * one_y[i] + factor_y * one_x[i] + other_x * two_y[i] + other_y * two_x[i]


@numba.njit(fastmath=MATHEMATICS, **OPTIONS)
def _store(on: FloatArray, component: int, result: FloatArray) -> None:
    """Store in an array (n, 2) what a unit along x or y causes, from the factors (4, n) of it and of its conjugate."""
    on_x, on_y, conjugate_x, conjugate_y = on[0], on[1], on[2], on[3]
    if component == 0:
        for i in range(len(result)):
            result[i, 0], result[i, 1] = on_x[i] + conjugate_x[i], on_y[i] + conjugate_y[i]
    else:
        for i in range(len(result)):
            result[i, 0], result[i, 1] = conjugate_y[i] - on_y[i], on_x[i] - conjugate_x[i]


@numba.njit(**OPTIONS)
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
    x_x, x_y = _in_blocks(x)
    single, tables, held = np.empty((N_SINGLE, x_x.size)), np.empty((_SLOTS, N_DOUBLE, x_x.size)), np.full(_SLOTS, -2)
    result, on = np.empty((wanted.size, x.size, 2)), np.empty((2, 4, x_x.size))
    around, ready = np.empty(3, np.int64), np.full(2, -2)
    for c in range(wanted.size):
        element, kind, component = wanted[c] >> 2, (wanted[c] >> 1) & 1, wanted[c] & 1
        if ready[kind] != element and kind == 0:
            tabulate_single(constants, x_x, x_y, places, element, start[element], end[element], single)
            # with its sign in the equations
            for i in range(x_x.size):
                on[0, 0, i], on[0, 1, i], on[0, 2, i], on[0, 3, i] = (
                    -single[U, i],
                    0.0,
                    -single[UC, i],
                    -single[UC + 1, i],
                )
        elif ready[kind] != element:
            around[:] = element
            if slopes.size:
                around[:] = neighbours[:, element]
            on[1] = 0.0
            for k in range(3):
                acted_on = around[k]
                if not slopes.size and k != 1:
                    continue
                slot = _slot_of(acted_on, around, held)
                if held[slot] != acted_on:
                    held[slot] = acted_on
                    tabulate_double(constants, x_x, x_y, places, acted_on, start[acted_on], end[acted_on], tables[slot])
                mean, slope = (1.0 + 0j if k == 1 else 0j), 0j
                if slopes.size:  # an element is the one after its predecessor, itself, and the one before its successor
                    mean, slope = mean + means[2 - k, acted_on], slopes[2 - k, acted_on]
                table = tables[slot]
                _add(on[1, 0], on[1, 1], table[T : T + 2], mean, table[TS : TS + 2], slope)
                _add(
                    on[1, 2],
                    on[1, 3],
                    table[TC : TC + 2],
                    mean.conjugate(),
                    table[TSC : TSC + 2],
                    slope.conjugate(),
                )
            for i in range(x.size):
                if places[i] == element:
                    on[1, 0, i] += 0.5
        ready[kind] = element
        _store(on[kind], component, result[c])
    return result.reshape(wanted.size, 2 * x.size)


@numba.njit(fastmath=MATHEMATICS, **OPTIONS)
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


@numba.njit(**OPTIONS)
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
    x_x, x_y = _in_blocks(x)
    single, double = np.empty((N_SINGLE, x_x.size)), np.empty((N_DOUBLE, x_x.size))
    real, imaginary = np.zeros(x_x.size), np.zeros(x_x.size)
    for j in range(start.size):
        t, u, s = traction[j], displacement[j], slope[j]
        if t != 0.0:
            tabulate_single(constants, x_x, x_y, places, j, start[j], end[j], single)
            # conj(p) has the factors of a complex number, p those of a real one
            real -= t.real * single[U] + t.real * single[UC] + t.imag * single[UC + 1]
            imaginary -= t.imag * single[U] + t.real * single[UC + 1] - t.imag * single[UC]
        tabulate_double(constants, x_x, x_y, places, j, start[j], end[j], double)
        _add(real, imaginary, double[T : T + 2], u, double[TS : TS + 2], s)
        _add(real, imaginary, double[TC : TC + 2], u.conjugate(), double[TSC : TSC + 2], s.conjugate())
    return real[: x.size] + 1j * imaginary[: x.size]
