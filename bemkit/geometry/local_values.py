"""Functions of a space element by element, also where the degrees of elements differ.

On every element a function is written in the basis of the space, by its values at `BoundarySpace.local_nodes`. On an
element of lower degree p these values follow from its p + 1 dofs, and integrals against the basis of the space are
combined to those against its own p + 1 basis functions.
"""

from __future__ import annotations

import numpy as np

from bemkit.arrays import BoolArray, FloatArray, IntArray
from bemkit.geometry.quadrature import gauss_legendre, gauss_lobatto
from bemkit.geometry.spaces import BoundarySpace, LagrangeSpace, element_nodes, lagrange_polynomials


def element_degrees(space: BoundarySpace) -> IntArray:
    """Return the polynomial degree (n_elements,) of each element."""
    if isinstance(space, LagrangeSpace) and space.element_degrees is not None:
        return space.element_degrees
    return np.full(space.mesh.n_elements, space.degree)


def values_on_elements(space: BoundarySpace, dofs: FloatArray, elements: IntArray | None = None) -> FloatArray:
    """Return the values (m, n_local, ...) of a function at the local nodes of some elements; by default of all.

    Parameters
    ----------
    space : BoundarySpace
    dofs : (n_scalar, ...) array
        Values of the function at the dofs.
    elements : (m,) int array, optional
    """
    chosen = slice(None) if elements is None else elements
    return from_own_nodes(space, dofs[space.element_dofs[chosen]], elements)


def from_own_nodes(space: BoundarySpace, at_dofs: FloatArray, elements: IntArray | None = None) -> FloatArray:
    """Return the values (m, n_local, ...) at the local nodes from those (m, n_local, ...) at the dofs of elements."""
    if element_degrees(space).min() == space.degree:
        return at_dofs
    own = _values_of_own_functions(space, elements)
    return np.asarray(np.einsum("ekl,ek...->el...", own, at_dofs))


def continued_to_ends(
    space: BoundarySpace, elements: IntArray, is_known: BoolArray
) -> tuple[IntArray, IntArray, FloatArray]:
    """Continue a function that is known at some dofs of elements only, by the polynomial through all known values.

    Parameters
    ----------
    space : BoundarySpace
    elements : (m,) int array
    is_known : (m, n_local) bool array
        The dofs of each element where the function is known; there are no results for elements without any.

    Returns
    -------
    row, position : (n,) int arrays
        The unknown values: rows of `elements` and local dofs.
    factors : (n, n_local) array
        By which the values of that element are multiplied.
    """
    nodes, position = element_nodes(space)[elements], np.arange(is_known.shape[1])
    is_own = (position < element_degrees(space)[elements, None]) | (position == position[-1])
    is_known = is_known & is_own
    row, unknown = np.nonzero(is_own & ~is_known & is_known.any(axis=1, keepdims=True))
    factors = np.zeros((row.size, position.size))
    for own, known, own_nodes, at in zip(factors, is_known[row], nodes[row], unknown, strict=True):
        own[known] = lagrange_polynomials(own_nodes[known], own_nodes[[at]])[:, 0]
    return row, unknown, factors


def summed_at_dofs(space: BoundarySpace, integrals: FloatArray, elements: IntArray) -> FloatArray:
    """Return integrals (n_scalar, ...) against the global basis from those (m, n_local, ...) against the local one."""
    if element_degrees(space).min() < space.degree:
        integrals = np.einsum("ekl,el...->ek...", _values_of_own_functions(space, elements), integrals)
    result = np.zeros((space.n_dofs // 2, *integrals.shape[2:]))
    np.add.at(result, space.element_dofs[elements], integrals)
    return result


def _values_of_own_functions(space: BoundarySpace, elements: IntArray | None) -> FloatArray:
    """Return the values (m, n_dofs, n_local) of the functions of the dofs of elements at the local nodes.

    At the ends they are 0 or 1 to the last bit: elements of different degrees agree exactly at the node between them.
    """
    degrees = element_degrees(space)[slice(None) if elements is None else elements]
    values = np.zeros((degrees.size, space.degree + 1, space.degree + 1))
    for degree in np.unique(degrees).tolist():
        local = np.array([*range(degree), space.degree])
        of_degree = lagrange_polynomials(gauss_lobatto(degree), space.local_nodes)
        values[np.flatnonzero(degrees == degree)[:, None], local] = of_degree
    return values


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


def mean_tractions(space: BoundarySpace, traction: FloatArray) -> FloatArray:
    """Return the means (n_elements, 2) of tractions (n_elements, n_local, 2) at the local nodes of their space."""
    xi, weights = gauss_legendre(space.degree + 1)
    mean: FloatArray = np.einsum("l,elc->ec", space.basis(xi) @ weights / 2.0, traction)
    return mean


def projector(space: BoundarySpace, xi: FloatArray, weights: FloatArray) -> FloatArray:
    """Return (n_local, n_points): the local dofs of the least-squares fit to values at quadrature points."""
    basis = space.basis(xi)
    return np.asarray(np.linalg.solve((basis * weights) @ basis.T, basis * weights), float)
