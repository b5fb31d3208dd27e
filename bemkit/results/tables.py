"""Results as text: CSV tables and the JSON summary."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import fields, replace
from itertools import chain
from typing import Any

import numpy as np

from bemkit.arrays import FloatArray
from bemkit.contact.certificate import Certificate
from bemkit.errors import InputError
from bemkit.geometry.local_values import values_on_elements
from bemkit.geometry.vectors import components_before
from bemkit.results.file_meanings import CONTACT_COLUMNS
from bemkit.results.pressure_distribution import PressureShare, pressure_shares
from bemkit.results.solution import Solution
from bemkit.results.solved_body import SolvedBody
from bemkit.results.solved_scene import part_facts
from bemkit.results.stress_measures import STRESSES
from bemkit.scene.unit_names import QUANTITIES, UnitNames, unit_of
from bemkit.solvers.base import StepRecord
from bemkit.table import Column, Table, json_text

TABLES = ("contact", "boundary", "history", "steps", "forces", "pressures")
_HISTORY = (
    *("step", "linear_solves", "n_separated", "n_stick", "n_slip", "n_changed", "relative_change"),
    *(entry.name for entry in fields(Certificate)),
    *("message", "worst"),
)
_BOUNDARY = (
    Column("body", "", "name of the body"),
    Column("element", "", "index of the element"),
    Column("u_x", "m", "displacement along x at the centre", ".6g"),
    Column("u_y", "m", "displacement along y at the centre", ".6g"),
    Column("t_x", "Pa", "mean traction along x", ".6g"),
    Column("t_y", "Pa", "mean traction along y", ".6g"),
    Column("sigma_xx", "Pa", "stress along x at the centre", ".6g"),
    Column("sigma_yy", "Pa", "stress along y at the centre", ".6g"),
    Column("sigma_xy", "Pa", "shear stress at the centre", ".6g"),
    Column("hoop", "Pa", "normal stress along the boundary at the centre", ".6g"),
    Column("von_mises", "Pa", "equivalent stress of von Mises at the centre", ".6g"),
)
RESULTANT_COLUMNS = (
    Column("body", "", "name of the body"),
    Column("name", "", "part of the boundary, or contact"),
    Column("force_x", "N/m", "resultant along x, on the body", ".6g"),
    Column("force_y", "N/m", "resultant along y, on the body", ".6g"),
    Column("moment", "N m/m", "moment about the origin, anticlockwise", ".6g"),
    Column("force_normal", "N/m", "pressing force", ".6g"),
    Column("force_tangential", "N/m", "friction force", ".6g"),
    Column("contact_length", "m", "length in contact", ".6g"),
    Column("peak_pressure", "Pa", "largest pressure of a node", ".6g"),
    Column("largest_slip", "m", "of nodes in contact", ".6g"),
    Column("contact_fraction", "", "share of the part that is in contact", ".6g"),
    Column("peak_x", "m", "first coordinate of the node with the peak pressure", ".6g"),
    Column("peak_y", "m", "second coordinate", ".6g"),
)
"""Columns of the resultants on parts and contacts."""
_STEPS = (
    Column("time", "s", "at the end of the step", ".6g"),
    *(Column(name, "J/m", "in the step", ".6g") for name in ("external_work", "dissipation", "increment_work")),
    Column("friction_gain", "J/m", "work that friction gives in the step", ".6g"),
    Column("elastic_energy", "J/m", "at the end of the step", ".6g"),
    Column("force_normal", "N/m", "pressing force of all contacts", ".6g"),
    Column("force_tangential", "N/m", "friction force of all contacts", ".6g"),
    Column("mean_displacement", "m", "mean displacement of the contact nodes along the tangent", ".6g"),
)

_HEADS = {
    "contact": CONTACT_COLUMNS,
    "boundary": (*CONTACT_COLUMNS[:2], *_BOUNDARY, CONTACT_COLUMNS[-1]),
    "forces": RESULTANT_COLUMNS,
    "steps": _STEPS,
    "history": (),
}


def to_csv(solution: Solution, table: str) -> str:
    """Return one table of a solution as comma-separated values with a header line.

    Parameters
    ----------
    solution : Solution
    table : str
        ``"contact"``: one row per contact node; ``"boundary"``: one row per element, values at its centre;
        ``"history"``: one row per step of the solver; ``"steps"``: one row per step of the load history; ``"forces"``:
        the resultants on each part; ``"pressures"``: the distribution of pressures on each contact.

    Raises
    ------
    InputError
        If there is no table of that name, or no load history.
    """
    return table_of(solution, table).to_csv()


def table_of(solution: Solution, table: str) -> Table:
    """Return one table of a solution; see `to_csv`."""
    if table not in TABLES:
        raise InputError(f"table is {table!r}: give one of {', '.join(TABLES)}")
    if table == "pressures":
        shares = (pressure_shares(solution.contact, part) for part in solution.contact.parts)
        found = Table.from_records(PressureShare, chain.from_iterable(shares))
        return Table(tuple(in_units(head, solution) for head in found.columns), found.rows)
    arrays = _columns(solution, table)
    known = {head.name: in_units(head, solution) for head in _HEADS[table]}
    return Table.from_arrays([known.get(name) or Column(name) for name in arrays], arrays)


def in_units(head: Column, solution: Solution) -> Column:
    """Return a column with the name of its unit in the scene, without names in SI units."""
    names = solution.units or UnitNames("m", "Pa").over_thickness(solution.scene.thickness)
    unit = head.unit.removeprefix("1/")
    inverse = head.unit.removesuffix(unit)
    return replace(head, unit=inverse + unit_of(QUANTITIES[unit], names)) if unit in QUANTITIES else head


def history_columns(history: Sequence[StepRecord]) -> dict[str, list[Any]]:
    """Return the convergence history as columns, the entries of the certificate and the worst of them included."""
    rows = [vars(record) | vars(record.certificate) | {"worst": record.certificate.worst} for record in history]
    return {name: [row[name] for row in rows] for name in _HISTORY}


def to_json(solution: Solution) -> str:
    """Return the summary as one JSON object; numbers that are not finite become null."""
    return json_text(solution.summary())


def element_displacement(body: SolvedBody) -> FloatArray:
    """Return the displacement at the element centres, (n_elements, 2) array [m], interpolated if need be."""
    space = body.scene.discretisation.displacement_space(body.mesh)
    at_centre = space.basis(np.zeros(1))[:, 0]
    return np.asarray(np.einsum("p,epc->ec", at_centre, values_on_elements(space, body.boundary.displacement)))


def _columns(solution: Solution, table: str) -> dict[str, Any]:
    match table:
        case "contact":
            contact = solution.contact
            columns: dict[str, Any] = contact.columns() | {"status": contact.status_words(), "part": list(contact.part)}
            return {head.name: columns[head.name] for head in CONTACT_COLUMNS if head.name != "weight"}
        case "boundary":
            return _boundary_columns(solution)
        case "forces":
            facts = part_facts(solution)
            names = list(facts[0]) if facts else [head.name for head in RESULTANT_COLUMNS[1:5]]
            return {name: [fact[name] for fact in facts] for name in names}
        case "steps":
            rows = [] if solution.loading is None else [step.as_dict() for step in solution.loading.steps]
            if not rows:
                raise InputError("the result has no load history: give [[steps]] or several load_factors")
            return {name: [row[name] for row in rows] for name in rows[0]}
        case _:
            return history_columns(solution.history)


def _boundary_columns(solution: Solution) -> dict[str, Any]:
    """Return the columns of one body after the other, those of several with the name of the body in front."""
    tables = [_columns_of_body(body) for body in solution.bodies.values()]
    columns = {name: np.concatenate([table[name] for table in tables]) for name in tables[0]}
    if "" in solution.bodies:
        return columns
    counts = [body.mesh.n_elements for body in solution.bodies.values()]
    return {"body": np.repeat(list(solution.bodies), counts)} | columns


def _columns_of_body(body: SolvedBody) -> dict[str, Any]:
    names = np.full(body.mesh.n_elements, "", dtype=object)
    for name, elements in body.mesh.parts.items():
        names[elements] = name
    centres, traction = body.boundary.centres, body.boundary.traction
    displacement = element_displacement(body)
    return {
        "element": np.arange(body.mesh.n_elements),
        "part": names,
        "x": centres[:, 0],
        "y": centres[:, 1],
        "u_x": displacement[:, 0],
        "u_y": displacement[:, 1],
        "t_x": traction[:, 0],
        "t_y": traction[:, 1],
        **_stresses(body),
    }


def _stresses(body: SolvedBody) -> dict[str, FloatArray]:
    """Return the stress at the centres of the elements by the names of its columns."""
    mesh, centre = body.mesh, np.zeros(1)
    elements = np.arange(mesh.n_elements)
    stress = body.boundary_stress.at(elements, centre)[:, 0]
    return {
        "sigma_xx": stress[:, 0, 0],
        "sigma_yy": stress[:, 1, 1],
        "sigma_xy": stress[:, 0, 1],
        "hoop": components_before(stress, mesh.normals_at(elements, centre)[:, 0])[2],
        "von_mises": STRESSES["von-mises"].of(stress, body.scene.material),
    }
