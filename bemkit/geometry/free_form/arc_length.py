"""Arc length as the parameter of a curve."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.polynomial import chebyshev

from bemkit.arrays import FloatArray
from bemkit.geometry.vectors import norms

_DEGREE = 16
_MOST_SPLITS = 30  # a speed that jumps is cornered within 2**-30 of the curve
_RESOLVED = 1e-14  # last coefficients of the speed, relative to its largest
_MOST_STEPS = 50
_ROUND_OFF = 4.0 * float(np.finfo(float).eps)


class ArcLength:
    """The arc length of a curve as piecewise polynomials of its parameter, and the parameter as a function of it.

    Parameters
    ----------
    derivative : callable
        (n,) parameters in [0, 1] -> (n, 2) derivatives [m], nowhere zero.

    Notes
    -----
    The speed is interpolated at Chebyshev points on intervals that are halved until its series has decayed, and
    integrated term by term; the inverse is Newton's method with bisection as its safeguard.
    """

    def __init__(self, derivative: Callable[[FloatArray], FloatArray]) -> None:
        nodes = chebyshev.chebpts1(_DEGREE)
        to_series = np.linalg.inv(chebyshev.chebvander(nodes, _DEGREE - 1))
        breaks = np.linspace(0.0, 1.0, 5)
        low, high = breaks[:-1], breaks[1:]
        done: list[tuple[FloatArray, FloatArray, FloatArray]] = []
        for split in range(_MOST_SPLITS + 1):
            half = 0.5 * (high - low)
            s = (0.5 * (low + high))[:, None] + half[:, None] * nodes
            speed = norms(derivative(s.ravel())).reshape(s.shape)
            series = speed @ to_series.T
            is_resolved = np.abs(series[:, -2:]).max(axis=1) <= _RESOLVED * np.abs(series).max()
            if split == _MOST_SPLITS:
                is_resolved[:] = True
            done.append((low[is_resolved], high[is_resolved], series[is_resolved] * half[is_resolved, None]))
            low, high = low[~is_resolved], high[~is_resolved]
            if not low.size:
                break
            middle = 0.5 * (low + high)
            low, high = np.concatenate([low, middle]), np.concatenate([middle, high])
        low, high, series = (np.concatenate(parts) for parts in zip(*done, strict=True))
        order = np.argsort(low)
        self._low, self._high, self._speed = low[order], high[order], series[order].T
        self._length = chebyshev.chebint(self._speed, lbnd=-1.0)
        self._ends = np.concatenate([[0.0], np.cumsum(self._length.sum(axis=0))])

    @property
    def total(self) -> float:
        """Length of the whole curve [m]."""
        return float(self._ends[-1])

    def parameter(self, fraction: FloatArray) -> FloatArray:
        """Return the parameters (n,) at which the arc length is a fraction (n,) in [0, 1] of the total."""
        target = np.clip(fraction, 0.0, 1.0) * self.total
        piece = np.clip(np.searchsorted(self._ends, target, side="right") - 1, 0, self._low.size - 1)
        target = target - self._ends[piece]
        length, speed = self._length[:, piece], self._speed[:, piece]
        low, high = np.full(target.shape, -1.0), np.full(target.shape, 1.0)
        x = 2.0 * target / (self._ends[piece + 1] - self._ends[piece]) - 1.0
        for _ in range(_MOST_STEPS):
            excess = chebyshev.chebval(x, length, tensor=False) - target
            low, high = np.where(excess <= 0.0, x, low), np.where(excess >= 0.0, x, high)
            # a curve may have no speed at its end
            slope = np.maximum(chebyshev.chebval(x, speed, tensor=False), _ROUND_OFF * self.total)
            following = x - excess / slope
            following = np.where((following < low) | (following > high), 0.5 * (low + high), following)
            change = np.abs(following - x)
            x = following
            if np.all(change <= _ROUND_OFF):
                break
        result: FloatArray = self._low[piece] + 0.5 * (x + 1.0) * (self._high - self._low)[piece]
        return result
