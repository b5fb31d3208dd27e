"""One body of a scene in the coordinates of its shape: the input of its mesh and its equations."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from bemkit.arrays import IntArray
from bemkit.contact.laws import FrictionLaw
from bemkit.contact.obstacle import SIMPLE_OBSTACLES, Obstacle
from bemkit.errors import InputError, Mistakes
from bemkit.formulas import choices
from bemkit.geometry.mesh import BoundaryMesh
from bemkit.geometry.meshing.discretise import discretise
from bemkit.geometry.meshing.division import divide
from bemkit.geometry.outline import Outline, Selection
from bemkit.geometry.shapes import Shape
from bemkit.operators.material import Material
from bemkit.scene.conditions import Clamped, Contact, Free, Part, PrescribedDisplacement, RigidConnection, Roller
from bemkit.scene.discretisation import Discretisation, Galerkin, MeshOptions
from bemkit.scene.objects import check_laws

if TYPE_CHECKING:
    from bemkit.geometry.meshing.partition import Partition
    from bemkit.geometry.symmetry.lines import Symmetry
    from bemkit.scene.body_forces import BodyForce
    from bemkit.scene.plane_motion import FarField
    from bemkit.scene.steps import Step
    from bemkit.scene.unit_names import UnitNames


@dataclass(frozen=True, kw_only=True)
class BodyScene:
    """One body of a scene, without the others; see `Scene.scene_of`.

    Parameters
    ----------
    shape : Shape
    material : Material
    parts : tuple of Part
        The parts of the scene, and as free parts the sides that touch other bodies.
    law : FrictionLaw
        On all parts at rigid obstacles that have no law of their own.
    steps : tuple of Step
    n_steps : int
        Number of load steps, increments counted.
    symmetry : Symmetry or None
        Lines that cross the body. Only the elements on the side x <= a, y <= b carry unknowns.
    body_forces : tuple of BodyForce
    far : FarField or None
    discretisation : Discretisation
    mesh : MeshOptions
    units : UnitNames or None
        In results.
    depth : float [m]
        Thickness on which forces in results act, 1 if none is given. Everything here is per unit of thickness.

    Raises
    ------
    InputError
        If a part names an unknown side, a law needs slip or time without steps, body forces act in an exterior, an
        collocation has an accuracy, or a half-plane has an option of other bodies.
    GeometryError
        If the outline of the shape is not a valid boundary.
    """

    shape: Shape
    material: Material
    parts: tuple[Part, ...]
    law: FrictionLaw
    steps: tuple[Step, ...]
    n_steps: int
    symmetry: Symmetry | None
    body_forces: tuple[BodyForce, ...]
    far: FarField | None
    discretisation: Discretisation
    mesh: MeshOptions
    units: UnitNames | None
    depth: float

    def __post_init__(self) -> None:
        outline, mistakes = self.shape.outline(), Mistakes()
        with mistakes.collected():
            check_laws({f"law of part {name!r}": law for name, law in self.laws.items()}, self.steps)
        if self.mesh.accuracy is not None:
            with mistakes.collected():
                self._check_accuracy(self.mesh.accuracy)
        if outline.surface is not None or self.far is not None:
            with mistakes.collected():
                _check_half_plane(outline, self.far, self.discretisation, self.mesh, self.parts)
        with mistakes.collected():
            self._check_rigid_connections(outline)
        if self.units is not None:
            from bemkit.scene.unit_names import check_length_of_file

            with mistakes.collected():
                if outline.drawing is not None:
                    check_length_of_file(outline.drawing.unit, self.units)
                if self.may_touch_profiles:
                    from bemkit.scene.profiles import check_profiles

                    check_profiles(self.obstacles, self.units)
        with mistakes.collected():
            self._check_body_forces(outline)
        for part in self.parts:
            with mistakes.collected():
                _check_sides(part, outline.selectable_names)
        mistakes.raise_all()

    def _check_rigid_connections(self, outline: Outline) -> None:
        rigid = [part.name for part in self.parts if isinstance(part.condition, RigidConnection)]
        if rigid and (outline.surface is not None or self.symmetry is not None):
            where = "a half-plane" if self.symmetry is None else "a symmetric body"
            raise InputError(
                f"part {rigid[0]!r} is a rigid connection, which {where} cannot have: give is_rigid = false"
            )

    def _check_body_forces(self, outline: Outline) -> None:
        if self.body_forces and outline.is_exterior:
            raise InputError(
                f"body_forces is {self.body_forces!r}, but the body has no end: nothing holds its infinite weight, and "
                "heat expands it without bound: remove the body forces, or give a bounded shape"
            )

    def _check_accuracy(self, accuracy: float) -> None:
        if self.mesh.rising_degrees and not isinstance(self.discretisation, Galerkin):
            raise InputError(
                f"mesh.rising_degrees is True: {self.discretisation} has no degree: choose Galerkin elements"
            )
        if not self.discretisation.estimates_error:
            raise InputError(
                f"mesh.accuracy is {accuracy}: {self.discretisation.method} has no error estimate: choose the "
                "discretisation 'quadratic' or 'linear', or give elements"
            )

    def check_among_others(self, name: str) -> None:
        """Raise InputError, with the name of the body, if it has an option that only a single body may have."""
        if isinstance(self.discretisation, Galerkin) and isinstance(self.discretisation.degree, tuple):
            raise InputError(
                f"degree is a list, of body {name!r}: elements have several degrees in scenes of one body only; give "
                "one degree"
            )

    @property
    def contact_parts(self) -> tuple[Part, ...]:
        """The parts that may touch an obstacle."""
        return tuple(part for part in self.parts if isinstance(part.condition, Contact))

    @property
    def obstacles(self) -> dict[str, Obstacle]:
        """The obstacles of these parts, by their names."""
        return {part.name: part.condition.obstacle for part in self.parts if isinstance(part.condition, Contact)}

    @property
    def may_touch_profiles(self) -> bool:
        """Whether an obstacle may be a measured profile; only such scenes load the module of profiles."""
        return not all(isinstance(obstacle, SIMPLE_OBSTACLES) for obstacle in self.obstacles.values())

    @property
    def cannot_turn(self) -> bool:
        """Whether a symmetry, or a part whose displacements are given in x and y, keeps the body from turning."""
        return self.symmetry is not None or any(
            isinstance(part.condition, Clamped)
            or (isinstance(part.condition, PrescribedDisplacement) and all(part.condition.is_prescribed))
            for part in self.parts
        )

    def parts_on(self, mesh: BoundaryMesh) -> list[tuple[Part, IntArray]]:
        """Return the parts with their elements (k,) on a mesh, without parts beyond a symmetry line."""
        return [(part, elements) for part in self.parts if (elements := mesh.part(part.name)).size]

    @property
    def laws(self) -> dict[str, FrictionLaw]:
        """The friction law of each contact part, by name."""
        laws = {part.name: part.condition.law for part in self.parts if isinstance(part.condition, Contact)}
        return {name: self.law if law is None else law for name, law in laws.items()}

    @property
    def selections(self) -> dict[str, Selection]:
        """The pieces of the outline that the parts cover, by name."""
        return {part.name: part.selection for part in self.parts}

    @property
    def takes_graded_layers(self) -> bool:
        """Whether meshes that follow an accuracy are few elements of high degree in geometric layers."""
        degree = self.discretisation.largest_degree if isinstance(self.discretisation, Galerkin) else 0
        return self.n_steps == 1 and self.mesh.accuracy is not None and (self.mesh.rising_degrees or degree > 2)

    def first_partition(self, contact: Collection[str]) -> Partition:
        """Divide the boundary for the first time if an accuracy decides.

        Parameters
        ----------
        contact : collection of str
            Names of the parts that may touch something. They are divided evenly; if the next mesh is made anew in
            layers, this one only locates the transitions.
        """
        outline = self.shape.outline()
        if self.takes_graded_layers and contact:
            from bemkit.geometry.meshing.layers import probing_partition

            base = divide(outline, self.selections)
            base = base if self.symmetry is None else base.half(self.symmetry)
            return probing_partition(base, contact, self.mesh.n_elements)
        from bemkit.geometry.meshing.partition import first_partition

        return first_partition(outline, self.selections, self.mesh.n_elements, even=contact, symmetry=self.symmetry)

    def divided(self, contact: Collection[str], part_density: Mapping[str, float] | None = None) -> BoundaryMesh:
        """Return the mesh by number of elements, or the first mesh for an accuracy; see `first_partition`.

        A number of elements is shared by densities of the sides and, if given, of parts.
        """
        if self.mesh.elements is None:
            return self.first_partition(contact).mesh
        return discretise(
            self.shape.outline(),
            n_elements=self.mesh.elements,
            parts=self.selections,
            grading=self.mesh.grading,
            density=self.mesh.density,
            part_density=part_density,
            symmetry=self.symmetry,
        )


def _check_sides(part: Part, names: tuple[str, ...]) -> None:
    for side in part.sides:
        if side not in names:
            raise InputError(f"part {part.name!r}: unknown side {side!r}: the sides are {choices(side, names)}")


def _check_half_plane(
    outline: Outline, far: FarField | None, discretisation: Discretisation, mesh: MeshOptions, parts: Sequence[Part]
) -> None:
    """Check that a half-plane has no options of other bodies, and another body no far field.

    Raises
    ------
    InputError
        Naming the key, its value and the remedy.
    """
    if outline.surface is None:
        if far is not None:
            raise InputError(
                f"far is {far}, but the body is not a half-plane: hold or load its parts, or give the shape "
                "'half-plane' or 'periodic-half-plane'"
            )
        return
    if discretisation != Galerkin(1) or mesh.rising_degrees:
        raise InputError(
            f"discretisation is {discretisation}, but tractions on a half-plane are constant on each element: choose "
            "the discretisation 'linear', or remove it"
        )
    if outline.surface.is_periodic:
        _check_periodic(far, mesh, parts)


def _check_periodic(far: FarField | None, mesh: MeshOptions, parts: Sequence[Part]) -> None:
    if far is not None and far.strain:
        raise InputError(f"far.strain is {far.strain}: a strained surface does not repeat: remove it")
    if far is not None and (far.turn or far.moment is not None):
        name = "turn" if far.turn else "moment"
        raise InputError(f"far.{name} is {getattr(far, name)}: a periodic half-plane cannot turn: remove it")
    for part in parts:
        if isinstance(part.condition, Clamped | PrescribedDisplacement | Roller):
            raise InputError(
                f"part {part.name!r} holds the surface of a periodic half-plane: hold it far away, or let the part "
                "touch an obstacle"
            )
    if mesh.accuracy is not None:
        raise InputError(
            f"mesh.accuracy is {mesh.accuracy}: the elements of a periodic half-plane are equal: give elements"
        )
    if not any(isinstance(part.condition, Contact | Free) for part in parts):
        raise InputError("no part of the periodic half-plane is in contact: give one an obstacle")
