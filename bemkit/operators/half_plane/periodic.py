"""The flexibility of a periodic half-plane: one number for each wave, applied by fast Fourier transforms.

Tractions and displacements are complex numbers with the tangential component as real and the normal component as
imaginary part. A traction wave exp(i q s) displaces the surface by 2 / (E' |q|) - c / q times itself, with the
compressibility c of `bemkit.operators.half_plane.flexibility` [Johnson1985]. Tractions constant on elements and mean
displacements cannot distinguish the waves q, q + 2 pi / h, ...; the sum of their contributions is a zeta function.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from bemkit.arrays import ComplexArray, FloatArray
from bemkit.errors import InputError
from bemkit.operators.half_plane.surface import SurfaceElasticity
from bemkit.operators.material import Material

_EQUAL = 1e-6
"""Largest relative difference of the lengths of equal elements; round-off of a million elements is 1e-10."""


def wave_flexibility(n_elements: int, period: float, material: Material) -> FloatArray:
    """Return the displacement per traction of each wave on equal elements.

    Parameters
    ----------
    n_elements : int
    period : float [m]
    material : Material

    Returns
    -------
    (n_elements,) array [m/Pa]
        Positive, in the order of `numpy.fft.fftfreq`. The uniform wave has the flexibility period / (pi E') of the
        longest wave by convention, since no point of a half-plane is at rest.
    """
    from scipy.special import zeta

    share = np.arange(1, n_elements) / n_elements
    above, below = zeta(3.0, share), zeta(3.0, 1.0 - share)
    modulus, compressibility = material.plane_modulus, material.plane_compressibility
    of_wave = (above + below) / modulus - 0.5 * compressibility * (above - below)
    of_wave *= period / (np.pi**3 * n_elements) * np.sin(np.pi * share) ** 2
    return np.concatenate([[period / (np.pi * modulus)], of_wave])


@dataclass(frozen=True, eq=False)
class PeriodicElasticity(SurfaceElasticity):
    """Elasticity of a periodic half-plane with equal elements on its surface; no matrix is formed.

    Raises
    ------
    InputError
        If the elements have different lengths.
    """

    def __post_init__(self) -> None:
        lengths = self.mesh.lengths
        if float(np.ptp(lengths)) > _EQUAL * float(lengths.mean()):
            raise InputError(
                f"elements of a periodic half-plane have lengths from {lengths.min():.4g} to {lengths.max():.4g} of a "
                "period: remove the grading, and let parts end where equal elements do"
            )

    @cached_property
    def flexibility(self) -> FloatArray:
        """(n_elements,) array [m/Pa]: flexibility of each wave; see `wave_flexibility`."""
        return wave_flexibility(self.mesh.n_elements, float(self.mesh.lengths.sum()), self.material)

    def _displaced(self, traction: ComplexArray) -> ComplexArray:
        from scipy.fft import fft, ifft

        return np.asarray(ifft(self.flexibility * fft(traction)))

    @cached_property
    def full_flexibility(self) -> FloatArray:
        """(n_dofs, n_dofs) array [1/Pa]; see `SurfaceElasticity`."""
        from scipy.fft import ifft
        from scipy.linalg import circulant

        # the response depends only on the distance between two elements
        response = circulant(np.asarray(ifft(self.flexibility)) / self.mesh.lengths)
        return self.full_from_local(np.array([[response.real, -response.imag], [response.imag, response.real]]))

    def tractions_of(self, displacement: ComplexArray) -> ComplexArray:
        """Return the tractions (n_elements,) [Pa] that cause displacements (n_elements,) [m]."""
        from scipy.fft import fft, ifft

        return np.asarray(ifft(fft(displacement) / self.flexibility))
