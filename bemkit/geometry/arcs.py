"""Arcs of circles among the elements of meshes."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from bemkit.arrays import FloatArray, IntArray
from bemkit.geometry.mesh import BoundaryMesh
from bemkit.geometry.quadrature import gauss_legendre
from bemkit.geometry.vectors import cross

_N_POINTS = 12
_ROUND_OFF = 1e-9
"""Distance by which normals of arcs may miss their centre, relative to the diameter."""


def common_centre(sides: Sequence[tuple[BoundaryMesh, IntArray]]) -> FloatArray | None:
    """Return the point (2,) [m] through which all normals of curved elements (k,) of meshes pass.

    None if there is no such point, or if an element is straight.
    """
    if any(mesh.is_straight[elements].any() for mesh, elements in sides):
        return None
    (first, _), (xi, _) = sides[0], gauss_legendre(_N_POINTS)
    points = np.concatenate([mesh.points(elements, xi).reshape(-1, 2) for mesh, elements in sides])
    normals = np.concatenate([mesh.normals_at(elements, xi).reshape(-1, 2) for mesh, elements in sides])
    points -= first.centre
    arms = np.column_stack([-normals[:, 1], normals[:, 0]])
    centre = np.linalg.lstsq(arms, cross(normals, points), rcond=None)[0]
    missed = np.abs(cross(normals, points - centre)).max()
    return first.centre + centre if missed <= _ROUND_OFF * first.diameter else None
