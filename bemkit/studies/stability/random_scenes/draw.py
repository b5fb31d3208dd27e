"""Draws from a random generator as plain Python values, which scene files can hold."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TypeVar

import numpy as np

T = TypeVar("T")


def chance(random: np.random.Generator, probability: float) -> bool:
    """Return true with a probability."""
    return bool(random.random() < probability)


def between(random: np.random.Generator, low: float, high: float) -> float:
    """Return a number that is uniform between two."""
    return float(random.uniform(low, high))


def decades(random: np.random.Generator, low: float, high: float) -> float:
    """Return a power of ten whose exponent is uniform between two numbers."""
    return float(10.0 ** random.uniform(low, high))


def one_of(random: np.random.Generator, options: Sequence[T]) -> T:
    """Return one of some values, each as likely as the others."""
    return options[int(random.integers(len(options)))]


def one_by_weight(random: np.random.Generator, weights: Mapping[T, float]) -> T:
    """Return a key, as likely as its weight says."""
    shares = np.array(list(weights.values()), dtype=float)
    return list(weights)[int(random.choice(len(shares), p=shares / shares.sum()))]


def some_of(random: np.random.Generator, options: Sequence[T], least: int = 1) -> tuple[T, ...]:
    """Return at least some of the values, in their order."""
    count = int(random.integers(min(least, len(options)), len(options) + 1))
    chosen = np.sort(random.permutation(len(options))[:count])
    return tuple(options[k] for k in chosen.tolist())


def direction(random: np.random.Generator) -> np.ndarray[tuple[int, ...], np.dtype[np.float64]]:
    """Return a unit vector (2,): down, along an axis, or anywhere."""
    quarter = -0.5 * np.pi
    angles = {quarter: 0.5, quarter * float(random.integers(4)): 0.25, between(random, -np.pi, np.pi): 0.25}
    angle = one_by_weight(random, angles)
    return np.array([np.cos(angle), np.sin(angle)]).round(15)
