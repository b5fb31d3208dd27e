"""Nodes of a mesh where functions on the boundary may jump."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from bemkit.arrays import BoolArray, read_only
from bemkit.geometry.mesh import BoundaryMesh
from bemkit.geometry.vectors import angles_between


@lru_cache(maxsize=4)
def break_nodes(mesh: BoundaryMesh) -> BoolArray:
    """Return the (n_nodes,) mask, read-only, of nodes where tractions may jump: corners and ends of boundary parts."""
    if mesh.symmetry is not None:
        return break_nodes(mesh.whole)[: mesh.n_nodes]
    owner = np.full(mesh.n_elements, -1)
    for number, name in enumerate(mesh.parts):
        owner[mesh.part(name)] = number
    before, after = mesh.node_elements.T
    changes = (owner[before] != owner[after]) | (before == after)  # the same only at the ends of a half-plane
    breaks: BoolArray = corner_nodes(mesh) | changes
    read_only(breaks)
    return breaks


def corner_nodes(mesh: BoundaryMesh, angle: float = 1e-6) -> BoolArray:
    """Return the (n_nodes,) mask of nodes where the tangent turns by more than `angle` [rad].

    The direction of a short element is known only as well as its coordinates are; that round-off is added to `angle`.
    """
    if mesh.symmetry is not None:
        return corner_nodes(mesh.whole, angle)[: mesh.n_nodes]
    incoming, outgoing = mesh.node_elements[:, 0], mesh.node_elements[:, 1]
    before = mesh.normals_at(incoming, np.array([1.0]))[:, 0]
    after = mesh.normals_at(outgoing, np.array([-1.0]))[:, 0]
    shortest = np.minimum(mesh.lengths[incoming], mesh.lengths[outgoing])
    round_off = 8.0 * np.finfo(float).eps * np.abs(mesh.nodes).max(axis=1) / shortest
    corners: BoolArray = np.abs(angles_between(before, after)) > angle + round_off
    return corners
