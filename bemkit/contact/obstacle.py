"""Rigid obstacles: distance of boundary points, and direction of contact.

Contact acts along the normal of the obstacle at the nearest point [Wriggers2006]: the body touches there first, and a
frictionless obstacle exerts forces along its normal for any shape of the body.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Protocol, runtime_checkable

import numpy as np

from bemkit.arrays import FloatArray
from bemkit.errors import InputError, called
from bemkit.formulas import ScalarField, check_field, evaluate_field

FACING_TOLERANCE = 1e-3
"""Smallest cosine of the angle between the normal of the body and the direction of contact at points that face the
obstacle."""


class Obstacle(Protocol):
    """A rigid body that the elastic body must not penetrate.

    Contact acts along the normals of the body, unless the obstacle is a `DirectedObstacle`.
    """

    def gap(self, points: FloatArray, normals: FloatArray) -> FloatArray:
        """Return the initial gap g of the condition u_n <= g.

        Parameters
        ----------
        points : (n, 2) array [m]
            Points of the undeformed boundary.
        normals : (n, 2) array [-]
            Outward unit normals of the body there.

        Returns
        -------
        (n,) array [m]
            Signed distance from each point to the obstacle along the direction of contact. It is negative where the
            bodies overlap initially (an interference fit), and infinite where the point can never touch.
        """
        ...


@runtime_checkable
class DirectedObstacle(Obstacle, Protocol):
    """An obstacle that gives the direction of contact."""

    def approach(self, points: FloatArray, normals: FloatArray) -> FloatArray:
        """Return the direction of contact, which is that of u_n and sigma_n.

        Parameters
        ----------
        points, normals : (n, 2) arrays
            See `gap`.

        Returns
        -------
        (n, 2) array [-]
            Unit vectors from the body into the obstacle, opposite to the normal of the obstacle at the nearest point.
        """
        ...


def measure_contact(obstacle: Obstacle, points: FloatArray, normals: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return gap and direction of contact; points that face away from the obstacle have an infinite gap.

    Parameters
    ----------
    obstacle : Obstacle
    points : (n, 2) array [m]
    normals : (n, 2) array [-]

    Returns
    -------
    gap : (n,) array [m]
        Infinite where the normal of the body does not point towards the obstacle.
    direction : (n, 2) array [-]

    Raises
    ------
    InputError
        If a method of the obstacle takes other arguments or returns an array of another shape.
    """
    gap = _measured(obstacle, "gap", points, normals, points.shape[:1])
    if not isinstance(obstacle, DirectedObstacle):
        return gap, normals
    direction = _measured(obstacle, "approach", points, normals, points.shape)
    return np.where(np.sum(direction * normals, axis=1) > FACING_TOLERANCE, gap, np.inf), direction


def _measured(
    obstacle: Obstacle, name: str, points: FloatArray, normals: FloatArray, shape: tuple[int, ...]
) -> FloatArray:
    remedy = (
        f"{name}(self, points, normals) for arrays of the shape (n, 2), which returns the shape "
        f"{'(n,)' if len(shape) == 1 else '(n, 2)'}"
    )
    values = called(obstacle, name, (points, normals), remedy)
    result = np.asarray(values, dtype=float)
    if result.shape != shape:
        raise InputError(
            f"{type(obstacle).__name__}.{name} returned an array of the shape {result.shape}: return the shape {shape} "
            f"for {shape[0]} points"
        )
    return result


@dataclass(frozen=True)
class RigidHalfPlane:
    """The obstacle fills the half-plane behind a straight line: ``(x - point) @ normal <= 0``.

    Parameters
    ----------
    point : (x, y) [m]
        Any point of the straight surface.
    normal : (x, y) [-]
        From the obstacle towards the body, of any length.

    Raises
    ------
    ValueError
        If a coordinate is not finite or the normal is zero.
    """

    point: tuple[float, float] = (0.0, 0.0)
    normal: tuple[float, float] = (0.0, 1.0)

    def __post_init__(self) -> None:
        check_pair("point", self.point)
        check_pair("normal", self.normal)
        if math.hypot(*self.normal) == 0.0:
            raise InputError("normal is (0, 0): give the direction from the obstacle towards the body, such as (0, 1)")

    def gap(self, points: FloatArray, normals: FloatArray) -> FloatArray:
        """Return the distance from the surface; see `Obstacle.gap`."""
        return np.asarray((points - np.array(self.point)) @ self._unit_normal)

    def approach(self, points: FloatArray, normals: FloatArray) -> FloatArray:
        """Return the direction against the surface normal; see `DirectedObstacle.approach`."""
        return np.broadcast_to(-self._unit_normal, points.shape)

    @property
    def _unit_normal(self) -> FloatArray:
        return np.array(self.normal) / math.hypot(*self.normal)


@dataclass(frozen=True)
class _Round:
    centre: tuple[float, float]
    radius: float

    def __post_init__(self) -> None:
        check_pair("centre", self.centre)
        if not (math.isfinite(self.radius) and self.radius > 0.0):
            raise InputError(f"radius is {self.radius}: give a positive, finite length")

    def _from_centre(self, points: FloatArray) -> FloatArray:
        return np.asarray(points - np.array(self.centre))


@dataclass(frozen=True)
class RigidCircle(_Round):
    """The obstacle fills a disc; the body is outside of it (a roll, a shaft in a hole).

    Parameters
    ----------
    centre : (x, y) [m]
    radius : float [m]

    Raises
    ------
    InputError
        If the centre is not finite or the radius not positive.
    """

    def gap(self, points: FloatArray, normals: FloatArray) -> FloatArray:
        """Return the distance from the circle; see `Obstacle.gap`."""
        return np.asarray(np.hypot(*self._from_centre(points).T) - self.radius)

    def approach(self, points: FloatArray, normals: FloatArray) -> FloatArray:
        """Return the direction towards the centre; see `DirectedObstacle.approach`."""
        return unit_vectors(-self._from_centre(points), normals)


@dataclass(frozen=True)
class RigidCavity(_Round):
    """The obstacle fills the outside of a circle; the body is inside (a disc in a rigid ring).

    Parameters
    ----------
    centre : (x, y) [m]
    radius : float [m]

    Raises
    ------
    InputError
        If the centre is not finite or the radius not positive.
    """

    def gap(self, points: FloatArray, normals: FloatArray) -> FloatArray:
        """Return the distance from the circle; see `Obstacle.gap`."""
        return np.asarray(self.radius - np.hypot(*self._from_centre(points).T))

    def approach(self, points: FloatArray, normals: FloatArray) -> FloatArray:
        """Return the direction away from the centre; see `DirectedObstacle.approach`."""
        return unit_vectors(self._from_centre(points), normals)


SIMPLE_OBSTACLES = (RigidHalfPlane, RigidCircle, RigidCavity)
"""Obstacles that are defined in this module."""


@dataclass(frozen=True)
class Gap:
    """An obstacle given by its gap, as a number or a function of the boundary point.

    Parameters
    ----------
    value : float, Expression or callable (x, y) -> (n,) array [m]
        Distance along `direction`; zero for an obstacle that fits the body exactly.
    direction : pair of float, Expression or callable [-], optional
        Direction from the body into the obstacle, of any length; by default the outward normal of the body.

    Raises
    ------
    ValueError
        If the value or a component is not a finite number, a formula or a function, or if the direction is zero at a
        point.
    """

    value: ScalarField = 0.0
    direction: tuple[ScalarField, ScalarField] | None = None

    def __post_init__(self) -> None:
        check_field(self.value, "value")
        for index, component in enumerate(self.direction or ()):
            check_field(component, f"direction[{index}]")
        if self.direction is not None and len(self.direction) != 2:
            raise InputError(f"direction has {len(self.direction)} components: give x and y, such as (0, -1)")

    def gap(self, points: FloatArray, normals: FloatArray) -> FloatArray:
        """Evaluate the given gap; see `Obstacle.gap`."""
        return evaluate_field(self.value, points)

    def approach(self, points: FloatArray, normals: FloatArray) -> FloatArray:
        """Evaluate the given direction, or return the normals of the body; see `DirectedObstacle.approach`."""
        if self.direction is None:
            return normals
        towards = np.stack([evaluate_field(component, points) for component in self.direction], axis=1)
        length = np.hypot(*towards.T)
        if not length.all():
            x, y = points[int(np.argmin(length))]
            raise InputError(f"direction is (0, 0) at ({x:.6g}, {y:.6g}): give the direction into the obstacle")
        return np.asarray(towards / length[:, None])


def unit_vectors(vectors: FloatArray, otherwise: FloatArray) -> FloatArray:
    """Return unit vectors (n, 2); zero vectors are replaced by those of `otherwise`."""
    largest = np.abs(vectors).max(axis=1, initial=0.0)[:, None]
    is_nonzero = largest > 0.0
    scaled = vectors / np.where(is_nonzero, largest, 1.0)  # squares of tiny components would underflow
    return np.where(is_nonzero, scaled / np.where(is_nonzero, np.hypot(*scaled.T)[:, None], 1.0), otherwise)


def check_pair(name: str, pair: tuple[float, float]) -> None:
    """Raise InputError unless a pair is two finite numbers."""
    if len(pair) != 2 or not all(math.isfinite(component) for component in pair):
        raise InputError(f"{name} is {pair}: give two finite numbers")
