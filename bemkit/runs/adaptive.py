"""Meshes of one body or of several that follow the solution until the accuracy asked for is reached."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, cast

from bemkit.errors import InputError
from bemkit.plan import make_plan
from bemkit.runs.density import DensityMeshes
from bemkit.runs.earlier_steps import EarlierSteps
from bemkit.runs.hp import LayeredMeshes
from bemkit.runs.mesh_sequence import Level, MeshSequence
from bemkit.runs.refinement import refined, required_accuracy
from bemkit.runs.step_errors import in_which_step
from bemkit.runs.steps import guess_from, joined, run_on_mesh, solved_history
from bemkit.scene.scene import Scene
from bemkit.solvers.base import StepRecord

if TYPE_CHECKING:
    from concurrent.futures import Executor


def run_adaptive(
    scene: Scene,
    *,
    start: Any = None,
    callback: Callable[[StepRecord], None] | None = None,
    done: Any = None,
    finished: Callable[[Any], None] | None = None,
    executor: Executor | None = None,
) -> tuple[Any, ...]:
    """Solve a scene on a sequence of meshes until the estimated error is below its accuracy.

    A load history is solved as a whole on each mesh, which follows the largest errors of all its steps, relative to the
    largest energy among them.

    All bodies are divided anew after each solve, by density for linear and quadratic elements (`DensityMeshes`), in
    layers for higher and rising degrees (`LayeredMeshes`); both sides of a contact get nodes where its status changes.
    Copies keep one mesh in common, as fine as the worst of them needs. A solve starts from the solution before it, so
    that few Newton steps are needed.

    Parameters
    ----------
    scene : Scene
        With `MeshOptions.accuracy`.
    start : Solution, optional
        Of the first mesh; as for `bemkit.run`.
    callback : callable, optional
        Receives a record of every step on every mesh.
    done, finished : optional
        Of a load history; see `EarlierSteps`.
    executor : Executor, optional
        As for `bemkit.run`.

    Returns
    -------
    tuple of Solution
        One for each mesh; the best one comes last. Its timings, linear solves, steps and history are those of all
        meshes together. If the accuracy is out of reach within the elements or the time allowed, or because the solve
        on a finer mesh fails, its status is ACCURACY_NOT_REACHED, its message gives the reason, and
        `Solution.estimated_error` says what was reached. If no mesh at all could be solved, its status is that of the
        last one.

    Raises
    ------
    ValueError
        If the scene has no accuracy, degrees shall rise in a load history, or for the reasons of `bemkit.run`.
    """
    level: Level = Level.first(cast(Any, scene))
    refinement = _Refinement(_rule(level), start, callback, EarlierSteps(done, finished), executor)
    return refined(level, refinement, scene.mesh)


def _rule(level: Level) -> MeshSequence:
    """Return how better meshes are made: in layers for elements of high degree, if there is a single load."""
    mesh, n_steps = level.asked.mesh, level.asked.n_steps
    accuracy = required_accuracy(mesh)
    if n_steps > 1 and mesh.rising_degrees:
        raise InputError(
            f"discretisation is 'hp', and there are {n_steps} load steps: degrees rise only for single loads: "
            "choose 'quadratic', or another fixed degree"
        )
    return LayeredMeshes(accuracy) if level.is_layered else DensityMeshes(accuracy)


@dataclass(frozen=True)
class _Refinement:
    """How the meshes of a level are solved, judged and refined."""

    meshes: MeshSequence
    start: Any
    callback: Callable[[StepRecord], None] | None
    earlier: EarlierSteps
    executor: Executor | None

    def solved(self, level: Level, start: Any) -> Any:
        """Solve a single load from the solution before, and if that leads nowhere from the beginning."""
        scene = level.scene
        if start is not None and start.contact.n_contact and scene.n_steps == 1:
            solution = run_on_mesh(scene, level.meshes, start, self.callback, self.executor)
            if solution.is_converged:
                return solution
        earlier = self.earlier.on(level)
        guess = guess_from(scene, self.start) if start is None else None
        steps = solved_history([scene], level.meshes, self.callback, *earlier, guess=guess, executor=self.executor)
        return joined(*steps)

    def error(self, solution: Any) -> float:
        """Return the estimated error; infinite without an estimate."""
        return float(self.meshes.error(solution))

    def shown_error(self, solution: Any) -> str:
        """Return the estimated errors in words."""
        if where := in_which_step(solution):
            return f"{self.error(solution):.1e}{where}"
        energy, tractions = solution.estimated_error, solution.estimated_traction_error
        of_energy = "unknown" if energy is None else f"{energy:.1e}"
        return of_energy if tractions is None else f"{of_energy}, of contact tractions {tractions:.1e}"

    def is_enough(self, solutions: Sequence[Any]) -> bool:
        """Return whether the last of the solutions is as accurate as it shall be."""
        return self.meshes.is_enough(solutions)

    def following(self, level: Level, solutions: Sequence[Any]) -> Level | None:
        """Return the next level, its meshes made; None if that would not help."""
        following = self.meshes.following(level, solutions)
        if following is not None:
            _ = following.meshes  # errors in them are raised now
        return following

    def excess(self, level: Level, most_elements: int) -> str:
        """Say which number of elements a level exceeds; empty if it does not.

        That of a body, on average; of high degree, of quadratic ones with as many nodes. Copies count as one.
        """
        degree = level.scene.discretisation.displacement_space(level.partitions[0].mesh).degree
        n_elements = sum(len(partition.sides) for partition in level.partitions) // len(level.partitions)
        of_each = " a body" if len(level.keys) > 1 else ""
        return f"{most_elements} elements{of_each}" if n_elements * max(degree, 2) // 2 > most_elements else ""

    def expected_seconds(self, level: Level, solution: Any, spent: float) -> float:
        """Return how long the next meshes will take: what the last ones took, in the proportion of their plans."""
        return spent * make_plan(level.scene, level.meshes).seconds / float(solution.plan.seconds)
