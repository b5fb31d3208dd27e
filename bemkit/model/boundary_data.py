"""From the conditions of a scene to supports and loads on a mesh, dimensionless.

Inside, lengths are measured by the diameter of the body, stresses of the material by E', loads by their largest value
p and displacements by p L / E'.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from bemkit.arrays import FloatArray, IntArray
from bemkit.contact.obstacle import measure_contact
from bemkit.errors import InputError
from bemkit.geometry.mesh import BoundaryMesh
from bemkit.geometry.spaces import BoundarySpace
from bemkit.geometry.validity.magnitude import LARGEST, SMALLEST
from bemkit.operators.steklov_poincare import TractionField
from bemkit.operators.steklov_poincare.nodal_conditions import Support, integrate_traction
from bemkit.scene.scene import Clamped, Contact, Part, PrescribedDisplacement, Pressure, Roller, Scene, Traction


class OutOfRangeError(InputError):
    """Stiffness, loads and lengths from which numbers too large or too small for floating point would follow."""


@dataclass(frozen=True)
class Units:
    """The physical size of one dimensionless unit.

    Parameters
    ----------
    centre : (2,) array [m]
        Where the dimensionless origin sits.
    length : float [m]
        Diameter of the body.
    modulus : float [Pa]
        E' of the material.
    stress : float [Pa]
        The largest load, or the stress that the largest prescribed displacement or interference suggests.
    """

    centre: FloatArray
    length: float
    modulus: float
    stress: float

    @property
    def displacement(self) -> float:
        """Unit of displacements and gaps [m]."""
        return self.stress / self.modulus * self.length

    def check_range(self) -> None:
        """Refuse units whose squares and products, such as energies, overflow or vanish."""
        _check_scale("stiffness", self.modulus)
        _check_scale("stress", self.stress)
        strain = self.stress / self.modulus
        _check_scale("strain", strain)
        _check_scale("displacement", strain * self.length)
        _check_scale("root of the energy", float(np.sqrt(self.stress) * np.sqrt(strain)) * self.length)

    def to_physical(self, points: FloatArray) -> FloatArray:
        """Return dimensionless points [-] in metres."""
        return self.centre + self.length * points


def _check_scale(name: str, scale: float) -> None:
    if not SMALLEST <= scale <= LARGEST:
        raise OutOfRangeError(
            f"the {name} is about {scale:.1e}, and its square is no number any more: choose units in which stiffness, "
            f"stresses, strains, displacements and the roots of energies lie between {SMALLEST:g} and {LARGEST:g}"
        )


def parts_on(scene: Scene, mesh: BoundaryMesh) -> list[tuple[Part, IntArray, FloatArray]]:
    """List the parts with their elements and the outward normals of these, but for parts beyond a symmetry line."""
    parts = [part for part in scene.parts if mesh.part(part.name).size]
    return [(part, mesh.part(part.name), mesh.normals[mesh.part(part.name)]) for part in parts]


def find_units(scene: Scene, mesh: BoundaryMesh) -> Units:
    """Choose the units by the largest load, prescribed displacement or interference.

    Raises
    ------
    OutOfRangeError
        If results in these units could overflow or vanish.
    """
    modulus, length = scene.material.plane_modulus, mesh.diameter
    stresses = [0.0]
    gaps = [0.0]
    places = np.array([-1.0, 0.0, 1.0])
    for part, elements, normals in parts_on(scene, mesh):
        points, normals = mesh.points(elements, places).reshape(-1, 2), np.repeat(normals, places.size, axis=0)
        if isinstance(part.condition, Traction | Pressure):
            stresses.append(float(np.abs(part.condition.at(points, normals)).max()))
        elif isinstance(part.condition, PrescribedDisplacement):
            stresses.append(float(np.abs(part.condition.at(points)).max()) / length * modulus)
        elif isinstance(part.condition, Contact):
            gap, _ = measure_contact(part.condition.obstacle, points, normals)
            # an overlap or gap below the round-off of the coordinates is no measure of anything
            gap = np.where(np.abs(gap) > 1e-18 * length, gap, 0.0)
            stresses.append(float(np.maximum(-gap, 0.0).max()) / length * modulus)
            gaps.append(float(np.abs(gap[np.isfinite(gap)]).max(initial=0.0)))
    stress = max(stresses) or max(gaps) / length * modulus or modulus
    units = Units(mesh.centre, length, modulus, stress)
    units.check_range()
    return units


def supports_on(scene: Scene, mesh: BoundaryMesh, units: Units, space: BoundarySpace) -> list[Support]:
    """Return the supports of the parts that hold the body, their displacements in the units given."""
    result = []
    for part, elements, _ in parts_on(scene, mesh):
        condition = part.condition
        axes = np.broadcast_to(np.eye(2), (elements.size, 2, 2))
        if isinstance(condition, Roller):
            normals = mesh.normals_at(elements, space.local_nodes)
            result.append(Support(part.name, elements, normals[:, :, None, :]))
        elif isinstance(condition, Clamped):
            result.append(Support(part.name, elements, axes))
        elif isinstance(condition, PrescribedDisplacement):
            result.append(
                Support(
                    part.name, elements, axes[:, list(condition.is_prescribed)], _dimensionless_motion(condition, units)
                )
            )
    return result


def _dimensionless_motion(condition: PrescribedDisplacement, units: Units) -> Callable[[FloatArray], FloatArray]:
    def field(points: FloatArray) -> FloatArray:
        return condition.at(units.to_physical(points)) / units.displacement

    return field


def nodal_forces(scene: Scene, mesh: BoundaryMesh, space: BoundarySpace, units: Units) -> FloatArray:
    """Return the (n_nodes, 2) dimensionless forces of all loads on the nodes of a space on the unit mesh."""
    force = np.zeros((space.n_dofs // 2, 2))
    for part, elements, _ in parts_on(scene, mesh):
        if isinstance(part.condition, Traction | Pressure):
            force += integrate_traction(space, elements, dimensionless_load(part.condition, units))
    return force


def dimensionless_load(load: Traction | Pressure, units: Units) -> TractionField:
    """Return a load as a function of dimensionless points."""

    def field(points: FloatArray, normals: FloatArray) -> FloatArray:
        return load.at(units.to_physical(points), normals) / units.stress

    return field
