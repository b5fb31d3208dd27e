"""Decides whether contact tractions can balance the load."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, TypeAlias, TypeVar

import numpy as np

from bemkit.arrays import BoolArray, FloatArray
from bemkit.contact.body import ContactState
from bemkit.contact.problem import ContactProblem
from bemkit.operators.rigid_modes import RigidMotions, as_rows, largest_components, of_unit_size

if TYPE_CHECKING:
    from scipy.sparse import csc_array, csr_array

Result = TypeVar("Result")
Inequalities: TypeAlias = "tuple[csc_array | csr_array | None, FloatArray | None]"
"""Matrix and largest values of the inequalities of a linear programme."""


_RELATIVE_WORK = 1e-6
"""Smallest work relative to the largest force. For smaller work, linear programming (tolerance 1e-7) cannot decide
whether contact balances the load; the solvers can."""

_PLAIN = 1e-3
"""Work relative to the forces of the sticking state that errors of supports and integrals cannot cause. These forces
may be round-off below this multiple of those of a body that strains as much as it moves."""

_FARTHEST = 1e7
"""Largest rigid motion to an obstacle, relative to the deformation, with nine digits of the deformation."""

_MANY_MOTIONS = 60
"""Number of motions up to which the largest residual of equilibrium is minimised, with one condition for each motion;
for more motions the sum of residuals is minimised."""

_PRESSES = 1e-9
"""Smallest velocity into an obstacle, relative to the largest one, that is not round-off."""

_MEETS = 1e-7
"""The same for motions from linear programming, which has a larger tolerance."""


@dataclass(frozen=True, eq=False)
class UnsolvableLoad:
    """A rigid motion on which the load does work that contact cannot balance.

    Parameters
    ----------
    motion : (n_contact, 2) array
        Normal and tangential components of the mechanism at the contact nodes, scaled to a largest entry of one.
    lift : (n_contact,) array
        Separation velocity beyond that of sliding at full friction, ``-v_n - s |v_t|``; zero at all nodes if the body
        slides, nan at nodes that can never touch.
    work : float [N]
        Work of the load on this motion minus that of friction; positive.
    who, where : str
        The body that moves, and the one that it touches, for messages.
    """

    motion: FloatArray
    lift: FloatArray
    work: float
    who: str = "the body"
    where: str = "the obstacle"

    @property
    def is_sliding(self) -> bool:
        """Whether the body slides without separation, so that only friction could hold it."""
        touches = ~np.isnan(self.lift)
        slip = float(np.abs(self.motion[touches, 1]).max(initial=0.0))
        return slip > 1e-6 and float(self.lift[touches].max()) <= 1e-6

    @property
    def description(self) -> str:
        """A sentence that describes the mechanism."""
        if np.isnan(self.lift).all():
            how = f"moves {self.who} where no obstacle stops it"
        elif not self.is_sliding:
            how = "pushes" if np.ptp(self.motion[~np.isnan(self.lift), 0]) < 1e-6 else "tips"
            how += f" {self.who} away from {self.where}"
        else:
            how = f"slides {self.who} along {self.where} against full friction"
        return f"the load {how} (work {self.work:.3g} on that rigid motion)"


def find_unsolvable_load(problem: ContactProblem, state: ContactState | None = None) -> UnsolvableLoad | None:
    """Return a rigid motion on which the load cannot be balanced, or None if contact tractions may balance it.

    Parameters
    ----------
    problem : ContactProblem
    state : ContactState, optional
        State whose pressures give the friction bounds of pressed nodes. By default pressures are not limited.

    Raises
    ------
    LawError
        If the friction law fails.

    Notes
    -----
    A motion v is a mechanism if ``v_n + s |v_t| <= 0`` at all nodes, and if the load does more work on it than
    cohesion, ``L(v) > sum w c |v_t|``. By linear duality, a mechanism exists if and only if no tractions with ``sigma_n
    <= 0`` and ``|sigma_t| <= c + s |sigma_n|`` balance the load. c and s bound the law from above, and a cap gives a
    second pair (c = cap, s = 0), so the test never refuses a load that contact can balance. Unsolvable loads that it
    does not find end in a status of the solver.
    """
    motions = as_rows(problem.body.rigid_motions())
    if not motions.shape[0]:
        return None
    motions, unit = of_unit_size(motions)
    load, force_scale = _rigid_load(problem, unit)
    if force_scale == 0.0:
        return None
    if state is None:
        touches, pairs = np.isfinite(problem.gap), friction_envelopes(problem)
    else:
        pressure = state.traction[:, 0]
        touches, pairs = pressure < 0.0, [(problem.friction_bound(pressure), np.zeros(problem.n_contact))]
    best = None
    for cohesion, slope in pairs:
        resistance = np.where(touches, problem.body.weights * cohesion, 0.0) / force_scale
        coefficients = _largest_mechanism(motions, load / force_scale, resistance, np.where(touches, slope, np.nan))
        motion = np.asarray(coefficients @ motions).reshape(-1, 2)
        work = float(load @ coefficients) - force_scale * float(resistance @ np.abs(motion[:, 1]))
        if work > _RELATIVE_WORK * force_scale:
            largest = float(np.abs(motion).max())
            motion, work = motion / largest, work / largest
            lift = np.where(touches, -motion[:, 0] - slope * np.abs(motion[:, 1]), np.nan)
            if best is None or work > best.work:
                moved = coefficients / unit
                who, where = problem.body.moving_bodies(moved), problem.body.partners_of(moved)
                best = UnsolvableLoad(motion, lift, work, who, where)
    return best


def needs_contact(problem: ContactProblem) -> bool:
    """Whether the load does more work on a rigid motion than round-off, so that only contact can balance it.

    It takes no response. False does not imply that the load is balanced.
    """
    motions = as_rows(problem.body.rigid_motions())
    if not motions.shape[0]:
        return False
    load, force_scale = _rigid_load(problem, largest_components(motions))
    # forces of a body that strains as much as it moves
    carried = problem.modulus * float(np.abs(problem.sticking_state.displacement).max())
    return bool(np.abs(load).max() > _PLAIN * max(force_scale, _PLAIN * carried))


def _rigid_load(problem: ContactProblem, unit: FloatArray) -> tuple[FloatArray, float]:
    """Return the work (n_motions,) of the load on rigid motions of unit size, and a scale of force."""
    load = problem.body.rigid_load() / unit
    forces = problem.body.weights[:, None] * problem.sticking_state.traction
    return load, max(float(np.abs(load).max()), float(np.abs(forces).sum()))


def find_long_motion(problem: ContactProblem) -> float | None:
    """Return the relative rigid motion to an obstacle, if it is too long to resolve the deformation.

    Parameters
    ----------
    problem : ContactProblem
        Problem with a load that contact can balance; see `find_unsolvable_load`.

    Returns
    -------
    float or None
        Smallest gap that must close, relative to the displacement of one node by the tractions of the sticking state;
        None if displacements have enough digits for rigid motion and deformation.
    """
    deformation = float(np.abs(problem.sticking_state.traction).max()) / problem.body.stiffness_scale
    is_far = problem.gap > _FARTHEST * deformation
    if not is_far.any() or find_unsolvable_load(replace(problem, gap=np.where(is_far, np.inf, problem.gap))) is None:
        return None
    return float(problem.gap[is_far].min()) / deformation


def friction_envelopes(problem: ContactProblem) -> list[tuple[FloatArray, FloatArray]]:
    """Return pairs (c, s) of (n_contact,) arrays with ``bound <= c + s |sigma_n|``; see `envelopes_of`."""
    pressure = float(np.abs(problem.sticking_state.traction).max())
    slope = problem.friction_slope(np.zeros(problem.n_contact))
    return envelopes_of(problem.friction_bound, -slope, pressure or 1.0)


def envelopes_of(
    bound: Callable[[FloatArray], FloatArray], slope: FloatArray, pressure: float
) -> list[tuple[FloatArray, FloatArray]]:
    """Return pairs (c, s) of (n,) arrays with ``bound <= c + s |sigma_n|`` at sampled pressures.

    Parameters
    ----------
    bound : callable
        (n,) normal tractions [Pa] -> (n,) bounds [Pa].
    slope : (n,) array [-]
        Slope of the bound at zero pressure.
    pressure : float [Pa]
        Typical pressure.
    """
    none = np.zeros(slope.size)
    cohesion, slopes = bound(none), [slope]
    for factor in 10.0 ** np.arange(-6, 7):
        slopes.append((bound(none - factor * pressure) - cohesion) / (factor * pressure))
    steepest = np.maximum(np.max(slopes, axis=0), 0.0)
    cap = bound(none - 1e12 * pressure)
    is_capped = bool(np.any(cap < 0.5 * (cohesion + 1e12 * pressure * steepest)))
    return [(cohesion, steepest), *([(cap, none)] if is_capped else [])]


def _largest_mechanism(
    motions: RigidMotions, load: FloatArray, resistance: FloatArray, slope: FloatArray
) -> FloatArray:
    """Return the coefficients (n_motions,) of the mechanism on which the load does most work; zeros if there is none.

    The sum of their absolute values is at most one, which favours mechanisms of a single motion. `slope` is nan at
    nodes that never touch.

    Notes
    -----
    The dual problem is solved: find contact forces p within the friction cones with the smallest residual ``r = M p +
    load``, with the work M of unit forces on the motions. The multipliers of these equations are the mechanism. The
    norm of r is its largest component, so that the absolute values of the multipliers add up to one; with many motions
    it is the sum of components, so that no multiplier exceeds one. Forces are combinations of the edges of the friction
    cones and of cohesive tangential forces. So all conditions on p are bounds, and M is sparse.
    """
    touches = np.isfinite(slope)
    if motions.shape[0] == 1 and isinstance(motions, np.ndarray):
        normal, tangential = motions.reshape(-1, 2)[touches].T
        for sign in np.sign(load):
            if np.all(sign * normal + slope[touches] * np.abs(tangential) <= _PRESSES):
                return np.array([sign])
        return np.zeros(1)

    def mechanism(slope: FloatArray) -> tuple[FloatArray, FloatArray]:
        coefficients = _mechanism_of(motions, load, resistance, slope)
        return coefficients, coefficients

    return with_violated_nodes(motions, resistance, slope, mechanism)


def with_violated_nodes(
    motions: RigidMotions,
    resistance: FloatArray,
    slope: FloatArray,
    programme: Callable[[FloatArray], tuple[Result, FloatArray | None]],
) -> Result:
    """Solve a linear programme of contact forces whose multipliers are a mechanism, adding violated nodes.

    Parameters
    ----------
    motions : RigidMotions
    resistance, slope : (n_contact,) arrays
        See `contact_forces`; the slope is nan at nodes that never touch.
    programme : callable
        Slopes (n_contact,), nan at excluded nodes -> result and velocities (n_motions,) of the mechanism, or None if
        there is no mechanism.

    Notes
    -----
    The extreme nodes of a contact nearly always suffice. Other nodes are added if the mechanism presses them, and all
    of them if there is no mechanism.
    """
    touches = np.isfinite(slope)
    takes_part = touches if isinstance(motions, np.ndarray) else extreme_nodes(motions, touches)
    while True:
        result, velocities = programme(np.where(takes_part, slope, np.nan))
        joins = touches & ~takes_part
        if velocities is not None and joins.any():
            joins &= violated(motions, velocities, resistance, np.where(touches, slope, 0.0))
        if not joins.any():
            return result
        takes_part = takes_part | joins


def violated(motions: RigidMotions, velocities: FloatArray, resistance: FloatArray, slope: FloatArray) -> BoolArray:
    """Return a mask (n_contact,) of nodes that a motion presses into the obstacle or that resist it by cohesion."""
    motion = np.asarray(velocities @ motions).reshape(-1, 2)
    is_pressed = motion[:, 0] + slope * np.abs(motion[:, 1]) > _MEETS * np.abs(motion).max()
    return np.asarray(is_pressed | ((resistance > 0.0) & (motion[:, 1] != 0.0)))


def extreme_nodes(motions: csr_array, touches: BoolArray) -> BoolArray:
    """Return a mask (n_contact,) of the first and last node of each contact between the same motions."""
    nodes = np.flatnonzero(touches)
    works = (abs(motions.T)).tocsr()
    merged = works[2 * nodes] + works[2 * nodes + 1]
    merged.sort_indices()
    has_motions = merged.indptr[1:] > merged.indptr[:-1]
    nodes, begins, ends = nodes[has_motions], merged.indptr[:-1][has_motions], merged.indptr[1:][has_motions]
    pairs = np.stack([merged.indices[begins], merged.indices[ends - 1]], axis=1)
    chosen = np.zeros(touches.size, bool)
    for order in (slice(None), slice(None, None, -1)):
        chosen[nodes[order][np.unique(pairs[order], axis=0, return_index=True)[1]]] = True
    return chosen


def _mechanism_of(motions: RigidMotions, load: FloatArray, resistance: FloatArray, slope: FloatArray) -> FloatArray:
    """Return the coefficients of `_largest_mechanism` with forces at nodes whose slope is a number."""
    from scipy import sparse

    n_motions, (works, bounds) = motions.shape[0], contact_forces(motions, resistance, slope)
    n_forces, unit = works.shape[1], sparse.eye_array(n_motions)
    balance = sparse.hstack([works, unit, -unit], format="csc")
    limits = np.vstack([bounds, np.tile([0.0, np.inf], (2 * n_motions, 1))])
    cost = np.append(np.zeros(n_forces), np.ones(2 * n_motions))
    below: Inequalities = (None, None)
    if n_motions <= _MANY_MOTIONS:
        balance = sparse.hstack([balance, sparse.csc_array((n_motions, 1))])
        largest = sparse.csr_array(np.full((n_motions, 1), -1.0))
        parts = [sparse.csr_array((n_motions, n_forces)), unit, unit, largest]
        below = sparse.hstack(parts, format="csr"), np.zeros(n_motions)
        limits, cost = np.vstack([limits, [0.0, np.inf]]), np.append(np.zeros_like(cost), 1.0)
    result = linear_programme(cost, balance, -load, limits, below)
    if result.x is None:  # p = 0 is feasible, so the solver has failed: do not refuse the load
        return np.zeros(n_motions)
    return -np.asarray(result.eqlin.marginals, dtype=float)


def linear_programme(
    cost: FloatArray, balance: Any, right: FloatArray, limits: FloatArray, below: Inequalities = (None, None)
) -> Any:
    """Return the result of a linear programme with equations, limits (n, 2) and optional inequalities."""
    from scipy.optimize import linprog

    return linprog(  # type: ignore[call-overload]  # the stubs know no sparse arrays
        cost, A_ub=below[0], b_ub=below[1], A_eq=balance, b_eq=right, bounds=limits, method="highs"
    )


def contact_forces(motions: RigidMotions, resistance: FloatArray, slope: FloatArray) -> tuple[csc_array, FloatArray]:
    """Return basic forces whose combinations are the admissible contact forces at nodes whose slope is a number.

    Parameters
    ----------
    motions : RigidMotions
    resistance : (n_contact,) array [N]
        Cohesion: friction without pressure.
    slope : (n_contact,) array [-]
        Friction coefficient.

    Returns
    -------
    works : (n_motions, n_forces) sparse array
        Work of each basic force on each motion: forces on both edges of the friction cones, then cohesive tangential
        forces.
    bounds : (n_forces, 2) array
        Smallest and largest factor of each.
    """
    from scipy import sparse

    touches = np.isfinite(slope)
    resists = touches & (resistance > 0.0)
    by_component = sparse.csc_array(motions)
    normal, tangential = by_component[:, 2 * np.flatnonzero(touches)], by_component[:, 2 * np.flatnonzero(touches) + 1]
    wedged = tangential @ sparse.diags_array(slope[touches])
    held = by_component[:, 2 * np.flatnonzero(resists) + 1]
    works = sparse.hstack([wedged - normal, -wedged - normal, held], format="csc")
    bounds = np.full((works.shape[1], 2), [0.0, np.inf])
    bounds[works.shape[1] - held.shape[1] :] = resistance[resists, None] * [-1.0, 1.0]
    return works, bounds
