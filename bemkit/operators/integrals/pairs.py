"""Requests for element-pair integrals, and the integrals themselves."""

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
    def n_products(self) -> int:
        """How many products of polynomials on the two elements the larger family has."""
        families = [family for family in (self.log, self.double) if family]
        return max(((test + 1) * (trial + 1) for test, trial in families), default=1)

    @property
    def either_way(self) -> Degrees:
        """The same with test and trial elements exchanged, too."""
        log, double = (family and (max(family),) * 2 for family in (self.log, self.double))
        return Degrees(log, double)

    @property
    def extra_points(self) -> int:
        """Gauss points on top of those for linear and quadratic elements: one for every two degrees more."""
        families = [family for family in (self.log, self.double) if family]
        return max((test // 2 for test, _ in families), default=0)

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
    """Inner integrals over elements of half length 1 whose chord is the real axis, (n_polynomials, ...).

    Parameters
    ----------
    log, quotient : arrays
        Integrals of P_b(t) log|rho| and P_b(t) rho / conj(rho), seen from one outer point for each pair.
    cauchy : complex array
        Its imaginary part is the integral of 2 pi P_b(t) k; on straight elements it is C_b (see `kernels`).
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
        """Return integrals that are all zero."""
        n_log, n_double = degrees.n_trial
        return cls(np.zeros((n_log, *shape)), np.zeros((n_log, *shape), complex), np.zeros((n_double, *shape), complex))

    @classmethod
    def straight(cls, degrees: Degrees, integrals: ComplexArray, log_product: FloatArray, eta: FloatArray) -> Inner:
        """Combine the Cauchy integrals of straight elements (see `kernels`)."""
        n_log, n_double = degrees.n_trial
        log = kernels.log_integrals(integrals[: n_log + 1], log_product)
        return cls(log, kernels.quotient_integrals(integrals[:n_log], eta), integrals[:n_double])

    def rows(self) -> FloatArray:
        """Return all of them as (n_rows, ...) real numbers; `from_rows` undoes it."""
        return np.concatenate([self.log, self.quotient.real, self.quotient.imag, self.cauchy.real, self.cauchy.imag])

    @classmethod
    def from_rows(cls, degrees: Degrees, rows: FloatArray) -> Inner:
        """Split what `rows` has joined."""
        n_log, n_double = degrees.n_trial
        edges = np.cumsum([n_log, n_log, n_log, n_double])
        log, real, imaginary, cauchy_real, cauchy_imaginary = np.split(rows, edges)
        return cls(log, real + 1j * imaginary, cauchy_real + 1j * cauchy_imaginary)


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

    @classmethod
    def summed(cls, degrees: Degrees, inner: Sequence[Inner]) -> PairIntegrals:
        """Sum inner integrals seen from all Gauss points of one rule on the test elements."""
        n_polynomials = max((family[0] + 1 for family in (degrees.log, degrees.double) if family), default=1)
        weighted = kernels.legendre_weights(n_polynomials, len(inner))

        def total(family: tuple[int, int] | None, values: Sequence[FloatArray]) -> FloatArray:
            # by trial degree, point and pair; the sums are contiguous by trial degree, test degree and pair
            stacked = np.stack(values, axis=1)
            n_test = 0 if family is None else family[0] + 1
            sums = weighted[:n_test] @ stacked.reshape(len(stacked), len(inner), math.prod(stacked.shape[2:]))
            return sums.reshape(len(stacked), n_test, *stacked.shape[2:]).swapaxes(0, 1)

        quotient = total(degrees.log, [one.quotient.view(float) for one in inner])
        return cls(
            total(degrees.log, [one.log for one in inner]),
            quotient.view(complex),
            total(degrees.double, [one.double for one in inner]),
        )

    def scale(self, test_half: FloatArray, half: FloatArray, tangent: ComplexArray) -> None:
        """Turn sums for half lengths 1 and a real trial axis into the integrals of the elements themselves."""
        if self.log.size:
            self.log[0, 0] += 4.0 * np.log(half)
            self.log[:] *= test_half * half
            self.quotient[:] *= test_half * (half * tangent * tangent)
        if self.double.size:
            self.double[:] *= test_half / (2.0 * np.pi)

    def put(self, rows: IntArray | slice, columns: IntArray | slice, other: PairIntegrals) -> None:
        """Overwrite the pairs (rows, columns) with those of `other`."""
        self.log[:, :, rows, columns] = other.log
        self.quotient[:, :, rows, columns] = other.quotient
        self.double[:, :, rows, columns] = other.double

    @classmethod
    def joined(cls, degrees: Degrees, parts: Sequence[PairIntegrals]) -> PairIntegrals:
        """Join lists of pairs one after the other, cut to what is wanted."""
        wanted = cls.zeros(degrees, (0,))

        def together(own: _Numbers, lists: Sequence[_Numbers]) -> _Numbers:
            n_test, n_trial = own.shape[:2]
            return np.concatenate([values[:n_test, :n_trial] for values in lists], axis=-1)

        return cls(
            together(wanted.log, [part.log for part in parts]),
            together(wanted.quotient, [part.quotient for part in parts]),
            together(wanted.double, [part.double for part in parts]),
        )

    @property
    def swapped(self) -> PairIntegrals:
        """The same by the degrees (trial, test), not copied."""
        return PairIntegrals(self.log.swapaxes(0, 1), self.quotient.swapaxes(0, 1), self.double.swapaxes(0, 1))

    @property
    def size(self) -> int:
        """How many pairs are listed."""
        return int(self.log.shape[-1])

    def take(self, chosen: IntArray | slice) -> PairIntegrals:
        """Return some of the listed pairs, in the shape of `chosen`, or some of the columns."""
        return PairIntegrals(self.log[..., chosen], self.quotient[..., chosen], self.double[..., chosen])
