"""The independent check of an assembly: each body alone, each contact from both its sides, all forces together."""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np

from bemkit.results.assembly_solution import AssemblySolution
from bemkit.studies.stability.independent_check.boundary import largest
from bemkit.studies.stability.independent_check.check import slip_opposition, status_mismatch
from bemkit.studies.stability.independent_check.distances import gap_mismatch, hidden_overlaps, mean_mismatch
from bemkit.studies.stability.independent_check.joints import Joints
from bemkit.studies.stability.independent_check.resultants import (
    energy_mismatch,
    largest_imbalance,
    reaction_mismatch,
    rigid_mismatch,
)
from bemkit.studies.stability.independent_check.verdict import COARSE_LIMIT, COARSE_SHARE, Entries


@dataclass(frozen=True, kw_only=True)
class AssemblyCheck(Entries):
    """Violations found in the fields of an assembly, dimensionless; zero is perfect.

    Parameters
    ----------
    numbers : float
        Infinite if a field holds a number that is not finite, zero otherwise.
    gaps : float
        Gaps of the table against distances measured again, of obstacles and of flat sides.
    means : float
        Mean relative displacements of flat sides against those of the table; its clearances against gaps.
    supports : float
        Held displacements and loads against what is given.
    penetration, tension, complementarity, cone_excess, slip_opposition, status : float
        See `IndependentCheck`.
    reactions : float
        Forces that the elements of a side feel, against what the table says, with the other sign on the partner's.
    equilibrium : float
        Resultant of loads, contacts and forces inside on each body, along free translations.
    negative_energy, energy : float
        Elastic energy of a body below zero; of all against half the work of loads and of contacts.
    elasticity : float
        Of half-planes, see `IndependentCheck`.
    rigid : float
        Motions and loads of rigid bodies against what is given, and the balance of each.
    between_nodes : float
        How much deeper points of one side are in the other one than the solution says of them.
    reciprocity, coarseness, hidden_overlap
        See `Entries`: the worst of the bodies, the moments on them among them; how deep points between nodes are in
        the partner, over the displacement that strains the body.
    """

    numbers: float
    gaps: float
    means: float
    supports: float
    penetration: float
    tension: float
    complementarity: float
    cone_excess: float
    slip_opposition: float
    status: float
    reactions: float
    equilibrium: float
    negative_energy: float
    energy: float
    elasticity: float
    rigid: float
    between_nodes: float

    @property
    def needs_warning(self) -> str:
        """What a solution must warn of: "reciprocity" or "hidden_overlap" of a coarse mesh."""
        if self.hidden_overlap > max(COARSE_LIMIT, COARSE_SHARE * self.coarseness):
            return "hidden_overlap"
        return "reciprocity" if self.is_coarse else ""


def check_assembly(solution: AssemblySolution, before: AssemblySolution | None = None) -> AssemblyCheck:
    """Check the fields of an assembly; see `AssemblyCheck`.

    Slip counts from the end of the load step before. Without that, friction against slip is not checked at the end of a
    load history.
    """
    if not _is_finite(solution):
        unknown = dict.fromkeys((entry.name for entry in fields(AssemblyCheck)), float("nan"))
        return AssemblyCheck(**{**unknown, "numbers": float("inf")})
    joints = Joints.of(solution)
    measured = joints.measured(before)
    bodies = joints.bodies.values()
    deepest, unsaid = hidden_overlaps(joints)
    has_history = before is None and solution.loading is not None and len(solution.loading.steps) > 1
    return AssemblyCheck(
        numbers=0.0,
        gaps=gap_mismatch(joints),
        means=mean_mismatch(joints),
        supports=max(body.supports() for body in bodies),
        penetration=largest(-measured.clearance),
        tension=largest(-measured.pressure),
        complementarity=largest(np.minimum(measured.held, np.abs(measured.clearance))),
        cone_excess=largest((np.abs(measured.shear) - measured.bound)[measured.obeys_friction]),
        slip_opposition=0.0 if has_history else slip_opposition(measured),
        status=0.0 if has_history else status_mismatch(solution.contact.status, measured),
        reactions=reaction_mismatch(joints),
        equilibrium=largest_imbalance(joints),
        negative_energy=max(body.negative_energy() for body in bodies),
        energy=energy_mismatch(joints),
        elasticity=max(body.elasticity() for body in bodies),
        rigid=rigid_mismatch(joints),
        between_nodes=unsaid,
        reciprocity=max(max(body.reciprocity(), body.moment()) for body in bodies),
        coarseness=max(body.coarseness for body in bodies),
        hidden_overlap=deepest,
    )


def _is_finite(solution: AssemblySolution) -> bool:
    columns = solution.contact.columns()
    distances = [columns.pop(name) for name in ("gap", "clearance")]
    of_bodies = (
        field
        for body in solution.bodies.values()
        for field in (body.boundary.displacement, body.boundary.traction_dofs, np.array(body.energy))
    )
    is_finite = all(bool(np.isfinite(field).all()) for field in (*columns.values(), *of_bodies))
    return is_finite and not any(np.isnan(field).any() for field in distances)
