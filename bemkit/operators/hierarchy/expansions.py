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

import numpy as np
from scipy.special import comb

from bemkit.arrays import ComplexArray, FloatArray, IntArray


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

    @cached_property
    def _of_parent(self) -> FloatArray:
        """(order + 1, order + 1): what x^(m - k) is multiplied by in row m; the logarithm is a - sum x^m / m."""
        row, k = np.meshgrid(self._powers, self._powers, indexing="ij")
        of_log = np.where(row > 0, -1.0 / np.maximum(row, 1.0), 1.0)
        return np.asarray(np.where(row >= k, np.where(k > 0, comb(row - 1, k - 1), of_log), 0.0))

    @cached_property
    def _of_child(self) -> FloatArray:
        """(order + 1, order + 1): (y + x)^k = sum C(k, m) x^(k - m) y^m, rows m."""
        m, k = np.meshgrid(self._powers, self._powers, indexing="ij")
        return np.asarray(comb(k, m))

    def of_sources(
        self, arm: ComplexArray, radius: FloatArray, f: ComplexArray, g: ComplexArray, e: FloatArray, first: IntArray
    ) -> ComplexArray:
        """Return the series of clusters of sources.

        Parameters
        ----------
        arm : (n_sources,) complex array [m]
            From the centre of the cluster of each source.
        radius : (n_sources,) array [m]
            Of that cluster.
        f, g : (n_sources,) complex arrays
        e : (n_sources,) array
        first : (n_clusters,) int array
            The first source of each cluster.
        """
        result = np.empty((first.size, 2, self.order + 1), complex)
        x, g, e = arm / radius, g / radius, e / radius
        inner = e - x.conj() * f
        on_psi = -self.kappa * f.conj()
        result[:, 0, 0], result[:, 1, 0] = np.add.reduceat(f, first), np.add.reduceat(on_psi, first)
        power, g_twice, before = np.ones_like(x), x.conj() * g, np.zeros_like(x)
        for k in range(1, self.order + 1):
            of_log = power * x / -k
            result[:, 0, k] = np.add.reduceat(f * of_log + g * power, first)
            result[:, 1, k] = np.add.reduceat(on_psi * of_log + inner * power + (k - 1.0) * g_twice * before, first)
            before, power = power, power * x
        return result

    def of_parents(
        self, series: ComplexArray, arm: ComplexArray, radius: FloatArray, parent: FloatArray
    ) -> ComplexArray:
        """Return what the sources of clusters add to the series of their parents.

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
        own *= (radius / parent)[:, None, None] ** self._powers
        return np.asarray(own @ self._moving(self._of_parent, arm / parent).transpose(0, 2, 1))

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
        weighted = series * (-radius / arm)[:, None, None] ** self._powers
        result = (
            weighted.reshape(-1, self.order + 1).view(float).reshape(-1, self.order + 1, 2).transpose(0, 2, 1)
            @ self._of_local.T
        ).transpose(0, 2, 1)
        own = np.ascontiguousarray(result).view(complex)[..., 0].reshape(series.shape)
        own[:, :, 0] += logs * np.log(-arm / self.log_length)[:, None]
        own[:, 0, 0] -= logs[:, 0] / self.kappa  # the displacement -f / (2 mu)
        own[:, :, 1:] -= logs[:, :, None] / self._powers[1:]
        own *= (target / arm)[:, None, None] ** self._powers
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
        moved = own @ self._moving(self._of_child.T, arm / radius)
        return np.asarray(moved * (child / radius)[:, None, None] ** self._powers)

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

    def _of_gradient(self, phi: ComplexArray) -> ComplexArray:
        """Return r phi' (n, order), from the power 1 on, of phi (n, order + 1) outside of discs of the radius r."""
        factors = np.concatenate([[1.0], -self._powers[1:-1]])
        return np.asarray(phi[:, :-1] * factors)

    def _moving(self, factors: FloatArray, x: ComplexArray) -> ComplexArray:
        """Return lower triangles (n, order + 1, order + 1) of factors times x^(row - column)."""
        rows, columns = np.indices(factors.shape)
        powers: ComplexArray = x[:, None] ** self._powers
        return np.where(rows >= columns, factors * powers[:, np.abs(rows - columns)], 0.0)
