"""Boundary element spaces: what a displacement or traction looks like on each element."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property, lru_cache
from typing import ClassVar, Protocol

import numpy as np

from bemkit.arrays import BoolArray, FloatArray, IntArray, read_only
from bemkit.geometry.errors import GeometryError
from bemkit.geometry.mesh import BoundaryMesh
from bemkit.geometry.quadrature import gauss_legendre, gauss_lobatto
from bemkit.geometry.vectors import angles_between

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
    (n_local, degree + 1) array
        Row p holds the coefficients of P_0 ... P_degree of the local basis function p.
    """
    n = space.degree + 1
    xi, weights = gauss_legendre(n)
    polynomials = np.polynomial.legendre.legvander(xi, space.degree)
    coefficients: FloatArray = (space.basis(xi) * weights) @ polynomials * (np.arange(n) + 0.5)
    coefficients[np.abs(coefficients) < 1e-14] = 0.0  # round-off; keeps sums free of empty terms
    return coefficients


def dof_points(space: BoundarySpace, mesh: BoundaryMesh | None = None) -> FloatArray:
    """Return the (n_scalar, 2) points [m] at which the scalar dofs are function values.

    Parameters
    ----------
    space : BoundarySpace
    mesh : BoundaryMesh, optional
        The same mesh in other units, to find the points there to the last digit; that of the space if left out.

    Returns
    -------
    (n_scalar, 2) array [m]
    """
    mesh = space.mesh if mesh is None else mesh
    points = np.empty((space.n_dofs // 2, 2))
    points[space.element_dofs] = mesh.points(np.arange(mesh.n_elements), space.local_nodes)
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
    xi, weights = gauss_legendre(space.degree + 2 if bool(space.mesh.is_straight[elements].all()) else 16)
    local = (space.mesh.jacobian(elements, xi) * weights) @ space.basis(xi).T
    result = np.zeros(space.n_dofs // 2)
    np.add.at(result, space.element_dofs[elements], local)
    return result


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


@dataclass(frozen=True, eq=False)
class ElementwiseSpace:
    """The functions of another space with dofs of their own on each element, so that all of them may jump."""

    space: BoundarySpace

    @property
    def mesh(self) -> BoundaryMesh:
        """The mesh of the other space."""
        return self.space.mesh

    @property
    def degree(self) -> int:
        """Polynomial degree of the other space."""
        return self.space.degree

    @property
    def is_continuous(self) -> bool:
        """Functions jump from element to element."""
        return False

    @property
    def n_dofs(self) -> int:
        """Number of vector dofs."""
        return 2 * self.element_dofs.size

    @cached_property
    def element_dofs(self) -> IntArray:
        """(n_elements, n_local) array of scalar dofs, element by element."""
        return np.arange(self.space.element_dofs.size).reshape(self.space.element_dofs.shape)

    @property
    def local_nodes(self) -> FloatArray:
        """Those of the other space."""
        return self.space.local_nodes

    def basis(self, xi: FloatArray) -> FloatArray:
        """Evaluate the local basis of the other space."""
        return self.space.basis(xi)


@dataclass(frozen=True, eq=False)
class LagrangeSpace:
    """Piecewise polynomials of any degree, continuous except at the nodes named in `broken`.

    Parameters
    ----------
    mesh : BoundaryMesh
    broken : (n_nodes,) bool array, optional
        Nodes where the function may jump (tractions jump at corners). `corner_nodes(mesh)` finds the corners.
    degree : int
        From 1 to `LARGEST_DEGREE`. The dofs of an element are the values at its Gauss-Lobatto points.

    Raises
    ------
    GeometryError
        If the degree is out of range, or `broken` does not have one flag for each node.
    """

    mesh: BoundaryMesh
    broken: BoolArray | None = None
    degree: int = field(kw_only=True)

    def __post_init__(self) -> None:
        check_degree(self.degree)
        if self.broken is not None and self.broken.shape != (self.mesh.n_nodes,):
            raise GeometryError(
                f"broken has the shape {self.broken.shape}: give one flag for each of the {self.mesh.n_nodes} nodes"
            )

    @property
    def is_continuous(self) -> bool:
        """Whether no node is broken."""
        return self.broken is None or not bool(self.broken.any())

    @property
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
        ends, n_inner = self._end_dofs, self.degree - 1
        inner = int(ends.max()) + 1 + np.arange(self.mesh.n_elements * n_inner).reshape(self.mesh.n_elements, n_inner)
        return np.column_stack([ends[:, 0], inner, ends[:, 1]])

    @cached_property
    def _end_dofs(self) -> IntArray:
        """Dofs of the start and the end of each element; the element that ends at a broken node has one of its own."""
        dofs = self.mesh.elements.copy()
        if self.broken is not None:
            # on a symmetry line there is no second element
            is_shared = self.broken & ~self.mesh.on_symmetry_lines.any(axis=1)
            own = np.full(self.mesh.n_nodes, -1)
            own[is_shared] = self.mesh.n_nodes + np.arange(int(is_shared.sum()))
            end = self.mesh.elements[:, 1]
            dofs[:, 1] = np.where(is_shared[end], own[end], end)
        return dofs

    def basis(self, xi: FloatArray) -> FloatArray:
        """Evaluate the Lagrange polynomials, each one at its own node and zero at the others."""
        nodes = self.local_nodes
        values = np.ones((nodes.size, xi.size))
        for own, value in zip(nodes, values, strict=True):
            for other in nodes[nodes != own]:
                value *= (xi - other) / (own - other)
        return values


@dataclass(frozen=True, eq=False)
class LinearSpace(LagrangeSpace):
    """Piecewise linear functions; see `LagrangeSpace`."""

    degree: int = field(default=1, init=False)


@dataclass(frozen=True, eq=False)
class QuadraticSpace(LagrangeSpace):
    """Piecewise quadratic functions; see `LagrangeSpace`."""

    degree: int = field(default=2, init=False)


def check_degree(degree: int) -> None:
    """Refuse a degree that no space has."""
    if isinstance(degree, bool) or not isinstance(degree, int) or not 1 <= degree <= LARGEST_DEGREE:
        raise GeometryError(f"degree is {degree!r}: give a whole number from 1 to {LARGEST_DEGREE}")


@lru_cache(maxsize=4)
def break_nodes(mesh: BoundaryMesh) -> BoolArray:
    """Return the (n_nodes,) mask, read-only, of nodes where tractions may jump: corners and ends of boundary parts."""
    if mesh.symmetry is not None:
        return break_nodes(mesh.whole)[: mesh.n_nodes]
    owner = np.full(mesh.n_elements, -1)
    for number, name in enumerate(mesh.parts):
        owner[mesh.part(name)] = number
    before, after = mesh.node_elements.T
    changes = (owner[before] != owner[after]) | (before == after)  # the same only at the ends of a half-plane
    breaks: BoolArray = corner_nodes(mesh) | changes
    read_only(breaks)
    return breaks


def corner_nodes(mesh: BoundaryMesh, angle: float = 1e-6) -> BoolArray:
    """Return the (n_nodes,) mask of nodes where the tangent turns by more than `angle` [rad].

    The direction of a short element is known only as well as its coordinates are; that round-off is added to `angle`.
    """
    if mesh.symmetry is not None:
        return corner_nodes(mesh.whole, angle)[: mesh.n_nodes]
    incoming, outgoing = mesh.node_elements[:, 0], mesh.node_elements[:, 1]
    before = mesh.normals_at(incoming, np.array([1.0]))[:, 0]
    after = mesh.normals_at(outgoing, np.array([-1.0]))[:, 0]
    shortest = np.minimum(mesh.lengths[incoming], mesh.lengths[outgoing])
    round_off = 8.0 * np.finfo(float).eps * np.abs(mesh.nodes).max(axis=1) / shortest
    corners: BoolArray = np.abs(angles_between(before, after)) > angle + round_off
    return corners
