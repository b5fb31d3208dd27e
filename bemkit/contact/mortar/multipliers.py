"""Functions of the multipliers on the covered part of the non-mortar side.

On an element that is wholly covered, all of whose nodes carry multipliers, they are the dual basis [Wohlmuth2000]:
``int psi_i phi_j = delta_ij int phi_i``, polynomials of the degree of the displacements. Their integrals are those of
the displacements' basis, which at Gauss-Lobatto points are positive for every degree.

On any other element the multipliers have to see the covered part alone [CichoszBischoff2011], and there the dual basis
would do harm: the integrals of quadratic and higher basis functions over a part may be negative, and a node far from a
short part would rest on an extrapolation. Instead the nodes that lie in the covered part and may carry a multiplier
share it by hat functions: linear between these nodes, constant beyond the last of them. If there is no such node, the
nearest one takes the part alone. Hats are not negative, so that the weights stay positive, and they sum to one like the
dual basis, so that uniform tractions are transmitted exactly. No combination of them is orthogonal to all polynomials
of the displacements, so that no constraint repeats another one.
"""

from __future__ import annotations

import numpy as np

from bemkit.arrays import BoolArray, FloatArray, IntArray
from bemkit.contact.mortar.segments import MortarQuadrature, Segments
from bemkit.contact.mortar.sides import ContactSide

_AT_THE_EDGE = 1e-9
"""A node this far, in local coordinates, outside of the covered part counts as covered."""


def modified_rows(segments: Segments, may_carry: BoolArray) -> BoolArray:
    """Return (m,) bool: elements that are partly covered, or that have nodes without a multiplier.

    Parameters
    ----------
    segments : Segments
    may_carry : (m, n_local) bool array
        Nodes of each element of the non-mortar side.
    """
    is_modified = np.asarray(~may_carry.all(axis=1))
    is_modified[segments.row[~segments.is_covered]] = True
    return is_modified


def multiplier_functions(
    side: ContactSide, segments: Segments, quadrature: MortarQuadrature, may_carry: BoolArray
) -> tuple[FloatArray, IntArray, FloatArray]:
    """Evaluate the functions psi_i of the multipliers, and integrate them against the basis functions phi_j.

    Parameters
    ----------
    side : ContactSide
        The non-mortar side.
    segments : Segments
        Those of `modified_rows` cut at the nodes.
    quadrature : MortarQuadrature
        On these.
    may_carry : (m, n_local) bool array

    Returns
    -------
    psi : (s, n_local, q) array
        At the points of the quadrature.
    rows : (r,) int array
        Positions of the elements that are covered at least in part.
    integrals : (r, n_local, n_local) array [m]
        ``int psi_i phi_j``.
    """
    shape = quadrature.xi.shape
    phi = side.space.basis(quadrature.xi.ravel()).reshape(-1, *shape).transpose(1, 0, 2)
    rows, first, number = np.unique(quadrature.row, return_index=True, return_inverse=True)
    weighted = phi * quadrature.weights[:, None]

    def integrate(psi: FloatArray) -> FloatArray:
        return np.asarray(np.add.reduceat(np.matmul(psi, weighted.transpose(0, 2, 1)), first, axis=0))

    is_modified = modified_rows(segments, may_carry)[rows]
    mass = integrate(phi)
    integrals = np.eye(phi.shape[1]) * mass.sum(axis=2)[:, :, None]
    mass[is_modified] = np.eye(phi.shape[1])  # that of a short piece is singular
    psi = np.matmul((integrals @ np.linalg.inv(mass))[number], phi)
    nodes = side.space.local_nodes
    for k in np.flatnonzero(is_modified):
        covered = (segments.row == rows[k]) & segments.is_covered
        carries = carrying_nodes(nodes, may_carry[rows[k]], segments.low[covered], segments.high[covered])
        psi[number == k] = hats(nodes, carries, quadrature.xi[number == k])
    if is_modified.any():
        integrals[is_modified] = integrate(psi)[is_modified]
    return psi, rows, integrals


def carrying_nodes(nodes: FloatArray, may_carry: BoolArray, low: FloatArray, high: FloatArray) -> BoolArray:
    """Return (n_local,) bool: which nodes of an element share the multipliers of its covered part.

    Parameters
    ----------
    nodes : (n_local,) array
        Local coordinates.
    may_carry : (n_local,) bool array
    low, high : (k,) arrays
        The pieces that are covered.

    Returns
    -------
    (n_local,) bool array
        None if no node may carry one.
    """
    apart = np.maximum(low - nodes[:, None], nodes[:, None] - high).min(axis=1)
    carries = may_carry & (apart <= _AT_THE_EDGE)
    if may_carry.any() and not carries.any():
        carries[np.argmin(np.where(may_carry, apart, np.inf))] = True
    return np.asarray(carries)


def hats(nodes: FloatArray, carries: BoolArray, xi: FloatArray) -> FloatArray:
    """Return functions (s, n_local, q) at xi (s, q): linear between the marked nodes, constant beyond the last ones.

    Each is one at its own node; those of other nodes are zero.
    """
    values = np.zeros((len(xi), nodes.size, xi.shape[1]))
    marked = np.flatnonzero(carries)
    marked = marked[np.argsort(nodes[marked])]
    for own, unit in zip(marked, np.eye(marked.size), strict=True):
        values[:, own] = np.interp(xi, nodes[marked], unit)
    return values
