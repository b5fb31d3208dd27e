"""Whether adaptive meshes should keep elements, so that the integrals between kept elements could be used again.

    python benchmarks/reuse.py [REPETITIONS]

bemkit makes each mesh anew, so that nothing survives. This script solves the same scenes on nested meshes as well:
each follows the same density as bemkit's next mesh, but elements are only bisected, or cut where the contact status
changes, and those that the density wants no finer are kept. A share f of kept elements spares f**2 of the element pairs
of that mesh, at best that part of its assembly. Reported are both sequences of meshes, their errors, the time of the
nested one relative to bemkit's, and what is left of it if every kept pair were free.
"""

from __future__ import annotations

import dataclasses
import statistics
import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.table import Table

import bemkit as bk
from bemkit.geometry.meshing.partition import Partition
from bemkit.runs.adaptive import run_adaptive
from bemkit.runs.density import DensityMeshes
from bemkit.runs.mesh_sequence import Level as MeshLevel
from bemkit.runs.mesh_sequence import zone_cuts

sys.path.insert(0, str(Path(__file__).parents[2]))
from benchmarks.accuracy import measured_errors
from tests.scenes import paper

ACCURACIES = (4e-3, 1e-3, 6e-5)
SPLIT = 2.0**0.5
"""An element is bisected if the density wants more than this many in its place: on average neither too many nor few."""
CLOSE = 0.25
"""A cut this close to a node, in elements of the wanted density, is not made."""


@dataclass(frozen=True)
class Level:
    """One mesh of a sequence: its solution, and the share of its elements that the mesh before had too."""

    solution: bk.Solution
    kept: float


def nested_partition(old: Partition, wanted: Partition, cuts: dict[int, list[float]]) -> Partition:
    """Bisect and cut elements of an old partition until they are as short as those of the wanted one."""
    parameters = []
    for piece, ends in zip(old.division.pieces, old.parameters, strict=True):
        own = wanted.spans[wanted.sides == piece.side]
        nodes = np.unique(own)
        new = [float(ends[0])]
        for start, end in zip(ends[:-1].tolist(), ends[1:].tolist(), strict=True):
            new += _split(start, end, nodes, cuts.get(piece.side, []))
        parameters.append(np.array(new))
    return Partition(old.base, old.base, tuple(parameters))


def _split(start: float, end: float, nodes: np.ndarray, cuts: list[float]) -> list[float]:
    """Return the inner and the last end of the pieces of an element."""

    def count(low: float, high: float) -> float:
        return float(np.diff(np.interp([low, high], nodes, np.arange(nodes.size)))[0])

    for cut in cuts:
        if start < cut < end and min(count(start, cut), count(cut, end)) > CLOSE:
            return _split(start, cut, nodes, cuts) + _split(cut, end, nodes, cuts)
    if count(start, end) <= SPLIT:
        return [end]
    middle = 0.5 * (start + end)
    return _split(start, middle, nodes, cuts) + _split(middle, end, nodes, cuts)


def kept_share(old: Partition, new: Partition) -> float:
    """Return the share of the new elements that the old partition has too."""
    before, after = ({(s, *span) for s, span in zip(p.sides, map(tuple, p.spans), strict=True)} for p in (old, new))
    return len(before & after) / len(after)


def nested_levels(scene: bk.Scene) -> list[Level]:
    """Solve a scene as `run_adaptive` does, by its own rules, on nested meshes."""
    meshes = DensityMeshes(scene.mesh.accuracy)
    first = MeshLevel.first(scene)
    partition = first.partition
    levels = [Level(bk.run(scene, mesh=partition.mesh), 0.0)]
    while True:
        solution = levels[-1].solution
        solutions = [level.solution for level in levels]
        if meshes.is_enough(solutions):
            return levels
        wanted = meshes.following(dataclasses.replace(first, partitions=(partition,)), solutions).partition
        new = nested_partition(partition, wanted, zone_cuts(partition, solution.zone_ends))
        levels.append(Level(bk.run(scene, mesh=new.mesh, start=solution), kept_share(partition, new)))
        partition = new


def add_rows(table: Table, example: int, accuracy: float, repetitions: int) -> None:
    """Measure both ways in turn, and add one row for each."""
    scene = paper(example, mesh=bk.MeshOptions(accuracy=accuracy))
    anew_times, nested_times, spared, assembly = [], [], [], []
    for _ in range(repetitions):
        anew = run_adaptive(scene)
        anew_times.append(anew[-1].timings["total"])
        levels = nested_levels(scene)
        nested_times.append(sum(level.solution.timings["total"] for level in levels))
        assembly.append(sum(level.solution.timings["assemble"] for level in levels))
        spared.append(sum(level.kept**2 * level.solution.timings["assemble"] for level in levels))
    anew_time, nested_time = statistics.median(anew_times), statistics.median(nested_times)
    share, rest = (1.0 - statistics.median(part) / nested_time for part in (assembly, spared))
    for name, solutions, kept, numbers in (
        ("made anew", anew, "", ("1.00", "", "")),
        (
            "nested",
            [level.solution for level in levels],
            ", ".join(f"{level.kept:.2f}" for level in levels[1:]),
            tuple(f"{value:.2f}" for value in (nested_time / anew_time, 1.0 - share, nested_time / anew_time * rest)),
        ),
    ):
        errors = measured_errors(solutions[-1], example)
        table.add_row(
            f"paper-{example}",
            f"{accuracy:.0e}",
            name,
            ", ".join(str(solution.mesh.n_elements) for solution in solutions),
            kept,
            *(f"{errors[key]:.1e}" for key in ("sigma_n", "sigma_t")),
            *numbers,
        )


def main() -> None:
    """Measure and print."""
    repetitions = int(sys.argv[1]) if len(sys.argv) > 1 else 5
    table = Table(title="Nested meshes against meshes made anew (quadratic elements)")
    columns = ("example", "accuracy", "meshes", "elements", "kept share f", "sigma_n", "sigma_t", "time")
    for column in (*columns, "of it assembly", "time if kept pairs were free"):
        table.add_column(column, justify="right")
    for example in (1, 2):
        for accuracy in ACCURACIES:
            add_rows(table, example, accuracy, repetitions)
        table.add_section()
    Console(width=150).print(table)


if __name__ == "__main__":
    main()
