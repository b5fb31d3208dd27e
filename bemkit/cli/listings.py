"""The commands ``bemkit scenes``, ``schema`` and ``cite``: scenes, their schema, and references."""

from __future__ import annotations

import json
from pathlib import Path

import click

from bemkit.cli.options import shown_progress
from bemkit.cli.process import print_data


@click.command()
def scenes() -> None:
    """List the scenes that are shipped with bemkit."""
    with shown_progress(quiet=False):
        from bemkit.scene.toml import shipped_scenes

        titles = shipped_scenes()
    width = max(map(len, titles))
    for name, title in titles.items():
        print(f"{name:<{width}}  {title}")


@click.command()
def schema() -> None:
    """Print the JSON schema of scene files, by which editors check them while they are written."""
    with shown_progress(quiet=False):
        from bemkit.scene.schema import scene_schema

        text = json.dumps(scene_schema(), indent=1, ensure_ascii=False, allow_nan=False)
    print_data(text + "\n")


@click.command()
@click.argument("subject", metavar="SCENE_OR_RESULT")
def cite(subject: str) -> None:
    """Print what to cite for SCENE_OR_RESULT, a scene or a result file that ends in .h5 or .hdf5, as a BibTeX file."""
    with shown_progress(quiet=False):
        from bemkit.cli.sources import RESULT_ENDINGS
        from bemkit.results.citations import cite as works_behind
        from bemkit.results.result_file import read_result
        from bemkit.scene.toml import load_scene

        is_result = Path(subject).suffix.lower() in RESULT_ENDINGS
        citations = works_behind(read_result(subject) if is_result else load_scene(subject))
    print_data(f"{citations}\n")
