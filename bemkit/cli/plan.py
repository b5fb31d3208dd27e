"""The command ``bemkit plan``."""

from __future__ import annotations

from typing import TYPE_CHECKING, Literal

import click

from bemkit.cli import options
from bemkit.cli.options import shown_progress
from bemkit.cli.outputs import STDOUT, TextFile
from bemkit.errors import concerning
from bemkit.table import json_text

if TYPE_CHECKING:
    from bemkit.plan.plan import Plan
    from bemkit.scene.scene import Scene


@click.command()
@click.argument("scene")
@options.settings_option
@options.elements_option
@options.accuracy_option
@options.discretisation_option
@options.degree_option
@options.json_option
def plan(
    scene: str,
    settings: tuple[str, ...],
    elements: int | None,
    accuracy: float | None,
    discretisation: str | None,
    degree: int | Literal["hp"] | None,
    json_file: str | None,
) -> None:
    """List what SCENE needs, what is skipped and why, without solving it."""
    with shown_progress(json_file is not None):
        from bemkit.scene.keys import with_settings
        from bemkit.scene.toml import load_scene, with_overrides

        text = TextFile(json_file, _as_json)
        text.check()
        chosen = with_overrides(
            with_settings(load_scene(scene), settings),
            elements=elements,
            accuracy=accuracy,
            discretisation=discretisation,
            degree=degree,
        )
        with concerning(scene):
            made = _planned(chosen)
    text.write(made)
    if json_file != STDOUT:
        from bemkit.cli.console import print_plan

        print_plan(chosen.title, made)


def _as_json(made: Plan) -> str:
    return json_text(made.as_dict())


def _planned(scene: Scene) -> Plan:
    """Return the plan of a scene, with a symmetry that it could use."""
    from bemkit.plan.plan import check_elements, make_plan
    from bemkit.scene.symmetry import find_symmetry

    check_elements(scene)
    proposal = find_symmetry(scene.only) if not scene.bodies and scene.symmetry is None else None
    return make_plan(scene, proposal=proposal)
