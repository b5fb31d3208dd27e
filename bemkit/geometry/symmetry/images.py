"""Functions on one side of symmetry lines as functions on the whole boundary.

A symmetric displacement or traction u is given by its dofs on the half. On the image g of element e it is

    u(g x) = signs_g u(x),

and since a single reflection also reverses the local coordinate, its local dofs there are those of e, in reverse order.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from bemkit.arrays import BoolArray, FloatArray, IntArray
from bemkit.errors import GeometryError
from bemkit.geometry.local_values import element_degrees
from bemkit.geometry.spaces import BoundarySpace
from bemkit.geometry.symmetry.lines import is_reversing


def element_images(space: BoundarySpace) -> Iterator[tuple[slice, FloatArray, IntArray]]:
    """Yield how a space on a half covers the whole boundary, image by image.

    Yields
    ------
    elements : slice
        Of ``space.mesh.whole``.
    signs : (2,) array
        Of the components x and y there.
    dofs : (n_elements, n_local) int array
        Scalar dofs of the space that are the local dofs of these elements.

    Raises
    ------
    GeometryError
        If there is a symmetry and the local basis is not symmetric.
    """
    n, symmetry = space.mesh.n_elements, space.mesh.symmetry
    if symmetry is None:
        yield slice(0, n), np.ones(2), space.element_dofs
        return
    nodes = space.local_nodes
    if not np.array_equal(nodes, -nodes[::-1]):
        raise GeometryError(
            f"symmetry: {type(space).__name__} has the local nodes {nodes.tolist()}, which its image does not have: "
            "choose local nodes that are symmetric about 0, or remove the symmetry"
        )
    for g, signs in enumerate(symmetry.images):
        dofs = space.element_dofs
        yield slice(g * n, g * n + n), signs, _reversed(space, dofs) if is_reversing(signs) else dofs


def _reversed(space: BoundarySpace, dofs: IntArray) -> IntArray:
    """Return the dofs of each element from its end to its start; those that it repeats stay its last ones."""
    columns = np.arange(dofs.shape[1])
    last = columns[-1] - (space.degree - element_degrees(space))[:, None]
    return np.take_along_axis(dofs, np.maximum(last - columns, 0), axis=1)


def reflected_to_whole(space: BoundarySpace, whole: BoundarySpace, values: FloatArray) -> FloatArray:
    """Return the dofs of a symmetric field on the whole boundary.

    Parameters
    ----------
    space : BoundarySpace
        On a mesh.
    whole : BoundarySpace
        The same kind of space on ``mesh.whole``.
    values : (n_scalar, 2) array
        Dofs of the field on `space`.

    Returns
    -------
    (n_scalar_of_whole, 2) array
    """
    result = np.empty((whole.n_dofs // 2, 2))
    for elements, signs, dofs in element_images(space):
        result[whole.element_dofs[elements]] = signs * values[dofs]
    return result


def antisymmetric_dofs(space: BoundarySpace) -> BoolArray:
    """Return which vector dofs are zero, because the function goes over into its image on a symmetry line.

    Returns
    -------
    (n_dofs,) bool array
        The components normal to a line at nodes on it, unless the function may jump there.
    """
    vanishes = np.zeros((space.n_dofs // 2, 2), bool)
    broken = getattr(space, "broken", None)
    if space.mesh.symmetry is None or (broken is None and not space.is_continuous):
        return vanishes.ravel()
    mesh = space.mesh
    joins = mesh.on_symmetry_lines if broken is None else mesh.on_symmetry_lines & ~broken[:, None]
    first, last = int(np.argmin(space.local_nodes)), int(np.argmax(space.local_nodes))
    for end, local in enumerate((first, last)):
        vanishes[space.element_dofs[:, local]] |= joins[mesh.elements[:, end]]
    return vanishes.ravel()
