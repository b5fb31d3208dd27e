"""The bodies of a scene in their places, with meshes and spaces, and the same bodies under further scenes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import zip_longest
from typing import TYPE_CHECKING, TypeAlias

import numpy as np

from bemkit.arrays import IntArray
from bemkit.errors import GeometryError, InputError
from bemkit.geometry.mesh import BoundaryMesh
from bemkit.geometry.placement import Placement
from bemkit.geometry.spaces import BoundarySpace
from bemkit.model.given import check_same_body
from bemkit.model.units import Units, check_position, largest_sizes
from bemkit.operators.material import Material
from bemkit.scene.body import Body
from bemkit.scene.body_scene import BodyScene
from bemkit.scene.scene import Scene

if TYPE_CHECKING:
    from bemkit.scene.contacts import ContactPair
    from bemkit.scene.plane_motion import RigidBody

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
    if not scene.elastic_contacts:
        return meshes
    from bemkit.model.matched_sides import matching_densities

    densities = matching_densities(scene, own_scenes, meshes)
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


def with_found_contacts(scene: Scene, found: Sequence[ContactPair]) -> Scene:
    """Return a scene that lists the contacts that were found between touching bodies, under its own law for them."""
    if scene.touching is None:
        return scene
    pairs = (replace(pair, law=scene.touching.law, reach=scene.touching.reach) for pair in found)
    return scene.with_contacts((*scene.contacts, *pairs))


def find_units(scenes: Sequence[Scene], bodies: Sequence[PlacedBody]) -> Units:
    """Choose units by the largest load of some scenes, the size of the largest body and the most compliant contact.

    Raises
    ------
    OutOfRangeError
        If results in these units could overflow or vanish.
    """
    return max((_units_of(scene, bodies_under(scene, bodies)) for scene in scenes), key=lambda units: units.stress)


def _units_of(scene: Scene, bodies: Sequence[PlacedBody]) -> Units:
    numbers = {body.name: body for body in bodies}
    length = max(body.mesh.diameter for body in bodies)
    moduli = [
        1.0 / sum(1.0 / numbers[body].material.plane_modulus for body, _ in pair.elastic_parts)
        for pair in scene.contacts
    ]
    modulus = min(moduli, default=max(body.material.plane_modulus for body in bodies))
    sizes = [largest_sizes(body.scene, body.mesh, length) for body in bodies]
    motions = [motion for _, motion, _ in sizes]
    for pair in scene.contacts:
        body, part = pair.elastic_parts[0]
        mesh = numbers[body].mesh
        motions.append(max(-float(pair.gap_at(mesh.centres[mesh.part(part)]).min(initial=0.0)), pair.interference))
    motions += [float(np.abs(body.motion / [1.0, 1.0, 1.0 / length]).max()) for body in scene.rigid]
    loads = [load for load, _, _ in sizes]
    loads += [float(np.abs(scene.load_on(body) / [length, length, length**2]).max()) for body in scene.rigid]
    stress = max(*loads, max(motions) / length * modulus)
    stress = stress or max(gap for _, _, gap in sizes) / length * modulus or modulus
    units = Units(np.mean([body.mesh.centre for body in bodies], axis=0), length, modulus, stress)
    units.check_range()
    return units


def bodies_under(scene: Scene, bodies: Sequence[PlacedBody]) -> tuple[PlacedBody, ...]:
    """Return placed bodies under the conditions of another scene; InputError if it has other bodies."""
    names, others = ([body.name for body in some] for some in (bodies, scene.placed_bodies))
    if names != others:
        raise InputError(
            f"the bodies are {_first_of(others)}, and those of the step before {_first_of(names)}: change numbers of "
            "conditions and contacts only"
        )
    under, checked = [], set()
    for placed, body in zip(bodies, scene.placed_bodies, strict=True):
        own_scene = scene.scene_of(body)
        if own_scene is not placed.scene and (pair := (id(placed.scene), id(own_scene))) not in checked:
            check_same_body(placed.scene, own_scene, placed.body.parts, body.parts, body.name)
            check_body_symmetry(own_scene, placed.mesh)
            checked.add(pair)
        spaces = placed.mesh, placed.own_mesh, placed.space, placed.own_space, placed.space_in_place
        under.append(PlacedBody(body, own_scene, *spaces))
    return tuple(under)


def check_step(first: Scene, other: Scene) -> None:
    """Check that a load step has the thickness and the rigid bodies of the first one."""
    if first.thickness != other.thickness:
        raise InputError(f"thickness is {other.thickness} in a load step and {first.thickness} in the first: keep it")
    for body, changed in zip_longest(first.rigid, other.rigid):
        if body is None or changed is None or _layout(body) != _layout(changed):
            raise InputError(
                f"rigid body {(body or changed).name!r} changes its shape, its position or its given motions and "
                "loads: change numbers only, or run the scene on its own"
            )


def _layout(body: RigidBody) -> tuple[object, ...]:
    return body.name, body.obstacle, body.centre, body.is_load_controlled.tolist()


def _first_of(names: Sequence[str]) -> str:
    return ", ".join(repr(name) for name in names[:6]) + (", ..." if len(names) > 6 else "")
