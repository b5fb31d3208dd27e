"""Fields below the surface of a half-plane in closed form, from tractions that are constant on elements.

Let z = x + i y, let the body lie below the line y = 0, and let N and T be the tractions along y and x. The potential

    Phi(z) = -1 / (2 pi i) int (N - i T) / (t - z) dt

is defined on both sides of the line. With its integral phi [Muskhelishvili1953]

    sigma_xx + sigma_yy = 4 Re Phi(z),  sigma_yy - i sigma_xy = Phi(z) - Phi(z*) + (z - z*) Phi'(z)*,
    2 mu (u_x + i u_y) = kappa phi(z) + phi(z*) - (z - z*) Phi(z)*.

The integrals are sums of c log(t - z) over the ends t of the elements, with c the jump of N - i T at t divided by 2 pi
i. On a periodic surface log sin pi (t - z) replaces the logarithm, with the period as unit of length.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from bemkit.arrays import BoolArray, ComplexArray, FloatArray
from bemkit.errors import InputError
from bemkit.geometry.mesh import BoundaryMesh
from bemkit.geometry.proximity.location import PointNotInsideError
from bemkit.operators.half_plane.equations import HalfPlaneEquations
from bemkit.operators.material import Material
from bemkit.operators.somigliana.potentials import PotentialFields, as_points

_CHUNK = 500_000
"""Pairs of points and ends of elements that are evaluated at a time."""
_SAMPLED = 64
"""Elements whose displacements determine the far motion."""
_AT_DEPTH = 0.5j * np.pi - np.log(2.0)
"""Limit of log sin(pi w) + i pi w at depth."""
_DEEP = 6.0
"""Depth in periods below which all waves have vanished: exp(-12 pi) is 4e-17."""


class HalfPlaneFields(PotentialFields):
    """Displacement, its gradient, strain and stress below the surface of a half-plane.

    Parameters
    ----------
    mesh : BoundaryMesh
        Elements of the surface.
    material : Material
    traction : (n_elements, 2) array [Pa]
        Uniform traction on each element, in x and y.
    displacement : (n_elements, 2) array [m]
        Means over elements, in x and y; they determine the far motion.
    strain : float [-]
        Strain along the surface, far below it.

    Raises
    ------
    InputError
        If the mesh is not the surface of a half-plane.

    Notes
    -----
    Points must lie strictly below the surface; otherwise methods are those of `InteriorFields`. Below a periodic
    surface the mean strain along it is `strain` at all depths.
    """

    def __init__(
        self,
        mesh: BoundaryMesh,
        material: Material,
        traction: FloatArray,
        displacement: FloatArray,
        strain: float = 0.0,
    ) -> None:
        if mesh.surface is None:
            raise InputError("mesh has closed boundaries: give that of a half-plane, or take InteriorFields")
        self.mesh, self.material, self._is_periodic = mesh, material, mesh.surface.is_periodic
        self.background = None
        # local axes: x against the tangent, y along the normal, from the end of the strip
        self._axis = -complex(*mesh.tangents[0])
        self._length, self._origin = float(mesh.lengths.sum()), mesh.nodes[mesh.elements[-1, 1]]
        tractions, lengths = self._local(traction)[::-1], mesh.lengths[::-1]
        jumps = np.diff(np.concatenate([[0.0], -tractions / (2.0 * np.pi), [0.0]]))
        ends = np.append(0.0, np.cumsum(lengths)) / self._length
        self._ends, self._jumps = ends[jumps != 0.0], jumps[jumps != 0.0]
        self._mean = complex((tractions * lengths).sum() / self._length)
        # uniform tension along x, rotation and translation to be added
        self._tension, self._turn, self._shift = material.plane_modulus * strain, 0.0, 0j
        if self._is_periodic:
            self._fit_period(displacement)
        else:
            self._fit_strip(strain, traction, displacement)

    def _local(self, vectors: FloatArray) -> ComplexArray:
        """Return vectors (n, 2) in x and y as complex numbers along the local axes."""
        return np.asarray((vectors[:, 0] + 1j * vectors[:, 1]) / self._axis)

    def _fit_strip(self, strain: float, traction: FloatArray, displacement: FloatArray) -> None:
        """Fit the far motion to the displacements of some elements; forces do not move points at the distance L."""
        mesh, length = self.mesh, self._length
        # the potentials take sign(s - r) + 1 on one side of an element, the flexibility takes sign(s - r)
        self._shift = 0.5j * self.material.plane_compressibility * self._mean * length
        nodes = np.unique(np.linspace(0.0, mesh.n_elements - 1.0, _SAMPLED).astype(int))
        x = length - (np.cumsum(mesh.lengths) - 0.5 * mesh.lengths)[nodes]
        ends = np.append(0.0, np.cumsum(mesh.lengths)) / length
        equations = HalfPlaneEquations(ends, self.material, np.zeros((0, mesh.n_elements), complex))
        along_surface = np.stack([mesh.tangents[0], mesh.normals[0]], axis=1)
        rigid = length * equations.residual(nodes, traction @ along_surface, displacement @ along_surface / length)
        rigid_motion = -rigid[:, 0] + 1j * rigid[:, 1] - strain * x
        turn = float(np.polyfit(x / length, rigid_motion.imag, 1)[0]) / length if nodes.size > 1 else 0.0
        self._turn = turn
        self._shift += complex((rigid_motion - 1j * turn * x).mean())

    def _fit_period(self, displacement: FloatArray) -> None:
        """Fit the mean strain along the surface and the mean displacement."""
        compressibility, lengths = self.material.plane_compressibility, self.mesh.lengths
        self._tension -= self.material.plane_modulus * compressibility * self._mean.imag
        self._turn = compressibility * self._mean.real
        # below all waves the field is linear; it continues to the mean displacement of the surface
        depth = _DEEP * self._length
        deep = (self._origin - depth * self.mesh.normals[0])[None, :]
        above = self.displacement(deep) + depth * self.displacement_gradient(deep) @ self.mesh.normals[0]
        self._shift = complex(self._local(lengths @ displacement / lengths.sum() - above)[0])

    def is_inside(self, points: FloatArray) -> BoolArray:
        """Return the (n,) mask of the (n, 2) points [m] that lie strictly below the surface."""
        return np.asarray(self._local_points(as_points(points)).imag < 0.0)

    def _local_points(self, points: FloatArray) -> ComplexArray:
        """Return points in the local axes, with the length of the strip as unit."""
        return self._local(points - self._origin) / self._length

    def _checked(self, points: FloatArray) -> ComplexArray:
        points = as_points(points)
        z = self._local_points(points)
        outside = np.flatnonzero(~(z.imag < 0.0))
        if outside.size:
            x, y = points[outside[0]]
            raise PointNotInsideError(
                f"point {outside[0]} at ({x:.9g}, {y:.9g}) lies on or above the surface of the half-plane "
                f"({outside.size} of {len(points)} points do): select points with is_inside(points)"
            )
        return z

    def potentials(self, points: FloatArray) -> tuple[ComplexArray, ComplexArray]:
        """Return Phi and D (n,) [Pa]."""
        z = self._checked(points)
        (potential, mirrored), (slope, _) = self._sums(z, _periodic_slope if self._is_periodic else _slope)
        shear = 2.0 * potential.real - (potential - mirrored + (z - z.conj()) * slope.conj())
        turn = 2.0j * self.material.shear_modulus * self._turn / (self.material.kappa + 1.0)
        return potential + 0.25 * self._tension + turn, (shear + 0.5 * self._tension) * self._axis**2

    def displacement(self, points: FloatArray) -> FloatArray:
        """Evaluate the displacement (n, 2) [m] at points (n, 2) [m]."""
        z = self._checked(points)
        (potential, _), (integral, mirrored) = self._sums(z, _periodic_integral if self._is_periodic else _integral)
        kappa, two_mu = self.material.kappa, 2.0 * self.material.shear_modulus
        strained = kappa * integral + mirrored - (z - z.conj()) * potential.conj()
        tension = self._tension * (0.25 * (kappa - 1.0) * z + 0.5 * z.conj())
        local = ((strained + tension) / two_mu + 1j * self._turn * z) * self._length + self._shift
        displacement = local * self._axis
        return np.stack([displacement.real, displacement.imag], axis=1)

    def _sums(self, z: ComplexArray, kernels: _Kernels) -> ComplexArray:
        """Return the potentials of two kernels at z and at the mirrored points z*, (2, 2, n)."""
        jumps = np.stack([self._jumps, self._jumps.conj()], axis=1)
        chunk = max(1, _CHUNK // max(1, self._ends.size))
        sums = np.zeros((2, z.size, 2), complex)
        for begin in range(0, z.size, chunk):
            rows = slice(begin, begin + chunk)
            sums[:, rows] = [kernel @ jumps for kernel in kernels(self._ends, z[rows, None])]
        # a kernel at mirrored points is its conjugate
        return np.stack([sums[:, :, 0], sums[:, :, 1].conj()], axis=1)


_Kernels = Callable[[ComplexArray, ComplexArray], tuple[ComplexArray, ComplexArray]]
"""Ends t of elements and points z -> log (t - z) or log sin pi (t - z), and its derivative or integral in z."""


def _slope(ends: ComplexArray, z: ComplexArray) -> tuple[ComplexArray, ComplexArray]:
    arm = ends - z
    return np.log(arm), -1.0 / arm


def _integral(ends: ComplexArray, z: ComplexArray) -> tuple[ComplexArray, ComplexArray]:
    arm = ends - z
    log = np.log(arm)
    return log, -arm * (log - 1.0)


def _periodic_slope(ends: ComplexArray, z: ComplexArray) -> tuple[ComplexArray, ComplexArray]:
    wave = _wave(ends, z)
    return _log_sine(ends - z, np.log1p(-wave)), 1j * np.pi * (1.0 + wave) / (1.0 - wave)


def _periodic_integral(ends: ComplexArray, z: ComplexArray) -> tuple[ComplexArray, ComplexArray]:
    wave, arm = _wave(ends, z), ends - z
    log = np.log1p(-wave)
    return _log_sine(arm, log), (0.5j * np.pi * arm - _AT_DEPTH) * arm - 0.5j / np.pi * dilogarithm(wave, log)


def _wave(ends: ComplexArray, z: ComplexArray) -> ComplexArray:
    """Return exp(2 pi i (ends - z)), which decays with depth."""
    return np.asarray(np.exp(2j * np.pi * ends) * np.exp(-2j * np.pi * z))


def _log_sine(arm: ComplexArray, log: ComplexArray) -> ComplexArray:
    """Return log sin(pi w) for w above the real axis from log(1 - exp(2 pi i w))."""
    return np.asarray(-1j * np.pi * arm + _AT_DEPTH + log)


def dilogarithm(z: ComplexArray, log: ComplexArray) -> ComplexArray:
    """Return Li_2(z) for abs(z) <= 1 and log(1 - z), by the series in u = -log(1 - z) with Bernoulli numbers.

    `scipy.special.spence` sums some hundred terms next to the unit circle, which takes 70 times as long.
    """
    from scipy.special import bernoulli, factorial

    is_right = z.real > 0.5  # there Li_2(z) + Li_2(1 - z) = pi^2 / 6 - log(z) log(1 - z)
    log_z = np.log(np.where(is_right, z, 1.0))
    u = -np.where(is_right, log_z, log)
    square, series = u * u, np.zeros_like(u)
    even = np.arange(20, 0, -2)
    for coefficient in bernoulli(20)[even] / factorial(even + 1):  # abs(u) < 1.3: the next term is below 1e-17
        series = (series + coefficient) * square
    series = u * (1.0 - 0.25 * u + series)
    return np.asarray(np.where(is_right, np.pi**2 / 6.0 - log_z * log - series, series))
