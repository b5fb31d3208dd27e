"""The independent check of an assembly: each body alone, each contact from both its sides, all forces together."""

from __future__ import annotations

from dataclasses import dataclass

from bemkit.results.assembly_solution import AssemblySolution
from bemkit.results.solution import Solution
from bemkit.studies.stability.independent_check.check import check_solution, contact_violations, is_finite
from bemkit.studies.stability.independent_check.distances import gap_mismatch, hidden_overlaps, mean_mismatch
from bemkit.studies.stability.independent_check.joints import Joints
from bemkit.studies.stability.independent_check.resultants import (
    energy_mismatch,
    largest_imbalance,
    reaction_mismatch,
    rigid_mismatch,
)
from bemkit.studies.stability.independent_check.verdict import COARSE_LIMIT, COARSE_SHARE, Violations


@dataclass(frozen=True, kw_only=True)
class AssemblyCheck(Violations):
    """Violations found in the fields of an assembly, dimensionless; zero is perfect.

    Of reciprocity, with the moments, coarseness and the like the worst of all bodies is told; hidden overlap is how
    deep points between nodes are in the partner, over the displacement that strains the body.

    Parameters
    ----------
    gaps : float
        Gaps of the table against distances measured again, of obstacles and of flat sides.
    means : float
        Mean relative displacements of flat sides against those of the table; its clearances against gaps.
    reactions : float
        Forces that the elements of a side feel, against what the table says, with the other sign on the partner's.
    rigid : float
        Motions and loads of rigid bodies against what is given, and the balance of each.
    between_nodes : float
        How much deeper points of one side are in the other one than the solution says of them.
    """

    gaps: float
    means: float
    reactions: float
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
    if not is_finite(solution):
        return AssemblyCheck.not_finite()
    joints = Joints.of(solution)
    bodies = joints.bodies.values()
    deepest, unsaid = hidden_overlaps(joints)
    return AssemblyCheck(
        numbers=0.0,
        gaps=gap_mismatch(joints),
        means=mean_mismatch(joints),
        supports=max(body.supports() for body in bodies),
        **contact_violations(joints.measured(before), solution, knows_slip=before is not None),
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


def check_step(step: Solution | AssemblySolution, before: Solution | AssemblySolution | None) -> Violations:
    """Check a solution of one body or of several, of a load history with the step before it.

    Slip counts from the last increment, which is not there to be seen if the step was gone in several.
    """
    if step.loading is not None and step.loading.steps[-1].n_increments > 1:
        before = None
    if isinstance(step, AssemblySolution):
        return check_assembly(step, before if isinstance(before, AssemblySolution) else None)
    return check_solution(step, before if isinstance(before, Solution) else None)
