"""Curved elements as complex polynomials of the local coordinate.

A curved element of constant speed is y = c + l tau p(t) with a polynomial p of low degree, exact to round-off on [-1,
1]. Let t0 be the parameter of a point x, the root of p(t0) = zeta, which is complex unless x lies on the curve. The
distance factors,

    zeta - p(t) = (t0 - t) g(t),    g the divided difference of p, without zeros near [-1, 1],

so that every integral is the closed form of the straight element for the point t0 plus the integral of a smooth
remainder. This is singularity swap quadrature [AfKlintebergBarnett2021], with remainders instead of swapped densities.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.polynomial import chebyshev
from numpy.typing import NDArray

from bemkit.arrays import BoolArray, ComplexArray, FloatArray, IntArray
from bemkit.errors import GeometryError
from bemkit.geometry.curves import Curve
from bemkit.geometry.mesh import BoundaryMesh

MAX_DEGREE = 20
"""Highest degree of an element; a half circle has degree 18."""
N_SAMPLES = 29
MAX_BEND = 1.6
"""Largest product of curvature and half length, about that of a half circle."""
ROUND_OFF = 4.0 * float(np.finfo(float).eps)
UNRESOLVED = 1e3
"""Largest coefficient beyond MAX_DEGREE, relative to round-off, on analytic curves."""
MAX_NEWTON = 30
FOLLOWED = 1e-5
"""Largest coefficient beyond MAX_DEGREE, relative to the half length, on other curves such as splines."""
ELLIPSE = 1.8
"""Semi-axis of the ellipse with foci -1 and 1; points with a parameter inside are near, others take a Gauss rule."""


@dataclass(frozen=True, eq=False)
class CurvedGeometry:
    """The polynomials of all elements of a mesh; straight elements have p(t) = t.

    Parameters
    ----------
    about_centre, about_start, about_end : (n_powers, n_elements) complex arrays
        Coefficients of p(t), p(-1 + u) - p(-1) and p(1 + v) - p(1).
    bend : (n_elements,) array
        Largest curvature times half length.
    """

    about_centre: ComplexArray
    about_start: ComplexArray
    about_end: ComplexArray
    bend: FloatArray

    def at(self, elements: IntArray, t: FloatArray | float) -> ComplexArray:
        """Return p(t) (n,) of elements (n,) at local coordinates, one for all or one for each."""
        return evaluate(self.about_centre[:, elements], np.full(elements.size, t, complex))

    def slopes_from_end(self, elements: IntArray, shift: FloatArray, at_start: BoolArray) -> ComplexArray:
        """Return (p(end + shift) - p(end)) / shift (n,) of some elements from their start or their other end node."""
        about = np.where(at_start, self.about_start[1:, elements], self.about_end[1:, elements])
        return evaluate(about, shift.astype(complex))

    def stretched(self, distance: float) -> FloatArray:
        """Return the distance, in half lengths, at which the parameter of circular elements is `distance`."""
        exponent = np.minimum(self.bend * distance, 300.0)  # to avoid overflow
        ratio = np.where(exponent > 1e-8, np.expm1(exponent) / np.maximum(exponent, 1e-8), 1.0)
        return np.asarray(distance * ratio)


def fit(mesh: BoundaryMesh, tangent: ComplexArray, half: FloatArray, centre: ComplexArray) -> CurvedGeometry:
    """Interpolate the curved elements of a mesh up to the round-off of their coordinates.

    Raises
    ------
    GeometryError
        If an element bends too much, or no polynomial represents it.
    """
    curved = np.flatnonzero(~mesh.is_straight)
    # Chebyshev series of the local coordinates
    angles, to_series = _interpolation()
    points = mesh.points(curved, np.cos(angles))
    points[:, 0], points[:, -1] = mesh.end[curved], mesh.start[curved]  # neighbours share exactly the same node
    local = ((points @ np.array([1.0, 1j])) - centre[curved, None]) * (tangent[curved].conj() / half[curved])[:, None]
    series = local @ to_series.T
    # coefficients below the round-off of the coordinates, relative to the half length, are noise: cut the series there
    noise = ROUND_OFF * (1.0 + _of_curves(mesh, lambda curve: curve.magnitude)[curved] / half[curved])
    is_noise = np.logical_and.accumulate((np.abs(series) <= noise[:, None])[:, ::-1], axis=1)[:, ::-1]
    degree = np.clip(series.shape[1] - 1 - is_noise.sum(axis=1), 1, MAX_DEGREE)
    allowed = np.where(_of_curves(mesh, lambda curve: curve.is_analytic)[curved], UNRESOLVED * noise, FOLLOWED)
    is_unresolved = (np.abs(series[:, MAX_DEGREE + 1 :]) > allowed[:, None]).any(axis=1)
    series[np.arange(series.shape[1]) > degree[:, None]] = 0.0
    # shift the cut series to the nodes: otherwise tiny elements would have gaps of the size of the noise
    ends = np.column_stack([series.sum(axis=1), series @ (-1.0) ** np.arange(series.shape[1])])
    mismatch = local[:, [0, -1]] - ends
    series[:, 0] += 0.5 * (mismatch[:, 0] + mismatch[:, 1])
    series[:, 1] += 0.5 * (mismatch[:, 0] - mismatch[:, 1])
    # powers of t
    n_powers = int(degree.max()) + 1
    about_centre = np.zeros((n_powers, mesh.n_elements), complex)
    about_centre[1] = 1.0
    to_powers = np.zeros((n_powers, n_powers))
    for k, unit in enumerate(np.eye(n_powers)):
        to_powers[: k + 1, k] = chebyshev.cheb2poly(unit[: k + 1])
    about_centre[:, curved] = to_powers @ series.T[:n_powers]
    # largest curvature
    bend = np.zeros(mesh.n_elements)
    second = about_centre[2:] * (np.arange(2, n_powers) * np.arange(1, n_powers - 1))[:, None]
    if n_powers > 2:
        bend[curved] = np.abs(
            np.vander(np.linspace(-1.0, 1.0, 9), n_powers - 2, increasing=True) @ second[:, curved]
        ).max(axis=0)
    _check(mesh, curved, bend, is_unresolved)
    return CurvedGeometry(about_centre, _shifted(about_centre, -1.0), _shifted(about_centre, 1.0), bend)


def _of_curves(mesh: BoundaryMesh, ask: Callable[[Curve], Any]) -> NDArray[Any]:
    """Return a property of the curve of each element, (n_elements,); values of straight elements are meaningless."""
    values = np.array([ask(curve) for curve in mesh.curves])
    return values[mesh.element_curve]


def _check(mesh: BoundaryMesh, curved: IntArray, bend: FloatArray, is_unresolved: BoolArray) -> None:
    is_bad = is_unresolved | (bend[curved] > MAX_BEND)
    if is_bad.any():
        element = int(curved[np.argmax(is_bad)])
        (x, y), (x_end, y_end) = mesh.start[element], mesh.end[element]
        msg = (
            f"element {element} from ({x:.6g}, {y:.6g}) to ({x_end:.6g}, {y_end:.6g}) bends too much for one element "
            f"(curvature times half length {bend[element]:.3g}): use more elements there"
        )
        raise GeometryError(msg)


@lru_cache(maxsize=1)
def _interpolation() -> tuple[FloatArray, FloatArray]:
    """Return the angles of the Chebyshev-Lobatto points and the matrix from values to Chebyshev coefficients."""
    angles = np.linspace(0.0, np.pi, N_SAMPLES)
    to_series = np.cos(np.outer(np.arange(N_SAMPLES), angles)) * (2.0 / (N_SAMPLES - 1))
    to_series[[0, -1]] *= 0.5
    to_series[:, [0, -1]] *= 0.5
    return angles, to_series


def _shifted(coefficients: ComplexArray, centre: float) -> ComplexArray:
    """Return the coefficients of p(centre + u) - p(centre)."""
    n = coefficients.shape[0]
    taylor = np.array([[math.comb(m, k) * centre ** (m - k) if m >= k else 0.0 for m in range(n)] for k in range(n)])
    taylor[0] = 0.0
    return np.asarray(taylor @ coefficients)


def evaluate(coefficients: ComplexArray, t: ComplexArray) -> ComplexArray:
    """Evaluate n polynomials (n_powers, n), each at one of n points."""
    value: ComplexArray = coefficients[-1] + np.zeros_like(t)
    for coefficient in coefficients[-2::-1]:
        value *= t
        value += coefficient
    return value


def derivative(coefficients: ComplexArray) -> ComplexArray:
    """Return the coefficients of the derivatives."""
    result: ComplexArray = coefficients[1:] * np.arange(1, coefficients.shape[0])[:, None]
    return result


def divided_difference(coefficients: ComplexArray, root: ComplexArray) -> ComplexArray:
    """Return the coefficients of (p(root) - p(t)) / (root - t)."""
    quotient = np.empty((coefficients.shape[0] - 1, root.size), complex)
    quotient[-1] = coefficients[-1]
    for m in range(quotient.shape[0] - 1, 0, -1):
        quotient[m - 1] = coefficients[m] + root * quotient[m]
    return quotient


def find_parameters(
    geometry: CurvedGeometry, elements: IntArray, from_start: ComplexArray, from_end: ComplexArray
) -> tuple[ComplexArray, ComplexArray, BoolArray]:
    """Find the complex parameters t0 of points by Newton's method, relative to the nearer end.

    Parameters
    ----------
    geometry : CurvedGeometry
    elements : (n,) int array
    from_start, from_end : (n,) complex arrays
        Local coordinates of the points relative to both ends of the element.

    Returns
    -------
    plus, minus : (n,) complex arrays
        t0 + 1 and t0 - 1, each with full relative accuracy near its end.
    is_near : (n,) bool array
        Whether a root was found inside the ellipse `ELLIPSE`.
    """
    at_start = np.abs(from_start) < np.abs(from_end)
    target = np.where(at_start, from_start, from_end)
    coefficients = np.where(at_start, geometry.about_start[1:, elements], geometry.about_end[1:, elements])
    guesses = np.linspace(0.0, 2.0, 5)
    starts: ComplexArray = np.where(at_start, 1.0, -1.0) * guesses[:, None].astype(complex)
    distance = np.stack([np.abs(start * evaluate(coefficients, start) - target) for start in starts])
    u = starts[np.argmin(distance, axis=0), np.arange(target.size)]
    slopes = coefficients * np.arange(1, coefficients.shape[0] + 1)[:, None]
    change = np.full(u.shape, np.inf)
    active = np.arange(u.size)
    with np.errstate(all="ignore"):  # diverging iterates become nan and do not count as near
        for _ in range(MAX_NEWTON):
            here = u[active]
            value = here * evaluate(coefficients[:, active], here)
            step = (value - target[active]) / evaluate(slopes[:, active], here)
            u[active] = here - step
            change[active] = np.abs(step)
            active = active[(change[active] > 1e-15 * np.abs(u[active])) & (np.abs(u[active]) < 10.0)]
            if not active.size:
                break
        plus, minus = np.where(at_start, u, u + 2.0), np.where(at_start, u - 2.0, u)
        is_near = (change <= 1e-13 * np.abs(u)) | (change == 0.0)
        is_near &= np.abs(plus) + np.abs(minus) < 2.0 * ELLIPSE
    return plus, minus, is_near
