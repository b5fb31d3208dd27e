"""Whether contact tractions can balance the load."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, TypeVar

import numpy as np

from bemkit.arrays import BoolArray, FloatArray
from bemkit.contact.conditions import RigidMotions, as_rows, largest_components, scaled_motions
from bemkit.contact.problem import ContactProblem, ContactState

if TYPE_CHECKING:
    from scipy.sparse import csc_array, csr_array

Result = TypeVar("Result")


_RELATIVE_WORK = 1e-6
"""Work below this share of the largest force counts as zero. Linear programming (tolerance 1e-7) cannot decide whether
contact holds such a load; the solvers can."""

_PLAIN = 1e-3
"""Work, relative to the forces of the sticking state, that errors of supports and integrals cannot cause; and size of
these forces, relative to those of a body strained by as much as it moves, below which they may be round-off."""

_FARTHEST = 1e7
"""Travel to an obstacle, in deformations of the body, up to which displacements hold nine digits of the deformation."""

_MANY_MOTIONS = 60
"""Largest number of motions for which the largest residual of the balance is minimised, with a condition for each. Of
more motions the sum of all residuals is."""

_PRESSES = 1e-9
"""Speed into an obstacle, relative to the largest speed of the motion, above which it is not round-off."""

_MEETS = 1e-7
"""The same for motions that are found by linear programming, whose tolerance is larger."""


@dataclass(frozen=True, eq=False)
class UnsolvableLoad:
    """A rigid motion along which the load does work that contact cannot take up.

    Parameters
    ----------
    motion : (n_contact, 2) array
        Normal and tangential components of the mechanism at the contact nodes, scaled to a largest entry of one.
    lift : (n_contact,) array
        How much faster each node leaves the obstacle than sliding at full friction would allow, ``-v_n - s |v_t|``;
        zero everywhere if the body slides, nan where a node can never touch.
    work : float [N]
        Work of the load on this motion, less what friction takes up; positive.
    who, where : str
        The body that moves, and the one that it touches, in words for messages.
    """

    motion: FloatArray
    lift: FloatArray
    work: float
    who: str = "the body"
    where: str = "the obstacle"

    @property
    def is_sliding(self) -> bool:
        """Whether the body slides and stays in touch everywhere, so that only friction could have held it."""
        touches = ~np.isnan(self.lift)
        slip = float(np.abs(self.motion[touches, 1]).max(initial=0.0))
        return slip > 1e-6 and float(self.lift[touches].max()) <= 1e-6

    @property
    def description(self) -> str:
        """One sentence that names the mechanism."""
        if np.isnan(self.lift).all():
            how = f"moves {self.who} where no obstacle can meet it"
        elif not self.is_sliding:
            how = "pushes" if np.ptp(self.motion[~np.isnan(self.lift), 0]) < 1e-6 else "tips"
            how += f" {self.who} away from {self.where}"
        else:
            how = f"slides {self.who} along {self.where} against all the friction there is"
        return f"the load {how} (work {self.work:.3g} on that rigid motion)"


def find_unsolvable_load(problem: ContactProblem, state: ContactState | None = None) -> UnsolvableLoad | None:
    """Return a rigid motion on which the load cannot be balanced, or None if contact tractions may balance it.

    Parameters
    ----------
    problem : ContactProblem
    state : ContactState, optional
        Whose pressures bound the friction, at pressed nodes only. By default they may grow without bound.

    Raises
    ------
    LawError
        If the friction law fails.

    Notes
    -----
    A motion v is a mechanism if it nowhere presses into the obstacle harder than friction can wedge,
    ``v_n + s |v_t| <= 0``, and the load does more work on it than cohesion, ``L(v) > sum w c |v_t|``. By linear
    duality no mechanism exists exactly if tractions with ``sigma_n <= 0`` and ``|sigma_t| <= c + s |sigma_n|`` balance
    the load. c and s envelop the law from above, and a cap is tried as a second pair (c = cap, s = 0), so the
    test never refuses a load that can be held. A load that it misses is left to the status of the solver.
    """
    motions = as_rows(problem.body.rigid_motions())
    if not motions.shape[0]:
        return None
    unit = largest_components(motions)
    load, force_scale = _rigid_load(problem, unit)
    motions = scaled_motions(motions, unit)
    if force_scale == 0.0:
        return None
    if state is None:
        touches, pairs = np.isfinite(problem.gap), friction_envelopes(problem)
    else:
        pressure = state.traction[:, 0]
        touches, pairs = pressure < 0.0, [(problem.friction_bound(pressure), np.zeros(problem.n_contact))]
    if motions.shape[0] == 1 and isinstance(motions, np.ndarray) and _presses(motions, load, touches):
        return None
    best = None
    for cohesion, slope in pairs:
        resistance = np.where(touches, problem.body.weights * cohesion, 0.0) / force_scale
        coefficients = _largest_mechanism(motions, load / force_scale, resistance, np.where(touches, slope, np.nan))
        motion = np.asarray(coefficients @ motions).reshape(-1, 2)
        work = float(load @ coefficients) - force_scale * float(resistance @ np.abs(motion[:, 1]))
        if work > _RELATIVE_WORK * force_scale:
            size = float(np.abs(motion).max())
            motion, work = motion / size, work / size
            lift = np.where(touches, -motion[:, 0] - slope * np.abs(motion[:, 1]), np.nan)
            if best is None or work > best.work:
                moved = coefficients / unit
                who, where = problem.body.moving_bodies(moved), problem.body.partners_of(moved)
                best = UnsolvableLoad(motion, lift, work, who, where)
    return best


def _presses(motion: FloatArray, load: FloatArray, touches: BoolArray) -> bool:
    """Whether the only motion (1, 2 n_contact) presses into the obstacle where it follows the load (1,)."""
    return bool(np.any(np.sign(load) * motion[0, 0::2][touches] > _PRESSES))


def needs_contact(problem: ContactProblem) -> bool:
    """Whether the load does work on a rigid motion, far more than round-off could: then the body needs contact.

    No response is computed for it. False does not say that the load is balanced.
    """
    motions = as_rows(problem.body.rigid_motions())
    if not motions.shape[0]:
        return False
    load, force_scale = _rigid_load(problem, largest_components(motions))
    # forces of a body strained by as much as it moves
    carried = problem.modulus * float(np.abs(problem.sticking_state.displacement).max())
    return bool(np.abs(load).max() > _PLAIN * max(force_scale, _PLAIN * carried))


def _rigid_load(problem: ContactProblem, unit: FloatArray) -> tuple[FloatArray, float]:
    """Return the work (n_motions,) of the load on rigid motions of unit size, and a force to compare it with."""
    load = problem.body.rigid_load() / unit
    forces = problem.body.weights[:, None] * problem.sticking_state.traction
    return load, max(float(np.abs(load).max()), float(np.abs(forces).sum()))


def find_long_motion(problem: ContactProblem) -> float | None:
    """Return how far the load moves the body before an obstacle can hold it, if that is too far to resolve deformation.

    Parameters
    ----------
    problem : ContactProblem
        With a load that the obstacle can hold; see `find_unsolvable_load`.

    Returns
    -------
    float or None
        Smallest gap that must close, relative to the displacement that the tractions of the sticking state cause at one
        node; None if displacements hold enough digits for both the travel and the deformation.
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
    """Return pairs (c, s) of (n,) arrays with ``bound <= c + s |sigma_n|`` for the pressures tried.

    Parameters
    ----------
    bound : callable
        (n,) normal tractions [Pa] -> (n,) bounds [Pa].
    slope : (n,) array [-]
        Growth of the bound with the pressure where this is zero.
    pressure : float [Pa]
        A typical one.
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
    """Return (n_motions,) coefficients of the mechanism on which the load does most work, zeros if none.

    Their absolute values add up to one at most, which favours mechanisms with a single motion, the simplest to name.
    `slope` is nan at nodes that never touch.

    Notes
    -----
    This solves the dual problem: find the contact forces p within friction that have the smallest residual
    ``r = M p + load``, M the work of unit forces on the motions. The multipliers of these equations are the mechanism.
    The size of r is its largest component, so that absolute values of the multipliers add up to one; with many motions
    it is the sum of all components, so that no multiplier exceeds one. Forces are sums of those on both edges of the
    friction cone and of tangential ones that need no pressure. So all conditions on p are bounds, and M is sparse.
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
    """Return the result of a linear programme of contact forces, whose multipliers are a mechanism.

    Parameters
    ----------
    motions : RigidMotions
    resistance, slope : (n_contact,) arrays
        As for `contact_forces`; the slope is nan at nodes that never touch.
    programme : callable
        Slopes (n_contact,), nan at nodes that take no part -> the result, and the velocities (n_motions,) of the
        mechanism; None for velocities if there is none.

    Notes
    -----
    Where two bodies meet, the extreme nodes nearly always suffice. Nodes between them join if the mechanism presses
    them, all of them if there is no mechanism.
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
    """Return (n_contact,) bool: nodes that a motion presses into the obstacle, or that resist it without pressure."""
    motion = np.asarray(velocities @ motions).reshape(-1, 2)
    is_pressed = motion[:, 0] + slope * np.abs(motion[:, 1]) > _MEETS * np.abs(motion).max()
    return np.asarray(is_pressed | ((resistance > 0.0) & (motion[:, 1] != 0.0)))


def extreme_nodes(motions: csr_array, touches: BoolArray) -> BoolArray:
    """Return (n_contact,) bool: the first and the last of the nodes at which the same motions meet."""
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
    """Return the coefficients of `_largest_mechanism` for the nodes whose slope is a number."""
    from scipy import sparse
    from scipy.optimize import linprog

    n_motions, (works, bounds) = motions.shape[0], contact_forces(motions, resistance, slope)
    n_forces, unit = works.shape[1], sparse.eye_array(n_motions)
    balance = sparse.hstack([works, unit, -unit], format="csc")
    limits = np.vstack([bounds, np.tile([0.0, np.inf], (2 * n_motions, 1))])
    cost = np.append(np.zeros(n_forces), np.ones(2 * n_motions))
    below_largest, none = sparse.csr_array((0, balance.shape[1])), np.zeros(0)
    if n_motions <= _MANY_MOTIONS:
        balance = sparse.hstack([balance, sparse.csc_array((n_motions, 1))])
        largest = sparse.csr_array(np.full((n_motions, 1), -1.0))
        below_largest = sparse.hstack([sparse.csr_array((n_motions, n_forces)), unit, unit, largest], format="csr")
        none = np.zeros(n_motions)
        limits, cost = np.vstack([limits, [0.0, np.inf]]), np.append(np.zeros_like(cost), 1.0)
    result = linprog(  # type: ignore[call-overload]  # the stubs know no sparse arrays
        cost,
        A_ub=below_largest,
        b_ub=none,
        A_eq=balance,
        b_eq=-load,
        bounds=limits,
        method="highs",
    )
    if result.x is None:  # leaving all of the load is admissible, so this is the solver's failure: do not condemn it
        return np.zeros(n_motions)
    return -np.asarray(result.eqlin.marginals, dtype=float)


def contact_forces(motions: RigidMotions, resistance: FloatArray, slope: FloatArray) -> tuple[csc_array, FloatArray]:
    """Return the forces that friction allows at the nodes whose slope is a number, as sums of simple ones.

    Parameters
    ----------
    motions : RigidMotions
    resistance : (n_contact,) array [N]
        What friction holds without pressure.
    slope : (n_contact,) array [-]
        Further friction by pressure.

    Returns
    -------
    works : (n_motions, n_forces) sparse array
        Work of each simple force on each motion: those on both edges of the cones of friction, then the tangential ones
        that need no pressure.
    bounds : (n_forces, 2) array
        Least and largest factor of each.
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
