"""The surface of a half-plane: a boundary that is a straight strip instead of closed loops."""

from dataclasses import dataclass

import numpy as np

from bemkit.arrays import FloatArray, IntArray
from bemkit.errors import GeometryError, format_point
from bemkit.geometry.vectors import norms

_STRAIGHT = 1e-9
"""Distance of a node from the line between the ends of the strip that is round-off, relative to its length."""


@dataclass(frozen=True)
class Surface:
    """Marks an outline or a mesh as a strip of the surface of a half-plane, free of traction elsewhere.

    Parameters
    ----------
    is_periodic : bool
        Whether the strip is one period of a periodic surface.
    """

    is_periodic: bool = False

    def check(self, nodes: FloatArray, elements: IntArray, is_exterior: bool) -> None:
        """Raise GeometryError unless the elements are one straight strip, in order, of an unsymmetric exterior."""
        if not is_exterior:
            raise GeometryError("BoundaryMesh: surface is given: a half-plane is an exterior without symmetry lines")
        n = len(elements)
        if not np.array_equal(elements, np.column_stack([np.arange(n), np.arange(1, n + 1)])):
            raise GeometryError(
                "BoundaryMesh: the elements of a half-plane are not in order: let element i join the nodes i and i + 1"
            )
        chord = nodes[-1] - nodes[0]
        length = float(np.hypot(*chord))
        steps = np.diff(nodes, axis=0)
        across = (nodes - nodes[0]) @ np.array([-chord[1], chord[0]]) / length
        worst = int(np.argmax(np.abs(across)))
        if abs(across[worst]) > _STRAIGHT * length or np.any(steps @ chord <= 0.0) or not norms(steps).all():
            raise GeometryError(
                f"BoundaryMesh: the surface of a half-plane is straight, but its node at {format_point(nodes[worst])} "
                f"lies {abs(across[worst]):.3g} beside the line between its ends, or the nodes turn back: give nodes "
                "on a line, in order"
            )
