"""Coefficients of friction laws: numbers, numbers per contact node, or formulas of the coordinates."""

from typing import TypeAlias

import numpy as np

from bemkit.arrays import FloatArray, read_only
from bemkit.errors import InputError
from bemkit.formulas import ScalarField, check_field, evaluate_field

Coefficient: TypeAlias = ScalarField | FloatArray
"""A number, a formula or function of x and y, or one number per contact node."""


class LawError(InputError):
    """A friction law failed or returned what no bound can be; the message names the law."""


def checked_coefficient(name: str, value: Coefficient, *, may_be_infinite: bool = False) -> Coefficient:
    """Check a coefficient and return it as a float, a read-only array of its own, or the formula it is."""
    if callable(value):
        check_field(value, name)
        return value
    array = np.array(value, dtype=float)
    if array.ndim > 1:
        raise InputError(f"{name} has the shape {array.shape}; give one number or one number per contact node")
    is_wrong = np.isnan(array) | (array < 0.0) | (False if may_be_infinite else np.isinf(array))
    if np.any(is_wrong):
        where = f" at contact node {int(np.argmax(is_wrong))}" if array.ndim else ""
        raise InputError(f"{name} = {array[is_wrong][0] if array.ndim else array:g}{where}; give a number >= 0")
    if array.ndim == 0:
        return float(array)
    read_only(array)
    return array


def numbers_of(name: str, value: Coefficient) -> float | FloatArray:
    """Return a coefficient that is known in numbers; InputError if it is a function of the coordinates."""
    if callable(value):
        raise InputError(f"{name} is a function of the coordinates; take law.at(points) for the contact nodes first")
    return value


def is_zero(value: Coefficient) -> bool:
    """Whether a coefficient is known to vanish everywhere."""
    return not callable(value) and not np.any(value)


def evaluated_coefficient(name: str, value: Coefficient, points: FloatArray) -> Coefficient:
    """Return a coefficient in numbers, evaluated at (n_contact, 2) points [m] if it is a formula or function."""
    if isinstance(value, np.ndarray) and len(value) != len(points):
        raise LawError(
            f"{name} has {len(value)} values for {len(points)} contact nodes: give one number, one for each node, or a "
            "formula of x and y"
        )
    if not callable(value):
        return value
    values = evaluate_field(value, points)
    if np.any(values < 0.0):
        node = int(np.argmin(values))
        x, y = points[node]
        raise LawError(
            f"{name} = {value!r} is {values[node]:g} at (x, y) = ({x:.6g}, {y:.6g}); it must be zero or positive on "
            "the whole contact part"
        )
    return values
