"""What rigid motions do to a condensed body, exact where elimination leaves round-off.

A body that supports leave free to move resists no rigid motion, its load does on it the work of all given forces, and
what follows the unknowns follows the motion. Elimination keeps that to the round-off of the forces on the whole body. A
contact much smaller than the body, such as a pin in a plate, has short lever arms: there the same round-off would be
forces that turn the body, by far.
"""

from __future__ import annotations

import numpy as np

from bemkit.arrays import FloatArray

_ROUND_OFF = 1e-6
"""What is off by more than this share is no round-off: it stays, for the certificate to tell."""


def resisting_none(stiffness: FloatArray, motions: FloatArray) -> FloatArray:
    """Return a stiffness (n, n) that maps motions (n_motions, n) to no force, and makes no force that works on them."""
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
    if np.abs(missing).max() > _ROUND_OFF * size:
        return load
    return np.asarray(load + np.linalg.lstsq(motions, missing, rcond=None)[0])


def following(response: FloatArray, motions: FloatArray, followed: FloatArray) -> FloatArray:
    """Return a response (k, n) that takes motions (n_motions, n) to (n_motions, k), what they are where it leads."""
    missing = followed - motions @ response.T
    if np.abs(missing).max(initial=0.0) > _ROUND_OFF * np.abs(motions).max():
        return response
    return np.asarray(response + np.linalg.lstsq(motions, missing, rcond=None)[0].T)
