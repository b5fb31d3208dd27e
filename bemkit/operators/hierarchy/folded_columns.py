"""Columns of the boundary equations of a body that is symmetric about lines, of which one side is divided."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bemkit.arrays import ComplexArray, FloatArray, IntArray
from bemkit.geometry.mesh import BoundaryMesh
from bemkit.operators.hierarchy.boundary_columns import NOWHERE, BoundaryColumns
from bemkit.operators.hierarchy.sourced_columns import SourcedColumns
from bemkit.operators.material import Material


@dataclass(frozen=True, eq=False)
class FoldedColumns(BoundaryColumns):
    """Elements with their images: what is said by place says the same of the places of the images behind them.

    In the middle of an element an unknown and its images act together. Points of no element, by which clusters are
    seen from afar, see only the unknown: what its images cause beyond a line is the image of what it causes, and lies
    as far from the cluster at least.

    Parameters
    ----------
    images : (n_images, 2) array
        The signs of the components in each image, the body itself first.
    """

    images: FloatArray = None  # type: ignore[assignment]  # fields without a default cannot follow others

    @property
    def n_elements(self) -> int:
        """Number of elements, images not counted."""
        return self.order.size // len(self.images)

    @property
    def reach(self) -> IntArray:
        """(k, n_elements) places on which each element acts, images among them."""
        return super().reach[:, : self.n_elements]

    def fields(self, x: ComplexArray, places: IntArray, columns: IntArray) -> FloatArray:
        """Return what columns cause at points, (2 n_points, n_columns), in the middle of elements with their images."""
        result = super().fields(x, places, columns)
        is_middle = places != NOWHERE
        for number, signs in enumerate(self.images[1:], 1) if is_middle.any() else ():
            image = super().fields(x[is_middle], places[is_middle], columns + 4 * number * self.n_elements)
            result[np.repeat(is_middle, 2)] += image * signs[columns % 2]
        return result

    def applied(self, places: IntArray, traction: FloatArray, displacement: FloatArray) -> FloatArray:
        """Return (1/2 + T) u - U t, (n, 2), in the middle of some elements."""
        whole = ((self.images[:, None] * of).reshape(-1, 2) for of in (traction, displacement))
        return super().applied(places, *whole)


def boundary_columns(
    mesh: BoundaryMesh, material: Material, order: IntArray, *, takes_slopes: bool, holes: list[IntArray] | None = None
) -> BoundaryColumns:
    """Return the columns of a mesh; see `BoundaryColumns.of`.

    Parameters
    ----------
    mesh : BoundaryMesh
    material : Material
    order : (n_elements + n_holes,) array
        The element at each place, or the number of elements and that of a hole.
    takes_slopes : bool
    holes : list of arrays, optional
        The elements of each hole that has a place of its own; of a symmetric body none has.
    """
    if holes:
        inner = BoundaryColumns.of(mesh, material, order[order < mesh.n_elements], takes_slopes=takes_slopes)
        return SourcedColumns.around(inner, mesh, material, order, holes)
    if mesh.symmetry is None:
        return BoundaryColumns.of(mesh, material, order, takes_slopes=takes_slopes)
    images = mesh.symmetry.images
    with_images = (np.arange(len(images))[:, None] * mesh.n_elements + order).ravel()
    whole = BoundaryColumns.of(mesh.whole, material, with_images, takes_slopes=takes_slopes, log_length=mesh.diameter)
    return FoldedColumns(**vars(whole), images=images)
