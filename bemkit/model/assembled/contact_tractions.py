"""Contact tractions on the elements of both sides, from those at the nodes with multipliers."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy import sparse

from bemkit.arrays import BoolArray, FloatArray, IntArray
from bemkit.geometry.quadrature import gauss_legendre
from bemkit.geometry.spaces import BoundarySpace
from bemkit.model.assembled.contacts import ContactRows
from bemkit.model.assembled.placed import PlacedBody
from bemkit.model.boundary_tractions import projector

_REACHED = 1e-12
"""Share of the largest coupling from which on a node takes part; less is round-off of places where meshes meet."""


def contact_tractions(
    bodies: Sequence[PlacedBody], contacts: Sequence[ContactRows], traction: FloatArray
) -> list[list[tuple[IntArray, FloatArray]]]:
    """Return the tractions that contacts put on the elements of both their sides.

    Parameters
    ----------
    bodies : sequence of PlacedBody
    contacts : sequence of ContactRows
    traction : (n_contact, 2) array [Pa]
        At the nodes with multipliers, in (n, t) components.

    Returns
    -------
    list of lists of (elements, values)
        For each body its contact sides: (m,) elements and (m, n_local, 2) tractions [Pa] in x and y, at the local nodes
        of the traction space.

    Notes
    -----
    The nodal forces of a side over the integrals of its basis functions: with Gauss-Lobatto nodes that is exact for
    tractions of a degree less than the displacements, whatever the meshes. The integrals are those over all elements
    that the partner covers at least in part: an element where a partner ends carries its whole force, spread over its
    length. Forces of all contacts of a side are added up first.
    """
    sides: dict[tuple[int, bytes], tuple[IntArray, FloatArray, FloatArray]] = {}
    first = 0
    for rows in contacts:
        own = traction[first : first + rows.n_contact]
        first += rows.n_contact
        vectors = np.einsum("n,nk,nkc->nc", rows.weights, own, rows.frame)
        for number, coupling, elements, sign in _sides(rows):
            n_nodes = bodies[number].space.n_dofs // 2
            nothing = elements, np.zeros((n_nodes, 2)), np.zeros(n_nodes)
            _, forces, reached = sides.setdefault((number, elements.tobytes()), nothing)
            forces += sign * (coupling.T @ vectors)
            reached += abs(coupling).T @ rows.weights
            if not isinstance(rows.on_other, sparse.csr_array):  # an obstacle ends nowhere
                reached[bodies[number].space.element_dofs[elements]] = 1.0 + reached.max()
    found: list[list[tuple[IntArray, FloatArray]]] = [[] for _ in bodies]
    for (number, _), (elements, forces, reached) in sides.items():
        body = bodies[number]
        of_tractions = body.scene.discretisation.traction_space(body.mesh)
        is_reached = reached > _REACHED * reached.max(initial=0.0)
        values = _spread(forces, is_reached, elements, body.space)
        found[number].append((elements, _projected(values, body.space, of_tractions)))
    return found


def _spread(forces: FloatArray, is_reached: BoolArray, elements: IntArray, space: BoundarySpace) -> FloatArray:
    """Return tractions (m, n_local, 2) at the nodes of elements (m,) that stand for nodal forces (n_nodes, 2)."""
    dofs = space.element_dofs[elements]
    is_covered = np.asarray(is_reached[dofs].all(axis=1))
    # nodes that are alone: on a sliver, or beside nodes that a support holds
    alone = np.setdiff1d(np.flatnonzero(is_reached), dofs[is_covered])
    is_covered |= np.isin(dofs, alone).any(axis=1)
    xi, weights = gauss_legendre(space.degree + 1)
    integrals = 0.5 * space.mesh.lengths[elements][:, None] * (space.basis(xi) @ weights)
    totals = np.bincount(dofs[is_covered].ravel(), integrals[is_covered].ravel(), minlength=len(forces))
    has_total = totals > 0.0
    at_nodes = np.where(has_total[:, None], forces, 0.0) / np.where(has_total, totals, 1.0)[:, None]
    return np.asarray(at_nodes[dofs] * is_covered[:, None, None])


def _sides(rows: ContactRows) -> list[tuple[int, sparse.csr_array, IntArray, float]]:
    """Return body, coupling (n, n_nodes), elements and sign of each side that a contact has."""
    sides = [(rows.body, rows.on_body, rows.elements, 1.0)]
    if isinstance(rows.on_other, sparse.csr_array):
        sides.append((rows.other, rows.on_other, rows.other_elements, -1.0))
    return sides


def _projected(at_nodes: FloatArray, space: BoundarySpace, of_tractions: BoundarySpace) -> FloatArray:
    """Project fields (m, n_local, 2) at the nodes of displacements onto the tractions of elements."""
    xi, weights = gauss_legendre(space.degree + 1)
    projection = space.basis(xi) @ projector(of_tractions, xi, weights).T
    return np.asarray(np.einsum("pl,epc->elc", projection, at_nodes))
