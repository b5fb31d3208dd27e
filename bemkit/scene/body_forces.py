"""Body forces: weight, rotation and temperature; frozen values in one consistent set of units."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import TypeAlias

import numpy as np

from bemkit.arrays import FloatArray
from bemkit.errors import InputError
from bemkit.formulas import ScalarField, check_field, evaluate_field
from bemkit.geometry.placement import Placement


@dataclass(frozen=True)
class Gravity:
    """The weight of the body.

    Parameters
    ----------
    density : float [kg/m^3]
        Positive.
    acceleration : (float, float) [m/s^2]
        Acceleration of gravity, in the direction of the weight.
    is_constant : bool
        Whether load factors do not apply to it.

    Raises
    ------
    ValueError
        If the density is not positive and finite, or the acceleration is not finite.
    """

    density: float
    acceleration: tuple[float, float] = (0.0, -9.81)
    is_constant: bool = False

    def __post_init__(self) -> None:
        _check_density(self.density)
        _check_finite("acceleration", self.acceleration)

    def force_at(self, points: FloatArray) -> FloatArray:
        """Evaluate the force (n, 2) [N/m^3] at (n, 2) points [m]."""
        return np.tile(self.density * np.array(self.acceleration, dtype=float), (len(points), 1))


@dataclass(frozen=True)
class Rotation:
    """The centrifugal force of a body that turns at a constant rate: density * angular_velocity^2 * distance.

    Parameters
    ----------
    density : float [kg/m^3]
        Positive.
    angular_velocity : float [rad/s]
    centre : (float, float) [m]
        Centre of the rotation.
    is_constant : bool
        Whether load factors do not apply to it.

    Raises
    ------
    ValueError
        If the density is not positive and finite, or another number is not finite.
    """

    density: float
    angular_velocity: float
    centre: tuple[float, float] = (0.0, 0.0)
    is_constant: bool = False

    def __post_init__(self) -> None:
        _check_density(self.density)
        _check_finite("angular_velocity", (self.angular_velocity,))
        _check_finite("centre", self.centre)

    @property
    def factor(self) -> float:
        """Force per distance from the centre [N/m^4]."""
        return self.density * self.angular_velocity**2

    def force_at(self, points: FloatArray) -> FloatArray:
        """Evaluate the force (n, 2) [N/m^3] at (n, 2) points [m]."""
        return np.asarray(self.factor * (points - np.array(self.centre)))


@dataclass(frozen=True)
class Heating:
    """A stationary change of temperature without heat sources in the body: a harmonic function of the coordinates.

    Parameters
    ----------
    expansion : float [1/K]
        Coefficient of thermal expansion: strain per temperature of a body that is free to expand.
    temperature : float, Expression or callable [K]
        Difference from the temperature of the undeformed body.
    is_constant : bool
        Whether load factors do not apply to it.

    Raises
    ------
    ValueError
        If the expansion is not finite, or the temperature is not a finite number, a formula or a function.
    """

    expansion: float
    temperature: ScalarField
    is_constant: bool = False

    def __post_init__(self) -> None:
        _check_finite("expansion", (self.expansion,))
        check_field(self.temperature, "temperature")

    def strain_at(self, points: FloatArray) -> FloatArray:
        """Evaluate the strain (n,) [-] of a body that is free to expand at (n, 2) points [m]."""
        return np.asarray(self.expansion * evaluate_field(self.temperature, points))


BodyForce: TypeAlias = Gravity | Rotation | Heating


def seen_from(force: BodyForce, placement: Placement) -> BodyForce:
    """Return a body force in the coordinates of the shape of a placed body; the same object if it was not moved."""
    if placement == Placement():
        return force
    match force:
        case Gravity(acceleration=acceleration):
            x, y = placement.turned_back(np.array(acceleration)).tolist()
            return replace(force, acceleration=(x, y))
        case Rotation(centre=centre):
            x, y = placement.back(np.array(centre)).tolist()
            return replace(force, centre=(x, y))
        case Heating(temperature=temperature):
            if isinstance(temperature, int | float):
                return force

            def on_shape(x: FloatArray, y: FloatArray) -> FloatArray:
                return evaluate_field(temperature, placement.forward(np.stack([x, y], axis=-1)))

            return replace(force, temperature=on_shape)


def scaled_body_force(force: BodyForce, factor: float) -> BodyForce:
    """Return a body force times a load factor.

    Raises
    ------
    InputError
        If the force is that of a rotation and the factor negative: it always points away from the centre.
    """
    match force:
        case Gravity(acceleration=(x, y)):
            return replace(force, acceleration=(factor * x, factor * y))
        case Rotation():
            if factor < 0.0:
                raise InputError(
                    f"load factor {factor} of a rotation, whose force always points away from its centre: give load "
                    "factors that are not negative, or set is_constant"
                )
            return replace(force, angular_velocity=math.sqrt(factor) * force.angular_velocity)
        case Heating():
            return replace(force, expansion=factor * force.expansion)


def _check_density(density: float) -> None:
    if not (math.isfinite(density) and density > 0.0):
        raise InputError(f"density is {density}: give a positive, finite number such as 2400.0")


def _check_finite(name: str, values: tuple[float, ...]) -> None:
    if not np.all(np.isfinite(values)):
        shown = values if len(values) > 1 else values[0]
        raise InputError(f"{name} is {shown}: give finite numbers")
