"""What random assemblies are made of: bodies, materials, meshes, weight, supports, loads, laws, gaps between them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

from bemkit.contact.further_laws import CohesiveCoulomb
from bemkit.contact.laws import Coulomb, FrictionLaw, Frictionless, Tresca
from bemkit.contact.obstacle import RigidHalfPlane
from bemkit.geometry.meshing.discretise import Algebraic, Uniform
from bemkit.geometry.placement import Placement
from bemkit.geometry.shapes import Shape
from bemkit.operators.material import Material, Plane
from bemkit.scene.body import Body
from bemkit.scene.body_forces import BodyForce, Gravity, Heating, Rotation
from bemkit.scene.conditions import Clamped, Contact, Part, PrescribedDisplacement, Pressure, Roller, Traction
from bemkit.scene.contacts import ContactPair, Touching
from bemkit.scene.copies import Copies
from bemkit.scene.discretisation import ConstantCollocation, Discretisation, Galerkin, MeshOptions
from checks.random_scenes.draw import Draw

_RATIOS = (0.0, 0.2, 0.3, 0.3, 0.3, 0.4, 0.49, 0.4999, 0.5)


@dataclass(frozen=True)
class Layout:
    """Bodies in their places, and what touches what."""

    bodies: tuple[Body, ...]
    contacts: tuple[ContactPair, ...] = field(default_factory=tuple)
    touching: Touching | None = None


def base(draw: Draw, side: str) -> tuple[Part, ...]:
    """Draw what holds a body from below: now and then nothing."""
    weights = {"clamped": 6.0, "given": 1.0, "rollers": 0.4, "obstacle": 0.7, "none": 0.2}
    match draw.one_by_weight(weights):
        case "clamped":
            return (Part("base", Clamped(), (side,)),)
        case "given":
            return (Part("base", PrescribedDisplacement(0.0, draw.between(-1e-4, 1e-4)), (side,)),)
        case "rollers":
            return (Part("base", Roller(), (side,)),)
        case "obstacle":
            return (Part("base", Contact(RigidHalfPlane((0.0, 0.0))), (side,)),)
    return ()


@dataclass(frozen=True)
class Members:
    """Draws what bodies of unit size and stiffness consist of.

    Parameters
    ----------
    draw : Draw
    stress : float
        Of loads, over the modulus.
    weight : float
        Of all bodies, over the modulus and their size; zero for none.
    has_mixed_materials, has_mixed_spaces : bool
    """

    draw: Draw
    stress: float
    weight: float
    has_mixed_materials: bool
    has_mixed_spaces: bool

    @classmethod
    def drawn(cls, draw: Draw) -> Members:
        """Draw the sizes that all bodies share."""
        stress = draw.decades(-7.0, -2.0)
        weight = stress * draw.decades(-2.0, 0.5) if draw.chance(0.5) else 0.0
        return cls(draw, stress, weight, draw.chance(0.4), draw.chance(0.3))

    def body(
        self,
        name: str,
        shape: Shape,
        parts: tuple[Part, ...] = (),
        placement: Placement = Placement(),  # noqa: B008  # frozen
        copies: Copies | None = None,
        is_heavy: bool = False,
    ) -> Body:
        """Return a body of a random material on a random mesh."""
        forces: list[BodyForce] = []
        if (self.weight or is_heavy) and not shape.outline().is_exterior:
            forces.append(Gravity(self.weight or self.stress, (0.0, -1.0)))
        if self.draw.chance(0.05) and not shape.outline().is_exterior:
            kinds: tuple[BodyForce, ...] = (Heating(self.stress, 1.0), Rotation(self.stress, 1.0, (0.0, 0.0)))
            forces.append(self.draw.one_of(kinds))
        return Body(
            name=name,
            shape=shape,
            material=self._material(),
            parts=parts,
            body_forces=tuple(forces),
            placement=placement,
            copies=copies,
            discretisation=self._discretisation() if self.has_mixed_spaces else None,
            mesh=self._mesh(sum(len(loop) for loop in shape.outline().loops)),
        )

    def _material(self) -> Material:
        draw = self.draw
        modulus = draw.decades(-3.0, 3.0) if self.has_mixed_materials and draw.chance(0.5) else 1.0
        plane = Plane.STRESS if draw.chance(0.1) else Plane.STRAIN
        return Material(modulus, draw.one_of(_RATIOS) if draw.chance(0.7) else 0.3, plane)

    def _discretisation(self) -> Discretisation:
        draw = self.draw
        weights: dict[Discretisation, float] = {
            Galerkin(1): 2.0,
            Galerkin(2): 2.0,
            Galerkin(int(draw.integers(3, 6))): 1.0,
            ConstantCollocation(): 1.0,
        }
        return draw.one_by_weight(weights)

    def discretisation(self) -> Discretisation:
        """Draw the discretisation of bodies that have none of their own."""
        return self._discretisation()

    def _mesh(self, least: int) -> MeshOptions:
        low, high = self.draw.one_by_weight({(4, 12): 0.15, (12, 40): 0.75, (40, 70): 0.1})
        grading = Uniform() if self.draw.chance(0.7) else Algebraic(self.draw.between(1.2, 2.5))
        return MeshOptions(max(least, int(self.draw.integers(low, high + 1))), grading)

    def loads(self, pressed: Sequence[str], pushed: Sequence[str]) -> tuple[Part, ...]:
        """Press sides downwards, push others, each with some tangential load."""
        draw, parts = self.draw, []
        for side in pressed:
            shear = draw.one_of((0.0, 0.0, 0.0, draw.between(-0.3, 0.3)))
            condition = Traction(shear * self.stress, -self.stress)
            parts.append(Part(f"press {side}", condition, (side,)))
        for side in pushed:
            parts.append(Part(f"push {side}", Pressure(draw.between(0.0, 1.0) * self.stress), (side,)))
        return tuple(parts)

    def gap(self) -> tuple[float, float]:
        """Draw a distance and an overlap of bodies as drawn; one of them is zero."""
        draw = self.draw
        match draw.one_by_weight({"flush": 5.0, "gap": 2.0, "overlap": 2.0}):
            case "gap":
                return draw.decades(-9.0, -2.0), 0.0
            case "overlap":
                return 0.0, draw.decades(-6.0, -2.0)
        return 0.0, 0.0

    def law(self) -> FrictionLaw:
        """Draw a friction law."""
        draw = self.draw
        coefficient = draw.one_of((0.0, 0.1, 0.3, 0.5, 1.0, 3.0))
        stress = self.stress * draw.decades(-2.0, 1.0)
        match draw.one_by_weight({"coulomb": 5.0, "frictionless": 3.0, "tresca": 1.0, "cohesive": 1.0}):
            case "coulomb":
                return Coulomb(coefficient)
            case "tresca":
                return Tresca(stress)
            case "cohesive":
                return CohesiveCoulomb(coefficient, cohesion=stress)
        return Frictionless()

    def pair(self, one: str, two: str, interference: float, gap: float | None = None) -> ContactPair:
        """Return a contact; now and then the interference is forgotten, or the multipliers are put on a side."""
        draw = self.draw
        pair = ContactPair(draw.one_of(((one, two), (two, one))), self.law() if draw.chance(0.2) else None)
        given = 0.0 if draw.chance(0.1) else interference * draw.one_of((1.001, 2.0))
        pair = replace(pair, interference=given)
        if gap is not None:
            pair = replace(pair, gap=gap)
        elif draw.chance(0.1):
            pair = replace(pair, gap=draw.one_of((-1.0, 1.0)) * self.stress * draw.decades(-1.0, 1.0))
        return replace(pair, multipliers_on=draw.one_of((one, two))) if draw.chance(0.25) else pair
