"""Rough rigid surfaces: measured profiles from files, and random self-affine profiles."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from bemkit.arrays import FloatArray
from bemkit.contact import profile_filters
from bemkit.contact.profile_file import LARGEST_STEP, ProfileError, ReadProfile, read_profile
from bemkit.contact.profile_filters import Levelling
from bemkit.errors import InputError, printable

_POINTS_OF_WAVE = 16
"""Points in the shortest wavelength; the error of a spline through them is less than 1e-4 of the height."""
_MOST_WAVES = 1_000_000
_STEEPER = 2.0
"""Slope over the seam of a period, relative to the steepest slope elsewhere, above which the seam is a jump."""


@dataclass(frozen=True)
class ProfilePoints:
    """A rigid rough obstacle, linear between points; its highest point touches the undeformed body.

    Parameters
    ----------
    points : sequence of (x, height) [m]
        Points with increasing x.
    period : float, optional [m]
        Period of the profile. Without a period there is no contact beyond its ends.
    distance : float [m]
        Between the highest point and the body.

    Raises
    ------
    InputError
        If there are fewer than two points, x does not increase, a number is not finite, or the points are longer than
        the period or end too early.
    """

    points: tuple[tuple[float, float], ...]
    period: float | None = None
    distance: float = 0.0

    def __post_init__(self) -> None:
        if not math.isfinite(self.distance):
            raise InputError(f"distance is {self.distance}: give a finite number")
        if len(self.points) < 2 or not np.isfinite(self.points).all():
            raise InputError(f"points has {len(self.points)} entries: give at least two finite points")
        x, _ = self.columns
        steps = np.diff(x)
        if (k := int(np.argmin(steps))) >= 0 and steps[k] <= 0.0:
            raise InputError(f"points[{k + 1}] is at x = {x[k + 1]:.6g} after {x[k]:.6g}: sort the points by x")
        if self.period is None:
            return
        length = float(x[-1] - x[0])
        if not length <= self.period < math.inf:
            raise InputError(
                f"the profile is {length:.6g} long, more than its period, {self.period}: give the length after which "
                "it repeats itself"
            )
        if self.period - length > LARGEST_STEP * float(np.median(steps)):
            raise InputError(
                f"the profile is {length:.6g} long, and no points are known up to its period, {self.period}: give the "
                "length after which it repeats itself"
            )

    @cached_property
    def columns(self) -> tuple[FloatArray, FloatArray]:
        """Positions and heights, (n,) arrays [m]."""
        x, heights = np.array(self.points, float).T
        return x, heights

    @property
    def rms_height(self) -> float:
        """Root mean square of the heights about their mean [m]."""
        return profile_filters.rms_height(*self._closed)

    @property
    def rms_slope(self) -> float:
        """Root mean square slope [-]; infinite with a vertical jump at the seam."""
        return profile_filters.rms_slope(*self._closed)

    @property
    def _closed(self) -> tuple[FloatArray, FloatArray]:
        """Positions and heights, closed to a whole period if there is one."""
        x, heights = self.columns
        return (
            (x, heights) if self.period is None else (np.append(x, x[0] + self.period), np.append(heights, heights[0]))
        )

    @property
    def seam_jump(self) -> float:
        """Jump [m] from the end of a period to the next one; zero if it is not steeper than other steps."""
        x, heights = self._closed
        steps, rises = np.diff(x), np.abs(np.diff(heights))
        if self.period is None or rises.size < 2:
            return 0.0
        steepest = float((rises[:-1] / steps[:-1]).max())
        is_jump = rises[-1] > _STEEPER * steepest * max(float(steps[-1]), float(np.median(steps)))
        return float(heights[-1] - heights[-2]) if is_jump else 0.0

    def heights(self, x: FloatArray) -> FloatArray:
        """Return the heights (n,) [m] at positions (n,) [m], minus infinity beyond the ends."""
        positions, heights = self.columns
        if self.period is not None:
            return np.asarray(np.interp(x, positions, heights, period=self.period))
        return np.asarray(np.interp(x, positions, heights, left=-np.inf, right=-np.inf))

    def gap(self, points: FloatArray, normals: FloatArray) -> FloatArray:
        """Return the depth of the profile below its highest point; see `bemkit.contact.obstacle.Obstacle.gap`."""
        return np.asarray(self.distance + self.columns[1].max() - self.heights(points[:, 0]))


@dataclass(frozen=True)
class Profile:
    """A rigid rough obstacle with heights from a file; its highest point touches the undeformed body.

    Parameters
    ----------
    file : str
        Text of two columns, position and height [m], separated by commas, semicolons or blanks; the profile is linear
        between points. Lines that begin with # and a first line without numbers are skipped. Files of instruments are
        read by SurfaceTopography, in metres. Paths are relative to the scene file or, in Python, to the current folder.
    period : float, optional [m]
        Period of the profile. Without a period there is no contact beyond its ends.
    distance : float [m]
        Between the highest point and the body.
    row : int, optional
        Row of a map of heights from an instrument, counted from 0.
    scale : float, optional
        Factor of all positions and heights of the file; default 1.
    height_scale : float
        Additional factor of the heights, such as 1e-3 for a file in mm and um.
    levelling : Levelling
        The line that is subtracted first: none, the least-squares line, or the line through both ends.
    shortest_wavelength, longest_wavelength : float, optional [m]
        Cut-offs of Gaussian filters, which halve the height of waves of that length.

    Raises
    ------
    ProfileError
        If the file cannot be read, a line is not two finite numbers, positions do not increase, points are missing, or
        the profile is longer than its period.
    InputError
        If another number is out of range.
    """

    file: str
    period: float | None = None
    distance: float = 0.0
    row: int | None = None
    scale: float | None = None
    height_scale: float = 1.0
    levelling: Levelling = Levelling.NONE
    shortest_wavelength: float | None = None
    longest_wavelength: float | None = None

    def __post_init__(self) -> None:
        shortest, longest = self.shortest_wavelength, self.longest_wavelength
        given = {"scale": self.scale, "shortest_wavelength": shortest, "longest_wavelength": longest}
        for name, value in given.items():
            if value is not None and not 0.0 < value < math.inf:
                raise InputError(f"{name} is {value}: give a positive number")
        if not (math.isfinite(self.height_scale) and self.height_scale):
            raise InputError(f"height_scale is {self.height_scale}: give a finite factor other than zero")
        if shortest is not None and longest is not None and shortest >= longest:
            raise InputError(f"shortest_wavelength is {shortest}: give less than longest_wavelength, {longest}")
        _ = self.profile

    @cached_property
    def profile(self) -> ProfilePoints:
        """Points of the file, levelled and filtered."""
        cut_offs = self.shortest_wavelength, self.longest_wavelength
        if cut_offs == (None, None):
            return self._levelled
        return self._points(*profile_filters.filtered(*self._levelled.columns, self.period, *cut_offs))

    @cached_property
    def _levelled(self) -> ProfilePoints:
        scale = 1.0 if self.scale is None else self.scale
        x, heights = scale * self._read.x, scale * self.height_scale * self._read.heights
        return self._points(x, profile_filters.levelled(x, heights, self.levelling))

    def _points(self, x: FloatArray, heights: FloatArray) -> ProfilePoints:
        try:
            return ProfilePoints(tuple(zip(x.tolist(), heights.tolist(), strict=True)), self.period, self.distance)
        except InputError as error:
            stated = f"; the file is in {self.unit!r}, and scale converts it" if self.unit else ""
            raise ProfileError(f"{printable(self.file)}: {error}{stated}") from error

    @property
    def seam_jump(self) -> float:
        """Jump of `ProfilePoints` before filters smooth it [m]."""
        return self._levelled.seam_jump

    @cached_property
    def _read(self) -> ReadProfile:
        return read_profile(self.file, self.row)

    @property
    def unit(self) -> str:
        """Unit of length from the file; empty if it has none, or if a scale replaces it."""
        return self._read.unit if self.scale is None else ""

    @property
    def rms_height(self) -> float:
        """Root mean square of the heights about their mean [m]."""
        return self.profile.rms_height

    @property
    def rms_slope(self) -> float:
        """Root mean square slope [-]."""
        return self.profile.rms_slope

    def heights(self, x: FloatArray) -> FloatArray:
        """Return the heights (n,) [m] at positions (n,) [m], minus infinity beyond the ends."""
        return self.profile.heights(x)

    def gap(self, points: FloatArray, normals: FloatArray) -> FloatArray:
        """Return the depth of the profile below its highest point; see `bemkit.contact.obstacle.Obstacle.gap`."""
        return self.profile.gap(points, normals)


@dataclass(frozen=True, kw_only=True)
class SelfAffineProfile:
    """A rigid rough obstacle with a random profile, self-affine between two wavelengths; a seed makes it reproducible.

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
        Seed of the random phases.
    distance : float [m]
        Between the highest point and the body.

    Raises
    ------
    InputError
        If a number is out of range.

    References
    ----------
    [JacobsEtAl2017], one-dimensional power spectral densities.
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
        """Number of shortest wavelengths in a period."""
        return int(self.period / self.cut_off * (1.0 + 1e-12))

    @property
    def rms_slope(self) -> float:
        """Root mean square slope [-]."""
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
        """Equidistant positions over a period, and heights, (n,) arrays [m]."""
        n = _POINTS_OF_WAVE * self.n_waves
        phases = 2.0 * np.pi * np.random.default_rng(self.seed).random(self.n_waves)
        spectrum = np.zeros(n // 2 + 1, complex)
        spectrum[1 : self.n_waves + 1] = 0.5 * n * self._amplitudes * np.exp(1j * phases)
        heights: FloatArray = np.fft.irfft(spectrum, n).astype(float)
        return np.asarray(self.period / n * np.arange(n)), heights

    def heights(self, x: FloatArray) -> FloatArray:
        """Return the heights (n,) [m] at positions (n,) [m]."""
        from scipy.interpolate import CubicSpline

        positions, heights = self.points
        closed = np.append(positions, self.period), np.append(heights, heights[0])
        return np.asarray(CubicSpline(*closed, bc_type="periodic")(x % self.period))

    def gap(self, points: FloatArray, normals: FloatArray) -> FloatArray:
        """Return the depth of the profile below its highest point; see `bemkit.contact.obstacle.Obstacle.gap`."""
        return np.asarray(self.distance + self.points[1].max() - self.heights(points[:, 0]))
