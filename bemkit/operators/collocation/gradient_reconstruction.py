"""Slopes of displacements that are constant on elements, by which the double layer becomes one of the second order.

On each element the displacement is taken as u_j + g_j (y - x_j) in complex notation, with the slope g_j that the
midpoints of the element and its neighbours suggest; that is u_j + s_j p(t) with s_j = g_j l tau in the local coordinate
t of the element, p(t) = t on straight ones. The unknowns are still one displacement for each element. Rotations have
the slope i everywhere, and so are held exactly.

The parabola through the three midpoints differs from that in the mean by b_j (l tau)^2 / 3, b_j its leading
coefficient, and this much is added to the constant part. Without it a bent body seems to be displaced by h^2 / 24 of
its curvature everywhere but at the midpoint itself, which makes thin bodies wrong.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from bemkit.arrays import BoolArray, ComplexArray, IntArray, Run, consecutive_runs
from bemkit.geometry.mesh import BoundaryMesh
from bemkit.geometry.neighbours import corner_nodes
from bemkit.operators.integrals.panels import Panels

CORNER_ANGLE = 0.3
"""Angle [rad] between neighbours from which on they have slopes of their own; polygons for curves turn by less."""


@dataclass(frozen=True, eq=False)
class GradientReconstruction:
    """Slopes as combinations of the midpoint values of an element and its neighbours.

    Parameters
    ----------
    neighbours : (3, n_elements) array
        The element before, the element itself, and the one after it along the boundary.
    slopes : (3, n_elements) complex array
        Weights of their values in the slope; they sum to zero.
    means : (3, n_elements) complex array
        Weights of the same values in what is added to the constant part; they sum to zero.
    """

    neighbours: IntArray
    slopes: ComplexArray
    means: ComplexArray

    @classmethod
    def of(cls, mesh: BoundaryMesh, panels: Panels) -> GradientReconstruction:
        """Return the least-squares slopes on a closed mesh.

        Notes
        -----
        With x_k the midpoints of an element and its neighbours and m their mean, sum c_k u_k with
        c_k = conj(x_k - m) / sum |x_j - m|^2 is the derivative of the complex-linear function nearest to u; along a
        straight side it is that of the nearest straight line. Slopes are not taken across corners, where they jump,
        unless an element has a corner at either end; parabolas are not taken past any.
        """
        neighbours = np.empty((3, mesh.n_elements), dtype=np.intp)
        for loop in mesh.loops:
            neighbours[:, loop] = np.roll(loop, 1), loop, np.roll(loop, -1)
        is_corner = corner_nodes(mesh, CORNER_ANGLE)[mesh.elements].T
        centre, half = panels.centre[neighbours], panels.half * panels.tangent
        counts = np.ones(neighbours.shape, bool)
        counts[0], counts[2] = ~is_corner
        is_smooth = counts.all(axis=0) & (neighbours[0] != neighbours[2])
        counts[:, counts.sum(axis=0) == 1] = True
        arm = np.where(counts, centre - np.mean(centre, axis=0, where=counts), 0.0)
        weights = arm.conj() / np.sum(np.square(arm.real) + np.square(arm.imag), axis=0)
        return cls(neighbours, weights * half, _means(centre, half, is_smooth))

    def add_to(self, on: ComplexArray, on_slope: ComplexArray, *, is_conjugate: bool) -> None:
        """Add what slopes contribute to coefficients (n_rows, n_elements) of displacements, or of their conjugates."""
        before, own, after = self._of_value(on, on_slope, is_conjugate)
        on += own
        # a neighbour's slope takes this element as the one that follows, or precedes, it
        for contribution, runs in ((after, self._runs[0]), (before, self._runs[1])):
            for target, source in runs:
                on[:, target] += contribution[:, source]

    def _of_value(self, on: ComplexArray, on_slope: ComplexArray, is_conjugate: bool) -> tuple[ComplexArray, ...]:
        """Return the coefficients of the values before, on and after each element."""
        slopes, means = (self.slopes.conj(), self.means.conj()) if is_conjugate else (self.slopes, self.means)
        return tuple(on_slope * slope + on * mean for slope, mean in zip(slopes, means, strict=True))

    @cached_property
    def _runs(self) -> tuple[list[Run], list[Run]]:
        return consecutive_runs(self.neighbours[0]), consecutive_runs(self.neighbours[2])


def _means(centre: ComplexArray, half: ComplexArray, is_smooth: BoolArray) -> ComplexArray:
    """Return (3, n_elements) weights of the mean of b (y - x)^2, b by divided differences of the three midpoints."""
    previous, own, following = centre
    back, ahead = np.where(is_smooth, previous - own, -1.0), np.where(is_smooth, following - own, 1.0)
    of_mean = np.where(is_smooth, half**2 / 3.0, 0.0) / (ahead - back)
    return np.array([-of_mean / back, of_mean / back - of_mean / ahead, of_mean / ahead])
