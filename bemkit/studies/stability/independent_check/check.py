"""The independent check of one solution."""

from __future__ import annotations

from dataclasses import asdict, dataclass

import numpy as np

from bemkit.results.solution import Solution
from bemkit.studies.stability.independent_check.balance import (
    energy_mismatch,
    imbalance,
    load_mismatch,
    negative_energy,
    support_mismatch,
)
from bemkit.studies.stability.independent_check.boundary import CONTACT_LIMIT, largest
from bemkit.studies.stability.independent_check.contact import (
    measured_contact,
    obstacle_mismatch,
    resultant_mismatch,
    slip_opposition,
    status_mismatch,
    table_mismatch,
    traction_mismatch,
)
from bemkit.studies.stability.independent_check.nodes import Fields, hidden_overlap
from bemkit.studies.stability.independent_check.reciprocity import reciprocity_mismatch

COARSE_LIMIT = 0.1
"""Largest share of work out of balance in the reciprocal theorem: the discretisation error of a coarse mesh, far below
that of fields which do not belong to the body at all."""
COARSE_SHARE = 2.0
"""The same for each unit of `IndependentCheck.coarseness`: collocation with 35, 70 and 140 elements on a block between
two obstacles misses it by 1.5, 1.4 and 1.25 times that, its energy by 34, 15 and 7 %."""
OVERLAP_LIMIT = 1e-5
"""Share of the largest displacement by which a support may push a node into an obstacle without a word: ten times what
the warning takes for round-off."""

_INEXACT = ("reciprocity", "coarseness", "hidden_overlap")


@dataclass(frozen=True)
class IndependentCheck:
    """Violations found in the fields of a solution, dimensionless; zero is perfect.

    Parameters
    ----------
    numbers : float
        Infinite if a field holds a number that is not finite, zero otherwise.
    obstacle : float
        Gap of the table against the distance measured again, beyond the round-off of the coordinates.
    table : float
        Displacements of the table against those of the boundary at the same points; reported forces against sums.
    tractions : float
        Tractions of elements against loads and against the contact tractions of the table.
    supports : float
        Held displacements against what is prescribed.
    penetration, tension, complementarity : float
        Of normal contact: the smaller of pressure and clearance where both exist.
    cone_excess, slip_opposition : float
        Of friction: traction beyond the bound; the smaller of slip and missing opposition.
    status : float
        What the status of a node claims against its traction, clearance and slip.
    equilibrium : float
        Work of loads and contact tractions on the rigid motions that no support holds.
    negative_energy, energy : float
        Elastic energy below zero; against half the work of the external forces.
    reciprocity : float
        Betti's theorem against states of uniform stress, point forces and centres of dilatation outside of the body;
        holds up to the discretisation error.
    coarseness : float
        Length of the longest element over the diameter of the body.
    hidden_overlap : float
        How deep nodes that supports hold against their obstacle are in it, over the largest displacement.
    """

    numbers: float
    obstacle: float
    table: float
    tractions: float
    supports: float
    penetration: float
    tension: float
    complementarity: float
    cone_excess: float
    slip_opposition: float
    status: float
    equilibrium: float
    negative_energy: float
    energy: float
    reciprocity: float
    coarseness: float
    hidden_overlap: float

    @property
    def exact(self) -> dict[str, float]:
        """The entries that must vanish to round-off on every mesh, by name."""
        return {name: value for name, value in asdict(self).items() if name not in _INEXACT}

    @property
    def worst(self) -> float:
        """The largest entry that must vanish to round-off; nan if any entry is."""
        return float(np.max(list(self.exact.values())))

    @property
    def faults(self) -> tuple[str, ...]:
        """Names of the entries that must vanish and do not, the largest first."""
        wrong = {name: value for name, value in self.exact.items() if not value <= CONTACT_LIMIT}
        return tuple(sorted(wrong, key=lambda name: -np.nan_to_num(wrong[name], nan=np.inf, posinf=np.inf)))

    @property
    def is_good(self) -> bool:
        """Whether the fields obey supports, contact, friction, equilibrium and the balance of energy."""
        return not self.faults

    @property
    def needs_warning(self) -> str:
        """What a solution must warn of: "reciprocity" of a coarse mesh, "hidden_overlap"; empty if there is nothing."""
        if self.hidden_overlap > OVERLAP_LIMIT:
            return "hidden_overlap"
        return "reciprocity" if self.is_coarse else ""

    @property
    def is_coarse(self) -> bool:
        """Whether tractions and displacements belong to one elastic body only roughly."""
        return not self.reciprocity <= max(COARSE_LIMIT, COARSE_SHARE * self.coarseness)


def check_solution(solution: Solution, before: Solution | None = None) -> IndependentCheck:
    """Check the fields of a solution; see `IndependentCheck`.

    Parameters
    ----------
    solution : Solution
    before : Solution, optional
        The load step before, from whose end slip counts. Without it friction against slip is not checked at the end of
        a load history.
    """
    if not _is_finite(solution):
        return IndependentCheck(float("inf"), *(float("nan"),) * 16)
    fields = Fields.of(solution, before)
    measured = measured_contact(fields)
    has_history = before is None and len(solution.scene.load_factors) > 1
    return IndependentCheck(
        numbers=0.0,
        obstacle=obstacle_mismatch(fields),
        table=max(table_mismatch(fields), resultant_mismatch(solution)),
        tractions=max(traction_mismatch(fields), load_mismatch(fields)),
        supports=support_mismatch(fields),
        penetration=largest(-measured.clearance),
        tension=largest(-measured.pressure),
        complementarity=largest(np.minimum(measured.held, np.abs(measured.clearance))),
        cone_excess=largest((np.abs(measured.shear) - measured.bound)[measured.obeys_friction]),
        slip_opposition=0.0 if has_history else slip_opposition(measured),
        status=0.0 if has_history else status_mismatch(solution, measured),
        equilibrium=imbalance(fields),
        negative_energy=negative_energy(fields),
        energy=energy_mismatch(fields),
        reciprocity=reciprocity_mismatch(fields),
        coarseness=float(fields.boundary.lengths.max()) / solution.mesh.diameter,
        hidden_overlap=hidden_overlap(fields),
    )


def _is_finite(solution: Solution) -> bool:
    """Tell whether all fields are numbers; distances to obstacles out of reach may be infinite."""
    columns = solution.contact.columns()
    distances = [columns.pop(name) for name in ("gap", "clearance")]
    fields = (*columns.values(), solution.boundary.displacement, solution.boundary.traction)
    is_finite = all(bool(np.isfinite(field).all()) for field in fields) and np.isfinite(solution.energy)
    return bool(is_finite and not any(np.isnan(field).any() for field in distances))
