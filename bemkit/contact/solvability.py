"""Whether the obstacle can hold the load at all."""

from dataclasses import dataclass, replace

import numpy as np

from bemkit.arrays import FloatArray
from bemkit.contact.problem import ContactProblem

_RELATIVE_WORK = 1e-6
"""Work below this share of the largest force at hand counts as zero: the load is then on the edge of being held, which
linear programming (tolerance 1e-7) cannot decide and the drivers can."""

_FARTHEST = 1e7
"""Travel to an obstacle, in deformations of the body, up to which displacements hold nine digits of the deformation."""


@dataclass(frozen=True, eq=False)
class UnsolvableLoad:
    """A rigid motion along which the load does work that contact cannot take up.

    Parameters
    ----------
    motion : (n_contact, 2) array
        Normal and tangential components of the escape at the contact nodes, scaled to a largest entry of one.
    lift : (n_contact,) array
        How much faster each node leaves the obstacle than sliding at full friction would allow, ``-v_n - s |v_t|``;
        zero everywhere if the body slides, nan where a node can never touch.
    work : float [N]
        Work of the load on this motion, less what friction takes up; positive.
    """

    motion: FloatArray
    lift: FloatArray
    work: float

    @property
    def is_sliding(self) -> bool:
        """Whether the body slides and stays in touch everywhere, so that only friction could have held it."""
        touches = ~np.isnan(self.lift)
        slip = float(np.abs(self.motion[touches, 1]).max(initial=0.0))
        return slip > 1e-6 and float(self.lift[touches].max()) <= 1e-6

    @property
    def description(self) -> str:
        """One sentence that names the escape."""
        if np.isnan(self.lift).all():
            how = "moves the body where no obstacle can meet it"
        elif not self.is_sliding:
            how = "pushes" if np.ptp(self.motion[:, 0]) < 1e-6 else "tips"
            how += " the body away from the obstacle"
        else:
            how = "slides the body along the obstacle against all the friction there is"
        return f"the load {how} (work {self.work:.3g} on that rigid motion)"


def find_unsolvable_load(problem: ContactProblem) -> UnsolvableLoad | None:
    """Return a rigid motion on which the load cannot be balanced, or None if contact tractions may balance it.

    Notes
    -----
    A motion v escapes if it nowhere presses into the obstacle harder than friction can wedge, ``v_n + s |v_t| <= 0``,
    and the load does more work on it than friction present without pressure takes up, ``L(v) > sum w c |v_t|``. By
    linear duality no escape exists exactly if tractions with ``sigma_n <= 0`` and ``|sigma_t| <= c + s |sigma_n|``
    balance the load. c and s envelop the law from above, and a cap is tried as a second pair (c = cap, s = 0), so the
    test never condemns a load that can be held; what it misses the driver's status still reports.
    """
    motions = problem.body.rigid_motions()
    if not len(motions):
        return None
    unit = np.abs(motions).reshape(len(motions), -1).max(axis=1)
    motions, load = motions / unit[:, None, None], problem.body.rigid_load() / unit
    forces = problem.body.weights[:, None] * problem.sticking_state.traction
    force_scale = max(float(np.abs(load).max()), float(np.abs(forces).sum()))
    if force_scale == 0.0:
        return None
    touches = np.isfinite(problem.gap)
    best = None
    for cohesion, slope in _friction_envelopes(problem):
        resistance = np.where(touches, problem.body.weights * cohesion, 0.0) / force_scale
        coefficients = _largest_escape(motions, load / force_scale, resistance, np.where(touches, slope, np.nan))
        motion = np.tensordot(coefficients, motions, axes=1)
        work = float(load @ coefficients) - force_scale * float(resistance @ np.abs(motion[:, 1]))
        if work > _RELATIVE_WORK * force_scale:
            size = float(np.abs(motion).max())
            motion, work = motion / size, work / size
            lift = np.where(touches, -motion[:, 0] - slope * np.abs(motion[:, 1]), np.nan)
            if best is None or work > best.work:
                best = UnsolvableLoad(motion, lift, work)
    return best


def find_long_travel(problem: ContactProblem) -> float | None:
    """Return how far the load carries the body before any obstacle can hold it, if that hides how the body deforms.

    Parameters
    ----------
    problem : ContactProblem
        With a load that the obstacle can hold; see `find_unsolvable_load`.

    Returns
    -------
    float or None
        Smallest gap that must close, in displacements that the load of the tied body causes at one node; None if it
        is small enough for displacements to hold both the travel and the deformation.
    """
    deformation = float(np.abs(problem.sticking_state.traction).max()) / problem.body.stiffness_scale
    is_far = problem.gap > _FARTHEST * deformation
    if not is_far.any() or find_unsolvable_load(replace(problem, gap=np.where(is_far, np.inf, problem.gap))) is None:
        return None
    return float(problem.gap[is_far].min()) / deformation


def _friction_envelopes(problem: ContactProblem) -> list[tuple[FloatArray, FloatArray]]:
    """Return pairs (c, s) of (n_contact,) arrays with ``bound <= c + s |sigma_n|`` for the pressures tried."""
    none = np.zeros(problem.n_contact)
    pressure = float(np.abs(problem.sticking_state.traction).max()) or 1.0
    cohesion = problem.cohesion
    slopes = [-problem.friction_slope(none)]
    for factor in 10.0 ** np.arange(-6, 7):
        slopes.append((problem.friction_bound(none - factor * pressure) - cohesion) / (factor * pressure))
    slope = np.maximum(np.max(slopes, axis=0), 0.0)
    cap = problem.friction_bound(none - 1e12 * pressure)
    is_capped = bool(np.any(cap < 0.5 * (cohesion + 1e12 * pressure * slope)))
    return [(cohesion, slope), *([(cap, none)] if is_capped else [])]


def _largest_escape(motions: FloatArray, load: FloatArray, resistance: FloatArray, slope: FloatArray) -> FloatArray:
    """Return (n_motions,) coefficients of the escape on which the load does most work, zeros if none.

    Their absolute values add up to one at most, which favours escapes along a single motion: among several, the
    simplest to name. `slope` is nan at nodes that never touch.
    """
    touches = np.isfinite(slope)
    normal, tangential = motions[:, touches, 0].T, motions[:, touches, 1].T  # (n_touching, n_motions)
    slope, resistance = slope[touches], resistance[touches]
    if len(motions) == 1:
        for sign in np.sign(load):
            if np.all(sign * normal[:, 0] + slope * np.abs(tangential[:, 0]) <= 1e-9):
                return np.array([sign])
        return np.zeros(1)

    from scipy import sparse
    from scipy.optimize import linprog

    # Unknowns: coefficients c, a >= |c|, and e >= |v_t| where something resists. Maximise load c - resistance e.
    n_motions, resists = len(motions), resistance > 0.0
    n_resisting = int(np.count_nonzero(resists))
    wedged = slope[~resists, None] * tangential[~resists]
    own = np.eye(n_motions)
    on_motions = [normal[resists], tangential[resists], -tangential[resists]]
    on_motions += [normal[~resists] + wedged, normal[~resists] - wedged, own, -own, np.zeros((1, n_motions))]
    on_sizes = np.zeros((3 * n_resisting + 2 * len(wedged), n_motions))
    unit = sparse.eye_array(n_resisting)
    on_slips = sparse.vstack([sparse.diags_array(slope[resists]), -unit, -unit])
    n_others = 2 * len(wedged) + 2 * n_motions + 1
    conditions = sparse.hstack(
        [
            sparse.csr_array(np.concatenate(on_motions)),
            sparse.csr_array(np.concatenate([on_sizes, -own, -own, np.ones((1, n_motions))])),
            sparse.vstack([on_slips, sparse.csr_array((n_others, n_resisting))]),
        ],
        format="csr",
    )
    limits = np.zeros(conditions.shape[0])
    limits[-1] = 1.0
    result = linprog(
        np.concatenate([-load, np.zeros(n_motions), resistance[resists]]),
        A_ub=conditions,
        b_ub=limits,
        bounds=[(None, None)] * n_motions + [(0.0, None)] * (n_motions + n_resisting),
        method="highs-ipm" if n_resisting else "highs",  # the simplex method takes a pivot for each node that resists
    )
    if result.x is None:  # zero is always admissible, so this is the solver's failure: do not condemn the load
        return np.zeros(n_motions)
    return np.asarray(result.x[:n_motions], dtype=float)
