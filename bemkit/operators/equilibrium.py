"""Whether the forces on a body are in equilibrium, and as far as round-off lets one tell."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass

import numpy as np

from bemkit.arrays import FloatArray

MOST_ROUND_OFF = 1e-6
"""Share of the forces up to which an imbalance may be put down to round-off; beyond, too few digits are left. The
estimate is 1e-12 in all but thin or nearly incompressible bodies; a strip of 1000 : 1 has an imbalance of 1e-7 and an
estimate of 1e-6. More than that no check of the result would let pass."""


@dataclass(frozen=True)
class Imbalance:
    """How far forces are from equilibrium, relative to their sizes.

    Parameters
    ----------
    force, moment : float
        As measured.
    round_off : float
        How much of that round-off alone may leave. It is cut off at `MOST_ROUND_OFF`.
    """

    force: float
    moment: float
    round_off: float = 0.0

    def __post_init__(self) -> None:
        object.__setattr__(self, "round_off", min(self.round_off, MOST_ROUND_OFF))

    @property
    def worst(self) -> float:
        """The larger of the two measured numbers."""
        return float(np.maximum(self.force, self.moment))

    def is_below(self, tolerance: float) -> bool:
        """Whether what is measured exceeds the tolerance by no more than round-off may leave; not if it is ``nan``."""
        return self.worst <= tolerance + self.round_off

    def joined(self, other: Imbalance) -> Imbalance:
        """Return the larger of each of the numbers of two measurements."""
        mine, others = ((of.force, of.moment, of.round_off) for of in (self, other))
        return Imbalance(*np.maximum(mine, others).tolist())


def round_off_of(displacement: FloatArray, sensitivity: FloatArray | None) -> float:
    """Return what round-off of displacements may leave in a sum of forces.

    Parameters
    ----------
    displacement : (n_nodes, 2) array [m]
    sensitivity : (n_nodes, 2) array or None
        Sum of the sizes of all forces that a unit displacement of each node causes; see `CondensedMap`.

    Returns
    -------
    float [N/m]
        Zero if the sensitivity is not known.
    """
    if sensitivity is None:
        return 0.0
    return float(np.finfo(float).eps * np.sum(sensitivity * np.abs(displacement)))


def resultant_imbalance(
    points: FloatArray,
    force: FloatArray,
    balanced: Collection[int],
    round_off: float,
    volume_force: FloatArray | None = None,
) -> Imbalance:
    """Return resultant force and moment of all forces on a body, relative to the sum of their sizes.

    Parameters
    ----------
    points, force : (n_nodes, 2) arrays [m], [N/m]
    balanced : collection of int
        Which of the resultants along x and y and the moment (0, 1, 2) have to vanish.
    round_off : float [N/m]
        What may be left of a sum of these forces.
    volume_force : (3,) array, optional
        Resultants along x and y, and moment about the origin, of forces inside the body; none by default.

    Returns
    -------
    Imbalance
        The moment about the mean point, in units of the size of the body.
    """
    inside = np.zeros(3) if volume_force is None else volume_force
    total = float(np.abs(force).sum() + np.abs(inside[:2]).sum())
    if not balanced or total == 0.0:
        return Imbalance(0.0, 0.0)
    centre = points.mean(axis=0)
    arm = points - centre
    moment = float(np.sum(arm[:, 0] * force[:, 1] - arm[:, 1] * force[:, 0]))
    moment += float(inside[2] - centre[0] * inside[1] + centre[1] * inside[0])
    sums = np.append(np.abs(force.sum(axis=0) + inside[:2]), abs(moment) / float(np.abs(arm).max()))
    off = np.where(np.isin(np.arange(3), list(balanced)), sums, 0.0) / total
    return Imbalance(float(off[:2].max()), float(off[2]), round_off / total)
