"""Round bodies that nothing keeps from turning.

A body whose contact sides are arcs around one point turns about it without changing them: without friction no contact
resists, whatever it touches. Its elements do, since they interpolate the rotation: a load that turns the body would be
balanced by what its mesh differs from a circle, at any angle.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from bemkit.arrays import FloatArray, IntArray
from bemkit.geometry.quadrature import gauss_legendre
from bemkit.geometry.vectors import cross, norms
from bemkit.model.assembled.model import AssembledModel
from bemkit.model.assembled.placed import PlacedBody
from bemkit.model.assembled.prepared import PreparedAssembly
from bemkit.scene.conditions import Clamped, PrescribedDisplacement, Pressure, Roller, Traction
from bemkit.scene.unit_names import amount
from bemkit.solvers.base import ContactSolution, Status

_N_POINTS = 12
_ROUND_OFF = 1e-9
"""Of the diameter, by which normals of arcs miss their centre."""
_BALANCED = 1e-6
"""Share of the moment of all loads, each taken by its size, that counts as none."""


def with_turning_checked(model: AssembledModel, result: ContactSolution) -> ContactSolution:
    """Return the outcome of a solve, named UNSOLVABLE_LOAD if nothing but its mesh keeps a body from turning."""
    if not result.is_converged:
        return result
    reason = next(filter(None, (_turned(model.prepared, number) for number in range(len(model.condensed)))), "")
    status = Status.UNSOLVABLE_LOAD
    return replace(result, status=status, message=f"{status.value} [{reason}]") if reason else result


def _turned(prepared: PreparedAssembly, number: int) -> str:
    """Say how the load turns a body that may turn; empty if it does not. Bodies with forces inside are not judged."""
    body = prepared.bodies[number]
    is_held = any(isinstance(part.condition, Clamped | Roller | PrescribedDisplacement) for part in body.scene.parts)
    unbounded = body.mesh.is_exterior or body.mesh.surface is not None
    if is_held or unbounded or body.mesh.symmetry is not None or body.scene.body_forces:
        return ""
    touching = [rows for rows in prepared.rows if number in (rows.body, rows.other)]
    if not touching or not all(rows.law.is_frictionless for rows in touching):
        return ""
    sides = [rows.elements for rows in touching if rows.body == number]
    sides += [rows.other_elements for rows in touching if rows.other == number]
    centre = _common_centre(body, np.unique(np.concatenate(sides)))
    if centre is None:
        return ""
    moment, size = _moment(body, centre)
    if abs(moment) <= _BALANCED * size:
        return ""
    x, y = np.where(np.abs(centre) < _ROUND_OFF * body.mesh.diameter, 0.0, centre).tolist()
    by = amount(abs(moment), "energy", prepared.assembly.units)
    sense = "anticlockwise" if moment > 0.0 else "clockwise"
    return (
        f"the load turns body {body.name!r} {sense} about ({x:.4g}, {y:.4g}) with {by}, and its contacts, round and "
        "without friction, do not resist: give them friction, hold the body by a support, or change the load"
    )


def _common_centre(body: PlacedBody, elements: IntArray) -> FloatArray | None:
    """Return the point (2,) [m] through which the normals of all these elements pass; None if there is none."""
    mesh, (xi, _) = body.mesh, gauss_legendre(_N_POINTS)
    if mesh.is_straight[elements].any():
        return None
    points = (mesh.points(elements, xi) - mesh.centre).reshape(-1, 2)
    normals = mesh.normals_at(elements, xi).reshape(-1, 2)
    arms = np.column_stack([-normals[:, 1], normals[:, 0]])
    centre = np.linalg.lstsq(arms, cross(normals, points), rcond=None)[0]
    missed = np.abs(cross(normals, points - centre)).max()
    return mesh.centre + centre if missed <= _ROUND_OFF * mesh.diameter else None


def _moment(body: PlacedBody, centre: FloatArray) -> tuple[float, float]:
    """Return the moment [N] of the loads per thickness about a point, and that of their sizes."""
    mesh, (xi, weights) = body.mesh, gauss_legendre(_N_POINTS)
    moment = size = 0.0
    for part, elements in body.scene.parts_on(mesh):
        if isinstance(part.condition, Traction | Pressure):
            points, normals = mesh.points(elements, xi), mesh.normals_at(elements, xi)
            load = part.condition.at(points.reshape(-1, 2), normals.reshape(-1, 2)).reshape(points.shape)
            shares = mesh.jacobian(elements, xi) * weights
            moment += float(np.sum(cross(points - centre, load) * shares))
            size += float(np.sum(norms(points - centre) * norms(load) * shares))
    return moment, size
