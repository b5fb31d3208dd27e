"""Both boundary matrices of collocation as a whole, every pair exactly: slow, and without the code that bodies take."""

from __future__ import annotations

import numpy as np

from bemkit.arrays import BoolArray, ComplexArray, FloatArray, IntArray
from bemkit.geometry.mesh import BoundaryMesh
from bemkit.operators import kernels
from bemkit.operators.collocation.corrections import GradientReconstruction
from bemkit.operators.collocation.layers import Constants
from bemkit.operators.element_geometry import ElementGeometry
from bemkit.operators.integrals.inner import bending, inner_integrals
from bemkit.operators.integrals.pairs import Degrees, Inner
from bemkit.operators.material import Material


def collocation_matrices(
    mesh: BoundaryMesh, material: Material, *, takes_slopes: bool = False
) -> tuple[FloatArray, FloatArray]:
    """Return the single and the double layer of constant densities at the element midpoints.

    Parameters
    ----------
    mesh : BoundaryMesh
        x is the point in the middle of the arc of each element.
    material : Material
    takes_slopes : bool
        Whether the double layer takes the slopes of displacements.

    Returns
    -------
    single, double : (2 n_elements, 2 n_elements) arrays
        Rows and columns are 2 * element + component. single maps tractions [Pa] to displacements [m]; its logarithm
        is log(|r| / r0) with r0 the diameter of the mesh. double maps displacements to displacements, without the
        free term 1/2.
    """
    n, whole = mesh.n_elements, mesh.whole
    geometry = ElementGeometry(whole)
    row, column = np.divmod(np.arange(n * whole.n_elements), whole.n_elements)
    exact = _exact_factors(geometry, Constants.of(material, mesh.diameter), geometry.centre[row], column, row == column)
    p, conj_p, v, conj_v, s, conj_s = exact.reshape(6, n, whole.n_elements)
    if takes_slopes:
        reconstruction = GradientReconstruction(whole, geometry)
        v, conj_v = reconstruction.gathered(v, s), reconstruction.gathered(conj_v.conj(), conj_s.conj()).conj()
    return _real(mesh, p, conj_p), _real(mesh, v, conj_v)


def _real(mesh: BoundaryMesh, on: ComplexArray, on_conjugate: ComplexArray) -> FloatArray:
    """Return the matrix of v -> on v + on_conjugate conj(v), images added to what they are images of."""
    images = np.ones((1, 2)) if mesh.symmetry is None else mesh.symmetry.images
    x, y = on + on_conjugate, 1j * (on - on_conjugate)
    columns = np.stack([x, y], axis=-1).reshape(mesh.n_elements, len(images), mesh.n_elements, 2)
    total = np.einsum("rgnc,gc->rnc", columns, images)
    return np.stack([total.real, total.imag], axis=1).reshape(2 * mesh.n_elements, -1)


def _exact_factors(
    geometry: ElementGeometry, constants: Constants, x: ComplexArray, elements: IntArray, is_midpoint: BoolArray
) -> ComplexArray:
    """Return the factors (6, n) of p, conj(p), v, conj(v), s and conj(s), one element for each point."""
    result = np.zeros((6, elements.size), complex)
    is_straight = geometry.is_straight[elements]
    for chosen in (np.flatnonzero(is_straight), np.flatnonzero(~is_straight)):
        if chosen.size:
            result[:, chosen] = _of_one_kind(geometry, constants, x[chosen], elements[chosen], is_midpoint[chosen])
    return result


def _of_one_kind(
    geometry: ElementGeometry, constants: Constants, x: ComplexArray, elements: IntArray, is_midpoint: BoolArray
) -> ComplexArray:
    """Return the factors of pairs whose elements are all straight or all curved."""
    from_start, from_end = x - geometry.start[elements], x - geometry.end[elements]
    plus, minus = from_start * geometry.to_local[elements], from_end * geometry.to_local[elements]
    is_straight = bool(geometry.is_straight[elements[0]])
    polynomials = geometry.polynomials(elements)[: 2 if is_straight else None]
    highest = len(polynomials) - 1
    degrees = Degrees(log=(0, highest - 1), double=(0, highest))
    inner = inner_integrals(geometry, degrees, elements, from_start, from_end)
    if is_midpoint.any():
        own = _on_midpoints(geometry, degrees, elements[is_midpoint])
        for values, values_there in zip(vars(inner).values(), vars(own).values(), strict=True):
            values[:, is_midpoint] = values_there
        if is_straight:
            plus[is_midpoint], minus[is_midpoint] = 1.0, -1.0
    # eta is more accurate if measured from the nearer end
    eta = np.where(np.abs(plus) < np.abs(minus), plus.imag, minus.imag)
    log_ratio = np.log(np.abs(plus)) - np.log(np.abs(minus))
    # difference of rho / conj(rho) between the ends, without cancellation
    quotient_change = (plus - minus).real * eta / (plus * minus).conj()
    half, b = geometry.half[elements], -constants.double
    a, kappa = constants.single * half, 3.0 - 4.0 * constants.poisson_ratio
    turn, angle, ratio = geometry.tangent[elements] ** 2, 0.5 / np.pi, b * (1.0 - 2.0 * constants.poisson_ratio)
    double, log_moment, quotient_moment = _moments_by_parts(inner, polynomials, plus, minus)
    return np.array(
        [
            a * (1.0 - 2.0 * kappa * np.log(half / constants.log_length)) - a * kappa * inner.log[0],
            a * turn * (0.5 * inner.quotient[0]),
            angle * inner.double[0] + 1j * ratio * log_ratio,
            b * turn * quotient_change,
            angle * double + 1j * ratio * log_moment,
            b * turn * quotient_moment,
        ]
    )


def _moments_by_parts(
    inner: Inner, polynomials: ComplexArray, plus: ComplexArray, minus: ComplexArray
) -> tuple[FloatArray | ComplexArray, FloatArray | ComplexArray, ComplexArray]:
    """Return the moments of the linear density by partial integration.

    `plus` and `minus` are the local coordinates of the point relative to start and end of the element.
    """
    n = len(polynomials)
    of_powers = [np.append(np.polynomial.legendre.poly2leg(np.eye(m + 1)[m]), np.zeros(n - m - 1)) for m in range(n)]
    coefficients = np.transpose(of_powers) @ polynomials
    slopes = np.polynomial.legendre.legder(coefficients)
    signs = (-1.0) ** np.arange(len(coefficients))  # P_k at the start; it is one at the end
    at_start, at_end = signs @ coefficients, coefficients.sum(axis=0)
    double = sum(factor * value for factor, value in zip(coefficients, inner.double, strict=False))
    log_ratio = at_start * np.log(np.abs(plus)) - at_end * np.log(np.abs(minus))
    quotient_change = at_end.conj() * (minus / minus.conj()) - at_start.conj() * (plus / plus.conj())
    for slope, log, quotient in zip(slopes, inner.log, inner.quotient, strict=False):
        log_ratio = log_ratio + slope * log
        quotient_change -= slope.conj() * quotient
    return double, log_ratio, -0.5j * quotient_change


def _on_midpoints(geometry: ElementGeometry, degrees: Degrees, elements: IntArray) -> Inner:
    """Integrate over elements for their own midpoints; the double layer is a principal value."""
    end = np.full(elements.size, 1.0 + 0j)
    integrals, log_product = kernels.near_integrals(end, -end, degrees.highest_integral)
    straight = Inner.straight(degrees, integrals.real.astype(complex), log_product, np.zeros(elements.size))
    if geometry.is_straight[elements].all():
        return straight
    smooth = bending(degrees, geometry.polynomials(elements), np.zeros(elements.size, complex))
    return Inner(straight.log + smooth.log, smooth.quotient, straight.cauchy + smooth.cauchy)
