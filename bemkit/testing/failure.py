"""How a conformance check fails: with an exception of its own, so that `python -O` disables nothing."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from bemkit.arrays import FloatArray
from bemkit.errors import BemkitError


class CheckFailed(BemkitError, AssertionError):  # noqa: N818 - it reads as what happened, and pytest shows it as a failed test
    """An implementation breaks a promise of its protocol; the message names the promise and by how much."""


def demand(is_kept: bool, message: str) -> None:
    """Raise `CheckFailed` with the message unless a promise is kept."""
    if not is_kept:
        raise CheckFailed(message)


def class_name(implementation: object) -> str:
    """Return the name of the class of an object; CheckFailed if the object is a class itself."""
    if isinstance(implementation, type):
        raise CheckFailed(f"{implementation.__name__} is a class: give an object, {implementation.__name__}(...)")
    return type(implementation).__name__


def evaluated(label: str, method: Callable[[FloatArray], FloatArray], places: FloatArray, shape: object) -> FloatArray:
    """Return the values of a function at some places, after checks of shape, finiteness, purity and repeatability."""
    before = places.copy()
    values = method(places)
    demand(np.array_equal(places, before), f"{label} changes its argument")
    demand(
        np.shape(values) == shape, f"{label} returns the shape {np.shape(values)} for {places.size} points, not {shape}"
    )
    demand(bool(np.isfinite(values).all()), f"{label} is not finite at {places}")
    demand(np.array_equal(values, method(places)), f"{label} gives two answers to one question")
    return values
