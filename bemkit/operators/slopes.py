"""Slopes of displacements that are constant on elements, by which the double layer becomes one of the second order.

On each element the displacement is taken as u_j + g_j (y - x_j) in complex notation, with the slope g_j that the
midpoints of the element and its neighbours suggest; that is u_j + s_j p(t) with s_j = g_j l tau in the local coordinate
t of the element, p(t) = t on straight ones. The unknowns are still one displacement for each element. Rotations have
the slope i everywhere, and so are held exactly.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from bemkit.arrays import ComplexArray, IntArray, Run, consecutive_runs
from bemkit.geometry.mesh import BoundaryMesh
from bemkit.geometry.space import corner_nodes
from bemkit.operators.panels import Panels

SHARP = 0.3
"""Angle [rad] between neighbours from which on they have slopes of their own; polygons for curves turn by less."""


@dataclass(frozen=True, eq=False)
class Slopes:
    """Slopes as combinations of midpoint values: s = before u_previous + own u + after u_following.

    Parameters
    ----------
    previous, following : (n_elements,) array
        Neighbours along the boundary.
    before, own, after : (n_elements,) complex array
        Their weights; they sum to zero.
    """

    previous: IntArray
    following: IntArray
    before: ComplexArray
    own: ComplexArray
    after: ComplexArray

    @classmethod
    def of(cls, mesh: BoundaryMesh, panels: Panels) -> Slopes:
        """Return the least-squares slopes on a closed mesh.

        Notes
        -----
        With x_k the midpoints of an element and its neighbours and m their mean, sum c_k u_k with
        c_k = conj(x_k - m) / sum |x_j - m|^2 is the derivative of the complex-linear function nearest to u; along a
        straight side it is that of the nearest straight line. Slopes are not taken across corners, where they jump,
        unless an element has a corner at either end.
        """
        neighbours = np.empty((3, mesh.n_elements), dtype=np.intp)
        for loop in mesh.loops:
            neighbours[:, loop] = np.roll(loop, 1), loop, np.roll(loop, -1)
        counts = np.ones(neighbours.shape, bool)
        counts[0], counts[2] = ~corner_nodes(mesh, SHARP)[mesh.elements].T
        counts[:, counts.sum(axis=0) == 1] = True
        arm = panels.centre[neighbours]
        arm = np.where(counts, arm - np.mean(arm, axis=0, where=counts), 0.0)
        weights = arm.conj() / np.sum(np.square(arm.real) + np.square(arm.imag), axis=0)
        return cls(neighbours[0], neighbours[2], *(weights * (panels.half * panels.tangent)))

    def add_to(self, on: ComplexArray, on_slope: ComplexArray, *, is_conjugate: bool) -> None:
        """Add what slopes contribute to coefficients (n_rows, n_elements) of displacements, or of their conjugates."""
        own, after, before = (w.conj() if is_conjugate else w for w in (self.own, self.after, self.before))
        on += on_slope * own
        # a neighbour's slope takes this element as the one that follows, or precedes, it
        for weights, runs in ((after, self._runs[0]), (before, self._runs[1])):
            for target, source in runs:
                on[:, target] += on_slope[:, source] * weights[source]

    @cached_property
    def _runs(self) -> tuple[list[Run], list[Run]]:
        return consecutive_runs(self.previous), consecutive_runs(self.following)
