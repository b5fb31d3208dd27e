"""Conditions on pieces of the boundary: supports, loads and contact; frozen values in one consistent set of units."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from typing import TypeAlias, cast

import numpy as np

from bemkit.arrays import BoolArray, FloatArray
from bemkit.contact.laws import FrictionLaw
from bemkit.contact.obstacle import Obstacle
from bemkit.errors import InputError
from bemkit.formulas import Expression, ScalarField, check_field, evaluate_field
from bemkit.geometry.meshing.division import quadrature
from bemkit.geometry.outline import Outline, Selection
from bemkit.geometry.placement import Placement
from bemkit.geometry.vectors import turned_left
from bemkit.scene.objects import check_objects

Region: TypeAlias = Expression | Callable[[FloatArray, FloatArray], BoolArray]
"""A condition on the coordinates, such as ``Expression("x > 0.5")``."""


@dataclass(frozen=True)
class Clamped:
    """Both displacement components are zero."""


@dataclass(frozen=True)
class Roller:
    """The normal displacement and the tangential traction are zero (also the condition on a symmetry line)."""


@dataclass(frozen=True)
class PrescribedDisplacement:
    """Displacement components are given; a component that is not given is free of traction.

    Parameters
    ----------
    x, y : float, Expression, callable or None [m]

    Raises
    ------
    ValueError
        If neither is given, or one is not a finite number, a formula or a function.
    """

    x: ScalarField | None = None
    y: ScalarField | None = None

    def __post_init__(self) -> None:
        if self.x is None and self.y is None:
            raise InputError("neither x nor y is given: give at least one displacement component, such as y = -0.01")
        for name in ("x", "y"):
            if getattr(self, name) is not None:
                check_field(getattr(self, name), name)

    @property
    def is_prescribed(self) -> tuple[bool, bool]:
        """Which of the components x and y are given."""
        return self.x is not None, self.y is not None

    def at(self, points: FloatArray) -> FloatArray:
        """Evaluate the displacement at (n, 2) points [m] as an (n, 2) array [m]; free components are zero."""
        values = [0.0 if value is None else value for value in (self.x, self.y)]
        return np.stack([evaluate_field(value, points) for value in values], axis=1)


class Load:
    """A condition that gives forces: those of a traction."""

    def at(self, points: FloatArray, normals: FloatArray) -> FloatArray:
        """Return the traction at (n, 2) points [m] with unit normals as an (n, 2) array [Pa]."""
        raise NotImplementedError


class DistributedLoad(Load):
    """A load that acts at each point: the traction of the solution equals it."""


@dataclass(frozen=True)
class Traction(DistributedLoad):
    """A load per area in the directions x and y.

    Parameters
    ----------
    x, y : float, Expression or callable [Pa]

    Raises
    ------
    ValueError
        If one is not a finite number, a formula or a function.
    """

    x: ScalarField = 0.0
    y: ScalarField = 0.0

    def __post_init__(self) -> None:
        check_field(self.x, "x")
        check_field(self.y, "y")

    def at(self, points: FloatArray, normals: FloatArray) -> FloatArray:
        """Evaluate the traction at (n, 2) points [m] as an (n, 2) array [Pa]; the normals do not matter."""
        return np.stack([evaluate_field(self.x, points), evaluate_field(self.y, points)], axis=1)


@dataclass(frozen=True)
class Pressure(DistributedLoad):
    """A load against the outward normal, and optionally along the boundary.

    Parameters
    ----------
    pressure : float, Expression or callable [Pa]
        Positive when it pushes the body inwards.
    shear : float, Expression or callable [Pa]
        Positive along the anticlockwise traversal of the boundary.

    Raises
    ------
    ValueError
        If one is not a finite number, a formula or a function.
    """

    pressure: ScalarField
    shear: ScalarField = 0.0

    def __post_init__(self) -> None:
        check_field(self.pressure, "pressure")
        check_field(self.shear, "shear")

    def at(self, points: FloatArray, normals: FloatArray) -> FloatArray:
        """Evaluate the traction at (n, 2) points [m] with unit normals as an (n, 2) array [Pa]."""
        pressure = evaluate_field(self.pressure, points)[:, None]
        return evaluate_field(self.shear, points)[:, None] * turned_left(normals) - pressure * normals


@dataclass(frozen=True)
class Force:
    """A resultant force and moment on a part: a load that is uniform or linear, or a rigid connection.

    The load is the traction ``F / L + M J (x - c) / I`` with the length L of the part, its middle c, the second moment
    ``I`` of the length about it, and J a quarter turn anticlockwise.

    Parameters
    ----------
    x, y : float [N/m]
        The force on the whole part, per unit of thickness unless the scene has a thickness.
    moment : float [N m/m]
        About the middle of the part, anticlockwise.
    is_rigid : bool
        Whether the part moves as a rigid body, as if a stiff piece were glued to it. Tractions follow; only their
        resultants are given.

    Raises
    ------
    ValueError
        If one is not a finite number.
    """

    x: float = 0.0
    y: float = 0.0
    moment: float = 0.0
    is_rigid: bool = False

    def __post_init__(self) -> None:
        for name in ("x", "y", "moment"):
            value = getattr(self, name)
            if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
                raise InputError(f"{name} is {value!r}: give a finite number, the resultant on the whole part")

    def over(self, area: float, middle: FloatArray, second_moment: float) -> Traction | RigidConnection:
        """Return the load on a part of an area [m^2], middle (2,) [m] and second moment of its area [m^4]."""

        def component(axis: int, x: FloatArray, y: FloatArray) -> FloatArray:
            turning = self.moment / second_moment * turned_left(np.column_stack([x, y]) - middle)
            return np.asarray((self.x, self.y)[axis] / area + turning[:, axis])

        traction = Traction(partial(component, 0), partial(component, 1))
        return RigidConnection(traction) if self.is_rigid else traction


@dataclass(frozen=True)
class RigidConnection(Load):
    """The part moves as a rigid body under the resultants of a traction: a placed `Force`."""

    traction: Traction

    def at(self, points: FloatArray, normals: FloatArray) -> FloatArray:
        """Return the traction that has the resultants, as `Traction.at`."""
        return self.traction.at(points, normals)


@dataclass(frozen=True)
class Free:
    """A named piece of the boundary without load, which other bodies may touch."""


@dataclass(frozen=True)
class Contact:
    """The part may touch a rigid obstacle.

    Parameters
    ----------
    obstacle : Obstacle
    law : FrictionLaw, optional
        The friction law on this part; by default that of the scene.

    Raises
    ------
    InputError
        If one is a text or a class.
    """

    obstacle: Obstacle
    law: FrictionLaw | None = None

    def __post_init__(self) -> None:
        check_objects(self)


def name_at_obstacle(body: str, part: str) -> str:
    """Return the name of the contact of a part with a fixed obstacle: ``"body.part"``, or the part."""
    return f"{body}.{part}" if body else part


Condition: TypeAlias = Clamped | Roller | PrescribedDisplacement | Traction | Pressure | Force | Contact | Free


def with_fields(
    condition: Condition, load: Callable[[ScalarField], ScalarField], motion: Callable[[ScalarField], ScalarField]
) -> Condition:
    """Return a condition with functions applied to its loads and its prescribed displacements."""
    match condition:
        case Traction(x, y):
            return Traction(load(x), load(y))
        case Pressure(pressure, shear):
            return Pressure(load(pressure), load(shear))
        case Force(x, y, moment):
            x, y, moment = (cast(float, load(value)) for value in (x, y, moment))
            return Force(x, y, moment, condition.is_rigid)
        case PrescribedDisplacement(x, y):
            return PrescribedDisplacement(*(None if value is None else motion(value) for value in (x, y)))
    return condition


@dataclass(frozen=True)
class Part:
    """A named piece of the boundary with its condition.

    Parameters
    ----------
    name : str
    condition : Condition
    sides : tuple of str
        Names of sides of the shape; empty means all sides.
    where : Expression, callable or None
        Keeps only the points where it is true; the ends are found to round-off and become mesh nodes.

    Raises
    ------
    ValueError
        If the name is empty, `where` is not a condition, or a word is given instead of an object or a tuple.
    """

    name: str
    condition: Condition
    sides: tuple[str, ...] = ()
    where: Region | None = None

    def __post_init__(self) -> None:
        if not self.name or not self.name.isprintable():
            raise InputError(f"the part name {self.name!r} is not printable text: give a name such as 'foundation'")
        check_objects(self, f"part {self.name!r}")
        if isinstance(self.where, str):
            raise InputError(
                f"part {self.name!r}: where is the text {self.where!r}: give Expression({self.where!r}) or a function"
            )
        if isinstance(self.where, Expression) and not self.where.is_condition:
            raise InputError(f"where is '{self.where.text}', which is a number: give a condition such as 'x > 0.5'")

    @property
    def selection(self) -> Selection:
        """The piece of the outline that the part covers."""
        return Selection(sides=self.sides, where=self.where)

    def on(self, outline: Outline, placement: Placement, thickness: float) -> Part:
        """Return the part with the tractions of its resultant force, if it has one, on its piece of a placed outline.

        The force acts on a thickness [m].

        Raises
        ------
        GeometryError
            If the part is empty.
        """
        if not isinstance(self.condition, Force):
            return self
        points, lengths = quadrature(outline, self.name, self.selection)
        points, length = placement.forward(points), float(lengths.sum())
        middle: FloatArray = lengths @ points / length
        second_moment = float(lengths @ np.sum((points - middle) ** 2, axis=1))
        placed = self.condition.over(thickness * length, middle, thickness * second_moment)
        return replace(self, condition=cast(Condition, placed))  # no kind of scene files: a placed one
