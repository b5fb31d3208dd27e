"""Meshes of several bodies that follow the solution until the accuracy asked for is reached."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from bemkit.arrays import FloatArray, IntArray
from bemkit.errors import BemkitError, InputError
from bemkit.geometry.meshing.partition import SPREAD, Partition, better_partition
from bemkit.geometry.vectors import norms
from bemkit.results.assembly_solution import AssemblySolution, BodyResult
from bemkit.runs.assembly import run_assembly
from bemkit.runs.best_mesh import best_last
from bemkit.runs.density import LARGEST_GROWTH, MOST_FOR_TRANSITIONS, SAFETY, SMALLEST_GROWTH, TRANSITION
from bemkit.scene.assembly import Assembly
from bemkit.scene.mesh_options import MOST_ELEMENTS
from bemkit.solvers.base import StepRecord


def run_assembly_adaptive(
    assembly: Assembly, *, callback: Callable[[StepRecord], None] | None = None
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

    Returns
    -------
    tuple of AssemblySolution
        One for each mesh, the best one last; see `bemkit.runs.adaptive.run_adaptive`.

    Raises
    ------
    ValueError
        If the assembly has no accuracy, or for the reasons of `bemkit.run`.
    """
    options, begin = assembly.mesh, time.perf_counter()
    if options.accuracy is None:
        raise InputError("mesh.accuracy is missing: give one, such as MeshOptions(accuracy=1e-3)")
    level = _Level.first(assembly)
    most_elements = MOST_ELEMENTS if options.most_elements is None else options.most_elements
    solutions: list[AssemblySolution] = []
    obstacle = ""
    while not obstacle:
        started = time.perf_counter()
        try:
            meshes = {name: level.partitions[key].mesh for name, key in level.keys.items()}
            solution = run_assembly(assembly, meshes=meshes, callback=callback)
        except BemkitError as error:
            if not solutions:
                raise
            obstacle = f"meshes of {level.n_elements} elements cannot be solved ({error})"
            break
        solutions.append(solution)
        if not solution.is_converged:
            obstacle = f"the solve on {solution.n_elements} elements failed"
        elif _is_enough(solutions, options.accuracy):
            break
        else:
            level = level.following(solution, options.accuracy)
            spent = (time.perf_counter() - started) * (level.n_elements / solution.n_elements) ** 2
            if level.n_elements > most_elements * len(level.partitions):
                obstacle = f"more than {most_elements} elements a body would be needed"
            elif options.most_seconds is not None and time.perf_counter() - begin + spent > options.most_seconds:
                obstacle = f"more than {options.most_seconds:g} s would be needed"
    return best_last(solutions, obstacle, options.accuracy, error=_error, shown=_shown)


@dataclass(frozen=True, eq=False)
class _Level:
    """How the bodies are divided; copies have one partition."""

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
                partitions[id(scene)] = scene.mesh.first_partition(outline, scene.selections, parts)
        return cls(keys, partitions, touching)

    @property
    def n_elements(self) -> int:
        """Number of elements of all bodies."""
        return sum(len(self.partitions[key].sides) for key in self.keys.values())

    def following(self, solution: AssemblySolution, accuracy: float) -> _Level:
        """Return partitions whose density follows the estimated errors."""
        rate = _rate(solution)
        densities: dict[int, FloatArray] = {}
        for name, key in self.keys.items():
            own = _errors(solution.bodies[name]) ** (1.0 / (rate + 1))
            densities[key] = np.maximum(densities.get(key, own), own)
        copies = {key: sum(one == key for one in self.keys.values()) for key in self.partitions}
        total = sum(copies[key] * float(density.sum()) for key, density in densities.items())
        allowed = (SAFETY * accuracy) ** 2 * solution.error_unit
        needed = (total / allowed) ** (1.0 / rate) * total / (1.0 - SPREAD) if allowed > 0.0 else 0.0
        error = solution.estimated_error
        smallest = SMALLEST_GROWTH if error is None or error > accuracy else 1.0
        n_elements = float(np.clip(needed, smallest * self.n_elements, LARGEST_GROWTH * self.n_elements))
        cuts: dict[int, dict[int, list[float]]] = {key: {} for key in self.partitions}
        for body, element, fraction in zone_ends(solution):
            partition = self.partitions[self.keys[body]]
            start, end = partition.spans[element].tolist()
            side = int(partition.sides[element])
            cuts[self.keys[body]].setdefault(side, []).append(start + fraction * (end - start))
        better = {}
        for key, partition in self.partitions.items():
            share = (1.0 - SPREAD) * float(densities[key].sum()) / total + SPREAD / len(self.keys)
            better[key] = better_partition(
                partition,
                densities[key],
                int(np.ceil(n_elements * share)),
                cuts=cuts[key],
                spread_over=self.touching[key],
            )
        return replace(self, partitions=better)


def zone_ends(solution: AssemblySolution) -> list[tuple[str, int, float]]:
    """Return where zones of one status end, on both sides: body, element and fraction of its length.

    A zone that a single node stands for is not resolved yet: its ends are left alone.
    """
    table = solution.contact
    sides = {pair.name: pair.elastic_sides for pair in solution.assembly.contacts}
    found = []
    for contact in table.parts:
        nodes = table.s[table.rows(contact)]
        own = [transition for transition in solution.transitions if transition.part == contact]
        places = np.array([transition.s for transition in own])
        sizes = np.histogram(nodes, np.concatenate([[-np.inf], places, [np.inf]]))[0]
        for transition, before, after in zip(own, sizes[:-1].tolist(), sizes[1:].tolist(), strict=True):
            if before > 1 and after > 1:
                point = np.array([transition.x, transition.y])
                for side in sides.get(contact, (contact,)):
                    body, part = side.split(".", 1)
                    result = solution.bodies[body]
                    found.append((body, *_nearest(result, result.mesh.part(part), point)))
    return found


def _nearest(body: BodyResult, elements: IntArray, point: FloatArray) -> tuple[int, float]:
    """Return the element nearest to a point, and the fraction of its chord there."""
    start, end = body.mesh.start[elements], body.mesh.end[elements]
    chord = end - start
    along = np.clip(np.sum((point - start) * chord, axis=1) / np.sum(chord**2, axis=1), 0.0, 1.0)
    k = int(np.argmin(norms(start + along[:, None] * chord - point)))
    return int(elements[k]), float(along[k])


def _is_enough(solutions: Sequence[AssemblySolution], accuracy: float) -> bool:
    """Tell whether the estimated error is small enough, and the elements in which the status changes short."""
    errors = [each.estimated_error for each in solutions]
    n_accurate = sum(error is not None and error <= accuracy for error in errors)
    if n_accurate == 0 or errors[-1] is None or errors[-1] > accuracy:
        return False
    return n_accurate > MOST_FOR_TRANSITIONS or _resolves_transitions(solutions[-1], accuracy)


def _resolves_transitions(solution: AssemblySolution, accuracy: float) -> bool:
    """Tell whether the elements in which the status changes are short; see `DensityMeshes`."""
    for body, element, _ in zone_ends(solution):
        mesh = solution.bodies[body].mesh
        part = next(part for part, elements in mesh.parts.items() if element in elements)
        if mesh.lengths[element] > TRANSITION * accuracy * mesh.lengths[mesh.part(part)].sum():
            return False
    return True


def _errors(body: BodyResult) -> FloatArray:
    if body.element_errors is None:
        raise InputError(f"body {body.name!r}: collocation has no error estimate: choose a Galerkin discretisation")
    return body.element_errors


def _rate(solution: AssemblySolution) -> int:
    """Return the power of element lengths in the squared energy error: 2 p + 1 for the lowest degree p."""
    bodies = solution.bodies.values()
    return 2 * min(body.scene.discretisation.displacement_space(body.mesh).degree for body in bodies) + 1


def _error(solution: AssemblySolution) -> float:
    return float("inf") if solution.estimated_error is None else solution.estimated_error


def _shown(solution: AssemblySolution) -> str:
    return f"{_error(solution):.1e}"
