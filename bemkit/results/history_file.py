"""Load histories in result files: what stands there besides the last step, which the file holds like any result.

/asked           text, the scene or assembly as TOML with all its steps; /scene or /assembly is that of the last step
/steps           table: time, work and energy of each finished step; attributes n_steps, time, time_step
/steps/contact   columns of the contact table, (n_finished, n_contact) arrays; the other columns are those of /contact
/steps/slip      (n_finished, n_contact) array: length of the path that each node has slipped; last_slip: (n_contact,)
/steps/state     (n_contact, 4) array: dimensionless displacement and traction, from which a run goes on
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from bemkit.contact.body import ContactState
from bemkit.contact.slip_history import SlipHistory
from bemkit.errors import InputError
from bemkit.hdf5 import Reader, rows_of, write_table, write_text
from bemkit.results.contact_table import ContactTable
from bemkit.results.load_history import LoadHistory, LoadStep, StepWork
from bemkit.scene.toml import MAX_BYTES, scene_from_toml, scene_to_toml

if TYPE_CHECKING:
    import h5py

_WORK = ("external_work", "dissipation", "increment_work")
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
    motion = loading.motion
    group.attrs.update({"n_steps": loading.n_steps, "time": motion.time, "time_step": motion.time_step})
    floats = {name: np.array([row[name] for row in rows], dtype=float) for name in _FLOATS}
    write_table(group, floats | {name: np.array([row[name] for row in rows], dtype=np.int64) for name in _COUNTS})
    for name in (*_CONTACT, "status"):
        column = np.stack([getattr(step.contact, name) for step in loading.steps])
        group[f"contact/{name}"] = column.astype(np.int64) if name == "status" else column
    group["slip"] = np.stack([step.slip for step in loading.steps])
    group["last_slip"] = motion.last_slip
    group["state"] = np.concatenate([loading.state.displacement, loading.state.traction], axis=1)


def read_history(reader: Reader, contact: ContactTable) -> LoadHistory | None:
    """Read what `write_history` wrote; None if the file holds no load history.

    Parameters
    ----------
    reader : Reader
    contact : ContactTable
        Of the last step.
    """
    if not reader.has("steps"):
        return None
    asked = scene_from_toml(reader.text("asked", MAX_BYTES), name="scene inside")
    marks = reader.attributes("steps")
    rows = rows_of(reader.table("steps", floats=_FLOATS, integers=_COUNTS))
    columns = {name: reader.floats(f"steps/contact/{name}") for name in _CONTACT}
    status, slip, state = (
        reader.integers("steps/contact/status"),
        reader.floats("steps/slip"),
        reader.floats("steps/state"),
    )
    shape = len(rows), contact.n_contact
    if not rows or any(column.shape != shape for column in (*columns.values(), status, slip)):
        raise InputError(f"the columns of {len(rows)} steps differ in shape")
    if state.shape != (contact.n_contact, 4):
        raise InputError(f"the state of {contact.n_contact} contact nodes has the shape {state.shape}")
    steps = []
    for k, row in enumerate(rows):
        own = {name: column[k].copy() for name, column in columns.items()}
        steps.append(
            LoadStep(
                time=row["time"],
                work=StepWork(**{name: row[name] for name in _WORK}),
                elastic_energy=row["elastic_energy"],
                n_increments=row["n_increments"],
                linear_solves=row["linear_solves"],
                contact=replace(contact, **own, status=status[k].copy()),
                slip=slip[k].copy(),
            )
        )
    motion = SlipHistory(
        float(marks["time"]), float(marks["time_step"]), steps[-1].slip, reader.floats("steps/last_slip")
    )
    end = ContactState(state[:, :2].copy(), state[:, 2:].copy())
    return LoadHistory(asked, int(marks["n_steps"]), tuple(steps), end, motion)
