"""Meshes of one body or of several that follow the solution until the accuracy asked for is reached."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass
from typing import Any, Generic

from bemkit.errors import InputError
from bemkit.plan import make_plan
from bemkit.results.assembly_solution import AssemblySolution
from bemkit.results.solution import Solution
from bemkit.runs.assembly import several_bodies
from bemkit.runs.density import DensityMeshes
from bemkit.runs.earlier_steps import EarlierSteps
from bemkit.runs.history import ONE_BODY, run_on_mesh
from bemkit.runs.hp import LayeredMeshes
from bemkit.runs.mesh_sequence import AnyScene, AnySolution, Level, MeshSequence
from bemkit.runs.refinement import refined, required_accuracy
from bemkit.runs.step_errors import in_which_step
from bemkit.runs.steps import Kind, joined, solved_history
from bemkit.scene.assembly import Assembly
from bemkit.scene.scene import Scene
from bemkit.solvers.base import StepRecord


def run_adaptive(
    scene: Scene,
    *,
    callback: Callable[[StepRecord], None] | None = None,
    done: Solution | None = None,
    finished: Callable[[Solution], None] | None = None,
) -> tuple[Solution, ...]:
    """Solve a scene on a sequence of meshes until the estimated error is below the accuracy of the scene.

    A load history is solved as a whole on each mesh, which follows the largest errors of all its steps, relative to the
    largest energy among them.

    Each mesh is made from the solution before it, by density for linear and quadratic elements (`DensityMeshes`), in
    layers for higher and rising degrees (`LayeredMeshes`), and its solve starts from that solution, so that few Newton
    steps are needed.

    Parameters
    ----------
    scene : Scene
        With `MeshOptions.accuracy`.
    callback : callable, optional
        Receives a record of every step on every mesh.
    done, finished : optional
        Of a load history; see `EarlierSteps`.

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
    level = Level.first(scene)
    return refined(level, _SceneRefinement(_rule(level), callback, EarlierSteps(done, finished)), scene.mesh)


def run_assembly_adaptive(
    assembly: Assembly,
    *,
    callback: Callable[[StepRecord], None] | None = None,
    done: AssemblySolution | None = None,
    finished: Callable[[AssemblySolution], None] | None = None,
    executor: Executor | None = None,
) -> tuple[AssemblySolution, ...]:
    """Solve an assembly on a sequence of meshes until the estimated error is below its accuracy.

    All bodies are divided anew after each solve, as in `run_adaptive`; both sides of a contact get nodes where its
    status changes. Copies keep one mesh in common, as fine as the worst of them needs.

    Parameters
    ----------
    assembly : Assembly
        With `MeshOptions.accuracy`.
    callback : callable, optional
        Receives a record of every step on every mesh.
    done, finished : optional
        Of a load history; see `EarlierSteps`.
    executor : Executor, optional
        As for `run_assembly`.

    Returns
    -------
    tuple of AssemblySolution
        One for each mesh, the best one last; see `run_adaptive`.

    Raises
    ------
    ValueError
        If the assembly has no accuracy, or for the reasons of `bemkit.run`.
    """
    level, earlier = Level.first(assembly), EarlierSteps(done, finished)
    refinement = _AssemblyRefinement(_rule(level), callback, earlier, several_bodies(executor))
    return refined(level, refinement, assembly.mesh)


def _rule(level: Level[Any]) -> MeshSequence[Any]:
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
class _Refinement(Generic[AnyScene, AnySolution]):
    """What one body and several have in common."""

    meshes: MeshSequence[AnySolution]
    callback: Callable[[StepRecord], None] | None
    earlier: EarlierSteps[AnySolution]

    def _solved(self, kind: Kind[Any, AnySolution], level: Level[AnyScene], meshes: Any) -> AnySolution:
        return joined(*solved_history(kind, [level.scene], meshes, self.callback, *self.earlier.on(level)))

    def error(self, solution: AnySolution) -> float:
        return self.meshes.error(solution)

    def shown_error(self, solution: AnySolution) -> str:
        if where := in_which_step(solution):
            return f"{self.error(solution):.1e}{where}"
        energy, tractions = solution.estimated_error, solution.estimated_traction_error
        of_energy = "unknown" if energy is None else f"{energy:.1e}"
        return of_energy if tractions is None else f"{of_energy}, of contact tractions {tractions:.1e}"

    def is_enough(self, solutions: Sequence[AnySolution]) -> bool:
        return self.meshes.is_enough(solutions)

    def following(self, level: Level[AnyScene], solutions: Sequence[AnySolution]) -> Level[AnyScene] | None:
        following = self.meshes.following(level, solutions)
        if following is not None:
            _ = following.meshes  # errors in them are raised now
        return following

    def excess(self, level: Level[AnyScene], most_elements: int) -> str:
        """Compare the number of elements of a body, on average; of high degree, of quadratic ones with as many nodes.

        Copies count as one.
        """
        degree = level.scene.discretisation.displacement_space(level.partitions[0].mesh).degree
        n_elements = sum(len(partition.sides) for partition in level.partitions) // len(level.partitions)
        of_each = " a body" if len(level.keys) > 1 else ""
        return f"{most_elements} elements{of_each}" if n_elements * max(degree, 2) // 2 > most_elements else ""


class _SceneRefinement(_Refinement[Scene, Solution]):
    def solved(self, level: Level[Scene], start: Solution | None) -> Solution:
        """Solve a single load from the solution before, and if that leads nowhere from the beginning."""
        scene, mesh = level.scene, level.partition.mesh
        if start is not None and scene.contact_parts and scene.n_steps == 1:
            solution = run_on_mesh(scene, mesh, start, self.callback)
            if solution.is_converged:
                return solution
        return self._solved(ONE_BODY, level, mesh)

    def expected_seconds(self, level: Level[Scene], solution: Solution, spent: float) -> float:
        """Return how long the next mesh will take: what the last one took, in the proportion of their plans."""
        return spent * make_plan(level.scene, level.partition.mesh).seconds / solution.plan.seconds


@dataclass(frozen=True)
class _AssemblyRefinement(_Refinement[Assembly, AssemblySolution]):
    kind: Kind[Any, AssemblySolution]

    def solved(self, level: Level[Assembly], start: AssemblySolution | None) -> AssemblySolution:
        """Solve from the beginning: contact nodes of several bodies are not carried from mesh to mesh."""
        return self._solved(self.kind, level, level.meshes)

    def expected_seconds(self, level: Level[Assembly], solution: AssemblySolution, spent: float) -> float:
        """Return how long the next meshes will take."""
        return spent * (level.n_elements / solution.n_elements) ** 2
