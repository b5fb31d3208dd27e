"""Errors of the distances from rigid obstacles after the body has moved."""

from __future__ import annotations

import numpy as np

from bemkit.arrays import IntArray
from bemkit.contact.obstacle import Obstacle
from bemkit.geometry.neighbours import along_boundary
from bemkit.geometry.vectors import norms
from bemkit.model.finite_sliding import is_in_the_plane
from bemkit.results.points_between import Interpolation, points_between, sample_at_obstacle
from bemkit.results.solved_body import SolvedBody

_PRESSED = 0.01
"""Least pressure that counts, relative to the largest."""


def distances_off(body: SolvedBody) -> dict[str, tuple[float, float]]:
    """Return the differences between distances from obstacles after the displacement and the solved clearances.

    Clearances are linear in the displacement, along the normal of the obstacle at its point nearest to the undeformed
    body. This is wrong for a body that slides far along a curved obstacle, or turns.

    Returns
    -------
    dict of str to (float, float) [m]
        By contact part, of obstacles in the plane: the largest difference where the part is pressed, and the
        displacement that its contact force causes, force / E'. Parts without contact force are excluded.
    """
    found = {}
    for part, obstacle in body.scene.obstacles.items():
        if is_in_the_plane(obstacle):
            elements = along_boundary(body.mesh, body.mesh.part(part))
            force = float(body.mesh.lengths[elements] @ norms(body.boundary.traction[elements]))
            if force > 0.0:
                off = _distance_off(body, obstacle, elements)
                found[part] = off, force / body.scene.material.plane_modulus
    return found


def _distance_off(body: SolvedBody, obstacle: Obstacle, elements: IntArray) -> float:
    n = elements.size
    values = sample_at_obstacle(body, obstacle, elements)(np.arange(n), np.full(n, -1.0), np.ones(n))
    is_pressed = -values.sigma_n > _PRESSED * float(np.maximum(-values.sigma_n, 0.0).max(initial=0.0))
    is_pressed &= np.isfinite(values.clearance)  # round-off where a part does not face its obstacle
    xi = points_between(body.scene.discretisation.displacement_space(body.mesh).degree)
    at = np.broadcast_to(xi, (elements.size, xi.size))
    moved = values.points + Interpolation.at(body, elements, at).displacement(body).reshape(-1, 2)
    distance = obstacle.gap(moved[is_pressed], -values.directions[is_pressed])
    return float(np.abs(distance - values.clearance[is_pressed]).max(initial=0.0))
