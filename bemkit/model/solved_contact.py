"""Checks of a solved contact state: warnings in sentences, negative energy.

The elastic energy of no body can be negative, but that of a discrete one can. Collocation does not make the stiffness
symmetric and positive semidefinite, as Galerkin's method does: on elements that are much longer than a body is thick it
may push back the wrong way, and still satisfy contact and equilibrium.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from bemkit.arrays import FloatArray, IntArray
from bemkit.contact.equilibrium import NOISE_FACTOR, round_off_of
from bemkit.geometry.spaces import BoundarySpace, dof_points
from bemkit.model.contact_model import Model, energy_beyond, map_fields
from bemkit.operators.rigid_modes import traction_free_modes
from bemkit.operators.steklov_poincare import CondensedMap, SteklovPoincare
from bemkit.result_warning import ResultWarning
from bemkit.scene.unit_names import amount
from bemkit.solvers.active_sets import NodeStatus
from bemkit.solvers.base import ContactSolution, Status

if TYPE_CHECKING:
    from bemkit.model.assembled.model import AssembledModel  # single bodies are solved without it


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
"""Share of the sensitivity of the whole body that elimination may leave in its condensed stiffness."""


def contact_warnings(model: Model, displacement: FloatArray, node_status: IntArray) -> tuple[ResultWarning, ...]:
    """Say where contact is closed at a large angle, and where supports push the body into an obstacle.

    Parameters
    ----------
    model : Model
    displacement : (n_nodes, 2) array [m]
        Of all nodes of the displacement space.
    node_status : (n_contact,) array of `NodeStatus` values

    Returns
    -------
    tuple of ResultWarning
        At most one of either kind for each contact part.
    """
    return (*_oblique(model, node_status), *_pushed_in(model, displacement))


def _oblique(model: Model, node_status: IntArray) -> list[ResultWarning]:
    contact = model.contact
    angle = np.degrees(np.arccos(np.clip(contact.facing, -1.0, 1.0)))
    is_oblique = (node_status != NodeStatus.SEPARATED) & (angle > LARGEST_ANGLE)
    worst: dict[str, float] = {}
    for node in np.flatnonzero(is_oblique).tolist():
        part = contact.parts[node]
        worst[part] = max(worst.get(part, 0.0), float(angle[node]))
    return [
        ResultWarning(
            "oblique contact",
            part,
            f"Part {part!r} touches its obstacle at up to {degrees:.0f} degrees to its own normal, where small "
            "displacements no longer describe the contact: model the body nearer to its final position.",
            degrees,
        )
        for part, degrees in worst.items()
    ]


def _pushed_in(model: Model, displacement: FloatArray) -> list[ResultWarning]:
    candidates, nodes = model.prepared.candidates, model.prepared.candidates.nodes
    overlap = np.sum(displacement[nodes.nodes] * nodes.directions, axis=1) - candidates.gap
    overlap[np.isin(nodes.nodes, model.nodes.nodes)] = -math.inf
    found = []
    for part in dict.fromkeys(candidates.parts):
        node = int(np.argmax(np.where(np.equal(candidates.parts, part), overlap, -math.inf)))
        if overlap[node] > SMALLEST_OVERLAP * np.abs(displacement).max():
            x, y = candidates.points[node]
            depth = amount(overlap[node], "length", model.scene.units, 3)
            text = (
                f"Supports push part {part!r} {depth} into its obstacle at ({x:.6g}, {y:.6g}), where "
                "contact cannot act: let them move with the obstacle, or leave a free element between them."
            )
            found.append(ResultWarning("pushed into obstacle", part, text, float(overlap[node])))
    return found


def with_energy_checked(model: Model, result: ContactSolution) -> ContactSolution:
    """Return the outcome of a solve, named NEGATIVE_ENERGY if the energy of the body is negative or can become so.

    Returns
    -------
    ContactSolution
        The same unless the condensed stiffness has a negative direction or the work of all forces is negative.
    """
    if not result.state.is_finite or result.status is Status.NOT_FINITE:
        return result
    if model.mesh.surface is not None:  # the flexibility of a half-plane is positive in closed form
        return result
    displacement, force = map_fields(model.elastic, *model.body.recover(result.state))
    space = model.prepared.space
    if model.body.condensed is None:  # only the work of the solution shows it
        sensitivity = np.full(displacement.shape, model.elastic.material.plane_modulus)
        finding = _negative_work(model.elastic, displacement, force, space, sensitivity)
    else:
        is_symmetric = model.scene.discretisation.is_symmetric
        finding = _negative_energy_of(model.body.condensed, model.elastic, space, is_symmetric, (displacement, force))
    return _named_negative(result, finding) if finding else result


def with_energies_checked(model: AssembledModel, result: ContactSolution) -> ContactSolution:
    """Return the outcome of a solve, named NEGATIVE_ENERGY and by the body if the energy of one is negative or can be.

    See `with_energy_checked`.
    """
    if not result.state.is_finite or result.status is Status.NOT_FINITE:
        return result
    unknowns = model.body.member_displacements(result.state)[: len(model.condensed)]  # rigid bodies come last
    bodies = zip(model.prepared.bodies, model.elastic, model.condensed, unknowns, strict=True)
    for body, elastic, condensed, own in bodies:
        fields, is_symmetric = map_fields(elastic, *condensed.recover(own)), body.scene.discretisation.is_symmetric
        finding = _negative_energy_of(condensed, elastic, body.own_space, is_symmetric, fields)
        if finding:
            return _named_negative(result, f"body {body.name!r}: {finding}")
    return result


def _negative_energy_of(
    condensed: CondensedMap,
    elastic: SteklovPoincare,
    space: BoundarySpace,
    is_symmetric: bool,
    fields: tuple[FloatArray, FloatArray],
) -> str:
    """Say why the energy of a body is or can be negative; empty if it is not.

    Parameters
    ----------
    condensed : CondensedMap
    elastic : SteklovPoincare
    space : BoundarySpace
        Of the displacements.
    is_symmetric : bool
        Whether the map is.
    fields : two (n_nodes, 2) arrays [-]
        Displacements and forces without what acts inside the body.
    """
    displacement, force = fields
    sensitivity = condensed.sensitivity
    if sensitivity is None:  # a node resists by about E' per displacement, for any elements around it
        sensitivity = np.full(displacement.shape, elastic.material.plane_modulus)
    # a symmetric map is negative in no direction but for round-off, which the work of the solution shows
    if not is_symmetric and is_indefinite(condensed.stiffness, sensitivity):
        return "the stiffness that the contact boundary sees is negative in some direction"
    return _negative_work(elastic, displacement, force, space, sensitivity)


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
    if not share and (beyond := energy_beyond(elastic, displacement, force)).any():
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


def _named_negative(result: ContactSolution, reason: str) -> ContactSolution:
    """Return an outcome with the status NEGATIVE_ENERGY and a reason."""
    status = Status.NEGATIVE_ENERGY
    return replace(result, status=status, message=f"{status.value} [{reason}]")
