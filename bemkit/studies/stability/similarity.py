"""Scenes in other units, turned and elsewhere: every result follows from that of the original."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from bemkit.arrays import FloatArray
from bemkit.contact.further_laws import CohesiveCoulomb, RateStrengthening, SlipWeakening
from bemkit.contact.laws import Coulomb, FrictionLaw, Frictionless, Tresca
from bemkit.contact.obstacle import Gap, Obstacle, RigidCavity, RigidCircle, RigidHalfPlane
from bemkit.contact.polygon import RigidPolygon
from bemkit.contact.spline import RigidSpline
from bemkit.errors import InputError
from bemkit.geometry.placement import Placement
from bemkit.geometry.shapes import Disk, ExteriorOf, PlateWithHole, Polygon, Rectangle, Ring, Sector, Shape
from bemkit.scene.body import Body
from bemkit.scene.body_forces import BodyForce, Gravity, Rotation
from bemkit.scene.conditions import Condition, Contact, Force, Part, PrescribedDisplacement, Pressure, Traction
from bemkit.scene.contacts import ContactPair
from bemkit.scene.copies import CircleCopies, Copies, GridCopies, ListedCopies
from bemkit.scene.load_history import with_changed_steps
from bemkit.scene.plane_motion import RigidBody
from bemkit.scene.scene import Scene
from bemkit.studies.stability.transform import AffineMap, TransformedRegion, transformed_scene


@dataclass(frozen=True)
class Similarity:
    """The map x -> length * (turned x) + shift, with moduli and loads multiplied: every result follows from it.

    Parameters
    ----------
    length, modulus, stress : float
        Factors of all lengths of the bodies, of Young's moduli, and of all loads. Several bodies are similar only if
        displacements are multiplied like lengths: modulus and stress have to be equal.
    turn : float [degree]
        Anticlockwise, about the origin; several bodies only.
    shift : (float, float) [m]
        Where the origin goes.
    """

    length: float = 1.0
    modulus: float = 1.0
    stress: float = 1.0
    turn: float = 0.0
    shift: tuple[float, float] = (0.0, 0.0)

    @property
    def displacement(self) -> float:
        """Factor of displacements, and so of gaps and prescribed displacements."""
        return self.stress / self.modulus * self.length

    @property
    def _motion(self) -> Placement:
        return Placement(self.shift, self.turn)

    @property
    def _scaling(self) -> AffineMap:
        return AffineMap((self.length, self.length))

    def points(self, points: FloatArray) -> FloatArray:
        """Map points (..., 2)."""
        return self._motion.forward(self.length * points)

    def vectors(self, vectors: FloatArray) -> FloatArray:
        """Turn vectors (..., 2)."""
        return self._motion.turned(vectors)

    def apply(self, scene: Scene) -> Scene:
        """Return the similar scene.

        One body gets fields, regions and obstacles that are functions. Scenes of several bodies are changed number by
        number, so that the result can be written to a file (but for several load steps, and parts chosen by a region,
        if the length changes): their fields have to be numbers, and copies in a grid stay as they are turned only by
        way of a list of places.

        Raises
        ------
        InputError
            If something of it has no similar one; the message names it.
        """
        if not scene.bodies:
            if self.turn != 0.0:
                raise InputError(f"turn is {self.turn}: a scene is turned if it lists its bodies")
            affine, factor = replace(self._scaling, shift=self.shift), self.displacement
            return transformed_scene(scene, affine, stress=self.stress, displacement=factor, modulus=self.modulus)
        if self.modulus != self.stress:
            raise InputError(
                f"modulus is {self.modulus} and stress {self.stress}: give equal factors for several bodies, whose "
                "distances change like displacements"
            )
        if scene.symmetry is not None and not (self.turn == 0.0 and self.shift == (0.0, 0.0)):
            raise InputError("the scene has a symmetry, so its bodies cannot be moved: remove the symmetry")
        return with_changed_steps(scene, self._applied)

    def _applied(self, scene: Scene) -> Scene:
        touching = scene.touching
        if touching is not None:
            law = None if touching.law is None else self._law(touching.law)
            reach = self._length(touching.reach)
            touching = replace(touching, within=self.length * touching.within, law=law, reach=reach)
        return replace(
            scene,
            bodies=tuple(self._body(body) for body in scene.bodies),
            rigid=tuple(self._rigid(body) for body in scene.rigid),
            contacts=tuple(self._pair(pair) for pair in scene.contacts),
            touching=touching,
            law=self._law(scene.law),
            symmetry=None if scene.symmetry is None else self._scaling.transformed(scene.symmetry),
        )

    def _pair(self, pair: ContactPair) -> ContactPair:
        law = None if pair.law is None else self._law(pair.law)
        if not isinstance(pair.gap, int | float):
            raise InputError(f"contact {pair.name!r}: gap is {pair.gap!r}: give a number")
        gap, interference = self.length * pair.gap, self.length * pair.interference
        return replace(pair, gap=gap, interference=interference, law=law, reach=self._length(pair.reach))

    def _length(self, length: float | None) -> float | None:
        return None if length is None else self.length * length

    def _rigid(self, body: RigidBody) -> RigidBody:
        """Return the rigid body that moves alike; one that a force drives along only one axis cannot be turned."""
        is_pushed = body.is_load_controlled[:2]
        if is_pushed.any() and not is_pushed.all() and self.turn != 0.0:
            raise InputError(
                f"rigid body {body.name!r} is driven by a force along only one axis, which cannot be turned: give "
                "both forces, or both motions"
            )
        of_turn = np.array([1.0, 1.0, self.length])
        moved = body.multiplied(self.length / of_turn, self.stress * self.length * of_turn)
        if self.turn != 0.0 and is_pushed.all():
            force_x, force_y = self._vector(moved.force_x or 0.0, moved.force_y or 0.0, 1.0)
            moved = replace(moved, force_x=force_x, force_y=force_y)
        elif self.turn != 0.0:
            x, y = self._vector(moved.x or 0.0, moved.y or 0.0, 1.0)
            moved = replace(moved, x=x, y=y)
        return replace(moved, obstacle=self._obstacle(body.obstacle), centre=self._point(body.centre))

    def _law(self, law: FrictionLaw) -> FrictionLaw:
        match law:
            case Frictionless():
                return law
            case Tresca(bound_value=bound):
                return Tresca(self.stress * _number(bound))
            case Coulomb(coefficient):
                return Coulomb(_number(coefficient))
            case CohesiveCoulomb(coefficient, cohesion, cap):
                stresses = (self.stress * _number(each) for each in (cohesion, cap))
                return CohesiveCoulomb(_number(coefficient), *stresses)
            case SlipWeakening(static, kinetic, distance):
                return SlipWeakening(_number(static), _number(kinetic), self.length * _number(distance))
            case RateStrengthening(coefficient, by_rate, rate):  # times stay what they are
                return RateStrengthening(_number(coefficient), _number(by_rate), self.length * _number(rate))
        raise InputError(f"law is {type(law).__name__}: give one of the laws of bemkit")

    def _body(self, body: Body) -> Body:
        material = replace(body.material, youngs_modulus=self.stress * body.material.youngs_modulus)
        placement = self._motion.after(Placement(self._scaled(body.placement.shift), body.placement.turn))
        return replace(
            body,
            shape=self._shape(body.shape),
            material=material,
            parts=tuple(self._part(part) for part in body.parts),
            body_forces=tuple(self._force(force) for force in body.body_forces),
            placement=placement,
            copies=None if body.copies is None else self._copies(body.copies),
        )

    def _scaled(self, point: tuple[float, float]) -> tuple[float, float]:
        return self.length * point[0], self.length * point[1]

    def _point(self, point: tuple[float, float]) -> tuple[float, float]:
        x, y = self.points(np.array(point)).tolist()
        return x, y

    def _vector(self, x: float, y: float, factor: float) -> tuple[float, float]:
        x, y = (factor * self.vectors(np.array([x, y]))).tolist()
        return x, y

    def _copies(self, copies: Copies) -> Copies:
        """Return the copies of a body that is already in its new place."""
        match copies:
            case CircleCopies(count, angle, centre):
                return CircleCopies(count, angle, self._point(centre))
            case GridCopies() if self._motion.is_shift:
                return GridCopies(copies.columns, copies.rows, self._scaled(copies.step))
        # x -> M P M^-1 x moves what M has moved
        back = Placement(turn=-self.turn).after(Placement((-self.shift[0], -self.shift[1])))
        places = [Placement(self._scaled(place.shift), place.turn) for place in copies.placements().values()]
        return ListedCopies(tuple(self._motion.after(place.after(back)) for place in places))

    def _shape(self, shape: Shape) -> Shape:
        factor, scaled = self.length, self._scaled
        match shape:
            case Rectangle(width, height, corner):
                return Rectangle(factor * width, factor * height, scaled(corner))
            case Polygon(vertices, names):
                return Polygon(tuple(scaled(vertex) for vertex in vertices), names)
            case Disk(radius, centre):
                return Disk(factor * radius, scaled(centre))
            case Ring(inner, outer, centre):
                return Ring(factor * inner, factor * outer, scaled(centre))
            case Sector(radius, start, end, centre):
                return Sector(factor * radius, start, end, scaled(centre))
            case PlateWithHole(width, height, radius, corner):
                return PlateWithHole(factor * width, factor * height, factor * radius, scaled(corner))
            case ExteriorOf(inner_shape):
                return ExteriorOf(self._shape(inner_shape))
        raise InputError(f"shape is {type(shape).__name__}: give one of those that random bodies are made of")

    def _part(self, part: Part) -> Part:
        where = part.where
        if where is not None and self.length != 1.0:  # regions are in the coordinates of the shape
            where = TransformedRegion(where, self._scaling)
        return replace(part, where=where, condition=self._condition(part.condition))

    def _condition(self, condition: Condition) -> Condition:
        match condition:
            case Traction(x, y):
                return Traction(*self._vector(_number(x), _number(y), self.stress))
            case Pressure(pressure, shear):
                return Pressure(self.stress * _number(pressure), self.stress * _number(shear))
            case Force(x, y, moment, is_rigid):
                force = self.stress * self.length
                return Force(*self._vector(x, y, force), force * self.length * moment, is_rigid)
            case PrescribedDisplacement(x, y) if x is not None and y is not None:
                return PrescribedDisplacement(*self._vector(_number(x), _number(y), self.length))
            case PrescribedDisplacement(x, y) if self.turn == 0.0:
                scaled = (None if each is None else self.length * _number(each) for each in (x, y))
                return PrescribedDisplacement(*scaled)
            case PrescribedDisplacement():
                raise InputError("one component of a displacement cannot be turned: give both")
            case Contact(obstacle, law):
                return Contact(self._obstacle(obstacle), None if law is None else self._law(law))
        return condition

    def _obstacle(self, obstacle: Obstacle) -> Obstacle:
        match obstacle:
            case RigidHalfPlane(point, (x, y)):
                return RigidHalfPlane(self._point(point), self._vector(x, y, 1.0))
            case RigidCircle(centre, radius):
                return RigidCircle(self._point(centre), self.length * radius)
            case RigidCavity(centre, radius):
                return RigidCavity(self._point(centre), self.length * radius)
            case RigidPolygon(vertices):
                return RigidPolygon(tuple(self._point(vertex) for vertex in vertices))
            case RigidSpline(points, is_closed):
                return RigidSpline(tuple(self._point(point) for point in points), is_closed)
            case Gap(value, None):
                return Gap(self.length * _number(value))
        raise InputError(
            f"obstacle is {type(obstacle).__name__}: give plane, circle, cavity, polygon, spline or plain gap"
        )

    def _force(self, force: BodyForce) -> BodyForce:
        match force:
            case Gravity(density, (x, y)):
                return replace(force, density=self.stress * density, acceleration=self._vector(x, y, 1.0 / self.length))
            case Rotation(density, rate, centre):
                return replace(
                    force,
                    density=self.stress * density,
                    angular_velocity=rate / self.length,
                    centre=self._point(centre),
                )
        return replace(force, temperature=_number(force.temperature))


def _number(field: object) -> float:
    """Return a field that is a number."""
    if not isinstance(field, int | float):
        raise InputError(f"{field!r} is not a number: give one, fields are not turned")
    return float(field)
