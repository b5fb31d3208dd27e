"""Whether the elastic energy of a body of an assembly can be negative."""

from __future__ import annotations

from bemkit.model.assembled.model import AssembledModel
from bemkit.model.energy import doubt_of, named_negative
from bemkit.solvers.base import ContactSolution, Status


def with_energies_checked(model: AssembledModel, result: ContactSolution) -> ContactSolution:
    """Return the outcome of a solve, named NEGATIVE_ENERGY and by the body if the energy of one is negative or can be.

    See `bemkit.model.energy.with_energy_checked`.
    """
    if not result.state.is_finite or result.status is Status.NOT_FINITE:
        return result
    unknowns = model.body.member_displacements(result.state)[: len(model.condensed)]  # rigid bodies come last
    bodies = zip(model.prepared.bodies, model.elastic, model.condensed, model.prepared.insides, unknowns, strict=True)
    for body, elastic, condensed, inside, own in bodies:
        displacement, force = condensed.recover(own)
        if inside is not None:
            displacement, force = displacement - inside.displacement, force - inside.force
        is_symmetric = body.scene.discretisation.is_symmetric
        doubt = doubt_of(condensed, elastic, body.own_space, is_symmetric, (displacement, force))
        if doubt:
            return named_negative(result, f"body {body.name!r}: {doubt}")
    return result
