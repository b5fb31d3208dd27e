"""Which cases of a test belong to the quick run; a case of several parameters is a tuple."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import pytest


def slow_only(values: Iterable[Any], *slow: Any) -> list[Any]:
    """Return the parameters of a test, those named marked as slow; it is an error to name an unknown one."""
    return _marked(list(values), slow, slow=True)


def slow_except(values: Iterable[Any], *quick: Any) -> list[Any]:
    """Return the parameters of a test, all but those named marked as slow; it is an error to name an unknown one."""
    return _marked(list(values), quick, slow=False)


def _marked(values: list[Any], named: tuple[Any, ...], *, slow: bool) -> list[Any]:
    if unknown := [each for each in named if each not in values]:
        raise ValueError(f"{unknown}: none of {values}")
    cases = ((value, value if isinstance(value, tuple) else (value,)) for value in values)
    return [pytest.param(*each, marks=pytest.mark.slow if (value in named) == slow else ()) for value, each in cases]
