"""The particular solution that belongs to the body forces of a scene, dimensionless and in physical units."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bemkit.arrays import FloatArray
from bemkit.formulas import Expression
from bemkit.geometry.mesh import BoundaryMesh
from bemkit.geometry.spaces import BoundarySpace
from bemkit.model.harmonic_fit import TemperatureError, harmonic_sources
from bemkit.operators.material import Material, Plane
from bemkit.operators.particular_solutions import (
    CentrifugalForce,
    HarmonicExpansion,
    ParticularSolution,
    Source,
    UniformForce,
)
from bemkit.operators.steklov_poincare.forces_inside import projected_tractions
from bemkit.scene.body_forces import BodyForce, Gravity, Heating, Rotation
from bemkit.scene.scene import Scene

_ROUND_OFF = 64.0 * float(np.finfo(float).eps)
"""Share of coordinates by which fields of them may be wrong."""


def stress_of(force: BodyForce, mesh: BoundaryMesh, material: Material) -> float:
    """Return the size [Pa] of the stresses that a body force causes."""
    points = np.concatenate([mesh.whole.nodes, mesh.whole.centres])
    if isinstance(force, Heating):
        return material.plane_modulus * _plane_strain_factor(material) * float(np.abs(force.strain_at(points)).max())
    return mesh.diameter * float(np.abs(force.force_at(points)).max())


def particular_solution(scene: Scene, mesh: BoundaryMesh, modulus: float, stress: float) -> ParticularSolution:
    """Return the dimensionless particular solution of the body forces of a scene.

    Parameters
    ----------
    scene : Scene
        With a single load and body forces.
    mesh : BoundaryMesh
        In physical units; lengths are measured by its diameter from its centre.
    modulus, stress : float [Pa]
        Units of the modulus and of stresses; strains are measured by their quotient.

    Returns
    -------
    ParticularSolution

    Raises
    ------
    TemperatureError
        If a temperature is not harmonic, or nothing that is known in closed form stands for it.
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
    def of(cls, scene: Scene, mesh: BoundaryMesh) -> ParticularFields | None:
        """Return that of a scene with a single load; None without body forces."""
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
