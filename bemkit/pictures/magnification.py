"""Magnification of displacements in pictures: they are visible, and bodies in contact are drawn in contact."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import permutations
from math import floor, log10

import numpy as np

from bemkit.arrays import FloatArray
from bemkit.contact.obstacle import DirectedObstacle, Gap
from bemkit.geometry.pieces import overlapping_boxes
from bemkit.geometry.proximity.location import Locator
from bemkit.pictures.shown import DrawnScene
from bemkit.results.contact_table import ContactTable
from bemkit.scene.conditions import Contact

_EXAGGERATION = 0.08
"""Drawn length of the largest displacement, relative to the picture."""
LINE = 0.003
"""Thickness of a line, relative to the picture."""


def magnification(shown: DrawnScene, size: float | None = None) -> float:
    """Choose the factor by which displacements are drawn.

    Parameters
    ----------
    shown : DrawnScene
    size : float, optional [m]
        Of the picture; that of all bodies by default.

    Returns
    -------
    float
        1, 2 or 5 times a power of ten: the largest displacement is seen, nothing is drawn inside its partner and no
        node that touches apart from it, by more than a line is thick. 1 if that is impossible, or if nothing
        moves.
    """
    size = shown.size if size is None else size
    factor = exaggeration(size, shown.displacement, shown.contact)
    while factor > 1.0 and _sinks(shown, factor, LINE * size):
        factor = _rounded(0.99 * factor)
    return max(factor, 1.0) if shown.contact.n_contact else factor


def exaggeration(size: float, displacement: FloatArray, contact: ContactTable) -> float:
    """Choose the factor of displacements (n, 2) [m] in a picture of a size [m] by gaps and displacements along normals.

    See `magnification`, which knows the curves of obstacles besides.
    """
    largest = float(np.hypot(*displacement.T).max())
    if not 0.0 < largest < np.inf:
        return 1.0
    wanted = _EXAGGERATION * size / largest
    is_closing = np.isfinite(contact.gap) & (contact.u_n > 0.0)
    room = np.maximum(contact.gap[is_closing], 0.0) + LINE * size
    wanted = min(wanted, float(np.min(room / contact.u_n[is_closing], initial=np.inf)))
    # bodies that overlap as they are drawn part by the overlap, and not by a multiple of it
    is_parting = contact.is_closed & (contact.gap < 0.0)
    wanted = min(wanted, 1.0 + float(np.min(LINE * size / -contact.gap[is_parting], initial=np.inf)))
    if wanted <= 1.0 and (is_closing.any() or is_parting.any()):
        return 1.0
    return _rounded(wanted)


def _rounded(wanted: float) -> float:
    """Return the largest 1, 2 or 5 times a power of ten that is not larger."""
    power = 10.0 ** floor(log10(wanted))
    return power * max(step for step in (1.0, 2.0, 5.0) if step * power <= wanted or step == 1.0)


def _sinks(shown: DrawnScene, factor: float, tolerance: float) -> bool:
    depths = (float(depth.max(initial=-np.inf)) for depth in drawn_depths(shown, factor))
    return any(depth > tolerance for depth in depths) or drawn_overlap(shown, factor) > tolerance


def drawn_depths(shown: DrawnScene, factor: float) -> Iterator[FloatArray]:
    """Yield how deep [m] each contact part is drawn inside a rigid obstacle that knows its distance, at its corners."""
    xi = np.array([-1.0, 0.0])
    for body in shown.bodies:
        for part, elements in body.parts:
            condition = part.condition
            if not isinstance(condition, Contact) or isinstance(condition.obstacle, Gap):
                continue
            if isinstance(condition.obstacle, DirectedObstacle):
                points = body.mesh.points(elements, xi) + factor * body.displacement_at(elements, xi)
                normals = body.mesh.normals_at(elements, xi)
                yield -condition.obstacle.gap(points.reshape(-1, 2), normals.reshape(-1, 2))


def drawn_overlap(shown: DrawnScene, factor: float) -> float:
    """Return how much deeper [m] bodies overlap as drawn than in their true positions.

    Sliding along curved sides brings that about.

    Parameters
    ----------
    shown : DrawnScene
    factor : float
        By which displacements are enlarged.
    """
    bodies = [body for body in shown.bodies if body.mesh.surface is None]
    if len(bodies) < 2:
        return 0.0
    moved, initial = ([body.outlines(by) for body in bodies] for by in (factor, 0.0))
    low, high = (np.array([extreme(np.concatenate(loops), axis=0) for loops in moved]) for extreme in (np.min, np.max))
    deepest = 0.0
    for first, second in zip(*overlapping_boxes(low, high), strict=True):
        for one, other in permutations((first, second)):
            now = _depth(np.concatenate(moved[one]), moved[other])
            if now.max() > deepest:
                before = _depth(np.concatenate(initial[one]), initial[other])
                deepest = max(deepest, float((now - before).max()))
    return deepest


def _depth(points: FloatArray, loops: list[FloatArray]) -> FloatArray:
    """Return how deep (n,) [m] points (n, 2) are inside the body within closed loops, zero outside."""
    starts, ends = (np.concatenate([loop[piece] for loop in loops]) for piece in (slice(-1), slice(1, None)))
    return Locator.of_pieces(starts, ends).depths(points)
