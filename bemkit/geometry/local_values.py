"""Functions of a space element by element, also where the degrees of elements differ.

On every element a function is written by its values at `BoundarySpace.local_nodes`, in the basis of the space. Where an
element has a lower degree p than others these values follow from its own p + 1 dofs, and integrals against the basis
are summed up to those of its own.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from bemkit.arrays import FloatArray, IntArray
from bemkit.geometry.quadrature import gauss_legendre
from bemkit.geometry.spaces import BoundarySpace, LagrangeSpace


def element_degrees(space: BoundarySpace) -> IntArray:
    """Return the polynomial degree (n_elements,) of each element."""
    own = space.element_degrees if isinstance(space, LagrangeSpace) else None
    return np.full(space.mesh.n_elements, space.degree) if own is None else own


def values_on_elements(space: BoundarySpace, dofs: FloatArray, elements: IntArray | None = None) -> FloatArray:
    """Return the values (m, n_local, ...) at the local nodes of some elements, of all unless given.

    Those of the function with the values (n_scalar, ...) at the dofs.
    """
    chosen = slice(None) if elements is None else elements
    return from_own_nodes(space, dofs[space.element_dofs[chosen]], elements)


def from_own_nodes(space: BoundarySpace, at_dofs: FloatArray, elements: IntArray | None = None) -> FloatArray:
    """Return the values (m, n_local, ...) at the local nodes from those (m, n_local, ...) at the dofs of elements."""
    lifting = _lifting(space)
    if lifting is None:
        return at_dofs
    return np.asarray(np.einsum("elk,ek...->el...", lifting[slice(None) if elements is None else elements], at_dofs))


def summed_at_dofs(space: BoundarySpace, integrals: FloatArray, elements: IntArray) -> FloatArray:
    """Sum up integrals (m, n_local, ...) against the local basis of elements to those (n_scalar, ...) of the dofs."""
    lifting = _lifting(space)
    if lifting is not None:
        integrals = np.einsum("elk,el...->ek...", lifting[elements], integrals)
    result = np.zeros((space.n_dofs // 2, *integrals.shape[2:]))
    np.add.at(result, space.element_dofs[elements], integrals)
    return result


def _lifting(space: BoundarySpace) -> FloatArray | None:
    return space.lifting if isinstance(space, LagrangeSpace) else None


def dof_weights(space: BoundarySpace, elements: IntArray) -> FloatArray:
    """Return the integrals of the scalar basis functions over some elements.

    Parameters
    ----------
    space : BoundarySpace
    elements : (n,) array
        The elements to integrate over.

    Returns
    -------
    (n_scalar,) array [m]
    """
    xi, weights = gauss_legendre(space.degree + 2 if bool(space.mesh.is_straight[elements].all()) else 16)
    local = (space.mesh.jacobian(elements, xi) * weights) @ space.basis(xi).T
    return summed_at_dofs(space, local, elements)


def of_one_degree(
    spaces: Sequence[BoundarySpace], elements: IntArray
) -> Iterator[tuple[IntArray, tuple[BoundarySpace, ...]]]:
    """Yield those of some elements that have one degree in each of several spaces, and the spaces as they see them."""
    if not any(isinstance(space, LagrangeSpace) and space.element_degrees is not None for space in spaces):
        yield elements, tuple(spaces)
        return
    kinds, group = np.unique([element_degrees(space)[elements] for space in spaces], axis=1, return_inverse=True)
    for number, degrees in enumerate(kinds.T.tolist()):
        seen = zip(spaces, degrees, strict=True)
        yield elements[group.ravel() == number], tuple(_as_seen(space, degree) for space, degree in seen)


def _as_seen(space: BoundarySpace, degree: int) -> BoundarySpace:
    if isinstance(space, LagrangeSpace) and space.element_degrees is not None:
        return space.of_degree(degree)
    return space


def mean_tractions(space: BoundarySpace, traction: FloatArray) -> FloatArray:
    """Return the means (n_elements, 2) of tractions (n_elements, n_local, 2) at the local nodes of their space."""
    xi, weights = gauss_legendre(space.degree + 1)
    mean: FloatArray = np.einsum("l,elc->ec", space.basis(xi) @ weights / 2.0, traction)
    return mean


def projector(space: BoundarySpace, xi: FloatArray, weights: FloatArray) -> FloatArray:
    """Return (n_local, n_points): the local dofs of the least-squares fit to values at quadrature points."""
    basis = space.basis(xi)
    return np.asarray(np.linalg.solve((basis * weights) @ basis.T, basis * weights), float)
