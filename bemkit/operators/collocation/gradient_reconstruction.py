"""Slopes of displacements that are constant on elements; they give the double layer second order.

In complex notation the displacement on element j is u_j + g_j (y - x_j), with a slope g_j from the midpoint values of
the element and its neighbours. In the local coordinate t this is u_j + s_j p(t) with s_j = g_j l tau, and p(t) = t on
straight elements. Each element still has one unknown displacement. Rotations have the slope i on all elements, so they
are represented exactly.

The mean of the parabola through the three midpoint values differs from u_j by b_j (l tau)^2 / 3, with its leading
coefficient b_j. This difference is added to the constant part. Without it the displacement of a bent body would be off
by h^2 / 24 times its curvature except at the midpoint, which makes results of thin bodies wrong.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from bemkit.arrays import BoolArray, ComplexArray, IntArray, Run, consecutive_runs
from bemkit.geometry.mesh import BoundaryMesh
from bemkit.geometry.neighbours import corner_nodes
from bemkit.operators.element_geometry import ElementGeometry

CORNER_ANGLE = 0.3
"""Smallest angle [rad] of a corner, across which no slope is taken; polygons of smooth curves have smaller angles."""


@dataclass(frozen=True, eq=False)
class GradientReconstruction:
    """Slopes and corrections of means as combinations of the midpoint values of an element and its neighbours.

    Parameters
    ----------
    neighbours : (3, n_elements) array
        The preceding element, the element itself, and the next element along the boundary.
    slopes : (3, n_elements) complex array
        Weights of their values in the slope; their sum is zero.
    means : (3, n_elements) complex array
        Weights of their values in the correction of the constant part; their sum is zero.
    """

    neighbours: IntArray
    slopes: ComplexArray
    means: ComplexArray

    @classmethod
    def of(cls, mesh: BoundaryMesh, geometry: ElementGeometry) -> GradientReconstruction:
        """Return the least-squares slopes on a closed mesh.

        Notes
        -----
        Let x_k be the midpoints of an element and its neighbours and m their mean. The slope is sum c_k u_k with
        c_k = conj(x_k - m) / sum |x_j - m|^2: the derivative of the complex-linear least-squares fit, or of the
        regression line along a straight side. Neighbours across a corner are excluded, unless the element has corners
        at both ends. Elements at corners have no correction of the mean.
        """
        neighbours = np.empty((3, mesh.n_elements), dtype=np.intp)
        for loop in mesh.loops:
            neighbours[:, loop] = np.roll(loop, 1), loop, np.roll(loop, -1)
        is_corner = corner_nodes(mesh, CORNER_ANGLE)[mesh.elements].T
        centre, half = geometry.centre[neighbours], geometry.half * geometry.tangent
        is_used = np.ones(neighbours.shape, bool)
        is_used[0], is_used[2] = ~is_corner
        is_smooth = is_used.all(axis=0) & (neighbours[0] != neighbours[2])
        is_used[:, is_used.sum(axis=0) == 1] = True
        arm = np.where(is_used, centre - np.mean(centre, axis=0, where=is_used), 0.0)
        weights = arm.conj() / np.sum(np.square(arm.real) + np.square(arm.imag), axis=0)
        return cls(neighbours, weights * half, _means(centre, half, is_smooth))

    def add_to(self, on: ComplexArray, on_slope: ComplexArray, *, is_conjugate: bool) -> None:
        """Add the contributions of slopes to coefficients (n_rows, n_elements) of displacements or their conjugates."""
        before, centre, after = self._of_value(on, on_slope, is_conjugate)
        on += centre
        # this element is the next or preceding element of its neighbours
        for contribution, runs in ((after, self._runs[0]), (before, self._runs[1])):
            for target, source in runs:
                on[:, target] += contribution[:, source]

    def _of_value(self, on: ComplexArray, on_slope: ComplexArray, is_conjugate: bool) -> tuple[ComplexArray, ...]:
        """Return the coefficients of the values on the preceding, each and the next element."""
        slopes, means = (self.slopes.conj(), self.means.conj()) if is_conjugate else (self.slopes, self.means)
        return tuple(on_slope * slope + on * mean for slope, mean in zip(slopes, means, strict=True))

    @cached_property
    def _runs(self) -> tuple[list[Run], list[Run]]:
        return consecutive_runs(self.neighbours[0]), consecutive_runs(self.neighbours[2])


def _means(centre: ComplexArray, half: ComplexArray, is_smooth: BoolArray) -> ComplexArray:
    """Return the weights (3, n_elements) of the mean of b (y - x)^2, with the second divided difference b."""
    before, middle, after = centre
    back, ahead = np.where(is_smooth, before - middle, -1.0), np.where(is_smooth, after - middle, 1.0)
    of_mean = np.where(is_smooth, half**2 / 3.0, 0.0) / (ahead - back)
    return np.array([-of_mean / back, of_mean / back - of_mean / ahead, of_mean / ahead])
