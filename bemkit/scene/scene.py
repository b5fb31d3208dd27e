"""A scene: the body, its boundary parts, loads, obstacles, the friction law, mesh and solver.

Everything here is a frozen value. A scene can be written in Python or as a TOML file (`bemkit.scene.toml`), and either
form can be turned into the other. All quantities are in one consistent set of units, for example m, N and Pa.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from bemkit.arrays import FloatArray, IntArray
from bemkit.contact.further_laws import PiecewiseLaw
from bemkit.contact.laws import FrictionLaw, Frictionless
from bemkit.contact.problem import LawError
from bemkit.errors import InputError
from bemkit.formulas import choices
from bemkit.geometry.mesh import BoundaryMesh
from bemkit.geometry.meshing.discretise import discretise
from bemkit.geometry.meshing.division import divide
from bemkit.geometry.outline import Outline, Selection
from bemkit.geometry.placement import Placement
from bemkit.geometry.shapes import Shape
from bemkit.geometry.symmetry import Symmetry
from bemkit.operators.linear.solvers import Automatic, LinearSolverChoice
from bemkit.operators.material import Material
from bemkit.scene.body_forces import BodyForce
from bemkit.scene.conditions import Clamped, Contact, Part, PrescribedDisplacement, Roller
from bemkit.scene.discretisation import Discretisation, Galerkin
from bemkit.scene.mesh_options import MeshOptions
from bemkit.scene.plane_motion import FarField
from bemkit.scene.steps import Stated, Step, check_laws, check_names
from bemkit.scene.unit_names import UnitNames, check_length_of_file
from bemkit.solvers.base import ContactSolver
from bemkit.solvers.fallbacks import Fallbacks

if TYPE_CHECKING:
    from bemkit.geometry.meshing.partition import Partition
    from bemkit.scene.body import Body


class NoContactError(InputError):
    """Something that needs contact was asked of a scene without contact parts."""


@dataclass(frozen=True, kw_only=True)
class Scene(Stated):
    """One body with its supports, loads and contacts: everything that determines the solution.

    Boundary that belongs to no part is free of traction. Without contact this is a problem of elasticity.

    Parameters
    ----------
    title : str
    shape : Shape
    material : Material
    parts : tuple of Part
        They must not overlap (checked when the boundary is divided).
    law : FrictionLaw
        On all contact parts that have no law of their own.
    load_factors : tuple of float
        A short form of load history: all tractions, pressures, prescribed displacements and body forces times these
        numbers, at the times 1, 2, 3 and so on.
    steps : tuple of Step
        The load history: what changes from step to step. Without one, or with a single step, slip counts from the
        undeformed body (the static law); with several, from the end of the step before (the incremental law).
    symmetry : Symmetry, optional
        Lines about which the scene, which describes the whole body, is symmetric. Only the elements on the side
        x <= a, y <= b carry unknowns, the others are their images; results are those of that side.
    body_forces : tuple of BodyForce
        Gravity, rotation, heating.
    far : FarField, optional
        Motion or load of a half-plane far away from its surface. By default it is at rest there.
    discretisation : Discretisation
    linear_solver : LinearSolver or Automatic
        How the displacements of the body away from the contact boundary are solved for.
    mesh : MeshOptions
    solver : ContactSolver
    units : UnitNames, optional
        Names of the units that everything is stated in; they label results.
    description, reference : str
        For the reader: what the scene shows and where it comes from.

    Raises
    ------
    ValueError
        If the title is empty, two parts share a name, a part names an unknown side, a load factor is missing or not
        finite, times do not increase, a law needs slip or time without steps, body forces act in an exterior, an
        accuracy is asked of collocation, or a law with friction or a solver is given without any contact.
    GeometryError
        If the outline of the shape is not a valid boundary.
    """

    title: str
    shape: Shape
    material: Material
    parts: tuple[Part, ...]
    law: FrictionLaw = field(default_factory=Frictionless)
    load_factors: tuple[float, ...] = (1.0,)
    steps: tuple[Step, ...] = ()
    symmetry: Symmetry | None = None
    body_forces: tuple[BodyForce, ...] = ()
    far: FarField | None = None
    discretisation: Discretisation = field(default_factory=lambda: Galerkin(1))
    linear_solver: LinearSolverChoice = field(default_factory=Automatic)
    mesh: MeshOptions = field(default_factory=MeshOptions)
    solver: ContactSolver = field(default_factory=Fallbacks)
    units: UnitNames | None = None
    description: str = ""
    reference: str = ""

    def __post_init__(self) -> None:
        super().__post_init__()
        check_names("parts", (part.name for part in self.parts), "parts")
        if not self.contact_parts:
            self._check_without_contact()
        check_laws({f"law of part {name!r}": law for name, law in self.laws.items()}, self.steps)
        if self.mesh.accuracy is not None:
            self._check_accuracy(self.mesh.accuracy)
        outline = self.shape.outline()
        if outline.surface is not None or self.far is not None:
            _check_half_plane(outline, self.far, self.discretisation, self.mesh, self.parts)
        if self.units is not None and outline.drawing is not None:
            check_length_of_file(outline.drawing.unit, self.units)
        if self.body_forces and outline.is_exterior:
            raise InputError(
                f"body_forces is {self.body_forces!r}, but the body has no end: nothing holds its infinite weight, and "
                "heat expands it without bound: remove the body forces, or give a bounded shape"
            )
        names = outline.selectable_names
        for part in self.parts:
            for side in part.sides:
                if side not in names:
                    raise InputError(f"part {part.name!r}: unknown side {side!r}: the sides are {choices(side, names)}")
        object.__setattr__(self, "parts", tuple(part.on(outline, Placement()) for part in self.parts))

    def _check_without_contact(self) -> None:
        for name, default in (("law", Frictionless()), ("solver", Fallbacks())):
            if getattr(self, name) != default:
                raise InputError(
                    f"{name} is {getattr(self, name)!r}, but no part is in contact: remove the {name}, or give one "
                    "part the condition 'contact' with an obstacle"
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

    @cached_property
    def placed_bodies(self) -> tuple[Body, ...]:
        """The only body, which has no name."""
        from bemkit.scene.body import Body

        body = Body(name="", shape=self.shape, material=self.material, parts=self.parts, body_forces=self.body_forces)
        return (body,)

    def scene_of(self, body: Body) -> Scene:
        """Return the scene itself."""
        return self

    @property
    def contact_parts(self) -> tuple[Part, ...]:
        """The parts that may touch an obstacle."""
        return tuple(part for part in self.parts if isinstance(part.condition, Contact))

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

    def law_at(self, parts: Sequence[str], points: FloatArray) -> FrictionLaw:
        """Return the friction law of given contact nodes, every coefficient in numbers.

        Parameters
        ----------
        parts : sequence of n_contact str
            The contact part that each node belongs to.
        points : (n_contact, 2) array [m]

        Raises
        ------
        LawError
            If a coefficient is not finite or negative somewhere; the message names the part.
        """
        laws: list[FrictionLaw] = []
        nodes: list[IntArray] = []
        for name, law in self.laws.items():
            part_nodes = np.flatnonzero(np.array([part == name for part in parts], bool))
            try:
                laws.append(law.at(points[part_nodes]))
            except ValueError as error:
                raise LawError(f"part {name!r}: friction law: {error}") from error
            nodes.append(part_nodes)
        if not laws:  # a scene without contact
            return self.law
        if len(laws) == 1 or all(law is laws[0] for law in laws):
            return laws[0]
        return PiecewiseLaw(laws, nodes)

    @property
    def takes_layers(self) -> bool:
        """Whether meshes that follow an accuracy are few elements of high degree in geometric layers."""
        degree = self.discretisation.largest_degree if isinstance(self.discretisation, Galerkin) else 0
        return self.n_steps == 1 and self.mesh.accuracy is not None and (self.mesh.rising_degrees or degree > 2)

    def first_partition(self, contact: Collection[str]) -> Partition:
        """Divide the boundary for the first time if an accuracy decides.

        Parameters
        ----------
        contact : collection of str
            Names of the parts that may touch something. They are divided evenly; where the next mesh is made anew in
            layers, this one only looks for places where their status changes.
        """
        outline = self.shape.outline()
        if self.takes_layers and contact:
            from bemkit.geometry.meshing.layers import looking_partition

            base = divide(outline, self.selections)
            base = base if self.symmetry is None else base.half(self.symmetry)
            return looking_partition(base, contact, self.mesh.n_elements)
        from bemkit.geometry.meshing.partition import first_partition

        return first_partition(outline, self.selections, self.mesh.n_elements, even=contact, symmetry=self.symmetry)

    def divided(self, contact: Collection[str]) -> BoundaryMesh:
        """Return the mesh by number of elements, or the first mesh for an accuracy; see `first_partition`."""
        if self.mesh.elements is None:
            return self.first_partition(contact).mesh
        return discretise(
            self.shape.outline(),
            n_elements=self.mesh.elements,
            parts=self.selections,
            grading=self.mesh.grading,
            density=self.mesh.density,
            symmetry=self.symmetry,
        )

    def build_mesh(self) -> BoundaryMesh:
        """Divide the boundary into elements, with one mesh part for each part of the scene.

        Raises
        ------
        GeometryError
            If parts overlap or are empty, or there are too few elements, or the scene lacks its symmetry.
        """
        mesh = self.divided([part.name for part in self.contact_parts])
        if self.symmetry is not None:
            from bemkit.scene.symmetry import check_symmetry

            check_symmetry(self, mesh)
        return mesh


def _check_half_plane(
    outline: Outline, far: FarField | None, discretisation: Discretisation, mesh: MeshOptions, parts: Sequence[Part]
) -> None:
    """Check that a half-plane has nothing that only other bodies have, and another body no far field.

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
    if not any(isinstance(part.condition, Contact) for part in parts):
        raise InputError("no part of the periodic half-plane is in contact: give one an obstacle")
