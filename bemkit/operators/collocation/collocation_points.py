"""Coefficients of constant densities, and of their slopes, at the collocation points in the middle of elements."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from bemkit.arrays import BoolArray, ComplexArray, FloatArray, IntArray
from bemkit.geometry.quadrature import gauss_legendre
from bemkit.operators import kernels
from bemkit.operators.collocation.gradient_reconstruction import GradientReconstruction
from bemkit.operators.integrals import curved_panels
from bemkit.operators.integrals.inner import far_inner, inner_integrals, inner_on_element, store
from bemkit.operators.integrals.pairs import Degrees, Inner
from bemkit.operators.integrals.panels import Panels, squared_distance
from bemkit.operators.material import Material

DENSE_DISTANCE = 16.0
"""Pairs closer than this, in half lengths of the element, take the closed forms instead of the far series."""
MANY_ELEMENTS = 700
DENSE_DISTANCE_OF_MANY = 45.0
"""With many elements few pairs are close, and a shorter series for all others pays."""
CURVED_DISTANCE = 4.5
"""Curved elements farther than this take a Gauss rule; the distance is measured in the parameter (`Panels.reach`)."""
CURVED_POINTS = 8
"""Points of that rule: its error is about (4.5 + sqrt(4.5^2 - 1))^-16, below 1e-15."""

DEGREES = Degrees(log=(0, 0), double=(0, 0))


@dataclass(frozen=True, eq=False)
class Coefficients:
    """Factors of densities and of their conjugates, for pairs of points and elements.

    Parameters
    ----------
    on_traction, on_conjugate_traction : arrays
        Of p and conj(p) in the single layer, zero where it was not asked for.
    on_displacement, on_conjugate_displacement : complex arrays
        Of v and conj(v) in the double layer.
    on_slope, on_conjugate_slope : complex arrays
        Of s and conj(s) there, for the density s p(t) (s t on straight elements). Empty if they were not asked for.
    """

    on_traction: FloatArray | ComplexArray
    on_conjugate_traction: ComplexArray
    on_displacement: ComplexArray
    on_conjugate_displacement: ComplexArray
    on_slope: ComplexArray
    on_conjugate_slope: ComplexArray

    @classmethod
    def zeros(cls, shape: tuple[int, ...], has_slopes: bool) -> Coefficients:
        """Return coefficients to be filled."""
        on_slopes: tuple[int, ...] = shape if has_slopes else (0, 0)
        tractions = np.zeros(shape), np.zeros(shape, complex)
        return cls(*tractions, *(np.zeros(each, complex) for each in (shape, shape, on_slopes, on_slopes)))

    @property
    def stacked(self) -> ComplexArray:
        """(6, ...) array of the factors of p, conj(p), v, conj(v), s and conj(s)."""
        on_displacement = self.on_displacement, self.on_conjugate_displacement
        traction = self.on_traction, self.on_conjugate_traction
        return np.array([*traction, *on_displacement, self.on_slope, self.on_conjugate_slope])

    def add_slopes(self, reconstruction: GradientReconstruction) -> None:
        """Add the slopes that displacements suggest."""
        reconstruction.add_to(self.on_displacement, self.on_slope, is_conjugate=False)
        reconstruction.add_to(self.on_conjugate_displacement, self.on_conjugate_slope, is_conjugate=True)

    def folded(self, images: Sequence[tuple[float, float]]) -> Coefficients:
        """Return those of the first elements with those of their images, whose densities have the signs given."""
        if len(images) == 1:
            return self
        p, conj_p = _folded(self.on_traction, self.on_conjugate_traction, images)
        v, conj_v = _folded(self.on_displacement, self.on_conjugate_displacement, images)
        return Coefficients(p, conj_p, v, conj_v, v[:0], v[:0])


def _folded(
    on: FloatArray | ComplexArray, on_conjugate: ComplexArray, images: Sequence[tuple[float, float]]
) -> tuple[ComplexArray, ComplexArray]:
    """Add the coefficients of images: the signs (f, f) mean v -> f v, and (f, -f) mean v -> f conj(v)."""
    pieces = zip(images, np.split(on, len(images), axis=1), np.split(on_conjugate, len(images), axis=1), strict=True)
    total: ComplexArray = np.zeros((2, len(on), on.shape[1] // len(images)), complex)
    for (along_x, along_y), of_v, of_conjugate in pieces:
        total += along_x * np.array([of_v, of_conjugate] if along_x == along_y else [of_conjugate, of_v])
    return total[0], total[1]


@dataclass(frozen=True, eq=False)
class _ElementIntegrals:
    """Integrals over elements of half length 1 with a chord along the real axis, with the letters of `assembly`.

    Parameters
    ----------
    log, half_quotient : arrays, optional
        L and Q / 2, of the single layer.
    double, log_ratio, quotient_change : arrays
        D, lambda and -i / 2 times the difference of rho / conj(rho) between the ends, of the double layer.
    moments : tuple of arrays, optional
        The same three with the density p(t) (t on straight elements), the last one with its conjugate.
    """

    log: FloatArray | None
    half_quotient: ComplexArray | None
    double: FloatArray
    log_ratio: FloatArray
    quotient_change: ComplexArray
    moments: tuple[FloatArray | ComplexArray, FloatArray | ComplexArray, ComplexArray] | None


@dataclass(frozen=True, eq=False)
class CollocationPoints:
    """Evaluates all pairs of midpoints and elements: far formulas first, then the close pairs exactly.

    Parameters
    ----------
    panels : Panels
    material : Material
    r0 : float [m]
        Unit of length of the logarithm.
    """

    panels: Panels
    material: Material
    r0: float

    def evaluate(self, rows: slice, parts: Sequence[tuple[slice, bool]], has_slopes: bool) -> Coefficients:
        """Return the coefficients of the midpoints of some elements and of all elements.

        Parameters
        ----------
        rows : slice
            Elements whose midpoints are the points.
        parts : sequence of (slice, bool)
            All elements, in ranges of straight or curved ones, and whether the single layer is wanted of each range.
        has_slopes : bool
            Whether the coefficients of slopes are wanted.
        """
        n_elements = self.panels.half.size
        result = Coefficients.zeros((rows.stop - rows.start, n_elements), has_slopes)
        distance = DENSE_DISTANCE if n_elements < MANY_ELEMENTS else DENSE_DISTANCE_OF_MANY
        everywhere = slice(None)
        for columns, has_single in parts:
            with np.errstate(all="ignore"):  # close pairs may overflow here; they are replaced
                if self.panels.is_straight[columns.start]:
                    integrals, is_close = _straight_far(self.panels, rows, columns, distance, has_single, has_slopes)
                else:
                    integrals, is_close = _curved_far(self.panels, rows, columns, has_single, has_slopes)
                self._combine(integrals, result, (everywhere, columns), columns)
            row, column = np.nonzero(is_close)
            if row.size:
                point, element = row + rows.start, column + columns.start
                exact = _listed(
                    self.panels, self.panels.centre[point], element, point == element, has_single, has_slopes
                )
                self._combine(exact, result, (row, element), element)
        return result

    def at(self, x: ComplexArray, elements: IntArray, is_own: BoolArray) -> Coefficients:
        """Return the coefficients (n,) of pairs of points anywhere and elements, exactly at any distance.

        Parameters
        ----------
        x : (n,) complex array
        elements : (n,) array
        is_own : (n,) bool array
            Where the point is the middle of the element.
        """
        result = Coefficients.zeros(elements.shape, True)
        is_straight = self.panels.is_straight[elements]
        for chosen in (np.flatnonzero(is_straight), np.flatnonzero(~is_straight)):
            if chosen.size:
                own = elements[chosen]
                exact = _listed(self.panels, x[chosen], own, is_own[chosen], True, True)
                self._combine(exact, result, (chosen,), own)
        return result

    def _combine(
        self,
        integrals: _ElementIntegrals,
        result: Coefficients,
        where: tuple[slice | IntArray, ...],
        columns: slice | IntArray,
    ) -> None:
        """Write the coefficients of the densities on some elements where they belong."""
        nu, panels = self.material.effective_poisson_ratio, self.panels
        b = -1.0 / (4.0 * np.pi * (1.0 - nu))
        turned, rates = b * panels.tangent[columns] ** 2, (0.5 / np.pi, b * (1.0 - 2.0 * nu))
        _join(result.on_displacement, where, integrals.double * rates[0], integrals.log_ratio * rates[1])
        _multiply(result.on_conjugate_displacement, where, integrals.quotient_change, turned)
        if integrals.moments is not None:
            double, log_ratio, quotient_change = integrals.moments
            _join(result.on_slope, where, double * rates[0], log_ratio * rates[1])
            _multiply(result.on_conjugate_slope, where, quotient_change, turned)
        if integrals.log is not None and integrals.half_quotient is not None:
            kappa, half = self.material.kappa, panels.half[columns]
            a = half / (8.0 * np.pi * self.material.shear_modulus * (1.0 - nu))
            _multiply(result.on_traction, where, integrals.log, -a * kappa)
            result.on_traction[where] += a * (1.0 - 2.0 * kappa * np.log(half / self.r0))
            _multiply(result.on_conjugate_traction, where, integrals.half_quotient, a * panels.tangent[columns] ** 2)


def constant_runs(*labels: BoolArray) -> list[slice]:
    """Cut all elements into the longest ranges on which no label (n_elements,) changes."""
    changes = 1 + np.flatnonzero(np.any([label[1:] != label[:-1] for label in labels], axis=0))
    edges = [0, *changes.tolist(), labels[0].size]
    return [slice(first, last) for first, last in itertools.pairwise(edges)]


def _straight_far(
    panels: Panels, rows: slice, columns: slice, distance: float, has_single: bool, has_slopes: bool
) -> tuple[_ElementIntegrals, BoolArray]:
    """Use the series of the closed forms; also return which pairs are too close for them."""
    zeta = (panels.centre[rows, None] - panels.centre[columns]) * panels.to_local[columns]
    first, second = kernels.far_integrals(zeta, 1, kernels.terms_needed(distance))
    eta, double, log_ratio = zeta.imag.copy(), first.imag.copy(), first.real.copy()
    product = zeta * zeta
    product -= 1.0
    squared = np.square(product.real)
    squared += np.square(product.imag)
    # |zeta^2 - 1| is |zeta|^2 up to 1; on the element itself it may be no number
    is_close: BoolArray = ~(squared > (distance**2 + 1.0) ** 2)
    quotient_change = product
    quotient_change *= eta * (2.0 / squared)
    moments = log = half_quotient = None
    if has_slopes:
        # int t / (zeta - t)^2 dt = zeta int 1 / (zeta - t)^2 dt - T_0
        of_slope = zeta.conj()
        of_slope *= quotient_change
        first *= eta
        of_slope -= first.conj()
        moments = second.imag, second.real, of_slope
    if has_single:
        log = np.log(squared, out=squared)
        log *= 0.5
        log += second.real
        half_quotient = _complex(1.0 + eta * double, eta * log_ratio)
    return _ElementIntegrals(log, half_quotient, double, log_ratio, quotient_change, moments), is_close


def _curved_far(
    panels: Panels, rows: slice, columns: slice, has_single: bool, has_slopes: bool
) -> tuple[_ElementIntegrals, BoolArray]:
    """Use a Gauss rule; also return which pairs are too close for it."""
    x = panels.centre[rows, None]
    zeta = (x - panels.centre[columns]) * panels.to_local[columns]
    polynomials = panels.polynomials(np.arange(columns.start, columns.stop))
    inner = far_inner(DEGREES, polynomials, zeta, CURVED_POINTS)
    start, end = (((p - panels.centre) * panels.to_local)[columns] for p in (panels.start, panels.end))
    plus, minus = zeta - start, zeta - end
    chord = (end - start).real
    # |plus|^2 - |minus|^2 = chord Re(plus + minus): log1p keeps the digits of the difference of two logarithms
    log_ratio = 0.5 * np.log1p(chord * (plus + minus).real / (np.square(minus.real) + np.square(minus.imag)))
    moments = _curved_moments(polynomials, zeta) if has_slopes else None
    reach = panels.half[columns] * panels.reach(CURVED_DISTANCE)[columns]
    integrals = _joined(inner, chord, plus, minus, plus.imag, log_ratio, has_single, moments)
    return integrals, squared_distance(x, panels.centre[columns]) < reach**2


def _curved_moments(polynomials: ComplexArray, zeta: ComplexArray) -> tuple[ComplexArray, ComplexArray, ComplexArray]:
    """Return the moments of curved elements far from points, by a Gauss rule for the derivatives themselves."""
    slopes = curved_panels.derivative(polynomials)
    double, log_ratio, quotient_change = (np.zeros(zeta.shape, complex) for _ in range(3))
    for t, weight in zip(*gauss_legendre(CURVED_POINTS), strict=True):
        place = np.full(polynomials.shape[1], t + 0j)
        p, slope = curved_panels.evaluate(polynomials, place), curved_panels.evaluate(slopes, place)
        rho = zeta - p
        rate = slope / rho
        double += (weight * p) * rate.imag
        log_ratio += (weight * p) * rate.real
        quotient_change -= (weight * p.conj()) * (rho / rho.conj() * rate.imag)
    return double, log_ratio, quotient_change


def _listed(
    panels: Panels, x: ComplexArray, columns: IntArray, same: BoolArray, has_single: bool, has_slopes: bool
) -> _ElementIntegrals:
    """Evaluate listed pairs, all straight or all curved, exactly at any distance; `same` where x is the middle."""
    from_start, from_end = x - panels.start[columns], x - panels.end[columns]
    plus, minus = from_start * panels.to_local[columns], from_end * panels.to_local[columns]
    is_straight = bool(panels.is_straight[columns[0]])
    polynomials = panels.polynomials(columns)[: 2 if is_straight else None]
    highest = len(polynomials) - 1
    degrees = Degrees(log=(0, highest - 1), double=(0, highest)) if has_slopes else DEGREES
    inner = inner_integrals(panels, degrees, columns, from_start, from_end)
    if same.any():
        store(inner, same, inner_on_element(panels, degrees, columns[same], 0.0))
        if is_straight:
            plus[same], minus[same] = 1.0, -1.0
    eta = np.where(np.abs(plus) < np.abs(minus), plus.imag, minus.imag)
    log_ratio = np.log(np.abs(plus)) - np.log(np.abs(minus))
    moments = _moments_by_parts(inner, polynomials, plus, minus) if has_slopes else None
    return _joined(inner, (plus - minus).real, plus, minus, eta, log_ratio, has_single, moments)


def _moments_by_parts(
    inner: Inner, polynomials: ComplexArray, plus: ComplexArray, minus: ComplexArray
) -> tuple[FloatArray | ComplexArray, FloatArray | ComplexArray, ComplexArray]:
    """Return the moments from inner integrals and what the end points `plus` and `minus` away give."""
    coefficients = kernels.legendre_of_monomials(len(polynomials) - 1).T @ polynomials
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


def _joined(
    inner: Inner,
    chord: FloatArray,
    plus: ComplexArray,
    minus: ComplexArray,
    eta: FloatArray,
    log_ratio: FloatArray,
    has_single: bool,
    moments: tuple[FloatArray | ComplexArray, FloatArray | ComplexArray, ComplexArray] | None,
) -> _ElementIntegrals:
    """Join inner integrals and what the end points give."""
    quotient_change: ComplexArray = (
        chord * eta / (plus * minus).conj()
    )  # the difference of rho / conj(rho), without cancellation
    log, half_quotient = (inner.log[0], 0.5 * inner.quotient[0]) if has_single else (None, None)
    return _ElementIntegrals(log, half_quotient, inner.double[0], log_ratio, quotient_change, moments)


def _multiply(
    target: FloatArray | ComplexArray,
    where: tuple[slice | IntArray, ...],
    values: FloatArray | ComplexArray,
    factor: FloatArray | ComplexArray,
) -> None:
    """Write a product, without a copy in between where slices say the place."""
    if isinstance(where[0], slice):
        np.multiply(values, factor, out=target[where])
    else:
        target[where] = values * factor


def _join(
    target: ComplexArray,
    where: tuple[slice | IntArray, ...],
    real: FloatArray | ComplexArray,
    imaginary: FloatArray | ComplexArray,
) -> None:
    """Write real + i imaginary; the parts are complex themselves on curved elements."""
    if np.iscomplexobj(real):
        target[where] = real + 1j * imaginary
    else:
        target.real[where], target.imag[where] = real, imaginary


def _complex(real: FloatArray, imaginary: FloatArray) -> ComplexArray:
    """Join two arrays; cheaper than arithmetic with 1j."""
    result = np.empty(real.shape, complex)
    result.real, result.imag = real, imaginary
    return result
