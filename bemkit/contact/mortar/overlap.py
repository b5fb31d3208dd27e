"""Whether sides that lie behind each other overlap, or face away from each other."""

from __future__ import annotations

import numpy as np

from bemkit.arrays import BoolArray, FloatArray
from bemkit.geometry.mesh import BoundaryMesh
from bemkit.geometry.vectors import angles_between


def encloses(mesh: BoundaryMesh, points: FloatArray) -> BoolArray:
    """Return (k,) bool: whether the body bounded by the chords of a mesh contains points (k, 2), by winding numbers."""
    whole = mesh.whole
    to_points = points[:, None]
    angles = angles_between(whole.start - to_points, whole.end - to_points).sum(axis=1)
    return np.asarray(angles > (-np.pi if mesh.is_exterior else np.pi))


def faces_away(
    one: BoundaryMesh, two: BoundaryMesh, middle: FloatArray, distance: FloatArray, slack: FloatArray
) -> BoolArray:
    """Find places where sides lie behind each other although their bodies do not overlap.

    Parameters
    ----------
    one, two : BoundaryMesh
    middle : (k, 2) array [m]
        Halfway between a point of the first side and what it is projected onto on the second one.
    distance : (k,) array [m]
        From the one to the other along the direction out of the first body.
    slack : (k,) array [m]
        Depth of an overlap that is not looked into, because coordinates or chords do not resolve it.

    Returns
    -------
    (k,) bool array
        Where the distance is negative and the middle does not belong to both bodies.
    """
    behind = np.flatnonzero(distance < -slack)
    result = np.zeros(len(middle), bool)
    if behind.size:
        result[behind] = ~(encloses(one, middle[behind]) & encloses(two, middle[behind]))
    return result
