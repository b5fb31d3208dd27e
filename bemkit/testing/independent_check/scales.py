"""Sizes that violations are measured by, and what counts as round-off."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bemkit.arrays import FloatArray
from bemkit.results.contact_table import ContactTable
from bemkit.results.solved_body import SolvedBody
from bemkit.scene.conditions import DistributedLoad
from bemkit.testing.independent_check.motions import strained_displacement

CONTACT_LIMIT = 1e-6
"""Largest violation of contact, friction, supports and equilibrium in a right answer. Solvers stop at 1e-9 of a
traction that may be hundreds of times that of the answer (that of the body held everywhere)."""
EPSILON = float(np.finfo(float).eps)


@dataclass(frozen=True)
class Scales:
    """Sizes that violations in a body are divided by.

    Parameters
    ----------
    stress : float [Pa]
        Largest traction on the boundary, but no less than `trusted`.
    length : float [m]
        Displacement that this traction causes across the body, ``stress * diameter / E'``. Smaller remainders of rigid
        motions that are a million times longer are round-off. If there are no tractions at all, as in a body that has
        given way to an overlap, its displacement is the only length there is.
    coordinates : float [m]
        Round-off of lengths that are differences of coordinates.
    turned : float [m]
        Round-off of displacement components: the largest displacement times the error of normals, which are
        differentiated from coordinates.
    slipped : float [m]
        The same of the difference from the load step before.
    trusted : float [Pa]
        Least scale of stresses: its `CONTACT_LIMIT`-th part is the round-off of tractions; see `_trusted_stress`.
    strained : float [Pa]
        The larger of `stress` and that of the strains: heat strains a free body without tractions.
    """

    stress: float
    length: float
    coordinates: float
    turned: float
    slipped: float
    trusted: float
    strained: float


def scales_of(body: SolvedBody, before: SolvedBody | None, at_obstacles: ContactTable) -> Scales:
    """Return the scales of the violations in a body.

    Parameters
    ----------
    body, before : SolvedBody
        What is left of the load step before is known no better than its own tractions were.
    at_obstacles : ContactTable
        Its nodes that face rigid obstacles.
    """
    # round-off of coordinates and gaps
    modulus, diameter, farthest = body.scene.material.plane_modulus, body.mesh.diameter, np.abs(body.mesh.nodes).max()
    displacement = float(np.abs(body.boundary.displacement).max())
    earlier = 0.0 if before is None else float(np.abs(before.boundary.displacement).max())
    gaps = np.abs(at_obstacles.gap[np.isfinite(at_obstacles.gap)]).max(initial=0.0)
    coordinates = 64.0 * EPSILON * (float(farthest) + float(gaps))
    # the largest traction, if it is more than round-off, and the displacement that it causes
    fields = (body.boundary.traction, at_obstacles.sigma_n, at_obstacles.sigma_t)
    largest_traction = max(largest(np.abs(each)) for each in fields)
    trusted = _trusted_stress(body, max(displacement, earlier), at_obstacles.weight)
    # tractions that loads leave which cancel on each element, or coordinates of bodies that lie far away
    shortest = float(body.mesh.lengths.min())
    away = max(float(farthest) - 2.0 * diameter, 0.0) / shortest
    round_off = EPSILON * max(64.0 * _largest_load(body), away * modulus)
    if largest_traction <= round_off:
        trusted = max(trusted, round_off / CONTACT_LIMIT)
    stress = max(largest_traction, trusted)
    length = max(stress / modulus * diameter, 1e-6 * displacement)
    # forces inside strain a body, too, that an overlap has pushed aside and that touches nothing any more
    deciding = fields[1:] if body.scene.body_forces and at_obstacles.n_contact else fields
    if max(largest(np.abs(each)) for each in deciding) <= CONTACT_LIMIT * trusted:
        # the body has only moved: a hundredth of that, to be strict; back at rest, round-off of gaps is all there is
        length = max(length, 1e-2 * displacement, coordinates / CONTACT_LIMIT)
    curved = body.mesh.lengths[~body.mesh.is_straight]
    # derivatives of 14 points amplify their errors by up to 14^2 at the ends of an element
    error = 1e-12 + (200.0 * EPSILON * float(farthest) / float(curved.min()) if curved.size else 0.0)
    # ends of straight ones are differences of coordinates far away
    error += 4.0 * EPSILON * float(farthest) / shortest
    strained = float(np.abs(strained_displacement(body)).max()) / diameter * modulus
    return Scales(
        stress=stress or 1.0,
        length=length or 1.0,
        coordinates=coordinates,
        turned=error * displacement,
        slipped=0.0 if before is None else error * (displacement + earlier),
        trusted=trusted,
        strained=max(stress, strained),
    )


def _trusted_stress(body: SolvedBody, displacement: float, weights: FloatArray) -> float:
    """Return the least scale of stresses [Pa] of a body, for its largest displacement [m].

    A displacement has a round-off of some eps of its size: across a node of length h the strain ``eps |u| / h``, times
    E' a stress, which a bulk modulus beyond E' magnifies. A body in rigid motion, such as one pushed aside by an
    overlap, has no other tractions. The allowance ends at 1e-10 of the tractions by which the displacement would strain
    the whole body, also for tiny elements and nearly incompressible bodies.
    """
    material, diameter = body.scene.material, body.mesh.diameter
    freedom = 1.0 if material.is_incompressible else min(1.0, 1.0 - 2.0 * material.effective_poisson_ratio)
    shortest = float((weights if weights.size else body.mesh.lengths).min())
    digits = 64.0 * EPSILON * diameter / (shortest * freedom)
    return min(digits / CONTACT_LIMIT, 1e-4) * displacement / diameter * material.plane_modulus


def _largest_load(body: SolvedBody) -> float:
    """Return the largest given load [Pa] of a body at the ends and middles of its elements, which may cancel."""
    mesh, xi, sizes = body.mesh, np.array([-1.0, 0.0, 1.0]), [0.0]
    for part, elements in body.scene.parts_on(mesh):
        if isinstance(part.condition, DistributedLoad) and elements.size:
            points, normals = (at(elements, xi).reshape(-1, 2) for at in (mesh.points, mesh.normals_at))
            sizes.append(float(np.abs(part.condition.at(points, normals)).max()))
    return max(sizes)


def largest(values: FloatArray) -> float:
    """Return the largest value, at least zero; nan if there is one."""
    return float(np.max(np.maximum(values, 0.0), initial=0.0))


def beyond(differences: FloatArray, allowed: float, unit: float) -> float:
    """Return the largest difference beyond what is allowed, in units; nan if there is one."""
    return max(largest(differences) - allowed, 0.0) / unit if not np.isnan(differences).any() else float("nan")
