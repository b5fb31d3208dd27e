"""Collocation with constant elements (the paper's discretisation): both boundary matrices at the element midpoints.

With complex tractions p and displacements v on an element from a to b, chord direction tau, half length l, seen from x:

    U p = A l ([1 - kappa (2 log(l / r0) + L)] p + tau^2 [Q / 2] conj(p)),                   A = 1 / (8 pi mu (1 - nu))
    T v = [D / (2 pi) - i B (1 - 2 nu) lambda] v + (i B / 2) [rho / conj(rho)]_a^b conj(v),  B = 1 / (4 pi (1 - nu))

where kappa = 3 - 4 nu, L, Q, D are the inner integrals (`pairs.Inner`) of log|rho|, rho / conj(rho) and 2 pi k over the
element of half length 1, and lambda = log(|x - a| / |x - b|): of the double layer only k is left to integrate, the rest
are differences between the ends, on straight and on curved elements alike. On its own element D is a principal value;
on straight ones it is zero. Then (1/2 I + T) u = U t.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bemkit.arrays import ComplexArray, FloatArray, IntArray
from bemkit.geometry.mesh import BoundaryMesh
from bemkit.operators import kernels
from bemkit.operators.inner import far_inner, inner_integrals, inner_on_element, store
from bemkit.operators.material import Material
from bemkit.operators.pairs import Degrees
from bemkit.operators.panels import Panels, squared_distance
from bemkit.operators.threads import for_each_chunk

DENSE_DISTANCE = 16.0
"""Pairs closer than this, in half lengths of the element, take the closed forms instead of the far series."""
MANY_ELEMENTS = 700
DENSE_DISTANCE_OF_MANY = 45.0
"""With many elements few pairs are close, and a shorter series for all others pays."""
CURVED_DISTANCE = 4.5
"""Curved elements farther than this take a Gauss rule; the distance is measured in the parameter (`Panels.reach`)."""
CURVED_POINTS = 8
"""Points of that rule: its error is about (4.5 + sqrt(4.5^2 - 1))^-16, below 1e-15."""
CHUNK_PAIRS = 32768
DEGREES = Degrees(log=(0, 0), double=(0, 0))


def collocation_matrices(mesh: BoundaryMesh, material: Material) -> tuple[FloatArray, FloatArray]:
    """Return the single and the double layer of constant densities at the element midpoints.

    Parameters
    ----------
    mesh : BoundaryMesh
        x is the point in the middle of the arc of each element.
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
    distance = DENSE_DISTANCE if n < MANY_ELEMENTS else DENSE_DISTANCE_OF_MANY

    def fill(rows: slice) -> None:
        (a, b, c, d), close = _dense(panels, material, rows, log_half, distance)
        for row, column in close:
            values = _listed(panels, material, row + rows.start, column, log_half)
            for target, value in zip((a, b, c, d), values, strict=True):
                target[row, column] = value
        _write(single, rows, a, None, b)
        _write(double, rows, c.real, c.imag, d)
        _balance(double, rows, c.sum(axis=1), d.sum(axis=1), 0.5 if mesh.is_exterior else -0.5)

    step = max(1, CHUNK_PAIRS // n)
    for_each_chunk(fill, (slice(first, min(first + step, n)) for first in range(0, n, step)), n_pairs=n * n)
    return single.reshape(2 * n, 2 * n), double.reshape(2 * n, 2 * n)


def _balance(double: FloatArray, rows: slice, value: ComplexArray, conjugate: ComplexArray, constant: float) -> None:
    """Make the double layer of a constant displacement exact in the diagonal blocks.

    An element of length h at coordinates of size one has its midpoint to eps / h only; the tractions there feel that
    divided by h again unless a translation causes none. `value` and `conjugate` are the row sums of the coefficients.
    """
    own = np.arange(rows.start, rows.stop)
    sums = np.zeros((own.size, 2, 1, 2))
    _write(sums, slice(None), value.real[:, None], value.imag[:, None], conjugate[:, None])
    double[own, :, own, :] += constant * np.eye(2) - sums[:, :, 0]


ClosePairs = list[tuple[IntArray, IntArray]]
"""(row, column) pairs too close for the far formulas: those of straight columns, then of curved ones."""


def _close_pairs(panels: Panels, rows: slice, distance: float) -> ClosePairs:
    """Find the close pairs by their distances."""
    reach = panels.half * np.where(panels.is_straight, distance, panels.reach(CURVED_DISTANCE))
    row, column = np.nonzero(squared_distance(panels.centre[rows, None], panels.centre) < reach**2)
    kinds = (panels.is_straight[column], ~panels.is_straight[column])
    return [(row[kind], column[kind]) for kind in kinds if kind.any()]


Coefficients = tuple[FloatArray, ComplexArray, ComplexArray, ComplexArray]


@dataclass(frozen=True, eq=False)
class _Seen:
    """What points see of elements of half length 1 with a chord along the real axis.

    `angle` is D, `stretch` lambda, and `turn` is -i / 2 times the difference of rho / conj(rho) between the ends.
    """

    log: FloatArray
    half_quotient: ComplexArray
    angle: FloatArray
    stretch: FloatArray
    turn: ComplexArray

    def combine(
        self, panels: Panels, material: Material, columns: IntArray | slice, log_half: FloatArray
    ) -> Coefficients:
        """Return the factors of p and conj(p) in the single layer, then those of v and conj(v) in the double layer."""
        nu = material.effective_poisson_ratio
        a = panels.half[columns] / (8.0 * np.pi * material.shear_modulus * (1.0 - nu))
        b = -1.0 / (4.0 * np.pi * (1.0 - nu))
        square = panels.tangent[columns] ** 2
        on_p = a * (1.0 - 2.0 * (3.0 - 4.0 * nu) * log_half[columns]) - (a * (3.0 - 4.0 * nu)) * self.log
        on_conj_p = (a * square) * self.half_quotient
        on_v = _complex(self.angle / (2.0 * np.pi), (b * (1.0 - 2.0 * nu)) * self.stretch)
        on_conj_v = (b * square) * self.turn
        return on_p, on_conj_p, on_v, on_conj_v


def _dense(
    panels: Panels, material: Material, rows: slice, log_half: FloatArray, distance: float
) -> tuple[Coefficients, ClosePairs]:
    """Evaluate all pairs of some rows by the far formulas, and find those that are too close for them."""
    x = panels.centre[rows, None]
    with np.errstate(all="ignore"):  # close pairs may overflow here; the caller replaces them
        if panels.bent is None:
            seen = _straight_far(panels, x, slice(None), distance)
            # the log integral is log|zeta^2| up to 1 / |zeta|^2, and not a number on the element itself
            row, column = np.nonzero(~(seen.log > 2.0 * np.log(distance) + 2.0 / distance**2))
            return seen.combine(panels, material, slice(None), log_half), [(row, column)]
        straight, curved = np.flatnonzero(panels.is_straight), np.flatnonzero(~panels.is_straight)
        left = _straight_far(panels, x, straight, distance).combine(panels, material, straight, log_half)
        right = _curved_far(panels, x, curved).combine(panels, material, curved, log_half)
    order = np.argsort(np.concatenate([straight, curved]))
    a, b, c, d = (np.concatenate(pair, axis=1)[:, order] for pair in zip(left, right, strict=True))
    return (a, b, c, d), _close_pairs(panels, rows, distance)


def _straight_far(panels: Panels, x: ComplexArray, columns: IntArray | slice, distance: float) -> _Seen:
    """Use the series of the closed forms."""
    zeta = (x - panels.centre[columns]) * panels.to_local[columns]
    first, second = kernels.far_moments(zeta, 1, kernels.terms_needed(distance))
    log = kernels.far_log_product(zeta) + second.real
    eta, angle, stretch = zeta.imag.copy(), first.imag.copy(), first.real.copy()
    turn = eta * kernels.gradient_moment(zeta * zeta - 1.0).conj()
    return _Seen(log, _complex(1.0 + eta * angle, eta * stretch), angle, stretch, turn)


def _curved_far(panels: Panels, x: ComplexArray, columns: IntArray) -> _Seen:
    """Use a Gauss rule."""
    zeta = (x - panels.centre[columns]) * panels.to_local[columns]
    inner = far_inner(DEGREES, panels.polynomials(columns), zeta, CURVED_POINTS)
    start, end = (((p - panels.centre) * panels.to_local)[columns] for p in (panels.start, panels.end))
    plus, minus = zeta - start, zeta - end
    chord = (end - start).real
    # |plus|^2 - |minus|^2 = chord Re(plus + minus): log1p keeps the digits of the difference of two logarithms
    stretch = 0.5 * np.log1p(chord * (plus + minus).real / (np.square(minus.real) + np.square(minus.imag)))
    return _Seen(inner.log[0], 0.5 * inner.quotient[0], inner.double[0], stretch, _turn(chord, plus, minus, plus.imag))


def _listed(
    panels: Panels, material: Material, rows: IntArray, columns: IntArray, log_half: FloatArray
) -> Coefficients:
    """Evaluate listed pairs, all straight or all curved, exactly at any distance."""
    from_start, from_end = panels.centre[rows] - panels.start[columns], panels.centre[rows] - panels.end[columns]
    plus, minus = from_start * panels.to_local[columns], from_end * panels.to_local[columns]
    inner = inner_integrals(panels, DEGREES, columns, from_start, from_end)
    same = rows == columns
    if same.any():
        store(inner, same, inner_on_element(panels, DEGREES, columns[same], 0.0))
        is_straight = panels.is_straight[columns[same]]
        plus[same], minus[same] = np.where(is_straight, 1.0, plus[same]), np.where(is_straight, -1.0, minus[same])
    eta = np.where(np.abs(plus) < np.abs(minus), plus.imag, minus.imag)
    stretch = np.log(np.abs(plus)) - np.log(np.abs(minus))
    turn = _turn((plus - minus).real, plus, minus, eta)
    seen = _Seen(inner.log[0], 0.5 * inner.quotient[0], inner.double[0], stretch, turn)
    return seen.combine(panels, material, columns, log_half)


def _turn(chord: FloatArray, plus: ComplexArray, minus: ComplexArray, eta: FloatArray) -> ComplexArray:
    """Return minus / conj(minus) - plus / conj(plus), times -i / 2, without cancellation."""
    turn: ComplexArray = chord * eta / (plus * minus).conj()
    return turn


def _complex(real: FloatArray, imaginary: FloatArray) -> ComplexArray:
    """Join two arrays; cheaper than arithmetic with 1j."""
    result = np.empty(real.shape, complex)
    result.real, result.imag = real, imaginary
    return result


def _write(
    matrix: FloatArray, rows: slice, real: FloatArray, imaginary: FloatArray | None, on_conjugate: ComplexArray
) -> None:
    """Write v -> (a + i b) v + c conj(v) as real 2 x 2 blocks; b may be left out."""
    matrix[rows, 0, :, 0] = real + on_conjugate.real
    matrix[rows, 0, :, 1] = on_conjugate.imag if imaginary is None else on_conjugate.imag - imaginary
    matrix[rows, 1, :, 0] = on_conjugate.imag if imaginary is None else on_conjugate.imag + imaginary
    matrix[rows, 1, :, 1] = real - on_conjugate.real
