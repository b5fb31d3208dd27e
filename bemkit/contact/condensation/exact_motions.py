"""Stiffness and load that go with rigid motions to the last digit, not only to the round-off of the whole body."""

from __future__ import annotations

import numpy as np

from bemkit.arrays import FloatArray

_ROUND_OFF = 1e-6
"""A larger share is not round-off: it stays, and the certificate measures it."""


def resisting_none(stiffness: FloatArray, motions: FloatArray) -> FloatArray:
    """Return a stiffness (n, n) that maps motions (n_motions, n) to no force, and makes no force that works on them.

    Notes
    -----
    A body that supports leave free to move resists no rigid motion, and its load does on it the work of all given
    forces (`with_work`). Elimination keeps that to the round-off of the forces on the whole body. A contact much
    smaller than the body, such as a pin in a plate, has short lever arms: there the same round-off would be forces that
    turn the body, by far.
    """
    if not len(motions):
        return stiffness
    basis = np.linalg.qr(motions.T)[0]
    forces, works = stiffness @ basis, basis.T @ stiffness
    if max(np.abs(forces).max(), np.abs(works).max()) > _ROUND_OFF * np.abs(stiffness).max():
        return stiffness
    result: FloatArray = stiffness - forces @ basis.T - basis @ (works - (works @ basis) @ basis.T)
    return result


def with_work(load: FloatArray, motions: FloatArray, work: FloatArray, size: float) -> FloatArray:
    """Return a load (n,) that does a given work (n_motions,) on motions (n_motions, n).

    Parameters
    ----------
    load, motions, work : arrays
        The forces that are added are the least ones.
    size : float [N/m]
        Sum of the sizes of all given forces.
    """
    missing = work - motions @ load
    if not len(missing) or np.abs(missing).max() > _ROUND_OFF * size:
        return load
    return np.asarray(load + np.linalg.lstsq(motions, missing, rcond=None)[0])
