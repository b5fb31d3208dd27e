"""A block between rollers on a wavy obstacle: Westergaard's pressure, and the solution for a block of finite height."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from bemkit.arrays import FloatArray
from bemkit.errors import InputError
from bemkit.operators.material import Material
from bemkit.reference.compare import Reference, SampledFields, SamplePoints, ZoneEnd
from bemkit.reference.pressure import N_TERMS, EvenPressure, half_width_for, places_along, solve_pressure

_N_MODES = 4
"""Number of modes whose compliance the far side changes; for the fifth the change is less than 1e-30."""


def westergaard_half_width(mean_pressure: float, amplitude: float, wavelength: float, plane_modulus: float) -> float:
    """Return the half-width of contact on a wave of the height amplitude (1 - cos(2 pi x / wavelength)).

    Parameters
    ----------
    mean_pressure : float [Pa]
        Less than pi E' amplitude / wavelength, at which the wave is in contact everywhere.
    amplitude, wavelength : float [m]
    plane_modulus : float [Pa]
        E'.

    Returns
    -------
    float [m]
        a in mean_pressure = pi E' amplitude / wavelength sin^2(pi a / wavelength).

    Raises
    ------
    ValueError
        If contact does not end.

    References
    ----------
    H. M. Westergaard, Bearing pressures and cracks, J. Appl. Mech. 6 (1939) A49-A53.
    """
    share = mean_pressure * wavelength / (np.pi * plane_modulus * amplitude)
    if not 0.0 < share < 1.0:
        raise InputError(
            f"mean_pressure is {mean_pressure}: give one between 0 and {mean_pressure / share:g}, "
            "where the wave is in contact everywhere"
        )
    return float(wavelength / np.pi * np.arcsin(np.sqrt(share)))


def westergaard_pressure(x: FloatArray, half_width: float, mean_pressure: float, wavelength: float) -> FloatArray:
    """Return the contact pressure of a half-plane on a wave, zero where there is no contact.

    Parameters
    ----------
    x : (n,) array [m]
        From the crest.
    half_width, wavelength : float [m]
    mean_pressure : float [Pa]

    Returns
    -------
    (n,) array [Pa]
    """
    phase = np.pi * ((np.asarray(x) / wavelength + 0.5) % 1.0 - 0.5)
    edge = np.sin(np.pi * half_width / wavelength) ** 2
    inside = np.maximum(edge - np.sin(phase) ** 2, 0.0)
    return np.asarray(2.0 * mean_pressure * np.cos(phase) / edge * np.sqrt(inside))


@dataclass(frozen=True)
class WavyObstacle:
    """The block (0, wavelength / 2) x (0, height) on its wave, frictionless, pressed down uniformly between rollers.

    Parameters
    ----------
    mean_pressure : float [Pa]
    amplitude, wavelength, height : float [m]
    material : Material
    n_terms : int
        Coefficients of the pressure.

    Notes
    -----
    Westergaard's solution is that of a half-plane. The far side of a block of finite height changes the compliance of
    the first mode by about exp(-4 pi height / wavelength); here that is taken into account.
    """

    mean_pressure: float
    amplitude: float
    wavelength: float
    height: float
    material: Material
    n_terms: int = N_TERMS

    @cached_property
    def half_width(self) -> float:
        """End of contact [m]."""
        modulus = self.material.plane_modulus
        near = westergaard_half_width(self.mean_pressure, self.amplitude, self.wavelength, modulus)
        load = self.mean_pressure * self.wavelength
        return half_width_for(load, lambda a: self._solved(a)[0].integral(np.ones_like), near)

    def reference(self) -> Reference:
        """Return the fields along the bottom, named ``wave``, and the resultants."""
        a, modulus = self.half_width, self.material.plane_modulus
        pressure, shift = self._solved(a)
        s, weight = places_along(0.5 * self.wavelength, (a,))
        is_closed = s < a
        u_y = np.where(is_closed, -self._wave(s), pressure.displacement(self._normal_kernel, s) + shift)
        values = pressure.at(s)
        far_shift = shift - self.mean_pressure * self.height * (1.0 - self._ratio**2) / modulus
        work = -0.5 * pressure.integral(self._wave) - 0.5 * self.mean_pressure * self.wavelength * far_shift
        answer = SampledFields(
            u_n=-u_y,
            u_t=pressure.displacement(self._tangential_kernel, s),
            sigma_n=-values,
            sigma_t=np.zeros_like(s),
            energy=0.5 * work,
            force_normal=0.5 * pressure.integral(np.ones_like),
            force_tangential=0.0,
            zones=(ZoneEnd("wave", a, "slip", "separated"),),
        )
        return Reference("Westergaard's problem by Chebyshev polynomials", (SamplePoints("wave", s, weight),), answer)

    @property
    def _ratio(self) -> float:
        """Return nu / (1 - nu) of plane strain, nu of plane stress."""
        nu = self.material.effective_poisson_ratio
        return nu / (1.0 - nu)

    def _wave(self, x: FloatArray) -> FloatArray:
        return np.asarray(2.0 * self.amplitude * np.sin(np.pi * x / self.wavelength) ** 2)

    def _solved(self, a: float) -> tuple[EvenPressure, float]:
        return solve_pressure(self._normal_kernel, a, np.ones_like, lambda x: -self._wave(x), self.n_terms)

    @cached_property
    def _corrections(self) -> FloatArray:
        """(n_modes, 2) changes of the displacements u_y and u_x per pressure mode by the finite height [1/Pa m]."""
        return np.array([self._layer(2.0 * np.pi * m / self.wavelength) for m in range(1, _N_MODES + 1)])

    def _layer(self, k: float) -> FloatArray:
        """Solve for one mode of a layer of finite height and subtract the half-plane.

        With Airy's function F(y) cos(kx): sigma_yy = -k^2 F, sigma_xy ~ F', E' u_y = F'''/k^2 - (2 + r) F',
        E' u_x = F''/k + r k F, r = nu/(1-nu). F is a sum of exponentials that are 1 at the near or at the far side.
        """
        h, r = k * self.height, self._ratio
        far = np.exp(-h)

        def rows(y: float) -> FloatArray:
            # (A + B y) e^-y + (C + D (y - h)) e^(y - h), derivatives 0 to 3, lengths in 1/k
            near_e, far_e = np.exp(-y), np.exp(y - h)
            sign = (-1.0) ** np.arange(4)
            order = np.arange(4)
            return np.stack(
                [sign * near_e, sign * (y - order) * near_e, np.full(4, far_e), (y - h + order) * far_e], axis=1
            )

        bottom, top = rows(0.0), rows(h)
        unit = np.linalg.solve(np.stack([bottom[0], bottom[1], top[0], top[1]]), [1.0, 0.0, 0.0, 0.0])
        f = bottom @ unit
        half_plane = np.array([1.0, 0.0, -1.0, 2.0])
        change = f - half_plane if far > 0.0 else np.zeros(4)
        return np.array([change[3] - (2.0 + r) * change[1], change[2] + r * change[0]]) / (
            self.material.plane_modulus * k
        )

    def _normal_kernel(self, x: FloatArray) -> FloatArray:
        """u_y at a distance from a line force per period, without its mean."""
        phase = np.pi * x / self.wavelength
        kernel = -2.0 / (np.pi * self.material.plane_modulus) * np.log(np.abs(2.0 * np.sin(phase)))
        for m, (change, _) in enumerate(self._corrections, 1):
            kernel = kernel + 2.0 / self.wavelength * change * np.cos(2.0 * m * phase)
        return np.asarray(kernel)

    def _tangential_kernel(self, x: FloatArray) -> FloatArray:
        """u_x at a distance from a line force per period."""
        share = x / self.wavelength
        sawtooth = np.sign(share) * 0.5 - share  # the sum of sin(2 pi m share) / (pi m)
        kernel = -(1.0 - self._ratio) / self.material.plane_modulus * sawtooth
        for m, (_, change) in enumerate(self._corrections, 1):
            kernel = kernel + 2.0 / self.wavelength * change * np.sin(2.0 * np.pi * m * share)
        return np.asarray(kernel)
