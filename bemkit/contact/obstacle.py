"""Rigid obstacles: how far each boundary point may move along its outward normal before it touches."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from bemkit.arrays import FloatArray
from bemkit.expression import ScalarField, check_field, evaluate_field


class Obstacle(Protocol):
    """A rigid body that the elastic body must not enter."""

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
            The signed distance from each point to the obstacle along the outward normal: negative where the bodies
            overlap initially (an interference fit), infinite where the normal never meets the obstacle.
        """
        ...


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
            raise ValueError("normal is (0, 0): give the direction from the obstacle towards the body, such as (0, 1)")

    def gap(self, points: FloatArray, normals: FloatArray) -> FloatArray:
        """Measure the gap along the body's normals; see `Obstacle.gap`."""
        normal = np.array(self.normal) / math.hypot(*self.normal)
        approach = -(normals @ normal)
        result = np.full(len(points), np.inf)
        # round-off must not let a normal that runs along the surface meet it at a distance of 1e16
        meets = approach > 1e-12
        result[meets] = ((points[meets] - np.array(self.point)) @ normal) / approach[meets]
        return result


@dataclass(frozen=True)
class Circle:
    """The obstacle fills a disc; the body lies outside it (a roll, a shaft in a hole).

    Parameters
    ----------
    centre : (x, y) [m]
    radius : float [m]

    Raises
    ------
    ValueError
        If the centre is not finite or the radius not positive.
    """

    centre: tuple[float, float]
    radius: float

    def __post_init__(self) -> None:
        _check_pair("centre", self.centre)
        _check_radius(self.radius)

    def gap(self, points: FloatArray, normals: FloatArray) -> FloatArray:
        """Measure the gap along the body's normals; see `Obstacle.gap`."""
        along, discriminant = _line_and_circle(self.centre, self.radius, points, normals)
        meets = (discriminant >= 0.0) & (along < 0.0)
        # the near side of the disc: the smaller root of |q + g n| = radius
        return np.where(meets, -along - np.sqrt(np.maximum(discriminant, 0.0)), np.inf)


@dataclass(frozen=True)
class Cavity:
    """The obstacle fills everything outside a circle; the body lies inside it (a disc in a rigid ring).

    Parameters
    ----------
    centre : (x, y) [m]
    radius : float [m]

    Raises
    ------
    ValueError
        If the centre is not finite or the radius not positive.
    """

    centre: tuple[float, float]
    radius: float

    def __post_init__(self) -> None:
        _check_pair("centre", self.centre)
        _check_radius(self.radius)

    def gap(self, points: FloatArray, normals: FloatArray) -> FloatArray:
        """Measure the gap along the body's normals; see `Obstacle.gap`."""
        along, discriminant = _line_and_circle(self.centre, self.radius, points, normals)
        is_inside = np.sum((points - np.array(self.centre)) ** 2, axis=1) <= self.radius**2
        meets = (discriminant >= 0.0) & (is_inside | (along > 0.0))
        # the far side of the circle: the larger root of |q + g n| = radius
        return np.where(meets, -along + np.sqrt(np.maximum(discriminant, 0.0)), np.inf)


@dataclass(frozen=True)
class Gap:
    """An obstacle known by its gap alone, as a number or a function of the boundary point.

    Parameters
    ----------
    value : float, Expression or callable (x, y) -> (n,) array [m]
        The distance along the outward normal. Zero is an obstacle that fits the body exactly.

    Raises
    ------
    ValueError
        If the value is not a finite number, a formula for a number or a function.
    """

    value: ScalarField = 0.0

    def __post_init__(self) -> None:
        check_field(self.value, "value")

    def gap(self, points: FloatArray, normals: FloatArray) -> FloatArray:
        """Evaluate the given gap; see `Obstacle.gap`."""
        return evaluate_field(self.value, points)


def _line_and_circle(
    centre: tuple[float, float], radius: float, points: FloatArray, normals: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return q . n and the discriminant of |q + g n|^2 = radius^2, both (n,) arrays, with q = point - centre."""
    offset = points - np.array(centre)
    along = np.sum(offset * normals, axis=1)
    across = offset[:, 0] * normals[:, 1] - offset[:, 1] * normals[:, 0]
    return along, (radius - np.abs(across)) * (radius + np.abs(across))


def _check_pair(name: str, pair: tuple[float, float]) -> None:
    if len(pair) != 2 or not all(math.isfinite(component) for component in pair):
        raise ValueError(f"{name} is {pair}: give two finite numbers")


def _check_radius(radius: float) -> None:
    if not (math.isfinite(radius) and radius > 0.0):
        raise ValueError(f"radius is {radius}: give a positive, finite length")
