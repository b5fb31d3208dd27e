"""Levelling, filters and statistics of sampled profiles, which are linear between their points."""

from __future__ import annotations

from enum import Enum

import numpy as np

from bemkit.arrays import FloatArray


class Levelling(Enum):
    """The line that is subtracted from a profile: none, the least-squares line, or the line through its ends."""

    NONE = "none"
    LINE = "line"
    ENDS = "ends"


def levelled(x: FloatArray, heights: FloatArray, levelling: Levelling) -> FloatArray:
    """Return heights (n,) [m] at positions (n,) [m] minus a straight line."""
    if levelling is Levelling.NONE:
        return heights
    if levelling is Levelling.ENDS:
        return heights - np.interp(x, x[[0, -1]], heights[[0, -1]])
    middle, length = x.mean(), float(np.ptp(x))  # scaled to numbers about 1, against round-off
    rise, offset = np.polyfit((x - middle) / length, heights, 1)
    return np.asarray(heights - offset - rise * (x - middle) / length)


def filtered(
    x: FloatArray, heights: FloatArray, period: float | None, shortest: float | None, longest: float | None
) -> tuple[FloatArray, FloatArray]:
    """Return the wavelengths of a profile between two cut-offs, at equidistant positions.

    Parameters
    ----------
    x, heights : (n,) arrays [m]
    period : float or None [m]
        Without a period the profile is continued antisymmetrically about its ends, so that a line has no roughness.
    shortest, longest : float or None [m]
        Cut-offs of Gaussian filters, which halve the height of a wave of that length.

    Returns
    -------
    x, heights : (n,) arrays [m]

    References
    ----------
    [ISO16610]
    """
    n = x.size
    if period is None:
        even = np.linspace(x[0], x[-1], n)
        heights = np.interp(even, x, heights)
    else:
        even = x[0] + period / n * np.arange(n)
        heights = np.interp(even, x, heights, period=period)
    step = float(even[1] - even[0])
    if shortest is not None:
        heights = _long_waves(heights, shortest / step, is_periodic=period is not None)
    if longest is not None:
        heights = heights - _long_waves(heights, longest / step, is_periodic=period is not None)
    return even, heights


def _long_waves(heights: FloatArray, cut_off: float, *, is_periodic: bool) -> FloatArray:
    """Return the waves (n,) [m] of heights (n,) [m] that are longer than a cut-off [steps]."""
    n = heights.size
    if not is_periodic:
        line = np.linspace(heights[0], heights[-1], n)
        above = heights - line
        there_and_back = np.concatenate([above, -above[-2:0:-1]])
        return np.asarray(line + _long_waves(there_and_back, cut_off, is_periodic=True)[:n])
    passed = np.exp2(-((cut_off * np.fft.rfftfreq(n)) ** 2))
    return np.fft.irfft(passed * np.fft.rfft(heights), n).astype(float)


def rms_height(x: FloatArray, heights: FloatArray) -> float:
    """Return the root mean square [m] of a polyline of heights (n,) [m] about its mean."""
    steps = np.diff(x)
    above = heights - np.sum(steps * (heights[1:] + heights[:-1])) / (2.0 * steps.sum())
    first, last = above[:-1], above[1:]
    return float(np.sqrt(np.sum(steps * (first * first + first * last + last * last)) / (3.0 * steps.sum())))


def rms_slope(x: FloatArray, heights: FloatArray) -> float:
    """Return the root mean square slope [-] of a polyline through heights (n,) [m]; infinite with a vertical jump."""
    steps, rises = np.diff(x), np.diff(heights)
    slopes = np.divide(rises, steps, out=np.where(rises == 0.0, 0.0, np.inf), where=steps > 0.0)
    return float(np.sqrt(np.sum(np.where(steps > 0.0, steps, 1.0) * slopes**2) / steps.sum()))
