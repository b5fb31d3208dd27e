"""Gradings: how elements are spaced along a piece of a side."""

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from bemkit.arrays import FloatArray
from bemkit.geometry.errors import GeometryError


class Grading(Protocol):
    """A rule for spacing elements."""

    def positions(self, n: int) -> FloatArray:
        """Return where `n` elements begin and end along a piece.

        Parameters
        ----------
        n : int
            Number of elements, at least one.

        Returns
        -------
        (n + 1,) array
            Fractions of the length of the piece, strictly increasing from 0 to 1.
        """
        ...


@dataclass(frozen=True)
class Uniform:
    """Elements of equal length."""

    def positions(self, n: int) -> FloatArray:
        """Return equidistant fractions."""
        return np.arange(n + 1) / n


@dataclass(frozen=True)
class Algebraic:
    """Elements that shrink towards both ends like a power of the distance.

    Parameters
    ----------
    exponent : float
        Power of grading; 1 is uniform, 2 to 4 suit corners and edges of contact.
    """

    exponent: float = 2.0

    def __post_init__(self) -> None:
        if not (np.isfinite(self.exponent) and self.exponent >= 1.0):
            raise GeometryError(f"Algebraic: exponent is {self.exponent}: give a finite number of at least 1")

    def positions(self, n: int) -> FloatArray:
        """Return fractions (2 t)^exponent / 2 on the first half, mirrored on the second."""
        half = np.arange(n // 2 + 1) / n
        return _mirrored(0.5 * (2.0 * half) ** self.exponent, n)


@dataclass(frozen=True)
class Geometric:
    """Elements that shrink by a constant ratio towards both ends, and are equal between.

    Parameters
    ----------
    ratio : float
        Length of an element over that of its larger neighbour, between 0 and 1.
    levels : int
        Number of times the length shrinks on the way to either end; the ends have elements ratio**levels times as long
        as the middle. With fewer than 2 levels + 1 elements the largest ones are left out.
    """

    ratio: float = 0.5
    levels: int = 8

    def __post_init__(self) -> None:
        if not 0.0 < self.ratio < 1.0:
            raise GeometryError(f"Geometric: ratio is {self.ratio}: give a number between 0 and 1")
        if not isinstance(self.levels, int | np.integer) or self.levels < 0:
            raise GeometryError(f"Geometric: levels is {self.levels}: give a whole number, zero or more")

    def positions(self, n: int) -> FloatArray:
        """Return the partial sums of the geometric lengths."""
        from_end = np.minimum(np.arange(n), np.arange(n)[::-1])
        lengths = float(self.ratio) ** np.maximum(self.levels - from_end, 0)
        half = np.concatenate([[0.0], np.cumsum(lengths[: n // 2])])
        return _mirrored(half / lengths.sum(), n)


def _mirrored(half: FloatArray, n: int) -> FloatArray:
    """Complete the first n // 2 + 1 of n + 1 fractions, so that both halves mirror each other to round-off."""
    if n % 2 == 0:
        half = np.append(half[:-1], 0.5)
        return np.concatenate([half, 1.0 - half[-2::-1]])
    return np.concatenate([half, 1.0 - half[::-1]])
