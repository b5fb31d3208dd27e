"""The bodies of an assembly in their places: meshes, spaces, supports and loads."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from bemkit.arrays import IntArray
from bemkit.geometry.errors import GeometryError
from bemkit.geometry.mesh import BoundaryMesh
from bemkit.geometry.placement import Placement
from bemkit.geometry.spaces import BoundarySpace
from bemkit.model.units import Units, check_position
from bemkit.operators.material import Material
from bemkit.scene.assembly import Assembly
from bemkit.scene.body import Body
from bemkit.scene.scene import Scene
from bemkit.scene.symmetry import check_symmetry


@dataclass(frozen=True, eq=False)
class PlacedBody:
    """A body of an assembly on a mesh.

    Operators are assembled on its own mesh. That of a copy is the mesh of the shape where it was drawn, which all
    copies share; a body that supports or rigid obstacles hold forms its own group, and its own mesh is in place.

    Parameters
    ----------
    body : Body
    scene : Scene
        Its scene as a single body; see `Assembly.scene_of`.
    mesh : BoundaryMesh
        In its place, in physical units.
    own_mesh : BoundaryMesh
    """

    body: Body
    scene: Scene
    mesh: BoundaryMesh
    own_mesh: BoundaryMesh

    def under(self, body: Body, scene: Scene) -> PlacedBody:
        """Return it with other numbers of conditions, on the same mesh and spaces."""
        other = replace(self, body=body, scene=scene)
        other.__dict__.update({name: self.__dict__[name] for name in ("space", "own_space") if name in self.__dict__})
        return other

    def is_loaded_like(self, other: PlacedBody) -> bool:
        """Whether its parts and body forces are the very objects that another one has."""
        own, others = ((*each.body.parts, *each.body.body_forces) for each in (self, other))
        return len(own) == len(others) and all(one is two for one, two in zip(own, others, strict=True))

    @property
    def name(self) -> str:
        """The name of the body."""
        return self.body.name

    @property
    def material(self) -> Material:
        """Its material, in physical units."""
        return self.body.material

    @property
    def turn(self) -> Placement:
        """The motion from the own mesh to the mesh in place."""
        return Placement() if self.own_mesh is self.mesh else self.body.placement

    @cached_property
    def space(self) -> BoundarySpace:
        """The space of the displacements on the mesh in place."""
        return self.scene.discretisation.displacement_space(self.mesh)

    @cached_property
    def own_space(self) -> BoundarySpace:
        """The space of the displacements on the dimensionless own mesh; its nodes have the same numbers."""
        return self.scene.discretisation.displacement_space(self.own_mesh.unit)

    @cached_property
    def space_in_place(self) -> BoundarySpace:
        """The space of the displacements on the dimensionless mesh in place."""
        is_own = self.own_mesh is self.mesh
        return self.own_space if is_own else self.scene.discretisation.displacement_space(self.mesh.unit)

    def units(self, modulus: float, force: float, mesh: BoundaryMesh | None = None) -> Units:
        """Return its units, in which forces and displacements are those of all bodies of the assembly.

        Parameters
        ----------
        modulus : float [Pa]
        force : float [N/m]
        mesh : BoundaryMesh, optional
            The mesh in place; the own one by default.
        """
        mesh = self.own_mesh if mesh is None else mesh
        return Units(mesh.centre, mesh.diameter, modulus, force / mesh.diameter)


def place(assembly: Assembly, meshes: Mapping[str, BoundaryMesh] | None = None) -> tuple[PlacedBody, ...]:
    """Divide the bodies of an assembly and put them in their places.

    Parameters
    ----------
    assembly : Assembly
    meshes : mapping of str to BoundaryMesh, optional
        Meshes of bodies by name, in the coordinates of their shapes; by default what the assembly describes.

    Raises
    ------
    GeometryError
        If a body cannot be divided.
    TooFarError
        If a body lies more than 1e7 diameters from the origin.
    """
    divided: dict[int, BoundaryMesh] = {}
    placed = []
    for body in assembly.placed_bodies:
        scene = assembly.scene_of(body)
        if meshes is not None and body.name in meshes:
            drawn = meshes[body.name]
        else:
            drawn = divided.setdefault(id(scene), divided.get(id(scene)) or _divided(scene, assembly, body))
        if scene.symmetry is not None:
            check_symmetry(scene, drawn)
        mesh = body.placement.mesh(drawn)
        check_position(drawn, f"body {body.name!r}, where it is drawn,")
        check_position(mesh, f"body {body.name!r}")
        placed.append(PlacedBody(body, scene, mesh, mesh if body.is_held else drawn))
    return tuple(placed)


def _divided(scene: Scene, assembly: Assembly, body: Body) -> BoundaryMesh:
    even = [*(part.name for part in scene.contact_parts), *assembly.contact_parts(body)]
    try:
        return scene.divided(even)
    except GeometryError as error:
        raise type(error)(f"body {body.name!r}: {error}") from error


def groups(bodies: Sequence[PlacedBody]) -> list[IntArray]:
    """Return the numbers of the bodies that share an own mesh, in the order of the first of each."""
    found: dict[int, list[int]] = {}
    for number, body in enumerate(bodies):
        found.setdefault(id(body.own_mesh), []).append(number)
    return [np.array(numbers) for numbers in found.values()]
