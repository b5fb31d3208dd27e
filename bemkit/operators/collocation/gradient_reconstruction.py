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

import numpy as np

from bemkit.arrays import BoolArray, ComplexArray
from bemkit.geometry.mesh import BoundaryMesh
from bemkit.geometry.neighbours import corner_nodes
from bemkit.operators.element_geometry import ElementGeometry

CORNER_ANGLE = 0.3
"""Smallest angle [rad] of a corner, across which no slope is taken; polygons of smooth curves have smaller angles."""


class GradientReconstruction:
    """The linear displacements on elements that the midpoint value of each element causes, by least squares.

    Parameters
    ----------
    mesh : BoundaryMesh
        Closed.
    geometry : ElementGeometry

    Attributes
    ----------
    acted_on : (n_elements, 3) array
        Elements on which the value acts: the preceding one, the element itself, and the next one along the boundary.
    weights : (n_elements, 3, 2) complex array
        Constant part and slope of a unit value on these. On every element the constant parts add up to one, the slopes
        to zero.

    Notes
    -----
    Let x_k be the midpoints of an element and its neighbours and m their mean. The slope is sum c_k u_k with
    c_k = conj(x_k - m) / sum |x_j - m|^2: the derivative of the complex-linear least-squares fit, or of the regression
    line along a straight side. Neighbours across a corner are excluded, unless the element has corners at both ends.
    Elements at corners have no correction of the mean.
    """

    def __init__(self, mesh: BoundaryMesh, geometry: ElementGeometry) -> None:
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
        # of an element and its neighbours: their weights in its constant part and slope
        of_values = np.stack([_means(centre, half, is_smooth), weights * half], axis=2)
        of_values[1, :, 0] += 1.0
        # an element is neighbour 2 of the preceding one, 1 of itself and 0 of the next one
        self.acted_on = neighbours.T
        self.weights: ComplexArray = of_values[np.array([2, 1, 0]), self.acted_on]

    def gathered(self, on_constant: ComplexArray, on_slope: ComplexArray) -> ComplexArray:
        """Return the coefficients (..., n_elements) of values from those of constant parts and slopes."""
        of_values = np.stack([on_constant[..., self.acted_on], on_slope[..., self.acted_on]], axis=-1)
        return np.asarray((of_values * self.weights).sum(axis=(-2, -1)))


def _means(centre: ComplexArray, half: ComplexArray, is_smooth: BoolArray) -> ComplexArray:
    """Return the weights (3, n_elements) of the mean of b (y - x)^2, with the second divided difference b."""
    before, middle, after = centre
    back, ahead = np.where(is_smooth, before - middle, -1.0), np.where(is_smooth, after - middle, 1.0)
    of_mean = np.where(is_smooth, half**2 / 3.0, 0.0) / (ahead - back)
    return np.array([-of_mean / back, of_mean / back - of_mean / ahead, of_mean / ahead])
