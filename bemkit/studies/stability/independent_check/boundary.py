"""The boundary of a body at quadrature points, made from nothing but points on its elements."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bemkit.arrays import FloatArray, IntArray
from bemkit.results.solution import Solution

_N_POINTS = 8
"""Gauss points of an element: exact for products of loads and displacements of degree 15."""
_N_FITTED = 14
"""Points whose polynomial is differentiated: on an arc of 90 degrees 8 of them leave 1e-6, 14 of them round-off."""


@dataclass(frozen=True, eq=False)
class Boundary:
    """Places on each element, and how nodal values are interpolated there.

    Parameters
    ----------
    points, normals : (n_elements, n_places, 2) arrays [m], [-]
        At the quadrature points; the normals point out of the body.
    shares : (n_elements, n_places) array [m]
        Quadrature weights: the length of boundary that each point stands for.
    nodes : (n_elements, n_local) int array
        Rows of ``solution.boundary.displacement`` that each element interpolates.
    node_points, node_normals : (n_elements, n_local, 2) arrays [m], [-]
        At the nodes of each element; normals are one-sided at corners.
    basis : (n_local, n_places) array
        Lagrange polynomials at the quadrature points.
    """

    points: FloatArray
    normals: FloatArray
    shares: FloatArray
    nodes: IntArray
    node_points: FloatArray
    node_normals: FloatArray
    basis: FloatArray

    @property
    def lengths(self) -> FloatArray:
        """(n_elements,) array [m]."""
        return np.asarray(self.shares.sum(axis=1))

    def interpolated(self, nodal: FloatArray) -> FloatArray:
        """Return (n_elements, n_places, 2) values of nodal vectors (n_nodes, 2)."""
        return np.asarray(np.einsum("enc,nq->eqc", nodal[self.nodes], self.basis))


def boundary_of(solution: Solution) -> Boundary:
    """Return the elements of a solution with quadrature points, normals and interpolation."""
    mesh = solution.mesh
    places, weights = np.polynomial.legendre.leggauss(_N_POINTS)
    space = solution.scene.discretisation.displacement_space(mesh)  # which tells the rows of a result apart, no more
    node_places, nodes = space.local_nodes, space.element_dofs
    elements = np.arange(mesh.n_elements)
    fitted = np.polynomial.legendre.leggauss(_N_FITTED)[0]
    curve = mesh.points(elements, fitted) - mesh.centre
    slopes, node_slopes = (_slopes(curve, fitted, where) for where in (places, node_places))
    # on straight elements half the chord is exact, where differences of points lose digits
    half_chord = 0.5 * (mesh.end - mesh.start)[mesh.is_straight][:, None]
    slopes[mesh.is_straight] = node_slopes[mesh.is_straight] = half_chord
    return Boundary(
        points=mesh.points(elements, places),
        normals=turned_right(slopes),
        shares=np.hypot(slopes[..., 0], slopes[..., 1]) * weights,
        nodes=nodes,
        node_points=mesh.points(elements, node_places),
        node_normals=turned_right(node_slopes),
        basis=_lagrange(node_places, places),
    )


def turned_right(vectors: FloatArray) -> FloatArray:
    """Return unit vectors (..., 2) at a right angle to the right: outward normals of anticlockwise tangents."""
    size = np.hypot(vectors[..., 0], vectors[..., 1])
    return np.stack([vectors[..., 1] / size, -vectors[..., 0] / size], axis=-1)


def _lagrange(nodes: FloatArray, places: FloatArray) -> FloatArray:
    """Return the (n_nodes, n_places) Lagrange polynomials that belong to some nodes."""
    return np.asarray(np.linalg.solve(np.vander(nodes).T, np.vander(places, nodes.size).T))


def _slopes(values: FloatArray, places: FloatArray, targets: FloatArray) -> FloatArray:
    """Differentiate values (n, n_places, 2) at some places by their interpolating polynomial, at other places."""
    legendre = np.polynomial.legendre
    degree = places.size - 1
    coefficients = np.linalg.solve(legendre.legvander(places, degree), values.swapaxes(0, 1).reshape(places.size, -1))
    slopes = legendre.legvander(targets, degree - 1) @ legendre.legder(coefficients)
    return np.asarray(slopes.reshape(targets.size, len(values), 2).swapaxes(0, 1))
