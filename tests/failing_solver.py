"""A contact solver that fails where a test says so."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import bemkit as bk
from bemkit.contact.body import ContactState
from bemkit.contact.problem import ContactProblem
from bemkit.solvers.base import Status


@dataclass(frozen=True)
class Failing(bk.SemismoothNewton):
    """Ends as stalled, before any step, where `fails` says so of a problem and its start; `fails` may also raise."""

    fails: Callable[[ContactProblem, ContactState], bool] = lambda problem, start: False

    def init(self, problem: ContactProblem, start: ContactState) -> Any:
        first = super().init(problem, start)
        return replace(first, ended=Status.STALLED) if self.fails(problem, start) else first
