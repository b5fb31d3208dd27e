"""The two projections of contact and friction conditions, with their generalised derivatives [QiSun1993]."""

import numpy as np

from bemkit.arrays import FloatArray
from bemkit.errors import InputError


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
