"""Tractions along the boundary as what they are: polynomials on each element."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bemkit.arrays import FloatArray, IntArray
from bemkit.contact.contact_nodes import contact_frame
from bemkit.contact.obstacle import measure_contact
from bemkit.geometry.neighbours import along_boundary, arc_lengths, drawn_points
from bemkit.results.solution import Solution
from bemkit.results.solved_body import SolvedBody
from bemkit.scene.conditions import Contact, name_at_obstacle


@dataclass(frozen=True, eq=False)
class TractionCurve:
    """Tractions along some elements, each with points of its own, so that they may jump.

    Parameters
    ----------
    s : (n,) array [m]
        Arc length from the start of the first element.
    normal, tangential : (n,) arrays [Pa]
    """

    s: FloatArray
    normal: FloatArray
    tangential: FloatArray


def traction_curve(solution: Solution, part: str) -> TractionCurve:
    """Return the tractions along a contact, in the directions in which it counts.

    Parameters
    ----------
    solution : Solution
    part : str
        Name of a contact part, or of a contact of several bodies.
    """
    side = solution.contact_sides[part][0]
    body, name = solution.bodies[side.body], side.part
    elements = along_boundary(body.mesh, body.mesh.part(name))
    xi = _local_points(body)
    s = arc_lengths(body.mesh, elements, xi).ravel()
    directions = _directions(solution, part, body, elements, xi, s)
    return _resolved(body, elements, xi, s, directions)


def boundary_curve(body: SolvedBody, elements: IntArray) -> TractionCurve:
    """Return the tractions along some elements, in their order, along the normals and tangents of the body."""
    xi = _local_points(body)
    normals = body.mesh.normals_at(elements, xi).reshape(-1, 2)
    return _resolved(body, elements, xi, arc_lengths(body.mesh, elements, xi).ravel(), normals)


def _local_points(body: SolvedBody) -> FloatArray:
    return drawn_points(body.mesh, body.scene.discretisation.traction_space(body.mesh).degree)


def _resolved(
    body: SolvedBody, elements: IntArray, xi: FloatArray, s: FloatArray, directions: FloatArray
) -> TractionCurve:
    dofs = body.boundary.traction_dofs.reshape(body.mesh.n_elements, -1, 2)[elements]
    basis = body.scene.discretisation.traction_space(body.mesh).basis(xi)
    traction = np.einsum("lq,elc->eqc", basis, dofs).reshape(-1, 2)
    normal, tangential = np.einsum("nkc,nc->kn", contact_frame(directions), traction)
    return TractionCurve(s, normal, tangential)


def _directions(
    solution: Solution, part: str, body: SolvedBody, elements: IntArray, xi: FloatArray, s: FloatArray
) -> FloatArray:
    """Return the directions of contact (n, 2) at points of elements, between bodies those of the nodes near by."""
    for own in body.scene.contact_parts:
        if name_at_obstacle(body.name, own.name) == part and isinstance(own.condition, Contact):
            points, normals = body.mesh.points(elements, xi), body.mesh.normals_at(elements, xi)
            return measure_contact(own.condition.obstacle, points.reshape(-1, 2), normals.reshape(-1, 2))[1]
    rows = solution.contact.rows(part)
    order = np.argsort(solution.contact.s[rows])
    at_nodes = solution.contact_directions[rows][order]
    found = np.stack([np.interp(s, solution.contact.s[rows][order], column) for column in at_nodes.T], axis=1)
    return np.asarray(found / np.hypot(*found.T)[:, None])
