"""Collocation with constant elements (the paper's discretisation): both boundary matrices at the element midpoints.

With complex tractions p and displacements v on one element (closed forms of `kernels`, kappa = 3 - 4 nu), seen from x:

    U p = A l ([1 - kappa (2 log(l / r0) + J)] p + tau^2 [1 + i eta conj(T_0)] conj(p)),   A = 1 / (8 pi mu (1 - nu))
    T v = -B ([(2 - 2 nu) theta + i (1 - 2 nu) lambda] v + tau^2 eta conj(G_0) conj(v)),   B = 1 / (4 pi (1 - nu))

where J = log|zeta^2 - 1| + Re T_1 and T_0 = lambda - i theta. On its own element theta, lambda and the second term
are zero (principal value), and (1/2 I + T) u = U t.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from bemkit.arrays import ComplexArray, FloatArray, IntArray
from bemkit.geometry.mesh import BoundaryMesh
from bemkit.operators import kernels
from bemkit.operators.material import Material
from bemkit.operators.panels import Panels, squared_distance

DENSE_DISTANCE = 16.0
CHUNK_PAIRS = 16384


def collocation_matrices(mesh: BoundaryMesh, material: Material) -> tuple[FloatArray, FloatArray]:
    """Return the single and the double layer of constant densities at the element midpoints.

    Parameters
    ----------
    mesh : BoundaryMesh
        Straight elements.
    material : Material

    Returns
    -------
    single, double : (2 n_elements, 2 n_elements) arrays
        Rows and columns are 2 * element + component. single maps tractions [Pa] to displacements [m]; its logarithm
        is log(|r| / r0) with r0 the diameter of the mesh. double maps displacements to displacements, without the
        free term 1/2.
    """
    n = mesh.n_elements
    single, double = np.empty((n, 2, n, 2)), np.empty((n, 2, n, 2))
    panels = Panels(mesh)
    log_half = np.log(panels.half / mesh.diameter)
    for rows, close in _row_chunks(panels):
        a, b, c, d = _dense(panels, material, rows, log_half)
        row, column = close
        values = _listed(panels, material, row + rows.start, column, log_half)
        for target, value in zip((a, b, c, d), values, strict=True):
            target[row, column] = value
        _write(single, rows, a, b)
        _write(double, rows, c, d)
    return single.reshape(2 * n, 2 * n), double.reshape(2 * n, 2 * n)


def _row_chunks(panels: Panels) -> Iterator[tuple[slice, tuple[IntArray, IntArray]]]:
    """Yield slices of rows and the (row, column) pairs in them that are close."""
    n = panels.half.size
    step = max(1, CHUNK_PAIRS // n)
    reach = (DENSE_DISTANCE * panels.half) ** 2
    for first in range(0, n, step):
        rows = slice(first, min(first + step, n))
        row, column = np.nonzero(squared_distance(panels.centre[rows, None], panels.centre) < reach)
        yield rows, (row, column)


Coefficients = tuple[ComplexArray, ComplexArray, ComplexArray, ComplexArray]


def _combine(
    material: Material,
    half: FloatArray,
    tangent: ComplexArray,
    log_half: FloatArray,
    first: ComplexArray,
    j: FloatArray,
    eta: FloatArray,
    gradient: ComplexArray,
) -> Coefficients:
    """Return the factors of p and conj(p) in the single layer, then those of v and conj(v) in the double layer."""
    nu = material.effective_poisson_ratio
    a = half / (8.0 * np.pi * material.shear_modulus * (1.0 - nu))
    b = -1.0 / (4.0 * np.pi * (1.0 - nu))
    square = tangent * tangent
    on_p = (a * (1.0 - (3.0 - 4.0 * nu) * (2.0 * log_half + j))).astype(complex)
    on_conj_p = (a * square) * (1.0 + 1j * eta * first.conj())
    on_v = (-b * (2.0 - 2.0 * nu)) * first.imag + (1j * b * (1.0 - 2.0 * nu)) * first.real
    on_conj_v = (b * square) * (eta * gradient.conj())
    return on_p, on_conj_p, on_v, on_conj_v


def _dense(panels: Panels, material: Material, rows: slice, log_half: FloatArray) -> Coefficients:
    """Evaluate all pairs of some rows by the far series."""
    with np.errstate(all="ignore"):  # close pairs may overflow here; the caller replaces them
        zeta = (panels.centre[rows, None] - panels.centre) * panels.to_local
        first, second = kernels.far_moments(zeta, 1, kernels.terms_needed(DENSE_DISTANCE))
        j = kernels.far_log_product(zeta) + second.real
        gradient = kernels.gradient_moment(zeta * zeta - 1.0)
        return _combine(material, panels.half, panels.tangent, log_half, first, j, zeta.imag, gradient)


def _listed(
    panels: Panels, material: Material, rows: IntArray, columns: IntArray, log_half: FloatArray
) -> Coefficients:
    """Evaluate listed pairs by the closed forms, exact at any distance."""
    to_local = panels.to_local[columns]
    plus = (panels.centre[rows] - panels.start[columns]) * to_local
    minus = (panels.centre[rows] - panels.end[columns]) * to_local
    same = rows == columns
    plus[same], minus[same] = 1.0, -1.0
    moments, log_minus, log_plus = kernels.near_moments(plus, minus, 1)
    eta = np.where(np.abs(plus) < np.abs(minus), plus.imag, minus.imag)
    moments[0][same] = 0.0  # principal value
    j = log_minus + log_plus + moments[1].real
    return _combine(
        material,
        panels.half[columns],
        panels.tangent[columns],
        log_half[columns],
        moments[0],
        j,
        eta,
        kernels.gradient_moment(plus * minus),
    )


def _write(matrix: FloatArray, rows: slice, on_value: ComplexArray, on_conjugate: ComplexArray) -> None:
    """Write v -> a v + b conj(v) as real 2 x 2 blocks."""
    matrix[rows, 0, :, 0] = on_value.real + on_conjugate.real
    matrix[rows, 0, :, 1] = on_conjugate.imag - on_value.imag
    matrix[rows, 1, :, 0] = on_conjugate.imag + on_value.imag
    matrix[rows, 1, :, 1] = on_value.real - on_conjugate.real
