"""Whether the forces on a body are in equilibrium, up to round-off."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass

import numpy as np

from bemkit.arrays import FloatArray

ROUND_OFF_LIMIT = 1e-6
"""Share of the forces up to which an imbalance may be put down to round-off; beyond, too few digits are left. The
estimate is 1e-12 in all but thin or nearly incompressible bodies; a strip of 1000 : 1 has an imbalance of 1e-7 and an
estimate of 1e-6. More than that no check of the result would let pass."""


NOISE_FACTOR = 64.0
"""Forces below this many times the round-off of their terms are none: sums of hundreds of terms leave some eps of their
sizes, and loads that strain a body by less are lost in them."""


@dataclass(frozen=True)
class Imbalance:
    """How far forces are from equilibrium, relative to their sizes.

    Parameters
    ----------
    force, moment : float
        As measured.
    round_off : float
        How much of that may be round-off. It is cut off at `ROUND_OFF_LIMIT`.
    """

    force: float
    moment: float
    round_off: float = 0.0

    def __post_init__(self) -> None:
        object.__setattr__(self, "round_off", min(self.round_off, ROUND_OFF_LIMIT))

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


@dataclass(frozen=True, eq=False)
class Unbalanced:
    """Residual of the balance of forces of a contact state [N/m].

    Parameters
    ----------
    contact : (n,) array
        Forces of the obstacle at the nodes.
    at_nodes, on_motions : float
        Largest force that is missing at a node, and largest work of all forces on a rigid motion of unit size.
    nodes_round_off, motions_round_off : float
        How much of that may be round-off.
    terms : float
        Largest of the terms whose differences the forces are: those of the stiffness on each displacement.
    """

    contact: FloatArray
    at_nodes: float
    on_motions: float
    nodes_round_off: float
    motions_round_off: float
    terms: float

    def relative_to(self, given: FloatArray, reaction: float = 0.0, round_off: float = 0.0) -> Imbalance:
        """Return it relative to the forces at hand.

        Parameters
        ----------
        given : array [N/m]
            What else acts on the nodes of the body, in directions that no support holds.
        reaction : float [N/m]
            Largest force of a support; these do no work on the motions that are free.
        round_off : float [N/m]
            What may be left of a sum of forces on the whole body.

        Returns
        -------
        Imbalance
            What is missing at a node by the largest force, the work by the sum of the forces that could do any. If
            nothing is given, and no other force is more than round-off, the body has only been moved: then by the
            terms. They do not excuse what is missing of a load, or a body on its way to infinity would balance any. It
            is 1 where something is missing and there is nothing to measure it by.
        """
        loads = float(np.abs(given).sum())
        largest = max(float(np.abs(self.contact).max()), float(np.abs(given).max(initial=0.0)), reaction)
        total = loads + float(np.abs(self.contact).sum())
        of_sums = max(self.motions_round_off, round_off)
        terms = max(self.terms, round_off / np.finfo(float).eps)
        noise = NOISE_FACTOR * of_sums if loads == 0.0 else 0.0
        largest, total = (max(size, terms) if size <= noise else size for size in (largest, total))
        at_nodes, on_motions = (
            Imbalance(missing / size, 0.0, left / size) if size > 0.0 else Imbalance(float(missing > 0.0), 0.0)
            for missing, left, size in (
                (self.at_nodes, self.nodes_round_off, largest),
                (self.on_motions, of_sums, total),
            )
        )
        return at_nodes.joined(Imbalance(0.0, on_motions.force, on_motions.round_off))


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
    inner_force: float = 0.0,
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
    inner_force : float [N/m]
        Sum of the magnitudes of the forces that body forces and heat exert on the boundary, balanced or not.

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
    off = np.where([number in balanced for number in range(3)], sums, 0.0) / total
    return Imbalance(float(off[:2].max()), float(off[2]), round_off / total)
