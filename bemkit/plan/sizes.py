"""How large the problem of a scene is, exactly, before anything is computed."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bemkit.contact.condensation.retained import find_tangents
from bemkit.model.prepared import Prepared
from bemkit.operators.rigid_modes import possible_motions


@dataclass(frozen=True)
class Sizes:
    """Numbers of elements and unknowns.

    Parameters
    ----------
    n_elements, n_curved, n_loops : int
        Elements, those of them that are curved, and closed curves of the boundary.
    n_sources : int
        Elements of the whole body, images by symmetry included.
    displacement_degree, traction_degree : int
        Of the polynomials on each element.
    n_displacements, n_tractions : int
        Components at all nodes of the two spaces.
    n_fixed, n_free, n_open : int
        Displacement components that supports prescribe, that carry a known force, and that contact decides.
    n_contact, n_contact_unknowns : int
        Contact nodes, and the order of their system.
    n_motions, n_free_motions : int
        Rigid motions that cause no traction (3, or none on an exterior), and those of them that no support holds.
    """

    n_elements: int
    n_curved: int
    n_loops: int
    n_sources: int
    displacement_degree: int
    traction_degree: int
    n_displacements: int
    n_tractions: int
    n_fixed: int
    n_free: int
    n_open: int
    n_contact: int
    n_contact_unknowns: int
    n_motions: int
    n_free_motions: int


def find_sizes(prepared: Prepared) -> Sizes:
    """Count the elements and unknowns of a prepared scene."""
    mesh, conditions, nodes = prepared.mesh, prepared.conditions, prepared.contact.nodes
    n_contact, tractions = nodes.nodes.size, prepared.scene.discretisation.traction_space(mesh)
    return Sizes(
        n_elements=mesh.n_elements,
        n_curved=int(np.count_nonzero(~mesh.is_straight)),
        n_loops=len(mesh.loops),
        n_sources=mesh.whole.n_elements,
        displacement_degree=prepared.space.degree,
        traction_degree=tractions.degree,
        n_displacements=prepared.space.n_dofs,
        n_tractions=tractions.n_dofs,
        n_fixed=int(np.count_nonzero(conditions.is_fixed)),
        n_free=int(np.count_nonzero(conditions.is_free)),
        n_open=int(np.count_nonzero(conditions.is_open)),
        n_contact=n_contact,
        n_contact_unknowns=2 * n_contact - int(np.count_nonzero(find_tangents(conditions, nodes))),
        n_motions=len(possible_motions(mesh)),
        n_free_motions=len(prepared.free_motions),
    )
