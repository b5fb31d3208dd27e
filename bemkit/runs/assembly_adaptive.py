"""Meshes of several bodies that follow the solution until the accuracy asked for is reached."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from bemkit.arrays import FloatArray, IntArray
from bemkit.geometry.mesh import BoundaryMesh
from bemkit.geometry.meshing.partition import SPREAD, Partition, better_partition
from bemkit.geometry.vectors import norms
from bemkit.results.assembly_solution import AssemblySolution
from bemkit.results.contact_table import resolved_transitions
from bemkit.runs.assembly import SEVERAL_BODIES
from bemkit.runs.density import SAFETY, error_rate, is_enough, needed_elements, next_size
from bemkit.runs.earlier_steps import EarlierSteps
from bemkit.runs.mesh_sequence import ZoneEnd, zone_cuts
from bemkit.runs.refinement import refined, required_accuracy
from bemkit.runs.step_errors import StepErrors, in_which_step
from bemkit.runs.steps import joined, solved_history
from bemkit.scene.assembly import Assembly
from bemkit.solvers.base import StepRecord


def run_assembly_adaptive(
    assembly: Assembly,
    *,
    callback: Callable[[StepRecord], None] | None = None,
    done: AssemblySolution | None = None,
    finished: Callable[[AssemblySolution], None] | None = None,
) -> tuple[AssemblySolution, ...]:
    """Solve an assembly on a sequence of meshes until the estimated error is below its accuracy.

    All bodies are divided anew after each solve, by density as in `bemkit.runs.density.DensityMeshes`; both sides of a
    contact get nodes where its status changes. Copies keep one mesh in common, as fine as the worst of them needs.

    Parameters
    ----------
    assembly : Assembly
        With `MeshOptions.accuracy`.
    callback : callable, optional
        Receives a record of every step on every mesh.
    done, finished : optional
        Of a load history; see `EarlierSteps`.

    Returns
    -------
    tuple of AssemblySolution
        One for each mesh, the best one last; see `bemkit.runs.adaptive.run_adaptive`.

    Raises
    ------
    ValueError
        If the assembly has no accuracy, or for the reasons of `bemkit.run`.
    """
    earlier = EarlierSteps(done, finished)
    refinement = _AssemblyRefinement(required_accuracy(assembly.mesh), callback, earlier)
    return refined(_Level.first(assembly), refinement, assembly.mesh)


@dataclass(frozen=True)
class _AssemblyRefinement:
    accuracy: float
    callback: Callable[[StepRecord], None] | None
    earlier: EarlierSteps[AssemblySolution]

    def solved(self, level: _Level, start: AssemblySolution | None) -> AssemblySolution:
        """Solve from the beginning: contact nodes of several bodies are not carried from mesh to mesh."""
        known = self.earlier.on(level)
        return joined(*solved_history(SEVERAL_BODIES, [level.assembly], level.meshes, self.callback, *known))

    def error(self, solution: AssemblySolution) -> float:
        return StepErrors.of(solution).energy

    def shown_error(self, solution: AssemblySolution) -> str:
        return f"{self.error(solution):.1e}{in_which_step(solution)}"

    def is_enough(self, solutions: Sequence[AssemblySolution]) -> bool:
        ends = zone_ends(StepErrors.of(solutions[-1]).worst)
        return is_enough([self.error(each) for each in solutions], ends, self.accuracy)

    def following(self, level: _Level, solutions: Sequence[AssemblySolution]) -> _Level:
        return level.following(StepErrors.of(solutions[-1]), self.accuracy)

    def excess(self, level: _Level, most_elements: int) -> str:
        """Compare the number of elements of a body, on average; copies count as one."""
        is_larger = level.n_elements > most_elements * len(level.partitions)
        return f"{most_elements} elements a body" if is_larger else ""

    def expected_seconds(self, level: _Level, solution: AssemblySolution, spent: float) -> float:
        return spent * (level.n_elements / solution.n_elements) ** 2


@dataclass(frozen=True, eq=False)
class _Level:
    """How the bodies are divided; copies have one partition."""

    assembly: Assembly
    keys: Mapping[str, int]
    """By the name of the body, which partition is its own."""
    partitions: Mapping[int, Partition]
    touching: Mapping[int, tuple[str, ...]]
    """The parts in contact, of each partition."""

    @classmethod
    def first(cls, assembly: Assembly) -> _Level:
        keys, partitions, touching = {}, {}, {}
        for body in assembly.placed_bodies:
            scene = assembly.scene_of(body)
            keys[body.name] = id(scene)
            if id(scene) not in partitions:
                parts = [*assembly.contact_parts(body), *(part.name for part in scene.contact_parts)]
                touching[id(scene)] = tuple(parts)
                outline = scene.shape.outline()
                partitions[id(scene)] = scene.mesh.first_partition(outline, scene.selections, parts, scene.symmetry)
        return cls(assembly, keys, partitions, touching)

    @property
    def meshes(self) -> dict[str, BoundaryMesh]:
        """The mesh of each body by its name."""
        return {name: self.partitions[key].mesh for name, key in self.keys.items()}

    @property
    def n_elements(self) -> int:
        """Number of elements of all bodies."""
        return sum(len(self.partitions[key].sides) for key in self.keys.values())

    def following(self, errors: StepErrors[AssemblySolution], accuracy: float) -> _Level:
        """Return partitions whose density follows the estimated errors."""
        solution = errors.worst
        rate = error_rate(
            min(body.scene.discretisation.displacement_space(body.mesh).degree for body in solution.solved_bodies)
        )
        worst: dict[int, FloatArray] = {}
        for key, own in zip(self.keys.values(), errors.required(), strict=True):
            worst[key] = np.maximum(worst.get(key, own), own)
        of_bodies = [worst[key] for key in self.keys.values()]
        needed = needed_elements(np.concatenate(of_bodies), rate, (SAFETY * accuracy) ** 2 * errors.unit)
        ends_of_bodies = np.cumsum([len(own) for own in of_bodies])[:-1]
        densities = dict(zip(self.keys.values(), np.split(needed, ends_of_bodies), strict=True))
        total = float(needed.sum())
        n_elements = next_size(solution.n_elements, total / (1.0 - SPREAD), is_accurate=errors.energy <= accuracy)
        ends = zone_ends(solution)
        better = {}
        for key, partition in self.partitions.items():
            share = (1.0 - SPREAD) * float(densities[key].sum()) / total + SPREAD / len(self.keys)
            better[key] = better_partition(
                partition,
                densities[key],
                int(np.ceil(n_elements * share)),
                cuts=zone_cuts(partition, [end for end in ends if self.keys[end.body] == key]),
                spread_over=self.touching[key],
            )
        return replace(self, partitions=better)


def zone_ends(solution: AssemblySolution) -> list[ZoneEnd]:
    """Return where zones of one status end, on both sides, as far as they are resolved; see `resolved_transitions`."""
    sides = {pair.name: pair.elastic_sides for pair in solution.assembly.contacts}
    found = []
    for transition in resolved_transitions(solution.contact, solution.transitions):
        point = np.array([transition.x, transition.y])
        for side in sides.get(transition.part, (transition.part,)):
            body, part = side.split(".", 1)
            mesh = solution.bodies[body].mesh
            elements = mesh.part(part)
            found.append(ZoneEnd(mesh, float(mesh.lengths[elements].sum()), *_nearest(mesh, elements, point), body))
    return found


def _nearest(mesh: BoundaryMesh, elements: IntArray, point: FloatArray) -> tuple[int, float]:
    """Return the element nearest to a point, and the fraction of its chord there."""
    start, end = mesh.start[elements], mesh.end[elements]
    chord = end - start
    along = np.clip(np.sum((point - start) * chord, axis=1) / np.sum(chord**2, axis=1), 0.0, 1.0)
    k = int(np.argmin(norms(start + along[:, None] * chord - point)))
    return int(elements[k]), float(along[k])
