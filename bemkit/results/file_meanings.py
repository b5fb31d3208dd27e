"""Meanings and units of the arrays in a result file, as HDF5 attributes."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

from bemkit.scene.unit_names import QUANTITIES, UnitNames, unit_of
from bemkit.table import Column

if TYPE_CHECKING:
    import h5py

CONTACT_COLUMNS = (
    Column("x", "m", "first coordinate", ".6g"),
    Column("y", "m", "second coordinate", ".6g"),
    Column("s", "m", "arc length from the start of the part", ".6g"),
    Column("u_n", "m", "displacement towards the obstacle or the partner", ".6g"),
    Column("u_t", "m", "displacement along the tangent", ".6g"),
    Column("sigma_n", "Pa", "normal traction, negative where pressed", ".6g"),
    Column("sigma_t", "Pa", "tangential traction", ".6g"),
    Column("gap", "m", "initial distance", ".6g"),
    Column("clearance", "m", "distance left, gap - u_n", ".6g"),
    Column("status", "", "separated, slip or stick; in files 0, 1 stick, 2 slip along the tangent, 3 slip against it"),
    Column("weight", "m", "length of boundary of the node", ".6g"),
    Column("part", "", "contact part or contact of each node"),
)
"""Columns of the contact table in results, tables and files."""
_BOUNDARY = {
    "points": ("length", "nodes of the displacements"),
    "centres": ("length", "centres of the elements"),
    "displacement": ("length", "displacement along x and y at the points"),
    "traction": ("stress", "mean traction along x and y on each element"),
    "traction_dofs": ("stress", "traction along x and y at the local nodes of the elements, one after the other"),
    "reaction": ("force", "force of supports along x and y at the points"),
}
_COLUMNS = {
    **{head.name: (QUANTITIES.get(head.unit, ""), head.meaning) for head in CONTACT_COLUMNS},
    "direction_x": ("", "direction of contact, first component"),
    "direction_y": ("", "direction of contact, second component"),
    "friction_bound": ("stress", "largest tangential traction that the law allows"),
    "slip": ("length", "length of the path that the node has slipped"),
    "last_slip": ("length", "length that the last increment has added to the path"),
    **{f"state_{name}": ("", f"{name}, dimensionless") for name in ("u_n", "u_t", "sigma_n", "sigma_t")},
}
_MESH = {
    "nodes": ("length", "points where elements meet"),
    "elements": ("", "start node and end node of each element"),
    "part_elements": ("", "elements of all parts, one part after the other"),
    "element_curve": ("", "number of the curve that each element follows, -1 for a straight one"),
    "element_span": ("", "parameters of the start and the end of each element on its curve"),
}


def annotate(file: h5py.File, units: UnitNames | None) -> None:
    """Set the attributes ``meaning`` and ``unit`` of arrays, ``meanings`` and ``units`` of contact tables.

    Without names of units there is no attribute ``unit`` or ``units``. Of the steps only the last one has attributes.
    """
    last = file["last"]
    for mesh in file["meshes"].values():
        _annotate_arrays(mesh, _MESH, units)
    for group in (file, last):
        _annotate_arrays(group, _BOUNDARY, units)
    for table in (file["contact_nodes"], last["contact"]):
        entries = [_COLUMNS[name] for name in table.dtype.names]
        table.attrs["meanings"] = [meaning for _, meaning in entries]
        if units is not None:
            table.attrs["units"] = [unit_of(quantity, units) if quantity else "" for quantity, _ in entries]


def _annotate_arrays(group: h5py.Group, entries: Mapping[str, tuple[str, str]], units: UnitNames | None) -> None:
    for name, (quantity, meaning) in entries.items():
        if name in group:
            group[name].attrs["meaning"] = meaning
            if units is not None and quantity:
                group[name].attrs["unit"] = unit_of(quantity, units)
