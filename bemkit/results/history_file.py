"""Load histories in result files: the steps before the last, which the file holds like any result.

/asked           text, the scene or assembly as TOML with all its steps; /scene or /assembly is that of the last step
/steps           table: time, work and energy of each finished step; attribute n_steps
/steps/contact   columns of the contact table, (n_finished, n_contact) arrays; the other columns are those of /contact
/steps/slip      (n_finished, n_contact) array: the path that each node has slipped; last_slip: in the last increment
/steps/state     dimensionless displacement and traction of the contact nodes, from which a run goes on, a row a step

and the ends of all steps, stacked:

/steps/certificate       table: the entries of the certificate of each step
/steps/transitions       table as /transitions, with the number of the step, counted from 0
/steps/bodies/N          boundary fields of body N (of a scene the only one), a row for each step; energy
/steps/friction_bound    (n_finished, n_contact) array, of assemblies; nan without friction
/steps/directions        contact directions, of assemblies, a row for each step
/steps/contacts, /rigid  the numbers of these tables, of assemblies, a row for each step
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import fields, replace
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, TypeVar, cast

import numpy as np

from bemkit.arrays import FloatArray
from bemkit.contact.body import ContactState, SlipHistory
from bemkit.contact.certificate import Certificate
from bemkit.errors import InputError
from bemkit.hdf5 import Reader, rows_of, write_table, write_text
from bemkit.results.assembly_solution import AssemblySolution
from bemkit.results.contact_table import ContactTable, Transition
from bemkit.results.load_history import LoadHistory, LoadStep, StepWork
from bemkit.results.part_forces import ContactForce, RigidResult
from bemkit.results.solution import BoundaryFields, Solution
from bemkit.results.solved_body import SolvedBody
from bemkit.results.tables import CERTIFICATE_ENTRIES, columns_of
from bemkit.scene.assembly import Assembly
from bemkit.scene.load_history import load_steps
from bemkit.scene.scene import Scene
from bemkit.scene.toml import MAX_BYTES, scene_from_toml, scene_to_toml
from bemkit.solvers.base import Status

if TYPE_CHECKING:
    import h5py

_Row = TypeVar("_Row", ContactForce, RigidResult)
_FIELDS = ("displacement", "traction", "traction_dofs", "reaction")
TRANSITION_COLUMNS: Mapping[str, Sequence[str]] = MappingProxyType(
    {"texts": ("part", "from", "to"), "floats": ("x", "y", "s")}
)
_OF_ASSEMBLIES = ("friction_bound", "directions", "contacts", "rigid")
_WORK = ("external_work", "dissipation", "increment_work", "friction_gain")
_FLOATS = ("time", "elastic_energy", *_WORK)
_COUNTS = ("n_increments", "linear_solves")
_CONTACT = ("u_n", "u_t", "sigma_n", "sigma_t", "gap", "clearance")


def write_history(file: h5py.File, loading: LoadHistory) -> None:
    """Write the steps of a load history into an open result file.

    Raises
    ------
    SceneError
        If a step holds a Python function, which a file cannot hold.
    """
    write_text(file, "asked", scene_to_toml(loading.asked))
    group, rows = file.create_group("steps"), [step.as_dict() for step in loading.steps]
    motions, states = [step.motion for step in loading.steps], [step.state for step in loading.steps]
    group.attrs["n_steps"] = loading.n_steps
    write_table(group, columns_of(rows, floats=_FLOATS, integers=_COUNTS))
    for name in (*_CONTACT, "status"):
        column = np.stack([getattr(step.contact, name) for step in loading.steps])
        group[f"contact/{name}"] = column.astype(np.int64) if name == "status" else column
    for name in ("time_step", "slip", "last_slip"):
        group[name] = np.array([getattr(motion, name) for motion in motions])
    group["state"] = np.stack([np.hstack([state.displacement, state.traction]).ravel() for state in states])
    _write_ends(group, [step.end for step in loading.steps])


def read_history(reader: Reader, last: Solution | AssemblySolution) -> LoadHistory | None:
    """Read what `write_history` wrote; None if the file holds no load history.

    Parameters
    ----------
    reader : Reader
    last : Solution or AssemblySolution
        The result in the file.
    """
    if not reader.has("steps"):
        return None
    scene = scene_from_toml(reader.text("asked", MAX_BYTES), name="scene inside")
    rows = rows_of(reader.table("steps", floats=(*_FLOATS, "time_step"), integers=_COUNTS))
    columns = {name: reader.floats(f"steps/contact/{name}") for name in _CONTACT}
    status, slip = reader.integers("steps/contact/status"), reader.floats("steps/slip")
    last_slip, state = reader.floats("steps/last_slip"), reader.floats("steps/state")
    shape = len(rows), last.contact.n_contact
    if not rows or any(column.shape != shape for column in (*columns.values(), status, slip, last_slip)):
        raise InputError(f"the columns of {len(rows)} steps differ in shape")
    if state.shape != (shape[0], 4 * shape[1]):
        raise InputError(f"the states of {shape[1]} contact nodes in {shape[0]} steps have the shape {state.shape}")
    state = state.reshape(*shape, 4)
    tables = [
        replace(last.contact, **{name: column[k].copy() for name, column in columns.items()}, status=status[k].copy())
        for k in range(len(rows))
    ]
    ends = _read_ends(reader, last, scene, tables)
    steps = tuple(
        LoadStep(
            work=StepWork(**{name: row[name] for name in _WORK}),
            n_increments=row["n_increments"],
            linear_solves=row["linear_solves"],
            end=ends[k],
            state=ContactState(state[k, :, :2].copy(), state[k, :, 2:].copy()),
            motion=SlipHistory(row["time"], row["time_step"], slip[k].copy(), last_slip[k].copy()),
        )
        for k, row in enumerate(rows)
    )
    return LoadHistory(scene, int(reader.attributes("steps")["n_steps"]), steps)


def _write_ends(group: h5py.Group, ends: Sequence[Any]) -> None:
    """Write the ends of steps, which are all solutions or all solutions of assemblies, into a group."""
    certificates = [end.certificate.as_dict() for end in ends]
    write_table(group.create_group("certificate"), columns_of(certificates, floats=CERTIFICATE_ENTRIES))
    rows = [{"step": k, **transition.as_dict()} for k, end in enumerate(ends) for transition in end.transitions]
    write_table(group.create_group("transitions"), columns_of(rows, **TRANSITION_COLUMNS, integers=("step",)))
    for number, states in enumerate(zip(*(end.solved_bodies for end in ends), strict=True)):
        for name in _FIELDS:
            group[f"bodies/{number}/{name}"] = np.stack([getattr(state.boundary, name).ravel() for state in states])
        group[f"bodies/{number}/energy"] = np.array([state.energy for state in states])
    assemblies = [end for end in ends if isinstance(end, AssemblySolution)]
    if assemblies:
        group["directions"] = np.stack([end.contact_directions.ravel() for end in assemblies])
        bounds = [end.friction_bound for end in assemblies]
        none = np.full(assemblies[0].contact.n_contact, np.nan)
        group["friction_bound"] = np.stack([none if bound is None else bound for bound in bounds])
        group["contacts"] = _numbers([end.contacts for end in assemblies], ContactForce)
        group["rigid"] = _numbers([tuple(end.rigid.values()) for end in assemblies], RigidResult)


def _read_ends(
    reader: Reader,
    last: Solution | AssemblySolution,
    stated: Scene | Assembly,
    tables: Sequence[ContactTable],
) -> list[Solution | AssemblySolution]:
    """Read what `_write_ends` wrote; all else of each step is taken from the result in the file."""
    n = len(tables)
    rows = rows_of(reader.table("steps/certificate", floats=CERTIFICATE_ENTRIES))
    transitions = _read_transitions(reader, n)
    bodies = [_read_body(reader, f"steps/bodies/{number}", body, n) for number, body in enumerate(last.solved_bodies)]
    if len(rows) != n:
        raise InputError(f"{len(rows)} certificates for {n} steps")
    if isinstance(stated, Assembly) != isinstance(last, AssemblySolution):
        raise InputError("the steps are not those of the result")
    scenes: Sequence[Any] = load_steps(cast(Any, stated))
    names = _OF_ASSEMBLIES if isinstance(last, AssemblySolution) else ()
    columns = {name: reader.floats(f"steps/{name}") for name in names}
    ends: list[Solution | AssemblySolution] = []
    for k, (scene, table, row) in enumerate(zip(scenes[:n], tables, rows, strict=True)):
        entries: dict[str, Any] = {
            "status": Status.CONVERGED,
            "message": Status.CONVERGED.value,
            "certificate": Certificate(**row),
            "contact": table,
            "transitions": transitions[k],
            "loading": None,
        }
        if isinstance(last, Solution):
            entries["boundary"], entries["energy"] = bodies[0][k]
            entries["force_normal"] = float(np.sum(-table.weight * table.sigma_n))
            entries["force_tangential"] = float(np.sum(table.weight * table.sigma_t))
            ends.append(replace(last, scene=scene, **entries))
        else:
            numbers = {name: column[k] for name, column in columns.items()}
            ends.append(_assembly_end(last, scene, [body[k] for body in bodies], numbers, entries))
    return ends


def _assembly_end(
    last: AssemblySolution,
    step: Assembly,
    bodies: Sequence[tuple[BoundaryFields, float]],
    numbers: Mapping[str, FloatArray],
    common: dict[str, Any],
) -> AssemblySolution:
    assembly = step.with_contacts(last.assembly.contacts) if step.touching else step
    scenes = {body.name: assembly.scene_of(body) for body in assembly.placed_bodies}
    bound = numbers["friction_bound"]
    contact_names = [contact.name for contact in last.contacts]
    return replace(
        last,
        assembly=assembly,
        bodies={
            name: replace(body, scene=scenes[name], boundary=boundary, energy=energy)
            for (name, body), (boundary, energy) in zip(last.bodies.items(), bodies, strict=True)
        },
        contact_directions=numbers["directions"].reshape(-1, 2).copy(),
        friction_bound=None if np.isnan(bound).all() else bound.copy(),
        contacts=tuple(_rows(numbers["contacts"], contact_names, ContactForce)),
        rigid={body.name: body for body in _rows(numbers["rigid"], last.rigid, RigidResult)},
        **common,
    )


def _read_transitions(reader: Reader, n_steps: int) -> list[tuple[Transition, ...]]:
    """Return the transitions of each step."""
    rows = rows_of(reader.table("steps/transitions", **TRANSITION_COLUMNS, integers=("step",)))
    return [tuple(Transition.of(row) for row in rows if row["step"] == k) for k in range(n_steps)]


def _read_body(reader: Reader, place: str, body: SolvedBody, n_steps: int) -> list[tuple[BoundaryFields, float]]:
    energies = reader.floats(f"{place}/energy")
    columns = {name: reader.floats(f"{place}/{name}") for name in _FIELDS}
    if any(len(column) != n_steps for column in (energies, *columns.values())):
        raise InputError(f"the fields of {n_steps} steps differ in number")
    shaped = {name: column.reshape(n_steps, *getattr(body.boundary, name).shape) for name, column in columns.items()}
    return [
        (replace(body.boundary, **{name: column[k].copy() for name, column in shaped.items()}), float(energies[k]))
        for k in range(n_steps)
    ]


def _numbers(steps: Sequence[Sequence[object]], kind: type) -> FloatArray:
    """Return the numbers of rows whose first entry is a name: (n_steps, n_rows * n_numbers)."""
    names = [entry.name for entry in fields(kind)][1:]
    return np.array([[float(getattr(row, name)) for row in rows for name in names] for rows in steps])


def _rows(numbers: FloatArray, names: Iterable[str], kind: type[_Row]) -> list[_Row]:
    """Return the rows of one step."""
    n_numbers = len(fields(kind)) - 1
    return [kind(name, *row) for name, row in zip(names, numbers.reshape(-1, n_numbers).tolist(), strict=True)]
