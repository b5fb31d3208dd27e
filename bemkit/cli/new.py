"""The command ``bemkit new``: a commented scene to start from."""

from __future__ import annotations

from pathlib import Path

import click

from bemkit.atomic_files import check_target, write_text
from bemkit.errors import InputError, printable


@click.command()
@click.argument("kind")
@click.argument("file", required=False)
def new(kind: str, file: str | None) -> None:
    """Write a commented scene of KIND to FILE, by default KIND.toml, ready for bemkit run.

    The kinds are block, cylinders, pin, rough-surface and wall. A file that exists is never replaced.
    """
    from bemkit.formulas import choices
    from bemkit.scene.toml import shipped_files

    scenes = shipped_files("new")
    if kind not in scenes:
        raise InputError(f"no kind {printable(kind)!r} of scene: the kinds are {choices(kind, list(scenes))}")
    target = Path(file or f"{kind}.toml")
    if target.suffix.lower() != ".toml":
        raise InputError(f"{printable(str(target))}: the ending of scene files is .toml: give {target.stem}.toml")
    if target.exists():
        raise InputError(f"{printable(str(target))} exists: give another name, or remove it")
    write_text(check_target(target), scenes[kind].read_text("utf-8"))
    print(f"{target}: edit it, then: bemkit run {target} --plot figures")
