"""Boundary equations of a symmetric body on one half, folded from those of the whole body."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bemkit.arrays import ComplexArray, FloatArray, IntArray
from bemkit.geometry.mesh import BoundaryMesh
from bemkit.operators.boundary_equations import Border, BoundaryEquations
from bemkit.operators.collocation.equations import CollocationEquations, collocation_border
from bemkit.operators.collocation.layers import Layer
from bemkit.operators.material import Material


@dataclass(frozen=True, eq=False)
class FoldedEquations:
    """Equations of one half of a symmetric body; see `BoundaryEquations`.

    Far fields of a cluster omit its images: the field of an image is the image of the field, and is at least as far
    from the cluster.

    Parameters
    ----------
    whole : BoundaryEquations
        Equations of the whole body: the nodes of the half first, then those of each image in the same order.
    border : Border
        Border of the half.
    images : (n_images, 2) array
        Signs of the components in each image; the first image is the body itself.
    """

    whole: BoundaryEquations
    border: Border
    images: FloatArray

    @property
    def n(self) -> int:
        """Number of nodes of the half."""
        return self.whole.points.size // len(self.images)

    @property
    def points(self) -> ComplexArray:
        """(n,) array [m]."""
        return self.whole.points[: self.n]

    @property
    def supports(self) -> ComplexArray:
        """(m, n) array [m]."""
        return self.whole.supports[:, : self.n]

    @property
    def lengths(self) -> FloatArray:
        """(n,) array [m]."""
        return self.whole.lengths[: self.n]

    def block(self, rows: IntArray, columns: IntArray) -> FloatArray:
        """Return entries (n_rows, n_columns) of unknowns together with their images."""
        result = self.whole.block(rows, columns)
        for image, signs in enumerate(self.images[1:], 1):
            result = result + self.whole.block(rows, columns + 4 * image * self.n) * signs[columns % 2]
        return result

    def fields(self, x: ComplexArray, columns: IntArray) -> FloatArray:
        """Return the displacements (2 n_points, n_columns) of columns without their images."""
        return self.whole.fields(x, columns)

    def under_forces(self, x: ComplexArray, rows: IntArray) -> FloatArray:
        """Return the displacements (2 n_points, n_rows) at rows under unit forces."""
        return self.whole.under_forces(x, rows)

    def residual(self, nodes: IntArray, traction: FloatArray, displacement: FloatArray) -> FloatArray:
        """Return E (t, u) at some nodes, (n, 2)."""
        whole = ((self.images[:, None] * values).reshape(-1, 2) for values in (traction, displacement))
        return self.whole.residual(nodes, *whole)


def displacement_rows(equations: BoundaryEquations, nodes: IntArray, value_of_one: float) -> FloatArray:
    """Return all displacement columns (2 n_rows, 2 n) at some nodes, with exact values for translations.

    The midpoint of an element of length h has a relative round-off of eps / h, which the tractions there divide by h
    again. So the diagonal block of a node is chosen such that a translation has its exact value.

    Parameters
    ----------
    equations : BoundaryEquations
    nodes : (n_rows,) array
        Ascending.
    value_of_one : float
        Value of a unit translation: 0 for a body, 1 for an exterior.
    """
    n, rows = equations.points.size, (2 * nodes[:, None] + np.arange(2)).ravel()
    columns = (4 * np.arange(n)[:, None] + np.array([2, 3])).ravel()
    # transposed, as blocks are stored: (2 n, 2 n_rows)
    if isinstance(equations, FoldedEquations):
        parts = [equations.whole.block(rows, columns + 4 * k * n).T for k in range(len(equations.images))]
        by_column = np.sum(
            [part * signs[columns % 2, None] for part, signs in zip(parts, equations.images, strict=True)], axis=0
        )
    else:
        parts = [equations.block(rows, columns).T]
        by_column = parts[0]
    sums = np.sum([part.reshape(n, 2, -1).sum(axis=0) for part in parts], axis=0).reshape(2, -1, 2)
    blocks = by_column.reshape(n, 2, nodes.size, 2)
    blocks[nodes, :, np.arange(nodes.size)] += value_of_one * np.eye(2) - sums.transpose(1, 0, 2)
    return np.asarray(by_column.T)


def collocation_equations(
    mesh: BoundaryMesh, material: Material, order: IntArray, *, takes_slopes: bool, layer: Layer | None = None
) -> BoundaryEquations:
    """Return the equations of collocation of a body, with or without lines of symmetry.

    Parameters
    ----------
    mesh : BoundaryMesh
    material : Material
    order : (n_elements,) array
        The element at each position of a tree.
    takes_slopes : bool
    layer : Layer, optional
        Evaluates the layers of straight elements; by default the compiled layer if there are many elements.
    """
    border = collocation_border(mesh, material, order, takes_slopes=takes_slopes)
    if mesh.symmetry is None:
        return CollocationEquations.of(mesh, material, order, border, takes_slopes=takes_slopes, layer=layer)
    images = mesh.symmetry.images
    with_images = (np.arange(len(images))[:, None] * mesh.n_elements + order).ravel()
    whole = CollocationEquations.of(
        mesh.whole, material, with_images, border, takes_slopes=takes_slopes, layer=layer, log_length=mesh.diameter
    )
    return FoldedEquations(whole, border, images)
