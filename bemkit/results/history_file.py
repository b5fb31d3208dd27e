"""Load histories in result files: what stands there besides the last step, which the file holds like any result.

/asked           text, the scene or assembly as TOML with all its steps; /scene or /assembly is that of the last step
/steps           table: time, work and energy of each finished step; attribute n_steps
/steps/contact   columns of the contact table, (n_finished, n_contact) arrays; the other columns are those of /contact
/steps/slip      (n_finished, n_contact) array: the path that each node has slipped; last_slip: in the last increment
/steps/state     dimensionless displacement and traction of the contact nodes, from which a run goes on, a row a step

and the fields of the bodies at the end of each step, see `bemkit.results.step_fields`.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from bemkit.contact.body import ContactState, SlipHistory
from bemkit.errors import InputError
from bemkit.hdf5 import Reader, rows_of, write_table, write_text
from bemkit.results.load_history import LoadHistory, LoadStep, StepWork
from bemkit.results.step_fields import read_ends, write_ends
from bemkit.scene.toml import MAX_BYTES, scene_from_toml, scene_to_toml

if TYPE_CHECKING:
    import h5py

    from bemkit.results.assembly_solution import AssemblySolution
    from bemkit.results.solution import Solution

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
    floats = {name: np.array([row[name] for row in rows], dtype=float) for name in _FLOATS}
    write_table(group, floats | {name: np.array([row[name] for row in rows], dtype=np.int64) for name in _COUNTS})
    for name in (*_CONTACT, "status"):
        column = np.stack([getattr(step.contact, name) for step in loading.steps])
        group[f"contact/{name}"] = column.astype(np.int64) if name == "status" else column
    group["time_step"] = np.array([motion.time_step for motion in motions])
    group["slip"] = np.stack([motion.slip for motion in motions])
    group["last_slip"] = np.stack([motion.last_slip for motion in motions])
    group["state"] = np.stack(
        [np.concatenate([state.displacement, state.traction], axis=1).ravel() for state in states]
    )
    write_ends(group, [step.end for step in loading.steps])


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
    if not reader.has("steps/bodies"):
        raise InputError("its steps are of an older bemkit, which did not keep their fields: run its scene again")
    asked = scene_from_toml(reader.text("asked", MAX_BYTES), name="scene inside")
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
    ends = read_ends(reader, last, asked, tables)
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
    return LoadHistory(asked, int(reader.attributes("steps")["n_steps"]), steps)
