"""Projection equations of contact and friction with generalised derivatives [QiSun1993], and their active sets."""

from dataclasses import dataclass
from enum import IntEnum

import numpy as np

from bemkit.arrays import BoolArray, FloatArray, IntArray
from bemkit.contact.body import ContactState, augmented, of_statuses, slip, stick
from bemkit.contact.problem import ContactProblem
from bemkit.errors import InputError
from bemkit.operators.boundary_equations import LinearConditions

_FAR = float(np.finfo(float).max)


class NodeStatus(IntEnum):
    """Status of a contact node."""

    SEPARATED = 0
    STICK = 1
    SLIP_FORWARD = 2
    """Slips along the tangent, ``u_t > 0``; also a closed frictionless node at rest."""
    SLIP_BACKWARD = 3
    """Slips against the tangent, ``u_t < 0``."""


@dataclass(frozen=True, eq=False)
class ActiveSets:
    """The active sets of Algorithm 2 for each node.

    Parameters
    ----------
    is_closed : (n_contact,) bool array
        Whether ``u_n = g`` holds; open nodes carry no normal traction.
    direction : (n_contact,) int array
        +1 or -1 for slip along or against the tangent, 0 for stick; at open nodes from the projection (16).
    """

    is_closed: BoolArray
    direction: IntArray

    @property
    def node_status(self) -> IntArray:
        """(n_contact,) array of `NodeStatus` values."""
        slipping = np.where(self.direction > 0, NodeStatus.SLIP_FORWARD, NodeStatus.SLIP_BACKWARD)
        closed = np.where(self.direction == 0, NodeStatus.STICK, slipping)
        return np.where(self.is_closed, closed, NodeStatus.SEPARATED).astype(np.intp)

    @property
    def key(self) -> bytes:
        """A key that is equal for equal sets only."""
        return self.is_closed.tobytes() + self.direction.astype(np.int8).tobytes()

    def n_changed(self, other: "ActiveSets") -> int:
        """Return the number of nodes at which the sets differ."""
        return int(np.count_nonzero((self.is_closed != other.is_closed) | (self.direction != other.direction)))


@dataclass(frozen=True, eq=False)
class Residual:
    """The projection equations (15), (16) evaluated at a state.

    Parameters
    ----------
    state : ContactState
    sets : ActiveSets
        Sets from the generalised derivatives of the projections; at a tie a node counts as separated or sticking.
    bound, slope : (n_contact,) arrays [Pa], [-]
        Friction bound and its derivative at `predicted_sigma_n`.
    predicted_sigma_n : (n_contact,) array [Pa]
        ``-[rho_n (u_n - g) - multiplier_n]_+``.
    value : (n_contact, 2) array [Pa]
        Left-hand sides of (15) and (16).
    """

    state: ContactState
    sets: ActiveSets
    bound: FloatArray
    slope: FloatArray
    predicted_sigma_n: FloatArray
    value: FloatArray

    @property
    def is_free(self) -> BoolArray:
        """(n_contact,) bool array: frictionless nodes, whose bound and its derivative vanish."""
        return np.asarray((self.bound == 0.0) & (self.slope == 0.0))


@dataclass(frozen=True, eq=False)
class ProjectionEquations:
    """Contact and friction as the projection equations (15), (16) of the paper [AlartCurnier1991].

    With the multiplier m, which is the traction unless it is fixed,

        sigma_n = -[rho_n (u_n - g) - m_n]_+,    sigma_t = -clip(rho_t slip - m_t, bound(sigma_n)).

    Parameters
    ----------
    problem : ContactProblem
    rho_n, rho_t : float [Pa/m]
        Ratio of traction to displacement in the projections.
    multiplier : (n_contact, 2) array [Pa], optional
        Fixed multiplier sigma^(k) of Algorithm 1. By default it is the present traction, and the equations are the
        exact conditions.
    given_bound : (n_contact,) array [Pa], optional
        Fixed (lagged) friction bound. By default the bound depends on the predicted normal traction, and the Newton
        matrix contains its derivative.
    """

    problem: ContactProblem
    rho_n: float
    rho_t: float
    multiplier: FloatArray | None = None
    given_bound: FloatArray | None = None

    @classmethod
    def scaled(cls, problem: ContactProblem) -> "ProjectionEquations":
        """Return the equations with the stiffness scale of the body as both ratios."""
        return cls(problem, problem.body.stiffness_scale, problem.body.stiffness_scale)

    def evaluate(self, state: ContactState, touches: BoolArray | None = None) -> Residual:
        """Return sets and residual at `state`.

        Parameters
        ----------
        state : ContactState
        touches : (n_contact,) bool array, optional
            Nodes that count as closed at a tie, without pressure and clearance.
        """
        problem = self.problem
        multiplier = state.traction if self.multiplier is None else self.multiplier
        towards_obstacle = self.rho_n * (state.u_n - problem.gap) - multiplier[:, 0]
        along_obstacle = self.rho_t * (state.u_t - problem.slip_origin) - multiplier[:, 1]
        # a tangent that follows is not an unknown: its slip direction does not depend on friction
        follows = problem.body.tangent_follows
        if follows.any():
            along_obstacle = np.where(follows, problem.given_direction(state) * _FAR, along_obstacle)
        is_closed = positive_part_derivative(towards_obstacle) > 0.0
        if touches is not None:
            is_closed |= touches
        predicted_sigma_n = -positive_part(towards_obstacle)
        if self.given_bound is None:
            bound = problem.friction_bound(predicted_sigma_n, is_closed)
            slope = problem.friction_slope(predicted_sigma_n, is_closed)
        else:
            bound, slope = self.given_bound, np.zeros_like(self.given_bound)
        _, direction = clip_to_bound_derivative(along_obstacle, bound)
        value = state.traction.copy()
        value[:, 0] -= predicted_sigma_n
        value[:, 1] += clip_to_bound(along_obstacle, bound)
        sets = ActiveSets(is_closed, direction.astype(np.intp))
        return Residual(state, sets, bound, slope, predicted_sigma_n, value)

    def linearised(self, residual: Residual, sets: ActiveSets) -> LinearConditions:
        """Return the equations of a Newton step as conditions on the body.

        Parameters
        ----------
        residual : Residual
            Residual at which the friction bound is linearised.
        sets : ActiveSets
            Sets of the residual, or of `through_stick`. Frictionless nodes slide in either direction.
        """
        problem = self.problem
        if self.multiplier is None:
            sticking = stick(problem.gap, problem.slip_origin)
        else:
            sticking = augmented(problem.gap, problem.slip_origin, self.multiplier, self.rho_n, self.rho_t)
        intercept = residual.bound - residual.slope * residual.predicted_sigma_n
        sliding = slip(problem.gap, sets.direction.astype(float), residual.slope, intercept)
        slides = (sets.direction != 0) | residual.is_free
        return problem.possible(of_statuses(sets.is_closed, slides, sticking, sliding))

    def through_stick(self, residual: Residual, previous: ActiveSets) -> ActiveSets:
        """Return the sets of `residual` with direct changes of slip direction replaced by stick.

        Without this rule, the active sets of stiff bodies may alternate between both slip directions. The direction of
        frictionless nodes is set to zero, so that equal sets give equal steps.
        """
        sets = residual.sets
        reverses = sets.direction * previous.direction < 0
        return ActiveSets(sets.is_closed, np.where(reverses | residual.is_free, 0, sets.direction))


def contact_sets(problem: ContactProblem, state: ContactState) -> ActiveSets:
    """Return the active sets of a state by the exact conditions, with the stiffness scale of the body as rho.

    A closed frictionless node counts as slipping. A node without pressure counts as closed if cohesion holds it; see
    `coheres`.
    """
    residual = ProjectionEquations.scaled(problem).evaluate(state, coheres(problem, state))
    direction = np.where(residual.is_free & (residual.sets.direction == 0), 1, residual.sets.direction)
    return ActiveSets(residual.sets.is_closed, direction)


def coheres(problem: ContactProblem, state: ContactState) -> BoolArray:
    """Return a mask (n_contact,) of nodes that cohesion holds without pressure.

    As in the certificate, a node is open if its tangential traction is less than that which would close its clearance.
    """
    has_cohesion = (problem.cohesion > 0.0) & ~np.asarray(problem.law.acts_across_gap)
    clearance = problem.body.stiffness_scale * np.abs(problem.gap - state.u_n)
    return np.asarray(has_cohesion & (np.abs(state.sigma_t) > clearance))


def positive_part(a: FloatArray) -> FloatArray:
    """Project onto the non-negative numbers: ``[a]_+``.

    Parameters
    ----------
    a : (...) array

    Returns
    -------
    (...) array
        `a` where ``a > 0``, zero elsewhere; equation (13) of the paper.
    """
    return np.maximum(a, 0.0)


def positive_part_derivative(a: FloatArray) -> FloatArray:
    """Return one element of the generalised derivative of `positive_part`.

    Parameters
    ----------
    a : (...) array

    Returns
    -------
    (...) array
        One where ``a > 0``, zero elsewhere (at ``a = 0`` the node counts as separated).
    """
    return np.where(a > 0.0, 1.0, 0.0)


def clip_to_bound(x: FloatArray, bound: FloatArray | float) -> FloatArray:
    """Project onto the ball of radius `bound`: ``[x]_alpha``.

    Parameters
    ----------
    x : (n,) array or (n, d) array
        Tangential components of a plane problem, or one vector in each row.
    bound : (n,) array or float
        Radii, not negative.

    Returns
    -------
    array of the shape of `x`
        `x` where ``|x| <= bound``, otherwise ``bound x / |x|``; equation (14) of the paper, and zero for ``bound = 0``.

    Raises
    ------
    ValueError
        If a bound is negative or `x` has more than two axes.
    """
    bound = _checked_bound(x, bound)
    if x.ndim == 1:
        return np.clip(x, -bound, bound)
    length = np.hypot.reduce(x, axis=1)
    is_outside = length > bound
    factor = np.where(is_outside, bound / np.where(is_outside, length, 1.0), 1.0)
    return x * factor[:, None]


def clip_to_bound_derivative(x: FloatArray, bound: FloatArray | float) -> tuple[FloatArray, FloatArray]:
    """Return one element of the generalised derivative of `clip_to_bound` with respect to `x` and `bound`.

    Parameters
    ----------
    x : (n,) array or (n, d) array
    bound : (n,) array or float

    Returns
    -------
    by_x : (n,) array or (n, d, d) array
        One (the unit matrix) where ``|x| <= bound``, for sticking nodes; otherwise ``bound/|x| (I - x x^T/|x|^2)``,
        which is zero for (n,) components.
    by_bound : (n,) array or (n, d) array
        Zero for sticking nodes, otherwise ``x/|x|``.

    Raises
    ------
    ValueError
        See `clip_to_bound`.
    """
    bound = _checked_bound(x, bound)
    if x.ndim == 1:
        is_outside = np.abs(x) > bound
        return np.where(is_outside, 0.0, 1.0), np.where(is_outside, np.copysign(1.0, x), 0.0)
    length = np.hypot.reduce(x, axis=1)
    is_outside = length > bound
    safe_length = np.where(is_outside, length, 1.0)
    direction = np.where(is_outside[:, None], x / safe_length[:, None], 0.0)
    unit = np.eye(x.shape[1])
    outside = (bound / safe_length)[:, None, None] * (unit - direction[:, :, None] * direction[:, None, :])
    return np.where(is_outside[:, None, None], outside, unit), direction


def _checked_bound(x: FloatArray, bound: FloatArray | float) -> FloatArray:
    if x.ndim not in (1, 2):
        raise InputError(f"x has {x.ndim} axes; give (n,) components or (n, d) vectors")
    radii = np.asarray(bound, dtype=float)
    if radii.shape != x.shape[:1]:
        radii = np.broadcast_to(radii, x.shape[:1])
    if np.any(radii < 0.0):
        raise InputError(f"bound has the negative value {radii.min():g}; a friction bound is zero or positive")
    return radii
