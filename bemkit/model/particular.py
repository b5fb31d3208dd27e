"""The particular solution that belongs to the body forces of a scene, dimensionless and in physical units."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from bemkit.arrays import ComplexArray, FloatArray
from bemkit.errors import InputError
from bemkit.formulas import Expression
from bemkit.geometry.mesh import BoundaryMesh
from bemkit.geometry.spaces import BoundarySpace
from bemkit.geometry.vectors import norms
from bemkit.operators.material import Material, Plane
from bemkit.operators.particular_solutions import (
    CentrifugalForce,
    HarmonicExpansion,
    LogarithmicExpansion,
    ParticularSolution,
    Source,
    UniformForce,
)
from bemkit.operators.steklov_poincare.forces_inside import projected_tractions
from bemkit.scene.body_forces import BodyForce, Gravity, Heating, Rotation
from bemkit.scene.body_scene import BodyScene

HIGHEST_DEGREE = 16
"""Degrees of the trial polynomials."""
ACCURACY = 1e-10
"""Largest difference between a field and its approximation, relative to the field."""
_GOOD_ENOUGH = 1e-14
_GRID = 12
_MOST_ELEMENTS = 200
_BENEATH = 1e-3
"""Depth of the points beneath the boundary, relative to the size of the body."""
_RADIUS = 1e-2
"""Radius of circles whose mean value is compared with that at their centre, relative to the size of the body."""
_PLACES = np.array([-0.9, -0.5, 0.0, 0.5, 0.9])
_ROUND_OFF = 64.0 * float(np.finfo(float).eps)
"""Relative error of coordinates that fields may have."""


class TemperatureError(InputError):
    """A temperature that is not harmonic, or that no polynomial and logarithm approximate."""


def harmonic_sources(
    field: Callable[[FloatArray], FloatArray], mesh: BoundaryMesh, round_off: float = 0.0
) -> tuple[Source, ...]:
    """Return the expansions of a harmonic field in a body.

    Parameters
    ----------
    field : callable
        (n, 2) points [-] of the body -> (n,) values.
    mesh : BoundaryMesh
        Of size one, around the origin.
    round_off : float
        Relative error of values of the field far from the origin of its own coordinates.

    Raises
    ------
    TemperatureError
        If no harmonic polynomial of degree `HIGHEST_DEGREE`, in a body with one hole together with a logarithm around
        its centre, comes as near as `ACCURACY` and round-off allow.
    """
    points = _sample_points(mesh)
    values, z = field(points), points[:, 0] + 1j * points[:, 1]
    size = float(np.abs(values).max())
    if size == 0.0:
        return ()
    ring = _ring_around_hole(mesh)
    for hole in (None,) if ring is None else (None, ring):
        best, sources = np.inf, tuple[Source, ...]()
        for degree in range(HIGHEST_DEGREE + 1):
            miss, found = _fitted(values, z, degree, hole)
            if miss < best:
                best, sources = miss, found
            if best <= max(_GOOD_ENOUGH, round_off) * size:
                break
        if best <= (ACCURACY + round_off) * size:
            return sources
    raise TemperatureError(_reason(field, mesh, points, size, best / size, ACCURACY + round_off))


def _fitted(values: FloatArray, z: ComplexArray, degree: int, hole: _Ring | None) -> tuple[float, tuple[Source, ...]]:
    """Return the largest difference of the least-squares fit, and its sources."""
    powers = (2.0 * z[:, None]) ** np.arange(degree + 1)
    logs = np.log(np.abs(z[:, None] - np.array([] if hole is None else [hole.centre])))
    columns = np.column_stack([powers.real, -powers[:, 1:].imag, logs])
    coefficients = np.linalg.lstsq(columns, values, rcond=None)[0]
    along, across = coefficients[: degree + 1], np.append(0.0, coefficients[degree + 1 : 2 * degree + 1])
    polynomial = HarmonicExpansion(tuple(((along + 1j * across) * 2.0 ** np.arange(degree + 1)).tolist()))
    logarithm = () if hole is None else (LogarithmicExpansion(float(coefficients[-1]), *hole),)
    return float(np.abs(columns @ coefficients - values).max()), (polynomial, *logarithm)


def _sample_points(mesh: BoundaryMesh) -> FloatArray:
    """Return points on the boundary, just beneath it, and on a grid inside."""
    from bemkit.geometry.proximity.location import Locator  # only temperatures given by a formula need it

    whole = mesh.whole
    elements = np.unique(np.linspace(0, whole.n_elements - 1, _MOST_ELEMENTS).astype(np.intp))
    boundary, normals = whole.points(elements, _PLACES), whole.normals_at(elements, _PLACES)
    low, high = whole.nodes.min(axis=0), whole.nodes.max(axis=0)
    grid = low + (high - low) * np.stack(np.meshgrid(*2 * [(np.arange(_GRID) + 0.5) / _GRID]), axis=-1)
    inside = np.concatenate([(boundary - _BENEATH * normals).reshape(-1, 2), grid.reshape(-1, 2)])
    return np.concatenate([boundary.reshape(-1, 2), inside[Locator(whole).locate(inside).is_inside]])


class _Ring(NamedTuple):
    """The centre of area of a hole, and its distances from the nearest points of the hole and of the outside."""

    centre: complex
    radii: tuple[float, float]


def _ring_around_hole(mesh: BoundaryMesh) -> _Ring | None:
    """Return the ring around the only hole; None for a body without holes or with several."""
    whole = mesh.whole
    if len(whole.loops) != 2:
        return None
    hole, outside = (whole.loops[k] for k in np.argsort(whole.loop_areas))
    xi, weights = np.polynomial.legendre.leggauss(12)
    points, normals = whole.points(hole, xi), whole.normals_at(hole, xi)
    measure = whole.jacobian(hole, xi) * weights
    moments = np.einsum("epk,epk,ep->k", points**2, normals, measure)
    centre = moments / (2.0 * float(whole.loop_areas.min()))
    inner, outer = (float(norms(at - centre).min()) for at in (points, whole.points(outside, xi)))
    return _Ring(complex(*centre), (inner, outer))


def _reason(
    field: Callable[[FloatArray], FloatArray],
    mesh: BoundaryMesh,
    points: FloatArray,
    size: float,
    miss: float,
    accuracy: float,
) -> str:
    from bemkit.geometry.proximity.location import Locator

    whole = mesh.whole
    angles = 2.0 * np.pi * np.arange(16) / 16
    circle = _RADIUS * np.column_stack([np.cos(angles), np.sin(angles)])
    locator = Locator(whole)
    around = points[:, None] + circle
    rows = locator.locate(around.reshape(-1, 2)).is_inside.reshape(len(points), -1).all(axis=1)
    rows &= locator.locate(points).is_inside
    means = field(around[rows].reshape(-1, 2)).reshape(-1, len(circle)).mean(axis=1)
    off = np.abs(means - field(points[rows])).max(initial=0.0) / size
    if off > accuracy:
        return (
            "is not harmonic: its mean over small circles differs from its value in their centres by "
            f"{off:.1e} of its size, as if there were sources of heat: give a number, or a formula f with "
            "f_xx + f_yy = 0, such as '20 + 5 * x'"
        )
    return (
        f"is harmonic, but polynomials of degree {HIGHEST_DEGREE} miss it by {miss:.1e} of its size: give a number or "
        "a polynomial, in a body with one hole plus a multiple of log(r), r the distance from the centre of the hole"
    )


def stress_of(force: BodyForce, mesh: BoundaryMesh, material: Material) -> float:
    """Return the size [Pa] of the stresses that a body force causes."""
    points = np.concatenate([mesh.whole.nodes, mesh.whole.centres])
    if isinstance(force, Heating):
        return material.plane_modulus * _plane_strain_factor(material) * float(np.abs(force.strain_at(points)).max())
    return mesh.diameter * float(np.abs(force.force_at(points)).max())


def particular_solution(scene: BodyScene, mesh: BoundaryMesh, modulus: float, stress: float) -> ParticularSolution:
    """Return the dimensionless particular solution of the body forces of a scene.

    Parameters
    ----------
    scene : BodyScene
        With a single load and body forces.
    mesh : BoundaryMesh
        In physical units; lengths are measured by its diameter from its centre.
    modulus, stress : float [Pa]
        Units of the modulus and of stresses; strains are measured by their quotient.

    Raises
    ------
    TemperatureError
        If a temperature is not harmonic, or no closed form approximates it.
    """
    sources = [
        source for force in scene.body_forces for source in _sources(force, scene.material, mesh, modulus, stress)
    ]
    return ParticularSolution(tuple(sources), scene.material.scaled(modulus))


def _sources(
    force: BodyForce, material: Material, mesh: BoundaryMesh, modulus: float, stress: float
) -> tuple[Source, ...]:
    to_unit = mesh.diameter / stress
    match force:
        case Gravity(density, (x, y)):
            return (UniformForce(density * complex(x, y) * to_unit),)
        case Rotation():
            x, y = ((mesh.centre - np.array(force.centre)) / mesh.diameter).tolist()
            factor = force.factor * mesh.diameter * to_unit
            return UniformForce(factor * complex(x, y)), CentrifugalForce(factor)
        case Heating():
            scale = _plane_strain_factor(material) * modulus / stress
            if not callable(force.temperature):
                return (HarmonicExpansion((scale * force.expansion * force.temperature,)),)

            def strain(points: FloatArray) -> FloatArray:
                return scale * force.strain_at(mesh.centre + mesh.diameter * points)

            try:
                return harmonic_sources(strain, mesh.unit, _ROUND_OFF * float(np.abs(mesh.nodes).max()) / mesh.diameter)
            except TemperatureError as error:
                shown = force.temperature.text if isinstance(force.temperature, Expression) else force.temperature
                raise TemperatureError(f"temperature is {shown!r}, which {error}") from None


def _plane_strain_factor(material: Material) -> float:
    """Return the strain in the plane per strain of free expansion: a long body cannot expand along its length."""
    return 1.0 + material.poisson_ratio if material.plane is Plane.STRAIN else 1.0


@dataclass(frozen=True, eq=False)
class ParticularFields:
    """The particular solution of a scene in physical units.

    Parameters
    ----------
    solution : ParticularSolution
        Dimensionless, strains measured by one.
    mesh : BoundaryMesh
        In physical units.
    modulus : float [Pa]
    """

    solution: ParticularSolution
    mesh: BoundaryMesh
    modulus: float

    @classmethod
    def of(cls, scene: BodyScene, mesh: BoundaryMesh) -> ParticularFields | None:
        """Return the particular solution of a scene with a single load; None without body forces."""
        modulus = scene.material.plane_modulus
        solution = particular_solution(scene, mesh, modulus, modulus) if scene.body_forces else None
        return None if solution is None else cls(solution, mesh, modulus)

    def displacement(self, points: FloatArray) -> FloatArray:
        """Evaluate the displacement (n, 2) [m] at (n, 2) points [m]."""
        return self.mesh.diameter * self.solution.displacement(self._to_unit(points))

    def displacement_gradient(self, points: FloatArray) -> FloatArray:
        """Evaluate the (n, 2, 2) gradient [-] of the displacement at (n, 2) points [m]."""
        return self.solution.displacement_gradient(self._to_unit(points))

    def stress(self, points: FloatArray) -> FloatArray:
        """Evaluate the (n, 2, 2) stress [Pa] at (n, 2) points [m]."""
        return self.modulus * self.solution.stress(self._to_unit(points))

    def tractions(self, space: BoundarySpace) -> FloatArray:
        """Return the tractions (n_elements, n_local, 2) [Pa] projected onto a space on the unit mesh."""
        return self.modulus * projected_tractions(self.solution, space)

    @property
    def held_energy(self) -> float:
        """E' times the square of the largest thermal strain times the area [J/m]."""
        points = self._to_unit(np.concatenate([self.mesh.nodes, self.mesh.centres]))
        strain = float(np.abs(self.solution.expansion(points)).max())
        return self.modulus * strain**2 * self.mesh.area

    def _to_unit(self, points: FloatArray) -> FloatArray:
        return np.asarray((points - self.mesh.centre) / self.mesh.diameter)
