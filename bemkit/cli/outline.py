"""The command ``bemkit outline``: the body in a mesh, drawing or scene file, and a scene to start from."""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from bemkit.cli import options
from bemkit.cli.options import shown_progress
from bemkit.cli.outputs import Outputs, TextFile

if TYPE_CHECKING:
    from bemkit.geometry.outline import Outline
    from bemkit.geometry.shapes import Shape


@click.command()
@click.argument("file")
@click.option("-o", "--output", metavar="SCENE", help="Write a scene to start from (TOML).")
@options.plot_option
@click.option("--scale", type=float, metavar="F", help="Factor of all coordinates in the file.")
@click.option(
    "--only",
    multiple=True,
    metavar="NAME,...",
    callback=options.names_of,
    help="Surfaces, layers or ids of the body.",
)
@click.option(
    "--corner-angle", type=float, metavar="A", help="Degrees by which chords of a smooth curve may turn (25)."
)
@click.option("--tolerance", type=float, metavar="T", help="Gaps of a drawing that are closed (1e-5 of its size).")
def outline(
    file: str,
    output: str | None,
    folder: str | None,
    scale: float | None,
    only: tuple[str, ...],
    corner_angle: float | None,
    tolerance: float | None,
) -> None:
    """Show the sides of the body in FILE: a mesh, a drawing (.dxf, .svg), or a scene (.toml, or a shipped one).

    With -o write a scene to start from: the body pressed onto a rigid floor, ready for bemkit run.
    """
    with shown_progress(quiet=False):
        from bemkit.cli.sides import print_sides, shape_file
        from bemkit.cli.starting_scene import starting_scene
        from bemkit.geometry.files.shape_file import DrawingFile, MeshFile
        from bemkit.pictures.outline import draw_outline
        from bemkit.scene.toml import load_scene, shipped_files, single_body

        shape: Shape
        if Path(file).suffix.lower() == ".toml" or (file in shipped_files() and not Path(file).exists()):
            if output or scale or only or corner_angle is not None or tolerance:
                raise click.UsageError("a scene file says how its shape is read: give no other option than --plot")
            scene = single_body(load_scene(file), file)
            shape, units = scene.only.shape, scene.units
        else:
            shape, units = shape_file(file, scale, only, corner_angle, tolerance), None
        text = TextFile[str](output, str)

        def drawn(each: Outline) -> dict[str, Any]:
            return {"outline": draw_outline(each, Path(file).name, units=units).get_figure(root=True)}

        figures = Outputs((), folder, drawn, "outline")
        figures.check(text.check())
        sides = shape.outline()
    print_sides(sides)
    figures.write(sides)
    if output is not None and isinstance(shape, MeshFile | DrawingFile):
        relative = os.path.relpath(Path(file).resolve(), Path(output).resolve().parent)
        text.write(starting_scene(shape, Path(relative).as_posix()))
