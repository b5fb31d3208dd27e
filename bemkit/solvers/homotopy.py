"""Lemke's complementary pivoting on a body: follow exact solutions while an artificial load decreases to zero.

With sufficient additional pressure and friction every contact node is closed and sticks. The additions are the covering
vector times the artificial variable. Between two changes of status the response is linear in the artificial variable.
So the path to the original problem consists of straight segments. At each pivot one node changes its status, and the
artificial variable decreases, or increases where the path folds. A segment without end is a ray, which leads to no
solution. Newton's method and continuation fail at folds; this method does not. It is Lemke's algorithm [Lemke1965] with
responses of a body in place of a tableau.

The path may also start with other statuses, such as the last ones of Newton's method. Then the covering vector has
entries (of pressure, friction, gap or slip) only at nodes that violate an inequality. These are few, and the path is
short.
"""

from dataclasses import dataclass
from enum import IntEnum
from typing import NamedTuple

import numpy as np

from bemkit.arrays import BoolArray, FloatArray, IntArray, spread_fractions
from bemkit.contact.body import ContactState, SingularResponse, of_statuses, slip, stick
from bemkit.contact.problem import ContactProblem
from bemkit.operators.boundary_equations import LinearConditions
from bemkit.solvers.active_sets import ActiveSets


class _Inequality(IntEnum):
    """The inequality of a node, depending on its status."""

    PRESSURE = 0  # closed: -sigma_n >= 0
    CLEARANCE = 1  # open: g - u_n >= 0
    FORWARD = 2  # stick: bound + sigma_t >= 0, slips forward when it fails
    BACKWARD = 3  # stick: bound - sigma_t >= 0, slips backward when it fails
    SLIP = 4  # slip: direction * slip >= 0


@dataclass(frozen=True, eq=False)
class AffineBound:
    """Friction bound ``slope * sigma_n + intercept``: exact for Coulomb and Tresca, a tangent for other laws.

    Parameters
    ----------
    slope : (n_contact,) array [-]
    intercept : (n_contact,) array [Pa]
    """

    slope: FloatArray
    intercept: FloatArray

    @classmethod
    def tangent(cls, problem: ContactProblem, sigma_n: FloatArray) -> "AffineBound":
        """Return the tangent of the law at given normal tractions; tension counts as zero."""
        sigma_n = np.minimum(sigma_n, 0.0)
        slope = problem.friction_slope(sigma_n)
        return cls(slope, problem.friction_bound(sigma_n) - slope * sigma_n)


class PathEnd(NamedTuple):
    """Result of `follow_path`; `state` is None, with a reason, if the path leads to no solution."""

    state: ContactState | None
    linear_solves: int
    n_segments: int
    reason: str


class _Segment(NamedTuple):
    """A straight segment of the path: tractions and displacements are ``origin + artificial * rate``."""

    origin: ContactState
    rate: ContactState
    is_kept: BoolArray  # (5, n_contact): inequalities that apply
    slack: FloatArray  # (5, n_contact) at the origin
    slack_rate: FloatArray  # (5, n_contact)


def why_no_path(problem: ContactProblem, *, is_short: bool = False) -> str:
    """Return why the path of solutions cannot be followed; empty if it can.

    A long path takes at least two responses for each contact node. The friction bound must be continuous where nodes
    open.
    """
    if problem.body.responses_are_expensive and not is_short:
        return "the path of solutions is not followed, because responses of this body are costly"
    jumps = problem.cohesion > 0.0
    if np.any(jumps & ~np.asarray(problem.law.acts_across_gap)):
        return "there is no path of solutions, because the friction law jumps where nodes open"
    return ""


def follow_path(
    problem: ContactProblem, bound: AffineBound, start: ActiveSets | None = None, max_segments: int | None = None
) -> PathEnd:
    """Return the first solution on the path that starts with given statuses.

    Parameters
    ----------
    problem : ContactProblem
        Problem whose law is replaced by `bound`.
    bound : AffineBound
    start : ActiveSets, optional
        By default all nodes are closed and stick; that path leads to a solution if the body is held. From statuses near
        those of a solution the path is short, but may end on a ray.
    max_segments : int, optional
        By default ``20 n_contact + 100``; about 1.5 segments for each node are usual.

    Returns
    -------
    PathEnd
        The solution, exact up to round-off. Each segment takes two linear solves.
    """
    try:
        path, is_closed, direction, n_solves = _start_of_path(problem, bound, start)
    except SingularResponse as error:
        return PathEnd(None, 2, 0, f"the path begins with a singular response: {error}")
    limit = 20 * problem.n_contact + 100 if max_segments is None else max_segments
    state, n_segments, reason = _follow_segments(path, is_closed, direction, limit)
    return PathEnd(state, n_solves + 2 * n_segments, n_segments, reason)


def _start_of_path(
    problem: ContactProblem, bound: AffineBound, start: ActiveSets | None
) -> tuple["_Path", BoolArray, IntArray, int]:
    """Return a path, its first statuses (closed, direction of slip), and the linear solves that they took."""
    if start is None:
        at_rest = np.zeros(problem.n_contact, dtype=np.intp)
        return _Path(problem, bound, CoveringVector.everywhere(problem)), np.isfinite(problem.gap), at_rest, 0
    path = _Path(problem, bound, CoveringVector.zero(problem))
    is_closed, n_solves = start.is_closed, 0
    while True:  # open nodes that slip under tension, because additional pressure would change their friction
        segment = path.segment(is_closed, start.direction)
        n_solves += 2
        is_pulled = is_closed & (start.direction != 0) & (segment.slack[_Inequality.PRESSURE] < 0.0)
        if not is_pulled.any():
            cover = CoveringVector.of_violations(segment, bound, start.direction)
            return _Path(problem, bound, cover), is_closed, start.direction, n_solves
        is_closed = is_closed & ~is_pulled


def _follow_segments(
    path: "_Path", is_closed: BoolArray, direction: IntArray, limit: int
) -> tuple[ContactState | None, int, str]:
    """Return the end of a path (None if it leads to no solution), its number of segments, and the reason."""
    artificial, sign, entering = np.inf, -1.0, None
    for n_segments in range(1, limit + 1):
        # responses to the statuses at two values of the artificial variable
        try:
            segment = path.segment(is_closed, direction)
        except SingularResponse as error:
            return None, n_segments, f"the path meets a singular response: {error}"
        # The artificial variable falls or rises so that the slack that has entered grows from zero.
        if entering is None:
            artificial = _first_artificial(segment)
        else:
            sign = float(np.sign(segment.slack_rate[entering]))
            segment.is_kept[entering] = False
        # Ratio test: the problem itself, a ray, or the inequality that ends the segment.
        step, inequality, node = _leaving(segment, artificial, sign)
        if sign < 0.0 and step >= artificial:
            return segment.origin, n_segments, ""
        if sign == 0.0 or not np.isfinite(step):
            return None, n_segments, "the path ends on a ray"
        artificial += sign * step
        # pivot: the node changes its status
        if inequality is _Inequality.CLEARANCE and path.is_free(is_closed)[node]:
            direction = direction.copy()  # friction begins against the present slip of the open node
            direction[node] = 1 if path.slip(segment, artificial)[node] > 0.0 else -1
        is_closed, direction, entering = _pivoted(is_closed, direction, inequality, node)
    return None, limit, f"the path has more than {limit} segments"


@dataclass(frozen=True, eq=False)
class CoveringVector:
    """Additions to a problem, for an artificial variable of one, with which given statuses solve it.

    Parameters
    ----------
    pressure, friction : (n_contact,) arrays [Pa]
        Traction along the outward normal on the body, and addition to the friction bound.
    gap, slip : (n_contact,) arrays [m]
        Additions to the gap and to the slip origin.
    """

    pressure: FloatArray
    friction: FloatArray
    gap: FloatArray
    slip: FloatArray

    @classmethod
    def everywhere(cls, problem: ContactProblem) -> "CoveringVector":
        """Return pressure and friction at all nodes, which close every node and make it stick."""
        stress = float(np.abs(problem.sticking_state.traction).max()) or 1.0
        extras, none = stress * _uneven(2 * problem.n_contact), np.zeros(problem.n_contact)
        return cls(extras[::2], extras[1::2], none, none)

    @classmethod
    def zero(cls, problem: ContactProblem) -> "CoveringVector":
        """Return no additions."""
        none = np.zeros(problem.n_contact)
        return cls(none, none, none, none)

    @classmethod
    def of_violations(cls, segment: "_Segment", bound: AffineBound, direction: IntArray) -> "CoveringVector":
        """Return additions with which all inequalities of a segment hold and its response does not change.

        No slipping node may be under tension, because additional pressure would change its friction.
        """
        missing = np.where(segment.is_kept, np.maximum(-segment.slack, 0.0), 0.0)
        missing *= _uneven(missing.size).reshape(missing.shape)
        pressure = missing[_Inequality.PRESSURE]
        friction = np.maximum(missing[_Inequality.FORWARD], missing[_Inequality.BACKWARD])
        friction = np.maximum(friction + bound.slope * pressure, 0.0)  # less what the extra pressure adds
        return cls(pressure, friction, missing[_Inequality.CLEARANCE], -direction * missing[_Inequality.SLIP])


def _uneven(count: int) -> FloatArray:
    """Return different numbers from 1 to 3/2, so that nodes of symmetric problems change one after the other."""
    return 1.0 + 0.5 * spread_fractions(count)


class _Path:
    """The problem with its covering vector."""

    def __init__(self, problem: ContactProblem, bound: AffineBound, cover: CoveringVector) -> None:
        self.problem = problem
        self.bound = bound
        self.cover = cover

    def is_free(self, is_closed: BoolArray) -> BoolArray:
        """Return a mask (n_contact,) of frictionless nodes, for any artificial variable."""
        has_bound = (self.bound.intercept != 0.0) | (is_closed & (self.bound.slope != 0.0))
        return np.asarray(~has_bound & (self.cover.friction == 0.0))

    def slip(self, segment: _Segment, artificial: float) -> FloatArray:
        """Return the slip (n_contact,) [m] at a value of the artificial variable."""
        u_t = segment.origin.u_t + artificial * segment.rate.u_t
        return np.asarray(u_t - self.problem.slip_origin - artificial * self.cover.slip)

    def segment(self, is_closed: BoolArray, direction: IntArray) -> _Segment:
        """Return the responses to fixed statuses for the artificial variables zero and one."""
        problem, bound = self.problem, self.bound
        is_free = self.is_free(is_closed)
        slips = (direction != 0) | is_free
        sticks = ~slips & ~problem.body.tangent_follows  # tangents that follow have no inequality
        sticking = stick(problem.gap, problem.slip_origin)
        sliding = slip(problem.gap, direction.astype(float), bound.slope, bound.intercept)
        conditions = of_statuses(is_closed, slips, sticking, sliding)

        # the body carries contact tractions and additional pressure; conditions are on contact tractions only
        cover = self.cover
        extra_value = conditions.on_traction[:, :, 0] * cover.pressure[:, None]
        extra_value[:, 1] -= direction * cover.friction
        extra_value += conditions.on_displacement[:, :, 0] * cover.gap[:, None]
        extra_value += conditions.on_displacement[:, :, 1] * cover.slip[:, None]
        covered = LinearConditions(conditions.on_displacement, conditions.on_traction, conditions.value + extra_value)
        origin, shifted = problem.respond(conditions), problem.respond(covered)
        traction_rate = shifted.traction - origin.traction
        traction_rate[:, 0] -= cover.pressure
        rate = ContactState(shifted.displacement - origin.displacement, traction_rate)

        # slacks of all five inequalities and their rates; `is_kept` marks those that apply
        origin_slip = origin.u_t - problem.slip_origin
        limit = bound.slope * origin.sigma_n + bound.intercept
        limit_rate = bound.slope * rate.sigma_n + cover.friction
        slack = [-origin.sigma_n, problem.gap - origin.u_n, limit + origin.sigma_t, limit - origin.sigma_t]
        slack_rate = [-rate.sigma_n, cover.gap - rate.u_n, limit_rate + rate.sigma_t, limit_rate - rate.sigma_t]
        may_open, may_close = is_closed, ~is_closed & np.isfinite(problem.gap)
        keeps_slipping = slips & ~is_free & ~problem.body.tangent_follows
        return _Segment(
            origin,
            rate,
            is_kept=np.stack([may_open, may_close, sticks, sticks, keeps_slipping]),
            slack=np.stack([*slack, direction * origin_slip]),
            slack_rate=np.stack([*slack_rate, direction * (rate.u_t - cover.slip)]),
        )


def _first_artificial(segment: _Segment) -> float:
    """Return a value of the artificial variable above which all inequalities hold."""
    grows = segment.is_kept & (segment.slack_rate > 0.0)
    return max(0.0, float(np.max(-segment.slack[grows] / segment.slack_rate[grows], initial=0.0))) * 1.01


def _leaving(segment: _Segment, artificial: float, sign: float) -> tuple[float, _Inequality, int]:
    """Return the change of the artificial variable on the segment, and the inequality and node that end it."""
    rate = sign * segment.slack_rate
    ends = segment.is_kept & (rate < 0.0)
    ratio = np.full(rate.shape, np.inf)
    slack = segment.slack[ends] + artificial * segment.slack_rate[ends]
    ratio[ends] = np.maximum(slack, 0.0) / -rate[ends]
    inequality, node = np.unravel_index(np.argmin(ratio), ratio.shape)
    return float(ratio[inequality, node]), _Inequality(int(inequality)), int(node)


def _pivoted(
    is_closed: BoolArray, direction: IntArray, leaving: _Inequality, node: int
) -> tuple[BoolArray, IntArray, tuple[_Inequality, int]]:
    """Return the statuses after a pivot, and the inequality that enters."""
    is_closed, direction = is_closed.copy(), direction.copy()
    if leaving in (_Inequality.PRESSURE, _Inequality.CLEARANCE):
        is_closed[node] = not is_closed[node]
        entering = _Inequality.CLEARANCE if leaving is _Inequality.PRESSURE else _Inequality.PRESSURE
    elif leaving is _Inequality.SLIP:
        entering = _Inequality.FORWARD if direction[node] > 0 else _Inequality.BACKWARD
        direction[node] = 0
    else:
        direction[node] = 1 if leaving is _Inequality.FORWARD else -1
        entering = _Inequality.SLIP
    return is_closed, direction, (entering, node)
