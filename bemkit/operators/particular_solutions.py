r"""Particular solutions of elasticity under body forces and temperatures, in closed form.

With z = x + i y, displacements u = u_x + i u_y, forces b = b_x + i b_y and the plane compressibility beta:

    uniform force b              u = -beta conj(b) z^2 / 2,       sigma = -Re(conj(b) z) I
    centrifugal force q z        u = C |z|^2 z,                   C = -q beta / (8 (1 - nu))
    expansion Re f(z)            u = int f dz,                    sigma = 0
    expansion s log |z|          u = m z (log |z| - 1/2) / 2 + beta p z + c / conj(z),    m = s / (1 - nu)

No solution divides by 1 - 2 nu, so all hold for incompressible bodies. The first is a state of hydrostatic pressure. By
the third, a harmonic temperature causes no stress in a body without holes and supports. The last is the gradient of a
thermoelastic potential [TimoshenkoGoodier1970]; p and c make two circles free of traction, because otherwise the energy
of a thin ring would be a small difference of large terms.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import reduce
from typing import NamedTuple, Protocol

import numpy as np

from bemkit.arrays import ComplexArray, FloatArray
from bemkit.geometry.mesh import BoundaryMesh
from bemkit.geometry.quadrature import gauss_legendre
from bemkit.geometry.vectors import norms
from bemkit.operators.material import Material
from bemkit.operators.somigliana.stress import gradient_of, stress_of

_POINTS_ON_RAYS, _POINTS_ON_ELEMENTS = 24, 12
"""Gauss points of integrals of the energy."""


class ComplexState(NamedTuple):
    """An elastic state at n points; all arrays are (n,).

    Parameters
    ----------
    displacement, along, across : complex arrays [m], [-], [-]
        u, du/dz and du/dzbar.
    mean_stress : array [Pa]
        (sigma_xx + sigma_yy) / 2; the deviatoric stress is 2 mu du/dzbar.
    expansion : array [-]
        Free thermal strain along x and y.
    """

    displacement: ComplexArray
    along: ComplexArray
    across: ComplexArray
    mean_stress: FloatArray
    expansion: FloatArray


class Source(Protocol):
    """A body force or a thermal expansion, with one elastic state that balances it."""

    @property
    def is_expansion(self) -> bool:
        """Whether the source is a thermal strain instead of a force."""

    def state(self, z: ComplexArray, material: Material) -> ComplexState:
        """Return a state with div sigma + b = 0 at points z = x + i y [m]."""


@dataclass(frozen=True)
class UniformForce:
    """A uniform complex force b [N/m^3]."""

    density: complex
    is_expansion = False

    def state(self, z: ComplexArray, material: Material) -> ComplexState:
        """Return the hydrostatic state; see `Source.state`."""
        potential = -np.conj(self.density) * z
        along, zero = material.plane_compressibility * potential, np.zeros_like(z)
        return ComplexState(0.5 * along * z, along, zero, potential.real, zero.real)


@dataclass(frozen=True)
class CentrifugalForce:
    """A force q z [N/m^3] away from the origin."""

    factor: float
    is_expansion = False

    def state(self, z: ComplexArray, material: Material) -> ComplexState:
        """Return the radial state; see `Source.state`."""
        divisor, square = 1.0 - material.effective_poisson_ratio, np.abs(z) ** 2
        c = -0.125 * self.factor * material.plane_compressibility / divisor
        mean = -0.25 * self.factor / divisor * square
        along = (2.0 * c * square).astype(complex)
        return ComplexState(c * square * z, along, c * z**2, mean, np.zeros_like(square))


@dataclass(frozen=True)
class HarmonicExpansion:
    """The thermal strain Re(c_0 + c_1 z + c_2 z^2 + ...), with complex coefficients."""

    coefficients: tuple[complex, ...]
    is_expansion = True

    def state(self, z: ComplexArray, material: Material) -> ComplexState:
        """Return the state without stress; see `Source.state`."""
        polynomial = np.polynomial.Polynomial(self.coefficients)
        along, zero = polynomial(z), np.zeros_like(z)
        return ComplexState(polynomial.integ()(z), along, zero, zero.real, along.real)


@dataclass(frozen=True)
class LogarithmicExpansion:
    """The thermal strain s log |z - centre|, with a centre in a hole of the body.

    Parameters
    ----------
    strength : float [-]
    centre : complex [m]
    radii : two floats [m]
        Inner and outer radius of the circles around the centre that are free of traction.
    """

    strength: float
    centre: complex
    radii: tuple[float, float]
    is_expansion = True

    def state(self, z: ComplexArray, material: Material) -> ComplexState:
        """Return the state of a free ring between the radii, single-valued around the hole; see `Source.state`."""
        (inner, outer), arm = self.radii, z - self.centre
        distance, m = np.abs(arm), self.strength / (1.0 - material.effective_poisson_ratio)
        log, release = np.log(distance), 0.5 * np.log(outer / inner) / (1.0 - (inner / outer) ** 2)
        pressure = material.shear_modulus * m * (np.log(inner) - 0.5 + 2.0 * release)
        stretch = material.plane_compressibility * pressure
        inverse = m * release * inner**2 / arm.conj()
        across = 0.25 * m * arm / arm.conj() - inverse / arm.conj()
        along = (0.5 * m * log + stretch).astype(complex)
        displacement = (0.5 * m * (log - 0.5) + stretch) * arm + inverse
        return ComplexState(
            displacement, along, across, pressure - material.shear_modulus * m * log, self.strength * log
        )


@dataclass(frozen=True)
class ParticularSolution:
    """The sum of the states of several body forces and expansions."""

    sources: tuple[Source, ...]
    material: Material

    @property
    def forces(self) -> ParticularSolution:
        """The part that belongs to forces."""
        return replace(self, sources=tuple(source for source in self.sources if not source.is_expansion))

    @property
    def expansions(self) -> ParticularSolution:
        """The part that belongs to thermal strains."""
        return replace(self, sources=tuple(source for source in self.sources if source.is_expansion))

    def displacement(self, points: FloatArray) -> FloatArray:
        """Evaluate the displacement (n, 2) [m] at (n, 2) points [m]."""
        u = self._state(points).displacement
        return np.column_stack([u.real, u.imag])

    def displacement_gradient(self, points: FloatArray) -> FloatArray:
        """Evaluate the (n, 2, 2) gradient [-], [:, i, j] = du_i / dx_j, at (n, 2) points [m]."""
        state = self._state(points)
        return gradient_of(state.along, state.across)

    def stress(self, points: FloatArray) -> FloatArray:
        """Evaluate the (n, 2, 2) stress [Pa] at (n, 2) points [m]."""
        state = self._state(points)
        return stress_of(state.mean_stress, 2.0 * self.material.shear_modulus * state.across)

    def traction(self, points: FloatArray, normals: FloatArray) -> FloatArray:
        """Evaluate the tractions sigma n (n, 2) [Pa] at (n, 2) points [m] with unit normals."""
        return np.asarray(np.einsum("nij,nj->ni", self.stress(points), normals))

    def expansion(self, points: FloatArray) -> FloatArray:
        """Evaluate the free thermal strain (n,) [-] along x and y at (n, 2) points [m]."""
        return self._state(points).expansion

    def energy(self, mesh: BoundaryMesh) -> float:
        """Return the elastic energy [J/m] in a body, integrated along rays from the centre of the expansions."""
        log = next((source for source in self.sources if isinstance(source, LogarithmicExpansion)), None)
        origin = np.zeros(2) if log is None else np.array([log.centre.real, log.centre.imag])
        xi, weights = gauss_legendre(_POINTS_ON_ELEMENTS)
        elements = np.arange(mesh.n_elements)
        arms, normals = mesh.points(elements, xi) - origin, mesh.normals_at(elements, xi)
        swept = np.sum(arms * normals, axis=2) * mesh.jacobian(elements, xi) * weights
        total = 0.0
        for xi_on_ray, weight in zip(*gauss_legendre(_POINTS_ON_RAYS), strict=True):
            share = measure = np.full(swept.shape, 0.5 * (1.0 + float(xi_on_ray)))
            if log is not None:
                # rays begin on a circle around the centre, because the state is singular there; the parts inside
                # cancel. In the logarithm of the distance, powers and logarithms are smooth.
                depth = np.log(norms(arms) / log.radii[0])
                share = np.exp((share - 1.0) * depth)
                measure = share**2 * depth
            density = self._energy_density((origin + share[..., None] * arms).reshape(-1, 2)).reshape(swept.shape)
            total += 0.5 * float(weight) * float(np.sum(swept * measure * density))
        return total

    def _energy_density(self, points: FloatArray) -> FloatArray:
        state, material = self._state(points), self.material
        hydrostatic = material.plane_compressibility * state.mean_stress**2
        return np.asarray(hydrostatic + 2.0 * material.shear_modulus * np.abs(state.across) ** 2)

    def _state(self, points: FloatArray) -> ComplexState:
        z = points[:, 0] + 1j * points[:, 1]
        zero = np.zeros_like(z)
        zero_state = ComplexState(zero, zero, zero, zero.real, zero.real)
        return reduce(_sum, (source.state(z, self.material) for source in self.sources), zero_state)


def _sum(first: ComplexState, second: ComplexState) -> ComplexState:
    return ComplexState._make(a + b for a, b in zip(first, second, strict=True))
