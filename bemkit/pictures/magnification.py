"""How much displacements are enlarged in pictures: so that they are seen, and that what touches seems to touch."""

from __future__ import annotations

from collections.abc import Iterator
from math import floor, log10

import numpy as np

from bemkit.arrays import FloatArray
from bemkit.contact.obstacle import DirectedObstacle, Gap
from bemkit.pictures.overlap import drawn_overlap
from bemkit.pictures.shown import Shown
from bemkit.results.contact_table import ContactTable
from bemkit.scene.conditions import Contact
from bemkit.solvers.active_sets import NodeStatus

_EXAGGERATION = 0.08
"""The largest displacement is drawn about this long, in sizes of the picture."""
LINE = 0.003
"""Thickness of a line, in sizes of the picture."""


def magnification(shown: Shown, size: float | None = None) -> float:
    """Choose the factor by which displacements are drawn.

    Parameters
    ----------
    shown : Shown
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
    is_parting = (contact.status != NodeStatus.SEPARATED) & (contact.gap < 0.0)
    wanted = min(wanted, 1.0 + float(np.min(LINE * size / -contact.gap[is_parting], initial=np.inf)))
    if wanted <= 1.0 and (is_closing.any() or is_parting.any()):
        return 1.0
    return _rounded(wanted)


def _rounded(wanted: float) -> float:
    """Return the largest 1, 2 or 5 times a power of ten that is not larger."""
    power = 10.0 ** floor(log10(wanted))
    return power * max(step for step in (1.0, 2.0, 5.0) if step * power <= wanted or step == 1.0)


def _sinks(shown: Shown, factor: float, tolerance: float) -> bool:
    depths = (float(depth.max(initial=-np.inf)) for depth in drawn_depths(shown, factor))
    return any(depth > tolerance for depth in depths) or drawn_overlap(shown, factor) > tolerance


def drawn_depths(shown: Shown, factor: float) -> Iterator[FloatArray]:
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
