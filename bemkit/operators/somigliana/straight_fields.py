r"""Fields of straight elements with polynomial data at points off the boundary, in closed form.

Let rho = x - y, rho* its conjugate, tau the unit tangent, l the half length and zeta = xi + i eta the local coordinate
of x. With the Legendre polynomials P_k of the local coordinate t, all fields are combinations of

    C_k = int P_k / (zeta - t) dt,  G_k = int P_k / (zeta - t)^2 dt,  H_k = int P_k / (zeta - t)^3 dt,

beside the logarithm and rho / rho* (`bemkit.operators.kernels`):

    int P_k tau / rho ds   = C_k              int P_k (rho tau* / rho*^2 - tau / rho*) ds = 2 i eta tau^2 conj(G_k)
    int P_k / rho ds       = tau* C_k         int P_k rho / rho*^2 ds = tau^3 conj(C_k - 2 i eta G_k)
    int P_k tau / rho^2 ds = tau* G_k / l     int P_k (tau / rho*^2 - 2 rho tau* / rho*^3) ds
                                                                      = -tau^3 conj(G_k - 4 i eta H_k) / l

Gradients at points close to an end e of the element take powers of t - e instead of P_k. Without this expansion, the
contributions of the two elements that meet in a close node would lose digits.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bemkit.arrays import ComplexArray, FloatArray, IntArray
from bemkit.operators import kernels
from bemkit.operators.element_geometry import ElementGeometry
from bemkit.operators.material import Material

CENTRE, START, END = 0, 1, 2
"""Origins of the expansion of densities."""
AT_END = 0.5
"""Distance of a point from an end, in half lengths, below which densities are expanded about that end."""


@dataclass(frozen=True, eq=False)
class StraightFields:
    """Single layer of tractions minus double layer of displacements on straight elements.

    Parameters
    ----------
    geometry : ElementGeometry
    material : Material
    displacement, traction : (3, n_elements, n) complex arrays [m], [Pa]
        Coefficients of Legendre polynomials, of powers about the start, and of powers about the end.
    length : float [m]
        Unit of length in the logarithm.
    """

    geometry: ElementGeometry
    material: Material
    displacement: ComplexArray
    traction: ComplexArray
    length: float

    def displacements(self, x: ComplexArray, element: IntArray, reference: ComplexArray) -> ComplexArray:
        """Return displacements (1, n_pairs).

        Parameters
        ----------
        x : (n_pairs,) complex array [m]
            Points, none on its element.
        element : (n_pairs,) int array
        reference : (n_pairs,) complex array [m]
            Constant displacements that are subtracted from those of the elements.
        """
        plus, minus, eta = self._local(x, element)
        half, square, kappa = self.geometry.half[element], self.geometry.tangent[element] ** 2, self.material.kappa
        c, g = local_moments(plus, minus, self._highest + 1, 2)
        diagonal = -kappa * kernels.log_integrals(c, np.log(np.abs(plus)) + np.log(np.abs(minus)))
        diagonal[0] += 1.0 - 2.0 * kappa * np.log(half / self.length)
        quotient = 0.5 * square * kernels.quotient_integrals(c[:-1], eta)
        single, double = np.zeros((2, element.size), complex)
        for p, log_k, quotient_k in zip(self.traction[CENTRE, element].T, diagonal, quotient, strict=False):
            single += log_k * p + quotient_k * p.conj()
        for v, c_k, g_k in zip(self._moved(CENTRE, element, reference), c, g, strict=False):
            double += (kappa * c_k - c_k.conj()) * v - 2j * eta * square * (g_k * v).conj()
        factor = 0.5 / (np.pi * (kappa + 1.0))
        return np.asarray(factor * (half / self.material.shear_modulus * single + 1j * double))[None]

    def gradients(
        self, x: ComplexArray, element: IntArray, reference: ComplexArray, at_end: float = AT_END
    ) -> ComplexArray:
        """Return Phi and D (2, n_pairs), with powers within ``at_end`` half lengths of an end; see `displacements`."""
        plus, minus, eta = self._local(x, element)
        half, tangent, kappa = self.geometry.half[element], self.geometry.tangent[element], self.material.kappa
        origin = np.where(np.abs(plus) < at_end, START, np.where(np.abs(minus) < at_end, END, CENTRE))
        orders = local_moments(plus, minus, max(1, self._highest), 3)
        for end, zeta in ((START, plus), (END, minus)):
            _expand_about_end(orders, zeta, np.flatnonzero(origin == end), end)
        cube, factor = tangent**3, 1.0 / (np.pi * (kappa + 1.0))
        potential, shear = np.zeros((2, element.size), complex)
        for p, c_k, g_k in zip(self.traction[origin, element].T, *orders[:2], strict=False):
            potential -= 0.5 * tangent.conj() * c_k * p
            shear -= 0.5 * (kappa * tangent * c_k.conj() * p + cube * ((c_k - 2j * eta * g_k) * p).conj())
        double = 1j * self.material.shear_modulus / half
        for v, g_k, h_k in zip(self._moved(origin, element, reference), *orders[1:], strict=False):
            potential -= double * tangent.conj() * g_k * v
            shear += double * (tangent * g_k.conj() * v + cube * ((g_k - 4j * eta * h_k) * v).conj())
        return np.asarray(factor * np.stack([potential, shear]), complex)

    @property
    def _highest(self) -> int:
        return int(max(self.displacement.shape[2], self.traction.shape[2])) - 1

    def _moved(self, origin: IntArray | int, element: IntArray, reference: ComplexArray) -> ComplexArray:
        """Return the coefficients (n, n_pairs) of the displacements minus constant ones."""
        coefficients: ComplexArray = self.displacement[origin, element].T
        coefficients[0] -= reference
        return coefficients

    def _local(self, x: ComplexArray, element: IntArray) -> tuple[ComplexArray, ComplexArray, FloatArray]:
        """Return zeta + 1, zeta - 1 and eta, accurate near both ends."""
        geometry, to_local = self.geometry, self.geometry.to_local[element]
        plus, minus = (x - geometry.start[element]) * to_local, (x - geometry.end[element]) * to_local
        return plus, minus, kernels.local_coordinate(plus, minus).imag


def local_moments(plus: ComplexArray, minus: ComplexArray, highest: int, n_orders: int) -> list[ComplexArray]:
    """Return the first `n_orders` of C_k, G_k, H_k for k = 0 ... highest, at any distance from the element.

    Parameters
    ----------
    plus, minus : complex arrays
        zeta + 1 and zeta - 1, each computed from the position relative to its end.
    highest : int
        Highest degree.
    n_orders : int
        1 for C, 2 for C and G, 3 for C, G and H.

    Notes
    -----
    G_k = -C_k' and H_k = C_k'' / 2 follow without cancellation from (zeta^2 - 1) C_k' = k (zeta C_k - C_{k-1}) and from
    the differential equation of the Legendre polynomials [DLMF, 14.10.5 and 14.2.1].
    """
    integrals, _ = kernels.near_integrals(plus, minus, highest)
    result = [integrals]
    zeta = kernels.local_coordinate(plus, minus)
    product = plus * minus
    if n_orders > 1:
        pairs = zip(range(1, highest + 1), integrals[1:], integrals, strict=False)
        result.append(np.stack([2.0 / product, *(k * (below - zeta * c_k) / product for k, c_k, below in pairs)]))
    if n_orders > 2:
        pairs = zip(range(highest + 1), integrals, result[1], strict=True)
        result.append(np.stack([(zeta * g_k + 0.5 * k * (k + 1) * c_k) / product for k, c_k, g_k in pairs]))
    return result


def _expand_about_end(orders: list[ComplexArray], zeta: ComplexArray, chosen: IntArray, end: int) -> None:
    """Replace Legendre polynomials by powers of t - e for chosen points with `zeta` relative to the end e."""
    for k in range(1, len(orders[0])):
        # the integral of (t - e)**(k - 1) over [-1, 1]
        moment = 2.0**k / k if end == START else -((-2.0) ** k) / k
        below: ComplexArray | float = moment
        for row in orders:
            row[k][chosen] = zeta[chosen] * row[k - 1][chosen] - below
            below = row[k - 1][chosen]
