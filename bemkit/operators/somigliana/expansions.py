"""Series of the complex potentials of a cluster of elements, and how they move from cluster to cluster.

Displacements of plane strain are those of two analytic functions [Muskhelishvili1953],

    2 mu u = kappa phi(z) - (z - c) conj(phi'(z)) - conj(psi(z)),      kappa = 3 - 4 nu,

c being any point, on which psi depends: psi_d = psi_c + conj(d - c) phi'. A force F at w and a double layer of strength
v with the normal n there have, with f = -F / (8 pi (1 - nu)), g = mu n v / (4 pi (1 - nu)) and e = -2 Re(conj(n) v)
by the same factor,

    phi = f log(z - w) + g / (z - w)
    psi = -kappa conj(f) log(z - w) + (e - conj(w - c) f) / (z - w) + conj(w - c) g / (z - w)^2

(and the force a displacement -f / (2 mu) besides). Far from a disc around c of the radius r that holds all sources they
are ``a_0 log(z - c) + sum a_k (r / (z - c))^k``; in a disc far from all sources they are ``sum a_m ((z - c) / r)^m``
[GreengardRokhlin1987]. Coefficients are arrays (n_clusters, 2, order + 1), those of phi and of psi.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple, TypeVar

import numpy as np
from scipy.special import comb

from bemkit.arrays import ComplexArray, FloatArray, IntArray
from bemkit.operators.material import Material

Numbers = TypeVar("Numbers", FloatArray, ComplexArray)


class Sources(NamedTuple):
    """Places w from a centre [m] and strengths f, g (complex) and e of sources, arrays of one shape."""

    place: ComplexArray
    f: ComplexArray
    g: ComplexArray
    e: FloatArray


def layer_sources(
    y: ComplexArray, dy: ComplexArray, traction: ComplexArray, displacement: ComplexArray, material: Material
) -> Sources:
    """Return the sources of the single layer of tractions less the double layer of displacements.

    Parameters
    ----------
    y, dy : complex arrays of one shape [m]
        Gauss points on the boundary and the weighted steps along it.
    traction, displacement : complex arrays of the same shape [Pa], [m]
    material : Material
    """
    b = 1.0 / (np.pi * (material.kappa + 1.0))
    double = (b * material.shear_modulus) * dy
    return Sources(
        y, (-0.5 * b) * np.abs(dy) * traction, 1j * double * displacement, -2.0 * (double.conj() * displacement).imag
    )


@dataclass(frozen=True)
class Expansions:
    """Series of one order for one material.

    Parameters
    ----------
    order : int
        The largest power.
    kappa : float
        3 - 4 nu.
    log_length : float [m]
        Unit of length of the logarithm.
    """

    order: int
    kappa: float
    log_length: float

    @cached_property
    def _powers(self) -> FloatArray:
        return np.arange(self.order + 1.0)

    @cached_property
    def _of_local(self) -> FloatArray:
        """(order + 1, order + 1): (1 - x)^-k = sum C(m + k - 1, m) x^m, rows m; nothing of the logarithm, k = 0."""
        m, k = np.meshgrid(self._powers, self._powers, indexing="ij")
        return np.asarray(np.where(k > 0, comb(m + k - 1, m), 0.0))

    def of_sources(self, sources: Sources, radius: FloatArray, first: IntArray) -> ComplexArray:
        """Return the series of clusters of sources.

        Parameters
        ----------
        sources : Sources of (n_sources,) arrays
            Placed from the centre of the cluster of each.
        radius : (n_sources,) array [m]
            Of that cluster.
        first : (n_clusters,) int array
            The first source of each cluster.
        """
        f, x, g, e = sources.f, sources.place / radius, sources.g / radius, sources.e / radius
        on_psi, powers = -self.kappa * f.conj(), self._powers_of(x)
        columns = np.stack([f, on_psi, g, e - x.conj() * f, x.conj() * g], axis=1)
        ends = np.append(first[1:], x.size)
        # sums over the sources of a cluster, by power
        sums = np.stack([powers[i:j].T @ columns[i:j] for i, j in zip(first, ends, strict=True)])
        result = np.ascontiguousarray(sums[:, :, :2].transpose(0, 2, 1))
        result[:, :, 1:] /= -self._powers[1:]
        result[:, :, 1:] += sums[:, :-1, 2:4].transpose(0, 2, 1)
        result[:, 1, 2:] += self._powers[1:-1] * sums[:, :-2, 4]
        return result

    def of_parents(
        self, series: ComplexArray, arm: ComplexArray, radius: FloatArray, parent: FloatArray
    ) -> ComplexArray:
        """Return the series of the sources of clusters about the centres of their parents.

        Parameters
        ----------
        series : (n, 2, order + 1) complex array
            Of the clusters.
        arm : (n,) complex array [m]
            From the centre of the parent to that of the cluster.
        radius, parent : (n,) arrays [m]
            Radii of the cluster and of its parent.
        """
        own = series.copy()
        own[:, 1, 1:] -= (arm.conj() / radius)[:, None] * self._of_gradient(series[:, 0])
        own *= self._powers_of(radius / parent)[:, None]
        x = arm / parent
        logs = own[:, :, :1] * self._powers_of(x)[:, None, 1:] / self._powers[1:]
        terms = _by_power(own)
        for j in range(self.order - 1, 0, -1):  # (1 - x)^-k, Taylor's shift transposed
            for k in range(j, self.order):
                terms[k + 1] += x * terms[k]
        moved = _by_cluster(terms)
        moved[:, :, 1:] -= logs
        return moved

    def of_fields(
        self, series: ComplexArray, arm: ComplexArray, radius: FloatArray, target: FloatArray
    ) -> ComplexArray:
        """Return the series in discs of what sources in other discs, far away, cause.

        Parameters
        ----------
        series : (n, 2, order + 1) complex array
            Of the sources.
        arm : (n,) complex array [m]
            From the centre of the disc to that of the sources.
        radius, target : (n,) arrays [m]
            Radii of the sources and of the disc.
        """
        logs = series[:, :, 0]
        weighted = series * self._powers_of(-radius / arm)[:, None]
        parts = np.stack([weighted.real, weighted.imag]).reshape(-1, self.order + 1) @ self._of_local.T
        own = (parts[: parts.shape[0] // 2] + 1j * parts[parts.shape[0] // 2 :]).reshape(series.shape)
        own[:, :, 0] += logs * np.log(-arm / self.log_length)[:, None]
        own[:, 0, 0] -= logs[:, 0] / self.kappa  # the displacement -f / (2 mu)
        own[:, :, 1:] -= logs[:, :, None] / self._powers[1:]
        own *= self._powers_of(target / arm)[:, None]
        own[:, 1, :-1] -= (arm.conj() / target)[:, None] * own[:, 0, 1:] * self._powers[1:]
        return own

    def of_children(
        self, series: ComplexArray, arm: ComplexArray, radius: FloatArray, child: FloatArray
    ) -> ComplexArray:
        """Return the series in discs within discs.

        Parameters
        ----------
        series : (n, 2, order + 1) complex array
            In the larger discs.
        arm : (n,) complex array [m]
            From the centre of the larger disc to that of the smaller one.
        radius, child : (n,) arrays [m]
            Radii of both.
        """
        own = series.copy()
        own[:, 1, :-1] += (arm.conj() / radius)[:, None] * series[:, 0, 1:] * self._powers[1:]
        terms, x = _by_power(own), arm / radius
        for j in range(self.order):  # Taylor's shift by Horner's rule
            for k in range(self.order - 1, j - 1, -1):
                terms[k] += x * terms[k + 1]
        return _by_cluster(terms) * self._powers_of(child / radius)[:, None]

    def displacements(self, series: ComplexArray, arm: ComplexArray, radius: FloatArray) -> ComplexArray:
        """Return 2 mu u (n,) at points of discs.

        Parameters
        ----------
        series : (n, 2, order + 1) complex array
            Of the disc of each point.
        arm : (n,) complex array [m]
            From the centre of the disc to the point.
        radius : (n,) array [m]
        """
        x = arm / radius
        phi, psi, gradient = series[:, 0, -1], series[:, 1, -1], np.zeros_like(x)
        for k in range(self.order - 1, -1, -1):
            gradient = gradient * x + phi
            phi, psi = phi * x + series[:, 0, k], psi * x + series[:, 1, k]
        displacements: ComplexArray = self.kappa * phi - x * gradient.conj() - psi.conj()
        return displacements

    def outer_displacements(self, series: ComplexArray, arm: ComplexArray, radius: float) -> ComplexArray:
        """Return 2 mu u (n_points, n_series) at points outside of a disc.

        Parameters
        ----------
        series : (n_series, 2, order + 1) complex array
            Of the sources in the disc.
        arm : (n_points,) complex array [m]
            From the centre of the disc to the points.
        radius : float [m]
        """
        powers = self._powers_of(radius / arm)
        along = radius / arm[:, None] * powers * self._of_slope
        powers[:, 0] = np.log(arm / self.log_length)
        phi, psi, gradient = powers @ series[:, 0].T, powers @ series[:, 1].T, along @ series[:, 0].T
        return np.asarray(self.kappa * phi - series[:, 0, 0] - (arm / radius)[:, None] * gradient.conj() - psi.conj())

    def outer_gradients(
        self, series: ComplexArray, arm: ComplexArray, radius: float
    ) -> tuple[ComplexArray, ComplexArray]:
        """Return Phi = phi' and D = 2 mu du/dzbar, each (n_points, n_series); parameters as `outer_displacements`."""
        y = radius / arm[:, None]
        first = y * self._powers_of(y[:, 0]) * (self._of_slope / radius)
        second = y * first * (-(self._powers + 1.0) / radius)
        phi, psi = series[:, 0].T, series[:, 1].T
        return first @ phi, -arm[:, None] * (second @ phi).conj() - (first @ psi).conj()

    @cached_property
    def _of_slope(self) -> FloatArray:
        """(order + 1,): r times the derivative of (r / z)^k is this times (r / z)^(k + 1), of the logarithm r / z."""
        return np.concatenate([[1.0], -self._powers[1:]])

    def _of_gradient(self, phi: ComplexArray) -> ComplexArray:
        """Return r phi' (n, order), from the power 1 on, of phi (n, order + 1) outside of discs of the radius r."""
        return np.asarray(phi[:, :-1] * self._of_slope[:-1])

    def _powers_of(self, x: Numbers) -> Numbers:
        """Return the powers (n, order + 1) of numbers (n,)."""
        powers = np.repeat(x[:, None], self.order + 1, axis=1)
        powers[:, 0] = 1.0
        return np.multiply.accumulate(powers, axis=1, out=powers)


def _by_power(series: ComplexArray) -> ComplexArray:
    """Return series (n, 2, order + 1) as (order + 1, 2, n)."""
    return np.ascontiguousarray(series.transpose(2, 1, 0))


def _by_cluster(terms: ComplexArray) -> ComplexArray:
    """Return series (order + 1, 2, n) as (n, 2, order + 1)."""
    return np.ascontiguousarray(terms.transpose(2, 1, 0))
