"""The solutions of load steps: a tuple that shows itself in short."""

from __future__ import annotations

from typing import TypeVar

from bemkit.notebook import ShownInNotebooks
from bemkit.results.assembly_solution import AssemblySolution
from bemkit.results.solution import Solution

AnySolution = TypeVar("AnySolution", bound=Solution | AssemblySolution)


class SolvedSteps(ShownInNotebooks, tuple[AnySolution, ...]):
    """The solutions of load steps in their order, never none."""

    __slots__ = ()

    def __repr__(self) -> str:
        """Return one line."""
        last = self[-1]
        status = last.status.name.lower().replace("_", " ")
        return f"SolvedSteps({last.title!r}: {len(self)} steps, the last one {status})"
