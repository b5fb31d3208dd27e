"""The boundary equations of collocation, (1/2 + T) u = U t, over a tree."""

from __future__ import annotations

import numpy as np

from bemkit.arrays import BoolArray, FloatArray, IntArray
from bemkit.geometry.mesh import BoundaryMesh
from bemkit.operators.collocation.reciprocity import HoleSource, Reciprocity
from bemkit.operators.hierarchy.compression import Compression
from bemkit.operators.hierarchy.factor import Border
from bemkit.operators.hierarchy.folded_columns import boundary_columns
from bemkit.operators.hierarchy.system import HierarchicalSystem
from bemkit.operators.hierarchy.tree import ClusterTree
from bemkit.operators.material import Material
from bemkit.operators.rigid_modes import traction_free_modes

LEAF_SIZE = 88
"""Elements of a leaf: larger ones cost more to factor, smaller ones have skeletons nearly as large as themselves."""


def collocation_system(
    mesh: BoundaryMesh,
    material: Material,
    frame: FloatArray,
    *,
    may_be_traction: BoolArray,
    may_be_displacement: BoolArray,
    may_change: BoolArray,
    slopes: bool,
    tolerance: float,
) -> HierarchicalSystem:
    """Compress the equations.

    Parameters
    ----------
    mesh : BoundaryMesh
    material : Material
    frame : (n_elements, 2, 2) array
        Rows are the directions of the conditions of each element.
    may_be_traction, may_be_displacement : (n_elements,) bool arrays
        Elements whose traction, and whose displacement, may ever differ from zero.
    may_change : (n_elements,) bool array
        Elements whose conditions change by themselves; see `HierarchicalFactor`.
    slopes : bool
        Whether the double layer takes slopes.
    tolerance : float
        Of the compression; tractions and displacements err by a few times that.

    Notes
    -----
    The equations, the balances of the tractions and the reciprocities are those of
    `bemkit.operators.steklov_poincare.collocation.MixedSystem`.
    """
    n, holes = mesh.n_elements, _holes(mesh)
    at_holes = [[source.centre.real, source.centre.imag] for source in (HoleSource.of(mesh, each) for each in holes)]
    tree = ClusterTree.of(np.concatenate([mesh.centres, np.reshape(at_holes, (-1, 2))]), LEAF_SIZE)
    columns = boundary_columns(mesh, material, tree.order, takes_slopes=slopes, holes=holes)
    may_differ = np.repeat(np.stack([may_be_traction, may_be_displacement], axis=1), 2, axis=1)
    may_differ = np.concatenate([may_differ, np.tile([True, True, False, False], (len(holes), 1))])
    compression = Compression.of(columns, tree, may_differ[tree.order], tolerance)
    border = boundary_border(mesh, material, tree.order, slopes, has_holes=not holes)
    unit = mesh.diameter / n / material.plane_modulus
    return HierarchicalSystem(compression, border, frame, unit, may_change)


def _holes(mesh: BoundaryMesh) -> list[IntArray]:
    """Return the elements of each hole; none of a symmetric body, whose sources are several."""
    if mesh.symmetry is not None:
        return []
    return [loop for loop, area in zip(mesh.loops, mesh.loop_areas, strict=True) if area <= 0.0]


def boundary_border(
    mesh: BoundaryMesh, material: Material, order: IntArray, slopes: bool, *, has_holes: bool
) -> Border:
    """Return the errors and balances that the equations of collocation have besides, by place.

    Those of holes are among them unless these have places of their own.
    """
    n = mesh.n_elements
    motions = traction_free_modes(mesh, mesh.centres)
    reciprocity = Reciprocity.of(mesh, material, takes_slopes=slopes, has_holes=has_holes)
    compliance = 1.0 / (8.0 * np.pi * material.shear_modulus * (1.0 - material.effective_poisson_ratio))
    on_traction = np.concatenate([motions.T * (compliance * np.repeat(mesh.lengths, 2)), reciprocity.on_traction])
    on_displacement = np.concatenate([np.zeros(motions.T.shape), reciprocity.on_displacement])
    errors = np.column_stack([motions, reciprocity.fields])
    n_border = errors.shape[1]
    balances = np.concatenate([on_traction.reshape(n_border, n, 2), -on_displacement.reshape(n_border, n, 2)], axis=2)
    n_holes = order.size - n
    by_place = np.concatenate([errors.reshape(n, 2, n_border), np.zeros((n_holes, 2, n_border))])[order]
    balances = np.concatenate([balances, np.zeros((n_border, n_holes, 4))], axis=1)[:, order]
    return Border(
        by_place.reshape(2 * order.size, n_border),
        balances.reshape(n_border, 4 * order.size),
        np.zeros((n_border, n_border)),
    )
