"""Body forces: their resultants by integrals over the boundary, and their share of the fields.

The area of the body and its first moments are boundary integrals by Gauss's theorem. Symmetry lines, on which no
elements lie, add nothing: coordinates are taken from the centre, which lies on them.
"""

from __future__ import annotations

import numpy as np

from bemkit.arrays import FloatArray
from bemkit.results.solved_body import SolvedBody
from bemkit.scene.body_forces import Gravity, Heating, Rotation
from bemkit.testing.independent_check.boundary import Boundary


def inner_work(body: SolvedBody, boundary: Boundary) -> FloatArray:
    """Return the work (3,) of forces inside on the translations and on the rotation about the centre by 1 / diameter.

    Heat does none.
    """
    centre, diameter = body.mesh.centre, body.mesh.diameter
    arms, measure = boundary.points - centre, boundary.shares[..., None] * boundary.normals
    area = 0.5 * float(np.sum(arms * measure))
    moments = 0.5 * np.sum(arms**2 * measure, axis=(0, 1))
    work = np.zeros(3)
    for force in body.scene.body_forces:
        match force:
            case Gravity(density, acceleration):
                density_of_force = density * np.array(acceleration, dtype=float)
                resultant, lever = area * density_of_force, density_of_force
            case Rotation(density, angular_velocity, axis):
                factor, away = density * angular_velocity**2, centre - np.array(axis)
                resultant, lever = factor * (moments + area * away), factor * away
            case Heating():
                continue
        work += [*resultant, float(moments[0] * lever[1] - moments[1] * lever[0]) / diameter]
    return work


def without_particular(body: SolvedBody, boundary: Boundary) -> tuple[FloatArray, FloatArray]:
    """Return nodal displacements (n_nodes, 2) and tractions at quadrature points (n_elements, n_places, 2) without it.

    What is left belongs to a body in which nothing acts, for which Betti's theorem needs only the boundary.
    """
    fields, particular = body.boundary, body.particular
    if particular is None:
        return fields.displacement, boundary.traction
    left = fields.displacement - particular.displacement(fields.points)
    return left, boundary.traction - particular_tractions(body, boundary)


def particular_tractions(body: SolvedBody, boundary: Boundary) -> FloatArray:
    """Return the tractions (n_elements, n_places, 2) of the particular solution at quadrature points."""
    if body.particular is None:
        return np.zeros_like(boundary.points)
    stress = body.particular.stress(boundary.points.reshape(-1, 2)).reshape(*boundary.points.shape, 2)
    return np.asarray(np.einsum("eqij,eqj->eqi", stress, boundary.normals))
