"""Axes in which bodies are drawn: equal scales, a frame, bodies before and after, places for symbols."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from bemkit.arrays import FloatArray, IntArray
from bemkit.geometry.neighbours import along_boundary, at_arc_lengths
from bemkit.geometry.symmetry.lines import Symmetry
from bemkit.pictures.drawing import BLUE, GREY, Axes, axes_or_new
from bemkit.pictures.shown import DrawnBody, DrawnScene
from bemkit.scene.unit_names import UnitNames, with_unit

if TYPE_CHECKING:
    from matplotlib.path import Path

BODY = "#DCEBF5"
_WIDTH = 6.4


def plane_axes(axes: Axes | None, frame: FloatArray, title: str, units: UnitNames | None) -> Axes:
    """Return axes with equal scales and names, new ones as high as what they hold needs.

    Parameters
    ----------
    axes : Axes or None
    frame : (2, 2) array [m]
        Least and largest x, least and largest y.
    title : str
    units : UnitNames or None
    """
    width, height = np.ptp(frame, axis=1)
    axes = axes_or_new(axes, _WIDTH, float(np.clip(_WIDTH * height / (width or height or 1.0) + 1.8, 3.4, 8.0)))
    axes.set_aspect("equal")
    axes.set_xlabel(with_unit("$x$", "length", units))
    axes.set_ylabel(with_unit("$y$", "length", units))
    axes.set_title(title, parse_math=False, fontsize=11)
    return axes


def draw_bodies(axes: Axes, shown: DrawnScene, factor: float) -> None:
    """Draw the outlines of bodies, dashed, and the bodies moved by a factor times their displacements."""
    moved = f"deformed, displacements \u00d7 {factor:g}"
    for body in shown.bodies:
        before, after = body.outlines(0.0), body.outlines(factor)
        for initial, deformed in zip(before, after, strict=True):
            axes.plot(*initial.T, color=GREY, linestyle="--", linewidth=1.0, label="initial")
            axes.plot(*deformed.T, color=BLUE, linewidth=1.6, label=moved)
        fill(axes, body, after, shown.frame)


def draw_initial(axes: Axes, shown: DrawnScene, *, is_filled: bool = False, factor: float = 0.0) -> None:
    """Draw the bodies where they are before they move, or after a multiple of their displacement."""
    for body in shown.bodies:
        loops = body.outlines(factor)
        for loop in loops:
            axes.plot(*loop.T, color=BLUE if is_filled else GREY, linewidth=1.2 if is_filled else 0.8, zorder=1.5)
        if is_filled:
            fill(axes, body, loops, shown.frame)


def fill(axes: Axes, body: DrawnBody, loops: list[FloatArray], frame: FloatArray) -> None:
    """Fill the inside of a body; holes run the other way round and stay open."""
    from matplotlib.patches import PathPatch

    # no patch that sets limits: these would be sought along each of a million elements
    axes.add_artist(PathPatch(inside(body, loops, frame), facecolor=BODY, edgecolor="none", zorder=1))


def inside(body: DrawnBody, loops: list[FloatArray], frame: FloatArray) -> Path:
    """Return the path around a body whose closed loops are given; an exterior ends far outside of the frame."""
    from matplotlib.path import Path

    if body.mesh.surface is not None:
        (strip,) = loops
        deep = -4.0 * np.ptp(frame, axis=1).max() * body.mesh.normals[0]
        loops = [np.concatenate([strip, strip[-1:] + deep, strip[:1] + deep, strip[:1]])]
    elif body.mesh.is_exterior:
        far = 4.0 * np.ptp(frame, axis=1).max()
        (left, right), (bottom, top) = frame + np.array([-far, far])
        corners = np.array([[left, bottom], [right, bottom], [right, top], [left, top], [left, bottom]])
        loops = [corners, *loops]
    return Path.make_compound_path(*(Path(loop, closed=True) for loop in loops))


def draw_symmetry_lines(axes: Axes, symmetry: Symmetry | None) -> None:
    """Draw the lines about which a scene is symmetric."""
    if symmetry is not None and symmetry.x is not None:
        axes.axvline(symmetry.x, color="black", linestyle="-.", linewidth=0.8)
    if symmetry is not None and symmetry.y is not None:
        axes.axhline(symmetry.y, color="black", linestyle="-.", linewidth=0.8)


def draw_arrows(
    axes: Axes, tails: FloatArray, arrows: FloatArray, colour: str, label: str, *, is_hollow: bool = False
) -> None:
    """Draw arrows (n, 2) [m] from their tails (n, 2) [m]."""
    axes.quiver(
        *tails.T,
        *arrows.T,
        angles="xy",
        scale_units="xy",
        scale=1.0,
        units="inches",
        width=0.03 if is_hollow else 0.02,
        headwidth=4.5,
        color="white" if is_hollow else colour,
        edgecolor=colour,
        linewidth=1.0 if is_hollow else 0.0,
        zorder=3,
    )
    marker = r"$\Downarrow$" if is_hollow else r"$\rightarrow$"
    axes.plot([], [], linestyle="", marker=marker, markersize=14, color=colour, label=label)


def set_frame(axes: Axes, frame: FloatArray, margin: float = 0.08) -> None:
    """Show a frame (2, 2) [m] with some margin, in shares of its longer side."""
    spare = margin * float(np.ptp(frame, axis=1).max())
    axes.set_xlim(frame[0, 0] - spare, frame[0, 1] + spare)
    axes.set_ylim(frame[1, 0] - spare, frame[1, 1] + spare)


def joined_frame(*points: FloatArray) -> FloatArray:
    """Return the frame (2, 2) around points (n, 2)."""
    every = np.concatenate(points)
    return np.stack([every.min(axis=0), every.max(axis=0)], axis=1)


class BoundaryPoints(NamedTuple):
    """Points of the undeformed boundary, how they are drawn, and unit normals out of the body, all (n, 2)."""

    points: FloatArray
    drawn: FloatArray
    normals: FloatArray


def evenly_spaced(body: DrawnBody, elements: IntArray, spacing: float, factor: float) -> BoundaryPoints:
    """Return places about evenly spaced along elements, one at least.

    Parameters
    ----------
    body : DrawnBody
    elements : (m,) array
    spacing, factor : float
        Distance [m] of neighbours, and by how much displacements are enlarged.
    """
    elements = along_boundary(body.mesh, elements)
    length = body.mesh.lengths[elements].cumsum()[-1]
    n = max(1, round(length / spacing))
    position, xi = at_arc_lengths(body.mesh, elements, (np.arange(n) + 0.5) * length / n)
    elements, xi = elements[position], xi[:, None]
    points = body.mesh.points(elements, xi)
    drawn = points + factor * body.displacement_at(elements, xi)
    return BoundaryPoints(points[:, 0], drawn[:, 0], body.mesh.normals_at(elements, xi)[:, 0])
