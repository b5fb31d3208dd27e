"""Limit analysis: the largest multiple of a load that the contact forces of rigid bodies can balance."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial

import numpy as np

from bemkit.arrays import FloatArray
from bemkit.contact.solvability import contact_forces, linear_programme, with_violated_nodes
from bemkit.errors import InputError
from bemkit.operators.rigid_modes import RigidMotions, of_unit_size

WITHOUT_BOUND = 1e6
"""Multiple of all other forces above which a load counts as unbounded."""

_UNBOUNDED = 3
"""Status of a linear programme of `scipy.optimize.linprog`."""


def largest_factor(
    motions: RigidMotions,
    constant: FloatArray,
    growing: FloatArray,
    envelopes: Sequence[tuple[FloatArray, FloatArray]],
) -> float | None:
    """Return the largest factor of a growing load that contact forces balance together with a constant load.

    Parameters
    ----------
    motions : (n_motions, 2 n) array or sparse array
        Rigid motions that no support resists: relative normal and tangential velocities at n points.
    constant, growing : (n_motions,) arrays [N]
        Work of both loads on each motion.
    envelopes : sequence of (n,) arrays [N], (n,) arrays [-]
        Pairs of cohesion and friction coefficient, see `bemkit.contact.solvability.envelopes_of`. The factor is the
        smallest one over all pairs.

    Returns
    -------
    float or None
        Infinite if there is no limit, None if no factor balances the loads.

    Notes
    -----
    By the static theorem of limit analysis the factor is the largest one for which forces at the points with ``p_n <=
    0`` and ``|p_t| <= c + s |p_n|`` balance the loads [FerrisTinLoi2001]. For Coulomb's law without dilatancy it is an
    upper bound: the incremental law has no states above it, and may have none below it.
    """
    if not motions.shape[0]:
        return np.inf
    motions, unit = of_unit_size(motions)
    constant, growing = constant / unit, growing / unit
    load_scale = float(np.abs(growing).max())
    if load_scale == 0.0:
        return np.inf
    scale = float(np.abs(constant).max()) or load_scale
    factors = []
    for cohesion, slope in envelopes:
        programme = partial(_programme, motions, constant / scale, growing / load_scale, cohesion / scale)
        factors.append(with_violated_nodes(motions, cohesion / scale, slope, programme))
    bounded = [scale / load_scale * factor for factor in factors if factor is not None]
    return min(bounded) if len(bounded) == len(factors) else None


def _programme(
    motions: RigidMotions, constant: FloatArray, growing: FloatArray, resistance: FloatArray, slope: FloatArray
) -> tuple[float | None, FloatArray | None]:
    """Return the factor with forces at the points whose slope is a number, and the velocities of the collapse."""
    from scipy import sparse

    works, bounds = contact_forces(motions, resistance, slope)
    balance = sparse.hstack([works, sparse.csc_array(growing[:, None])], format="csc")
    cost = np.append(np.zeros(works.shape[1]), -1.0)
    bounds = np.vstack([bounds, [-WITHOUT_BOUND, WITHOUT_BOUND]])
    result = linear_programme(cost, balance, -constant, bounds)
    if result.x is None:
        return None, None
    if result.x[-1] > 0.5 * WITHOUT_BOUND:
        return np.inf, None
    return float(result.x[-1]), -np.asarray(result.eqlin.marginals, dtype=float)


def least_force(
    motions: RigidMotions,
    load: FloatArray,
    direction: FloatArray,
    cohesion: FloatArray,
    slope: FloatArray,
) -> tuple[FloatArray, FloatArray] | None:
    """Return the contact forces in equilibrium with a load that minimise a given combination.

    Parameters
    ----------
    motions : (n_motions, 2 n) sparse array
        As for `largest_factor`.
    load : (n_motions,) array [N]
    direction : (2 n,) array [-]
        The combination of normal and tangential forces, such as a component of the reaction of a support.
    cohesion, slope : (n,) arrays [N], [-]

    Returns
    -------
    forces : (n, 2) array [N]
        Normal, negative where pressed, and tangential.
    velocities : (n_motions,) array
        Motions under a unit displacement of the support against the combination; one of several if the minimum is not
        unique.
    None
        If no forces balance the load.

    Raises
    ------
    InputError
        If the combination has no minimum.
    """
    from scipy import sparse

    motions, unit = of_unit_size(motions)
    scale = float(np.abs(load / unit).max()) or 1.0
    simple, bounds = contact_forces(sparse.eye_array(2 * slope.size, format="csr"), cohesion / scale, slope)
    result = linear_programme(direction @ simple, motions @ simple, -load / unit / scale, bounds)
    if result.status == _UNBOUNDED:
        raise InputError(
            "friction wedges the bodies, so that the force is unbounded: choose another contact or direction"
        )
    if result.x is None:
        return None
    forces = scale * (simple @ result.x).reshape(-1, 2)
    return forces, -np.asarray(result.eqlin.marginals, dtype=float) / unit
