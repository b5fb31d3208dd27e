"""Contact nodes in the plane: where they are, how they are drawn, and in which direction they touch."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.spatial import KDTree

from bemkit.arrays import BoolArray, FloatArray
from bemkit.contact.condensation.nodes import contact_frame, nodes_on
from bemkit.contact.obstacle import measure_contact
from bemkit.geometry.spaces import dof_points
from bemkit.pictures.shown import Result, Shown
from bemkit.results.assembly_solution import AssemblySolution
from bemkit.results.contact_table import ContactTable
from bemkit.results.solution import Solution
from bemkit.scene.conditions import Contact
from bemkit.solvers.active_sets import NodeStatus


class Nodes(NamedTuple):
    """Contact nodes: points as they are and as they are drawn, and tractions on their body, all (n_contact, 2)."""

    points: FloatArray
    drawn: FloatArray
    tractions: FloatArray


def contact_nodes(solution: Result, shown: Shown, factor: float) -> Nodes:
    """Return the contact nodes of a result, drawn with displacements times a factor."""
    table = solution.contact
    points = node_points(table)
    if not table.n_contact:
        return Nodes(points, points, points)
    everywhere = np.concatenate([dof_points(body.space) for body in shown.bodies])
    _, nearest = KDTree(everywhere).query(points)
    drawn = points + factor * shown.displacement[nearest]
    components = np.stack([table.sigma_n, table.sigma_t], axis=1)
    return Nodes(points, drawn, np.einsum("nk,nkc->nc", components, contact_frame(contact_directions(solution))))


def contact_directions(solution: Result) -> FloatArray:
    """Return unit vectors (n_contact, 2) out of the body with the node, along which u_n and sigma_n count."""
    return solution.contact_directions if isinstance(solution, AssemblySolution) else _directions(solution)


def _directions(solution: Solution) -> FloatArray:
    table = solution.contact
    points, directions = node_points(table), np.zeros((table.n_contact, 2))
    space = solution.scene.discretisation.displacement_space(solution.mesh)
    for part in solution.scene.contact_parts:
        rows, elements = table.rows(part.name), solution.mesh.part(part.name)
        if isinstance(part.condition, Contact) and rows.any():
            nodes, normals = nodes_on(space, elements)
            _, nearest = KDTree(dof_points(space)[nodes]).query(points[rows])
            _, directions[rows] = measure_contact(part.condition.obstacle, points[rows], normals[nearest])
    return directions


def node_points(contact: ContactTable) -> FloatArray:
    """Return the places (n_contact, 2) [m] of contact nodes."""
    return np.stack([contact.x, contact.y], axis=1)


def is_closed(contact: ContactTable) -> BoolArray:
    """Return the mask (n_contact,) of the nodes that touch."""
    return np.asarray(contact.status != NodeStatus.SEPARATED)
