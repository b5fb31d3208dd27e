"""Requests for element-pair integrals, and the integrals themselves."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bemkit.arrays import ComplexArray, FloatArray, IntArray
from bemkit.operators import kernels


@dataclass(frozen=True)
class Degrees:
    """Highest degrees (test, trial) of Legendre polynomials that are wanted; None leaves a family of integrals out."""

    log: tuple[int, int] | None = None
    double: tuple[int, int] | None = None

    def __or__(self, other: Degrees) -> Degrees:
        """Return the smallest request that covers both."""
        return Degrees(_cover(self.log, other.log), _cover(self.double, other.double))

    @property
    def n_trial(self) -> tuple[int, int]:
        """How many polynomials on the trial element the two families need."""
        return 0 if self.log is None else self.log[1] + 1, 0 if self.double is None else self.double[1] + 1

    @property
    def extra_points(self) -> int:
        """Gauss points on top of those for linear and quadratic elements: one for every two degrees more."""
        families = [family for family in (self.log, self.double) if family]
        return max((max(test, trial - 1) // 2 for test, trial in families), default=0)

    @property
    def highest_integral(self) -> int:
        """Highest C_k that the inner integrals need."""
        log = 0 if self.log is None else self.log[1] + 1
        return max(1, log, 0 if self.double is None else self.double[1])


def _cover(one: tuple[int, int] | None, two: tuple[int, int] | None) -> tuple[int, int] | None:
    if one is None or two is None:
        return one if two is None else two
    return max(one[0], two[0]), max(one[1], two[1])


@dataclass(frozen=True, eq=False)
class Inner:
    """Inner integrals over trial elements of half length 1 whose chord is the real axis, by degree b.

    Parameters
    ----------
    log, quotient, double : lists of arrays
        Integrals of P_b(t) log|rho|, P_b(t) rho / conj(rho) and 2 pi P_b(t) k, seen from one outer point for each pair.
    """

    log: list[FloatArray]
    quotient: list[ComplexArray]
    double: list[FloatArray]

    @classmethod
    def zeros(cls, degrees: Degrees, shape: tuple[int, ...]) -> Inner:
        """Return integrals that are all zero."""
        n_log, n_double = degrees.n_trial
        return cls(
            [np.zeros(shape) for _ in range(n_log)],
            [np.zeros(shape, complex) for _ in range(n_log)],
            [np.zeros(shape) for _ in range(n_double)],
        )

    @classmethod
    def straight(
        cls, degrees: Degrees, integrals: list[ComplexArray], log_product: FloatArray, eta: FloatArray
    ) -> Inner:
        """Combine the Cauchy integrals of straight elements (see `kernels`)."""
        n_log, n_double = degrees.n_trial
        return cls(
            [kernels.log_integral(b, integrals, log_product) for b in range(n_log)],
            [kernels.quotient_integral(b, integrals, eta) for b in range(n_log)],
            [integral.imag for integral in integrals[:n_double]],
        )


@dataclass(frozen=True, eq=False)
class PairIntegrals:
    """The integrals of some element pairs; the first two axes are the degrees (test, trial), the others the pairs."""

    log: FloatArray
    quotient: ComplexArray
    double: FloatArray

    @classmethod
    def zeros(cls, degrees: Degrees, shape: tuple[int, ...]) -> PairIntegrals:
        """Return integrals that are all zero."""
        log = (0, 0) if degrees.log is None else (degrees.log[0] + 1, degrees.log[1] + 1)
        double = (0, 0) if degrees.double is None else (degrees.double[0] + 1, degrees.double[1] + 1)
        return cls(np.zeros(log + shape), np.zeros(log + shape, complex), np.zeros(double + shape))

    def add(self, weight: float, xi: float, inner: Inner) -> None:
        """Add one outer point for every pair: `weight` at the test coordinate `xi`."""
        factors = (weight * self._test_values(xi)).tolist()
        for b, (log, quotient) in enumerate(zip(inner.log, inner.quotient, strict=True)):
            for a in range(self.log.shape[0]):
                self.log[a, b] += factors[a] * log
                self.quotient[a, b] += factors[a] * quotient
        for b, double in enumerate(inner.double):
            for a in range(self.double.shape[0]):
                self.double[a, b] += (factors[a] / (2.0 * np.pi)) * double

    def add_points(self, weight: FloatArray, xi: FloatArray, inner: Inner) -> None:
        """Add several outer points: weights and test coordinates (n_points, n or 1), integrals (n_points * n,)."""
        for a, factor in enumerate(weight * self._test_values(xi)):
            if a < self.log.shape[0]:
                for b, (log, quotient) in enumerate(zip(inner.log, inner.quotient, strict=True)):
                    self.log[a, b] += (factor * log.reshape(len(weight), -1)).sum(axis=0)
                    self.quotient[a, b] += (factor * quotient.reshape(len(weight), -1)).sum(axis=0)
            if a < self.double.shape[0]:
                for b, double in enumerate(inner.double):
                    self.double[a, b] += (factor / (2.0 * np.pi) * double.reshape(len(weight), -1)).sum(axis=0)

    def _test_values(self, xi: FloatArray | float) -> FloatArray:
        """Return the polynomials on the test element at some points."""
        return kernels.legendre_values(max(self.log.shape[0], self.double.shape[0]) - 1, xi)

    def scale(self, test_half: FloatArray, half: FloatArray, tangent: ComplexArray) -> None:
        """Turn sums for half lengths 1 and a real trial axis into the integrals of the elements themselves."""
        if self.log.size:
            self.log[0, 0] += 4.0 * np.log(half)
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
