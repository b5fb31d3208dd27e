"""Carry a contact state from one mesh to another, to start a solve near its end."""

from __future__ import annotations

import numpy as np

from bemkit.contact.body import ContactState
from bemkit.errors import InputError
from bemkit.model.model import Model
from bemkit.results.solved_problem import SolvedProblem


def state_on(model: Model, solution: SolvedProblem) -> ContactState:
    """Interpolate the contact state of a solution onto the contact nodes of a model.

    Parameters
    ----------
    model : Model
    solution : Solution or AssemblySolution
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
    table, units = solution.contact, model.units
    scales = {
        "u_n": units.displacement,
        "u_t": units.displacement,
        "sigma_n": units.stress,
        "sigma_t": units.stress,
    }
    parts, arc_length = model.prepared.names, model.prepared.column("arc_length")
    values = {name: np.zeros(len(parts)) for name in scales}
    for part in dict.fromkeys(parts):
        known = np.flatnonzero(table.rows(part))
        if not known.size:
            raise InputError(f"the start has no contact {part!r}: it has {', '.join(table.parts)}")
        own = np.flatnonzero(np.equal(parts, part))
        known = known[np.argsort(table.s[known])]
        for name, scale in scales.items():
            values[name][own] = np.interp(arc_length[own], table.s[known], getattr(table, name)[known]) / scale
    return ContactState(
        np.stack([values["u_n"], values["u_t"]], axis=1), np.stack([values["sigma_n"], values["sigma_t"]], axis=1)
    )
