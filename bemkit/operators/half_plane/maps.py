"""Choice of the elastic map of a half-plane."""

from __future__ import annotations

from bemkit.geometry.mesh import BoundaryMesh
from bemkit.operators.half_plane.elasticity import HalfPlaneElasticity
from bemkit.operators.half_plane.large import LargeHalfPlane
from bemkit.operators.half_plane.periodic import PeriodicElasticity
from bemkit.operators.material import Material

LARGEST_DENSE = 1500
"""Largest number of elements of a half-plane whose flexibility is stored as a matrix."""


def half_plane_map(mesh: BoundaryMesh, material: Material) -> HalfPlaneElasticity | PeriodicElasticity:
    """Return the map of a half-plane with a meshed surface."""
    if mesh.surface is not None and mesh.surface.is_periodic:
        return PeriodicElasticity(mesh, material)
    return (HalfPlaneElasticity if mesh.n_elements <= LARGEST_DENSE else LargeHalfPlane)(mesh, material)
