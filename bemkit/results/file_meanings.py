"""What the arrays in a result file are: a sentence and a unit beside each, as HDF5 attributes."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import TYPE_CHECKING

from bemkit.results.contact_table import CONTACT_COLUMNS
from bemkit.scene.unit_names import UnitNames, unit_of

if TYPE_CHECKING:
    import h5py

_QUANTITIES = {"": "", "m": "length", "Pa": "stress"}
_POINTS = {"x": ("length", "first coordinate"), "y": ("length", "second coordinate")}
_RESULTANTS = {
    "force_x": ("force", "resultant along x, per unit of thickness"),
    "force_y": ("force", "resultant along y, per unit of thickness"),
    "moment": ("energy", "moment about the origin, anticlockwise, per unit of thickness"),
}
MEANINGS: Mapping[str, Mapping[str, tuple[str, str]]] = MappingProxyType(
    {
        "mesh": {
            "nodes": ("length", "points where elements meet"),
            "elements": ("", "start node and end node of each element"),
            "part_elements": ("", "elements of all parts, one part after the other"),
            "element_curve": ("", "number of the curve that each element follows, -1 for a straight one"),
            "element_span": ("", "parameters of the start and the end of each element on its curve"),
        },
        "boundary": {
            "points": ("length", "nodes of the displacements"),
            "displacement": ("length", "displacement along x and y at these points"),
            "centres": ("length", "centres of the elements"),
            "traction": ("stress", "mean traction along x and y on each element"),
            "traction_dofs": (
                "stress",
                "traction along x and y at the local nodes of the elements, one after the other",
            ),
            "reaction": ("force", "force of supports along x and y at the points"),
        },
        "contact": {
            **{head.name: (_QUANTITIES[head.unit], head.meaning) for head in CONTACT_COLUMNS},
            "direction_x": ("", "direction of contact, first component"),
            "direction_y": ("", "direction of contact, second component"),
            "friction_bound": ("stress", "largest tangential traction that the law allows"),
        },
        "steps": {
            "time": ("", "time at the end of the step"),
            "time_step": ("", "length in time of its last increment"),
            "external_work": ("energy", "work of loads, moving supports and obstacles in the step"),
            "elastic_energy": ("energy", "elastic energy at the end of the step"),
            "dissipation": ("energy", "work that friction takes up in the step"),
            "increment_work": ("energy", "work of tractions on clearances that open or close within increments"),
            "friction_gain": ("energy", "work that friction gives where it acts along slip"),
            "n_increments": ("", "increments in which the step was gone"),
            "linear_solves": ("", "linear systems solved in the step"),
            "slip": ("length", "length of the path that each contact node has slipped"),
            "last_slip": ("length", "what the last increment has added to it"),
            "state": ("", "dimensionless displacement and traction of the contact nodes"),
        },
        "transitions": {
            **_POINTS,
            "part": ("", "contact part"),
            "s": ("length", "arc length from the start of the part"),
            "from": ("", "status before, in the direction of growing s"),
            "to": ("", "status after"),
        },
        "parts": {"name": ("", "boundary part"), **_RESULTANTS},
        "contacts": {
            "name": ("", "contact"),
            **_RESULTANTS,
            "force_normal": ("force", "total pressing force, positive"),
            "force_tangential": ("force", "total friction force along the tangent"),
            "contact_length": ("length", "length of boundary in contact"),
            "peak_pressure": ("stress", "largest pressure"),
            "largest_slip": ("length", "largest tangential displacement of nodes in contact"),
        },
    }
)
"""By group and name of an array: the quantity whose unit it has, and what it is."""


def annotate(file: h5py.File, units: UnitNames | None) -> None:
    """Set the attributes ``meaning`` and, if units have names, ``unit`` on every array that has a meaning."""

    def visit(path: str, item: h5py.Dataset | h5py.Group) -> None:
        *_, group, name = ("", *path.split("/"))
        if group not in MEANINGS or name not in MEANINGS[group]:
            return
        quantity, meaning = MEANINGS[group][name]
        item.attrs["meaning"] = meaning
        if units is not None and quantity:
            item.attrs["unit"] = unit_of(quantity, units)

    file.visititems(visit)
