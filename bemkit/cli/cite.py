"""The command ``bemkit cite``."""

from __future__ import annotations

from pathlib import Path

import click

from bemkit.cli.options import shown_progress
from bemkit.results.streams import print_data


@click.command()
@click.argument("subject", metavar="SCENE_OR_RESULT")
@click.option("--bibtex", "is_bibtex", is_flag=True, help="Print the entries of a BibTeX file.")
def cite(subject: str, is_bibtex: bool) -> None:
    """Name the works to cite for SCENE_OR_RESULT: a scene, or a file written by bemkit run -o that ends in .h5."""
    with shown_progress(quiet=False):
        from bemkit.results.citations import cite as works_behind
        from bemkit.results.result_file import read_result
        from bemkit.scene.toml import load_scene

        citations = works_behind(read_result(subject) if Path(subject).suffix == ".h5" else load_scene(subject))
    print_data((citations.bibtex() if is_bibtex else str(citations)) + "\n")
