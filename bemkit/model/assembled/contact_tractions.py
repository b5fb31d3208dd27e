"""Contact tractions on the elements of both sides, from those at the nodes with multipliers."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy import sparse

from bemkit.arrays import FloatArray, IntArray
from bemkit.geometry.quadrature import gauss_legendre
from bemkit.geometry.spaces import BoundarySpace
from bemkit.model.assembled.contacts import ContactRows
from bemkit.model.assembled.placed import PlacedBody
from bemkit.model.boundary_tractions import projector


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
    tractions of a degree less than the displacements, whatever the meshes. Forces and integrals of all contacts of a
    side are added up first.
    """
    sides: dict[tuple[int, bytes], tuple[IntArray, FloatArray, FloatArray]] = {}
    first = 0
    for rows in contacts:
        own = traction[first : first + rows.n_contact]
        first += rows.n_contact
        vectors = np.einsum("n,nk,nkc->nc", rows.weights, own, rows.frame)
        # what is rigid faces a side as a whole, also where another body touches it
        counts = isinstance(rows.on_other, sparse.csr_array) | np.any(own != 0.0, axis=1)
        for number, coupling, elements, sign in _sides(rows):
            n_nodes = bodies[number].space.n_dofs // 2
            nothing = elements, np.zeros((n_nodes, 2)), np.zeros(n_nodes)
            _, forces, integrals = sides.setdefault((number, elements.tobytes()), nothing)
            forces += sign * (coupling.T @ vectors)
            integrals += coupling.T @ np.where(counts, rows.weights, 0.0)
    found: list[list[tuple[IntArray, FloatArray]]] = [[] for _ in bodies]
    for (number, _), (elements, forces, integrals) in sides.items():
        is_reached = integrals > 1e-12 * integrals.max(initial=0.0)
        at_nodes = np.zeros_like(forces)
        at_nodes[is_reached] = forces[is_reached] / integrals[is_reached, None]
        body = bodies[number]
        of_tractions = body.scene.discretisation.traction_space(body.mesh)
        found[number].append((elements, _projected(at_nodes, elements, body.space, of_tractions)))
    return found


def _sides(rows: ContactRows) -> list[tuple[int, sparse.csr_array, IntArray, float]]:
    """Return body, coupling (n, n_nodes), elements and sign of each side that a contact has."""
    sides = [(rows.body, rows.on_body, rows.elements, 1.0)]
    if isinstance(rows.on_other, sparse.csr_array):
        sides.append((rows.other, rows.on_other, rows.other_elements, -1.0))
    return sides


def _projected(
    at_nodes: FloatArray, elements: IntArray, space: BoundarySpace, of_tractions: BoundarySpace
) -> FloatArray:
    """Project a field with given values at the nodes of displacements onto the tractions of some elements."""
    xi, weights = gauss_legendre(space.degree + 1)
    projection = space.basis(xi) @ projector(of_tractions, xi, weights).T
    return np.asarray(np.einsum("pl,epc->elc", projection, at_nodes[space.element_dofs[elements]]))
