"""The bodies of a scene in their places, with their meshes and spaces."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from bemkit.arrays import IntArray
from bemkit.errors import GeometryError, InputError
from bemkit.geometry.mesh import BoundaryMesh
from bemkit.geometry.placement import Placement
from bemkit.geometry.spaces import BoundarySpace
from bemkit.model.units import Units, check_position
from bemkit.operators.material import Material
from bemkit.scene.body import Body
from bemkit.scene.body_scene import BodyScene
from bemkit.scene.scene import Scene

Meshes: TypeAlias = BoundaryMesh | Mapping[str, BoundaryMesh] | None
"""Meshes of bodies by name, or the mesh of the only body; None for those that the scene describes."""


@dataclass(frozen=True, eq=False)
class PlacedBody:
    """A body of a scene on a mesh.

    Operators are assembled on its own mesh. That of a copy is the mesh of the shape where it was drawn, which all
    copies share; a body that supports or rigid obstacles hold has no copies, and its own mesh is the one in place.

    Parameters
    ----------
    body : Body
    scene : BodyScene
        The scene of this body without the others; see `Scene.scene_of`.
    mesh : BoundaryMesh
        In its place, in physical units.
    own_mesh : BoundaryMesh
    space : BoundarySpace
        Of the displacements, on the mesh in place.
    own_space, space_in_place : BoundarySpace
        The same on the dimensionless own mesh, and on the dimensionless mesh in place; nodes have the same numbers.
    """

    body: Body
    scene: BodyScene
    mesh: BoundaryMesh
    own_mesh: BoundaryMesh
    space: BoundarySpace
    own_space: BoundarySpace
    space_in_place: BoundarySpace

    @classmethod
    def on(cls, body: Body, scene: BodyScene, mesh: BoundaryMesh, own_mesh: BoundaryMesh) -> PlacedBody:
        """Return a body on its meshes, with the spaces of its discretisation."""
        space_on = scene.discretisation.displacement_space
        own_space = space_on(own_mesh.unit)
        in_place = own_space if own_mesh is mesh else space_on(mesh.unit)
        return cls(body, scene, mesh, own_mesh, space_on(mesh), own_space, in_place)

    def is_loaded_like(self, other: PlacedBody) -> bool:
        """Whether another body has the identical parts and body forces, and the same motion far away."""
        own, others = ((*each.body.parts, *each.body.body_forces) for each in (self, other))
        is_alike = len(own) == len(others) and all(one is two for one, two in zip(own, others, strict=True))
        return is_alike and (self.scene.far, self.scene.depth) == (other.scene.far, other.scene.depth)

    @property
    def name(self) -> str:
        """The name of the body; empty of the only body of a scene."""
        return self.body.name

    @property
    def title(self) -> str:
        """Name of the body in messages."""
        return f"body {self.name!r}" if self.name else "the body"

    @property
    def material(self) -> Material:
        """Its material, in physical units."""
        return self.body.material

    @property
    def turn(self) -> Placement:
        """The motion from the own mesh to the mesh in place."""
        return Placement() if self.own_mesh is self.mesh else self.body.placement

    @property
    def traction_space(self) -> BoundarySpace:
        """The space of the tractions on the mesh in place."""
        return self.scene.discretisation.traction_space(self.mesh)

    def units(self, modulus: float, force: float, mesh: BoundaryMesh | None = None) -> Units:
        """Return its units, in which forces and displacements are those of all bodies of the scene.

        Parameters
        ----------
        modulus : float [Pa]
        force : float [N/m]
        mesh : BoundaryMesh, optional
            The mesh in place; the own one by default.
        """
        mesh = self.own_mesh if mesh is None else mesh
        return Units(mesh.centre, mesh.diameter, modulus, force / mesh.diameter)


def place(scene: Scene, meshes: Meshes = None) -> tuple[PlacedBody, ...]:
    """Divide the bodies of a scene and put them in their places.

    Parameters
    ----------
    scene : Scene
    meshes : BoundaryMesh or mapping of str to BoundaryMesh, optional
        Meshes of bodies by name, in the coordinates of their shapes, or that of the only body; by default what the
        scene describes.

    Raises
    ------
    GeometryError
        If a body cannot be divided.
    TooFarError
        If a body lies more than 1e7 diameters from the origin.
    """
    given = _by_name(scene.placed_bodies, meshes)
    drawn_meshes = _drawn(scene, given)
    placed = []
    for body in scene.placed_bodies:
        own_scene, drawn = scene.scene_of(body), drawn_meshes[body.name]
        check_body_symmetry(own_scene, drawn)
        mesh = body.placement.mesh(drawn)
        where = f"body {body.name!r}" if body.name else "the body"
        check_position(drawn, f"{where}, where it is drawn," if body.name else where)
        check_position(mesh, where)
        placed.append(PlacedBody.on(body, own_scene, mesh, mesh if body.is_held else drawn))
    return tuple(placed)


def _by_name(bodies: Sequence[Body], meshes: Meshes) -> Mapping[str, BoundaryMesh]:
    if not isinstance(meshes, BoundaryMesh):
        meshes = meshes or {}
        if unknown := sorted(set(meshes) - {body.name for body in bodies}):
            raise InputError(f"mesh names {unknown[0]!r}: the bodies are {', '.join(repr(b.name) for b in bodies)}")
        return meshes
    if len(bodies) > 1:
        raise InputError(f"mesh is given for {len(bodies)} bodies: give a mesh for each by its name")
    return {bodies[0].name: meshes}


def check_body_symmetry(scene: BodyScene, mesh: BoundaryMesh) -> None:
    """Raise GeometryError unless a scene of one body is symmetric about the lines that it names, like its mesh."""
    if scene.symmetry is not None or mesh.symmetry is not None:
        from bemkit.scene.symmetry import check_symmetry

        check_symmetry(scene, mesh)


def _drawn(scene: Scene, given: Mapping[str, BoundaryMesh]) -> dict[str, BoundaryMesh]:
    """Return the meshes of all bodies by name, where they are drawn; bodies that share a scene share one."""
    divided = [body for body in scene.placed_bodies if body.name not in given]
    own_scenes = {body.name: scene.scene_of(body) for body in scene.placed_bodies}
    by_scene: dict[int, BoundaryMesh] = {}
    for body in divided:
        own_scene = own_scenes[body.name]
        if id(own_scene) not in by_scene:
            by_scene[id(own_scene)] = _divided(own_scene, scene, body)
    meshes = {**given, **{body.name: by_scene[id(own_scenes[body.name])] for body in divided}}
    held = {name for name, own_scene in own_scenes.items() if own_scene.cannot_turn}
    pairs = [
        pair
        for pair in scene.elastic_contacts
        if not scene.law_of(pair).is_frictionless or held.issuperset(name for name, _ in pair.elastic_parts)
    ]
    if not pairs:
        return meshes
    from bemkit.model.matched_sides import matching_densities

    densities = matching_densities(pairs, own_scenes, meshes)
    matched: dict[int, BoundaryMesh] = {}
    for body in divided:
        own_scene = own_scenes[body.name]
        if body.name in densities and id(own_scene) not in matched:
            matched[id(own_scene)] = _divided(own_scene, scene, body, densities[body.name])
    return meshes | {b.name: matched[id(own)] for b in divided if id(own := own_scenes[b.name]) in matched}


def _divided(
    own_scene: BodyScene, scene: Scene, body: Body, part_density: Mapping[str, float] | None = None
) -> BoundaryMesh:
    even = [*(part.name for part in own_scene.contact_parts), *scene.touching_parts(body)]
    try:
        return own_scene.divided(even, part_density)
    except GeometryError as error:
        if not body.name:
            raise
        raise type(error)(f"body {body.name!r}: {error}") from error


def shape_numbers(bodies: Sequence[PlacedBody]) -> list[int]:
    """Return for each body which of the different own meshes it has, in the order of `groups`."""
    number_of: dict[int, int] = {}
    return [number_of.setdefault(id(body.own_mesh), len(number_of)) for body in bodies]


def groups(bodies: Sequence[PlacedBody]) -> list[IntArray]:
    """Return the numbers of the bodies that share an own mesh, in the order of the first of each."""
    found: dict[int, list[int]] = {}
    for number, body in enumerate(bodies):
        found.setdefault(id(body.own_mesh), []).append(number)
    return [np.array(numbers) for numbers in found.values()]
