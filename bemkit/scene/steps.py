"""Steps of a load history, and checks of names and laws that scenes and their bodies share."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from types import MappingProxyType
from typing import Any, TypeAlias

from bemkit.contact.laws import FrictionLaw
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
        if self.increments < 1:
            raise InputError(f"increments is {self.increments}: give 1 or more")
        object.__setattr__(self, "changes", MappingProxyType(dict(self.changes)))

    def __reduce__(self) -> tuple[type[Step], tuple[object, ...]]:
        """Pickle with a plain dict: a read-only mapping cannot be pickled."""
        return Step, (self.time, dict(self.changes), self.load_factor, self.increments)

    @property
    def is_plain(self) -> bool:
        """Whether it has a time and nothing else, as the steps of results do."""
        return not self.changes and self.load_factor is None and self.increments == 1


def check_steps(load_factors: Sequence[float], steps: Sequence[Step]) -> None:
    """Raise InputError unless load factors are finite, times increase, and only one of both describes the history."""
    if not (load_factors and all(map(math.isfinite, load_factors))):
        raise InputError(f"load_factors is {load_factors}: give finite numbers such as (0.5, 1.0)")
    if steps and load_factors != (1.0,):
        raise InputError(f"load_factors is {load_factors} besides {len(steps)} steps: give each step its load_factor")
    for number, (before, step) in enumerate(pairwise(steps), start=1):
        if step.time <= before.time:
            raise InputError(f"steps[{number}]: time is {step.time:g} after {before.time:g}: give times that increase")


def check_names(owner: str, names: Iterable[str], kind: str) -> None:
    """Raise InputError if two parts or bodies have one name."""
    for name, count in Counter(names).items():
        if count > 1:
            raise InputError(f"{owner}: {name!r} is the name of two {kind}: give each its own name")


def check_laws(laws: Mapping[str, FrictionLaw], steps: Sequence[Step]) -> None:
    """Check that laws that depend on slip or time have a load history.

    Raises
    ------
    InputError
        Naming the place and the law.
    """
    for place, law in laws.items():
        if law.needs_history and not steps:
            raise InputError(
                f"{place} is {type(law).__name__}, which depends on slip or time: give [[steps]] with their times"
            )
