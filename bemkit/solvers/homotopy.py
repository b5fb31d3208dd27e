"""Follow the path of exact solutions while an extra pressure and an extra friction decrease to zero.

With enough extra pressure and friction at the contact nodes every node is closed and sticks. Between two changes of a
node's status the response is linear in the amount of the extras. So the path from there to the problem itself consists
of straight pieces: at each joint one node changes its status, and the amount goes on falling, or rises for a while
where the path folds. At folds Newton's method and plain continuation fail; this method does not. It is Lemke's
complementary pivoting [Lemke1965], carried out on a body instead of a matrix.

The path may also start with other statuses, such as those at which Newton's method gives up. Then only nodes that
violate an inequality get extras (of pressure, friction, gap or slip), so that it holds. These are few, and the path is
short.
"""

from dataclasses import dataclass
from enum import IntEnum
from typing import NamedTuple

import numpy as np

from bemkit.arrays import BoolArray, FloatArray, IntArray, spread_fractions
from bemkit.contact.conditions import LinearConditions, of_statuses, slip, stick
from bemkit.contact.problem import ContactProblem, ContactState, SingularResponse
from bemkit.solvers.active_sets import ActiveSets


class _Kind(IntEnum):
    """The inequality that a node has to keep, by the piece it is on."""

    PRESSURE = 0  # closed: -sigma_n >= 0
    CLEARANCE = 1  # open: g - u_n >= 0
    FORWARD = 2  # stick: bound + sigma_t >= 0, slips forward when it fails
    BACKWARD = 3  # stick: bound - sigma_t >= 0, slips backward when it fails
    SLIP = 4  # slip: direction * slip >= 0


@dataclass(frozen=True, eq=False)
class AffineBound:
    """Friction bound ``slope * sigma_n + intercept``; exact for Coulomb and Tresca, a tangent for other laws.

    Parameters
    ----------
    slope : (n_contact,) array [-]
    intercept : (n_contact,) array [Pa]
    """

    slope: FloatArray
    intercept: FloatArray

    @classmethod
    def tangent(cls, problem: ContactProblem, sigma_n: FloatArray) -> "AffineBound":
        """Return the tangent of the problem's law at the given normal tractions (tension is read as zero)."""
        sigma_n = np.minimum(sigma_n, 0.0)
        slope = problem.friction_slope(sigma_n)
        return cls(slope, problem.friction_bound(sigma_n) - slope * sigma_n)


class PathEnd(NamedTuple):
    """Outcome of `follow_path`; `state` is None if the path does not lead to a solution, for the reason given."""

    state: ContactState | None
    linear_solves: int
    n_pieces: int
    reason: str


class _Piece(NamedTuple):
    """A straight piece of the path: tractions and displacements are ``origin + amount * rate``."""

    origin: ContactState
    rate: ContactState
    is_kept: BoolArray  # (5, n_contact): which inequalities matter
    slack: FloatArray  # (5, n_contact) at amount zero
    slack_rate: FloatArray  # (5, n_contact)


def why_no_path(problem: ContactProblem, *, is_short: bool = False) -> str:
    """Return why the path of solutions cannot be followed; empty if it can.

    Unless it is short it takes two responses or more for each contact node. The friction bound has to be continuous
    where nodes open.
    """
    if problem.body.is_costly and not is_short:
        return "the path of solutions is not followed, because responses of this body are costly"
    jumps = problem.cohesion > 0.0
    if np.any(jumps & ~np.asarray(problem.law.acts_across_gap)):
        return "there is no path of solutions, because the friction law jumps where nodes open"
    return ""


def follow_path(
    problem: ContactProblem, bound: AffineBound, start: ActiveSets | None = None, max_pieces: int | None = None
) -> PathEnd:
    """Return the first solution on the path that starts with given statuses.

    Parameters
    ----------
    problem : ContactProblem
        Its law is replaced by `bound`.
    bound : AffineBound
    start : ActiveSets, optional
        By default all nodes are closed and stick; that path leads to a solution if the body is held. From statuses near
        those of a solution the path is short, but may not lead to one.
    max_pieces : int, optional
        By default ``20 n_contact + 100``; about 1.5 pieces a node are usual.

    Returns
    -------
    PathEnd
        Two linear solves a piece. Tractions and displacements are exact up to round-off.
    """
    try:
        path, is_closed, direction, n_solves = _start_of_path(problem, bound, start)
    except SingularResponse as error:
        return PathEnd(None, 2, 0, f"the path begins with a singular response: {error}")
    limit = 20 * problem.n_contact + 100 if max_pieces is None else max_pieces
    state, n_pieces, reason = _follow_pieces(path, is_closed, direction, limit)
    return PathEnd(state, n_solves + 2 * n_pieces, n_pieces, reason)


def _start_of_path(
    problem: ContactProblem, bound: AffineBound, start: ActiveSets | None
) -> tuple["_Path", BoolArray, IntArray, int]:
    """Return a path, its first statuses (closed, direction of slip), and the linear solves to find them."""
    if start is None:
        at_rest = np.zeros(problem.n_contact, dtype=np.intp)
        return _Path(problem, bound, Extras.everywhere(problem)), np.isfinite(problem.gap), at_rest, 0
    path = _Path(problem, bound, Extras.nothing(problem))
    is_closed, n_solves = start.is_closed, 0
    while True:  # open nodes that slip under tension: extra pressure there would change the friction
        piece = path.piece(is_closed, start.direction)
        n_solves += 2
        is_pulled = is_closed & (start.direction != 0) & (piece.slack[_Kind.PRESSURE] < 0.0)
        if not is_pulled.any():
            extras = Extras.covering(piece, bound, start.direction)
            return _Path(problem, bound, extras), is_closed, start.direction, n_solves
        is_closed = is_closed & ~is_pulled


def _follow_pieces(
    path: "_Path", is_closed: BoolArray, direction: IntArray, limit: int
) -> tuple[ContactState | None, int, str]:
    """Return the end of a path (None if it does not lead to a solution), the number of its pieces, and the reason."""
    amount, falling, entered = np.inf, -1.0, None
    for n_pieces in range(1, limit + 1):
        try:
            piece = path.piece(is_closed, direction)
        except SingularResponse as error:
            return None, n_pieces, f"the path meets a singular response: {error}"
        if entered is None:
            amount = _first_amount(piece)
        else:
            falling = float(np.sign(piece.slack_rate[entered]))
            piece.is_kept[entered] = False  # it has just become active and grows from zero
        step, kind, node = _next_joint(piece, amount, falling)
        if falling < 0.0 and step >= amount:
            return piece.origin, n_pieces, ""
        if falling == 0.0 or not np.isfinite(step):
            return None, n_pieces, "the path does not return to the problem proper"
        amount += falling * step
        if kind is _Kind.CLEARANCE and path.is_free(is_closed)[node]:
            direction = direction.copy()  # friction sets in against the slip that the open node has come to
            direction[node] = 1 if path.slip(piece, amount)[node] > 0.0 else -1
        is_closed, direction, entered = _pivoted(is_closed, direction, kind, node)
    return None, limit, f"the path has more than {limit} pieces"


@dataclass(frozen=True, eq=False)
class Extras:
    """Additions to a problem, for an amount of one, with which given statuses solve it.

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
    def everywhere(cls, problem: ContactProblem) -> "Extras":
        """Return pressure and friction at all nodes: with enough of it every node touches and sticks."""
        stress = float(np.abs(problem.sticking_state.traction).max()) or 1.0
        extras, none = stress * _uneven(2 * problem.n_contact), np.zeros(problem.n_contact)
        return cls(extras[::2], extras[1::2], none, none)

    @classmethod
    def nothing(cls, problem: ContactProblem) -> "Extras":
        """Return no extras."""
        none = np.zeros(problem.n_contact)
        return cls(none, none, none, none)

    @classmethod
    def covering(cls, piece: "_Piece", bound: AffineBound, direction: IntArray) -> "Extras":
        """Return the extras that make all inequalities of a piece hold and do not change its response.

        Needs a piece in which no slipping node is under tension: extra pressure there would change the friction.
        """
        missing = np.where(piece.is_kept, np.maximum(-piece.slack, 0.0), 0.0)
        missing *= _uneven(missing.size).reshape(missing.shape)
        pressure = missing[_Kind.PRESSURE]
        friction = np.maximum(missing[_Kind.FORWARD], missing[_Kind.BACKWARD])
        friction = np.maximum(friction + bound.slope * pressure, 0.0)  # less what the extra pressure adds
        return cls(pressure, friction, missing[_Kind.CLEARANCE], -direction * missing[_Kind.SLIP])


def _uneven(count: int) -> FloatArray:
    """Return numbers from 1 to 3/2, all different, so that nodes of symmetric problems do not change at once."""
    return 1.0 + 0.5 * spread_fractions(count)


class _Path:
    """The problem with extras."""

    def __init__(self, problem: ContactProblem, bound: AffineBound, extras: Extras) -> None:
        self.problem = problem
        self.bound = bound
        self.extras = extras

    def is_free(self, is_closed: BoolArray) -> BoolArray:
        """Return (n_contact,) bool: nodes that nothing resists along the tangent, whatever the amount."""
        has_bound = (self.bound.intercept != 0.0) | (is_closed & (self.bound.slope != 0.0))
        return np.asarray(~has_bound & (self.extras.friction == 0.0))

    def slip(self, piece: _Piece, amount: float) -> FloatArray:
        """Return the slip (n_contact,) at an amount of extras [m]."""
        moved = piece.origin.u_t + amount * piece.rate.u_t
        return np.asarray(moved - self.problem.slip_origin - amount * self.extras.slip)

    def piece(self, is_closed: BoolArray, direction: IntArray) -> _Piece:
        """Respond to fixed statuses, at amount zero and at amount one."""
        problem, bound = self.problem, self.bound
        is_free = self.is_free(is_closed)
        slips = (direction != 0) | is_free
        sticks = ~slips & ~problem.body.tangent_is_eliminated  # an eliminated tangent is followed by the body
        held = stick(problem.gap, problem.slip_origin)
        sliding = slip(problem.gap, direction.astype(float), bound.slope, bound.intercept)
        conditions = of_statuses(is_closed, slips, held, sliding)

        # The body carries contact traction plus extra pressure; the conditions are on contact tractions alone.
        extras = self.extras
        extra_value = conditions.on_traction[:, :, 0] * extras.pressure[:, None]
        extra_value[:, 1] -= direction * extras.friction
        extra_value += conditions.on_displacement[:, :, 0] * extras.gap[:, None]
        extra_value += conditions.on_displacement[:, :, 1] * extras.slip[:, None]
        with_extras = LinearConditions(
            conditions.on_displacement, conditions.on_traction, conditions.value + extra_value
        )
        origin, shifted = problem.respond(conditions), problem.respond(with_extras)
        traction_rate = shifted.traction - origin.traction
        traction_rate[:, 0] -= extras.pressure
        rate = ContactState(shifted.displacement - origin.displacement, traction_rate)

        origin_slip = origin.u_t - problem.slip_origin
        limit = bound.slope * origin.sigma_n + bound.intercept
        limit_rate = bound.slope * rate.sigma_n + extras.friction
        slack = [-origin.sigma_n, problem.gap - origin.u_n, limit + origin.sigma_t, limit - origin.sigma_t]
        slack_rate = [-rate.sigma_n, extras.gap - rate.u_n, limit_rate + rate.sigma_t, limit_rate - rate.sigma_t]
        return _Piece(
            origin,
            rate,
            np.stack([is_closed, ~is_closed & np.isfinite(problem.gap), sticks, sticks, slips & ~is_free]),
            np.stack([*slack, direction * origin_slip]),
            np.stack([*slack_rate, direction * (rate.u_t - extras.slip)]),
        )


def _first_amount(piece: _Piece) -> float:
    """Return an amount of extras above which all inequalities hold."""
    grows = piece.is_kept & (piece.slack_rate > 0.0)
    return max(0.0, float(np.max(-piece.slack[grows] / piece.slack_rate[grows], initial=0.0))) * 1.01


def _next_joint(piece: _Piece, amount: float, falling: float) -> tuple[float, _Kind, int]:
    """Return by how much the amount changes on the piece, and the inequality and node that end it."""
    rate = falling * piece.slack_rate
    ends = piece.is_kept & (rate < 0.0)
    reach = np.full(rate.shape, np.inf)
    slack = piece.slack[ends] + amount * piece.slack_rate[ends]
    reach[ends] = np.maximum(slack, 0.0) / -rate[ends]
    kind, node = np.unravel_index(np.argmin(reach), reach.shape)
    return float(reach[kind, node]), _Kind(int(kind)), int(node)


def _pivoted(
    is_closed: BoolArray, direction: IntArray, kind: _Kind, node: int
) -> tuple[BoolArray, IntArray, tuple[_Kind, int]]:
    """Return the statuses after the joint, and the inequality that becomes active instead of the one that ended."""
    is_closed, direction = is_closed.copy(), direction.copy()
    if kind in (_Kind.PRESSURE, _Kind.CLEARANCE):
        is_closed[node] = not is_closed[node]
        entered = _Kind.CLEARANCE if kind is _Kind.PRESSURE else _Kind.PRESSURE
    elif kind is _Kind.SLIP:
        entered = _Kind.FORWARD if direction[node] > 0 else _Kind.BACKWARD
        direction[node] = 0
    else:
        direction[node] = 1 if kind is _Kind.FORWARD else -1
        entered = _Kind.SLIP
    return is_closed, direction, (entered, node)
