"""Result files: HDF5 with a versioned layout, written step by step, safe to read.

A result file holds plain arrays, texts and numbers only, so any HDF5 program can read it, and reading one from a
stranger runs no code. The layout, version 7 (files of other versions are refused):

    /                attributes format = "bemkit-result" and schema_version
    /provenance      attributes
    /scene           text, the scene as TOML, with all its load steps
    /listed          text, the scene as TOML with all its contacts listed, if it found them by `touching`
    /plan            text: linear solver, sizes and counts as JSON
    /bodies          table: name of each body, and its numbers of rows in the arrays that follow
    /meshes/N        mesh of body N: nodes, elements, part_elements, table parts; attribute is_exterior,
                     with a symmetry also symmetry_x, symmetry_y;
                     with curved elements also element_curve and element_span
    /points, /centres    of displacements and elements, one body after the other
    /contact_nodes   table: part, place and weight of each contact node
    /steps/0001      a group for each step of a load history, one for a single load:
        contact          table: displacement, traction, clearance, status, direction and friction bound of each contact
                         node; of a load history also what has slipped, and the dimensionless state from which a
                         run goes on
        displacement, traction, traction_dofs, reaction    one body after the other
        outcome          of a load history: text, all else of the step as JSON
        scene            text, of steps that are scenes of their own: the scene of the step
    /last            the group of the last step
    /outcome         text: status, certificate, transitions, history, timings, warnings ... of the whole run as JSON;
                     there is none until the last step is finished
    /derived         text, for other programs: violations between the nodes, resultants of contacts and parts as JSON

A table is a dataset of rows with named columns. Arrays of /last and of the groups above it have an attribute `meaning`
and, where the scene names its units, `unit`, tables `meanings` and `units`; see `bemkit.results.file_meanings`.
"""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

import numpy as np

from bemkit.atomic_files import OutputFileError
from bemkit.errors import InputError
from bemkit.geometry.curves import Curve
from bemkit.geometry.mesh import BoundaryMesh
from bemkit.geometry.outline import Surface
from bemkit.geometry.symmetry.lines import Symmetry
from bemkit.hdf5 import FileFormat, Reader, ResultFileError, write_array, write_table
from bemkit.plan.plan import Plan
from bemkit.results.file_meanings import annotate
from bemkit.results.load_history import LoadHistory, LoadStep
from bemkit.results.solution import Solution
from bemkit.results.solved_scene import part_facts
from bemkit.results.solved_steps import following
from bemkit.results.step_group import (
    NODES,
    BodyLayout,
    StepLayout,
    read_load_step,
    read_outcome,
    read_step,
    write_outcome,
    write_step,
)
from bemkit.scene.body import Body
from bemkit.scene.load_history import load_steps
from bemkit.scene.scene import Scene
from bemkit.scene.serialisation import structure
from bemkit.scene.toml import SceneError, scene_from_toml, scene_to_toml
from bemkit.scene.written_tables import unstructure
from bemkit.sealed_file import GrowingFile
from bemkit.solvers.base import Status

if TYPE_CHECKING:
    from typing import Self

    import h5py

__all__ = ["OutputFileError", "ResultFileError", "ResultWriter", "check_result_target", "read_result", "write_result"]

_MOST_BYTES = 100_000_000
"""Size of a scene as text, which holds the points of measured profiles."""
FORMAT = FileFormat("bemkit-result", 7, "bemkit result", "bemkit run -o")
_MAX_PLAN = 1_000_000


def check_result_target(path: str | Path) -> Path:
    """Check, before any computation, that a result can be written to a file.

    Raises
    ------
    OutputFileError
        If the folder cannot be written to, or a file that is not a bemkit result has its name.
    """
    if str(path) == "-":
        raise OutputFileError("- is standard output, which cannot take a binary result: give a file name")
    return FORMAT.check_target(path)


def write_result(path: str | Path, solution: Solution) -> None:
    """Write a solution to an HDF5 file, completely or not at all.

    Parameters
    ----------
    path : str or Path
        Path of the file, usually ``.h5``.
    solution : Solution

    Raises
    ------
    OutputFileError
        If the file cannot be written, or a file that is not a bemkit result has its name.
    SceneError
        If the scene holds a Python function, which a file cannot hold.
    """
    with ResultWriter(path) as writer:
        writer.finish(solution)


class ResultWriter:
    """Writes a result file that grows by one group for each finished step of a load history.

    Parameters
    ----------
    path : str or Path
        Path of the file. An existing result is replaced when the first step is written.

    Raises
    ------
    OutputFileError
        If the file cannot be written, or the name belongs to a file that is not a bemkit result.
    """

    def __init__(self, path: str | Path) -> None:
        self._target = check_result_target(path)
        self._growing: GrowingFile | None = None
        self._written: tuple[LoadStep, ...] = ()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *reason: object) -> None:
        if self._growing is not None:
            self._growing.close()

    def append(self, solution: Solution) -> None:
        """Append the new steps of a load history to the file on the disk, given the solution of the last of them.

        Another history than before, on a finer mesh for example, begins the file anew.

        Raises
        ------
        OutputFileError
            If the file cannot be written.
        SceneError
            If the scene holds a Python function, which a file cannot hold.
        """
        self._grown(solution, is_one_step=True).commit()

    def finish(self, solution: Solution) -> None:
        """Replace the file on the disk by the whole result; errors as for `append`."""
        growing = self._grown(solution, is_one_step=False)
        write_outcome(growing.file, solution)
        write_array(growing.file, "derived", json.dumps(_derived(solution)))
        growing.file["last"] = growing.file[_group(max(len(self._written), 1))]
        annotate(growing.file, solution.units)
        growing.finish()

    def _grown(self, solution: Solution, *, is_one_step: bool) -> GrowingFile:
        """Return the open file with all steps of a solution: that of the last step, or one with the records of all."""
        steps = () if solution.loading is None else solution.loading.steps
        n_written = len(self._written)
        if self._growing is None or steps[:n_written] != self._written:
            self._growing, n_written = self._begun(solution), 0
        file = self._growing.file
        for number, step in enumerate(steps[n_written:], start=n_written + 1):
            group = file.create_group(_group(number))
            write_step(group, solution if is_one_step and number == len(steps) else solution.at_step(number), step)
            if solution.loading is not None and solution.stated.n_steps != solution.loading.n_steps:
                write_array(group, "scene", scene_to_toml(cast(Any, step.end).stated))
        if not steps:
            write_step(file.create_group(_group(1)), solution, None)
        self._written = steps
        return self._growing

    def _begun(self, solution: Solution) -> GrowingFile:
        """Return a new file with the data that all steps share."""
        texts = {"scene": scene_to_toml(solution.stated), "plan": json.dumps(unstructure(solution.plan))}
        if solution.stated.touching:
            texts["listed"] = scene_to_toml(solution.scene)
        if self._growing is not None:
            self._growing.close()
        growing = GrowingFile(self._target)
        FORMAT.mark(growing.file)
        for name, text in texts.items():
            write_array(growing.file, name, text)
        if solution.loading is not None:
            growing.file.create_group("steps").attrs["n_steps"] = solution.loading.n_steps
        _write_layout(growing.file, solution)
        return growing


def read_result(path: str | Path) -> Solution:
    """Read a solution from a result file.

    Parameters
    ----------
    path : str or Path
        Of a file written by `write_result`, `bemkit.run` or ``bemkit run -o``.

    Returns
    -------
    Solution
        Its status is UNFINISHED if the file ends before its load history.

    Raises
    ------
    ResultFileError
        If the file is not a complete bemkit result of a known version.
    """
    with FORMAT.opened(path) as reader:
        try:
            problem = _read_problem(reader, "scene")
            listed = _read_problem(reader, "listed") if reader.has("listed") else problem
        except SceneError as error:
            raise reader.error(str(error)) from error
        try:
            layout = _read_layout(reader, listed)
            if "n_steps" not in reader.attributes("steps"):
                return read_step(reader, _group(1), "outcome", problem, layout)
            return _read_history(reader, problem, listed, layout)
        except (ValueError, LookupError, TypeError, AttributeError, OverflowError, RecursionError) as error:
            raise reader.error(f"inconsistent content ({error})") from error


def _derived(solution: Solution) -> dict[str, Any]:
    """Return results that follow from the fields."""
    between, contacts = solution.between_nodes, [contact.as_dict() for contact in solution.contacts]
    return {
        "between_nodes": None if between is None else between.as_dict(),
        "contacts": contacts,
        "parts": part_facts(solution),
    }


def _group(number: int) -> str:
    """Return the path of the group of a step, counted from 1."""
    return f"steps/{number:04d}"


def _read_problem(reader: Reader, name: str) -> Scene:
    return scene_from_toml(reader.text(name, _MOST_BYTES), name="scene inside")


def _read_history(reader: Reader, asked: Scene, listed: Scene, layout: StepLayout) -> Solution:
    """Return the result of the steps in the file; `listed` has all contacts."""
    n_steps = int(reader.attributes("steps")["n_steps"])
    groups = [f"steps/{name}" for name in reader.names("steps")]
    problems = (
        [_read_problem(reader, f"{group}/scene") for group in groups] if asked.n_steps != n_steps else load_steps(asked)
    )
    if not 0 < len(groups) <= min(n_steps, len(problems)):
        raise InputError(f"{len(groups)} of {n_steps} steps, where {len(problems)} were requested")
    steps: list[LoadStep] = []
    whole: Solution | None = None
    for number, (group, problem) in enumerate(zip(groups, problems, strict=False), start=1):
        if problem.touching:
            problem = problem.with_contacts(listed.contacts)
        end = read_step(reader, group, f"{group}/outcome", problem, layout)
        steps.append(read_load_step(reader, group, end))
        whole = end if n_steps == 1 else following(whole, end, asked, number, n_steps)
    loading = LoadHistory(asked, n_steps, tuple(steps))
    assert whole is not None  # there is a step
    if not reader.has("outcome"):
        return replace(whole, status=Status.UNFINISHED, loading=loading)
    return replace(end, **read_outcome(reader, "outcome"), loading=loading)


def _write_layout(file: h5py.File, solution: Solution) -> None:
    """Write what all steps have in common: meshes, points, contact nodes."""
    bodies = solution.bodies.values()
    fields = [body.boundary for body in bodies]
    counts = {name: [len(getattr(each, name)) for each in fields] for name in _COUNTED}
    columns = {f"n_{name}": np.array(count, dtype=np.int64) for name, count in counts.items()}
    write_table(file, "bodies", {"name": list(solution.bodies), **columns})
    for number, body in enumerate(bodies):
        _write_mesh(file.create_group(f"meshes/{number}"), body.mesh)
    for name in ("points", "centres"):
        write_array(file, name, np.concatenate([getattr(each, name) for each in fields]))
    table = solution.contact
    write_table(file, "contact_nodes", {"part": list(table.part), **{name: getattr(table, name) for name in NODES}})


def _read_layout(reader: Reader, problem: Scene) -> StepLayout:
    """Read what `_write_layout` wrote."""
    counted = [f"n_{name}" for name in _COUNTED]
    table = reader.table("bodies", texts=("name",), integers=counted)
    n_points, n_centres = table["n_points"], table["n_centres"]
    points = np.split(reader.rows("points", int(n_points.sum())), np.cumsum(n_points)[:-1])
    centres = np.split(reader.rows("centres", int(n_centres.sum())), np.cumsum(n_centres)[:-1])
    bodies = tuple(
        BodyLayout(name, _read_mesh(reader, f"meshes/{k}", curves), points[k], centres[k], *map(int, counts))
        for k, (name, curves, *counts) in enumerate(
            zip(table["name"], _curves(problem), table["n_traction_dofs"], table["n_reaction"], strict=True)
        )
    )
    for body in bodies:
        if len(body.centres) != body.mesh.n_elements:
            raise InputError(f"{len(body.centres)} tractions for {body.mesh.n_elements} elements")
    nodes = reader.table("contact_nodes", texts=("part",), floats=NODES)
    plan = structure(reader.json("plan", _MAX_PLAN), Plan)
    provenance = {name: str(value) for name, value in reader.attributes("provenance").items()}
    return StepLayout(bodies, nodes | {"part": tuple(nodes["part"])}, plan, provenance)


_COUNTED = ("points", "centres", "traction_dofs", "reaction")


def _curves(problem: Scene) -> list[Callable[[], tuple[Curve, ...]]]:
    """Return for each body the function that gives its curves, which the file names by their numbers."""
    return [partial(_curves_of, problem, body) for body in problem.placed_bodies]


def _curves_of(problem: Scene, body: Body) -> tuple[Curve, ...]:
    scene = problem.scene_of(body)
    return body.placement.mesh(scene.divided([part.name for part in scene.contact_parts])).curves


def _write_mesh(group: h5py.Group, mesh: BoundaryMesh) -> None:
    lines = {} if mesh.symmetry is None else {"symmetry_x": mesh.symmetry.x, "symmetry_y": mesh.symmetry.y}
    lines = {name: place for name, place in lines.items() if place is not None}
    strip = {} if mesh.surface is None else {"is_periodic": int(mesh.surface.is_periodic)}
    group.attrs.update({"is_exterior": int(mesh.is_exterior), **lines, **strip})
    write_array(group, "nodes", mesh.nodes)
    write_array(group, "elements", mesh.elements.astype(np.int64))
    if mesh.element_curve is not None and mesh.element_span is not None:
        write_array(group, "element_curve", mesh.element_curve.astype(np.int64))
        write_array(group, "element_span", mesh.element_span)
    counts = np.array([len(elements) for elements in mesh.parts.values()], dtype=np.int64)
    write_table(group, "parts", {"name": list(mesh.parts), "n_elements": counts})
    elements = np.concatenate([np.zeros(0, np.int64), *mesh.parts.values()]).astype(np.int64)
    write_array(group, "part_elements", elements)


def _read_mesh(reader: Reader, place: str, curves: Callable[[], tuple[Curve, ...]]) -> BoundaryMesh:
    parts_table = reader.table(f"{place}/parts", texts=("name",), integers=("n_elements",))
    ends = np.cumsum(parts_table["n_elements"])
    pieces = np.split(reader.integers(f"{place}/part_elements"), ends)
    is_curved = reader.has(f"{place}/element_curve")
    marks = reader.attributes(place)
    x, y = marks.get("symmetry_x"), marks.get("symmetry_y")
    return BoundaryMesh(
        nodes=reader.floats(f"{place}/nodes"),
        elements=reader.integers(f"{place}/elements"),
        parts=dict(zip(parts_table["name"], pieces, strict=False)),
        # the file names curves by their number in the outline; the outline itself is in the scene
        curves=curves() if is_curved else (),
        element_curve=reader.integers(f"{place}/element_curve") if is_curved else None,
        element_span=reader.floats(f"{place}/element_span") if is_curved else None,
        is_exterior=bool(marks["is_exterior"]),
        symmetry=None if x is None and y is None else Symmetry(x=x, y=y),
        surface=Surface(bool(marks["is_periodic"])) if "is_periodic" in marks else None,
    )
