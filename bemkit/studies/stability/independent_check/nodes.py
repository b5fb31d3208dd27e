"""The contact nodes of a solution in frames of their own: direction into the obstacle, and a quarter turn on."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from bemkit.arrays import BoolArray, FloatArray, IntArray
from bemkit.results.solution import Solution
from bemkit.scene.conditions import Clamped, Contact, PrescribedDisplacement, Roller
from bemkit.studies.stability.independent_check.boundary import Boundary
from bemkit.studies.stability.independent_check.obstacles import distance_to

_GRAZING_COSINE = 1e-6
"""Cosine between the body's normal and the direction of contact up to which a node may count as facing away."""


@dataclass(frozen=True, eq=False)
class Nodes:
    """The rows of a contact table, measured again.

    Parameters
    ----------
    nodes : (n_contact,) int array
        Rows of ``solution.boundary.displacement``.
    points : (n_contact, 2) array [m]
    offset : (n_contact,) array [m]
        Distance of the points of the table from those rows' points.
    frame : (n_contact, 2, 2) array [-]
        Rows are the direction d of contact and its quarter turn t.
    distance : (n_contact,) array [m]
        To the obstacle; infinite where the body faces away from it.
    is_grazing : (n_contact,) bool array
        Nodes of which round-off decides whether they face away.
    is_supported : (n_contact,) bool array
        Nodes that belong to a support as well: part of their force is a reaction, which no friction law governs.
    displacement, traction : (n_contact, 2) arrays [m], [Pa]
        From the boundary field; from sigma_n and sigma_t of the table. In x and y.
    acting : (n_contact, 2) array [Pa]
        The traction that acts on the body as contact. On supports what acts along t is the support's.
    """

    nodes: IntArray
    points: FloatArray
    offset: FloatArray
    frame: FloatArray
    distance: FloatArray
    is_grazing: BoolArray
    is_supported: BoolArray
    displacement: FloatArray
    traction: FloatArray
    acting: FloatArray

    def components(self, vectors: FloatArray) -> FloatArray:
        """Return the (n_contact, 2) components along d and t of vectors in x and y."""
        return np.asarray(np.einsum("nkc,nc->nk", self.frame, vectors))


def contact_nodes_of(solution: Solution, boundary: Boundary) -> Nodes:
    """Find the contact nodes of a solution on its boundary and measure their obstacles."""
    table, fields = solution.contact, solution.boundary
    points = np.column_stack([table.x, table.y])
    if not table.n_contact:
        nothing, none = np.zeros((0, 2)), np.zeros(0, bool)
        frame = np.zeros((0, 2, 2))
        return Nodes(np.zeros(0, np.intp), nothing, none * 0.0, frame, none * 0.0, none, none, *(nothing,) * 3)
    offset, nodes = (np.asarray(each) for each in cKDTree(fields.points).query(points))
    normals, direction = np.zeros((2, table.n_contact, 2))
    distance = np.full(table.n_contact, np.inf)
    for part in solution.scene.contact_parts:
        own = table.rows(part.name)
        if isinstance(part.condition, Contact) and own.any():
            normals[own] = _mean_normals(solution, boundary, part.name)[nodes[own]]
            distance[own], direction[own] = distance_to(part.condition.obstacle, points[own], normals[own])
    facing = np.sum(direction * normals, axis=1)
    frame = np.stack([direction, np.column_stack([-direction[:, 1], direction[:, 0]])], axis=1)
    is_supported = np.isin(nodes, _supported_nodes(solution, boundary))
    components = np.column_stack([table.sigma_n, table.sigma_t])
    acting = np.column_stack([table.sigma_n, np.where(is_supported, 0.0, table.sigma_t)])
    return Nodes(
        nodes=nodes,
        points=points,
        offset=offset,
        frame=frame,
        distance=np.where(facing > _GRAZING_COSINE, distance, np.inf),
        is_grazing=np.abs(facing) <= _GRAZING_COSINE,
        is_supported=is_supported,
        displacement=fields.displacement[nodes],
        traction=np.einsum("nk,nkc->nc", components, frame),
        acting=np.einsum("nk,nkc->nc", acting, frame),
    )


def hidden_overlap(solution: Solution, boundary: Boundary, nodes: Nodes) -> float:
    """Return how deep contact parts are in their obstacles at nodes that are not in the table, over the displacement.

    There supports hold the direction of contact, so that nothing but a warning can be asked for.
    """
    points, displacement = solution.boundary.points, solution.boundary.displacement
    motion = float(np.abs(displacement).max())
    deepest = 0.0
    for part in solution.scene.contact_parts:
        rows = np.setdiff1d(boundary.nodes[solution.mesh.part(part.name)], nodes.nodes)
        normals = _mean_normals(solution, boundary, part.name)[rows]
        if isinstance(part.condition, Contact) and rows.size:
            distance, direction = distance_to(part.condition.obstacle, points[rows], normals)
            overlap = np.sum(displacement[rows] * direction, axis=1) - distance
            is_facing = np.sum(direction * normals, axis=1) > _GRAZING_COSINE
            deepest = max(deepest, float(np.max(overlap[is_facing], initial=0.0)))
    return deepest / motion if motion > 0.0 else deepest


def _mean_normals(solution: Solution, boundary: Boundary, part: str) -> FloatArray:
    """Return (n_nodes, 2) normals: mean by length of a part's elements that meet at a node, zero elsewhere."""
    elements = solution.mesh.part(part)
    total = np.zeros_like(solution.boundary.points)
    weighted = boundary.node_normals[elements] * boundary.lengths[elements][:, None, None]
    np.add.at(total, boundary.nodes[elements], weighted)
    size = np.hypot(total[:, 0], total[:, 1])
    return np.asarray(total / np.where(size > 0.0, size, 1.0)[:, None])


def _supported_nodes(solution: Solution, boundary: Boundary) -> IntArray:
    """Return the nodes on supports and on symmetry lines, which hold a body like rollers."""
    mesh = solution.mesh
    found = [np.zeros(0, np.intp)]
    for part in solution.scene.parts:
        if isinstance(part.condition, Clamped | Roller | PrescribedDisplacement):
            found.append(boundary.nodes[mesh.part(part.name)].ravel())
    if mesh.symmetry is not None and boundary.nodes.shape[1] > 1:  # midpoints of elements lie on no line
        found.append(np.flatnonzero(mesh.on_symmetry_lines.any(axis=1)))
    return np.unique(np.concatenate(found))
