"""The largest equivalent stress of a body, on its boundary and inside."""

from __future__ import annotations

import numpy as np

from bemkit.results.interior import interior_fields
from bemkit.results.side_stress import LargestStress
from bemkit.results.solved_body import SolvedBody
from bemkit.results.stress_measures import STRESSES
from bemkit.results.stress_mesh import stress_mesh

_ACROSS = 48
"""Sample points along the longer side of the body in the search for the largest stress inside."""
_STEPS = 16
"""Number of times that the spacing of the nine points around the best one is halved."""


def largest_equivalent_stress(body: SolvedBody) -> LargestStress:
    """Return the largest equivalent stress of von Mises of a body, inside or on the boundary."""
    mesh, material, fields = body.mesh.whole, body.scene.material, interior_fields(body)
    on_boundary = body.largest_stress()
    low, high = mesh.nodes.min(axis=0), mesh.nodes.max(axis=0)
    size = float((high - low).max())
    filled = stress_mesh(body, size / _ACROSS, np.stack([low - 0.5 * size, high + 0.5 * size], axis=1))
    values = STRESSES["von-mises"].of(filled.stress, material)
    best = filled.points[[np.argmax(values)]]
    if not fields.is_inside(best)[0]:
        return on_boundary
    # stay clear of the boundary, where constant and linear elements have peaks of their own
    distance = float(np.hypot(*(mesh.centres - best).T).min())
    step = 0.25 * min(distance, size / _ACROSS)
    around = np.stack(np.meshgrid([-1.0, 0.0, 1.0], [-1.0, 0.0, 1.0]), axis=2).reshape(-1, 2)
    largest = float(values.max())
    for _ in range(_STEPS):
        points = best + step * around
        sampled = STRESSES["von-mises"].of(fields.stress(points), material)
        best, largest = points[[np.argmax(sampled)]], float(sampled.max())
        step *= 0.5
    x, y = best[0].tolist()
    return max(on_boundary, LargestStress(largest, x, y), key=lambda each: each.value)
