"""Choice of the elastic map of a half-plane."""

from __future__ import annotations

from bemkit.geometry.mesh import BoundaryMesh
from bemkit.operators.half_plane.elasticity import HalfPlaneElasticity
from bemkit.operators.half_plane.large import LargeHalfPlane
from bemkit.operators.half_plane.periodic import PeriodicElasticity
from bemkit.operators.material import Material

LARGEST_DENSE = 1500
"""Elements up to which the flexibility of a strip is kept as a matrix."""


def half_plane_map(mesh: BoundaryMesh, material: Material) -> HalfPlaneElasticity | PeriodicElasticity:
    """Return the map of the half-plane whose surface the mesh is."""
    if mesh.surface is not None and mesh.surface.is_periodic:
        return PeriodicElasticity(mesh, material)
    return (HalfPlaneElasticity if mesh.n_elements <= LARGEST_DENSE else LargeHalfPlane)(mesh, material)
