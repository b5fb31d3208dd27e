"""Whether the forces on a body are in equilibrium, as far as round-off lets one tell."""

from __future__ import annotations

from collections.abc import Collection

import numpy as np

from bemkit.arrays import FloatArray

FORGIVEN = 1e-6
"""Share of the forces up to which an imbalance may be put down to round-off; beyond, too few digits are left. What is
put down to it is the estimate of `round_off_of`, 1e-12 in all but thin bodies; a strip of 1000 : 1 has an imbalance of
1e-7 and an estimate of 1e-6. More than that no check of the result would let pass."""


def round_off_of(displacement: FloatArray, sensitivity: FloatArray | None) -> float:
    """Return what round-off of displacements may leave in a sum of forces.

    Parameters
    ----------
    displacement : (n_nodes, 2) array [m]
    sensitivity : (n_nodes, 2) array or None
        Sum of the sizes of all forces that a unit displacement of each node causes; see `CondensedMap`.

    Returns
    -------
    float
        Zero if the sensitivity is not known.
    """
    if sensitivity is None:
        return 0.0
    return float(np.finfo(float).eps * np.sum(sensitivity * np.abs(displacement)))


def resultant_imbalance(
    points: FloatArray, force: FloatArray, balanced: Collection[int], round_off: float
) -> tuple[float, float]:
    """Return resultant force and moment of all forces on a body, relative to the sum of their sizes.

    Parameters
    ----------
    points, force : (n_nodes, 2) arrays [m], [N/m]
    balanced : collection of int
        Which of the resultants along x and y and the moment (0, 1, 2) have to vanish.
    round_off : float
        What does not count, up to a share `FORGIVEN` of the forces.

    Returns
    -------
    force, moment : float
        The moment about the mean point, in units of the size of the body; not positive where only round-off is left.
    """
    total = float(np.abs(force).sum())
    if not balanced or total == 0.0:
        return 0.0, 0.0
    arm = points - points.mean(axis=0)
    moment = abs(float(np.sum(arm[:, 0] * force[:, 1] - arm[:, 1] * force[:, 0])))
    sums = np.append(np.abs(force.sum(axis=0)), moment / float(np.abs(arm).max()))
    is_balanced = np.isin(np.arange(3), list(balanced))
    off = np.where(is_balanced, sums - min(round_off, FORGIVEN * total), 0.0) / total
    return float(off[:2].max()), float(off[2])
