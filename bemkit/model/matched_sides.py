"""Elements of equal lengths on curved sides of two bodies that fit each other."""

from __future__ import annotations

from collections.abc import Mapping

from bemkit.geometry.mesh import BoundaryMesh
from bemkit.geometry.meshing.discretise import Uniform
from bemkit.geometry.neighbours import common_centre
from bemkit.scene.body_scene import BodyScene
from bemkit.scene.contacts import ContactPair
from bemkit.scene.discretisation import Galerkin
from bemkit.scene.scene import Scene

ALIKE = 1.02
"""Largest ratio of the lengths of two sides that may fit, and of element lengths that match."""
LEAST_REST = 0.5
"""Least share of the elements for the rest of a boundary."""


def matching_densities(
    scene: Scene, bodies: Mapping[str, BodyScene], meshes: Mapping[str, BoundaryMesh]
) -> dict[str, dict[str, float]]:
    """Return how densely parts must be divided to match the shorter elements of curved sides that they fit.

    Parameters
    ----------
    scene : Scene
    bodies : mapping of str to BodyScene
        The placed bodies by name.
    meshes : mapping of str to BoundaryMesh
        Theirs, divided without such densities.

    Returns
    -------
    dict of str to dict of str to float
        By the name of the body and of the part: density relative to the rest of the boundary, for
        `bemkit.geometry.meshing.discretise.discretise`.

    Notes
    -----
    Displacements that are linear on curved elements lie inside the curve between the nodes, by a share of the squared
    length of an element, on both sides alike if they are divided alike. Otherwise a uniform pressure varies, and its
    mean is wrong. Constant elements have steps where those of the other side have none. Only bodies of constant or
    linear elements, with neither an accuracy nor grading nor density, are matched; the rest of the boundary keeps at
    least half of its elements. Without friction bodies with a clearance would turn nearly freely on alike meshes;
    bodies in contact by arcs about one point may turn freely, see `bemkit.contact.mortar.coupling`.
    """
    densities: dict[str, dict[str, float]] = {}
    for pair in scene.elastic_contacts:
        sides = [(name, part, meshes[name], meshes[name].part(part)) for name, part in pair.elastic_parts]
        if not all(elements.size and _is_matched(bodies[name]) for name, _, _, elements in sides):
            continue
        if any(mesh.is_straight[elements].any() for _, _, mesh, elements in sides):
            continue
        side_lengths = [float(mesh.lengths[elements].sum()) for _, _, mesh, elements in sides]
        if max(side_lengths) > ALIKE * min(side_lengths) or _turns_nearly_freely(scene, pair, bodies, meshes):
            continue
        counts = [elements.size for *_, elements in sides]
        coarse = int(counts[1] < counts[0])
        name, part, mesh, elements = sides[coarse]
        rest = mesh.n_elements - elements.size
        wanted = min(counts[1 - coarse], mesh.n_elements - int(LEAST_REST * rest + 0.5))
        if rest and wanted > ALIKE * elements.size:
            share = side_lengths[coarse] / float(mesh.lengths.sum())
            density = wanted / (mesh.n_elements - wanted) * (1.0 - share) / share
            of_parts = densities.setdefault(name, {})
            of_parts[part] = max(density, of_parts.get(part, 1.0))
    return densities


def _turns_nearly_freely(
    scene: Scene, pair: ContactPair, bodies: Mapping[str, BodyScene], meshes: Mapping[str, BoundaryMesh]
) -> bool:
    """Whether a body may turn, with neither friction nor arcs about one point."""
    if not scene.law_of(pair).is_frictionless or all(bodies[name].cannot_turn for name, _ in pair.elastic_parts):
        return False
    placements = {body.name: body.placement for body in scene.placed_bodies}
    placed = [(placements[name].mesh(meshes[name]), meshes[name].part(part)) for name, part in pair.elastic_parts]
    return common_centre(placed) is None


def _is_matched(body: BodyScene) -> bool:
    """Whether a body has constant or linear elements whose lengths are not given."""
    mesh, discretisation = body.mesh, body.discretisation
    is_low = not isinstance(discretisation, Galerkin) or discretisation.largest_degree == 1
    return is_low and mesh.elements is not None and not mesh.density and isinstance(mesh.grading, Uniform)
