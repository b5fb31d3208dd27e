"""Mortar coupling of two sides with non-matching meshes: a mean relative displacement for each multiplier.

Multipliers are defined on the covered part of the non-mortar side. On a completely covered element, all of whose nodes
carry multipliers, they are the dual basis [Wohlmuth2000], ``int psi_i phi_j = delta_ij int phi_i``: polynomials of the
degree of the displacements. Their integrals equal those of the displacement basis, which are positive for every degree
at Gauss-Lobatto points.

On other elements the multipliers are integrated over the covered part only [CichoszBischoff2011]. The dual basis is not
suitable there: integrals of quadratic and higher basis functions over a part may be negative, and a node far from a
short part would depend on an extrapolation. Instead, nodes in the covered part that may carry a multiplier have hat
functions, linear between these nodes and constant beyond the last ones. If there is no such node, the nearest node
takes the whole part. Hats are not negative, so weights are positive. Their sum is one, so uniform tractions are
transmitted exactly. No combination of hats is orthogonal to all displacement polynomials, so constraints are
independent.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from bemkit.arrays import BoolArray, FloatArray, IntArray
from bemkit.contact.mortar.projection import mean_directions, on_rays, rays
from bemkit.contact.mortar.segments import MortarQuadrature, Segments, common_refinement, quadrature_on
from bemkit.contact.mortar.sides import ContactSide
from bemkit.errors import GeometryError, format_point
from bemkit.geometry.neighbours import common_centre
from bemkit.geometry.quadrature import gauss_legendre
from bemkit.geometry.spaces import dof_points
from bemkit.geometry.vectors import turned_left

if TYPE_CHECKING:
    from scipy.sparse import csr_matrix

_AT_THE_EDGE = 1e-9
"""Largest distance of a covered node from the covered part, in local coordinates."""
_LEAST_SHARE = 0.01
"""Weight of a node, relative to the integral of its basis function, below which its neighbours take its share."""


def modified_rows(segments: Segments, may_carry: BoolArray) -> BoolArray:
    """Return a mask (m,) of elements that are partly covered or have nodes without a multiplier.

    Parameters
    ----------
    segments : Segments
    may_carry : (m, n_local) bool array
        Nodes of each element of the non-mortar side that may carry a multiplier.
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
        Segments; elements of `modified_rows` are cut at their nodes.
    quadrature : MortarQuadrature
        Quadrature on the segments.
    may_carry : (m, n_local) bool array

    Returns
    -------
    psi : (s, n_local, q) array
        Functions at the points of the quadrature.
    rows : (r,) int array
        Positions of the elements that are at least partly covered.
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
    mass[is_modified] = np.eye(phi.shape[1])  # the mass matrix of a short piece is singular
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
    """Return a mask (n_local,) of the nodes of an element that carry the multipliers of its covered part.

    Parameters
    ----------
    nodes : (n_local,) array
        Local coordinates.
    may_carry : (n_local,) bool array
    low, high : (k,) arrays
        Covered pieces.

    Returns
    -------
    (n_local,) bool array
        All False if no node may carry one.
    """
    distance = np.maximum(low - nodes[:, None], nodes[:, None] - high).min(axis=1)
    carries = may_carry & (distance <= _AT_THE_EDGE)
    if may_carry.any() and not carries.any():
        carries[np.argmin(np.where(may_carry, distance, np.inf))] = True
    return np.asarray(carries)


def hats(nodes: FloatArray, carries: BoolArray, xi: FloatArray) -> FloatArray:
    """Return hat functions (s, n_local, q) at xi (s, q): linear between marked nodes, constant beyond the last ones.

    Each hat is one at its node; unmarked nodes have zero functions.
    """
    values = np.zeros((len(xi), nodes.size, xi.shape[1]))
    marked = np.flatnonzero(carries)
    marked = marked[np.argsort(nodes[marked])]
    for node, unit in zip(marked, np.eye(marked.size), strict=True):
        values[:, node] = np.interp(xi, nodes[marked], unit)
    return values


class NotFacingError(GeometryError):
    """Two sides do not face each other."""


@dataclass(frozen=True, eq=False)
class MortarCoupling:
    """Relative displacements of two sides at the nodes of their multipliers.

    The relative displacement of node i is ``frame[i] @ (on_non_mortar[i] @ u1 - on_mortar[i] @ u2)``, with the
    displacements (n_scalar, 2) of both bodies in x and y. A traction t_i, in the frame, exerts the nodal forces
    ``weights[i] * outer(on_non_mortar[i], t_i @ frame[i])`` on the non-mortar body, and the opposite forces with
    ``on_mortar`` on the mortar body.

    Parameters
    ----------
    nodes : (n,) int array
        Scalar dofs of the non-mortar space that carry a multiplier, in order along the side.
    points : (n, 2) array [m]
        Positions of the nodes.
    arc_length : (n,) array [m]
        Arc length of the nodes from the start of the side.
    frame : (n, 2, 2) array
        Rows are the direction d of contact, which is the mean of both normals and points out of the non-mortar body,
        and the tangent ``(-d_y, d_x)``.
    weights : (n,) array [m]
        ``int psi_i`` over the covered part of the non-mortar side; positive.
    gap : (n,) array [m]
        Mean distance along d, weighted by psi_i.
    overlap : float [m]
        Largest depth of overlap of the sides; zero without overlap.
    deepest : (2,) array [m]
        Point of the largest depth.
    on_non_mortar : (n, n_scalar) csr_matrix
        ``int psi_i phi_j / weights_i`` with the basis of the non-mortar space; rows sum to one.
    on_mortar : (n, n_scalar) csr_matrix
        The same with the basis of the mortar space at the projected points; rows sum to one.
    """

    nodes: IntArray
    points: FloatArray
    arc_length: FloatArray
    frame: FloatArray
    weights: FloatArray
    gap: FloatArray
    overlap: float
    deepest: FloatArray
    on_non_mortar: csr_matrix
    on_mortar: csr_matrix


def couple(
    non_mortar: ContactSide, mortar: ContactSide, *, without: IntArray | None = None, reach: float = np.inf
) -> MortarCoupling:
    """Couple two sides by mortar integrals with dual multipliers.

    Parameters
    ----------
    non_mortar : ContactSide
        The side that carries the multipliers; see `bemkit.contact.mortar.facing.is_non_mortar`.
    mortar : ContactSide
    without : (k,) int array, optional
        Scalar dofs of the non-mortar space without a multiplier, because a support holds them or several bodies meet
        there. The other nodes of their elements take their share.
    reach : float [m]
        Largest distance of facing sides along the direction of contact.

    Returns
    -------
    MortarCoupling
        Coupling of the nodes whose elements are at least partly covered.

    Raises
    ------
    NotFacingError
        If the sides do not face each other, or only where no node may carry a multiplier.

    Notes
    -----
    The projection is along the mean of both normals, interpolated along the non-mortar side [PusoLaursen2004],
    [PoppEtAl2010]. If both sides are arcs about one point, the mean positions of both sides of a node lie on a ray from
    it, which is the direction, so that rotations about it leave the gap and pressures have no moment. If the weight of
    a node is less than a hundredth of the integral of its basis function, because only a sliver of its elements is
    covered, other nodes take its share; slivers without other nodes are not covered.
    """
    directions, segments = facing_segments(non_mortar, mortar, reach)
    may_carry = np.ones(non_mortar.dofs.shape, bool) if without is None else ~np.isin(non_mortar.dofs, without)
    while may_carry[segments.row[segments.is_covered]].any():
        coupling, slivers = _integrate(non_mortar, mortar, directions, segments, may_carry)
        if not slivers.size:
            return coupling
        may_carry &= ~np.isin(non_mortar.dofs, slivers)
    raise NotFacingError(
        f"the sides at {format_point(non_mortar.start[0])} and {format_point(mortar.start[0])} face each other only "
        "where no node can carry a multiplier: use more elements, or leave more nodes free"
    )


def facing_segments(non_mortar: ContactSide, mortar: ContactSide, reach: float) -> tuple[FloatArray, Segments]:
    """Return the directions of contact (n_knots, 2) of a side, and its segments that face another side.

    Raises
    ------
    NotFacingError
        If no piece faces the other side within the distance `reach` [m].
    """
    directions = mean_directions(non_mortar, mortar, reach)
    segments = common_refinement(non_mortar, mortar, directions, reach)
    if not segments.is_covered.any():
        longest = float(max(non_mortar.lengths.max(), mortar.lengths.max()))
        coarse = (
            f", or elements shorter than {longest:.3g}, which are judged by their middles" if longest > reach else ""
        )
        raise NotFacingError(
            f"the sides at {format_point(non_mortar.start[0])} and {format_point(mortar.start[0])} face each other "
            f"nowhere within the distance {reach:g}: choose sides whose outward normals point at each other{coarse}"
        )
    return directions, segments


def _integrate(
    side: ContactSide, mortar: ContactSide, directions: FloatArray, segments: Segments, may_carry: BoolArray
) -> tuple[MortarCoupling, IntArray]:
    """Return the coupling with multipliers at some nodes (m, n_local), and dofs (k,) whose share is a sliver."""
    # integrals of the multipliers over the covered segments
    segments = segments.cut(modified_rows(segments, may_carry), side.space.local_nodes)
    quadrature = quadrature_on(segments, side, mortar, directions)
    psi, elements, integrals = multiplier_functions(side, segments, quadrature, may_carry)
    # nodes with a tiny part of their full weight are slivers; the others are the rows of the coupling
    rows, slivers = _MultiplierRows.from_integrals(side, elements, integrals)
    # mortar integrals with the bases of both sides
    weighted_psi = psi * quadrature.weights[:, None]
    mortar_basis = mortar.space.basis(quadrature.eta.ravel()).reshape(-1, *quadrature.eta.shape).transpose(1, 2, 0)
    mortar_integrals = np.matmul(weighted_psi, mortar_basis)
    on_non_mortar = rows.matrix(elements, side.dofs[elements], integrals, side.space.n_dofs // 2)
    on_mortar = rows.matrix(quadrature.row, mortar.dofs[quadrature.partner], mortar_integrals, mortar.space.n_dofs // 2)
    # mean of the gap vector for each multiplier, along the direction of contact of its node
    gap = rows.summed(quadrature.row, np.matmul(weighted_psi, quadrature.gap))
    node_xi = side.space.local_nodes[rows.local][:, None]
    direction = side.directions(directions, rows.element, node_xi)[:, 0]
    centre = common_centre([(each.mesh, each.elements) for each in (side, mortar)])
    if centre is not None and side.mesh.symmetry is None:
        direction = rays(on_non_mortar @ dof_points(side.space) - centre, direction)
        on_mortar = on_rays(on_mortar, direction, dof_points(mortar.space) - centre, mortar.resolution)
    distance = np.einsum("nc,nc->n", direction, gap) / rows.weights
    distance[np.abs(distance) <= max(side.resolution, mortar.resolution)] = 0.0
    overlap, deepest = _deepest_overlap(side, directions, quadrature)
    coupling = MortarCoupling(
        nodes=rows.dofs,
        points=side.points(rows.element, node_xi)[:, 0],
        arc_length=side.arc_length[rows.element, rows.local],
        frame=np.stack([direction, turned_left(direction)], axis=1),
        weights=rows.weights,
        gap=distance,
        overlap=overlap,
        deepest=deepest,
        on_non_mortar=on_non_mortar,
        on_mortar=on_mortar,
    )
    return coupling, slivers


@dataclass(frozen=True, eq=False)
class _MultiplierRows:
    """The nodes with a multiplier in the order of the arc length, which are the rows of the coupling.

    Parameters
    ----------
    dofs, element, local : (n,) int arrays
        Scalar dof of each node, an element that contains it, and its local index there.
    weights : (n,) array [m]
        Integrals of the multipliers; positive.
    row_of : (m, n_local) int array
        Row of each node of each element; -1 for nodes without a multiplier.
    """

    dofs: IntArray
    element: IntArray
    local: IntArray
    weights: FloatArray
    row_of: IntArray

    @classmethod
    def from_integrals(
        cls, side: ContactSide, elements: IntArray, integrals: FloatArray
    ) -> tuple[_MultiplierRows, IntArray]:
        """Return the rows of nodes with sufficient weight, and the dofs whose weight is a sliver."""
        dofs, first, index = np.unique(side.dofs, return_index=True, return_inverse=True)
        node_of = index.reshape(side.dofs.shape)
        weights = np.zeros(dofs.size)
        np.add.at(weights, node_of[elements], integrals.sum(axis=2))
        full_weights = np.bincount(node_of.ravel(), _basis_integrals(side).ravel())
        has_weight = weights > 0.0
        slivers = dofs[has_weight & (weights < _LEAST_SHARE * full_weights)]

        arc_length = side.arc_length.ravel()[first]
        order = np.argsort(np.where(has_weight, arc_length, np.inf), kind="stable")[: np.count_nonzero(has_weight)]
        row_of_node = np.full(dofs.size, -1)
        row_of_node[order] = np.arange(order.size)
        element, local = np.divmod(first[order], side.space.local_nodes.size)
        return cls(dofs[order], element, local, weights[order], row_of_node[node_of]), slivers

    def summed(self, elements: IntArray, values: FloatArray) -> FloatArray:
        """Sum values (k, n_local, j) at the nodes of elements (k,): (n, j)."""
        row = self.row_of[elements]
        sums = np.zeros((self.dofs.size, values.shape[2]))
        np.add.at(sums, row[row >= 0], values[row >= 0])
        return sums

    def matrix(self, elements: IntArray, columns: IntArray, values: FloatArray, n_columns: int) -> csr_matrix:
        """Sum values (k, n_local, j) at the nodes of elements (k,) and columns (k, j), relative to the weights."""
        from scipy.sparse import csr_matrix

        row, column = np.broadcast_arrays(self.row_of[elements][:, :, None], columns[:, None])
        is_kept = (row >= 0) & (values != 0.0)
        entries, index = np.unique(row[is_kept] * n_columns + column[is_kept], return_inverse=True)
        row, column = np.divmod(entries, n_columns)
        sums = np.bincount(index, values[is_kept]) / self.weights[row]
        starts = np.searchsorted(row, np.arange(self.dofs.size + 1))
        return csr_matrix((sums, column, starts), shape=(self.dofs.size, n_columns))


def _deepest_overlap(
    side: ContactSide, directions: FloatArray, quadrature: MortarQuadrature
) -> tuple[float, FloatArray]:
    """Return the largest overlap [m] of the sides at a quadrature point, zero if there is none, and the point (2,)."""
    depth = -np.einsum("sqc,sqc->sq", quadrature.gap, side.directions(directions, quadrature.row, quadrature.xi))
    segment, position = np.divmod(int(np.argmax(depth)), depth.shape[1])
    point = side.points(quadrature.row[[segment]], quadrature.xi[segment, [position]])[0, 0]
    return max(float(depth[segment, position]), 0.0), point


def _basis_integrals(side: ContactSide) -> FloatArray:
    """Return the integrals (m, n_local) [m] of the basis functions over the elements of a side."""
    xi, weights = gauss_legendre(side.space.degree + 1)
    return 0.5 * side.lengths[:, None] * (side.space.basis(xi) @ weights)
