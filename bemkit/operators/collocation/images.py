"""Boundary equations of a symmetric body: those of the whole body with each unknown joined to its images."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bemkit.arrays import ComplexArray, FloatArray, IntArray
from bemkit.geometry.mesh import BoundaryMesh
from bemkit.operators.collocation.equations import CollocationEquations, collocation_border
from bemkit.operators.hierarchy.equations import Border, BoundaryEquations
from bemkit.operators.material import Material


@dataclass(frozen=True, eq=False)
class FoldedEquations:
    """Equations of the half of a body, by symmetry those of the whole; see `BoundaryEquations`.

    Far from a cluster its unknowns are seen without their images: what these cause beyond a line is the image of what
    the unknowns cause, and lies as far from the cluster at least.

    Parameters
    ----------
    whole : BoundaryEquations
        Of the body and its images, the nodes of the half first, then those of each image in the same order.
    border : Border
        Of the half.
    images : (n_images, 2) array
        The signs of the components in each image, the body itself first.
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
        """Return entries (n_rows, n_columns): what the unknowns cause together with their images."""
        result = self.whole.block(rows, columns)
        for number, signs in enumerate(self.images[1:], 1):
            result = result + self.whole.block(rows, columns + 4 * number * self.n) * signs[columns % 2]
        return result

    def fields(self, x: ComplexArray, columns: IntArray) -> FloatArray:
        """Return displacements (2 n_points, n_columns) that columns cause without their images."""
        return self.whole.fields(x, columns)

    def under_forces(self, x: ComplexArray, rows: IntArray) -> FloatArray:
        """Return what rows feel of unit forces, (2 n_points, n_rows)."""
        return self.whole.under_forces(x, rows)

    def residual(self, nodes: IntArray, traction: FloatArray, displacement: FloatArray) -> FloatArray:
        """Return E (t, u) at some nodes, (n, 2)."""
        whole = ((self.images[:, None] * values).reshape(-1, 2) for values in (traction, displacement))
        return self.whole.residual(nodes, *whole)


def collocation_equations(
    mesh: BoundaryMesh, material: Material, order: IntArray, *, takes_slopes: bool
) -> BoundaryEquations:
    """Return the equations of collocation of a body, with or without lines of symmetry.

    Parameters
    ----------
    mesh : BoundaryMesh
    material : Material
    order : (n_elements,) array
        The element at each position of a tree.
    takes_slopes : bool
    """
    border = collocation_border(mesh, material, order, takes_slopes=takes_slopes)
    if mesh.symmetry is None:
        return CollocationEquations.of(mesh, material, order, border, takes_slopes=takes_slopes)
    images = mesh.symmetry.images
    with_images = (np.arange(len(images))[:, None] * mesh.n_elements + order).ravel()
    whole = CollocationEquations.of(
        mesh.whole, material, with_images, border, takes_slopes=takes_slopes, log_length=mesh.diameter
    )
    return FoldedEquations(whole, border, images)
