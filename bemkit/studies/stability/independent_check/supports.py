"""Prescribed displacements and loads: whether the boundary has what the scene gives it."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from bemkit.arrays import FloatArray, IntArray
from bemkit.results.solution import Solution
from bemkit.scene.conditions import Clamped, Contact, PrescribedDisplacement, Pressure, Roller, Traction
from bemkit.studies.stability.independent_check.boundary import Boundary
from bemkit.studies.stability.independent_check.contact import beyond, largest
from bemkit.studies.stability.independent_check.scales import Scales


def held_directions(solution: Solution, boundary: Boundary) -> Iterator[tuple[IntArray, FloatArray, FloatArray]]:
    """Yield the directions in which supports hold the nodes of their elements.

    Yields
    ------
    elements : (m,) int array
    directions : (m, n_local, 2) array [-]
    values : (m, n_local) array [m]
        Prescribed components of the displacement along the directions.
    """
    factor = solution.scene.load_factors[-1]
    for part in solution.scene.parts:
        elements = solution.mesh.part(part.name)
        points = boundary.node_points[elements]
        match part.condition:
            case Clamped():
                given, components = np.zeros_like(points), [0, 1]
            case PrescribedDisplacement(is_prescribed=is_prescribed) as condition:
                given = factor * condition.at(points.reshape(-1, 2)).reshape(points.shape)
                components = np.flatnonzero(is_prescribed).tolist()
            case Roller():
                yield elements, boundary.node_normals[elements], np.zeros(points.shape[:2])
                continue
            case _:
                continue
        for component in components:
            yield elements, np.broadcast_to(np.eye(2)[component], points.shape), given[:, :, component]


def support_mismatch(solution: Solution, boundary: Boundary, scales: Scales) -> float:
    """Return the largest difference [-] of a held displacement from what is prescribed, symmetry lines included."""
    mesh, displacement = solution.mesh, solution.boundary.displacement
    worst = [0.0]
    for elements, directions, values in held_directions(solution, boundary):
        motion = np.einsum("enc,enc->en", displacement[boundary.nodes[elements]], directions)
        worst.append(beyond(np.abs(motion - values), scales.turned, scales.length))
    if mesh.symmetry is not None and boundary.nodes.shape[1] > 1:
        across = displacement[: mesh.n_nodes][mesh.on_symmetry_lines]
        worst.append(largest(np.abs(across)) / scales.length)
    return float(np.max(worst))


def tractions_of(solution: Solution, boundary: Boundary) -> FloatArray:
    """Return the tractions at the quadrature points, but for those of contact, which are known at nodes.

    Returns
    -------
    (n_elements, n_places, 2) array [Pa]
        Loads as they are given, reactions of supports as means of elements.
    """
    factor = solution.scene.load_factors[-1]
    traction = np.zeros_like(boundary.points)
    for part in solution.scene.parts:
        elements = solution.mesh.part(part.name)
        points, normals = (each[elements].reshape(-1, 2) for each in (boundary.points, boundary.normals))
        if isinstance(part.condition, Traction | Pressure):
            load = factor * part.condition.at(points, normals)
            traction[elements] = load.reshape(traction[elements].shape)
        elif not isinstance(part.condition, Contact):
            traction[elements] = solution.boundary.traction[elements][:, None]
    return traction


def load_mismatch(solution: Solution, boundary: Boundary, traction: FloatArray, scales: Scales) -> float:
    """Return the largest difference [-] of mean tractions from the loads, on loaded and on free elements."""
    is_contact = np.zeros(solution.mesh.n_elements, bool)
    for part in solution.scene.contact_parts:
        is_contact[solution.mesh.part(part.name)] = True
    mean = np.einsum("eqc,eq->ec", traction, boundary.shares) / boundary.lengths[:, None]
    return largest(np.abs(mean - solution.boundary.traction)[~is_contact] / scales.stress)
