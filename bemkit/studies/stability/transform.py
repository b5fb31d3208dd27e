"""Stretched, moved and rescaled scenes: the same problem elsewhere, at another size, in other units."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from bemkit.arrays import BoolArray, FloatArray
from bemkit.contact.laws import FrictionLaw, RescaledLaw
from bemkit.contact.obstacle import Obstacle, measure_contact
from bemkit.formulas import ScalarField, evaluate_field
from bemkit.geometry.curves import Curve, ParametricCurve, Segment, scaled_curve
from bemkit.geometry.outline import Outline, Side
from bemkit.geometry.shapes import CheckedShape, Shape
from bemkit.geometry.symmetry.lines import Symmetry
from bemkit.scene.body_forces import BodyForce, Gravity, Heating, Rotation
from bemkit.scene.conditions import (
    Condition,
    Contact,
    Force,
    Part,
    Pressure,
    Region,
    Traction,
    with_fields,
)
from bemkit.scene.plane_motion import FarField
from bemkit.scene.scene import Scene


@dataclass(frozen=True)
class AffineMap:
    """The map x -> factor * x + shift of the plane, component by component.

    Parameters
    ----------
    factor : (float, float)
        Positive.
    shift : (float, float) [m]
    """

    factor: tuple[float, float] = (1.0, 1.0)
    shift: tuple[float, float] = (0.0, 0.0)

    def forward(self, points: FloatArray) -> FloatArray:
        """Map (n, 2) points."""
        return np.asarray(points * np.array(self.factor) + np.array(self.shift))

    def back(self, points: FloatArray) -> FloatArray:
        """Map (n, 2) points back to where they came from."""
        original: FloatArray = (points - np.array(self.shift)) / np.array(self.factor)
        return original

    def normals_back(self, normals: FloatArray) -> FloatArray:
        """Return the unit normals that belong to the normals of the transformed boundary."""
        if self.is_uniform:
            return normals
        original = normals * np.array(self.factor)
        return np.asarray(original / np.hypot(*original.T)[:, None])

    def normals_forward(self, normals: FloatArray) -> FloatArray:
        """Return the unit normals of the transformed boundary that belong to normals of the original."""
        return AffineMap((1.0 / self.factor[0], 1.0 / self.factor[1])).normals_back(normals)

    def transformed(self, symmetry: Symmetry) -> Symmetry:
        """Map symmetry lines."""
        places = zip((symmetry.x, symmetry.y), self.factor, self.shift, strict=True)
        return Symmetry(*(None if place is None else place * factor + shift for place, factor, shift in places))

    @property
    def is_uniform(self) -> bool:
        """Whether angles are kept."""
        return self.factor[0] == self.factor[1]


@dataclass(frozen=True)
class TransformedField:
    """``factor`` times a field of the original body, as a function of the moved coordinates."""

    field: ScalarField
    affine: AffineMap
    factor: float = 1.0

    def __call__(self, x: FloatArray, y: FloatArray) -> FloatArray:
        """Evaluate at moved coordinates."""
        return self.factor * evaluate_field(self.field, self.affine.back(np.column_stack([x, y])))


@dataclass(frozen=True)
class TransformedRegion:
    """A condition on the original coordinates, as a function of the moved ones."""

    region: Region
    affine: AffineMap

    def __call__(self, x: FloatArray, y: FloatArray) -> BoolArray:
        """Evaluate at moved coordinates."""
        original = self.affine.back(np.column_stack([x, y]))
        return np.asarray(self.region(original[:, 0], original[:, 1]))


@dataclass(frozen=True)
class TransformedObstacle:
    """An obstacle whose gap is ``factor`` times the gap of the original body, plus ``offset`` [m]."""

    obstacle: Obstacle
    affine: AffineMap = AffineMap()
    factor: float = 1.0
    offset: float = 0.0

    def gap(self, points: FloatArray, normals: FloatArray) -> FloatArray:
        """Measure the gap at moved points; see `Obstacle.gap`."""
        original = self.obstacle.gap(self.affine.back(points), self.affine.normals_back(normals))
        return self.factor * original + self.offset

    def approach(self, points: FloatArray, normals: FloatArray) -> FloatArray:
        """Return the direction of contact at moved points; see `DirectedObstacle.approach`."""
        _, direction = measure_contact(self.obstacle, self.affine.back(points), self.affine.normals_back(normals))
        return self.affine.normals_forward(direction)


@dataclass(frozen=True)
class TransformedLaw(RescaledLaw):
    """A friction law at moved points, in another unit of stress."""

    affine: AffineMap

    def at(self, points: FloatArray) -> FrictionLaw:
        """Return the law for contact nodes given by their moved points."""
        return super().at(self.affine.back(points))


@dataclass(frozen=True)
class TransformedShape(CheckedShape):
    """A shape after an affine map."""

    shape: Shape
    affine: AffineMap

    @cached_property
    def _outline(self) -> Outline:
        """Return the transformed boundary, its sides under their names."""
        outline = self.shape.outline()
        loops = tuple(
            tuple(Side(side.name, _transformed_curve(side.curve, self.affine), side.group) for side in loop)
            for loop in outline.loops
        )
        return Outline(loops, outline.is_exterior, outline.surface, outline.drawing)


def transformed_scene(
    scene: Scene, affine: AffineMap, *, stress: float = 1.0, displacement: float | None = None, modulus: float = 1.0
) -> Scene:
    """Return a scene after an affine map, with its numbers multiplied.

    Parameters
    ----------
    scene : Scene
    affine : AffineMap
    stress : float
        Factor of all loads, of the stresses of body forces, of those that act far away, and of those in the friction
        law.
    displacement : float, optional
        Factor of gaps and prescribed displacements, also far away; by default the first factor of the map.
    modulus : float
        Factor of Young's modulus.

    Returns
    -------
    Scene
        Its fields, regions and obstacles are functions, so it cannot be written to a file.
    """
    factor = affine.factor[0] if displacement is None else displacement
    body = scene.only
    material = replace(body.material, youngs_modulus=body.material.youngs_modulus * modulus)
    parts = tuple(_transformed_part(part, affine, stress, factor) for part in body.parts)
    law = TransformedLaw(scene.law, 1.0 / stress, affine) if scene.contact_parts else scene.law
    symmetry = None if scene.symmetry is None else affine.transformed(scene.symmetry)
    forces = tuple(_transformed_body_force(force, affine, stress, modulus) for force in scene.body_forces)
    return replace(
        scene,
        shape=TransformedShape(body.shape, affine),
        material=material,
        parts=parts,
        law=law,
        symmetry=symmetry,
        body_forces=forces,
        far=None if scene.far is None else _transformed_far(scene.far, affine, stress, factor),
    )


def with_gap_offset(scene: Scene, offset: float) -> Scene:
    """Return a scene whose obstacles are further away by `offset` [m], nearer if it is negative."""
    return with_conditions(
        scene,
        lambda condition: (
            replace(condition, obstacle=TransformedObstacle(condition.obstacle, offset=offset))
            if isinstance(condition, Contact)
            else condition
        ),
    )


def with_turned_loads(scene: Scene, angle: float) -> Scene:
    """Return a scene whose tractions, pressures and weight are turned anticlockwise by an angle [rad].

    Forces far away turn, too; given motions there resist their components along them.
    """
    cosine, sine = float(np.cos(angle)), float(np.sin(angle))

    def turned(condition: Condition) -> Condition:
        match condition:
            case Traction(x, y):
                return Traction(_combined(x, cosine, y, -sine), _combined(x, sine, y, cosine))
            case Force(x, y):
                return replace(condition, x=cosine * x - sine * y, y=sine * x + cosine * y)
            case Pressure(pressure, shear):  # the load is -pressure n + shear t, and t is n turned by 90 degrees
                return Pressure(_combined(pressure, cosine, shear, sine), _combined(shear, cosine, pressure, -sine))
        return condition

    def turned_weight(force: BodyForce) -> BodyForce:
        if not isinstance(force, Gravity):
            return force
        x, y = force.acceleration
        return replace(force, acceleration=(cosine * x - sine * y, sine * x + cosine * y))

    far = scene.far
    if far is not None:
        x, y, _ = far.load.tolist()
        turned_load = {"force_x": cosine * x - sine * y, "force_y": sine * x + cosine * y}
        far = replace(far, **{key: load for key, load in turned_load.items() if getattr(far, key) is not None})
    forces = tuple(turned_weight(force) for force in scene.body_forces)
    return replace(with_conditions(scene, turned), body_forces=forces, far=far)


def with_conditions(scene: Scene, change: Callable[[Condition], Condition]) -> Scene:
    """Return a scene with the condition of every part replaced by `change` of it."""
    return replace(scene, parts=tuple(replace(part, condition=change(part.condition)) for part in scene.parts))


def _combined(
    a: ScalarField, factor_a: float, b: ScalarField, factor_b: float
) -> Callable[[FloatArray, FloatArray], FloatArray]:
    def field(x: FloatArray, y: FloatArray) -> FloatArray:
        points = np.column_stack([x, y])
        return factor_a * evaluate_field(a, points) + factor_b * evaluate_field(b, points)

    return field


def _transformed_part(part: Part, affine: AffineMap, stress: float, displacement: float) -> Part:
    where = None if part.where is None else TransformedRegion(part.where, affine)
    return replace(part, condition=_transformed_condition(part.condition, affine, stress, displacement), where=where)


def _transformed_far(far: FarField, affine: AffineMap, stress: float, displacement: float) -> FarField:
    length = affine.factor[0]
    of_turn = np.array([1.0, 1.0, length])
    centre: tuple[float, float] = tuple(affine.forward(np.array([far.centre]))[0].tolist())
    moved = far.multiplied(displacement / of_turn, stress * length * of_turn)
    return replace(moved, centre=centre, strain=far.strain * displacement / length)


def _transformed_body_force(force: BodyForce, affine: AffineMap, stress: float, modulus: float) -> BodyForce:
    length = affine.factor[0]
    match force:
        case Gravity(acceleration=(x, y)):
            return replace(force, acceleration=(x * stress / length, y * stress / length))
        case Rotation():
            (centre,) = affine.forward(np.array([force.centre])).tolist()
            return replace(force, density=force.density * stress / length**2, centre=tuple(centre))
        case Heating():
            temperature = TransformedField(force.temperature, affine)
            return replace(force, expansion=force.expansion * stress / modulus, temperature=temperature)


def _transformed_condition(condition: Condition, affine: AffineMap, stress: float, displacement: float) -> Condition:
    if isinstance(condition, Contact):
        own = None if condition.law is None else TransformedLaw(condition.law, 1.0 / stress, affine)
        return Contact(TransformedObstacle(condition.obstacle, affine, displacement), own)
    return with_fields(
        condition,
        lambda load: TransformedField(load, affine, stress),
        lambda motion: TransformedField(motion, affine, displacement),
    )


def _transformed_curve(curve: Curve, affine: AffineMap) -> Curve:
    if curve.is_straight:
        start, end = affine.forward(curve.point(np.array([0.0, 1.0]))).tolist()
        return Segment(tuple(start), tuple(end))
    factor = affine.factor[0]
    if affine.is_uniform:
        return scaled_curve(curve, (-affine.shift[0] / factor, -affine.shift[1] / factor), (factor, factor))
    return ParametricCurve(
        lambda s: affine.forward(curve.point(s)), lambda s: curve.derivative(s) * np.array(affine.factor)
    )
