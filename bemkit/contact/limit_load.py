"""The largest load that contact tractions can balance, by the static theorem of limit analysis."""

from __future__ import annotations

import numpy as np

from bemkit.arrays import BoolArray, FloatArray
from bemkit.contact.conditions import RigidMotions, as_rows, largest_components
from bemkit.contact.problem import ContactProblem
from bemkit.contact.solvability import contact_forces, friction_envelopes, met, outermost

_WITHOUT_BOUND = 1e6
"""Multiple of all other forces from which on a growing load counts as one that contact holds however large it is."""


def largest_factor(problem: ContactProblem, growing: FloatArray) -> float | None:
    """Return the largest factor of a growing load that contact tractions can balance together with that of a problem.

    Parameters
    ----------
    problem : ContactProblem
        Under the load that is always there.
    growing : (n_motions,) array [N]
        Work of the growing load on each motion of `LinearBody.rigid_motions`.

    Returns
    -------
    float or None
        Infinite if nothing limits it, None if no factor at all does.

    Notes
    -----
    Of all tractions with ``sigma_n <= 0`` and ``|sigma_t| <= c + s |sigma_n|``, c and s as in
    `bemkit.contact.solvability.find_unsolvable_load`, those are sought that balance the largest factor. For Coulomb's
    law that is an upper bound, because a sliding contact does not dilate: states of the incremental law may fail to
    exist below it, none exists above.
    """
    motions = as_rows(problem.body.rigid_motions())
    if not motions.shape[0]:
        return np.inf
    unit = largest_components(motions)
    motions = motions / unit[:, None] if isinstance(motions, np.ndarray) else (motions.T / unit).T.tocsr()
    constant, growing = problem.body.rigid_load() / unit, growing / unit
    size = float(np.abs(growing).max())
    if size == 0.0:
        return np.inf
    forces = problem.body.weights[:, None] * problem.sticking_state.traction
    scale = max(float(np.abs(constant).max()), float(np.abs(forces).sum())) or size
    touches = np.isfinite(problem.gap)
    factors = [
        _largest(motions, constant / scale, growing / size, problem.body.weights * cohesion / scale, slope, touches)
        for cohesion, slope in friction_envelopes(problem)
    ]
    bounded = [scale / size * factor for factor in factors if factor is not None]
    return min(bounded) if len(bounded) == len(factors) else None


def _largest(
    motions: RigidMotions,
    constant: FloatArray,
    growing: FloatArray,
    resistance: FloatArray,
    slope: FloatArray,
    touches: BoolArray,
) -> float | None:
    """Return the factor for one envelope of the friction law; see `largest_factor`.

    As in `find_unsolvable_load` the outermost nodes of each two bodies come first, and others as the mechanism meets
    them: the multipliers of the equations of balance are its velocities.
    """
    takes_part = touches if isinstance(motions, np.ndarray) else outermost(motions, touches)
    while True:
        factor, velocities = _by_programme(motions, constant, growing, resistance, np.where(takes_part, slope, np.nan))
        if velocities is None:  # none at all, or without bound
            if factor is not None or takes_part[touches].all():
                return factor
            takes_part = touches
            continue
        meets = touches & met(motions, velocities, resistance, slope)
        if not np.any(meets & ~takes_part):
            return factor
        takes_part = takes_part | meets


def _by_programme(
    motions: RigidMotions, constant: FloatArray, growing: FloatArray, resistance: FloatArray, slope: FloatArray
) -> tuple[float | None, FloatArray | None]:
    from scipy import sparse
    from scipy.optimize import linprog

    works, bounds = contact_forces(motions, np.where(np.isfinite(slope), resistance, 0.0), slope)
    balance = sparse.hstack([works, sparse.csc_array(growing[:, None])], format="csc")
    cost = np.append(np.zeros(works.shape[1]), -1.0)
    bounds = np.vstack([bounds, [-_WITHOUT_BOUND, _WITHOUT_BOUND]])
    result = linprog(  # type: ignore[call-overload]  # the stubs know no sparse arrays
        cost, A_eq=balance, b_eq=-constant, bounds=bounds, method="highs"
    )
    if result.x is None:
        return None, None
    if result.x[-1] > 0.5 * _WITHOUT_BOUND:
        return np.inf, None
    return float(result.x[-1]), -np.asarray(result.eqlin.marginals, dtype=float)
