"""The bodies of a solution with what is measured again: boundary, scales, energy."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

from bemkit.arrays import IntArray
from bemkit.contact.obstacle import Obstacle
from bemkit.results.solution import Solution
from bemkit.results.solved_body import SolvedBody
from bemkit.scene.conditions import Contact, name_at_obstacle
from bemkit.testing.independent_check.boundary import Boundary, boundary_of, supported_nodes
from bemkit.testing.independent_check.scales import Scales, scales_of

COARSE_LIMIT = 0.1
"""Largest share of work out of balance in the reciprocal theorem: the discretisation error of a coarse mesh, far below
that of fields which do not belong to the body at all."""
COARSE_SHARE = 2.0
"""The same for each unit of the longest element over the diameter of its body: collocation with 35, 70 and 140 elements
on a block between two obstacles misses it by 1.5, 1.4 and 1.25 times that, its energy by 34, 15 and 7 %."""
LIGHTEST = 1e-3
"""Least unit of stress of a body, relative to the largest stress of the scene."""


@dataclass(frozen=True, eq=False)
class MeasuredBody:
    """A body with the quantities that are measured again.

    Parameters
    ----------
    solved : SolvedBody
    before : SolvedBody or None
        At the end of the load step before.
    touched : tuple of str
        Names of its parts in contacts, each once for each contact.
    boundary : Boundary
    scales : Scales
    """

    solved: SolvedBody
    before: SolvedBody | None
    touched: tuple[str, ...]
    boundary: Boundary
    scales: Scales

    @property
    def energy(self) -> float:
        """Elastic energy [J/m], per thickness."""
        return self.solved.energy / self.solved.scene.depth

    @cached_property
    def supported_nodes(self) -> IntArray:
        """The nodes that supports and symmetry lines hold in some direction."""
        return supported_nodes(self.solved, self.boundary)

    @property
    def allowed_error(self) -> float:
        """Share of work out of balance that the discretisation explains."""
        return max(COARSE_LIMIT, COARSE_SHARE * float(self.boundary.lengths.max()) / self.solved.mesh.diameter)

    def measured_by(self, least: float) -> MeasuredBody:
        """Return the body with units of a stress [Pa] at least, and of the displacement that it causes."""
        scales = self.scales
        length = least * self.solved.mesh.diameter / self.solved.scene.material.plane_modulus
        larger = replace(scales, stress=max(scales.stress, least), length=max(scales.length, length))
        return replace(self, scales=larger)


def bodies_of(solution: Solution, before: Solution | None) -> dict[str, MeasuredBody]:
    """Measure the bodies of a solution, by name; none by less than a share of the largest stress."""
    at_obstacles: dict[str, list[str]] = {name: [] for name in solution.bodies}
    touched: dict[str, list[str]] = {name: [] for name in solution.bodies}
    for name, body in solution.bodies.items():
        for part in fixed_obstacles_of(body):
            touched[name].append(part)
            at_obstacles[name].append(name_at_obstacle(name, part))
    for pair in solution.scene.contacts:
        sides = solution.contact_sides[pair.name]
        for side in sides:
            touched[side.body].append(side.part)
        if pair.rigid_body is not None:
            at_obstacles[sides[0].body].append(pair.name)
    measured = {}
    for name, body in solution.bodies.items():
        earlier = None if before is None else before.bodies[name]
        scales = scales_of(body, earlier, solution.contact.renamed({each: each for each in at_obstacles[name]}))
        measured[name] = MeasuredBody(body, earlier, tuple(touched[name]), boundary_of(body, touched[name]), scales)
    least = LIGHTEST * max(body.scales.strained for body in measured.values())
    return {name: body.measured_by(least) for name, body in measured.items()}


def fixed_obstacles_of(body: SolvedBody) -> dict[str, Obstacle]:
    """Return the fixed obstacles by the names of the parts that face them; a part beyond a symmetry line faces none."""
    return {
        part.name: part.condition.obstacle
        for part in body.scene.parts
        if isinstance(part.condition, Contact) and body.mesh.part(part.name).size
    }
