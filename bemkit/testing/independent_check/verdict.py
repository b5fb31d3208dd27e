"""The verdict on the entries of a check: faults, open questions, or nothing."""

from __future__ import annotations

from dataclasses import asdict, dataclass, fields
from typing import ClassVar, Self

import numpy as np

from bemkit.testing.independent_check.boundary import CONTACT_LIMIT

COARSE_LIMIT = 0.1
"""Largest share of work out of balance in the reciprocal theorem: the discretisation error of a coarse mesh, far below
that of fields which do not belong to the body at all."""
COARSE_SHARE = 2.0
"""The same for each unit of `Violations.coarseness`: collocation with 35, 70 and 140 elements on a block between
two obstacles misses it by 1.5, 1.4 and 1.25 times that, its energy by 34, 15 and 7 %."""
OVERLAP_LIMIT = 1e-5
"""Largest overlap that a support may cause at an obstacle without a warning, relative to the largest displacement: ten
times the round-off of the warning."""


@dataclass(frozen=True, kw_only=True)
class Violations:
    """Violations found in the fields of any solution, dimensionless; zero is perfect.

    Parameters
    ----------
    numbers : float
        Infinite if a field holds a number that is not finite, zero otherwise.
    supports : float
        Held displacements against what is prescribed.
    penetration, tension, complementarity : float
        Of normal contact: the smaller of pressure and clearance where both exist.
    cone_excess, slip_opposition : float
        Of friction: traction beyond the bound; the smaller of slip and missing opposition.
    status : float
        The status of a node against its traction, clearance and slip.
    equilibrium : float
        Of all forces on a body along motions that no support holds.
    negative_energy, energy : float
        Elastic energy below zero; against half the work of the external forces.
    elasticity : float
        Only for half-planes: displacements against Flamant's solution for the tractions and the motion far away.
    reciprocity : float
        Betti's theorem, up to the discretisation error.
    coarseness : float
        Length of the longest element over the diameter of its body.
    hidden_overlap : float
        How deep nodes that supports hold against their obstacle are in it, over the largest displacement.
    """

    inexact: ClassVar[tuple[str, ...]] = ("reciprocity", "coarseness", "hidden_overlap")
    """Entries that need not vanish."""

    numbers: float
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
    reciprocity: float
    coarseness: float
    hidden_overlap: float

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
        """Warnings that a solution must have: "reciprocity" of a coarse mesh, "hidden_overlap"; may be empty."""
        if self.hidden_overlap > OVERLAP_LIMIT:
            return "hidden_overlap"
        return "reciprocity" if self.is_coarse else ""

    @property
    def is_coarse(self) -> bool:
        """Whether tractions and displacements belong to one elastic body only roughly."""
        return not self.reciprocity <= max(COARSE_LIMIT, COARSE_SHARE * self.coarseness)

    @property
    def description(self) -> str:
        """The entries that are too large, and those that need not vanish, with their values."""
        entries = [f"{name} {self.exact[name]:.1e}" for name in self.faults]
        inexact = [f"{name} {getattr(self, name):.1e}" for name in ("reciprocity", "hidden_overlap")]
        return "; ".join([*entries, *inexact])
