"""Integrals of element pairs, and the degrees up to which they are required."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TypeVar

import numpy as np

from bemkit.arrays import ComplexArray, FloatArray, IntArray
from bemkit.operators import kernels

_Numbers = TypeVar("_Numbers", FloatArray, ComplexArray)


@dataclass(frozen=True)
class Degrees:
    """Highest degrees (test, trial) of the Legendre polynomials in each family of integrals; None excludes a family."""

    log: tuple[int, int] | None = None
    double: tuple[int, int] | None = None

    def __or__(self, other: Degrees) -> Degrees:
        """Return the smallest request that covers both."""
        return Degrees(_cover(self.log, other.log), _cover(self.double, other.double))

    @property
    def n_trial(self) -> tuple[int, int]:
        """Number of polynomials on the trial element in the two families."""
        return 0 if self.log is None else self.log[1] + 1, 0 if self.double is None else self.double[1] + 1

    @property
    def n_products(self) -> int:
        """Number of products of polynomials on both elements in the larger family."""
        families = [family for family in (self.log, self.double) if family]
        return max(((test + 1) * (trial + 1) for test, trial in families), default=1)

    @property
    def either_way(self) -> Degrees:
        """Degrees that cover both orders of test and trial elements."""
        log, double = (family and (max(family),) * 2 for family in (self.log, self.double))
        return Degrees(log, double)

    @property
    def extra_points(self) -> int:
        """Gauss points in addition to those of linear and quadratic elements: one for every two further degrees."""
        families = [family for family in (self.log, self.double) if family]
        return max((test // 2 for test, _ in families), default=0)

    @property
    def highest_integral(self) -> int:
        """Highest k of the C_k in the inner integrals."""
        log = 0 if self.log is None else self.log[1] + 1
        return max(1, log, 0 if self.double is None else self.double[1])


def _cover(first: tuple[int, int] | None, second: tuple[int, int] | None) -> tuple[int, int] | None:
    if first is None or second is None:
        return first if second is None else second
    return max(first[0], second[0]), max(first[1], second[1])


@dataclass(frozen=True, eq=False)
class Inner:
    """Inner integrals over elements of half length 1 with the real axis as chord, (n_polynomials, ...).

    Parameters
    ----------
    log, quotient : arrays
        Integrals of P_b(t) log|rho| and P_b(t) rho / conj(rho), for one outer point of each pair.
    cauchy : complex array
        The imaginary part is the integral of 2 pi P_b(t) k; on straight elements the value is C_b (see `kernels`).
    """

    log: FloatArray
    quotient: ComplexArray
    cauchy: ComplexArray

    @property
    def double(self) -> FloatArray:
        """Integrals of 2 pi P_b(t) k."""
        return self.cauchy.imag

    @classmethod
    def zeros(cls, degrees: Degrees, shape: tuple[int, ...]) -> Inner:
        """Return integrals that are zero."""
        n_log, n_double = degrees.n_trial
        return cls(np.zeros((n_log, *shape)), np.zeros((n_log, *shape), complex), np.zeros((n_double, *shape), complex))

    @classmethod
    def straight(cls, degrees: Degrees, integrals: ComplexArray, log_product: FloatArray, eta: FloatArray) -> Inner:
        """Combine the Cauchy integrals of straight elements (see `kernels`)."""
        n_log, n_double = degrees.n_trial
        log = kernels.log_integrals(integrals[: n_log + 1], log_product)
        return cls(log, kernels.quotient_integrals(integrals[:n_log], eta), integrals[:n_double])

    def rows(self) -> FloatArray:
        """Return all integrals as real numbers (n_rows, ...)."""
        return np.concatenate([self.log, self.quotient.real, self.quotient.imag, self.cauchy.real, self.cauchy.imag])

    @classmethod
    def from_rows(cls, degrees: Degrees, rows: FloatArray) -> Inner:
        """Return the integrals from the result of `rows`."""
        n_log, n_double = degrees.n_trial
        edges = np.cumsum([n_log, n_log, n_log, n_double])
        log, real, imaginary, cauchy_real, cauchy_imaginary = np.split(rows, edges)
        return cls(log, real + 1j * imaginary, cauchy_real + 1j * cauchy_imaginary)


@dataclass(frozen=True, eq=False)
class PairIntegrals:
    """The integrals of element pairs; the first two axes are the degrees (test, trial), the others the pairs."""

    log: FloatArray
    quotient: ComplexArray
    double: FloatArray

    @classmethod
    def zeros(cls, degrees: Degrees, shape: tuple[int, ...]) -> PairIntegrals:
        """Return integrals that are zero."""
        log = (0, 0) if degrees.log is None else (degrees.log[0] + 1, degrees.log[1] + 1)
        double = (0, 0) if degrees.double is None else (degrees.double[0] + 1, degrees.double[1] + 1)
        return cls(np.zeros(log + shape), np.zeros(log + shape, complex), np.zeros(double + shape))

    @classmethod
    def summed(cls, degrees: Degrees, inner: Sequence[Inner]) -> PairIntegrals:
        """Integrate inner integrals, given at each Gauss point, over the test elements."""
        n_polynomials = max((family[0] + 1 for family in (degrees.log, degrees.double) if family), default=1)
        weighted = kernels.legendre_weights(n_polynomials, len(inner))

        def total(family: tuple[int, int] | None, values: Sequence[FloatArray]) -> FloatArray:
            # axes: trial degree, point, pair; the sums are contiguous in trial degree, test degree, pair
            stacked = np.stack(values, axis=1)
            n_test = 0 if family is None else family[0] + 1
            sums = weighted[:n_test] @ stacked.reshape(len(stacked), len(inner), math.prod(stacked.shape[2:]))
            return sums.reshape(len(stacked), n_test, *stacked.shape[2:]).swapaxes(0, 1)

        quotient = total(degrees.log, [integrals.quotient.view(float) for integrals in inner])
        return cls(
            total(degrees.log, [integrals.log for integrals in inner]),
            quotient.view(complex),
            total(degrees.double, [integrals.double for integrals in inner]),
        )

    def scale(self, test_half: FloatArray, half: FloatArray, tangent: ComplexArray) -> None:
        """Scale integrals of half lengths 1 and a real trial axis to those of the elements, in place."""
        if self.log.size:
            self.log[0, 0] += 4.0 * np.log(half)
            self.log[:] *= test_half * half
            self.quotient[:] *= test_half * (half * tangent * tangent)
        if self.double.size:
            self.double[:] *= test_half / (2.0 * np.pi)

    def put(self, rows: IntArray | slice, columns: IntArray | slice, other: PairIntegrals) -> None:
        """Overwrite the integrals of pairs (rows, columns)."""
        self.log[:, :, rows, columns] = other.log
        self.quotient[:, :, rows, columns] = other.quotient
        self.double[:, :, rows, columns] = other.double

    @classmethod
    def concatenated(cls, degrees: Degrees, parts: Sequence[PairIntegrals]) -> PairIntegrals:
        """Concatenate lists of pairs, cut to the given degrees."""
        empty = cls.zeros(degrees, (0,))

        def together(target: _Numbers, lists: Sequence[_Numbers]) -> _Numbers:
            n_test, n_trial = target.shape[:2]
            return np.concatenate([values[:n_test, :n_trial] for values in lists], axis=-1)

        return cls(
            together(empty.log, [part.log for part in parts]),
            together(empty.quotient, [part.quotient for part in parts]),
            together(empty.double, [part.double for part in parts]),
        )

    @property
    def transposed(self) -> PairIntegrals:
        """The integrals with the degrees (trial, test) as first axes, not copied."""
        return PairIntegrals(self.log.swapaxes(0, 1), self.quotient.swapaxes(0, 1), self.double.swapaxes(0, 1))

    @property
    def size(self) -> int:
        """Number of listed pairs."""
        return int(self.log.shape[-1])

    def take(self, chosen: IntArray | slice) -> PairIntegrals:
        """Return some of the listed pairs, in the shape of `chosen`, or some columns."""
        return PairIntegrals(self.log[..., chosen], self.quotient[..., chosen], self.double[..., chosen])
