"""Sequences of meshes of one body or of several: the levels, and the protocol of their rules."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple, Protocol

import numpy as np

from bemkit.arrays import FloatArray, IntArray
from bemkit.geometry.mesh import BoundaryMesh
from bemkit.geometry.meshing.partition import Partition
from bemkit.geometry.spaces import LARGEST_DEGREE
from bemkit.results.solution import Solution
from bemkit.results.solved_body import SolvedBody
from bemkit.results.zone_ends import ZoneEnd
from bemkit.scene.body_scene import BodyScene
from bemkit.scene.discretisation import Discretisation, Galerkin
from bemkit.scene.scene import Scene


class Member(NamedTuple):
    """Results on a partition, of one body or of several copies of it.

    Zones of one status end at `ends`, and sides of other bodies at `facing_ends`; the direction of slip changes at
    `reversals` without a resolved stick zone.
    """

    partition: Partition
    bodies: tuple[SolvedBody, ...]
    contact_elements: IntArray
    ends: tuple[ZoneEnd, ...]
    facing_ends: tuple[ZoneEnd, ...] = ()
    reversals: tuple[ZoneEnd, ...] = ()


@dataclass(frozen=True, eq=False)
class Level:
    """The next level to solve.

    Parameters
    ----------
    asked : Scene
    partitions : tuple of Partition
        How bodies are divided; copies have one in common.
    keys : mapping of str to int
        The number of the partition of each body, by its name; a single body has none.
    touching : tuple of tuple of str
        The parts of each partition that are in contact.
    is_layered : bool
        Whether further meshes are few elements of high degree in layers.
    degree : int
        Of the elements on layered meshes if degrees rise; 2 on the first mesh, which only looks for the places where
        the contact status changes.
    degrees : tuple of int
        Of each element of a single body, where they are lower than `degree`.
    """

    asked: Scene
    partitions: tuple[Partition, ...]
    keys: Mapping[str, int]
    touching: tuple[tuple[str, ...], ...]
    is_layered: bool = False
    degree: int = 2
    degrees: tuple[int, ...] = ()

    @classmethod
    def first(cls, asked: Scene) -> Level:
        """Divide outlines without a known solution."""
        keys, scenes, touching = _divided_bodies(asked)
        partitions = tuple(scene.first_partition(parts) for scene, parts in zip(scenes, touching, strict=True))
        return cls(asked, partitions, keys, touching, all(scene.takes_graded_layers for scene in scenes))

    @property
    def partition(self) -> Partition:
        """How a single body is divided."""
        (partition,) = self.partitions
        return partition

    @cached_property
    def scene(self) -> Scene:
        """The scene with the discretisations of this level."""
        if not self.is_layered:
            return self.asked
        scene = replace(self.asked, discretisation=self._discretisation(self.asked.discretisation))
        pairs = ((body, body.discretisation) for body in scene.bodies)
        bodies = (body if d is None else replace(body, discretisation=self._discretisation(d)) for body, d in pairs)
        return replace(scene, bodies=tuple(bodies))

    def _discretisation(self, scene: Discretisation) -> Discretisation:
        return Galerkin(self.degrees) if self.degrees else self.with_degree(scene, self.degree)

    def with_degree(self, scene: Discretisation, degree: int) -> Discretisation:
        """Return the discretisation of layered meshes of a degree; the one stated unless degrees rise."""
        if self.asked.mesh.rising_degrees:
            return Galerkin(min(degree, LARGEST_DEGREE))
        return Galerkin(2) if degree == 2 else scene

    def with_sides_of(self, solution: Solution) -> Level:
        """Return the level with multipliers on the sides that had them in a solution.

        Errors of successive meshes are then of one sequence.
        """
        return replace(self, asked=with_sides_of(self.asked, solution))

    @property
    def n_elements(self) -> int:
        """Number of elements of all bodies."""
        return sum(len(self.partitions[key].sides) for key in self.keys.values())

    @property
    def meshes(self) -> dict[str, BoundaryMesh]:
        """The mesh of each body by its name."""
        return {name: self.partitions[key].mesh for name, key in self.keys.items()}

    def members(self, solution: Solution) -> list[Member]:
        """Return the results of a solution on each partition of this level."""
        members, places = [], solution.places
        zone_ends = places.zone_ends(solution.missed_contacts)
        for number, partition in enumerate(self.partitions):
            names = [name for name, key in self.keys.items() if key == number]
            ends = (
                tuple(end for end in each if end.body in names)
                for each in (zone_ends, places.facing_ends, places.reversals)
            )
            bodies = tuple(solution.bodies[name] for name in names)
            members.append(Member(partition, bodies, places.elements(names[0]), *ends))
        return members

    def at_worst(self, bodies: Sequence[FloatArray]) -> list[FloatArray]:
        """Return for each partition the largest values (n_elements,) that any of its bodies has."""
        worst: dict[int, FloatArray] = {}
        for key, values in zip(self.keys.values(), bodies, strict=True):
            worst[key] = np.maximum(worst.get(key, values), values)
        return [worst[key] for key in range(len(self.partitions))]


def with_sides_of(scene: Scene, solution: Solution) -> Scene:
    """Return a scene whose contacts have their multipliers on the sides that had them in a solution."""
    contacts, touching = [], scene.touching
    if touching is not None:
        listed = {*touching.names, *(pair.name for pair in scene.contacts)}
        found = (pair.name for pair in solution.scene.contacts if pair.name not in listed)
        touching = replace(touching, names=(*touching.names, *found))
    for pair in scene.contacts:
        first = solution.contact_sides.get(pair.name, (None,))[0]
        sides = [side for side, place in zip(pair.elastic_sides, pair.elastic_parts, strict=True) if place == first]
        is_open = pair.rigid_body is None and pair.multipliers_on is None
        contacts.append(replace(pair, multipliers_on=sides[0]) if is_open and sides else pair)
    return replace(scene, contacts=tuple(contacts), touching=touching)


def _divided_bodies(asked: Scene) -> tuple[dict[str, int], list[BodyScene], tuple[tuple[str, ...], ...]]:
    """Return the index of the scene of each body by name, these scenes, and their parts in contact."""
    keys: dict[str, int] = {}
    numbers: dict[int, int] = {}
    scenes: list[BodyScene] = []
    touching: list[tuple[str, ...]] = []
    for body in asked.placed_bodies:
        scene = asked.scene_of(body)
        if id(scene) not in numbers:
            numbers[id(scene)] = len(scenes)
            scenes.append(scene)
            touching.append((*asked.touching_parts(body), *(part.name for part in scene.contact_parts)))
        keys[body.name] = numbers[id(scene)]
    return keys, scenes, tuple(touching)


class MeshSequence(Protocol):
    """A rule for better meshes; a frozen dataclass without memory."""

    def error(self, solution: Solution) -> float:
        """Return the estimated error that is to be made small; infinite without an estimate."""
        ...

    def is_enough(self, solutions: Sequence[Solution]) -> bool:
        """Return whether the last of the solutions is accurate enough."""
        ...

    def following(self, level: Level, solutions: Sequence[Solution]) -> Level | None:
        """Return the next meshes, with the discretisation for them; None if that would not help.

        The last of the solutions is that of `level`.
        """
        ...


def zone_cuts(partition: Partition, ends: Iterable[ZoneEnd]) -> dict[int, list[float]]:
    """Return where zones of one status end, as parameters by the number of the side."""
    cuts: dict[int, list[float]] = {}
    for zone_end in ends:
        start, end = partition.spans[zone_end.element].tolist()
        side = int(partition.sides[zone_end.element])
        cuts.setdefault(side, []).append(start + zone_end.fraction * (end - start))
    return cuts
