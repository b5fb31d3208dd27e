"""Boundary element spaces: the functions of displacements and tractions on each element."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property, lru_cache, partial
from typing import ClassVar, Protocol

import numpy as np

from bemkit.arrays import BoolArray, FloatArray, IntArray, read_only
from bemkit.errors import GeometryError
from bemkit.geometry.mesh import BoundaryMesh
from bemkit.geometry.quadrature import gauss_legendre, gauss_lobatto

LARGEST_DEGREE = 12
"""Highest polynomial degree of an element; integrals are exact to round-off up to it."""


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
    """Return the Legendre coefficients of the local basis.

    Returns
    -------
    (n_local, degree + 1) array, read-only
        Row p holds the coefficients of P_0 ... P_degree of the local basis function p.
    """
    if isinstance(space, LagrangeSpace):
        return _lagrange_coefficients(space.degree)
    return _coefficients(space.basis, space.degree)


def element_coefficients(space: BoundarySpace) -> FloatArray:
    """Return the Legendre coefficients of the functions of the dofs of each element.

    Returns
    -------
    (n_elements, n_local, degree + 1) array, read-only
        In the order of ``element_dofs``; zero for the repeated dofs of elements of lower degree, but for the last one.
    """
    if not isinstance(space, LagrangeSpace) or space.element_degrees is None:
        return np.broadcast_to(local_coefficients(space), (space.mesh.n_elements, *local_coefficients(space).shape))
    coefficients = np.zeros((space.mesh.n_elements, space.degree + 1, space.degree + 1))
    for degree in np.unique(space.element_degrees).tolist():
        local = np.array([*range(degree), space.degree])
        elements = np.flatnonzero(space.element_degrees == degree)
        coefficients[np.ix_(elements, local, np.arange(degree + 1))] = _lagrange_coefficients(degree)
    return read_only(coefficients)


def _coefficients(basis: Callable[[FloatArray], FloatArray], degree: int) -> FloatArray:
    n = degree + 1
    xi, weights = gauss_legendre(n)
    polynomials = np.polynomial.legendre.legvander(xi, degree)
    coefficients: FloatArray = (basis(xi) * weights) @ polynomials * (np.arange(n) + 0.5)
    coefficients[np.abs(coefficients) < 1e-14] = 0.0  # round-off; keeps sums free of empty terms
    return coefficients


@lru_cache(maxsize=16)
def _lagrange_coefficients(degree: int) -> FloatArray:
    return read_only(_coefficients(partial(lagrange_polynomials, gauss_lobatto(degree)), degree))


def dof_points(space: BoundarySpace, mesh: BoundaryMesh | None = None) -> FloatArray:
    """Return the (n_scalar, 2) points [m] at which the scalar dofs are function values.

    Parameters
    ----------
    space : BoundarySpace
    mesh : BoundaryMesh, optional
        The same mesh in other units, for points that are exact to the last digit there; by default that of the space.

    Returns
    -------
    (n_scalar, 2) array [m]
    """
    mesh, points = space.mesh if mesh is None else mesh, np.empty((space.n_dofs // 2, 2))
    points[space.element_dofs] = mesh.points(np.arange(mesh.n_elements), element_nodes(space))
    return points


def element_nodes(space: BoundarySpace) -> FloatArray:
    """Return where on each element its dofs are values: (n_elements, n_local) local coordinates."""
    if not isinstance(space, LagrangeSpace) or space.element_degrees is None:
        return np.broadcast_to(space.local_nodes, space.element_dofs.shape)
    nodes = np.ones(space.element_dofs.shape)
    for degree in np.unique(space.element_degrees).tolist():
        nodes[space.element_degrees == degree, :degree] = gauss_lobatto(degree)[:-1]
    return nodes


@dataclass(frozen=True, eq=False)
class ConstantSpace:
    """Piecewise constant functions: one scalar dof per element, at its midpoint."""

    degree: ClassVar[int] = 0
    is_continuous: ClassVar[bool] = False
    local_nodes: ClassVar[FloatArray] = gauss_legendre(1)[0]

    mesh: BoundaryMesh

    @property
    def n_dofs(self) -> int:
        """Number of vector dofs."""
        return 2 * self.mesh.n_elements

    @cached_property
    def element_dofs(self) -> IntArray:
        """(n_elements, 1) array of scalar dofs."""
        return np.arange(self.mesh.n_elements)[:, None]

    def basis(self, xi: FloatArray) -> FloatArray:
        """Evaluate the constant 1."""
        return np.ones((1, xi.size))


class ElementwiseSpace:
    """The functions of another space with separate dofs on each element, so that they may jump at all nodes."""

    is_continuous: ClassVar[bool] = False

    def __init__(self, space: BoundarySpace) -> None:
        self.space, self.mesh, self.degree, self.local_nodes = space, space.mesh, space.degree, space.local_nodes
        self.element_dofs = np.arange(space.element_dofs.size).reshape(space.element_dofs.shape)
        self.n_dofs = 2 * self.element_dofs.size

    def basis(self, xi: FloatArray) -> FloatArray:
        """Evaluate the local basis of the other space."""
        return self.space.basis(xi)


@dataclass(frozen=True, eq=False)
class LagrangeSpace:
    """Piecewise polynomials of any degrees, continuous except at the nodes named in `broken`.

    Parameters
    ----------
    mesh : BoundaryMesh
    broken : (n_nodes,) bool array, optional
        Nodes where the function may jump (tractions jump at corners). `corner_nodes(mesh)` finds the corners.
    degree : int
        From 1 to `LARGEST_DEGREE`. The dofs of an element are the values at its Gauss-Lobatto points.
    element_degrees : (n_elements,) int array, optional
        Where elements differ; `degree` is then the largest one. Neighbours share the node between them.

    Raises
    ------
    GeometryError
        If a degree is out of range, or there is not one flag for each node or one degree for each element.

    Notes
    -----
    Where degrees differ, `local_nodes` and `basis` are those of the largest degree, which contains the functions of all
    elements (see `bemkit.geometry.local_values`). Rows of `element_dofs` of lower degree are filled up with the dof at
    the end of the element.
    """

    mesh: BoundaryMesh
    broken: BoolArray | None = None
    degree: int = field(kw_only=True)
    element_degrees: IntArray | None = field(default=None, kw_only=True)

    def __post_init__(self) -> None:
        check_degree(self.degree)
        if self.broken is not None and self.broken.shape != (self.mesh.n_nodes,):
            raise GeometryError(
                f"broken has the shape {self.broken.shape}: give one flag for each of the {self.mesh.n_nodes} nodes"
            )
        if self.element_degrees is not None:
            _check_element_degrees(self.element_degrees, self.mesh.n_elements, self.degree)

    @property
    def is_continuous(self) -> bool:
        """Whether no node is broken."""
        return self.broken is None or not bool(self.broken.any())

    @cached_property
    def n_dofs(self) -> int:
        """Number of vector dofs."""
        return 2 * (int(self.element_dofs.max()) + 1)

    @property
    def local_nodes(self) -> FloatArray:
        """(degree + 1,) array: the Gauss-Lobatto points."""
        return gauss_lobatto(self.degree)

    @cached_property
    def element_dofs(self) -> IntArray:
        """(n_elements, degree + 1) array of scalar dofs: start, inner nodes, end; those of mesh nodes come first."""
        ends, inner = self._end_dofs, np.arange(1, self.degree)
        degrees = np.full(self.mesh.n_elements, self.degree) if self.element_degrees is None else self.element_degrees
        by_degree = np.argsort(degrees, kind="stable")  # dofs of elements of one degree follow each other
        n_before = np.empty_like(degrees)
        n_before[by_degree] = np.cumsum(degrees[by_degree] - 1) - (degrees[by_degree] - 1)
        numbers = int(ends.max()) + n_before[:, None] + inner
        return np.column_stack([ends[:, 0], np.where(inner < degrees[:, None], numbers, ends[:, 1:]), ends[:, 1]])

    @cached_property
    def _end_dofs(self) -> IntArray:
        """(n_elements, 2): dofs of start and end; at a broken node the element that ends there has a second dof."""
        dofs = self.mesh.elements.copy()
        if self.broken is not None:
            # a node on a symmetry line has one element only
            is_shared = self.broken & ~self.mesh.on_symmetry_lines.any(axis=1)
            second_dof = np.full(self.mesh.n_nodes, -1)
            second_dof[is_shared] = self.mesh.n_nodes + np.arange(int(is_shared.sum()))
            end = self.mesh.elements[:, 1]
            dofs[:, 1] = np.where(is_shared[end], second_dof[end], end)
        return dofs

    def basis(self, xi: FloatArray) -> FloatArray:
        """Evaluate the Lagrange polynomials, each one at its own node and zero at the others."""
        return lagrange_polynomials(self.local_nodes, xi)


def lagrange_polynomials(nodes: FloatArray, xi: FloatArray) -> FloatArray:
    """Return the (n_nodes, n_points) values of the polynomials that are 1 at one of the nodes and 0 at the others."""
    distances = nodes[:, None] - nodes
    np.fill_diagonal(distances, 1.0)
    factors = (xi - nodes[:, None]) / distances[:, :, None]
    factors[np.diag_indices(nodes.size)] = 1.0
    return np.asarray(factors.prod(axis=1))


@dataclass(frozen=True, eq=False)
class LinearSpace(LagrangeSpace):
    """Piecewise linear functions; see `LagrangeSpace`."""

    degree: int = field(default=1, init=False)


@dataclass(frozen=True, eq=False)
class QuadraticSpace(LagrangeSpace):
    """Piecewise quadratic functions; see `LagrangeSpace`."""

    degree: int = field(default=2, init=False)


def check_degree(degree: int) -> None:
    """Raise GeometryError unless a degree is a whole number from 1 to `LARGEST_DEGREE`."""
    if isinstance(degree, bool) or not isinstance(degree, int) or not 1 <= degree <= LARGEST_DEGREE:
        raise GeometryError(f"degree is {degree!r}: give a whole number from 1 to {LARGEST_DEGREE}")


def _check_element_degrees(degrees: IntArray, n_elements: int, largest: int) -> None:
    if degrees.shape != (n_elements,):
        raise GeometryError(f"degree has {degrees.size} entries for {n_elements} elements: give one for each element")
    for degree in np.unique(degrees).tolist():
        check_degree(degree)
    if degrees.max() != largest:
        raise GeometryError(f"degree is {largest}, and that of elements up to {degrees.max()}: give the largest one")
