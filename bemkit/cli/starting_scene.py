"""A scene to start from: the body of a file pressed onto a rigid floor, as text to edit."""

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
"""Compression of the body, relative to its height."""
_LEAST_ELEMENTS, _ELEMENTS_OF_SIDE = 160, 6
_FACING_UP, _FACING_FLOOR = 0.7, 0.3
"""Least mean upward component of the normals of held sides, and downward component for sides that may touch."""
_NEAR = 0.05
"""Distance from the top or the floor within which they lie, relative to the height."""
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
    floor, grip = _chosen(outline, low, high)
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
    """Return the options of reading the file that are no defaults, as TOML."""
    chosen = ((entry, getattr(source, entry.name)) for entry in fields(source) if entry.name != "file")
    return {entry.name: json.dumps(value, ensure_ascii=False) for entry, value in chosen if value != entry.default}


def _text(text: str | list[str]) -> str:
    return json.dumps(text, ensure_ascii=False)


def _chosen(outline: Outline, low: float, high: float) -> tuple[str, str]:
    """Return the sides that may touch the floor and those held at the top, as TOML; they share no piece of boundary."""
    height = high - low
    touching, held = [], []
    for side in outline.sides:
        tangents, y = side.curve.derivative(_SEEN), side.curve.point(_SEEN)[:, 1]
        upward = (turned_right(tangents) / norms(tangents)[:, None])[:, 1]
        if ((y < low + _NEAR * height) & (upward < -_FACING_FLOOR)).any():
            touching.append(side.name)
        elif upward.mean() > _FACING_UP and y.max() > high - _NEAR * height:
            held.append(side.name)
    if touching and held:
        return f"sides = {_text(touching)}", f"sides = {_text(held)}"
    sides = f"sides = {_text(touching)}\n" if touching else ""
    return f'{sides}where = "y < {low + 0.3 * height:.6g}"', f'where = "y > {high - 0.1 * height:.6g}"'


def _listed(names: Sequence[str]) -> str:
    shown = ", ".join(names[:20])
    return f"{shown}{', ...' if len(names) > 20 else ''}"
