"""Steps of a load history."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from numbers import Integral
from types import MappingProxyType
from typing import Any, TypeAlias

from bemkit.errors import InputError

TimeValue: TypeAlias = float | str | Callable[[float], float]
"""A number, a formula in the time t, or a Python function of it."""


@dataclass(frozen=True)
class Step:
    """One step of a load history, with its changes. Everything else stays as at the end of the step before.

    Parameters
    ----------
    time : float [s]
        At the end of the step; positive, and later than the step before. The history begins at 0.
    changes : mapping of str to value
        New values by their keys in scene files, such as ``"parts.press.condition.y"``, ``"law.friction_coefficient"``
        or ``"rigid.punch.y"``: a number, a text, a table or an object as the key takes it, or a Python function of the
        time that returns one. Numbers hold from the first increment of the step on; formulas of the time ``t`` are
        evaluated at each increment, and keep their last value after the step.
    load_factor : float, str, callable or None
        Multiplies all loads, prescribed displacements and body forces that are not constant.
    increments : int
        Number of equal parts of the time of the step, each a step of the result.

    Raises
    ------
    InputError
        If the time is not positive and finite, or there is no increment.
    """

    time: float
    changes: Mapping[str, Any] = field(default_factory=dict)
    load_factor: TimeValue | None = None
    increments: int = 1

    def __post_init__(self) -> None:
        if not (math.isfinite(self.time) and self.time > 0.0):
            raise InputError(f"time is {self.time}: give the time at the end of the step, a positive number")
        if not isinstance(self.increments, Integral) or self.increments < 1:
            raise InputError(f"increments is {self.increments}: give a whole number, 1 or more")
        object.__setattr__(self, "changes", MappingProxyType(dict(self.changes)))

    def __reduce__(self) -> tuple[type[Step], tuple[object, ...]]:
        """Pickle with a plain dict: a read-only mapping cannot be pickled."""
        return Step, (self.time, dict(self.changes), self.load_factor, self.increments)

    @property
    def is_plain(self) -> bool:
        """Whether it has a time and nothing else, as the steps of results do."""
        return not self.changes and self.load_factor is None and self.increments == 1
