"""Carry a contact state from one mesh to another, to start a solve near its end."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from bemkit.arrays import FloatArray
from bemkit.contact.body import ContactState
from bemkit.errors import InputError
from bemkit.model.model import Model
from bemkit.results.solution import Solution


def state_on(model: Model, solution: Solution) -> ContactState:
    """Interpolate the contact state of a solution onto the contact nodes of a model.

    Parameters
    ----------
    model : Model
    solution : Solution
        On any mesh, coarse or fine, of a scene with the same contacts.

    Returns
    -------
    ContactState
        Dimensionless, in the units of the model; linear along each contact part. A guess, not a response of the body.

    Raises
    ------
    ValueError
        If the solution lacks one of the contact parts or is not finite.
    """
    table = solution.contact
    displacement, traction = (
        np.stack([getattr(table, name) for name in names], axis=1) for names in (("u_n", "u_t"), ("sigma_n", "sigma_t"))
    )
    return _carried(model, table.part, table.s, displacement, traction)


def take_sticking_state(model: Model, coarse: Model) -> None:
    """Measure the load of a model by the sticking state of a coarser mesh, which is cheaper than its own."""
    state, units = coarse.problem.sticking_state, coarse.units
    displacement, traction = state.displacement * units.displacement, state.traction * units.stress
    names, arc_length = coarse.prepared.names, coarse.prepared.column("arc_length")
    carried = _carried(model, names, arc_length, displacement, traction)
    model.problem.for_all_laws("sticking_state", lambda: carried)


def _carried(
    model: Model, names: Sequence[str], arc_length: FloatArray, displacement: FloatArray, traction: FloatArray
) -> ContactState:
    """Interpolate physical values (n, 2) at contacts onto the contact nodes of a model, dimensionless.

    Parameters
    ----------
    model : Model
    names : sequence of str
        The contact of each value.
    arc_length : (n,) array [m]
    displacement, traction : (n, 2) arrays [m], [Pa]
    """
    values = np.hstack([displacement / model.units.displacement, traction / model.units.stress])
    parts, places = np.array(model.prepared.names), model.prepared.column("arc_length")
    result = np.zeros((len(parts), 4))
    for part in dict.fromkeys(parts.tolist()):
        known = np.flatnonzero(np.array(names, dtype=str) == part)
        if not known.size:
            raise InputError(f"the start has no contact {part!r}: it has {', '.join(dict.fromkeys(names)) or 'none'}")
        known = known[np.argsort(arc_length[known])]
        rows = np.flatnonzero(parts == part)
        for column in range(4):
            result[rows, column] = np.interp(places[rows], arc_length[known], values[known, column])
    return ContactState(result[:, :2], result[:, 2:])
