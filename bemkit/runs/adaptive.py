"""Meshes that follow the solution until the accuracy asked for is reached."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from bemkit.errors import InputError
from bemkit.geometry.mesh import BoundaryMesh
from bemkit.plan import make_plan
from bemkit.results.solution import Solution
from bemkit.runs.density import DensityMeshes
from bemkit.runs.earlier_steps import EarlierSteps
from bemkit.runs.history import ONE_BODY, run_on_mesh
from bemkit.runs.hp import LayeredMeshes
from bemkit.runs.mesh_sequence import Level, MeshSequence
from bemkit.runs.refinement import refined, required_accuracy
from bemkit.runs.step_errors import in_which_step
from bemkit.runs.steps import joined, solved_history
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
    contact = [part.name for part in scene.contact_parts]
    first = scene.mesh.first_partition(scene.shape.outline(), scene.selections, contact, scene.symmetry)
    accuracy = required_accuracy(scene.mesh)
    if scene.n_steps > 1 and scene.discretisation.needs_accuracy:
        raise InputError(
            f"discretisation is {scene.discretisation.method}, and there are {scene.n_steps} load steps: degrees "
            "rise for single loads alone: choose 'quadratic', or another fixed degree"
        )
    sequence = LayeredMeshes if scene.discretisation.takes_layers and scene.n_steps == 1 else DensityMeshes
    refinement = _SceneRefinement(sequence(accuracy), callback, EarlierSteps(done, finished))
    return refined(Level(scene, first), refinement, scene.mesh)


@dataclass(frozen=True)
class _SceneRefinement:
    meshes: MeshSequence
    callback: Callable[[StepRecord], None] | None
    earlier: EarlierSteps[Solution]

    def solved(self, level: Level, start: Solution | None) -> Solution:
        """Solve a single load from the solution before, and if that leads nowhere from the beginning."""
        scene, mesh = level.scene, level.partition.mesh
        if start is not None and scene.contact_parts and scene.n_steps == 1:
            solution = run_on_mesh(scene, mesh, start, self.callback)
            if solution.is_converged:
                return solution
        return joined(*solved_history(ONE_BODY, [scene], mesh, self.callback, *self.earlier.on(level)))

    def error(self, solution: Solution) -> float:
        return self.meshes.error(solution)

    def shown_error(self, solution: Solution) -> str:
        if where := in_which_step(solution):
            return f"{self.error(solution):.1e}{where}"
        energy, tractions = solution.estimated_error, solution.estimated_traction_error
        of_energy = "unknown" if energy is None else f"{energy:.1e}"
        return of_energy if tractions is None else f"{of_energy}, of contact tractions {tractions:.1e}"

    def is_enough(self, solutions: Sequence[Solution]) -> bool:
        return self.meshes.is_enough(solutions)

    def following(self, level: Level, solutions: Sequence[Solution]) -> Level | None:
        following = self.meshes.following(level, solutions)
        if following is not None:
            _ = following.partition.mesh  # whatever is wrong with it is said now
        return following

    def excess(self, level: Level, most_elements: int) -> str:
        """Compare the number of elements; of high degree, of quadratic elements with as many nodes."""
        degree = level.scene.discretisation.displacement_space(level.partition.mesh).degree
        n_elements = len(level.partition.sides) * max(degree, 2) // 2
        return f"{most_elements} elements" if n_elements > most_elements else ""

    def expected_seconds(self, level: Level, solution: Solution, spent: float) -> float:
        return _expected_seconds(solution, spent, level.scene, level.partition.mesh)


def _expected_seconds(solution: Solution, spent: float, scene: Scene, mesh: BoundaryMesh) -> float:
    """Return how long the next mesh will take: what the last one took, in the proportion of their plans."""
    return spent * make_plan(scene, mesh).seconds / solution.plan.seconds
