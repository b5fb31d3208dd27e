"""The physical size of one dimensionless unit, as the loads of a scene suggest it, within the range of numbers."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bemkit.arrays import FloatArray
from bemkit.contact.obstacle import measure_contact
from bemkit.errors import InputError
from bemkit.geometry.mesh import BoundaryMesh
from bemkit.geometry.vectors import LARGEST, SMALLEST
from bemkit.scene.body_scene import BodyScene
from bemkit.scene.conditions import Contact, Load, PrescribedDisplacement

_FARTHEST = 1e7
"""Distance from the origin in diameters up to which coordinates hold nine digits of the shape."""


class OutOfRangeError(InputError):
    """Stiffness, loads and lengths from which numbers too large or too small for floating point would follow."""


class TooFarError(InputError):
    """A body whose coordinates are so large that they no longer hold its shape."""


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
            f"the {name} is about {scale:.1e}, and its square is no longer a number: choose units in which stiffness, "
            f"stresses, strains, displacements and the roots of energies lie between {SMALLEST:g} and {LARGEST:g}"
        )


def largest_sizes(scene: BodyScene, mesh: BoundaryMesh, length: float) -> tuple[float, float, float]:
    """Return the largest traction [Pa], the largest given displacement or interference, and the largest gap [m].

    The length [m] decides which overlaps and gaps are the round-off of coordinates.
    """
    loads, motions, gaps = [0.0], [0.0], [0.0]
    if scene.body_forces:
        from bemkit.model.particular import stress_of

        loads += [stress_of(force, mesh, scene.material) for force in scene.body_forces]
    if scene.far is not None:
        of_turn = np.array([1.0, 1.0, length])
        loads.append(float(np.abs(scene.far.load / of_turn).max()) / length)
        motions.append(float(np.abs(np.append(scene.far.motion * of_turn, scene.far.strain * length)).max()))
    places = np.array([-1.0, 0.0, 1.0])
    for part, elements in scene.parts_on(mesh):
        points = mesh.points(elements, places).reshape(-1, 2)
        normals = np.repeat(mesh.normals[elements], places.size, axis=0)
        if isinstance(part.condition, Load):
            loads.append(float(np.abs(part.condition.at(points, normals)).max()))
        elif isinstance(part.condition, PrescribedDisplacement):
            motions.append(float(np.abs(part.condition.at(points)).max()))
        elif isinstance(part.condition, Contact):
            gap, _ = measure_contact(part.condition.obstacle, points, normals)
            gap = np.where(np.abs(gap) > 1e-18 * length, gap, 0.0)
            motions.append(float(np.maximum(-gap, 0.0).max()))
            gaps.append(float(np.abs(gap[np.isfinite(gap)]).max(initial=0.0)))
    return max(loads), max(motions), max(gaps)


def check_position(mesh: BoundaryMesh, owner: str = "the body") -> None:
    """Refuse a body so far from the origin that its coordinates hold too few digits of its shape; `owner` names it."""
    distance = float(np.abs(mesh.nodes).max()) / mesh.diameter
    if distance > _FARTHEST:
        x, y = mesh.centre.tolist()
        raise TooFarError(
            f"{owner} lies {distance:.1e} times its size from the origin, where numbers hold fewer than nine digits "
            f"of its shape: subtract about ({x:.6g}, {y:.6g}) from all coordinates of body and obstacles"
        )


def motion_units(units: Units) -> FloatArray:
    """Return (3,) the lengths [-, -, m] by which motions x, y, turn become displacements."""
    return np.array([1.0, 1.0, units.length])
