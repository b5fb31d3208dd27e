"""Contact nodes in the plane: where they are, how they are drawn, and in which direction they touch."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.spatial import KDTree

from bemkit.arrays import BoolArray, FloatArray
from bemkit.contact.condensation.nodes import contact_frame
from bemkit.geometry.spaces import dof_points
from bemkit.pictures.shown import DrawnScene, Result
from bemkit.results.contact_table import ContactTable
from bemkit.solvers.active_sets import NodeStatus


class Nodes(NamedTuple):
    """Contact nodes: points as they are and as they are drawn, and tractions on their body, all (n_contact, 2)."""

    points: FloatArray
    drawn: FloatArray
    tractions: FloatArray


def contact_nodes(solution: Result, shown: DrawnScene, factor: float) -> Nodes:
    """Return the contact nodes of a result, drawn with displacements times a factor."""
    table = solution.contact
    points = node_points(table)
    if not table.n_contact:
        return Nodes(points, points, points)
    everywhere = np.concatenate([dof_points(body.space) for body in shown.bodies])
    _, nearest = KDTree(everywhere).query(points)
    drawn = points + factor * shown.displacement[nearest]
    components = np.stack([table.sigma_n, table.sigma_t], axis=1)
    return Nodes(points, drawn, np.einsum("nk,nkc->nc", components, contact_frame(solution.contact_directions)))


def node_points(contact: ContactTable) -> FloatArray:
    """Return the places (n_contact, 2) [m] of contact nodes."""
    return np.stack([contact.x, contact.y], axis=1)


def is_closed(contact: ContactTable) -> BoolArray:
    """Return the mask (n_contact,) of the nodes that touch."""
    return np.asarray(contact.status != NodeStatus.SEPARATED)
