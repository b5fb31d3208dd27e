"""The solutions of load steps: a tuple that shows itself in short."""

from __future__ import annotations

from bemkit.notebook import ShownInNotebooks
from bemkit.results.solved_problem import AnySolution


class SolvedSteps(ShownInNotebooks, tuple[AnySolution, ...]):
    """The solutions of load steps in their order, never none."""

    __slots__ = ()

    def __repr__(self) -> str:
        """Return one line."""
        last = self[-1]
        return f"SolvedSteps({last.title!r}: {len(self)} steps, the last one {last.status_words})"
