"""Requests for element-pair integrals, and the integrals themselves."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bemkit.arrays import ComplexArray, FloatArray, IntArray
from bemkit.operators import kernels


@dataclass(frozen=True)
class Degrees:
    """Highest powers (test, trial) of the local coordinates that are wanted; None leaves a family of integrals out."""

    log: tuple[int, int] | None = None
    double: tuple[int, int] | None = None

    def __or__(self, other: Degrees) -> Degrees:
        """Return the smallest request that covers both."""
        return Degrees(_cover(self.log, other.log), _cover(self.double, other.double))

    @property
    def trial_powers(self) -> tuple[int, int]:
        """How many powers of the trial coordinate the two families need."""
        return 0 if self.log is None else self.log[1] + 1, 0 if self.double is None else self.double[1] + 1

    @property
    def highest_moment(self) -> int:
        """Highest T_k that the inner integrals need."""
        log = 0 if self.log is None else self.log[1] + 1
        return max(1, log, 0 if self.double is None else self.double[1])


def _cover(one: tuple[int, int] | None, two: tuple[int, int] | None) -> tuple[int, int] | None:
    if one is None or two is None:
        return one if two is None else two
    return max(one[0], two[0]), max(one[1], two[1])


@dataclass(frozen=True, eq=False)
class Inner:
    """Inner integrals over trial elements of half length 1 whose chord is the real axis, by power b of the coordinate.

    Parameters
    ----------
    log, quotient, double : lists of arrays
        Integrals of t**b log|rho|, t**b rho / conj(rho) and 2 pi t**b k, seen from one outer point for each pair.
    """

    log: list[FloatArray]
    quotient: list[ComplexArray]
    double: list[FloatArray]

    @classmethod
    def zeros(cls, degrees: Degrees, shape: tuple[int, ...]) -> Inner:
        """Return integrals that are all zero."""
        n_log, n_double = degrees.trial_powers
        return cls(
            [np.zeros(shape) for _ in range(n_log)],
            [np.zeros(shape, complex) for _ in range(n_log)],
            [np.zeros(shape) for _ in range(n_double)],
        )

    @classmethod
    def straight(cls, degrees: Degrees, moments: list[ComplexArray], log_product: FloatArray, eta: FloatArray) -> Inner:
        """Combine the moments of straight elements (see `kernels`)."""
        n_log, n_double = degrees.trial_powers
        return cls(
            [kernels.log_moment(b, moments, log_product) for b in range(n_log)],
            [kernels.quotient_moment(b, moments, eta) for b in range(n_log)],
            [moment.imag for moment in moments[:n_double]],
        )


@dataclass(frozen=True, eq=False)
class PairIntegrals:
    """The integrals of some element pairs; the first two axes are the powers (test, trial), the others the pairs."""

    log: FloatArray
    quotient: ComplexArray
    double: FloatArray

    @classmethod
    def zeros(cls, degrees: Degrees, shape: tuple[int, ...]) -> PairIntegrals:
        """Return integrals that are all zero."""
        log = (0, 0) if degrees.log is None else (degrees.log[0] + 1, degrees.log[1] + 1)
        double = (0, 0) if degrees.double is None else (degrees.double[0] + 1, degrees.double[1] + 1)
        return cls(np.zeros(log + shape), np.zeros(log + shape, complex), np.zeros(double + shape))

    def add(self, weight: FloatArray | float, xi: FloatArray | float, inner: Inner) -> None:
        """Add one outer point (or one point for each pair): `weight` at the test coordinate `xi`."""
        for b, (log, quotient) in enumerate(zip(inner.log, inner.quotient, strict=True)):
            for a in range(self.log.shape[0]):
                factor = weight * xi**a if a else weight
                self.log[a, b] += factor * log
                self.quotient[a, b] += factor * quotient
        for b, double in enumerate(inner.double):
            for a in range(self.double.shape[0]):
                self.double[a, b] += (weight * xi**a / (2.0 * np.pi)) * double

    def add_points(self, weight: FloatArray, xi: FloatArray, inner: Inner) -> None:
        """Add several outer points: weights and test coordinates (n_points, n or 1), integrals (n_points * n,)."""
        for a in range(max(self.log.shape[0], self.double.shape[0])):
            factor = weight * xi**a if a else weight
            if a < self.log.shape[0]:
                for b, (log, quotient) in enumerate(zip(inner.log, inner.quotient, strict=True)):
                    self.log[a, b] += (factor * log.reshape(len(weight), -1)).sum(axis=0)
                    self.quotient[a, b] += (factor * quotient.reshape(len(weight), -1)).sum(axis=0)
            if a < self.double.shape[0]:
                for b, double in enumerate(inner.double):
                    self.double[a, b] += (factor / (2.0 * np.pi) * double.reshape(len(weight), -1)).sum(axis=0)

    def scale(self, test_half: FloatArray, half: FloatArray, tangent: ComplexArray) -> None:
        """Turn sums for half lengths 1 and a real trial axis into the integrals of the elements themselves."""
        log_half = np.log(half)
        for a in range(self.log.shape[0]):
            for b in range(self.log.shape[1]):
                constant = kernels.interval_moment(a) * kernels.interval_moment(b)
                if constant:
                    self.log[a, b] += constant * log_half
        if self.log.size:
            self.log[:] *= test_half * half
            self.quotient[:] *= test_half * (half * tangent * tangent)
        if self.double.size:
            self.double[:] *= test_half

    def put(self, rows: IntArray | slice, columns: IntArray | slice, other: PairIntegrals) -> None:
        """Overwrite the pairs (rows, columns) with those of `other`."""
        self.log[:, :, rows, columns] = other.log
        self.quotient[:, :, rows, columns] = other.quotient
        self.double[:, :, rows, columns] = other.double

    def take(self, chosen: slice) -> PairIntegrals:
        """Return some of the listed pairs."""
        return PairIntegrals(self.log[..., chosen], self.quotient[..., chosen], self.double[..., chosen])
