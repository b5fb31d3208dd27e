"""What leads from one mesh to a better one: the protocol, and where zones of one status end."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Protocol

import numpy as np

from bemkit.geometry.meshing.order import along_boundary
from bemkit.geometry.meshing.partition import Partition
from bemkit.results.solution import Solution
from bemkit.scene.scene import Scene


@dataclass(frozen=True, eq=False)
class Level:
    """What is solved next.

    Parameters
    ----------
    asked : Scene
    partition : Partition
    number : int
        Which of the discretisations that follow each other; see `Discretisation.at_level`.
    """

    asked: Scene
    partition: Partition
    number: int = 0

    @cached_property
    def scene(self) -> Scene:
        """The scene with the discretisation of this level."""
        return replace(self.asked, discretisation=self.asked.discretisation.at_level(self.number))


class MeshSequence(Protocol):
    """A rule for better meshes; a frozen dataclass without memory."""

    def error(self, solution: Solution) -> float:
        """Return the estimated error that is to be made small; infinite without an estimate."""
        ...

    def is_enough(self, solutions: Sequence[Solution]) -> bool:
        """Tell whether the last of the solutions is as accurate as it shall be."""
        ...

    def following(self, level: Level, solutions: Sequence[Solution]) -> Level | None:
        """Return the next mesh, with the discretisation for it; None if that would not help.

        The last of the solutions is that of `level`.
        """
        ...


def zone_ends(solution: Solution) -> list[tuple[str, int, float]]:
    """Return where zones of one status end: the part, the element and the fraction of its length.

    A zone that a single node stands for is not resolved yet, or it is a node that a support holds: its ends are left
    alone.
    """
    table, mesh = solution.contact, solution.mesh
    found = []
    for part in table.parts:
        nodes = table.s[table.rows(part)]
        places = np.array([transition.s for transition in solution.transitions if transition.part == part])
        zone_sizes = np.histogram(nodes, np.concatenate([[-np.inf], places, [np.inf]]))[0]
        elements = along_boundary(mesh, mesh.part(part))
        ends = np.cumsum(mesh.lengths[elements])
        for place in places[(zone_sizes[:-1] > 1) & (zone_sizes[1:] > 1)].tolist():
            k = min(int(np.searchsorted(ends, place)), elements.size - 1)
            found.append((part, int(elements[k]), 1.0 - float((ends[k] - place) / mesh.lengths[elements[k]])))
    return found


def zone_cuts(partition: Partition, solution: Solution) -> dict[int, list[float]]:
    """Return where zones of one status end, as parameters by the number of the side."""
    cuts: dict[int, list[float]] = {}
    for _, element, fraction in zone_ends(solution):
        start, end = partition.spans[element].tolist()
        cuts.setdefault(int(partition.sides[element]), []).append(start + fraction * (end - start))
    return cuts
