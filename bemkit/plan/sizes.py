"""How large the problem of a scene is, exactly, before anything is computed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from bemkit.contact.condensation.nodes import contact_conditions, free_motions
from bemkit.contact.condensation.retained import find_tangents
from bemkit.geometry.mesh import BoundaryMesh
from bemkit.geometry.spaces import BoundarySpace
from bemkit.model.boundary_data import find_units, nodal_forces, supports_on
from bemkit.model.contact_data import find_contact
from bemkit.operators.linear.threads import n_threads
from bemkit.operators.rigid_modes import possible_motions
from bemkit.operators.steklov_poincare.nodal_conditions import GivenData, NodalConditions, supported
from bemkit.plan.decisions import Decisions, Formulation
from bemkit.scene.scene import Scene


@dataclass(frozen=True)
class Sizes:
    """Numbers of elements and unknowns.

    Parameters
    ----------
    n_elements, n_curved, n_loops : int
        Elements, those of them that are curved, and closed curves of the boundary.
    n_sources : int
        Elements of the whole body, images by symmetry included.
    n_threads : int
        Threads that assemble.
    n_displacements, n_tractions : int
        Components at all nodes of the two spaces.
    n_fixed, n_free, n_open : int
        Displacement components that supports prescribe, that carry a known force, and that contact decides.
    n_sweeps : int
        For collocation, load steps whose data are no multiple of those before; the first is one of them.
    n_loaded, n_moved : int
        Free components that carry a force, and fixed ones that move, summed over these steps.
    n_collocation_pairs : int
        Pairs of a midpoint and an element that collocation evaluates for these steps.
    n_contact, n_contact_unknowns : int
        Contact nodes, and the order of their system.
    n_motions, n_free_motions : int
        Rigid motions that cause no traction (3, or none on an exterior), and those of them that no support holds.
    n_pressures : int
        Uniform pressures that a Galerkin map holds exactly: of each loop if incompressible, else of all at once.
    n_volumes : int
        Pressures that keep the volume: one of an incompressible body.
    """

    n_elements: int
    n_curved: int
    n_loops: int
    n_sources: int
    n_threads: int
    n_displacements: int
    n_tractions: int
    n_fixed: int
    n_free: int
    n_open: int
    n_loaded: int
    n_moved: int
    n_sweeps: int
    n_collocation_pairs: int
    n_contact: int
    n_contact_unknowns: int
    n_motions: int
    n_free_motions: int
    n_pressures: int
    n_volumes: int


def find_sizes(steps: Sequence[Scene], mesh: BoundaryMesh, decisions: Decisions) -> Sizes:
    """Count the elements and unknowns of a scene on a mesh.

    Parameters
    ----------
    steps : sequence of Scene
        Load steps.
    mesh : BoundaryMesh
    decisions : Decisions

    Returns
    -------
    Sizes

    Raises
    ------
    ConflictingSupportsError
        If supports contradict each other at a node.
    """
    scene = steps[0]
    units = find_units(scene, mesh)
    space = decisions.displacement_space(mesh.unit)
    supports, candidates = supports_on(scene, mesh, units, space), find_contact(scene, mesh, space).nodes
    conditions, nodes = contact_conditions(space, supports, candidates)
    tangent_is_free = find_tangents(conditions, nodes)
    data = _data(steps, mesh, space, conditions) if decisions.formulation is Formulation.COLLOCATION else []
    holds_volume = scene.material.is_incompressible and not mesh.is_exterior
    return Sizes(
        n_elements=mesh.n_elements,
        n_curved=int(np.count_nonzero(~mesh.is_straight)),
        n_loops=len(mesh.loops),
        n_sources=mesh.whole.n_elements,
        n_threads=n_threads(mesh.n_elements * mesh.whole.n_elements),
        n_displacements=space.n_dofs,
        n_tractions=decisions.traction_space(mesh).n_dofs,
        n_fixed=int(np.count_nonzero(conditions.is_fixed)),
        n_free=int(np.count_nonzero(conditions.is_free)),
        n_open=int(np.count_nonzero(conditions.is_open)),
        n_loaded=sum(each.n_loaded for each in data),
        n_moved=sum(each.n_moved for each in data),
        n_sweeps=len(data),
        n_collocation_pairs=_n_pairs(data, mesh),
        n_contact=nodes.nodes.size,
        n_contact_unknowns=2 * nodes.nodes.size - int(np.count_nonzero(tangent_is_free)),
        n_motions=len(possible_motions(mesh)),
        n_free_motions=len(free_motions(conditions, nodes, space)),
        n_pressures=len(mesh.loops) if holds_volume else int(not mesh.is_exterior),
        n_volumes=int(holds_volume),
    )


def _data(
    steps: Sequence[Scene], mesh: BoundaryMesh, space: BoundarySpace, conditions: NodalConditions
) -> list[GivenData]:
    """Return the given data of the load steps that are no multiple of those before."""
    displacement = conditions.displacement
    found: list[GivenData] = []
    for step in steps:
        units = find_units(step, mesh)
        if found:
            displacement = supported(space, supports_on(step, mesh, units, space)).displacement
        data = GivenData.of(conditions, nodal_forces(step, mesh, space, units), displacement)
        if not found or data.factor_of(found[-1]) is None:
            found.append(data)
    return found


def _n_pairs(data: Sequence[GivenData], mesh: BoundaryMesh) -> int:
    """Count the pairs that collocation evaluates: all for the first data, later those of tractions if these suffice."""
    n_elements = mesh.n_elements if data else 0
    for later in data[1:]:
        n_loaded = int(np.count_nonzero(later.force.any(axis=1)))
        n_elements += mesh.n_elements if later.n_moved else n_loaded
    return n_elements * mesh.whole.n_elements
