r"""Point sources on a boundary: forces and double layers at the Gauss points of its elements.

Two analytic functions give the displacements of plane strain [Muskhelishvili1953],

    2 mu u = kappa phi(z) - (z - c) conj(phi'(z)) - conj(psi(z)),      kappa = 3 - 4 nu,

with any point c, on which psi depends: psi_d = psi_c + conj(d - c) phi'. Let F be a force at w, and v the strength of a
double layer at w with the normal n. With f = -F / (8 pi (1 - nu)), g = mu n v / (4 pi (1 - nu)) and
e = -2 mu Re(conj(n) v) / (4 pi (1 - nu)), their potentials are

    phi = f log(z - w) + g / (z - w)
    psi = -kappa conj(f) log(z - w) + (e - conj(w - c) f) / (z - w) + conj(w - c) g / (z - w)^2

and the force causes an additional displacement -f / (2 mu).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple, TypeAlias

import numpy as np

from bemkit.arrays import ComplexArray, FloatArray, IntArray
from bemkit.geometry.mesh import BoundaryMesh
from bemkit.operators.kernels import legendre_values
from bemkit.operators.material import Material

N_POINTS = 14
"""Gauss points of a piece; (3 + sqrt(8))**-28 is far below round-off, because kernels contain rho to the power -3."""
GaussData: TypeAlias = tuple[ComplexArray, ComplexArray, ComplexArray, ComplexArray]
_PLANE = np.array([1.0, 1.0j])


class Sources(NamedTuple):
    """Positions w [m] and strengths f, g (complex) and e of sources; arrays of one shape."""

    position: ComplexArray
    f: ComplexArray
    g: ComplexArray
    e: FloatArray

    def displacements(self, z: ComplexArray, kappa: float, log_length: float) -> ComplexArray:
        """Return 2 mu u of each source at points, with the unit of length in the logarithm [m]."""
        (rho, f, g, e), mirrored = self._at(z)
        log = 2.0 * kappa * np.log(np.abs(rho) / log_length) - 1.0
        return log * f + kappa * g / rho + (rho * (g.conj() / mirrored - f.conj()) - e) / mirrored

    def gradients(self, z: ComplexArray, kappa: float) -> tuple[ComplexArray, ComplexArray]:
        """Return Phi = phi' and D = 2 mu du/dzbar of each source at points."""
        (rho, f, g, e), mirrored = self._at(z)
        turned = (rho * (f.conj() - 2.0 * g.conj() / mirrored) + e) / mirrored
        return (f - g / rho) / rho, (kappa * f + turned) / mirrored

    def _at(self, z: ComplexArray) -> tuple[Sources, ComplexArray]:
        """Return the sources with z - w as positions, and its conjugate."""
        rho = z - self.position
        return self._replace(position=rho), rho.conj()


def layer_sources(
    y: ComplexArray, dy: ComplexArray, traction: ComplexArray, displacement: ComplexArray, material: Material
) -> Sources:
    """Return the sources of the single layer of tractions minus the double layer of displacements.

    Parameters
    ----------
    y, dy : complex arrays of one shape [m]
        Gauss points on the boundary and the weighted steps along it.
    traction, displacement : complex arrays of the same shape [Pa], [m]
    material : Material
    """
    b = 1.0 / (np.pi * (material.kappa + 1.0))
    double = (b * material.shear_modulus) * dy
    return Sources(
        y, (-0.5 * b) * np.abs(dy) * traction, 1j * double * displacement, -2.0 * (double.conj() * displacement).imag
    )


@dataclass(frozen=True, eq=False)
class BoundaryData:
    """Displacements and tractions of a boundary.

    Parameters
    ----------
    mesh : BoundaryMesh
        About the origin.
    displacement, traction : (n_elements, n) complex arrays [m], [Pa]
        Coefficients of Legendre polynomials.
    """

    mesh: BoundaryMesh
    displacement: ComplexArray
    traction: ComplexArray

    @property
    def highest(self) -> int:
        """Highest degree of the data."""
        return int(max(self.displacement.shape[1], self.traction.shape[1])) - 1

    def points(self, elements: IntArray, xi: FloatArray) -> tuple[ComplexArray, ComplexArray]:
        """Return y and dy/dxi, (n, q), of n elements at local coordinates (q,) or (n, q)."""
        return self.mesh.points(elements, xi) @ _PLANE, self.mesh.derivatives(elements, xi) @ _PLANE

    def at(self, elements: IntArray, xi: FloatArray, weights: FloatArray) -> GaussData:
        """Return points, weighted steps, tractions and displacements (n, q) at the points (q,) or (n, q) of a rule."""
        (y, slope), polynomials = self.points(elements, xi), legendre_values(self.highest, xi)
        traction, displacement = np.zeros((2, *y.shape), complex)
        for values, field in ((traction, self.traction), (displacement, self.displacement)):
            for of_degree, polynomial in zip(field.T, polynomials, strict=False):
                values += of_degree[elements, None] * polynomial
        return y, slope * weights, traction, displacement
