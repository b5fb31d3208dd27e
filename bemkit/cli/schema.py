"""The command ``bemkit schema``."""

from __future__ import annotations

import json

import click

from bemkit.results.outputs import print_data
from bemkit.scene.schema import scene_schema


@click.command()
def schema() -> None:
    """Print the JSON schema of scene files, by which editors check them while they are written."""
    print_data(json.dumps(scene_schema(), indent=1, ensure_ascii=False, allow_nan=False) + "\n")
