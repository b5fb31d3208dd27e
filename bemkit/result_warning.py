"""Warnings of plans and results as values."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import asdict, dataclass
from typing import Any

_MOST_OF_A_KIND = 3


@dataclass(frozen=True)
class ResultWarning:
    """A reason to check a result although it is certified.

    Parameters
    ----------
    kind : str
        Fixed name of the kind, such as ``"overlap between nodes"``.
    subject : str
        Name of the part, contact or body, or the point, that the warning is about; empty for the whole result.
    text : str
        A sentence with the value and the remedy.
    number : float, optional
        The value, in the unit that the text states; None if the kind has none.
    step : int, optional
        Number of the load step, counted from 1, if it is an earlier one than that of the result.
    """

    kind: str
    subject: str
    text: str
    number: float | None = None
    step: int | None = None

    def __str__(self) -> str:
        """Return the sentence."""
        return self.text

    def as_dict(self) -> dict[str, Any]:
        """Return the warning as JSON can hold it."""
        return asdict(self)


def without_duplicates(warnings: Iterable[ResultWarning]) -> tuple[ResultWarning, ...]:
    """Return the first warning of each kind and subject."""
    first: dict[tuple[str, str], ResultWarning] = {}
    for warning in warnings:
        first.setdefault((warning.kind, warning.subject), warning)
    return tuple(first.values())


def first_of_each_kind(warnings: Iterable[ResultWarning]) -> tuple[ResultWarning, ...]:
    """Return at most three warnings of each kind, and one that counts the others of that kind."""
    kinds: dict[str, list[ResultWarning]] = {}
    for warning in warnings:
        kinds.setdefault(warning.kind, []).append(warning)
    shown: list[ResultWarning] = []
    for kind, alike in kinds.items():
        shown += alike[:_MOST_OF_A_KIND]
        if n_more := len(alike[_MOST_OF_A_KIND:]):
            # as a kind of its own, so that it never replaces a warning about the whole result
            shown.append(ResultWarning(f"more of {kind}", "", f"{n_more} more warnings of this kind: {kind}.", n_more))
    return tuple(shown)
