"""Estimated errors of elements of degree 3 and more, from the decay of their Legendre coefficients [Mavriplis1994].

On an element of degree p the slopes of the displacements and the tractions are polynomials of degree p - 1. Where the
exact fields are analytic their Legendre coefficients fall geometrically, near a singular point algebraically. In both
cases the last coefficients determine the size of those that are missing. No neighbour is needed, so that elements at
corners, where fields are singular and one-sided, are estimated like all others.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.polynomial import legendre

from bemkit.arrays import BoolArray, FloatArray, IntArray
from bemkit.geometry.local_values import element_degrees, values_on_elements
from bemkit.geometry.mesh import BoundaryMesh
from bemkit.geometry.neighbours import break_nodes
from bemkit.geometry.quadrature import gauss_legendre
from bemkit.geometry.spaces import BoundarySpace, dof_points, local_coefficients
from bemkit.operators.rigid_modes import without_motion

_N_MISSING = 64
"""Number of missing coefficients that are summed: of sequences that fall like 1 / k the rest is a hundredth."""
FASTEST = 0.05
"""Lower limit of the factor by which one more degree reduces the error."""
POWER = 0.3
"""Power of the distance from a corner or end of a part in tractions there: about the least of those with a bound."""
BOUNDED, LEAST_POWER = 0.0, -0.45
"""Powers that bound the missing coefficients: of fields with a bound, and of those whose square has an integral."""
_MORE_POINTS = 2


@dataclass(frozen=True, eq=False)
class CoefficientErrors:
    """Estimated errors of the elements of a solution.

    Parameters
    ----------
    energy : (n_elements,) array [J/m]
        Squared errors in the energy norm.
    traction : (n_elements,) array [Pa^2 m]
        Squared errors of the tractions in L2.
    energy_decay, traction_decay : (n_elements,) arrays
        Factors by which one more degree reduces the errors (not squared); 1 where the field is singular.
    last_traction : (n_elements,) array [Pa]
        Bounds of the last coefficients of the tractions.
    """

    energy: FloatArray
    traction: FloatArray
    energy_decay: FloatArray
    traction_decay: FloatArray
    last_traction: FloatArray

    @classmethod
    def joined(cls, several: Sequence[CoefficientErrors]) -> CoefficientErrors:
        """Return the errors of all elements, one list after the other."""
        return cls(
            *(np.concatenate(columns) for columns in zip(*(vars(errors).values() for errors in several), strict=True))
        )

    @classmethod
    def at_worst(cls, copies: Sequence[CoefficientErrors]) -> CoefficientErrors:
        """Return the largest error of all copies of a body on each element, multiplied by the number of copies."""
        columns = zip(*(vars(errors).values() for errors in copies), strict=True)
        energy, traction, *others = (np.max(column, axis=0) for column in columns)
        return cls(len(copies) * energy, len(copies) * traction, *others)

    def at_higher_degrees(self, rise: IntArray) -> CoefficientErrors:
        """Return the estimated errors with `rise` (n_elements,) degrees more."""
        energy, traction = (
            np.clip(decay, FASTEST, 1.0) ** (2 * rise) for decay in (self.energy_decay, self.traction_decay)
        )
        return replace(self, energy=self.energy * energy, traction=self.traction * traction)


def singular_error(last: float, length: float, degree: int, power: float) -> float:
    """Return the squared error [Pa^2 m] of tractions that are like a power of the distance from the end of an element.

    Parameters
    ----------
    last : float [Pa]
        Last Legendre coefficient of the tractions.
    length : float [m]
    degree : int
        Of the displacements.
    power : float
    """
    missing = last * _algebraic(degree, max(power, LEAST_POWER))
    return float(length * (missing**2 @ _odd(degree) ** -1.0))


def coefficient_errors(
    displacement_space: BoundarySpace,
    traction_space: BoundarySpace,
    displacement: FloatArray,
    traction: FloatArray,
    plane_modulus: float,
) -> CoefficientErrors:
    """Estimate the errors of each element from the Legendre coefficients of its slopes and tractions.

    Parameters
    ----------
    displacement_space, traction_space : BoundarySpace
        Continuous displacements of degree p and tractions of degree p - 1; p is at least 2 on each element and 3 on
        one.
    displacement : (n_scalar, 2) array [m]
    traction : (n_elements, p, 2) array [Pa]
        At the local nodes of the traction space, element by element.
    plane_modulus : float [Pa]
        E'.

    Notes
    -----
    On a half-plane <V t, t> is |t|^2 / (E' |k|) at the wave number k, and <W u, u> a quarter of |E' u'|^2 / (E' |k|).
    With |k| = (2 k + 1) / h for the Legendre polynomial k on an element of length h, a coefficient a has the squared
    norm h |a|^2 / (2 k + 1) in L2, in the energy norm h^2 |a|^2 / (E' (2 k + 1)^2), a quarter of that if of E' u'.
    """
    mesh, degree = displacement_space.mesh, element_degrees(displacement_space)
    strained = without_motion(mesh, dof_points(displacement_space), displacement)
    slopes = plane_modulus * _slope_coefficients(displacement_space, values_on_elements(displacement_space, strained))
    tractions = np.einsum("lk,elc->ekc", local_coefficients(traction_space), traction)
    at_break = np.asarray(break_nodes(mesh)[mesh.elements].any(axis=1))
    of_slopes, of_tractions = _missing(slopes, degree, at_break), _missing(tractions, degree, at_break)
    energies = 0.25 * of_slopes.energy, of_tractions.energy
    total = energies[0] + energies[1]
    squared_decay = energies[0] * of_slopes.decay**2 + energies[1] * of_tractions.decay**2
    return CoefficientErrors(
        energy=mesh.lengths**2 / plane_modulus * total,
        traction=mesh.lengths * of_tractions.mean_square,
        # weighted by the errors: coefficients of tractions that vanish are round-off, which does not fall
        energy_decay=np.sqrt(squared_decay / np.maximum(total, np.finfo(float).tiny)),
        traction_decay=of_tractions.decay,
        last_traction=of_tractions.last,
    )


def _slope_coefficients(space: BoundarySpace, displacement: FloatArray) -> FloatArray:
    """Return the Legendre coefficients (n_elements, p, 2) of du/ds."""
    mesh: BoundaryMesh = space.mesh
    xi, weights = gauss_legendre(space.degree + _MORE_POINTS)
    polynomials = legendre.legvander(xi, space.degree - 1)
    derivatives = polynomials @ legendre.legder(local_coefficients(space).T)  # (n_points, n_local)
    slopes = np.einsum("ql,elc->eqc", derivatives, displacement)
    slopes /= mesh.jacobian(np.arange(mesh.n_elements), xi)[:, :, None]
    projection = (polynomials * weights[:, None]) * (np.arange(space.degree) + 0.5)
    return np.asarray(np.einsum("qk,eqc->ekc", projection, slopes))


class _Missing(NamedTuple):
    """Sums (n,) of a^2 / (2 k + 1)^2 and a^2 / (2 k + 1) of the missing coefficients a, their ratio, the last known."""

    energy: FloatArray
    mean_square: FloatArray
    decay: FloatArray
    last: FloatArray


def _missing(coefficients: FloatArray, degrees: IntArray, at_break: BoolArray) -> _Missing:
    """Continue the Legendre coefficients (n, largest degree, 2) of elements.

    A geometric sequence is fitted to the second half of the coefficients. Each is taken as large as any after it, since
    every other coefficient of an odd or even field is zero: see `_without_gaps`. Missing ones fall at least like 1 / k,
    as where a field has a square root inside an element.
    """
    energy, mean_square, decay, last = np.empty((4, degrees.size))
    for n_known in np.unique(degrees).tolist():
        chosen = degrees == n_known
        bounds = _without_gaps(np.linalg.norm(coefficients[chosen, :n_known], axis=2), at_break[chosen])
        n_fitted = max(2, min(n_known - 1, n_known // 2 + 1))
        k = np.arange(n_fitted) - 0.5 * (n_fitted - 1)
        logarithms = np.log(np.maximum(bounds[:, n_known - n_fitted :], np.finfo(float).tiny))
        ratio = np.exp(np.minimum(logarithms @ k / (k @ k), 0.0))
        relative = np.minimum(ratio[:, None] ** (1.0 + np.arange(_N_MISSING)), _algebraic(n_known, BOUNDED))
        singular = np.where(at_break[chosen, None], np.maximum(relative, _algebraic(n_known, POWER)), relative)
        last[chosen], decay[chosen] = bounds[:, -1], ratio
        energy[chosen] = bounds[:, -1] ** 2 * (relative**2 @ _odd(n_known) ** -2.0)
        mean_square[chosen] = bounds[:, -1] ** 2 * (singular**2 @ _odd(n_known) ** -1.0)
    return _Missing(energy, mean_square, decay, last)


def _without_gaps(sizes: FloatArray, at_break: BoolArray) -> FloatArray:
    """Return bounds (n, n_known) of coefficients that never rise, from sizes of which every other one may be zero.

    The last one is at least half of what three before it lead to, less where they do not alternate; of three, the
    middle one at least the geometric mean of its neighbours, except beside corners and ends of parts: layers there are
    not symmetric. Otherwise an element in whose middle a field is symmetric had no error, or one that hardly falls.
    """
    known, n_known = sizes.copy(), sizes.shape[1]
    if n_known >= 4:
        before, next_to_last = sizes[:, -4:].max(axis=1), sizes[:, -2]
        expected = next_to_last * np.sqrt(next_to_last / np.maximum(before, np.finfo(float).tiny))
        alternates = np.minimum(1.0, next_to_last / np.maximum(sizes[:, -3], np.finfo(float).tiny))
        known[:, -1] = np.maximum(known[:, -1], 0.5 * alternates * expected)
    if n_known == 3:
        known[:, 1] = np.maximum(known[:, 1], np.where(at_break, 0.0, np.sqrt(known[:, 0] * known[:, 2])))
    return np.asarray(np.maximum.accumulate(known[:, ::-1], axis=1)[:, ::-1])


def _odd(n_known: int) -> FloatArray:
    """Return 2 k + 1 of the missing coefficients."""
    return np.asarray(2.0 * (n_known + np.arange(_N_MISSING)) + 1.0)


def _algebraic(n_known: int, power: float) -> FloatArray:
    """Return the missing coefficients of d**power, d the distance from the end of an element, over the last known."""
    k = n_known - 1.0 + np.arange(_N_MISSING)
    return np.asarray(np.cumprod((2.0 * k + 3.0) / (2.0 * k + 1.0) * (k - power) / (k + power + 2.0)))
