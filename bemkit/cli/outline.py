"""The command ``bemkit outline``: what is read of a mesh, drawing or scene file, and a scene to start from."""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING

import click
import numpy as np
from rich.text import Text

from bemkit.geometry.curves import Arc
from bemkit.geometry.drawn import drawn_shape
from bemkit.geometry.files.chords import CORNER_ANGLE
from bemkit.geometry.files.shape_file import DrawingFile, MeshFile, is_drawing
from bemkit.geometry.outline import Outline, Side
from bemkit.geometry.shapes import Shape
from bemkit.geometry.vectors import norms
from bemkit.results.drawing import new_figure
from bemkit.results.outputs import Outputs, TextFile, plain_table, stdout_console
from bemkit.scene.starting_scene import START, starting_scene
from bemkit.scene.toml import load_single_body
from bemkit.scene.unit_names import UnitNames

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_SEEN = np.linspace(0.5 / 64, 1.0 - 0.5 / 64, 64)


@click.command()
@click.argument("file")
@click.option("-o", "--output", metavar="SCENE", help="Write a scene to start from (TOML) that names the file.")
@click.option("--plot", "folder", metavar="DIR", help="Draw outline.png into a folder.")
@click.option("--scale", type=float, metavar="F", help="Times the numbers of the file.")
@click.option("--only", multiple=True, metavar="NAME", help="Surface, layer or id of the body; may be repeated.")
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
    """Show the sides of the body in FILE: a mesh, a drawing (.dxf, .svg), or a scene (.toml).

    With -o write a scene to start from: the body pressed onto a rigid floor, ready for bemkit run.
    """
    shape: Shape
    if Path(file).suffix.lower() == ".toml":
        if output or scale or only or corner_angle is not None or tolerance:
            raise click.UsageError("a scene file says how its shape is read: give no other option than --plot")
        scene = load_single_body(file)
        shape, units = scene.shape, scene.units
    else:
        shape, units = _shape_file(file, scale, only, corner_angle, tolerance), None
    text = TextFile[str](output, "scene to start from", START, str)
    figures = Outputs[Outline]((), folder, lambda each: {"outline": _figure(each, file, units)}, "outline")
    figures.check(text.check())
    sides = shape.outline()
    _print_sides(shape, sides)
    figures.write(sides)
    if output is not None and isinstance(shape, MeshFile | DrawingFile):
        relative = os.path.relpath(Path(file).resolve(), Path(output).resolve().parent)
        text.write(starting_scene(shape, Path(relative).as_posix()))


def _shape_file(
    file: str, scale: float | None, only: tuple[str, ...], corner_angle: float | None, tolerance: float | None
) -> MeshFile | DrawingFile:
    if is_drawing(file):
        if corner_angle is not None:
            raise click.UsageError("--corner-angle is for meshes: the corners of a drawing are those that it has")
        return DrawingFile(file, scale, only, tolerance)
    if tolerance is not None:
        raise click.UsageError("--tolerance is for drawings: the lines of a mesh meet at its nodes")
    return MeshFile(file, scale, only, CORNER_ANGLE if corner_angle is None else corner_angle)


def _print_sides(shape: Shape, sides: Outline) -> None:
    console = stdout_console()
    drawn = drawn_shape(shape)
    table = plain_table(("loop", "side", "group", "kind"), ("length", "from"), gap=2)
    for number, loop in enumerate(sides.loops):
        for side in loop:
            start = side.curve.point(np.zeros(1))[0]
            length = norms(side.curve.derivative(_SEEN)).mean()
            place = "outer" if number == 0 and not sides.is_exterior else f"hole {number}"
            texts = (place, side.name, side.group, _kind(side), f"{length:.6g}", f"({start[0]:.6g}, {start[1]:.6g})")
            table.add_row(*map(Text, texts))
    console.print(table)
    points = np.concatenate([side.curve.point(_SEEN) for side in sides.sides])
    width, height = np.ptp(points, axis=0).tolist()
    unit = f" {drawn.unit}" if drawn is not None and drawn.unit else ""
    console.print(Text(f"about {width:.6g} by {height:.6g}{unit}; the body lies on the left of every side"))
    for note in drawn.notes if drawn is not None else ():
        console.print(Text(f"note: {note}", style="yellow"))


def _kind(side: Side) -> str:
    return "line" if side.curve.is_straight else "arc" if isinstance(side.curve, Arc) else "curve"


def _figure(sides: Outline, file: str, units: UnitNames | None) -> Figure:
    from bemkit.pictures.outline import draw_outline

    figure = new_figure(7.0, 5.2)
    draw_outline(sides, Path(file).name, figure.add_subplot(), units=units)
    return figure
