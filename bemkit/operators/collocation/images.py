"""Boundary equations of a symmetric body on one half, folded from those of the whole body."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bemkit.arrays import ComplexArray, FloatArray, IntArray
from bemkit.operators.boundary_equations import Border, BoundaryEquations


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
        images = zip(self.image_blocks(rows, columns), self.images, strict=True)
        return np.asarray(sum(block * signs[columns % 2] for block, signs in images))

    def image_blocks(self, rows: IntArray, columns: IntArray) -> list[FloatArray]:
        """Return entries (n_rows, n_columns) of the unknowns of each image, before its signs are applied."""
        return [self.whole.block(rows, columns + 4 * image * self.n) for image in range(len(self.images))]

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
