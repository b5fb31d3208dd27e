"""Places along a part of the boundary where symbols stand."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from bemkit.arrays import FloatArray, IntArray
from bemkit.geometry.neighbours import along_boundary
from bemkit.pictures.shown import ShownBody


class Stations(NamedTuple):
    """Points of the undeformed boundary, how they are drawn, and unit normals out of the body, all (n, 2)."""

    points: FloatArray
    drawn: FloatArray
    normals: FloatArray


def stations(body: ShownBody, elements: IntArray, spacing: float, factor: float) -> Stations:
    """Return places about evenly spaced along elements, one at least.

    Parameters
    ----------
    body : ShownBody
    elements : (m,) array
    spacing, factor : float
        Distance [m] of neighbours, and by how much displacements are enlarged.
    """
    elements = along_boundary(body.mesh, elements)
    ends = np.cumsum(body.mesh.lengths[elements])
    n = max(1, round(ends[-1] / spacing))
    s = (np.arange(n) + 0.5) * ends[-1] / n
    place = np.searchsorted(ends, s).clip(max=ends.size - 1)
    elements = elements[place]
    xi = (1.0 - 2.0 * (ends[place] - s) / body.mesh.lengths[elements])[:, None]
    points = body.mesh.points(elements, xi)
    drawn = points + factor * body.displacement_at(elements, xi)
    return Stations(points[:, 0], drawn[:, 0], body.mesh.normals_at(elements, xi)[:, 0])
