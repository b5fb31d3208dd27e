"""Violations of the contact conditions between the nodes, where no equation enforces them."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from bemkit.arrays import FloatArray
from bemkit.contact.body import SlipHistory
from bemkit.contact.laws import FrictionLaw, LawOfCoefficients
from bemkit.geometry.vectors import norms
from bemkit.results.contact_table import ContactTable, free_contacts
from bemkit.results.part_forces import RigidResult
from bemkit.results.points_between import (
    MeasuredContact,
    PointsBetween,
    Sample,
    deepest,
    nearest_only,
    points_between,
    sample_at_obstacle,
    with_least_clearances,
)
from bemkit.scene.conditions import name_at_obstacle

if TYPE_CHECKING:
    from bemkit.results.solved_scene import SolvedScene
    from bemkit.scene.contacts import ContactPair
    from bemkit.scene.plane_motion import RigidBody

_NOWHERE = (float("nan"), float("nan"))
_NUMBERS = ("penetration", "tension", "complementarity", "cone_excess", "penetration_depth")
_ROUND_OFF = 64.0 * float(np.finfo(float).eps)
"""Round-off of clearances, which are differences of coordinates, relative to the largest coordinate."""
LARGEST_MISSED = 0.05
"""Largest overlap at the end of a contact zone inside an element, at points without traction, relative to the
displacement by contact forces."""
LARGEST_OVERLAP = 3.0
"""A larger overlap anywhere, relative to the same displacement, shows that the nodes do not find the contact. Two
constant elements beside the lowest point of a coarse ring overlap by 1.2 times that displacement, and their force is
right to 4 %."""
_FREE_ROUND_OFF = 1e-12
"""Overlap that may be round-off, for bodies without any contact force, relative to their displacement."""
_LIGHTEST = 1e-3
"""Smallest force that a body is measured by, relative to the forces on the others."""


@dataclass(frozen=True)
class BetweenNodes:
    """Largest violation of each contact condition at points between the nodes; zero without violation.

    Names and signs are those of `bemkit.contact.certificate.Certificate`, which measures the nodes. These violations
    are errors of the discretisation: they fall as elements become smaller or their degree higher. The opposition of
    slip is measured at nodes only.

    Parameters
    ----------
    penetration : float
        ``u_n - g`` where positive, relative to the displacement that the contact force causes, ``force / E'``.
    tension : float
        ``sigma_n`` where positive, relative to the largest contact traction.
    complementarity : float
        The smaller of traction and distance, both relative, where both exist.
    cone_excess : float
        ``|sigma_t| - bound(sigma_n)`` where positive, relative to the largest contact traction.
    penetration_depth : float [m]
        ``u_n - g`` where positive, and more than round-off of coordinates.
    place : tuple of float, optional
        The point of the boundary where that is.
    missed : float
        The penetration apart from contact zones, where contact is missed, beyond the steps of constant elements.
    missed_place : tuple of float, optional
        The point of the boundary where that is.
    apart : float
        The least distance of the sides, relative to the same displacement, where they touch nowhere.
    has_forces : bool
        Whether contact forces act on the bodies, here or elsewhere; without any the relative displacement is the
        largest one.
    """

    penetration: float
    tension: float
    complementarity: float
    cone_excess: float
    penetration_depth: float
    place: tuple[float, float] = _NOWHERE
    missed: float = 0.0
    missed_place: tuple[float, float] = _NOWHERE
    apart: float = 0.0
    has_forces: bool = True

    @property
    def violations(self) -> dict[str, float]:
        """The relative violations by name."""
        return {name: value for name, value in self.as_dict().items() if name != "penetration_depth"}

    @property
    def worst(self) -> float:
        """The largest relative violation; ``nan`` if any is."""
        return float(np.max(list(self.violations.values())))

    def as_dict(self) -> dict[str, float]:
        """Return the violations and the depth by name."""
        return {name: getattr(self, name) for name in _NUMBERS}

    @classmethod
    def largest(cls, measured: Iterable[BetweenNodes]) -> BetweenNodes | None:
        """Return the largest of each violation, without places; None if `measured` is empty."""
        rows = [list(violations.as_dict().values()) for violations in measured]
        return cls(*np.max(rows, axis=0).tolist()) if rows else None


def law_between(
    law: FrictionLaw, values: PointsBetween, contact: ContactTable, name: str, motion: SlipHistory | None
) -> FrictionLaw:
    """Return the law of a contact of the table at points between its nodes."""
    rows = np.flatnonzero(contact.rows(name))
    order = np.argsort(contact.s[rows])

    def between(nodal: FloatArray) -> FloatArray:
        return np.interp(values.s, contact.s[rows[order]], nodal[order])

    law = (law.with_lists(between) if isinstance(law, LawOfCoefficients) else law).at(values.points)
    if motion is None or not law.needs_history:
        return law
    slip, last_slip = between(motion.slip[rows]), between(motion.last_slip[rows])
    return law.at_slip(SlipHistory(motion.time, motion.time_step, slip, last_slip))


def violations_at(values: PointsBetween, law: FrictionLaw, stress: float, length: float) -> BetweenNodes:
    """Measure violations relative to a stress [Pa] and a length [m]."""
    bound = law.bound(np.minimum(values.sigma_n, 0.0))
    # friction given across the gap is not a sign of contact
    shear = 0.0 if law.acts_across_gap else np.abs(values.sigma_t)
    traction = np.maximum(np.abs(values.sigma_n), shear) / stress
    round_off = _ROUND_OFF * _largest(np.abs(values.points))
    (depth, place), (missed_depth, missed_place) = (
        (0.0 if depth <= round_off else depth, (float(point[0]), float(point[1])))
        for depth, point in (deepest(values), deepest(values.beyond_zones()))
    )
    return BetweenNodes(
        penetration=depth / length,
        tension=_largest(values.sigma_n) / stress,
        complementarity=_largest(np.minimum(traction, np.abs(values.clearance) / length)),
        cone_excess=_largest(np.abs(values.sigma_t) - bound) / stress,
        penetration_depth=depth,
        place=place,
        missed=missed_depth / length,
        missed_place=missed_place,
        apart=max(float(values.clearance.min()), 0.0) / length if values.clearance.size else 0.0,
    )


def violations_between_nodes(
    solution: SolvedScene, names: Collection[str] | None = None, known: Mapping[str, BetweenNodes] | None = None
) -> dict[str, BetweenNodes]:
    """Measure the displacements and tractions of a solution along its contacts.

    Parameters
    ----------
    solution : SolvedScene
    names : collection of str, optional
        The contacts to measure; by default all. The stress and the length to which violations are relative are those of
        all contacts.
    known : mapping of str to BetweenNodes, optional
        Contacts that are measured already.

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
    softer one: the heaviest block does not hide the violations of a light one. Without any contact force lengths are
    relative to the larger displacement of the two.
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
    violations = dict(known or {})
    moved = {name: float(norms(body.boundary.displacement).max()) for name, body in bodies.items()}
    for name, partners, law, measure in stated:
        if name in violations or (names is not None and name not in names):
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
    return {name: violations[name] for name, *_ in stated if name in violations}


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


def missed_contacts(table: ContactTable, measured: Mapping[str, BetweenNodes]) -> dict[str, tuple[float, float]]:
    """Return the points where the nodes do not find the contact, by contact.

    For bodies without contact force every overlap above round-off counts. For others an overlap counts above a share of
    the displacement by contact forces where there is no traction, and above a multiple of it where there is.
    """
    free, missed = free_contacts(table), {}
    for name, each in measured.items():
        if name in free and each.penetration > (LARGEST_MISSED if each.has_forces else _FREE_ROUND_OFF):
            missed[name] = each.place
        elif name not in free and each.missed > LARGEST_MISSED:
            missed[name] = each.missed_place
        elif name not in free and each.penetration > LARGEST_OVERLAP:
            missed[name] = each.place
    return missed


def unfound_contacts(table: ContactTable, measured: Mapping[str, BetweenNodes]) -> dict[str, tuple[float, float]]:
    """Return the missed contacts without force, and those that overlap by far more than their displacement."""
    free = free_contacts(table)
    return {
        name: place
        for name, place in missed_contacts(table, measured).items()
        if name in free or measured[name].penetration > LARGEST_OVERLAP
    }


def _largest(values: FloatArray) -> float:
    return float(np.maximum(values, 0.0).max(initial=0.0))
