"""A disc between two rigid, frictionless, parallel plates: exact, from the complex symbols of the circle."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from bemkit.arrays import FloatArray
from bemkit.errors import InputError
from bemkit.operators.material import Material
from bemkit.reference.compare import Reference, SampledFields, SamplePoints, ZoneEnd, errors_of
from bemkit.reference.pressure import N_TERMS, EvenPressure, half_width_for, places_along, solve_pressure


@dataclass(frozen=True)
class DiscBetweenPlates:
    """A disc pressed by plates that each approach its centre.

    Parameters
    ----------
    radius, approach : float [m]
        The plates end at the distance radius - approach from the centre.
    material : Material
    n_terms : int
        Coefficients of the pressure.
    along_normals : bool
        Contact acts along the normals of the undeformed circle, as by a gap formula, instead of along those of the
        plates; pressures differ by the order of the half-angle.

    Raises
    ------
    ValueError
        If the approach is not positive or not small.

    Notes
    -----
    Angles count from the middle of the lower contact, anticlockwise. The displacements that tractions t_k e^(ik angle)
    cause, u_k = t_k / S_k with the symbols S_k of the circle, are summed in closed form for the plates' directions and
    for the normals. By symmetry tractions on the upper half are opposite to those on the lower one.
    """

    radius: float
    approach: float
    material: Material
    n_terms: int = N_TERMS
    along_normals: bool = False

    def __post_init__(self) -> None:
        if not 0.0 < self.approach < 0.25 * self.radius:
            raise InputError(
                f"approach is {self.approach}: give one between 0 and a quarter of the radius, {0.25 * self.radius:g}; "
                "small strains end long before"
            )

    @cached_property
    def half_angle(self) -> float:
        """End of contact [rad]."""
        # Hertz: approach / radius = e^2 / 2 times a slowly varying logarithm
        share = self.approach / self.radius
        near = 0.5 * np.sqrt(share)
        for _ in range(20):
            near = np.sqrt(2.0 * share / (np.log(4.0 / near) - 0.5))
        return half_width_for(share, lambda e: self._solved(e)[1], near)

    def reference(self, part: str = "plate", length: float | None = None) -> Reference:
        """Return the fields along the arc from the lowest point on, and the resultants of a quarter of the disc.

        Parameters
        ----------
        part : str
            Name of the contact part, which begins at the lowest point and runs anticlockwise.
        length : float, optional [m]
            Length of the part; an arc of 90 degrees by default.
        """
        answer, places = self._fields_of(part, length)
        coarser, _ = replace(self, n_terms=self.n_terms * 2 // 3)._fields_of(part, length)
        reference = Reference("disc between plates by Chebyshev polynomials", (places,), answer)
        return replace(reference, own_errors=errors_of(coarser, reference))

    def _fields_of(self, part: str, length: float | None) -> tuple[SampledFields, SamplePoints]:
        e = self.half_angle
        pressure, _ = self._solved(e)
        length = 0.5 * np.pi * self.radius if length is None else length
        s, weight = places_along(length, (e * self.radius,))
        angle = s / self.radius
        u_n = np.where(angle < e, self._gap(angle), self.radius * pressure.displacement(self._towards, angle))
        force = self.radius * pressure.integral(np.ones_like)
        work = -self.radius * pressure.integral(self._gap)
        answer = SampledFields(
            u_n=u_n,
            u_t=self.radius * pressure.displacement(lambda x: self._influence(x)[1], angle),
            sigma_n=-pressure.at(angle),
            sigma_t=np.zeros_like(s),
            energy=0.25 * work,
            force_normal=0.5 * force,
            force_tangential=0.0,
            zones=(ZoneEnd(part, e * self.radius, "slip", "separated"),),
        )
        return answer, SamplePoints(part, s, weight)

    def pressure(self, angle: FloatArray) -> FloatArray:
        """Return the contact pressure [Pa] at angles [rad]."""
        return self._solved(self.half_angle)[0].at(angle)

    def load(self) -> float:
        """Return the force on each plate [N/m]."""
        pressure, _ = self._solved(self.half_angle)
        return self.radius * pressure.integral(np.cos if self.along_normals else np.ones_like)

    def _gap(self, angle: FloatArray) -> FloatArray:
        distance = self.radius * (1.0 - np.cos(angle)) - self.approach
        return np.asarray(distance / np.cos(angle) if self.along_normals else distance)

    def _solved(self, half_angle: float) -> tuple[EvenPressure, float]:
        """Return the pressure over angles on a given zone, and the approach over the radius that belongs to it."""

        def stretch(angle: FloatArray) -> FloatArray:
            return 1.0 / np.cos(angle) if self.along_normals else np.ones_like(angle)

        return solve_pressure(
            self._towards, half_angle, stretch, lambda angle: (1.0 - np.cos(angle)) * stretch(angle), self.n_terms
        )

    def _towards(self, angle: FloatArray) -> FloatArray:
        return self._influence(angle)[0]

    def _influence(self, angle: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return u_n / radius and u_t / radius of unit line pressures at an angle and opposite to it."""
        kappa, shear = self.material.kappa, self.material.shear_modulus
        # the sums of cos(n angle) / n and of sin(n angle) / n over odd n
        c, s = 0.5 * np.log(1.0 / np.tan(0.5 * np.abs(angle))), 0.25 * np.pi * np.sign(angle)
        cosine, sine = np.cos(angle), np.sin(angle)
        if self.along_normals:
            towards = 0.5 * (kappa - 1.0) + kappa * (cosine * c + sine * s - 1.0) + cosine * c - sine * s
            across = kappa * (cosine * s - sine * c) - (cosine * s + sine * c)
        else:
            towards = (kappa + 1.0) * (c - 0.5 * cosine)
            across = (kappa - 1.0) * s - 0.5 * (kappa + 1.0) * sine
        return -towards / (2.0 * np.pi * shear), -across / (2.0 * np.pi * shear)
