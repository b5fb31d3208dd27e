"""Selections: which piece of an outline a boundary part covers."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from bemkit.arrays import BoolArray, FloatArray
from bemkit.geometry.curves import Curve
from bemkit.geometry.errors import GeometryError

N_SAMPLES = 257
"""Points at which a predicate is looked at along a side; 2**k + 1, so that halves and quarters are among them."""
_N_PASSES = 7  # 256**-7 is less than the spacing of numbers near 1
_END_TOLERANCE = 1e-12  # a part does not begin this close to the end of its side: that is round-off of the predicate

Predicate = Callable[[FloatArray, FloatArray], BoolArray]


@dataclass(frozen=True)
class Selection:
    """A choice of boundary: some sides, or the pieces of them where a predicate holds.

    Parameters
    ----------
    sides : tuple of str
        Names of sides, or of groups of sides; empty for all sides.
    where : callable, optional
        Vectorised predicate: coordinates x and y, each (n,) [m] -> (n,) bool. A piece shorter than 1/256 of its side
        may be overlooked.
    """

    sides: tuple[str, ...] = ()
    where: Predicate | None = None

    def __post_init__(self) -> None:
        if isinstance(self.sides, str):
            raise GeometryError(f"Selection: sides is the string {self.sides!r}: give a tuple, ({self.sides!r},)")
        object.__setattr__(self, "sides", tuple(self.sides))

    def names(self, side_name: str, group: str = "") -> bool:
        """Tell whether a side is named, itself or by its group."""
        return not self.sides or side_name in self.sides or group in self.sides

    def holds(self, side_name: str, points: FloatArray, group: str = "") -> BoolArray:
        """Tell which points (n, 2) of the named side are selected, (n,)."""
        if not self.names(side_name, group):
            return np.zeros(len(points), dtype=bool)
        return np.ones(len(points), dtype=bool) if self.where is None else evaluate_predicate(self.where, points)


def evaluate_predicate(where: Predicate, points: FloatArray) -> BoolArray:
    """Evaluate a predicate at points (n, 2); a constant answer counts for all.

    Raises
    ------
    GeometryError
        If the answer is not boolean or has another shape.
    """
    answer = np.asarray(where(points[:, 0], points[:, 1]))
    if answer.dtype != np.bool_ or answer.shape not in ((), (len(points),)):
        raise GeometryError(
            f"Selection: where returned an array of {answer.dtype} of shape {answer.shape} for {len(points)} points: "
            f"return booleans of shape ({len(points)},), as in `x < 0.5`"
        )
    return np.broadcast_to(answer, (len(points),))


def breakpoints(curve: Curve, where: Predicate) -> FloatArray:
    """Find where along a curve a predicate changes.

    Parameters
    ----------
    curve : Curve
        The curve.
    where : callable
        The predicate, as in `Selection`.

    Returns
    -------
    (n,) array
        Parameters in (0, 1), increasing, to round-off: sampled at 257 points, then between those where it changes.
    """
    low, high = np.zeros(1), np.ones(1)
    for k in range(_N_PASSES):
        samples = np.linspace(low, high, N_SAMPLES)
        holds = evaluate_predicate(where, curve.point(samples.ravel())).reshape(samples.shape)
        before, interval = np.nonzero(holds[1:] != holds[:-1])
        if k > 0:  # one of each: far from the origin a predicate flickers, and each flicker would bring forth others
            interval, first = np.unique(interval, return_index=True)
            before = before[first]
        low, high = samples[before, interval], samples[before + 1, interval]
        if not low.size:
            break
    return merge_breakpoints(high)


def merge_breakpoints(s: FloatArray) -> FloatArray:
    """Sort parameters, drop those at the ends, and let those that differ by round-off be one."""
    # to 15 decimals, so that x <= 1/2 and x < 1/2 both break at 1/2
    s = np.sort(np.round(s, 15))
    s = s[(s > _END_TOLERANCE) & (s < 1.0 - _END_TOLERANCE)]
    return s[np.diff(s, prepend=-1.0) > _END_TOLERANCE]
