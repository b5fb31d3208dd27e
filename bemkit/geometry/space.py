"""Boundary element spaces: what a displacement or traction looks like on each element."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Protocol

import numpy as np

from bemkit.arrays import BoolArray, FloatArray, IntArray
from bemkit.geometry.mesh import BoundaryMesh


class BoundarySpace(Protocol):
    """Piecewise polynomials on a boundary mesh; the vector dof of component c is 2 * scalar dof + c.

    A new space needs only these members; `bemkit.testing.check_space` proves its promises.
    """

    @property
    def mesh(self) -> BoundaryMesh:
        """The mesh the space lives on."""

    @property
    def degree(self) -> int:
        """Largest polynomial degree on an element."""

    @property
    def is_continuous(self) -> bool:
        """Whether every function of the space is continuous on each closed loop."""

    @property
    def n_dofs(self) -> int:
        """Number of vector dofs: twice the number of scalar dofs."""

    @property
    def element_dofs(self) -> IntArray:
        """(n_elements, n_local) array: the scalar dofs of each element; a column never repeats a dof."""

    @property
    def local_nodes(self) -> FloatArray:
        """(n_local,) array: where in [-1, 1] each local dof is the value of the function."""

    def basis(self, xi: FloatArray) -> FloatArray:
        """Evaluate the local basis: (n_points,) in [-1, 1] -> (n_local, n_points)."""


def local_coefficients(space: BoundarySpace) -> FloatArray:
    """Return the monomial coefficients of the local basis.

    Returns
    -------
    (n_local, degree + 1) array
        Row p holds the coefficients of xi**0 ... xi**degree of the local basis function p.
    """
    n = space.degree + 1
    xi = np.cos((np.arange(n) + 0.5) * np.pi / n)
    vandermonde = np.vander(xi, n, increasing=True)
    coefficients: FloatArray = np.linalg.solve(vandermonde, space.basis(xi).T).T
    coefficients[np.abs(coefficients) < 1e-14] = 0.0  # round-off of the solve; keeps sums free of empty terms
    return coefficients


def dof_points(space: BoundarySpace) -> FloatArray:
    """Return the (n_scalar, 2) points [m] at which the scalar dofs are function values."""
    points = np.empty((space.n_dofs // 2, 2))
    elements = np.arange(space.mesh.n_elements)
    points[space.element_dofs] = space.mesh.points(elements, space.local_nodes)
    return points


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
    from bemkit.geometry.quadrature import gauss_legendre

    xi, weights = gauss_legendre(space.degree + 2 if bool(space.mesh.is_straight[elements].all()) else 16)
    local = (space.mesh.jacobian(elements, xi) * weights) @ space.basis(xi).T
    result = np.zeros(space.n_dofs // 2)
    np.add.at(result, space.element_dofs[elements], local)
    return result


@dataclass(frozen=True, eq=False)
class ConstantSpace:
    """Piecewise constant functions: one scalar dof per element, at its midpoint."""

    mesh: BoundaryMesh

    @property
    def degree(self) -> int:
        """Polynomial degree 0."""
        return 0

    @property
    def is_continuous(self) -> bool:
        """Constants jump from element to element."""
        return False

    @property
    def n_dofs(self) -> int:
        """Number of vector dofs."""
        return 2 * self.mesh.n_elements

    @cached_property
    def element_dofs(self) -> IntArray:
        """(n_elements, 1) array of scalar dofs."""
        return np.arange(self.mesh.n_elements)[:, None]

    @cached_property
    def local_nodes(self) -> FloatArray:
        """The midpoint."""
        return np.zeros(1)

    def basis(self, xi: FloatArray) -> FloatArray:
        """Evaluate the constant 1."""
        return np.ones((1, xi.size))


def _endpoint_dofs(mesh: BoundaryMesh, broken: BoolArray | None) -> tuple[IntArray, int]:
    """Give the end points of the elements their dofs, and a broken node one for each side."""
    dofs = mesh.elements.copy()
    n_scalar = mesh.n_nodes
    if broken is not None and broken.any():
        n_extra = int(broken.sum())
        second = np.full(mesh.n_nodes, -1)
        second[broken] = n_scalar + np.arange(n_extra)
        incoming_end = mesh.elements[:, 1]
        dofs[:, 1] = np.where(broken[incoming_end], second[incoming_end], incoming_end)
        n_scalar += n_extra
    return dofs, n_scalar


@dataclass(frozen=True, eq=False)
class LinearSpace:
    """Piecewise linear functions, continuous except at the nodes named in `broken`.

    Parameters
    ----------
    mesh : BoundaryMesh
    broken : (n_nodes,) bool array, optional
        Nodes where the function may jump (tractions jump at corners). `corner_nodes(mesh)` finds the corners.
    """

    mesh: BoundaryMesh
    broken: BoolArray | None = None

    @property
    def degree(self) -> int:
        """Polynomial degree 1."""
        return 1

    @property
    def is_continuous(self) -> bool:
        """Whether no node is broken."""
        return self.broken is None or not bool(self.broken.any())

    @cached_property
    def _numbering(self) -> tuple[IntArray, int]:
        return _endpoint_dofs(self.mesh, self.broken)

    @property
    def n_dofs(self) -> int:
        """Number of vector dofs."""
        return 2 * self._numbering[1]

    @property
    def element_dofs(self) -> IntArray:
        """(n_elements, 2) array of scalar dofs: start, end."""
        return self._numbering[0]

    @cached_property
    def local_nodes(self) -> FloatArray:
        """The two end points."""
        return np.array([-1.0, 1.0])

    def basis(self, xi: FloatArray) -> FloatArray:
        """Evaluate the two hat functions."""
        return np.stack([0.5 * (1.0 - xi), 0.5 * (1.0 + xi)])


@dataclass(frozen=True, eq=False)
class QuadraticSpace:
    """Piecewise quadratic functions, continuous except at the nodes named in `broken`.

    Parameters
    ----------
    mesh : BoundaryMesh
    broken : (n_nodes,) bool array, optional
        Nodes where the function may jump.
    """

    mesh: BoundaryMesh
    broken: BoolArray | None = None

    @property
    def degree(self) -> int:
        """Polynomial degree 2."""
        return 2

    @property
    def is_continuous(self) -> bool:
        """Whether no node is broken."""
        return self.broken is None or not bool(self.broken.any())

    @cached_property
    def _numbering(self) -> tuple[IntArray, int]:
        ends, n_ends = _endpoint_dofs(self.mesh, self.broken)
        middle = n_ends + np.arange(self.mesh.n_elements)
        return np.column_stack([ends[:, 0], middle, ends[:, 1]]), n_ends + self.mesh.n_elements

    @property
    def n_dofs(self) -> int:
        """Number of vector dofs."""
        return 2 * self._numbering[1]

    @property
    def element_dofs(self) -> IntArray:
        """(n_elements, 3) array of scalar dofs: start, middle, end."""
        return self._numbering[0]

    @cached_property
    def local_nodes(self) -> FloatArray:
        """The end points and the midpoint."""
        return np.array([-1.0, 0.0, 1.0])

    def basis(self, xi: FloatArray) -> FloatArray:
        """Evaluate the three Lagrange polynomials."""
        return np.stack([0.5 * xi * (xi - 1.0), (1.0 - xi) * (1.0 + xi), 0.5 * xi * (xi + 1.0)])


def corner_nodes(mesh: BoundaryMesh, angle: float = 1e-6) -> BoolArray:
    """Return the (n_nodes,) mask of nodes where the tangent turns by more than `angle` [rad].

    The direction of a short element is known only as well as its coordinates are; that round-off is added to `angle`.
    """
    incoming, outgoing = mesh.node_elements[:, 0], mesh.node_elements[:, 1]
    before = mesh.normals_at(incoming, np.array([1.0]))[:, 0]
    after = mesh.normals_at(outgoing, np.array([-1.0]))[:, 0]
    cross = before[:, 0] * after[:, 1] - before[:, 1] * after[:, 0]
    shortest = np.minimum(mesh.lengths[incoming], mesh.lengths[outgoing])
    round_off = 8.0 * np.finfo(float).eps * np.abs(mesh.nodes).max(axis=1) / shortest
    corners: BoolArray = np.abs(np.arctan2(cross, np.sum(before * after, axis=1))) > angle + round_off
    return corners
