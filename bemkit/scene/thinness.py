"""Bodies that are too thin for the constant elements around them."""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from functools import lru_cache

import numpy as np

from bemkit.arrays import FloatArray, IntArray
from bemkit.geometry.mesh import BoundaryMesh

_LONGEST = 0.75
"""Length of elements, in thicknesses, at which the energy of a pinched ring is 2 per cent off; it grows with the third
power of the length."""
_SHARE = 0.25
"""Of the boundary: more than what is thin in the tip of a wedge or between a hole and a side."""
_FACING = -0.5
_ROWS, _FEW = 4096, 256
"""Elements whose neighbours are found at a time; meshes of few need no tree."""


@lru_cache(maxsize=4)  # the plan and the choice of a linear solver ask for it, and it takes a while on large meshes
def thinness_warnings(mesh: BoundaryMesh) -> tuple[str, ...]:
    """Warn in one sentence if elements of collocation are too long for the thickness of the body."""
    if mesh.is_exterior:
        return ()
    longest = mesh.lengths / thicknesses(mesh, mesh.lengths / _LONGEST)
    is_thin = longest > _LONGEST
    if mesh.lengths[is_thin].sum() <= _SHARE * mesh.lengths.sum():
        return ()
    factor = float(np.median(longest[is_thin])) / _LONGEST
    return (
        f"collocation: on {int(np.count_nonzero(is_thin))} of {mesh.n_elements} elements the body is thinner than the "
        f"elements are long, and bends too stiffly: take {factor:.1f} times as many elements, or quadratic Galerkin",
    )


def thicknesses(mesh: BoundaryMesh, reach: FloatArray | float = np.inf) -> FloatArray:
    """Return the distance (n_elements,) [m] across the body to the nearest element that faces the other way.

    Elements face each other if their normals are opposite to within 60 degrees and the line between their middles is
    within 45 degrees of the normal; infinite where no element within `reach` [m] does.
    """
    whole, result = mesh.whole, np.full(mesh.n_elements, np.inf)
    farthest = np.minimum(reach, 4.0 * whole.diameter) + np.zeros(mesh.n_elements)
    for own, other in _near_pairs(mesh, farthest):
        arm = whole.centres[other] - whole.centres[own]
        across, distance = -np.sum(arm * whole.normals[own], axis=1), np.hypot(arm[:, 0], arm[:, 1])
        facing = np.sum(whole.normals[own] * whole.normals[other], axis=1)
        faces = (distance <= farthest[own]) & (facing < _FACING) & (across > np.sqrt(0.5) * distance)
        np.minimum.at(result, own[faces], distance[faces])
    return result


def _near_pairs(mesh: BoundaryMesh, farthest: FloatArray) -> Iterator[tuple[IntArray, IntArray]]:
    """Yield elements and those of the whole body that may be as near; on small meshes all are."""
    whole, elements = mesh.whole, np.arange(mesh.n_elements)
    if whole.n_elements <= _FEW:
        yield np.repeat(elements, whole.n_elements), np.tile(np.arange(whole.n_elements), mesh.n_elements)
        return
    from scipy.spatial import KDTree

    tree = KDTree(whole.centres)
    for rows in np.split(elements, range(_ROWS, mesh.n_elements, _ROWS)):
        near = tree.query_ball_point(mesh.centres[rows], farthest[rows], return_sorted=False)
        counts = np.fromiter(map(len, near), np.intp, len(near))
        yield np.repeat(rows, counts), np.fromiter(itertools.chain.from_iterable(near), np.intp, counts.sum())
