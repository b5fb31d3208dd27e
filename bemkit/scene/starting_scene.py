"""A scene to start from: the body of a file pressed onto a rigid floor, as text that its reader changes."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import fields
from types import MappingProxyType

import numpy as np

from bemkit.geometry.files.shape_file import ShapeFile
from bemkit.geometry.outline import Outline
from bemkit.geometry.vectors import norms, turned_right
from bemkit.scene.registry import SHAPES

START = "# A scene to start from"
"""How such texts begin."""
_SQUEEZE = 1e-3
"""Share of its height by which the body is pressed together."""
_LEAST_ELEMENTS, _ELEMENTS_OF_SIDE = 160, 6
_FACING = 0.7
"""Mean upward or downward component of the normals of sides that are held or touch the floor."""
_NEAR = 0.05
"""Share of the height within which such a side begins from the lowest or highest point."""
_REACHED = 1e-6
"""Share of the height within which one of them must come to it."""
_STEEL: Mapping[str, tuple[float, str]] = MappingProxyType(
    {"mm": (210000.0, "MPa"), "cm": (2.1e7, "N/cm^2"), "m": (2.1e11, "Pa"), "in": (3.05e7, "psi")}
)
"""Young's modulus of steel, and its unit, for units of length."""
_SEEN = np.linspace(0.0, 1.0, 257)


def starting_scene(source: ShapeFile, file: str) -> str:
    """Return a scene that runs as it is: the body is pressed down onto a rigid floor with friction.

    Parameters
    ----------
    source : MeshFile or DrawingFile
        Read with the options that the scene states.
    file : str
        Its name from the folder of the scene.

    Returns
    -------
    str
        TOML with remarks.
    """
    outline = source.outline()
    points = np.concatenate([side.curve.point(_SEEN) for side in outline.sides])
    low, high = float(points[:, 1].min()), float(points[:, 1].max())
    height = high - low
    youngs_modulus, stress = _STEEL.get(source.shape.unit, (210000.0, ""))
    floor = _facing(outline, -1.0, low, height) or f'where = "y < {low + 0.2 * height:.6g}"'
    grip = _facing(outline, 1.0, high, height) or f'where = "y > {high - 0.1 * height:.6g}"'
    lines = [
        f"{START}, written by bemkit outline. Sides: {_listed(outline.selectable_names)}",
        f"title = {_text(f'Part of {file}')}",
        'discretisation = "quadratic"',
        f"units = {{ length = {_text(source.shape.unit)}, stress = {_text(stress)} }}" if stress else "",
        f"\n[shape]\nkind = {_text(SHAPES.kind_of(source))}\nfile = {_text(file)}",
        *(f"{name} = {value}" for name, value in _options(source).items()),
        f"\n# steel{'' if stress else ', if lengths are in mm and stresses in MPa'}",
        f"[material]\nyoungs_modulus = {youngs_modulus}\npoisson_ratio = 0.3",
        '\n[law]\nkind = "coulomb"\nfriction_coefficient = 0.3',
        f"\n[mesh]\nelements = {max(_LEAST_ELEMENTS, _ELEMENTS_OF_SIDE * len(outline.sides))}",
        f"\n# what may touch the rigid floor\n[parts.floor]\n{floor}",
        f'condition = {{ kind = "contact", obstacle = {{ kind = "half-plane", point = [0.0, {low!r}] }} }}',
        f"\n# what is held, and moved down by a thousandth of the height\n[parts.grip]\n{grip}",
        f'condition = {{ kind = "displacement", x = 0.0, y = {-_SQUEEZE * height:.3g} }}',
    ]
    return "\n".join(line for line in lines if line) + "\n"


def _options(source: ShapeFile) -> dict[str, str]:
    """Return how the file is read, as TOML, where it is not by default."""
    chosen = ((entry, getattr(source, entry.name)) for entry in fields(source) if entry.name != "file")
    return {entry.name: json.dumps(value, ensure_ascii=False) for entry, value in chosen if value != entry.default}


def _text(text: str | list[str]) -> str:
    return json.dumps(text, ensure_ascii=False)


def _facing(outline: Outline, sense: float, level: float, height: float) -> str:
    """Return the sides that face up (+1) or down (-1) near a level, as TOML; empty if none of them reaches it."""
    names, reached = [], np.inf
    for side in outline.sides:
        tangents, points = side.curve.derivative(_SEEN), side.curve.point(_SEEN)
        upward = (turned_right(tangents) / norms(tangents)[:, None])[:, 1].mean()
        distance = np.abs(points[:, 1] - level).min()
        if sense * upward > _FACING and distance <= _NEAR * height:
            names.append(side.name)
            reached = min(reached, distance)
    return f"sides = {_text(names)}" if reached <= _REACHED * height else ""


def _listed(names: Sequence[str]) -> str:
    shown = ", ".join(names[:20])
    return f"{shown}{', ...' if len(names) > 20 else ''}"
