"""Checks of a solved contact state: warnings in sentences, negative energy, long motions.

The elastic energy of no body can be negative, but that of a discrete one can. Collocation does not make the stiffness
symmetric and positive semidefinite, as Galerkin's method does: on elements that are much longer than a body is thick it
may push back the wrong way, and still satisfy contact and equilibrium.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from bemkit.arrays import FloatArray, IntArray
from bemkit.contact.equilibrium import NOISE_FACTOR, round_off_of
from bemkit.errors import ResultWarning, format_point
from bemkit.geometry.spaces import BoundarySpace, dof_points
from bemkit.geometry.vectors import norms
from bemkit.model.contacts import ContactInterface
from bemkit.model.model import Model
from bemkit.model.prepared import PreparedBody
from bemkit.operators.linear_solvers import Tag
from bemkit.operators.rigid_modes import traction_free_modes
from bemkit.operators.steklov_poincare import CondensedMap, SteklovPoincare
from bemkit.scene.conditions import name_at_obstacle
from bemkit.scene.unit_names import UnitNames, amount
from bemkit.solvers.active_sets import NodeStatus
from bemkit.solvers.base import ContactSolution, Status

LARGEST_ANGLE = 30.0
"""Degrees between the body's normal and the direction of contact. A side lies down on its obstacle by turning through
this angle, and small displacements hold for turns that are small against one: a half is not."""
SMALLEST_OVERLAP = 1e-6
"""Share of the largest displacement below which an overlap is round-off of coordinates and prescribed motions."""
_ROUND_OFF = 1e-10
"""Share of the largest stiffness, or of the work of all forces, that round-off may make of zero. The softest bending of
a ring whose thickness is a hundredth of its radius has 1e-7 of the largest stiffness."""
_OF_DIFFERENCES = 4.0
"""Rounding errors in a strain, of the size of the displacements: of these, of the motion, of their difference."""
_ELIMINATION_TOLERANCE = 64.0 * float(np.finfo(float).eps)
"""Round-off of the condensed stiffness, relative to the sensitivity of the whole body."""
_NO_FORCE = 1e-9
"""Displacement by contact forces that is round-off, relative to the largest one."""


def contact_warnings(
    model: Model, displacements: Sequence[FloatArray], node_status: IntArray
) -> tuple[ResultWarning, ...]:
    """Warn of contact closed at a large angle, and of supports that push a body into an obstacle.

    Parameters
    ----------
    model : Model
    displacements : sequence of (n_nodes, 2) arrays [m]
        Of all nodes of the displacement space of each body.
    node_status : (n_contact,) array of `NodeStatus` values

    Returns
    -------
    tuple of ResultWarning
        At most one of either kind for each contact with an obstacle or a rigid body.
    """
    found: list[ResultWarning] = []
    touching: list[list[IntArray]] = [[] for _ in model.prepared.bodies]
    for rows, of_rows in model.prepared.by_contact(node_status):
        touching[rows.body].append(rows.nodes)
        if rows.couplings is None:
            found += _oblique(model.prepared.bodies[rows.body], rows, of_rows)
    units = model.prepared.scene.units
    for body, displacement, nodes in zip(model.prepared.bodies, displacements, touching, strict=True):
        found += _pushed_in(body, displacement, np.concatenate([np.zeros(0, np.intp), *nodes]), units)
    return tuple(found)


def _oblique(body: PreparedBody, rows: ContactInterface, node_status: IntArray) -> list[ResultWarning]:
    candidates, is_fixed = body.candidates, rows.other < 0
    is_of_part = np.equal(candidates.parts, rows.part if is_fixed else rows.name) & np.isin(
        candidates.nodes.nodes, rows.nodes
    )
    angle = np.degrees(np.arccos(np.clip(candidates.facing[is_of_part], -1.0, 1.0)))
    is_oblique = (node_status != NodeStatus.SEPARATED) & (angle > LARGEST_ANGLE)
    if not is_oblique.any():
        return []
    degrees = float(angle[is_oblique].max())
    touches = (
        f"Part {rows.name!r} touches its obstacle" if is_fixed else f"Contact {rows.name!r} touches the rigid body"
    )
    return [
        ResultWarning(
            "oblique contact",
            rows.name,
            f"{touches} at up to {degrees:.0f} degrees to its own normal, where small displacements no "
            "longer describe the contact: model the body nearer to its final position.",
            degrees,
        )
    ]


def _pushed_in(
    body: PreparedBody, displacement: FloatArray, touching: IntArray, units: UnitNames | None
) -> list[ResultWarning]:
    candidates, nodes = body.candidates, body.candidates.nodes
    is_fixed = np.isin(candidates.parts, [part.name for part in body.scene.contact_parts])
    overlap = np.sum(displacement[nodes.nodes] * nodes.directions, axis=1) - candidates.gap
    overlap[np.isin(nodes.nodes, touching) | ~is_fixed] = -math.inf
    found = []
    for part in dict.fromkeys(candidates.parts):
        node = int(np.argmax(np.where(np.equal(candidates.parts, part), overlap, -math.inf)))
        if overlap[node] > SMALLEST_OVERLAP * np.abs(displacement).max():
            place = format_point(candidates.points[node], body.mesh.diameter, digits=6)
            depth = amount(overlap[node], "length", units, 3)
            name = name_at_obstacle(body.name, part)
            text = (
                f"Supports push part {name!r} {depth} into its obstacle at {place}, "
                "where contact cannot act: let them move with the obstacle, or leave a free element between them."
            )
            found.append(ResultWarning("pushed into obstacle", name, text, float(overlap[node])))
    return found


def with_energies_checked(model: Model, result: ContactSolution) -> ContactSolution:
    """Return the outcome of a solve, named NEGATIVE_ENERGY if the energy of a body is negative or can become so.

    Returns
    -------
    ContactSolution
        The same unless the condensed stiffness of a body has a negative direction or the work of all forces on it is
        negative; the message names it.
    """
    if not result.state.is_finite or result.status is Status.NOT_FINITE:
        return result
    for number, (body, fields) in enumerate(zip(model.prepared.bodies, model.nodal_fields(result.state), strict=True)):
        if body.mesh.surface is not None:  # the flexibility of a half-plane is positive in closed form
            continue
        elastic = model.elastic[number]
        displacements = elastic.own_fields(*fields)
        condensed = model.condensed_map(number)
        if condensed is None:  # only the work of the solution shows it
            sensitivity = np.full(displacements[0].shape, elastic.material.plane_modulus)
            finding = _negative_work(elastic, *displacements, body.own_space, sensitivity)
        else:
            finding = _negative_energy_of(condensed, elastic, body, displacements)
        if finding:
            return result.named(Status.NEGATIVE_ENERGY, f"{body.title}: {finding}" if body.name else finding)
    return result


def _negative_energy_of(
    condensed: CondensedMap,
    elastic: SteklovPoincare,
    body: PreparedBody,
    fields: tuple[FloatArray, FloatArray],
) -> str:
    """Describe why the energy of a body is or can be negative; empty if it is not.

    Parameters
    ----------
    condensed : CondensedMap
    elastic : SteklovPoincare
    body : PreparedBody
    fields : two (n_nodes, 2) arrays [-]
        Displacements and forces without what acts inside the body.
    """
    displacement, force = fields
    sensitivity = condensed.sensitivity
    if sensitivity is None:  # a node resists by about E' per displacement, for any elements around it
        sensitivity = np.full(displacement.shape, elastic.material.plane_modulus)
    # a symmetric map is negative in no direction but for round-off, which the work of the solution shows
    if Tag.SYMMETRIC not in elastic.tags and is_indefinite(condensed.at_constant_volume, sensitivity):
        return "the stiffness that the contact boundary sees is negative in some direction"
    return _negative_work(elastic, displacement, force, body.own_space, sensitivity)


def _negative_work(
    elastic: SteklovPoincare,
    displacement: FloatArray,
    force: FloatArray,
    space: BoundarySpace,
    sensitivity: FloatArray,
) -> str:
    """Say how negative the work of all forces is, without those inside or with them; empty if neither is."""
    motions = traction_free_modes(space.mesh, dof_points(space))
    share = negative_share(displacement, force, motions, sensitivity)
    if not share and (beyond := elastic.further_energy(displacement, force)).any():
        share = negative_share(displacement, force, motions, sensitivity, 2.0 * beyond)
    return f"it is {-share:.1e} times the work of all forces, each taken by its size" if share else ""


def negative_share(
    displacement: FloatArray,
    force: FloatArray,
    motions: FloatArray,
    sensitivity: FloatArray | None,
    beyond: FloatArray | None = None,
) -> float:
    """Return how negative the work of all forces is, relative to the sum of the sizes of its parts.

    Parameters
    ----------
    displacement, force : (n_nodes, 2) arrays [m], [N/m]
    motions : (2 n_nodes, n_motions) array
        Rigid motions that cost no energy: balanced forces do no work on them, but for round-off.
    sensitivity : (n_nodes, 2) array or None
        See `CondensedMap`.
    beyond : (n,) array [J/m], optional
        Further parts of the work.

    Returns
    -------
    float
        Zero for a work that is positive, or negative by no more than round-off.
    """
    strained = displacement - (motions @ np.linalg.lstsq(motions, displacement.ravel(), rcond=None)[0]).reshape(-1, 2)
    parts = np.append(strained * force, [] if beyond is None else beyond)
    size = float(np.abs(parts).sum())
    # a body that only moves has only strains of round-off, and these are known no better than that
    farthest = max(
        float(np.abs(strained).max()), NOISE_FACTOR * float(np.finfo(float).eps * np.abs(displacement).max())
    )
    round_off = _ROUND_OFF * size + round_off_of(displacement, sensitivity) * farthest
    # strains are differences of displacements, and known no better than these are
    round_off += _OF_DIFFERENCES * float(np.finfo(float).eps * np.sum(np.abs(displacement * force)))
    # forces that strain nothing, such as a pressure all around an incompressible body, move it only by round-off
    stiffest = 0.0 if sensitivity is None else float(np.abs(sensitivity).max(initial=0.0))
    if stiffest > 0.0:
        round_off += NOISE_FACTOR * float(np.finfo(float).eps * np.sum(np.abs(force)) ** 2) / stiffest
    work = float(parts.sum())
    return -work / size if work < -round_off else 0.0


def is_indefinite(stiffness: FloatArray, sensitivity: FloatArray | None = None) -> bool:
    """Return whether the symmetric part of a stiffness has an eigenvalue that is negative beyond round-off.

    Parameters
    ----------
    stiffness : (n, n) array [N/m]
    sensitivity : (n_nodes, 2) array, optional
        Of the body that it was condensed from, whose round-off it carries; see `CondensedMap`.
    """
    if not np.isfinite(stiffness).all():
        return False  # overflow has a name of its own
    symmetric = 0.5 * (stiffness + stiffness.T)
    round_off = _ROUND_OFF * float(np.abs(symmetric).max(initial=0.0))
    if sensitivity is not None:
        round_off += _ELIMINATION_TOLERANCE * float(np.abs(sensitivity).max(initial=0.0))
    symmetric[np.diag_indices_from(symmetric)] += round_off
    try:
        np.linalg.cholesky(symmetric)
    except np.linalg.LinAlgError:
        return True
    return False


def with_sliding_checked(model: Model, result: ContactSolution) -> ContactSolution:
    """Return the outcome of a solve, named FINITE_SLIDING if a contact has moved too far along its surface."""
    prepared = model.prepared
    if not result.is_converged or not prepared.n_contact:
        return result
    displacements = result.state.displacement * prepared.units.displacement
    tractions = result.state.traction * prepared.units.stress
    forces = [rows.weights @ norms(traction) for rows, traction in prepared.by_contact(tractions)]
    softest = min(body.material.plane_modulus for body in prepared.bodies)
    deformation = float(max(forces)) / softest
    if deformation <= _NO_FORCE * float(np.abs(displacements).max()):
        return result
    moved = zip(prepared.by_contact(displacements), prepared.by_contact(tractions), strict=True)
    for (rows, displacement), (_, traction) in moved:
        is_pressed = traction[:, 0] != 0.0  # not by their friction, which some laws exert across a gap
        if not is_pressed.any():
            continue
        number = rows.other - len(prepared.bodies)
        if number < 0 and norms(displacement[is_pressed]).max() <= deformation:
            continue
        from bemkit.model.finite_sliding import why_off

        motion = model.rigid_bodies(result.state)[number][0] if number >= 0 else np.zeros(3)
        reason = why_off(prepared, rows, motion, displacement, is_pressed, deformation)
        if reason:
            return result.named(Status.FINITE_SLIDING, reason)
    return result
