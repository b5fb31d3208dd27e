"""Rigid punches with a flat face on a half-plane: frictionless, tilted, sliding, bonded.

x runs along the surface from the middle of the face, which covers -a < x < a; the half-plane lies below. Pressures and
loads (per unit of thickness) are positive, tangential tractions act on the half-plane and are positive along x. All
grow beyond bounds at the edges.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bemkit.arrays import FloatArray
from bemkit.errors import InputError
from bemkit.operators.material import Material
from bemkit.reference.hertz import check_positive


def coupling(material: Material) -> float:
    """Return beta = (1 - 2 nu) / (2 (1 - nu)) [-] of an elastic body on a rigid one, by which shear lifts surfaces."""
    nu = material.effective_poisson_ratio
    return (1.0 - 2.0 * nu) / (2.0 * (1.0 - nu))


@dataclass(frozen=True)
class FlatPunch:
    """A frictionless punch, level or tilted by a moment.

    Parameters
    ----------
    load : float [N/m]
    half_width : float [m]
        a.
    modulus : float [Pa]
        E*: E' of the half-plane under a rigid punch.
    tilt : float [-]
        Slope of the face, not negative: it goes deeper towards x = a.

    Notes
    -----
    In contact everywhere, p = (P / pi + E* tilt x / 2) / sqrt(a^2 - x^2), as long as P >= pi E* tilt a / 2. Under less
    load contact begins at ``contact_start``, p = E* tilt / 2 sqrt((x - contact_start) / (a - x)).

    References
    ----------
    [Johnson1985] section 2.8(a) for the level punch; [Muskhelishvili1953] section 116 for the tilted one.
    """

    load: float
    half_width: float
    modulus: float
    tilt: float = 0.0

    def __post_init__(self) -> None:
        check_positive(load=self.load, half_width=self.half_width, modulus=self.modulus)
        if not 0.0 <= self.tilt < 1.0:
            raise InputError(f"tilt is {self.tilt}: give a small slope, not negative")

    @property
    def contact_start(self) -> float:
        """Start of contact [m]: -a unless the tilt lifts this side off."""
        a = self.half_width
        if 0.5 * np.pi * self.modulus * self.tilt * a <= self.load:
            return -a
        return a - 4.0 * self.load / (np.pi * self.modulus * self.tilt)

    @property
    def moment(self) -> float:
        """Moment of the pressure about the middle [N], positive where the side x = a bears more."""
        a, start = self.half_width, self.contact_start
        if start == -a:
            return 0.25 * np.pi * self.modulus * self.tilt * a**2
        return self.load * (start + 0.75 * (a - start))

    def pressure(self, x: FloatArray) -> FloatArray:
        """Return the pressure [Pa], infinite at edges."""
        x, a, start = np.asarray(x, dtype=float), self.half_width, self.contact_start
        is_inside = (x > start) & (x < a)
        near = np.where(is_inside, x, 0.5 * (start + a))
        if start == -a:
            values = (self.load / np.pi + 0.5 * self.modulus * self.tilt * near) / np.sqrt(a**2 - near**2)
        else:
            values = 0.5 * self.modulus * self.tilt * np.sqrt((near - start) / (a - near))
        return np.asarray(np.where(is_inside, values, np.where((x == a) | ((x == start) & (start == -a)), np.inf, 0.0)))


@dataclass(frozen=True)
class SlidingPunch:
    """A level punch that slides steadily along +x, so that q = s p on the half-plane.

    Parameters
    ----------
    load : float [N/m]
    half_width : float [m]
    friction : float [-]
        s; negative if it slides along -x.
    material : Material
        Of the half-plane.

    Notes
    -----
    p = P cos(pi g) / (pi sqrt(a^2 - x^2)) ((a + x) / (a - x))^g, tan(pi g) = -s beta. The pressure is larger at the
    trailing edge.

    References
    ----------
    [Johnson1985] section 2.8(c).
    """

    load: float
    half_width: float
    friction: float
    material: Material

    def __post_init__(self) -> None:
        check_positive(load=self.load, half_width=self.half_width)

    @property
    def exponent(self) -> float:
        """G [-]."""
        return float(-np.arctan(self.friction * coupling(self.material)) / np.pi)

    def pressure(self, x: FloatArray) -> FloatArray:
        """Return the pressure [Pa], nan outside of the face and at its edges."""
        a, g = self.half_width, self.exponent
        near = _inside(x, a)
        skew = ((a + near) / (a - near)) ** g
        return np.asarray(self.load * np.cos(np.pi * g) / (np.pi * np.sqrt(a**2 - near**2)) * skew)

    def traction(self, x: FloatArray) -> FloatArray:
        """Return the tangential traction [Pa] on the half-plane."""
        return self.friction * self.pressure(x)


@dataclass(frozen=True)
class BondedPunch:
    """A level punch that sticks everywhere, under a pressing and a shearing force.

    Parameters
    ----------
    load : float [N/m]
    half_width : float [m]
    material : Material
        Of the half-plane.
    tangential_load : float [N/m]
        Q along x on the half-plane.

    Notes
    -----
    p + i q = 2 (1 - nu) / sqrt(3 - 4 nu) (P + i Q) / (pi sqrt(a^2 - x^2)) ((a + x) / (a - x))^(i e),
    e = ln(3 - 4 nu) / (2 pi). Without shear, pressures change sign infinitely often beside the edges, within a
    share of the half-width of about 2 exp(-pi / (2 e)), 1e-7 at nu = 0.3.

    References
    ----------
    [Johnson1985] section 2.8(b).
    """

    load: float
    half_width: float
    material: Material
    tangential_load: float = 0.0

    def __post_init__(self) -> None:
        check_positive(load=self.load, half_width=self.half_width)

    def pressure(self, x: FloatArray) -> FloatArray:
        """Return the pressure [Pa], nan outside of the face and at its edges."""
        return np.asarray(self._tractions(x).real)

    def traction(self, x: FloatArray) -> FloatArray:
        """Return the tangential traction [Pa] on the half-plane; without shear it points away from the middle."""
        return np.asarray(self._tractions(x).imag)

    def _tractions(self, x: FloatArray) -> np.ndarray[tuple[int, ...], np.dtype[np.complex128]]:
        a, kappa = self.half_width, self.material.kappa
        near = _inside(x, a)
        turn = np.exp(0.5j / np.pi * np.log(kappa) * np.log((a + near) / (a - near)))
        size = 0.5 * (kappa + 1.0) / np.sqrt(kappa) / (np.pi * np.sqrt(a**2 - near**2))
        return np.asarray(size * (self.load + 1j * self.tangential_load) * turn)


def _inside(x: FloatArray, half_width: float) -> FloatArray:
    """Replace places outside of the face by nan."""
    x = np.asarray(x, dtype=float)
    return np.asarray(np.where(np.abs(x) < half_width, x, np.nan))
