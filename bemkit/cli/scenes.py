"""The command ``bemkit scenes``."""

from __future__ import annotations

import click

from bemkit.cli.options import shown_progress


@click.command()
def scenes() -> None:
    """List the scenes that are shipped with bemkit."""
    with shown_progress(quiet=False):
        from bemkit.scene.toml import shipped_scenes

        titles = shipped_scenes()
    width = max(map(len, titles))
    for name, title in titles.items():
        print(f"{name:<{width}}  {title}")
