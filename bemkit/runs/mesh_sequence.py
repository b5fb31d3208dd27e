"""What leads from one mesh to a better one: the protocol, and where zones of one status end."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple, Protocol

import numpy as np

from bemkit.geometry.mesh import BoundaryMesh
from bemkit.geometry.meshing.partition import Partition
from bemkit.geometry.neighbours import along_boundary
from bemkit.results.contact_table import resolved_transitions
from bemkit.results.solution import Solution
from bemkit.scene.scene import Scene
from bemkit.solvers.active_sets import NodeStatus


@dataclass(frozen=True, eq=False)
class Level:
    """What is solved next.

    Parameters
    ----------
    asked : Scene
    partition : Partition
    number : int
        Which of the discretisations that follow each other; see `Discretisation.at_level`.
    degrees : tuple of int
        Of each element, where they are lower than those of that discretisation.
    """

    asked: Scene
    partition: Partition
    number: int = 0
    degrees: tuple[int, ...] = ()

    @cached_property
    def scene(self) -> Scene:
        """The scene with the discretisation of this level."""
        discretisation = self.asked.discretisation.at_level(self.number)
        return replace(self.asked, discretisation=discretisation.with_degrees(self.degrees))

    @property
    def n_elements(self) -> int:
        """Number of elements."""
        return self.partition.mesh.n_elements

    @property
    def meshes(self) -> dict[str, BoundaryMesh]:
        """The mesh, without a name."""
        return {"": self.partition.mesh}


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


class ZoneEnd(NamedTuple):
    """Where zones of one status end: in which element, and at which fraction of its length.

    The zone length says what the element is short or long compared with [m].
    """

    mesh: BoundaryMesh
    zone_length: float
    element: int
    fraction: float
    body: str = ""


def zone_ends(solution: Solution) -> list[ZoneEnd]:
    """Return where zones of one status end, as far as they are resolved; see `resolved_transitions`.

    Zones are as long as their part; on a half-plane, of which a part may be any strip, as half of what touches there.
    """
    mesh, table = solution.mesh, solution.contact
    found = []
    for transition in resolved_transitions(solution.contact, solution.transitions):
        elements = along_boundary(mesh, mesh.part(transition.part))
        ends = np.cumsum(mesh.lengths[elements])
        k = min(int(np.searchsorted(ends, transition.s)), elements.size - 1)
        fraction = 1.0 - float((ends[k] - transition.s) / mesh.lengths[elements[k]])
        zone_length = float(ends[-1])
        if mesh.surface is not None:
            touches = table.rows(transition.part) & (table.status != NodeStatus.SEPARATED)
            zone_length = 0.5 * float(table.weight[touches].sum())
        found.append(ZoneEnd(mesh, zone_length, int(elements[k]), fraction))
    return found


def zone_cuts(partition: Partition, ends: Iterable[ZoneEnd]) -> dict[int, list[float]]:
    """Return where zones of one status end, as parameters by the number of the side."""
    cuts: dict[int, list[float]] = {}
    for zone_end in ends:
        start, end = partition.spans[zone_end.element].tolist()
        side = int(partition.sides[zone_end.element])
        cuts.setdefault(side, []).append(start + zone_end.fraction * (end - start))
    return cuts
