"""Solutions with changed entries."""

from __future__ import annotations

from dataclasses import fields, replace
from typing import Any

import bemkit as bk
from bemkit.results.solved_body import SolvedBody

_OF_BODY = {entry.name for entry in fields(SolvedBody)} - {"name", "scene"}


def changed(solution: bk.Solution, **entries: Any) -> bk.Solution:
    """Return a solution with other entries of its own, or of its only body; a scene is that of both."""
    own = {name: value for name, value in entries.items() if name not in _OF_BODY}
    of_body = {name: value for name, value in entries.items() if name in _OF_BODY}
    body = replace(solution.body, scene=entries.get("scene", solution.scene).only, **of_body)
    return replace(solution, bodies={body.name: body}, **own)
