"""The plan of a scene."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

from bemkit.geometry.mesh import BoundaryMesh
from bemkit.geometry.symmetry import Symmetry
from bemkit.operators.counts import Work
from bemkit.plan.costs import Stage, peaks
from bemkit.plan.counts import planned_work
from bemkit.plan.decisions import Decisions, decide
from bemkit.plan.items import PlanItem, Wishes, output_items, plan_items
from bemkit.plan.machine import Machine
from bemkit.plan.sizes import Sizes, find_sizes
from bemkit.plan.thinness import thinness_warnings
from bemkit.scene.load_history import load_steps
from bemkit.scene.scene import Scene


@dataclass(frozen=True)
class Plan:
    """What a scene takes on a mesh: the choices that the solver follows, and what follows from them.

    Parameters
    ----------
    decisions : Decisions
    sizes : Sizes
    items : tuple of PlanItem
        In the order in which they are used.
    warnings : tuple of str
        What will be doubtful about the result, one sentence each.
    """

    decisions: Decisions
    sizes: Sizes
    items: tuple[PlanItem, ...]
    warnings: tuple[str, ...] = ()

    @property
    def work(self) -> Work:
        """The counts that `Solution.work` will show."""
        return planned_work(self.decisions, self.sizes)

    @property
    def peaks(self) -> dict[Stage, int]:
        """Largest memory of each stage [bytes]."""
        return peaks(self.decisions, self.sizes)

    @property
    def memory(self) -> int:
        """Largest memory of all stages [bytes]."""
        return max(self.peaks.values())

    def with_outputs(self, wishes: Wishes) -> Plan:
        """Return the same plan with other outputs."""
        own = tuple(item for item in self.items if item.stage is not Stage.OUTPUTS)
        return replace(self, items=(*own, *output_items(wishes)))

    def seconds(self, machine: Machine) -> dict[Stage, float]:
        """Return the time that each stage will take on a computer [s]."""
        result = dict.fromkeys(Stage, 0.0)
        for item in self.items:
            result[item.stage] += item.cost.seconds(machine)
        return result

    def as_dict(self, machine: Machine | None = None) -> dict[str, Any]:
        """Return the plan as JSON can hold it, with times if a computer is given."""
        items = [item.as_dict(machine) for item in self.items]
        seconds = {} if machine is None else {"seconds": sum(self.seconds(machine).values())}
        counts = {"memory": self.memory, **seconds, "work": self.work.as_dict()}
        return {**counts, "items": items, "warnings": list(self.warnings)}


def make_plan(
    scene: Scene, mesh: BoundaryMesh, *, steps: Sequence[Scene] | None = None, proposal: Symmetry | None = None
) -> Plan:
    """Say what a scene needs on a mesh and what it leaves out, before anything expensive happens.

    Parameters
    ----------
    scene : Scene
    mesh : BoundaryMesh
        As made by `Scene.build_mesh`.
    steps : sequence of Scene, optional
        What follows each other in time; the load steps of the scene by default.
    proposal : Symmetry, optional
        A symmetry that the scene has but does not use, from `bemkit.scene.symmetry.find_symmetry`.

    Returns
    -------
    Plan

    Raises
    ------
    ConflictingSupportsError
        If supports contradict each other at a node.
    """
    steps = load_steps(scene) if steps is None else steps
    decisions = decide(scene, mesh, len(steps))
    sizes = find_sizes(steps, mesh, decisions)
    choice = decisions.linear_choice(sizes.n_displacements, sizes.n_open)
    decisions = replace(decisions, linear_solver=choice.solver)
    items = plan_items(scene, decisions, sizes, choice.reason, proposal)
    return Plan(decisions, sizes, items, thinness_warnings(decisions, mesh))
