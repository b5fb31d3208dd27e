"""The runs of an error study, element types times solvers times sequences of meshes, and what is measured of each.

Measured are run times, memory and errors, or only the errors where runs at the same time would disturb each other.
"""

from __future__ import annotations

import tracemalloc
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any

import numpy as np

from bemkit.errors import InputError
from bemkit.geometry.meshing.discretise import Algebraic, Grading, Uniform
from bemkit.reference.compare import MEASURES, Reference, errors_of, sampled_fields
from bemkit.runs.run import run as solve
from bemkit.scene.discretisation import Discretisation, Galerkin, MeshOptions
from bemkit.scene.registry import DISCRETISATIONS, SOLVERS
from bemkit.scene.scene import Scene
from bemkit.solvers.base import ContactSolver
from bemkit.studies.accuracy.records import STAGES, ErrorRecord
from bemkit.studies.engine import Attempt, StudyError, Task, attempt

_NAN = float("nan")


@dataclass(frozen=True)
class MeshSequence:
    """Meshes of growing size: of given numbers of elements, or, without a grading, of given accuracies.

    Parameters
    ----------
    name : str
        A word for tables and figures.
    sizes : tuple of float
        Keys of the meshes, from coarse to fine: numbers of elements, or accuracies.
    grading : Grading or None
    most_elements : int, optional
        Limit of meshes that follow an accuracy.
    """

    name: str
    sizes: tuple[float, ...]
    grading: Grading | None = None
    most_elements: int | None = None

    def options(self, scene: Scene, size: float) -> MeshOptions:
        """Return the options of one mesh; densities of sides are those of the scene."""
        if self.grading is None:
            return MeshOptions(accuracy=size, most_elements=self.most_elements)
        return MeshOptions(elements=int(size), grading=self.grading, density=scene.mesh.density)


def uniform(elements: tuple[int, ...]) -> MeshSequence:
    """Return uniform meshes of given numbers of elements."""
    return MeshSequence("uniform", elements, Uniform())


def graded(elements: tuple[int, ...], exponent: float = 3.0) -> MeshSequence:
    """Return meshes graded towards corners and ends of parts like a power of the distance."""
    return MeshSequence("graded", elements, Algebraic(exponent))


def adaptive(accuracies: tuple[float, ...], most_elements: int = 500) -> MeshSequence:
    """Return meshes that follow the solution until an accuracy is reached.

    None has more than the given elements; a run that ends there keeps the best result so far. There is no limit of
    time, which would make results differ from run to run.
    """
    return MeshSequence("adaptive", accuracies, most_elements=most_elements)


@dataclass(frozen=True)
class Run:
    """One record to compute: its key, and a problem, of which mesh, elements and solver are changed.

    The size is a number of elements, or the accuracy that is asked for.
    """

    discretisation: str
    map: str
    meshes: str
    solver: str
    size: float
    problem: Scene = field(repr=False)
    changes: Mapping[str, Any] = field(repr=False)

    @property
    def scene(self) -> Scene:
        """The scene to run; InputError if it does not allow the element type or the mesh."""
        return replace(self.problem, **self.changes)

    @property
    def key(self) -> tuple[str, str, str, float]:
        """Key of a record in its study."""
        return self.discretisation, self.meshes, self.solver, self.size


def all_runs(
    scene: Scene,
    discretisations: Sequence[Discretisation | str],
    meshes: Sequence[MeshSequence],
    solvers: Sequence[ContactSolver],
) -> tuple[Run, ...]:
    """Combine element types, meshes and solvers.

    The word "hp" among the element types is for rising degrees. Constant elements have no error estimate and so no
    adaptive meshes, rising degrees no others.

    Its mesh, discretisation and solver are replaced. A combination that the scene does not allow becomes a refused row.

    Raises
    ------
    StudyError
        If nothing is left to run, two runs have one key, the scene has no contact, or a size is not a size of a
        mesh.
    """
    if not scene.contact_parts:
        raise StudyError("no part of the scene is in contact: errors are measured along the contact boundary")
    try:
        runs = tuple(
            _run(scene, element, sequence, solver, size)
            for element in discretisations
            for sequence in meshes
            if _goes_with(element, sequence)
            for solver in solvers
            for size in sequence.sizes
        )
    except InputError as error:  # of the mesh options, which name the number
        raise StudyError(str(error)) from error
    if not runs:
        raise StudyError(
            "no run is possible: give at least one element type, solver and mesh, with constant elements other than "
            "adaptive meshes, for which they have no error estimate, and with 'hp' adaptive ones"
        )
    keys = [run.key for run in runs]
    repeated = next((key for k, key in enumerate(keys) if key in keys[:k]), None)
    if repeated is not None:
        raise StudyError(f"{', '.join(map(str, repeated[:3]))} of size {repeated[3]:g} is given twice: remove one")
    return runs


def _goes_with(element: Discretisation | str, sequence: MeshSequence) -> bool:
    if isinstance(element, str):
        return sequence.grading is None
    return element.estimates_error or sequence.grading is not None


def _run(
    scene: Scene, element: Discretisation | str, sequence: MeshSequence, solver: ContactSolver, size: float
) -> Run:
    options = sequence.options(scene, size)
    if isinstance(element, str):
        word, element, options = element, Galerkin(2), replace(options, rising_degrees=True)
    else:
        word = _name_of(element)
    changes = {"discretisation": element, "mesh": options, "solver": solver}
    return Run(word, element.method, sequence.name, SOLVERS.name_of(solver), float(size), scene, changes)


def _name_of(element: Discretisation) -> str:
    """Return the name of an element type in a study: its word in scene files, or its degree."""
    word = DISCRETISATIONS.name_of(element)
    return f"degree {element.degree}" if word == "galerkin" and isinstance(element, Galerkin) else word


def error_tasks(runs: Sequence[Run], reference: Reference, repeat: int | None = None) -> tuple[Task[ErrorRecord], ...]:
    """Return the tasks of a study, for `bemkit.studies.engine.compute`.

    Each run is timed `repeat` times, after one that warms up and before one that measures the memory. By default
    neither is measured, and both are nan: runs at the same time would disturb each other.

    Raises
    ------
    StudyError
        If `repeat` is not positive.
    """
    if repeat is not None and repeat < 1:
        raise StudyError(f"repeat is {repeat}: give at least one timed repetition")
    return tuple(
        Task(
            run.key,
            f"{run.discretisation}, {run.meshes} {run.size:g}, {run.solver}",
            partial(measure, run, reference, repeat),
        )
        for run in runs
    )


def measure(run: Run, reference: Reference, repeat: int | None) -> ErrorRecord:
    """Run once to warm up and for the errors, then repeatedly for the times, then once for the memory."""
    first = _attempt(run)
    names = {"total": "seconds", **{stage: f"seconds_{stage}" for stage in STAGES}}
    if repeat is None or first.solution is None or not first.solution.is_certified:
        return _record(run, first, reference, dict.fromkeys([*names.values(), "peak_memory"], _NAN))
    solutions = [again for _ in range(repeat) if (again := _attempt(run).solution) is not None]
    seconds = {name: float(np.median([each.timings[key] for each in solutions])) for key, name in names.items()}
    return _record(run, first, reference, {**seconds, "peak_memory": _peak_memory(run)})


def _attempt(run: Run) -> Attempt:
    # the scene is made inside: what it does not allow is an answer too
    return attempt(lambda: solve(run.scene))


def _peak_memory(run: Run) -> float:
    """Return the largest memory [bytes] that one run holds at a time; tracing it slows the run down."""
    tracemalloc.start()
    try:
        _attempt(run)
        return float(tracemalloc.get_traced_memory()[1])
    finally:
        tracemalloc.stop()


def _record(run: Run, found: Attempt, reference: Reference, measured: Mapping[str, float]) -> ErrorRecord:
    solution = found.solution
    errors: dict[str, Any] = dict.fromkeys(MEASURES, _NAN)
    if solution is not None and solution.is_certified:
        errors = errors_of(sampled_fields(solution, reference.places), reference)
    return ErrorRecord(
        discretisation=run.discretisation,
        map=run.map,
        meshes=run.meshes,
        solver=run.solver,
        size=run.size,
        status=found.status,
        elements=0 if solution is None else solution.mesh.n_elements,
        unknowns=0 if solution is None else solution.boundary.displacement.size,
        contact_nodes=0 if solution is None else solution.contact.n_contact,
        linear_solves=0 if solution is None else solution.linear_solves,
        outer_steps=0 if solution is None else solution.outer_steps,
        estimated_error=_NAN if solution is None or solution.estimated_error is None else solution.estimated_error,
        message="" if found.is_converged else found.message,
        **measured,
        **errors,
    )
