"""The command ``bemkit critical-friction``."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import click

from bemkit.cli import options
from bemkit.cli.options import shown_progress
from bemkit.cli.outputs import Outputs, TextFile
from bemkit.errors import concerning
from bemkit.table import json_text

if TYPE_CHECKING:
    from bemkit.runs.critical_friction import CriticalFriction


@click.command("critical-friction")
@click.argument("scene")
@options.elements_option
@options.accuracy_option
@options.json_option
def critical_friction(scene: str, elements: int | None, accuracy: float | None, json_file: str | None) -> None:
    """Find the friction coefficients at which sliding states of SCENE lose uniqueness."""
    with shown_progress(quiet=False), concerning(scene):
        from bemkit.runs.critical_friction import critical_friction as critical_friction_of
        from bemkit.scene.toml import load_scene, with_overrides

        chosen = with_overrides(load_scene(scene), elements=elements, accuracy=accuracy)

        def as_json(found: CriticalFriction) -> str:
            return json_text({"title": chosen.title, **found.as_dict()})

        outputs = Outputs((TextFile(json_file, as_json),))
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
