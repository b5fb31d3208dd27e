"""What stresses and lengths of a solution are measured by."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from bemkit.results.solution import Solution

CONTACT_LIMIT = 1e-6
"""Largest violation of contact, friction, supports and equilibrium in a right answer. Drivers stop at 1e-9 of a
traction that may be hundreds of times that of the answer (that of the body held everywhere)."""

EPSILON = float(np.finfo(float).eps)


class Scales(NamedTuple):
    """Sizes that violations are divided by.

    Parameters
    ----------
    stress : float [Pa]
        Largest traction on the boundary, but no less than its round-off is worth, see `trusted_stress`.
    length : float [m]
        Displacement that this traction causes across the body, ``stress * diameter / E'``. What is left of rigid
        motions a million times longer is round-off. If there are no tractions at all, as in a body that has given way
        to an overlap, its displacement is the only length there is.
    coordinates : float [m]
        Round-off of lengths that are differences of coordinates.
    turned : float [m]
        Round-off of displacement components: the largest displacement times the error of normals of curved elements,
        which are differentiated from coordinates.
    """

    stress: float
    length: float
    coordinates: float
    turned: float


def scales_of(solution: Solution, before: Solution | None = None) -> Scales:
    """Return the sizes that the violations in a solution are measured by.

    What is left of the load step `before` is known no better than its own tractions were.
    """
    modulus, diameter = solution.scene.material.plane_modulus, solution.mesh.diameter
    displacement = float(np.abs(solution.boundary.displacement).max())
    table = solution.contact
    fields = (solution.boundary.traction, table.sigma_n, table.sigma_t)
    largest = max(float(np.abs(each).max(initial=0.0)) for each in fields)
    trusted = max(trusted_stress(each) for each in (solution, before) if each is not None)
    stress = max(largest, trusted)
    length = max(stress / modulus * diameter, 1e-6 * displacement)
    if largest <= CONTACT_LIMIT * trusted:  # the body has only moved: a hundredth of that, to be strict
        length = max(length, 1e-2 * displacement)
    gaps = np.abs(table.gap[np.isfinite(table.gap)]).max(initial=0.0)
    coordinates = 64.0 * EPSILON * (float(np.abs(solution.mesh.nodes).max()) + float(gaps))
    curved = solution.mesh.lengths[~solution.mesh.is_straight]
    # derivatives of 14 points amplify their errors by up to 14^2 at the ends of an element
    error = 200.0 * EPSILON * float(np.abs(solution.mesh.nodes).max()) / float(curved.min()) if curved.size else 0.0
    return Scales(stress or 1.0, length or 1.0, coordinates, (error + 1e-12) * displacement)


def trusted_stress(solution: Solution) -> float:
    """Return the stress [Pa] whose `CONTACT_LIMIT`-th part is the round-off of tractions: the least to measure by.

    Numbers hold a displacement to some eps of its size. Across a node of length h that is the strain ``eps |u| / h``,
    times E' a stress, which a bulk modulus beyond E' multiplies. A body that only moves, say because an overlap has
    pushed it aside, has no tractions but these. Tiny elements and nearly incompressible bodies are no excuse for
    tractions beyond 1e-10 of those by which the displacement would strain the whole body.
    """
    material, diameter = solution.scene.material, solution.mesh.diameter
    freedom = 1.0 if material.is_incompressible else 1.0 - 2.0 * material.effective_poisson_ratio
    lengths = solution.contact.weight if solution.contact.n_contact else solution.mesh.lengths
    digits = 64.0 * EPSILON * diameter / (float(lengths.min()) * freedom)
    strain = float(np.abs(solution.boundary.displacement).max()) / diameter
    return min(digits / CONTACT_LIMIT, 1e-4) * strain * material.plane_modulus
