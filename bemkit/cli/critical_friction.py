"""The command ``bemkit critical-friction``."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import click

from bemkit.cli import options
from bemkit.cli.options import shown_progress
from bemkit.cli.outputs import Outputs, json_of
from bemkit.errors import concerning

if TYPE_CHECKING:
    from collections.abc import Callable

    from bemkit.runs.critical_friction import CriticalFriction
    from bemkit.scene.scene import Scene


@click.command("critical-friction")
@click.argument("scene")
@options.changes_scene("elements", "accuracy")
@options.json_option
def critical_friction(scene: str, json_file: str | None, load: Callable[[str], Scene]) -> None:
    """Find the friction coefficients at which sliding states of SCENE lose uniqueness."""
    with shown_progress(quiet=False), concerning(scene):
        from bemkit.runs.critical_friction import critical_friction as critical_friction_of

        chosen = load(scene)

        def entries(found: CriticalFriction) -> dict[str, Any]:
            return {"title": chosen.title, **found.as_dict()}

        outputs = Outputs((json_of(json_file, entries),))
        outputs.check()
        found = critical_friction_of(chosen)
    outputs.write(found)
    if not outputs.uses_stdout:
        print(f"{found.n_contact} nodes in contact, {found.n_slipping} of them slip in the solution")
        print(f"all slide forward:             {_words(found.forward)}")
        print(f"all slide backward:            {_words(found.backward)}")
        print(f"those that slip slide on:      {_words(found.present)}")


def _words(coefficient: float) -> str:
    return "unique at any friction" if math.isinf(coefficient) else f"loses uniqueness at {coefficient:.6g}"
