"""The only body of a scene, between fixed obstacles or without contact nodes, as the body of the contact problem."""

from __future__ import annotations

from typing import TYPE_CHECKING, TypeAlias

from bemkit.contact.contact_nodes import ContactNodes, NoContactNodesError, opened
from bemkit.contact.direct_body import DirectBody, WholeBody
from bemkit.errors import InputError
from bemkit.model.given import without_body_forces
from bemkit.model.prepared import Prepared
from bemkit.operators.steklov_poincare import CondensedMap, SteklovPoincare

if TYPE_CHECKING:
    from bemkit.arrays import FloatArray
    from bemkit.contact.half_plane.surface_body import SurfaceBody
    from bemkit.contact.hierarchical_body import HierarchicalBody
    from bemkit.model.contact_free_body import ContactFreeBody
    from bemkit.operators.steklov_poincare.nodal_conditions import NodalConditions

SingleBody: TypeAlias = "DirectBody | HierarchicalBody | SurfaceBody | ContactFreeBody"


def is_single(prepared: Prepared) -> bool:
    """Whether the relative displacements of contact nodes are those of one body, which touches obstacles at most.

    Raises
    ------
    NoContactNodesError
        If supports leave no node of the contact boundary free to move towards the obstacle.
    InputError
        If no two of several bodies are in contact.
    """
    if not prepared.n_contact:
        _check_without_nodes(prepared)
    return prepared.scene.has_obstacles_only


def _check_without_nodes(prepared: Prepared) -> None:
    if prepared.scene.contacts or any(body.scene.contact_parts for body in prepared.bodies):
        raise NoContactNodesError
    if len(prepared.bodies) > 1:
        raise InputError("no two bodies are in contact: list contacts, or solve each body as a scene of its own")


def is_direct(prepared: Prepared) -> bool:
    """Whether the contact problem uses the condensed stiffness of the only body."""
    if not prepared.n_contact or prepared.only.mesh.surface is not None:
        return False
    return prepared.is_condensed or prepared.linear_solver(prepared.only).hierarchical is None


def single_body(prepared: Prepared, elastic: SteklovPoincare, condensed: CondensedMap | None = None) -> SingleBody:
    """Return the only body as the body of the contact problem, with its equations in the frames of contact.

    Parameters
    ----------
    prepared : Prepared
    elastic : SteklovPoincare
    condensed : CondensedMap, optional
        The map condensed under the conditions and forces of the body, if that is known and `is_direct`.

    Raises
    ------
    FreeBodyError
        If nothing is in contact and the supports leave a rigid motion free.
    """
    body = prepared.only
    if not prepared.n_contact:
        from bemkit.model.free_motion import check_held

        check_held(prepared)
    nodes = prepared.contact_nodes
    conditions = opened(body.conditions, nodes) if condensed is None else body.conditions
    if body.mesh.surface is not None:
        return _half_plane(elastic, conditions, nodes, body.force)
    if not prepared.n_contact or is_direct(prepared):
        condensed = elastic.condense(conditions, body.force) if condensed is None else condensed
        whole = WholeBody.of(body.own_space, condensed, conditions, body.force, body.free_modes)
        if prepared.n_contact:
            return DirectBody.of(whole, nodes, elastic.material)
        from bemkit.model.contact_free_body import ContactFreeBody

        return ContactFreeBody(whole)
    from bemkit.contact.hierarchical_body import hierarchical_body
    from bemkit.operators.steklov_poincare.hierarchical import HierarchicalCollocation

    compressed = without_body_forces(elastic, body.inside)
    assert isinstance(compressed, HierarchicalCollocation)
    return hierarchical_body(compressed, conditions, nodes, body.force, body.inside)


def _half_plane(
    elastic: SteklovPoincare, conditions: NodalConditions, nodes: ContactNodes, force: FloatArray
) -> SurfaceBody:
    from bemkit.operators.half_plane.elasticity import HalfPlaneElasticity, LargeHalfPlane

    if isinstance(elastic, HalfPlaneElasticity):
        if isinstance(elastic, LargeHalfPlane) and not conditions.is_fixed.any():
            from bemkit.contact.half_plane.large_strip_body import LargeStripBody

            return LargeStripBody(elastic, conditions, nodes, force)
        from bemkit.contact.half_plane.strip_body import StripBody

        return StripBody(elastic, conditions, nodes, force)
    from bemkit.contact.half_plane.periodic_body import PeriodicBody
    from bemkit.operators.half_plane.periodic import PeriodicElasticity

    assert isinstance(elastic, PeriodicElasticity)
    return PeriodicBody(elastic, conditions, nodes, force)
