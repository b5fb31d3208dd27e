"""A warning before the work: collocation of bodies that are thin for their elements."""

from __future__ import annotations

import numpy as np

from bemkit.arrays import FloatArray
from bemkit.geometry.mesh import BoundaryMesh

_LONGEST = 0.75
"""Length of elements, in thicknesses, at which the energy of a pinched ring is 2 per cent off; it grows with the third
power of the length."""
_SHARE = 0.25
"""Of the boundary: more than what is thin in the tip of a wedge or between a hole and a side."""
_FACING = -0.5
_ROWS = 256


def thinness_warnings(mesh: BoundaryMesh) -> tuple[str, ...]:
    """Warn if elements of collocation are too long for the thickness of the body.

    Parameters
    ----------
    mesh : BoundaryMesh

    Returns
    -------
    tuple of str
        One sentence or none.
    """
    if mesh.is_exterior:
        return ()
    longest = mesh.lengths / thicknesses(mesh)
    is_thin = longest > _LONGEST
    if mesh.lengths[is_thin].sum() <= _SHARE * mesh.lengths.sum():
        return ()
    factor = float(np.median(longest[is_thin])) / _LONGEST
    return (
        f"collocation: on {int(np.count_nonzero(is_thin))} of {mesh.n_elements} elements the body is thinner than the "
        f"elements are long, and bends too stiffly: take {factor:.1f} times as many elements, or quadratic Galerkin",
    )


def thicknesses(mesh: BoundaryMesh) -> FloatArray:
    """Return the distance (n_elements,) [m] across the body to the nearest element that faces the other way.

    Elements face each other if their normals are opposite to within 60 degrees and the line between their middles is
    within 45 degrees of the normal; infinite where no element does.
    """
    whole = mesh.whole
    result = np.empty(mesh.n_elements)
    for begin in range(0, mesh.n_elements, _ROWS):
        own = slice(begin, min(begin + _ROWS, mesh.n_elements))
        arms = whole.centres - whole.centres[own, None]
        across = -np.einsum("tpc,tc->tp", arms, whole.normals[own])
        distance = np.hypot(arms[..., 0], arms[..., 1])
        faces = (whole.normals[own] @ whole.normals.T < _FACING) & (across > np.sqrt(0.5) * distance)
        result[own] = np.where(faces, distance, np.inf).min(axis=1)
    return result
