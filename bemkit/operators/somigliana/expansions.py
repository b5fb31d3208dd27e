"""Series of the complex potentials of clusters of elements, and their translations.

Far from a disc around c of radius r that contains all sources (`point_sources`) the potentials phi and psi are
``a_0 log(z - c) + sum a_k (r / (z - c))^k``; in a disc far from all sources they are ``sum a_m ((z - c) / r)^m``
[GreengardRokhlin1987]. Coefficients of phi and psi are arrays (n_clusters, 2, order + 1).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TypeVar

import numpy as np
from scipy.special import comb

from bemkit.arrays import ComplexArray, FloatArray, IntArray
from bemkit.operators.somigliana.point_sources import Sources

Numbers = TypeVar("Numbers", FloatArray, ComplexArray)


@dataclass(frozen=True)
class Expansions:
    """Series of a given order for one material.

    Parameters
    ----------
    order : int
        Highest power.
    kappa : float
        3 - 4 nu.
    log_length : float [m]
        Unit of length in the logarithm.

    Notes
    -----
    Methods take series (n, 2, order + 1) of n discs, their radii (n,) [m], and complex arms (n,) [m] between centres:
    from the larger disc to the smaller one, from a target to its sources, or from a disc to a point.
    """

    order: int
    kappa: float
    log_length: float

    @cached_property
    def _powers(self) -> FloatArray:
        return np.arange(self.order + 1.0)

    @cached_property
    def _of_local(self) -> FloatArray:
        """(order + 1, order + 1) array: (1 - x)^-k = sum C(m + k - 1, m) x^m, rows m; zero for the logarithm, k = 0."""
        m, k = np.meshgrid(self._powers, self._powers, indexing="ij")
        return np.asarray(np.where(k > 0, comb(m + k - 1, m), 0.0))

    def of_sources(self, sources: Sources, radius: FloatArray, first: IntArray) -> ComplexArray:
        """Return the series of clusters of sources.

        Parameters
        ----------
        sources : Sources of (n_sources,) arrays
            Positions are relative to the centre of the cluster.
        radius : (n_sources,) array [m]
            Radius of the cluster of each source.
        first : (n_clusters,) int array
            Index of the first source of each cluster.
        """
        f, x, g, e = sources.f, sources.position / radius, sources.g / radius, sources.e / radius
        on_psi, powers = -self.kappa * f.conj(), self._powers_of(x)
        columns = np.stack([f, on_psi, g, e - x.conj() * f, x.conj() * g], axis=1)
        ends = np.append(first[1:], x.size)
        # sums over the sources of a cluster for each power
        sums = np.stack([powers[i:j].T @ columns[i:j] for i, j in zip(first, ends, strict=True)])
        result = np.ascontiguousarray(sums[:, :, :2].transpose(0, 2, 1))
        result[:, :, 1:] /= -self._powers[1:]
        result[:, :, 1:] += sums[:, :-1, 2:4].transpose(0, 2, 1)
        result[:, 1, 2:] += self._powers[1:-1] * sums[:, :-2, 4]
        return result

    def of_parents(
        self, series: ComplexArray, arm: ComplexArray, radius: FloatArray, parent: FloatArray
    ) -> ComplexArray:
        """Translate the far series of clusters to the centres of their parents, of the radii `parent`."""
        scaled = series.copy()
        scaled[:, 1, 1:] -= (arm.conj() / radius)[:, None] * self._of_gradient(series[:, 0])
        scaled *= self._powers_of(radius / parent)[:, None]
        x = arm / parent
        logs = scaled[:, :, :1] * self._powers_of(x)[:, None, 1:] / self._powers[1:]
        terms = _by_power(scaled)
        for j in range(self.order - 1, 0, -1):  # transposed Taylor shift: (1 - x)^-k
            for k in range(j, self.order):
                terms[k + 1] += x * terms[k]
        translated = _by_cluster(terms)
        translated[:, :, 1:] -= logs
        return translated

    def of_fields(
        self, series: ComplexArray, arm: ComplexArray, radius: FloatArray, target: FloatArray
    ) -> ComplexArray:
        """Convert far series of sources to local series in distant discs, of the radii `target`."""
        logs = series[:, :, 0]
        weighted = series * self._powers_of(-radius / arm)[:, None]
        parts = np.stack([weighted.real, weighted.imag]).reshape(-1, self.order + 1) @ self._of_local.T
        local = (parts[: parts.shape[0] // 2] + 1j * parts[parts.shape[0] // 2 :]).reshape(series.shape)
        local[:, :, 0] += logs * np.log(-arm / self.log_length)[:, None]
        local[:, 0, 0] -= logs[:, 0] / self.kappa  # the displacement -f / (2 mu)
        local[:, :, 1:] -= logs[:, :, None] / self._powers[1:]
        local *= self._powers_of(target / arm)[:, None]
        local[:, 1, :-1] -= (arm.conj() / target)[:, None] * local[:, 0, 1:] * self._powers[1:]
        return local

    def of_children(
        self, series: ComplexArray, arm: ComplexArray, radius: FloatArray, child: FloatArray
    ) -> ComplexArray:
        """Translate local series of parent discs along arms to the centres of their children, of the radii `child`."""
        shifted = series.copy()
        shifted[:, 1, :-1] += (arm.conj() / radius)[:, None] * series[:, 0, 1:] * self._powers[1:]
        terms, x = _by_power(shifted), arm / radius
        for j in range(self.order):  # Taylor shift by Horner's rule
            for k in range(self.order - 1, j - 1, -1):
                terms[k] += x * terms[k + 1]
        return _by_cluster(terms) * self._powers_of(child / radius)[:, None]

    def displacements(self, series: ComplexArray, arm: ComplexArray, radius: FloatArray) -> ComplexArray:
        """Return 2 mu u (n,) at one point of each disc, from its local series."""
        x = arm / radius
        phi, psi, gradient = series[:, 0, -1], series[:, 1, -1], np.zeros_like(x)
        for k in range(self.order - 1, -1, -1):
            gradient = gradient * x + phi
            phi, psi = phi * x + series[:, 0, k], psi * x + series[:, 1, k]
        displacements: ComplexArray = self.kappa * phi - x * gradient.conj() - psi.conj()
        return displacements

    def outer_displacements(self, series: ComplexArray, arm: ComplexArray, radius: float) -> ComplexArray:
        """Return 2 mu u (n_points, n_series) at points (n_points,) outside of one disc, from far series of it."""
        powers = self._powers_of(radius / arm)
        along = radius / arm[:, None] * powers * self._of_slope
        powers[:, 0] = np.log(arm / self.log_length)
        phi, psi, gradient = powers @ series[:, 0].T, powers @ series[:, 1].T, along @ series[:, 0].T
        return np.asarray(self.kappa * phi - series[:, 0, 0] - (arm / radius)[:, None] * gradient.conj() - psi.conj())

    def outer_gradients(
        self, series: ComplexArray, arm: ComplexArray, radius: float
    ) -> tuple[ComplexArray, ComplexArray]:
        """Return Phi = phi' and D = 2 mu du/dzbar, each (n_points, n_series); see `outer_displacements`."""
        y = radius / arm[:, None]
        first = y * self._powers_of(y[:, 0]) * (self._of_slope / radius)
        second = y * first * (-(self._powers + 1.0) / radius)
        phi, psi = series[:, 0].T, series[:, 1].T
        return first @ phi, -arm[:, None] * (second @ phi).conj() - (first @ psi).conj()

    @cached_property
    def _of_slope(self) -> FloatArray:
        """(order + 1,) array: factors of (r / z)^(k + 1) in r times the derivative of (r / z)^k; for k = 0 of log z."""
        return np.concatenate([[1.0], -self._powers[1:]])

    def _of_gradient(self, phi: ComplexArray) -> ComplexArray:
        """Return the far series r phi' (n, order), powers 1 ..., for phi (n, order + 1)."""
        return np.asarray(phi[:, :-1] * self._of_slope[:-1])

    def _powers_of(self, x: Numbers) -> Numbers:
        """Return the powers (n, order + 1) of numbers (n,)."""
        powers = np.repeat(x[:, None], self.order + 1, axis=1)
        powers[:, 0] = 1.0
        return np.multiply.accumulate(powers, axis=1, out=powers)


def _by_power(series: ComplexArray) -> ComplexArray:
    """Transpose series (n, 2, order + 1) to (order + 1, 2, n)."""
    return np.ascontiguousarray(series.transpose(2, 1, 0))


def _by_cluster(terms: ComplexArray) -> ComplexArray:
    """Transpose series (order + 1, 2, n) to (n, 2, order + 1)."""
    return np.ascontiguousarray(terms.transpose(2, 1, 0))
