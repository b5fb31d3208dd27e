"""The command ``bemkit schema``."""

from __future__ import annotations

import json

import click

from bemkit.cli.options import shown_progress
from bemkit.results.streams import print_data


@click.command()
def schema() -> None:
    """Print the JSON schema of scene files, by which editors check them while they are written."""
    with shown_progress(quiet=False):
        from bemkit.scene.schema import scene_schema

        text = json.dumps(scene_schema(), indent=1, ensure_ascii=False, allow_nan=False)
    print_data(text + "\n")
