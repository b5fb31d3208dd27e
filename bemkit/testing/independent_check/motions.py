"""Rigid motions of a body, and which of them its supports leave free."""

from __future__ import annotations

import numpy as np

from bemkit.arrays import FloatArray
from bemkit.results.solved_body import SolvedBody
from bemkit.testing.independent_check.boundary import Boundary


def motions_at(body: SolvedBody, points: FloatArray) -> FloatArray:
    """Return the two translations and the rotation at points (..., 2), (..., 2, 3), lengths by the diameter."""
    mesh = body.mesh
    x, y = np.moveaxis((points - mesh.centre) / mesh.diameter, -1, 0)
    zero, one = np.zeros_like(x), np.ones_like(x)
    return np.stack([np.stack([one, zero, -y], axis=-1), np.stack([zero, one, x], axis=-1)], axis=-2)


def admissible_modes_of(body: SolvedBody) -> list[int]:
    """Return which of the two translations and the rotation the symmetry allows; an exterior is at rest far away."""
    mesh = body.mesh
    if mesh.is_exterior:
        return []
    if mesh.symmetry is None:
        return [0, 1, 2]
    return [k for k, place in enumerate((mesh.symmetry.x, mesh.symmetry.y)) if place is None]


def strained_displacement(body: SolvedBody, displacement: FloatArray | None = None) -> FloatArray:
    """Return nodal displacements (n_nodes, 2) [m], those of the solution unless given, without their rigid part."""
    fields = body.boundary
    displacement = fields.displacement if displacement is None else displacement
    motions = motions_at(body, fields.points)[:, :, admissible_modes_of(body)].reshape(2 * len(fields.points), -1)
    rigid = np.linalg.lstsq(motions, displacement.ravel(), rcond=None)[0]
    return np.asarray(displacement - (motions @ rigid).reshape(-1, 2))


def free_motions(body: SolvedBody, boundary: Boundary) -> FloatArray:
    """Return (n_free, 3) coefficients of the rigid motions that no support resists."""
    admissible = admissible_modes_of(body)
    rows = [np.eye(3)[[mode for mode in range(3) if mode not in admissible]], np.zeros((1, 3))]
    for elements, directions, _ in boundary.held:
        motions = motions_at(body, boundary.node_points[elements])
        rows.append(np.einsum("enc,encm->enm", directions, motions).reshape(-1, 3))
    held = np.concatenate(rows)
    _, singular, directions = np.linalg.svd(held.T @ held)
    return np.asarray(directions[singular <= 1e-12 * max(singular.max(), 1e-30)])


def translations_among(motions: FloatArray) -> FloatArray:
    """Return (k, 3) coefficients of the translations among rigid motions (n, 3)."""
    if not len(motions):
        return motions
    _, sizes, combinations = np.linalg.svd(motions[:, 2:].T, full_matrices=True)
    rank = int(np.count_nonzero(sizes > 1e-9))
    return np.asarray(combinations[rank:] @ motions)
