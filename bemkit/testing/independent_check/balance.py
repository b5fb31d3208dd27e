"""Supports and loads as the scene gives them, equilibrium of each body, and the energy of all."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from bemkit.arrays import FloatArray
from bemkit.results.solution import Solution
from bemkit.testing.independent_check.bodies import MeasuredBody
from bemkit.testing.independent_check.contacts import MeasuredContact
from bemkit.testing.independent_check.half_plane import Surface
from bemkit.testing.independent_check.inside import inner_work, particular_tractions
from bemkit.testing.independent_check.motions import (
    free_motions,
    motions_at,
    strained_displacement,
    translations_among,
)
from bemkit.testing.independent_check.scales import beyond, largest


def support_mismatch(measured: MeasuredBody) -> float:
    """Return the largest difference [-] of a held displacement from what is prescribed, symmetry lines included."""
    mesh, boundary, scales = measured.solved.mesh, measured.boundary, measured.scales
    displacement = measured.solved.boundary.displacement
    worst = [0.0]
    for elements, directions, values in boundary.held:
        motion = np.einsum("enc,enc->en", displacement[boundary.nodes[elements]], directions)
        worst.append(beyond(np.abs(motion - values), scales.turned, scales.length))
    if mesh.symmetry is not None and boundary.nodes.shape[1] > 1:
        across = displacement[: mesh.n_nodes][mesh.on_symmetry_lines]
        worst.append(largest(np.abs(across)) / scales.length)
    return float(np.max(worst))


def load_mismatch(measured: MeasuredBody) -> float:
    """Return the largest difference [-] of the mean tractions of elements from loads, and from tractions at nodes."""
    boundary = measured.boundary
    mean = boundary.forces.sum(axis=1) / boundary.lengths[:, None]
    return largest(np.abs(mean - measured.solved.boundary.traction) / measured.scales.stress)


def imbalance(measured: MeasuredBody, contacts: Iterable[MeasuredContact]) -> float:
    """Return the work of all given forces on free rigid motions over that of all forces on the body.

    These are loads, forces inside and those of contacts. To the size belong the reactions of supports, which squeeze a
    body by forces of any size without work on free motions. Where elastic bodies touch, mean conditions hold, so that
    the moment of the forces at the nodes is right up to the discretisation error only; see `reciprocity_mismatch`.
    """
    body, boundary = measured.solved, measured.boundary
    if body.mesh.surface is not None:
        return Surface.of(measured).imbalance()
    motions, free = motions_at(body, body.boundary.points), free_motions(body, boundary)
    inside = inner_work(body, boundary)
    work, size = inside.copy(), measured.scales.trusted * body.mesh.diameter + float(np.abs(inside).sum())
    for contact in contacts:
        if contact.owner.body is measured and contact.partner is None:
            work = work + np.einsum("nc,ncm->m", contact.forces, motions[contact.nodes])
        for side, sign in contact.sides:
            if side.body is measured:
                size += float(np.abs(contact.forces).sum())
                if contact.partner is not None:
                    work[:2] += sign * contact.forces.sum(axis=0)
                    free = translations_among(free)
    # what the elements make of a rotation: on curved ones it is not one exactly
    interpolated = np.einsum("encm,enq->eqcm", motions[boundary.nodes], boundary.basis)
    if body.particular is not None:  # its tractions act on the elements as loads do, with the other sign
        missed = motions_at(body, boundary.points) - interpolated
        acting = particular_tractions(body, boundary) * boundary.shares[..., None]
        work = work + np.einsum("eqc,eqcm->m", acting, missed)
    size += float(np.abs(boundary.loads).sum())
    size += float(np.abs(boundary.forces).sum()) + measured.scales.stress * float(boundary.lengths.min())
    work = work + np.einsum("eqc,eqcm->m", boundary.loads, interpolated)
    return float(np.abs(work @ free.T).max(initial=0.0)) / size


def negative_energy(measured: MeasuredBody) -> float:
    """Return by how much the elastic energy is negative, over the work of the sizes of tractions and strains.

    They include tractions that may be round-off, on the displacement of the whole body.
    """
    size = _work_of_sizes(measured, strained_displacement(measured.solved)) + _trusted_work(measured)
    size += 1e-6 * _unit_work(measured)
    return max(-measured.energy, 0.0) / size


def energy_mismatch(solution: Solution, bodies: Iterable[MeasuredBody], contacts: Iterable[MeasuredContact]) -> float:
    """Return the difference [-] of the elastic energy from half the work of loads, contacts and rigid bodies.

    Held components without prescribed displacement do no work; where one is prescribed, the mean reactions of elements
    give the work up to the discretisation error only, and nothing is compared; nor is it with forces or heat inside.
    Half-planes that move or are loaded far away are compared by themselves.
    """
    surfaces = [Surface.of(body).energy_mismatch() for body in bodies if body.solved.mesh.surface is not None]
    worst = float(np.max(surfaces, initial=0.0))
    work = size = energy = 0.0
    for body in bodies:
        scene, boundary = body.solved.scene, body.boundary
        if scene.body_forces or scene.far is not None or any(np.any(held.values != 0.0) for held in boundary.held):
            return worst
        displacement = body.solved.boundary.displacement
        work += 0.5 * float(np.sum(boundary.loads * boundary.interpolated(displacement)))
        size += _work_of_sizes(body, displacement) + _trusted_work(body) + 1e-3 * _unit_work(body)
        energy += body.energy
    for contact in contacts:
        each = contact.forces_along * contact.stated_displacement
        work, size = work + 0.5 * float(each.sum()), size + 0.5 * float(np.abs(each).sum())
    for found in solution.rigid.values():  # relative displacements exclude the motion of obstacles
        each = np.array([found.force_x * found.x, found.force_y * found.y, found.moment * found.turn])
        each /= solution.scene.depth
        work, size = work + 0.5 * float(each.sum()), size + 0.5 * float(np.abs(each).sum())
    return max(worst, abs(energy - work) / size if size > 0.0 else 0.0)


def _trusted_work(measured: MeasuredBody) -> float:
    """Return the work [J/m] of tractions that may be round-off, on the motion of the whole body."""
    motion = float(np.abs(measured.solved.boundary.displacement).max())
    return measured.scales.trusted * motion * float(measured.boundary.lengths.sum())


def _unit_work(measured: MeasuredBody) -> float:
    """Return the work [J/m] of the units of stress and length."""
    return measured.scales.stress * measured.scales.length * measured.solved.mesh.diameter


def _work_of_sizes(measured: MeasuredBody, displacement: FloatArray) -> float:
    """Return half the work [J/m] that tractions did if each had the direction of its displacement (n_nodes, 2)."""
    motion = measured.boundary.interpolated(displacement)
    return 0.5 * float(np.sum(np.linalg.norm(measured.boundary.forces, axis=-1) * np.linalg.norm(motion, axis=-1)))
