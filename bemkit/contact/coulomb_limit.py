"""Load factors of collapse of rigid bodies in contact with non-associative Coulomb friction."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy import sparse
from scipy.sparse import csc_array

from bemkit.arrays import FloatArray
from bemkit.contact.limit_load import WITHOUT_BOUND, largest_factor
from bemkit.contact.solvability import linear_programme, with_violated_nodes
from bemkit.errors import InputError
from bemkit.operators.rigid_modes import RigidMotions, of_unit_size

MOST_PROGRAMMES = 60
"""Largest number of linear programmes with given friction bounds; walls of 30 to 60 blocks take 10 to 50."""
_SHARE = 0.6
"""Weight of the last normal forces in the next ones; without it, states of equal factors alternate."""
_STEADY, _N_STEADY = 1e-5, 6
"""Largest relative change of the factor, and number of consecutive steps, at which the iteration ends."""
_MOVES = 1e-7
"""Smallest velocity, relative to the largest one, that is not round-off of linear programming."""
_BELOW = (0.01, 0.02, 0.05, 0.1, 0.2)
"""Relative distances below the factor at which a stable state of forces is sought."""
_HOLDS = 1e-6
"""Smallest relative growth of the factor without a motion, above the tolerance of linear programming."""

_WEDGED = 1e4
"""Pressing force relative to the loads above which bodies are wedged."""
_ANY_FACTOR = np.array([[-WITHOUT_BOUND, WITHOUT_BOUND]])


@dataclass(frozen=True)
class CoulombLimit:
    """Load factors of collapse with Coulomb friction.

    With friction without dilatancy, the contact forces at a factor are not unique, and they decide whether a motion
    begins. So factors of collapse fill intervals, and none of these numbers is a lower bound of all of them.

    Parameters
    ----------
    held : float
        Factor with a state of forces from which no motion begins: the same friction bounds balance a larger load. It is
        1 % below `factor` for walls of dozens of blocks, and minus infinity if no state was found.
    factor : float
        Factor with a state of forces from which a motion begins: forces in equilibrium and in the friction cones, and a
        motion that does not penetrate, opens only joints without pressure and slides only against full friction. It is
        the limit of the iteration and agrees with factors in the literature.
    smallest : float
        The smallest factor with such a state: an upper bound of the smallest factor of collapse.
    associative : float
        Factor above which no state of forces exists (associative friction).
    """

    held: float
    factor: float
    smallest: float
    associative: float


_WITHOUT_LIMIT = CoulombLimit(np.inf, np.inf, np.inf, np.inf)


def coulomb_limit(
    motions: RigidMotions,
    constant: FloatArray,
    growing: FloatArray,
    cohesion: FloatArray,
    slope: FloatArray,
    *,
    most_programmes: int = MOST_PROGRAMMES,
) -> CoulombLimit | None:
    """Return load factors of collapse; parameters are those of `bemkit.contact.limit_load.largest_factor`.

    Parameters
    ----------
    motions : (n_motions, 2 n) array or sparse array
    constant, growing : (n_motions,) arrays [N]
    cohesion, slope : (n,) arrays [N], [-]
    most_programmes : int
        Largest number of programmes with given friction bounds.

    Returns
    -------
    CoulombLimit or None
        None if no factor balances the loads. All factors are infinite if supports hold any multiple, or if no load is
        constant and contact forces hold any multiple.

    Notes
    -----
    A sequence of linear programmes: the normal forces of the last programme give the friction bounds of the next one,
    so that sliding does not dilate [FerrisTinLoi2001]. Each programme gives a motion. The forces of collapse for that
    motion form a convex set, and two more programmes find its smallest and largest factor; every factor between them
    has a state of collapse. A state holds if the same friction bounds balance a larger factor.
    """
    associative = largest_factor(motions, constant, growing, [(cohesion, slope)])
    if associative is None:
        return None
    if np.isinf(associative) and not (motions.shape[0] and constant.any() and growing.any()):
        return _WITHOUT_LIMIT
    scaled, unit = of_unit_size(motions)
    constant, growing = constant / unit, growing / unit
    size = float(np.abs(growing).max())
    scale = float(np.abs(constant).max()) or size

    def programme(slopes: FloatArray) -> tuple[CoulombLimit, FloatArray | None]:
        points = np.flatnonzero(np.isfinite(slopes))
        columns = sparse.csc_array(scaled)
        blocks = _Blocks(
            columns[:, 2 * points],
            columns[:, 2 * points + 1],
            constant / scale,
            growing / size,
            cohesion[points] / scale,
            slope[points],
        )
        return _limit(blocks, most_programmes)

    # sliding does not dilate: add only nodes that the motion presses or that have cohesion
    found = with_violated_nodes(scaled, cohesion / scale, 0.0 * slope, programme)
    if np.isnan(found.factor):
        raise InputError("no state of collapse was found: use largest_load_factor, an upper bound")
    held, factor, smallest = (scale / size * value for value in (found.held, found.factor, found.smallest))
    return CoulombLimit(held, factor, smallest, associative)


@dataclass(frozen=True, eq=False)
class _Blocks:
    """Dimensionless loads (m,) on m motions, and work (m, n) of unit normal and tangential forces at n points."""

    normal: csc_array
    tangential: csc_array
    constant: FloatArray
    growing: FloatArray
    cohesion: FloatArray
    slope: FloatArray

    def bound(self, pressing: FloatArray) -> FloatArray:
        """Return the friction bounds (n,) of pressing forces (n,)."""
        return self.cohesion + self.slope * pressing

    @property
    def load_column(self) -> csc_array:
        """The growing load as the last column of the equilibrium equations."""
        return sparse.csc_array(self.growing[:, None])


def _limit(blocks: _Blocks, most_programmes: int) -> tuple[CoulombLimit, FloatArray | None]:
    """Return the dimensionless factors and the velocities of the last collapse; nan and None if there is none."""
    none = CoulombLimit(np.nan, np.nan, np.nan, np.nan), None
    pressing = _pressing_forces_at_the_limit(blocks)
    if pressing is None:
        return none
    if pressing.max(initial=0.0) > _WEDGED:  # no limit: begin with the forces that balance the constant load
        least = _pressing_forces_near(blocks, 0.0, np.zeros(pressing.size))
        pressing = pressing if least is None else least
    factor, smallest, velocities, n_steady = np.nan, np.inf, None, 0
    for _ in range(most_programmes):
        found = _largest_with_bound(blocks, blocks.bound(pressing))
        if found is None:
            break
        last, (value, forces, motion) = factor, found
        if value > 0.5 * WITHOUT_BOUND:
            return _WITHOUT_LIMIT, None
        lowest, highest = _factors_of_collapse(blocks, motion)
        smallest = min(smallest, lowest)
        if lowest <= highest:
            factor, velocities = min(max(value, lowest), highest), motion
        n_steady = n_steady + 1 if abs(factor - last) <= _STEADY * abs(factor) else 0
        if n_steady == _N_STEADY:
            break
        pressing = (1.0 - _SHARE) * pressing + _SHARE * forces
    if velocities is None:
        return none
    below = (float(factor - share * abs(factor)) for share in _BELOW)
    held = next((candidate for candidate in below if _holds(blocks, candidate, pressing)), -np.inf)
    return CoulombLimit(held, factor, smallest, np.nan), velocities


def _pressing_forces_at_the_limit(blocks: _Blocks) -> FloatArray | None:
    """Return the pressing forces (n,) at the largest factor of associative friction; None if there is none."""
    n, wedged = blocks.slope.size, blocks.tangential @ sparse.diags_array(blocks.slope)
    edges = [wedged - blocks.normal, -wedged - blocks.normal]
    balance = sparse.hstack([*edges, blocks.tangential, blocks.load_column], format="csc")
    limits = np.vstack([np.tile([0.0, np.inf], (2 * n, 1)), blocks.cohesion[:, None] * [-1.0, 1.0], _ANY_FACTOR])
    result = linear_programme(np.append(np.zeros(3 * n), -1.0), balance, -blocks.constant, limits)
    return None if result.x is None else np.asarray(result.x[:n] + result.x[n : 2 * n])


def _largest_with_bound(blocks: _Blocks, bound: FloatArray) -> tuple[float, FloatArray, FloatArray] | None:
    """Return the largest factor with given friction bounds (n,), its pressing forces (n,) and motion (m,)."""
    balance = sparse.hstack([-blocks.normal, blocks.tangential, blocks.load_column], format="csc")
    limits = np.vstack([np.tile([0.0, np.inf], (bound.size, 1)), bound[:, None] * [-1.0, 1.0], _ANY_FACTOR])
    result = linear_programme(np.append(np.zeros(2 * bound.size), -1.0), balance, -blocks.constant, limits)
    if result.x is None:
        return None
    return float(result.x[-1]), result.x[: bound.size], -np.asarray(result.eqlin.marginals, dtype=float)


def _factors_of_collapse(blocks: _Blocks, motion: FloatArray) -> tuple[float, float]:
    """Return the smallest and largest factor at which a motion (m,) begins; (inf, -inf) if there is none.

    Opening points carry no pressure; at sliding points friction is full and opposes sliding.
    """
    opening, sliding = motion @ blocks.normal, motion @ blocks.tangential
    least = _MOVES * float(max(np.abs(opening).max(), np.abs(sliding).max()))
    if opening.max() > least or motion @ blocks.growing <= 0.0:
        return np.inf, -np.inf
    is_closed, slides = opening >= -least, np.abs(sliding) > least
    sense = np.where(slides, -np.sign(sliding), 0.0)
    wedged = blocks.tangential @ sparse.diags_array(blocks.slope)
    chosen, at_rest = np.flatnonzero(is_closed & slides), np.flatnonzero(is_closed & ~slides)
    full = wedged[:, chosen] @ sparse.diags_array(sense[chosen]) - blocks.normal[:, chosen]
    edges = [sign * wedged[:, at_rest] - blocks.normal[:, at_rest] for sign in (1.0, -1.0)]
    balance = sparse.hstack([full, *edges, blocks.tangential[:, at_rest], blocks.load_column], format="csc")
    cohesion = blocks.cohesion[at_rest, None] * [-1.0, 1.0]
    limits = np.vstack([np.tile([0.0, np.inf], (chosen.size + 2 * at_rest.size, 1)), cohesion, _ANY_FACTOR])
    right = -blocks.constant - blocks.tangential @ (sense * blocks.cohesion)
    results = [
        linear_programme(np.append(np.zeros(len(limits) - 1), sign), balance, right, limits) for sign in (1.0, -1.0)
    ]
    if any(result.x is None for result in results):
        return np.inf, -np.inf
    first, last = (float(result.x[-1]) for result in results)
    return min(first, last), max(first, last)  # round-off may exchange them


def _pressing_forces_near(blocks: _Blocks, factor: float, wanted: FloatArray) -> FloatArray | None:
    """Return the pressing forces (n,) of the state in equilibrium nearest to `wanted` in the 1-norm, or None."""
    n, unit = wanted.size, sparse.eye_array(wanted.size)
    balance = sparse.hstack([-blocks.normal, blocks.normal, blocks.tangential], format="csc")
    wedge = sparse.diags_array(blocks.slope)
    rows: list[Any] = [sparse.hstack([-wedge, wedge, sign * unit]) for sign in (1.0, -1.0)]
    limits = np.zeros((3 * n, 2))
    limits[:n, 1], limits[n : 2 * n, 1], limits[2 * n :] = np.inf, wanted, (-np.inf, np.inf)
    result = linear_programme(
        np.append(np.ones(2 * n), np.zeros(n)),
        balance,
        blocks.normal @ wanted - blocks.constant - factor * blocks.growing,
        limits,
        (sparse.vstack(rows, format="csc"), np.tile(blocks.bound(wanted), 2)),
    )
    return None if result.x is None else np.asarray(wanted + result.x[:n] - result.x[n : 2 * n])


def _holds(blocks: _Blocks, factor: float, wanted: FloatArray) -> bool:
    """Return whether no motion begins from a state of forces at a factor, near pressing forces `wanted` (n,)."""
    pressing = _pressing_forces_near(blocks, factor, wanted)
    found = None if pressing is None else _largest_with_bound(blocks, blocks.bound(pressing))
    return found is not None and found[0] > factor + _HOLDS * max(abs(factor), 1.0)
