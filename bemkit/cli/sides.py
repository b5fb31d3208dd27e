"""The sides of a body, read and printed by ``bemkit outline``."""

from __future__ import annotations

import click
import numpy as np
from rich.text import Text

from bemkit.cli.outputs import plain_table, stdout_console
from bemkit.geometry.curves import Arc
from bemkit.geometry.files.chords import CORNER_ANGLE
from bemkit.geometry.files.shape_file import DrawingFile, MeshFile, is_drawing
from bemkit.geometry.outline import Outline, Side
from bemkit.geometry.vectors import norms

_SEEN = np.linspace(0.5 / 64, 1.0 - 0.5 / 64, 64)


def shape_file(
    file: str, scale: float | None, only: tuple[str, ...], corner_angle: float | None, tolerance: float | None
) -> MeshFile | DrawingFile:
    """Return the body in a mesh or a drawing."""
    if is_drawing(file):
        if corner_angle is not None:
            raise click.UsageError("--corner-angle is for meshes: the corners of a drawing are those that it has")
        return DrawingFile(file, scale, only, tolerance)
    if tolerance is not None:
        raise click.UsageError("--tolerance is for drawings: the lines of a mesh meet at its nodes")
    return MeshFile(file, scale, only, CORNER_ANGLE if corner_angle is None else corner_angle)


def print_sides(sides: Outline) -> None:
    """Print a line for each side, the size of the body and what was done to read it."""
    console = stdout_console()
    drawing = sides.drawing
    table = plain_table(("loop", "side", "group", "kind"), ("length", "from"), gap=2)
    for number, loop in enumerate(sides.loops):
        for side in loop:
            start = side.curve.point(np.zeros(1))[0]
            length = norms(side.curve.derivative(_SEEN)).mean()
            target = "outer" if number == 0 and not sides.is_exterior else f"hole {number}"
            texts = (target, side.name, side.group, _kind(side), f"{length:.6g}", f"({start[0]:.6g}, {start[1]:.6g})")
            table.add_row(*map(Text, texts))
    console.print(table)
    points = np.concatenate([side.curve.point(_SEEN) for side in sides.sides])
    width, height = np.ptp(points, axis=0).tolist()
    unit = f" {drawing.unit}" if drawing is not None and drawing.unit else ""
    console.print(Text(f"about {width:.4g} by {height:.4g}{unit}; the body lies on the left of every side"))
    for note in () if drawing is None else drawing.notes:
        console.print(Text(f"note: {note}", style="yellow"))


def _kind(side: Side) -> str:
    return "line" if side.curve.is_straight else "arc" if isinstance(side.curve, Arc) else "curve"
