"""Contact nodes in the plane: where they are, how they are drawn, and in which direction they touch."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from scipy.spatial import KDTree

from bemkit.arrays import FloatArray, IntArray
from bemkit.contact.contact_nodes import contact_frame
from bemkit.geometry.spaces import dof_points
from bemkit.geometry.symmetry.lines import Symmetry
from bemkit.pictures.shown import DrawnScene
from bemkit.results.solution import Solution

_AT = 1e-6
"""Distance within which a point is a node, relative to the picture."""


class Nodes(NamedTuple):
    """Contact nodes and their images by symmetry, as far as bodies are drawn there.

    Rows (n,) in the contact table; points as they are and as they are drawn, tractions on their body, and directions
    of contact, all (n, 2).
    """

    rows: IntArray
    points: FloatArray
    drawn: FloatArray
    tractions: FloatArray
    directions: FloatArray


def contact_nodes(solution: Solution, shown: DrawnScene, factor: float) -> Nodes:
    """Return the contact nodes of a result, drawn with displacements times a factor."""
    table, symmetry = solution.contact, solution.scene.symmetry
    rows, points, signs = np.arange(table.n_contact), table.points, np.ones((table.n_contact, 2))
    if not table.n_contact:
        return Nodes(rows, points, points, points, points)
    nodes = KDTree(np.concatenate([dof_points(body.space) for body in shown.bodies]))
    for image, reflected in images_of(symmetry, table.points):
        is_new = KDTree(points).query(reflected)[0] > _AT * shown.size  # not on the line
        new = np.flatnonzero(is_new & (nodes.query(reflected)[0] <= _AT * shown.size))
        rows, points = np.append(rows, new), np.concatenate([points, reflected[new]])
        signs = np.concatenate([signs, np.broadcast_to(image, (new.size, 2))])
    drawn = points + factor * shown.displacement[nodes.query(points)[1]]
    components = np.stack([table.sigma_n, table.sigma_t], axis=1)
    tractions = np.einsum("nk,nkc->nc", components, contact_frame(solution.contact_directions))
    return Nodes(rows, points, drawn, signs * tractions[rows], signs * solution.contact_directions[rows])


def images_of(symmetry: Symmetry | None, points: FloatArray) -> Iterator[tuple[FloatArray, FloatArray]]:
    """Yield signs (2,) of the components of vectors, and points (n, 2) [m], for each image by symmetry."""
    if symmetry is not None:
        for image in symmetry.images[1:]:
            yield image, symmetry.reflected(points, image)
