"""The command ``bemkit plan``."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import click

from bemkit.cli import options
from bemkit.cli.options import shown_progress
from bemkit.cli.outputs import STDOUT, json_of
from bemkit.errors import concerning

if TYPE_CHECKING:
    from collections.abc import Callable

    from bemkit.plan.plan import Plan
    from bemkit.scene.scene import Scene


@click.command()
@click.argument("scene")
@options.changes_scene("settings", "elements", "accuracy", "discretisation", "degree")
@options.json_option
def plan(scene: str, json_file: str | None, load: Callable[[str], Scene]) -> None:
    """List what SCENE needs, what is skipped and why, without solving it."""
    with shown_progress(json_file is not None):
        text = json_of(json_file, _entries)
        text.check()
        chosen = load(scene)
        with concerning(scene):
            made = _planned(chosen)
    text.write(made)
    if json_file != STDOUT:
        from bemkit.cli.console import print_plan

        print_plan(chosen.title, made)


def _entries(made: Plan) -> dict[str, Any]:
    return made.as_dict()


def _planned(scene: Scene) -> Plan:
    """Return the plan of a scene, with a symmetry that it could use."""
    from bemkit.plan.plan import check_elements, make_plan
    from bemkit.scene.symmetry import find_symmetry

    check_elements(scene)
    proposal = find_symmetry(scene.only) if not scene.bodies and scene.symmetry is None else None
    return make_plan(scene, proposal=proposal)
