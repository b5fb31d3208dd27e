"""Rigid obstacles: how far each boundary point is from them, and in which direction it touches.

Contact acts along the obstacle's normal at its nearest point [Wriggers2006]: that is where the point touches first, and
a frictionless obstacle pushes along its own normal, whatever shape the body has there.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Protocol, runtime_checkable

import numpy as np

from bemkit.arrays import BoolArray, FloatArray
from bemkit.errors import InputError
from bemkit.formulas import ScalarField, check_field, evaluate_field

FACING = 1e-12
"""Cosine of the angle between the body's normal and the contact direction below which a point does not face the
obstacle: round-off of a side that runs along it."""
_TOUCHING = 1e-12
"""Distance from a polygon, relative to the coordinates, that may be their round-off."""


class Obstacle(Protocol):
    """A rigid body that the elastic body must not enter.

    Contact acts along the body's normals, unless the obstacle is a `DirectedObstacle`.
    """

    def gap(self, points: FloatArray, normals: FloatArray) -> FloatArray:
        """Measure the initial gap g of the condition u_n <= g.

        Parameters
        ----------
        points : (n, 2) array [m]
            Points of the undeformed boundary.
        normals : (n, 2) array [-]
            Outward unit normals of the body there.

        Returns
        -------
        (n,) array [m]
            The signed distance from each point to the obstacle along the direction of contact: negative where the
            bodies overlap initially (an interference fit), infinite where the point can never touch.
        """
        ...


@runtime_checkable
class DirectedObstacle(Obstacle, Protocol):
    """An obstacle that knows in which direction each point approaches it."""

    def approach(self, points: FloatArray, normals: FloatArray) -> FloatArray:
        """Return the direction of contact: that of u_n and sigma_n.

        Parameters
        ----------
        points, normals : (n, 2) arrays
            As for `gap`.

        Returns
        -------
        (n, 2) array [-]
            Unit vectors from the body into the obstacle: against the obstacle's normal at its nearest point.
        """
        ...


def measure_contact(obstacle: Obstacle, points: FloatArray, normals: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Measure gap and direction of contact, with points that face away left out.

    Parameters
    ----------
    obstacle : Obstacle
    points : (n, 2) array [m]
    normals : (n, 2) array [-]

    Returns
    -------
    gap : (n,) array [m]
        Infinite where the body's normal does not point towards the obstacle.
    direction : (n, 2) array [-]
    """
    gap = obstacle.gap(points, normals)
    if not isinstance(obstacle, DirectedObstacle):
        return gap, normals
    direction = obstacle.approach(points, normals)
    return np.where(np.sum(direction * normals, axis=1) > FACING, gap, np.inf), direction


@dataclass(frozen=True)
class HalfPlane:
    """The obstacle fills the half-plane (x - point) . normal <= 0.

    Parameters
    ----------
    point : (x, y) [m]
        Any point of its straight surface.
    normal : (x, y) [-]
        From the obstacle towards the body; it need not have unit length.

    Raises
    ------
    ValueError
        If a coordinate is not finite or the normal is zero.
    """

    point: tuple[float, float] = (0.0, 0.0)
    normal: tuple[float, float] = (0.0, 1.0)

    def __post_init__(self) -> None:
        _check_pair("point", self.point)
        _check_pair("normal", self.normal)
        if math.hypot(*self.normal) == 0.0:
            raise InputError("normal is (0, 0): give the direction from the obstacle towards the body, such as (0, 1)")

    def gap(self, points: FloatArray, normals: FloatArray) -> FloatArray:
        """Measure the distance from the surface; see `Obstacle.gap`."""
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
        _check_pair("centre", self.centre)
        if not (math.isfinite(self.radius) and self.radius > 0.0):
            raise InputError(f"radius is {self.radius}: give a positive, finite length")

    def _from_centre(self, points: FloatArray) -> FloatArray:
        return np.asarray(points - np.array(self.centre))


@dataclass(frozen=True)
class Circle(_Round):
    """The obstacle fills a disc; the body lies outside it (a roll, a shaft in a hole).

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
        """Measure the distance from the circle; see `Obstacle.gap`."""
        return np.asarray(np.hypot(*self._from_centre(points).T) - self.radius)

    def approach(self, points: FloatArray, normals: FloatArray) -> FloatArray:
        """Return the direction towards the centre; see `DirectedObstacle.approach`."""
        return _unit_vectors(-self._from_centre(points), normals)


@dataclass(frozen=True)
class Cavity(_Round):
    """The obstacle fills everything outside a circle, as `Circle`; the body lies inside it (a disc in a rigid ring)."""

    def gap(self, points: FloatArray, normals: FloatArray) -> FloatArray:
        """Measure the distance from the circle; see `Obstacle.gap`."""
        return np.asarray(self.radius - np.hypot(*self._from_centre(points).T))

    def approach(self, points: FloatArray, normals: FloatArray) -> FloatArray:
        """Return the direction away from the centre; see `DirectedObstacle.approach`."""
        return _unit_vectors(self._from_centre(points), normals)


@dataclass(frozen=True)
class PolygonalObstacle:
    """The obstacle fills a polygon; the body lies outside it.

    Parameters
    ----------
    vertices : sequence of (x, y) [m]
        In order around the polygon, either way, without crossing itself.

    Raises
    ------
    ValueError
        If there are fewer than three vertices, two neighbours coincide, or a coordinate is not finite.

    Notes
    -----
    At a corner that a point is nearest to, contact acts along the line from the point to the corner; a point inside is
    pushed out through the nearest side.
    """

    vertices: tuple[tuple[float, float], ...]

    def __post_init__(self) -> None:
        if len(self.vertices) < 3:
            raise InputError(f"vertices has {len(self.vertices)} points: give at least three")
        for number, vertex in enumerate(self.vertices):
            _check_pair(f"vertices[{number}]", vertex)
            if tuple(vertex) == tuple(self.vertices[number - 1]):
                raise InputError(f"vertices[{number}] is {vertex}, as is the one before it: leave one of them out")

    def gap(self, points: FloatArray, normals: FloatArray) -> FloatArray:
        """Measure the distance from the nearest side or corner; see `Obstacle.gap`."""
        towards, _, _ = self._nearest(points)
        distance = np.hypot(*towards.T)
        return np.asarray(np.where(self._holds(points), -distance, distance))

    def approach(self, points: FloatArray, normals: FloatArray) -> FloatArray:
        """Return the direction to the nearest point, out of it where the polygon holds the point."""
        towards, inward, is_corner = self._nearest(points)
        away = np.where(self._holds(points)[:, None], -towards, towards)
        # of a point on the polygon itself the vector is round-off: its side knows better, and at a corner the body
        touches = np.hypot(*towards.T) <= _TOUCHING * np.abs(np.concatenate([self.vertices, points])).max()
        at_corner = np.where(touches[:, None], normals, _unit_vectors(away, normals))
        return np.where(is_corner[:, None], at_corner, inward)

    def _sides(self) -> tuple[FloatArray, FloatArray]:
        """Return start (n_sides, 2) and vector to the end (n_sides, 2) of each side, anticlockwise."""
        start = np.array(self.vertices, dtype=float)
        x, y = (start - start[0]).T
        if np.sum(x * np.roll(y, -1) - y * np.roll(x, -1)) < 0.0:
            start = start[::-1]
        return start, np.roll(start, -1, axis=0) - start

    def _nearest(self, points: FloatArray) -> tuple[FloatArray, FloatArray, BoolArray]:
        """Return the vectors (n, 2) to the nearest points, the inward normals (n, 2) there, and which are corners."""
        start, along = self._sides()
        offset = start - points[:, None, :]
        share = np.clip(-np.sum(offset * along, axis=2) / np.sum(along**2, axis=1), 0.0, 1.0)
        to_side = offset + share[:, :, None] * along
        rows, nearest = np.arange(len(points)), np.argmin(np.sum(to_side**2, axis=2), axis=1)
        unit = along[nearest] / np.hypot(*along[nearest].T)[:, None]
        chosen = share[rows, nearest]
        return to_side[rows, nearest], np.stack([-unit[:, 1], unit[:, 0]], axis=1), (chosen == 0.0) | (chosen == 1.0)

    def _holds(self, points: FloatArray) -> BoolArray:
        """Return (n,) bool: points inside, by the number of sides that a ray to the right crosses."""
        start, along = self._sides()
        x, y = points[:, :1], points[:, 1:]
        end = np.roll(start, -1, axis=0)  # to the last digit the start of the next side
        spans = (start[:, 1] > y) != (end[:, 1] > y)
        rise = np.where(along[:, 1] == 0.0, 1.0, along[:, 1])
        crossings = spans & (x < start[:, 0] + along[:, 0] * (y - start[:, 1]) / rise)
        return np.asarray(crossings.sum(axis=1) % 2 == 1)


@dataclass(frozen=True)
class Gap:
    """An obstacle known by its gap alone, as a number or a function of the boundary point.

    Parameters
    ----------
    value : float, Expression or callable (x, y) -> (n,) array [m]
        The distance along `direction`. Zero is an obstacle that fits the body exactly.
    direction : pair of float, Expression or callable [-], optional
        The direction from the body into the obstacle, of any length; by default the outward normal of the body.

    Raises
    ------
    ValueError
        If the value or a component is not a finite number, a formula for a number or a function; if the direction is
        zero somewhere.
    """

    value: ScalarField = 0.0
    direction: tuple[ScalarField, ScalarField] | None = None

    def __post_init__(self) -> None:
        check_field(self.value, "value")
        for number, component in enumerate(self.direction or ()):
            check_field(component, f"direction[{number}]")
        if self.direction is not None and len(self.direction) != 2:
            raise InputError(f"direction has {len(self.direction)} components: give x and y, such as (0, -1)")

    def gap(self, points: FloatArray, normals: FloatArray) -> FloatArray:
        """Evaluate the given gap; see `Obstacle.gap`."""
        return evaluate_field(self.value, points)

    def approach(self, points: FloatArray, normals: FloatArray) -> FloatArray:
        """Evaluate the given direction, or return the body's normals; see `DirectedObstacle.approach`."""
        if self.direction is None:
            return normals
        towards = np.stack([evaluate_field(component, points) for component in self.direction], axis=1)
        length = np.hypot(*towards.T)
        if not length.all():
            x, y = points[int(np.argmin(length))]
            raise InputError(f"direction is (0, 0) at ({x:.6g}, {y:.6g}): give the direction into the obstacle")
        return np.asarray(towards / length[:, None])


def _unit_vectors(vectors: FloatArray, otherwise: FloatArray) -> FloatArray:
    """Return unit vectors (n, 2), those of `otherwise` where a vector is zero."""
    largest = np.abs(vectors).max(axis=1, initial=0.0)[:, None]
    is_known = largest > 0.0
    scaled = vectors / np.where(is_known, largest, 1.0)  # lengths of tiny vectors have few digits
    return np.where(is_known, scaled / np.where(is_known, np.hypot(*scaled.T)[:, None], 1.0), otherwise)


def _check_pair(name: str, pair: tuple[float, float]) -> None:
    if len(pair) != 2 or not all(math.isfinite(component) for component in pair):
        raise InputError(f"{name} is {pair}: give two finite numbers")
