"""Equilibrium of the forces on a body, up to round-off."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass

import numpy as np

from bemkit.arrays import FloatArray

ROUND_OFF_LIMIT = 1e-6
"""Largest relative imbalance that may be round-off. The estimate of round-off is 1e-12 except for thin or nearly
incompressible bodies; a strip of 1000 : 1 has an imbalance of 1e-7 and an estimate of 1e-6."""


NOISE_FACTOR = 64.0
"""Forces below this multiple of the round-off of their terms count as zero: sums of hundreds of terms have an error of
some eps."""


@dataclass(frozen=True)
class Imbalance:
    """Relative residual of the equilibrium of forces.

    Parameters
    ----------
    force, moment : float
        Relative residuals.
    round_off : float
        Part of these that may be round-off, at most `ROUND_OFF_LIMIT`.
    """

    force: float
    moment: float
    round_off: float = 0.0

    def __post_init__(self) -> None:
        object.__setattr__(self, "round_off", min(self.round_off, ROUND_OFF_LIMIT))

    @property
    def worst(self) -> float:
        """The larger residual."""
        return float(np.maximum(self.force, self.moment))

    def is_below(self, tolerance: float) -> bool:
        """Whether both residuals are at most `tolerance + round_off`; not if one is ``nan``."""
        return self.worst <= tolerance + self.round_off

    def joined(self, other: Imbalance) -> Imbalance:
        """Return the larger of both values for each number."""
        first, second = ((part.force, part.moment, part.round_off) for part in (self, other))
        return Imbalance(*np.maximum(first, second).tolist())


@dataclass(frozen=True, eq=False)
class Unbalanced:
    """Residual of the equilibrium of a contact state [N/m].

    Parameters
    ----------
    contact : (n,) array
        Forces of the obstacle at the nodes.
    at_nodes, on_motions : float
        Largest residual at a node, and largest work of all forces on a rigid motion of unit size.
    nodes_round_off, motions_round_off : float
        Parts of these that may be round-off.
    terms : float
        Largest term in the sums of forces: products of the stiffness and displacements.
    """

    contact: FloatArray
    at_nodes: float
    on_motions: float
    nodes_round_off: float
    motions_round_off: float
    terms: float

    def relative_to(self, given: FloatArray, reaction: float = 0.0, round_off: float = 0.0) -> Imbalance:
        """Return the residual relative to the acting forces.

        Parameters
        ----------
        given : array [N/m]
            Other forces on the nodes of the body, in directions that no support holds.
        reaction : float [N/m]
            Largest reaction of a support; reactions do no work on free motions.
        round_off : float [N/m]
            Round-off of a sum of forces on the whole body.

        Returns
        -------
        Imbalance
            The residual at a node relative to the largest force, and the work relative to the sum of forces. If no
            force is given and all others are round-off, the body has only been moved, and both are relative to the
            terms. Under a load they are not, because a body that moves to infinity would balance any load. A residual
            without any force to compare it with is 1.
        """
        loads = float(np.abs(given).sum())
        largest = max(float(np.abs(self.contact).max()), float(np.abs(given).max(initial=0.0)), reaction)
        total = loads + float(np.abs(self.contact).sum())
        of_sums = max(self.motions_round_off, round_off)
        terms = max(self.terms, round_off / np.finfo(float).eps)
        noise = NOISE_FACTOR * of_sums if loads == 0.0 else 0.0
        largest, total = (max(scale, terms) if scale <= noise else scale for scale in (largest, total))
        at_nodes, on_motions = (
            Imbalance(residual / scale, 0.0, noise / scale) if scale > 0.0 else Imbalance(float(residual > 0.0), 0.0)
            for residual, noise, scale in (
                (self.at_nodes, self.nodes_round_off, largest),
                (self.on_motions, of_sums, total),
            )
        )
        return at_nodes.joined(Imbalance(0.0, on_motions.force, on_motions.round_off))


def round_off_of(displacement: FloatArray, sensitivity: FloatArray | None) -> float:
    """Return the error of a sum of forces by round-off of displacements.

    Parameters
    ----------
    displacement : (n_nodes, 2) array [m]
    sensitivity : (n_nodes, 2) array or None
        Sum of the magnitudes of all forces that a unit displacement of each node causes; see `CondensedMap`.

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
    inner_force: float = 0.0,
) -> Imbalance:
    """Return resultant force and moment of all forces on a body, relative to the sum of their magnitudes.

    Parameters
    ----------
    points, force : (n_nodes, 2) arrays [m], [N/m]
    balanced : collection of int
        The resultants along x, along y and the moment (0, 1, 2) that must vanish.
    round_off : float [N/m]
        Round-off of a sum of these forces.
    volume_force : (3,) array, optional
        Resultants along x and y, and moment about the origin, of body forces; none by default.
    inner_force : float [N/m]
        Sum of the magnitudes of the boundary forces of body forces and heat, balanced or not.

    Returns
    -------
    Imbalance
        The moment about the mean point, in units of the size of the body.
    """
    inside = np.zeros(3) if volume_force is None else volume_force
    total = float(np.abs(force).sum() + np.abs(inside[:2]).sum()) + inner_force
    if not balanced or total == 0.0:
        return Imbalance(0.0, 0.0)
    centre = points.mean(axis=0)
    arm = points - centre
    moment = float(np.sum(arm[:, 0] * force[:, 1] - arm[:, 1] * force[:, 0]))
    moment += float(inside[2] - centre[0] * inside[1] + centre[1] * inside[0])
    sums = np.append(np.abs(force.sum(axis=0) + inside[:2]), abs(moment) / float(np.abs(arm).max()))
    off = np.where([component in balanced for component in range(3)], sums, 0.0) / total
    return Imbalance(float(off[:2].max()), float(off[2]), round_off / total)
