"""One side of a contact: ordered elements of a body, continuous normals along them, and tests of what is inside."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from bemkit.arrays import BoolArray, FloatArray, IntArray
from bemkit.errors import GeometryError
from bemkit.geometry.mesh import BoundaryMesh
from bemkit.geometry.neighbours import along_boundary, arc_lengths
from bemkit.geometry.spaces import BoundarySpace
from bemkit.geometry.vectors import norms, turned_right, winding_numbers

_RESOLUTION = 32.0 * np.finfo(float).eps
"""Largest difference of equal positions, relative to the largest coordinate."""


@dataclass(frozen=True, eq=False)
class ContactSide:
    """Elements of a body that face another body.

    Parameters
    ----------
    space : BoundarySpace
        Displacement space on the placed mesh of the body, in physical units.
    elements : (m,) int array
        Elements of the side; sorted along the boundary.

    Raises
    ------
    GeometryError
        If there are no elements, or an element is repeated or does not exist.
    """

    space: BoundarySpace
    elements: IntArray

    def __post_init__(self) -> None:
        elements, n_elements = np.asarray(self.elements), self.space.mesh.n_elements
        if not elements.size:
            raise GeometryError("ContactSide: elements is empty: name at least one element of the body")
        if elements.min() < 0 or elements.max() >= n_elements or np.unique(elements).size < elements.size:
            raise GeometryError(
                f"ContactSide: elements {elements.tolist()[:8]} of a mesh of {n_elements}: "
                f"give different indices from 0 to {n_elements - 1}"
            )
        object.__setattr__(self, "elements", along_boundary(self.space.mesh, elements))

    @property
    def mesh(self) -> BoundaryMesh:
        """The mesh of the body."""
        return self.space.mesh

    @cached_property
    def dofs(self) -> IntArray:
        """(m, n_local) array: scalar dofs of the elements."""
        return self.space.element_dofs[self.elements]

    @cached_property
    def start(self) -> FloatArray:
        """(m, 2) array [m]: start points of the elements."""
        return self.mesh.start[self.elements]

    @cached_property
    def end(self) -> FloatArray:
        """(m, 2) array [m]: end points of the elements."""
        return self.mesh.end[self.elements]

    @cached_property
    def lengths(self) -> FloatArray:
        """(m,) array [m]: lengths of the elements."""
        return self.mesh.lengths[self.elements]

    @cached_property
    def is_straight(self) -> bool:
        """Whether all elements are straight."""
        return bool(self.mesh.is_straight[self.elements].all())

    @cached_property
    def sagittas(self) -> FloatArray:
        """(m,) array [m]: distances of the midpoints of the elements from those of their chords."""
        if self.is_straight:
            return np.zeros(self.elements.size)
        return norms(self.mesh.centres[self.elements] - 0.5 * (self.start + self.end))

    @cached_property
    def resolution(self) -> float:
        """Round-off of positions on the side [m]."""
        return _RESOLUTION * float(max(np.abs(self.start).max(), np.abs(self.end).max()))

    @cached_property
    def arc_length(self) -> FloatArray:
        """(m, n_local) array [m]: arc length of the nodes from the start of the side."""
        return arc_lengths(self.mesh, self.elements, self.space.local_nodes)

    @cached_property
    def knots(self) -> FloatArray:
        """(k,) array: local coordinates of the knots of directions: nodes of the space, or both ends."""
        return self.space.local_nodes if self.space.degree else np.array([-1.0, 1.0])

    @cached_property
    def knot_numbers(self) -> IntArray:
        """(m, k) array: indices of the knots along the side; neighbouring elements share knots."""
        if not self.space.degree:
            keys = self.mesh.elements[self.elements]
        else:
            keys = self.dofs
        _, first, number = np.unique(keys.ravel(), return_index=True, return_inverse=True)
        position = np.empty(first.size, np.intp)
        position[np.argsort(first)] = np.arange(first.size)
        return position[number].reshape(keys.shape)

    @cached_property
    def first_knots(self) -> tuple[IntArray, IntArray]:
        """Two (n_knots,) arrays: position of an element that has the knot, and local index of the knot there."""
        _, first = np.unique(self.knot_numbers.ravel(), return_index=True)
        element, local = np.divmod(first, self.knots.size)
        return element, local

    @cached_property
    def flat_normal(self) -> FloatArray | None:
        """(2,) array: outward unit normal if all elements and their images lie on one line, otherwise None.

        It has no round-off from the directions of short elements.
        """
        along = (self.end - self.start).sum(axis=0)
        size = float(norms(along))
        if not self.is_straight or size < self.lengths.max():
            return None
        normal = turned_right(along / size)
        if (np.abs(normal) > _RESOLUTION)[self._ends_on_lines.any(axis=(0, 1))].any():
            return None
        off_line = (np.concatenate([self.start, self.end]) - self.start[0]) @ normal
        is_flat = np.abs(off_line).max() <= self.resolution and np.all((self.end - self.start) @ along > 0.0)
        return normal if is_flat else None

    @cached_property
    def _ends_on_lines(self) -> BoolArray:
        """(m, 2, 2) array: whether start and end of each element lie on the symmetry lines along y and along x."""
        return self.mesh.on_symmetry_lines[self.mesh.elements[self.elements]]

    @cached_property
    def normals(self) -> FloatArray:
        """(n_knots, 2) array: outward unit normals; means of both elements at common knots."""
        if self.flat_normal is not None:
            return np.tile(self.flat_normal, (int(self.knot_numbers.max()) + 1, 1))
        at_knots = self.mesh.normals_at(self.elements, self.knots)
        total = np.zeros((int(self.knot_numbers.max()) + 1, 2))
        np.add.at(total, self.knot_numbers, at_knots)
        # at a symmetry line the mean includes the image of the element
        is_across = np.zeros(total.shape, bool)
        np.logical_or.at(is_across, self.knot_numbers[:, [0, -1]], self._ends_on_lines)
        total[is_across] = 0.0
        size = norms(total)
        # elements that fold back onto each other have no mean
        return (
            np.where(size[:, None] > 0.0, total, at_knots[self.first_knots]) / np.where(size > 0.0, size, 1.0)[:, None]
        )

    def smooth_normals(self, rows: IntArray, xi: FloatArray) -> FloatArray:
        """Return outward unit normals (r, 2) at xi (r,) on elements at the positions `rows` (r,).

        Normals of straight elements are interpolated between knots.
        """
        normals = self.directions(self.normals, rows, xi[:, None])[:, 0]
        if self.is_straight:
            return normals
        is_curved = ~self.mesh.is_straight[self.elements[rows]]
        normals[is_curved] = self.mesh.normals_at(self.elements[rows[is_curved]], xi[is_curved, None])[:, 0]
        return normals

    def points(self, rows: IntArray, xi: FloatArray) -> FloatArray:
        """Return points (r, q, 2) [m] at xi, (q,) or (r, q), on elements at the positions `rows` (r,)."""
        return self.mesh.points(self.elements[rows], xi)

    def directions(self, at_knots: FloatArray, rows: IntArray, xi: FloatArray) -> FloatArray:
        """Interpolate directions.

        Parameters
        ----------
        at_knots : (n_knots, 2) array
            Unit vectors.
        rows : (r,) int array
            Positions of elements in the side.
        xi : (r, q) array

        Returns
        -------
        (r, q, 2) array
            Unit vectors.
        """
        if (at_knots == at_knots[0]).all():
            return np.broadcast_to(at_knots[0], (*xi.shape, 2))
        if self.space.degree:
            basis = self.space.basis(xi.ravel())
        else:
            basis = 0.5 * np.stack([1.0 - xi.ravel(), 1.0 + xi.ravel()])
        values = at_knots[self.knot_numbers[rows]]
        vectors = np.matmul(basis.reshape(-1, *xi.shape).transpose(1, 2, 0), values)
        return np.asarray(vectors / norms(vectors)[..., None])


def encloses(mesh: BoundaryMesh, points: FloatArray) -> BoolArray:
    """Return a mask (k,) of points (k, 2) inside the body bounded by the chords of a mesh."""
    number = 0 if mesh.is_exterior else 1
    return np.asarray(winding_numbers(points, mesh.whole.start, mesh.whole.end) == number)


def faces_away(
    first: BoundaryMesh, second: BoundaryMesh, middle: FloatArray, distance: FloatArray, slack: FloatArray
) -> BoolArray:
    """Return a mask of points with a negative distance whose bodies do not overlap: the sides face away.

    Parameters
    ----------
    first, second : BoundaryMesh
    middle : (k, 2) array [m]
        Midpoints between points of the first side and their projections on the second side.
    distance : (k,) array [m]
        Distances from the first to the second side along the outward direction of the first body.
    slack : (k,) array [m]
        Largest depth of overlap that is not checked, because coordinates or chords do not resolve it.

    Returns
    -------
    (k,) bool array
        True where the distance is negative and the midpoint is not inside both bodies.
    """
    behind = np.flatnonzero(distance < -slack)
    result = np.zeros(len(middle), bool)
    if behind.size:
        result[behind] = ~(encloses(first, middle[behind]) & encloses(second, middle[behind]))
    return result
