"""The independent check of a solution: each body, each contact from both its sides, all forces together."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np

from bemkit.results.solution import Solution
from bemkit.testing.independent_check.balance import (
    energy_mismatch,
    imbalance,
    load_mismatch,
    negative_energy,
    support_mismatch,
)
from bemkit.testing.independent_check.bodies import MeasuredBody, bodies_of
from bemkit.testing.independent_check.contact_laws import contact_violations
from bemkit.testing.independent_check.contacts import MeasuredContact, measured_contacts
from bemkit.testing.independent_check.half_plane import Surface
from bemkit.testing.independent_check.overlaps import held_overlap, hidden_overlap, unsaid_overlap
from bemkit.testing.independent_check.reciprocity import reciprocity_mismatch
from bemkit.testing.independent_check.tables import (
    displacement_mismatch,
    gap_mismatch,
    nodal_mismatch,
    reaction_mismatch,
    resultant_mismatch,
    rigid_mismatch,
)
from bemkit.testing.independent_check.verdict import Violations


def violations_of(solution: Solution, before: Solution | None = None) -> Violations:
    """Check the fields of a solution.

    Parameters
    ----------
    solution : Solution
    before : Solution, optional
        The end of the load step before, from which slip counts. Without it friction against slip is not checked at the
        end of a load history, nor if the last step was divided into increments.
    """
    if not is_finite(solution):
        return Violations.not_finite()
    n_steps = 0
    if solution.loading is not None:
        n_steps = len(solution.loading.steps)
        before = before if solution.loading.steps[-1].n_increments == 1 else None
    measured = bodies_of(solution, before)
    bodies, contacts = tuple(measured.values()), tuple(measured_contacts(solution, before, measured))
    laws = [contact_violations(each, knows_slip=before is not None or n_steps <= 1) for each in contacts]
    return Violations(
        numbers=0.0,
        gaps=_worst(gap_mismatch(each) for each in contacts),
        table=_worst([resultant_mismatch(solution, contacts), *(displacement_mismatch(each) for each in contacts)]),
        tractions=_worst(max(load_mismatch(body), nodal_mismatch(body, contacts)) for body in bodies),
        reactions=reaction_mismatch(contacts),
        rigid=rigid_mismatch(solution, bodies, contacts),
        supports=_worst(support_mismatch(body) for body in bodies),
        **{name: _worst(law[name] for law in laws) for name in _LAWS},
        equilibrium=_worst(imbalance(body, contacts) for body in bodies),
        negative_energy=_worst(negative_energy(body) for body in bodies),
        energy=energy_mismatch(solution, bodies, contacts),
        elasticity=_worst(Surface.of(body).elasticity_mismatch() for body in bodies if body.solved.mesh.surface),
        **_reciprocity(bodies),
        **_overlaps(solution, contacts),
    )


_LAWS = ("penetration", "tension", "complementarity", "cone_excess", "slip_opposition", "status")


def is_finite(solution: Solution) -> bool:
    """Return whether all fields are numbers; distances to obstacles out of reach may be infinite."""
    columns = solution.contact.columns()
    distances = [columns.pop(name) for name in ("gap", "clearance")]
    of_bodies = (
        field for body in solution.bodies.values() for field in (*vars(body.boundary).values(), np.array(body.energy))
    )
    known = all(bool(np.isfinite(field).all()) for field in (*columns.values(), *of_bodies))
    return known and not any(np.isnan(field).any() for field in distances)


def _reciprocity(bodies: Iterable[MeasuredBody]) -> dict[str, float]:
    """Return the mismatch of the body that is worst for its mesh, and what that explains; see `Violations`."""
    found = [(reciprocity_mismatch(body), body.allowed_error) for body in bodies]
    worst, allowed = _worst_by_share(found)
    return {"reciprocity": worst, "allowed_reciprocity": allowed}


def _overlaps(solution: Solution, contacts: Sequence[MeasuredContact]) -> dict[str, float]:
    """Return the violations between nodes and at nodes that supports hold; see `Violations`."""
    hidden, unsaid, held = [(0.0, 1.0)], [0.0], [0.0]
    for contact in contacts:
        rows = [each.nodes for each in contacts if each.owner.body is contact.owner.body]
        held.append(held_overlap(contact, np.concatenate(rows)))
        if contact.is_shared:
            continue
        overlap = hidden_overlap(contact)
        hidden.append((overlap / contact.length, max(side.body.allowed_error for side, _ in contact.sides)))
        unsaid.append(unsaid_overlap(contact, overlap, solution.contacts_between_nodes[contact.name].penetration_depth))
    deepest, allowed = _worst_by_share(hidden)
    return {
        "between_nodes": _worst(unsaid),
        "hidden_overlap": deepest,
        "allowed_overlap": allowed,
        "held_overlap": _worst(held),
    }


def _worst_by_share(pairs: Sequence[tuple[float, float]]) -> tuple[float, float]:
    """Return the pair of a violation and what is allowed that has the largest ratio, or nan."""
    return pairs[int(np.argmax([found / allowed for found, allowed in pairs]))]


def _worst(values: Iterable[float]) -> float:
    return float(np.max([0.0, *values]))
