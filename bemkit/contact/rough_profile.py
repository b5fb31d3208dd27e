"""Rough rigid surfaces: measured profiles from files, and self-affine ones of given statistics."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np

from bemkit.arrays import FloatArray
from bemkit.errors import InputError, printable

_LARGEST_STEP = 5.0
"""Distance of two neighbours, in usual steps, from which on points are missing between them."""
_POINTS_OF_WAVE = 16
"""Points of the shortest wave: the error of a spline through them is less than 1e-4 of its height."""
_MOST_WAVES = 1_000_000


class ProfileError(InputError):
    """A file that holds no profile; the message names the file, the line and the remedy."""


@dataclass(frozen=True)
class Profile:
    """A rigid rough obstacle with heights from a file; its highest point touches the undeformed body.

    Parameters
    ----------
    file : str
        Text of two columns, position and height [m], between which it is straight; separated by commas, semicolons or
        blanks. Lines that begin with # and a first line without numbers are skipped. The file is found from the folder
        in which bemkit runs.
    period : float, optional [m]
        Distance after which the profile repeats itself. Without it nothing can be touched beyond its ends.
    distance : float [m]
        Between the highest point and the body.

    Raises
    ------
    ProfileError
        If the file cannot be read, a line is not two finite numbers, positions do not increase, points are missing
        between two, or the profile is longer than its period.
    """

    file: str
    period: float | None = None
    distance: float = 0.0

    def __post_init__(self) -> None:
        if not math.isfinite(self.distance):
            raise InputError(f"distance is {self.distance}: give a finite number")
        x, _ = self.points
        if self.period is not None and not x[-1] - x[0] <= self.period < math.inf:
            raise ProfileError(
                f"{printable(self.file)}: the profile is {x[-1] - x[0]:.6g} long, more than its period, {self.period}: "
                "give the length after which it repeats itself"
            )

    @cached_property
    def points(self) -> tuple[FloatArray, FloatArray]:
        """Positions and heights, two (n,) arrays [m]."""
        return read_profile(self.file)

    def heights(self, x: FloatArray) -> FloatArray:
        """Return the heights (n,) [m] at positions (n,) [m], minus infinity beyond the ends."""
        places, heights = self.points
        if self.period is not None:
            return np.asarray(np.interp(x, places, heights, period=self.period))
        return np.asarray(np.interp(x, places, heights, left=-np.inf, right=-np.inf))

    def gap(self, points: FloatArray, normals: FloatArray) -> FloatArray:
        """Measure how far the profile is below its highest point; see `bemkit.contact.obstacle.Obstacle.gap`."""
        return np.asarray(self.distance + self.points[1].max() - self.heights(points[:, 0]))


def read_profile(file: str | Path) -> tuple[FloatArray, FloatArray]:
    """Read a profile; see `Profile`.

    Returns
    -------
    x, heights : (n,) arrays [m]

    Raises
    ------
    ProfileError
    """
    name = printable(str(file))
    try:
        lines = Path(file).read_text("utf-8-sig").splitlines()
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or "not text"
        raise ProfileError(f"{name}: cannot be read ({reason}): give a text file of two columns") from error
    rows: list[tuple[float, float]] = []
    numbers: list[int] = []
    for number, line in enumerate(lines, start=1):
        cells = _cells(line)
        if not cells or cells[0].startswith("#") or (not rows and number == 1 and not _is_number(cells[0])):
            continue
        if len(cells) != 2 or not all(map(_is_number, cells)):
            raise ProfileError(
                f"{name}: line {number} is {printable(line.strip())[:60]!r}: give two finite numbers, position and "
                "height; where no height is known, cut the profile there or fill it in"
            )
        rows.append((float(cells[0]), float(cells[1])))
        numbers.append(number)
    if len(rows) < 2:
        raise ProfileError(f"{name}: has {len(rows)} points: give at least two lines of position and height")
    x, heights = np.array(rows).T
    steps = np.diff(x)
    if (k := int(np.argmin(steps))) >= 0 and steps[k] <= 0.0:
        raise ProfileError(
            f"{name}: line {numbers[k + 1]}: the position {x[k + 1]:.6g} comes after {x[k]:.6g}: sort the lines by "
            "position, and remove repeated points"
        )
    if steps[k := int(np.argmax(steps))] > _LARGEST_STEP * float(np.median(steps)):
        raise ProfileError(
            f"{name}: line {numbers[k + 1]}: no points between {x[k]:.6g} and {x[k + 1]:.6g}, "
            f"{steps[k] / np.median(steps):.3g} usual steps: cut the profile there or fill the gap"
        )
    return x, heights


def _cells(line: str) -> list[str]:
    """Split a line; a cell between two separators may be empty."""
    for separator in (",", ";"):
        if separator in line:
            return [cell.strip() for cell in line.split(separator)]
    return line.split()


def _is_number(cell: str) -> bool:
    try:
        return math.isfinite(float(cell))
    except ValueError:
        return False


@dataclass(frozen=True, kw_only=True)
class SelfAffineProfile:
    """A rigid rough obstacle drawn at random: self-affine between two wavelengths, the same for the same seed.

    Parameters
    ----------
    period : float [m]
    rms_height : float [m]
        Root mean square of the heights about their mean.
    hurst : float
        H, between 0 and 1: the spectral density falls like ``q**(-1 - 2 H)`` with the wave number q.
    roll_off : float [m]
        Wavelength from which on the spectral density is constant; at most the period.
    cut_off : float [m]
        Shortest wavelength. Elements should be at most an eighth as long.
    seed : int
        Of the random phases.
    distance : float [m]
        Between the highest point and the body.

    Raises
    ------
    InputError
        If a number is out of range.

    References
    ----------
    [JacobsEtAl2017], one-dimensional spectral densities.
    """

    period: float
    rms_height: float
    hurst: float = 0.8
    roll_off: float
    cut_off: float
    seed: int = 0
    distance: float = 0.0

    def __post_init__(self) -> None:
        for name in ("period", "rms_height", "cut_off"):
            value = getattr(self, name)
            if not 0.0 < value < math.inf:
                raise InputError(f"{name} is {value}: give a positive length")
        if not 0.0 <= self.hurst <= 1.0:
            raise InputError(f"hurst is {self.hurst}: give a number from 0 to 1")
        if not self.cut_off <= self.roll_off <= self.period:
            raise InputError(
                f"roll_off is {self.roll_off}: give a wavelength from cut_off, {self.cut_off}, to period, {self.period}"
            )
        if self.n_waves > _MOST_WAVES:
            raise InputError(f"cut_off is {self.cut_off}: give at least a millionth of the period")
        if not (isinstance(self.seed, int) and self.seed >= 0):
            raise InputError(f"seed is {self.seed!r}: give a whole number, zero or positive")
        if not math.isfinite(self.distance):
            raise InputError(f"distance is {self.distance}: give a finite number")

    @property
    def n_waves(self) -> int:
        """Number of waves in a period of the shortest wave."""
        return int(self.period / self.cut_off * (1.0 + 1e-12))

    @property
    def rms_slope(self) -> float:
        """Root mean square of the slopes [-]."""
        waves = 2.0 * np.pi / self.period * np.arange(1, self.n_waves + 1)
        return float(np.sqrt(0.5 * np.sum((waves * self._amplitudes) ** 2)))

    @cached_property
    def _amplitudes(self) -> FloatArray:
        """(n_waves,) array [m]."""
        wavelength = self.period / np.arange(1, self.n_waves + 1)
        amplitudes = np.minimum(wavelength / self.roll_off, 1.0) ** (0.5 + self.hurst)
        return np.asarray(amplitudes * self.rms_height / np.sqrt(0.5 * np.sum(amplitudes**2)))

    @cached_property
    def points(self) -> tuple[FloatArray, FloatArray]:
        """Equidistant positions over a period and heights there, two (n,) arrays [m]."""
        n = _POINTS_OF_WAVE * self.n_waves
        phases = 2.0 * np.pi * np.random.default_rng(self.seed).random(self.n_waves)
        spectrum = np.zeros(n // 2 + 1, complex)
        spectrum[1 : self.n_waves + 1] = 0.5 * n * self._amplitudes * np.exp(1j * phases)
        heights: FloatArray = np.fft.irfft(spectrum, n).astype(float)
        return np.asarray(self.period / n * np.arange(n)), heights

    def heights(self, x: FloatArray) -> FloatArray:
        """Return the heights (n,) [m] at positions (n,) [m]."""
        from scipy.interpolate import CubicSpline

        places, heights = self.points
        closed = np.append(places, self.period), np.append(heights, heights[0])
        return np.asarray(CubicSpline(*closed, bc_type="periodic")(x % self.period))

    def gap(self, points: FloatArray, normals: FloatArray) -> FloatArray:
        """Measure how far the profile is below its highest point; see `bemkit.contact.obstacle.Obstacle.gap`."""
        return np.asarray(self.distance + self.points[1].max() - self.heights(points[:, 0]))
