"""Stress along sides: tables, the largest value and where it is, stress concentration."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from bemkit.arrays import FloatArray, IntArray
from bemkit.errors import InputError
from bemkit.geometry.mesh import BoundaryMesh
from bemkit.geometry.neighbours import along_boundary, arc_lengths
from bemkit.geometry.vectors import components_before
from bemkit.results.boundary_stress import BoundaryStress
from bemkit.results.stress_measures import STRESSES
from bemkit.table import Column, Table

SIDE_COLUMNS = (
    Column("s", "m", "arc length from the start of the side", ".6g"),
    Column("x", "m", "first coordinate", ".6g"),
    Column("y", "m", "second coordinate", ".6g"),
    Column("sigma_n", "Pa", "normal stress across the boundary, negative where pressed", ".6g"),
    Column("sigma_t", "Pa", "shear stress on the boundary, along the tangent", ".6g"),
    Column("hoop", "Pa", "normal stress along the boundary", ".6g"),
    Column("von_mises", "Pa", "equivalent stress of von Mises", ".6g"),
)
HOOP = "hoop"
_TOLERANCE = 1e-9
"""Tolerance of the local coordinate of the largest stress, which hardly changes the value."""


def side_stress(boundary: BoundaryStress, mesh: BoundaryMesh, part: str) -> Table:
    """Return the stress along a part of a mesh, the whole one or the half of a symmetry; see `SolvedBody`."""
    elements = along_boundary(mesh, mesh.part(part))
    xi = np.linspace(-1.0, 1.0, 2 * boundary.space.degree + 1) if boundary.space.degree > 1 else np.zeros(1)
    stress, points = boundary.at(elements, xi), mesh.points(elements, xi).reshape(-1, 2)
    normal, shear, hoop = components_before(stress, mesh.normals_at(elements, xi))
    columns = {
        "s": arc_lengths(mesh, elements, xi),
        "x": points[:, 0],
        "y": points[:, 1],
        "sigma_n": normal,
        "sigma_t": shear,
        HOOP: hoop,
        "von_mises": STRESSES["von-mises"].of(stress, boundary.material),
    }
    return Table.from_arrays(SIDE_COLUMNS, {name: np.ravel(values) for name, values in columns.items()})


@dataclass(frozen=True)
class LargestStress:
    """The stress of largest size on the boundary.

    Parameters
    ----------
    value : float [Pa]
        With its sign.
    x, y : float [m]
    """

    value: float
    x: float
    y: float


def largest_stress(boundary: BoundaryStress, measure: str = "von-mises", part: str | None = None) -> LargestStress:
    """Return the stress of largest size on the boundary; see `SolvedBody.largest_stress`."""
    mesh = boundary.mesh
    elements = np.arange(mesh.n_elements) if part is None else mesh.part(part)

    def values(some: IntArray, xi: FloatArray) -> FloatArray:
        stress = boundary.at(some, xi)
        if measure == HOOP:
            return components_before(stress, mesh.normals_at(some, xi))[2]
        return STRESSES[measure].of(stress, boundary.material)

    if measure != HOOP and measure not in STRESSES:
        raise InputError(f"measure is {measure!r}: give one of {HOOP}, {', '.join(STRESSES)}")
    # constant and linear elements know the strain in their middle only
    n_points = 4 * boundary.space.degree + 1 if boundary.space.degree > 1 else 1
    xi = np.sin(0.5 * np.pi * np.linspace(-1.0, 1.0, n_points)) if n_points > 1 else np.zeros(1)
    sampled = values(elements, xi)
    row, column = np.unravel_index(np.argmax(np.abs(sampled)), sampled.shape)
    element, best = elements[[row]], float(xi[column])
    if n_points > 1:
        best = _refined(lambda at: abs(float(values(element, np.array([at]))[0, 0])), xi, int(column))
    x, y = mesh.points(element, np.array([best]))[0, 0].tolist()
    return LargestStress(float(values(element, np.array([best]))[0, 0]), x, y)


def _refined(size: Callable[[float], float], xi: FloatArray, best: int) -> float:
    """Return the local coordinate of the maximum of a function on an element, near the best sample."""
    from scipy.optimize import minimize_scalar

    low, high = xi[max(best - 1, 0)], xi[min(best + 1, len(xi) - 1)]
    found = minimize_scalar(lambda at: -size(at), bounds=(low, high), method="bounded", options={"xatol": _TOLERANCE})
    return float(found.x) if -found.fun > size(float(xi[best])) else float(xi[best])
