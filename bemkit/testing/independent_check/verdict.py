"""The verdict on the entries of a check: faults, open questions, or nothing."""

from __future__ import annotations

from dataclasses import asdict, dataclass, fields
from typing import ClassVar, Self

import numpy as np

from bemkit.testing.independent_check.scales import CONTACT_LIMIT

OVERLAP_LIMIT = 1e-5
"""Largest overlap that a support may cause at an obstacle without a warning, relative to the largest displacement: ten
times the round-off of the warning."""


@dataclass(frozen=True, kw_only=True)
class Violations:
    """Violations found in the fields of a solution, dimensionless; zero is perfect.

    Each entry is the worst of all bodies and contacts.

    Parameters
    ----------
    numbers : float
        Infinite if a field holds a number that is not finite, zero otherwise.
    gaps : float
        Gaps of the table against distances measured again, of obstacles and of flat sides.
    table : float
        Displacements of the table against those of the boundaries, at nodes at obstacles and in the mean of flat sides;
        clearances against gaps; reported forces against sums.
    tractions : float
        Tractions of elements against loads, and against those of nodes at obstacles.
    reactions : float
        Forces on the elements of a side between bodies against those of the table, with the opposite sign on the
        partner.
    rigid : float
        Motions and loads of rigid bodies against what is given, and the balance of each.
    supports : float
        Held displacements against what is prescribed.
    penetration, tension, complementarity : float
        Of normal contact: the smaller of pressure and clearance where both exist.
    cone_excess, slip_opposition : float
        Of friction: traction beyond the bound; the smaller of slip and missing opposition.
    status : float
        The status of a node against its traction, clearance and slip.
    equilibrium : float
        Of all forces on a body along motions that no support holds; of a half-plane, of tractions and loads far away
        on the motions that these drive. Moments on bodies that touch others belong to reciprocity.
    negative_energy, energy : float
        Elastic energy below zero; against half the work of the external forces.
    elasticity : float
        Only for half-planes: displacements against Flamant's solution for the tractions and the motion far away.
    between_nodes : float
        Excess of the overlap between nodes over that which the solution says.
    reciprocity : float
        Betti's theorem, with point forces and centres of dilatation outside of the body, with uniform stresses and with
        a turn; up to the discretisation error.
    allowed_reciprocity : float
        What the mesh of that body explains.
    hidden_overlap, allowed_overlap : float
        How deep points between nodes are in the obstacle or partner, over the displacement that strains the
        body; what the meshes explain.
    held_overlap : float
        How deep nodes that supports hold against their obstacle are in it, over the largest displacement.
    """

    inexact: ClassVar[tuple[str, ...]] = (
        "reciprocity",
        "allowed_reciprocity",
        "hidden_overlap",
        "allowed_overlap",
        "held_overlap",
    )
    """Entries that need not vanish."""

    numbers: float
    gaps: float
    table: float
    tractions: float
    reactions: float
    rigid: float
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
    elasticity: float
    between_nodes: float
    reciprocity: float
    allowed_reciprocity: float
    hidden_overlap: float
    allowed_overlap: float
    held_overlap: float

    @classmethod
    def not_finite(cls) -> Self:
        """Return the verdict on fields that are not finite."""
        return cls(**{**dict.fromkeys((entry.name for entry in fields(cls)), np.nan), "numbers": np.inf})

    @property
    def exact(self) -> dict[str, float]:
        """The entries that must vanish to round-off on every mesh, by name."""
        return {name: value for name, value in asdict(self).items() if name not in self.inexact}

    @property
    def worst(self) -> float:
        """The largest entry that must vanish to round-off; nan if any entry is."""
        return float(np.max(list(self.exact.values())))

    @property
    def faults(self) -> tuple[str, ...]:
        """Names of the entries that should vanish and do not, the largest first."""
        wrong = {name: value for name, value in self.exact.items() if not value <= CONTACT_LIMIT}
        return tuple(sorted(wrong, key=lambda name: -np.nan_to_num(wrong[name], nan=np.inf, posinf=np.inf)))

    @property
    def is_good(self) -> bool:
        """Whether the fields obey supports, contact, friction, equilibrium and the balance of energy."""
        return not self.faults

    @property
    def needs_warning(self) -> str:
        """The first of the entries that a solution must warn of, "held_overlap", "hidden_overlap" and "reciprocity"."""
        if self.held_overlap > OVERLAP_LIMIT:
            return "held_overlap"
        if self.hidden_overlap > self.allowed_overlap:
            return "hidden_overlap"
        return "reciprocity" if self.is_coarse else ""

    @property
    def is_coarse(self) -> bool:
        """Whether tractions and displacements belong to one elastic body only roughly."""
        return not self.reciprocity <= self.allowed_reciprocity

    @property
    def description(self) -> str:
        """The entries that are too large, and those that need not vanish, with their values."""
        entries = [f"{name} {self.exact[name]:.1e}" for name in self.faults]
        inexact = [f"{name} {getattr(self, name):.1e}" for name in self.inexact]
        return "; ".join([*entries, *inexact])
