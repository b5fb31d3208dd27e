"""The choice of the body that represents a half-plane in contact."""

from __future__ import annotations

from bemkit.arrays import FloatArray
from bemkit.contact.contact_nodes import ContactNodes
from bemkit.contact.half_plane.surface_body import SurfaceBody
from bemkit.operators.half_plane.elasticity import HalfPlaneElasticity
from bemkit.operators.half_plane.surface import SurfaceElasticity
from bemkit.operators.steklov_poincare.nodal_conditions import NodalConditions


def surface_body(
    elastic: SurfaceElasticity, conditions: NodalConditions, nodes: ContactNodes, force: FloatArray
) -> SurfaceBody:
    """Return the body of a half-plane for the contact problem; the parameters are those of `SurfaceBody`."""
    if isinstance(elastic, HalfPlaneElasticity):
        from bemkit.contact.half_plane.large_strip_body import LargeStripBody
        from bemkit.operators.half_plane.large import LargeHalfPlane

        if isinstance(elastic, LargeHalfPlane) and not conditions.is_fixed.any():
            return LargeStripBody(elastic, conditions, nodes, force)
        from bemkit.contact.half_plane.strip_body import StripBody

        return StripBody(elastic, conditions, nodes, force)
    from bemkit.contact.half_plane.periodic_body import PeriodicBody
    from bemkit.operators.half_plane.periodic import PeriodicElasticity

    assert isinstance(elastic, PeriodicElasticity)
    return PeriodicBody(elastic, conditions, nodes, force)
