"""Violations of the conditions of contact between the nodes of a solution, contact by contact."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from bemkit.arrays import FloatArray
from bemkit.contact.laws import FrictionLaw
from bemkit.results.between_nodes import (
    BetweenNodes,
    MeasuredContact,
    law_between,
    points_between,
    sample_at_obstacle,
    violations_at,
)
from bemkit.results.least_clearance import Sample, nearest_only, with_least_clearances
from bemkit.results.part_forces import RigidResult
from bemkit.scene.conditions import name_at_obstacle

if TYPE_CHECKING:
    from bemkit.results.solved_scene import SolvedScene
    from bemkit.scene.contacts import ContactPair
    from bemkit.scene.plane_motion import RigidBody

_LIGHTEST = 1e-3
"""Smallest force that a body is measured by, relative to the forces on the others."""


def violations_between_nodes(solution: SolvedScene, names: Collection[str] | None = None) -> dict[str, BetweenNodes]:
    """Measure the displacements and tractions of a solution along its contacts.

    Parameters
    ----------
    solution : SolvedScene
    names : collection of str, optional
        The contacts to measure; by default all. The stress and the length to which violations are relative are those of
        all contacts.

    Returns
    -------
    dict of str to BetweenNodes
        By contact of the table.

    Notes
    -----
    The gap is measured at each point, so that the shape of both sides between nodes counts too. Fields of constant
    elements are steps. Between elastic bodies points lie on the pieces on which the functions of both sides are smooth,
    and face each other along the mean of both normals; tractions of both sides are measured, with one clearance.
    Tractions are relative to those on the body of the contact that carries less, and lengths to the displacement of the
    softer one: the heaviest block does not hide the violations of a light
    one. Without any contact force lengths are relative to
    the larger displacement of the two.
    """
    bodies, contact = solution.bodies, solution.contact
    stated = [*_at_obstacles(solution)]
    if solution.scene.elastic_contacts:
        from bemkit.results.between_bodies import contacts_between_bodies  # mortars, which other scenes lack

        stated += contacts_between_bodies(solution)
    forces = {name: 0.0 for name in bodies}
    stresses = dict(forces)
    size = np.hypot(contact.sigma_n, contact.sigma_t)
    for name, partners, _, _ in stated:
        rows = contact.rows(name)
        for body in partners:
            forces[body] += float(contact.weight[rows] @ size[rows])
            stresses[body] = max(stresses[body], float(size[rows].max(initial=0.0)))
    violations: dict[str, BetweenNodes] = {}
    moved = {name: float(np.abs(body.boundary.displacement).max()) for name, body in bodies.items()}
    for name, partners, law, measure in stated:
        if names is not None and name not in names:
            continue
        modulus = min(bodies[body].scene.material.plane_modulus for body in partners)
        force, stress = (
            max(min(of[body] for body in partners), _LIGHTEST * max(of.values())) for of in (forces, stresses)
        )
        with np.errstate(all="ignore"):  # results that are not finite are measured by nan
            values = measure()
            found = violations_at(
                values,
                law_between(law, values, contact, name, solution.motion),
                stress or 1.0,
                force / modulus or max(moved[body] for body in partners) or max(moved.values()) or 1.0,
            )
        violations[name] = replace(found, has_forces=force > 0.0)
    return violations


def _at_obstacles(solution: SolvedScene) -> Iterator[MeasuredContact]:
    """Yield the contacts with rigid obstacles, fixed and moving; each point belongs to the one that is nearest."""
    stated = solution.scene
    moving: dict[str, list[ContactPair]] = {}
    for pair in stated.contacts:
        if pair.rigid_body is not None:
            moving.setdefault(pair.elastic_parts[0][0], []).append(pair)
    for owner, body in solution.bodies.items():
        scene, mesh = body.scene, body.mesh
        facing: dict[str, list[tuple[str, FrictionLaw, Sample]]] = {}
        for part_name, obstacle in scene.obstacles.items():
            elements = mesh.part(part_name)
            if elements.size:  # none beyond a symmetry line
                sample = sample_at_obstacle(body, obstacle, elements)
                facing[part_name] = [(name_at_obstacle(body.name, part_name), scene.laws[part_name], sample)]
        for pair in moving.get(owner, ()):
            part_name = pair.elastic_parts[0][1]
            rigid = stated.rigid_body_of(pair)
            shift = partial(_moved, rigid, solution.rigid[str(pair.rigid_body)])
            sample = sample_at_obstacle(body, rigid.obstacle, mesh.part(part_name), pair.gap_at, shift)
            facing.setdefault(part_name, []).append((pair.name, stated.law_of(pair), sample))
        xi = points_between(scene.discretisation.displacement_space(mesh).degree)
        for part_name, rivals in facing.items():
            samples = [sample for _, _, sample in rivals]
            for k, (name, law, _) in enumerate(rivals):
                sample, n_elements = nearest_only(samples, k), mesh.part(part_name).size
                yield MeasuredContact(name, (owner,), law, partial(with_least_clearances, sample, n_elements, xi))


def _moved(stated: RigidBody, motion: RigidResult, points: FloatArray) -> FloatArray:
    """Return the displacements (n, 2) [m] of a rigid body at points (n, 2)."""
    return np.asarray(stated.motions_at(points) @ np.array([motion.x, motion.y, motion.turn]))
