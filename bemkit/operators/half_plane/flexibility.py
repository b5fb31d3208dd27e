"""The flexibility of the surface of a half-plane in closed form [Johnson1985].

Let t be the tangent and n the outward normal of the surface, and s the position along t. Tractions displace the surface
by

    u_t(s) = -2 / (pi E') int log|s - r| t_t(r) dr + c / 2 int sign(s - r) t_n(r) dr,
    u_n(s) = -2 / (pi E') int log|s - r| t_n(r) dr - c / 2 int sign(s - r) t_t(r) dr,

with the compressibility c = (1 - 2 nu) / ((1 - nu) E') of `Material`. Tractions are constant on elements and
displacements are means over elements. The flexibility from forces of elements to mean displacements is then symmetric.
"""

from __future__ import annotations

import numpy as np

from bemkit.arrays import FloatArray, IntArray
from bemkit.geometry.quadrature import gauss_legendre

_FAR = 20.0
"""Distance of two centres, in lengths of the longer element, from which on a series is exact to round-off."""
_APART = 2.0
"""Distance between the elements, in lengths of the shorter one, from which on Gauss points are exact to round-off."""
_N_POINTS = 8
"""Gauss points on the shorter element."""
_EQUAL = 4.0 * float(np.finfo(float).eps)
"""Largest round-off of the ends of equal intervals, relative to the extent."""


def mean_logarithms(nodes: FloatArray) -> FloatArray:
    """Return the means of log|s - r| over all pairs of consecutive intervals.

    Parameters
    ----------
    nodes : (n + 1,) array
        Ends of the intervals, increasing.

    Returns
    -------
    (n, n) array

    Notes
    -----
    Neighbours are integrated in closed form. At some distance the shorter interval takes Gauss points. Far away, the
    closed form would lose digits in differences of large terms: the logarithm is expanded in the moments of s - r about
    the distance of the centres.
    """
    n, extent = nodes.size - 1, float(nodes[-1] - nodes[0])
    order = np.arange(n)
    if np.abs(nodes - nodes[0] - np.linspace(0.0, extent, n + 1)).max() <= _EQUAL * extent:
        return np.asarray(logarithms_between(nodes, np.zeros(n, int), order)[np.abs(order[:, None] - order)])
    result = np.empty((n, n))
    first, second = np.triu_indices(n)
    result[first, second] = result[second, first] = logarithms_between(nodes, first, second)
    return result


def logarithms_between(nodes: FloatArray, first: IntArray, second: IntArray) -> FloatArray:
    """Return the means of log|s - r| over pairs of intervals.

    Parameters
    ----------
    nodes : (n + 1,) array
        Ends of the intervals, increasing.
    first, second : (k,) arrays
        Indices of intervals, with ``first <= second``.

    Returns
    -------
    (k,) array
    """
    length, centre = np.diff(nodes), 0.5 * (nodes[:-1] + nodes[1:])
    h, k = length[first], length[second]
    distance, longer, shorter = centre[second] - centre[first], np.maximum(h, k), np.minimum(h, k)
    is_far = distance > _FAR * longer
    is_apart = ~is_far & (distance - 0.5 * longer > _APART * shorter)
    is_near = ~is_far & ~is_apart
    values = np.empty(first.size)
    values[is_far] = _by_moments(distance[is_far], h[is_far], k[is_far])
    values[is_apart] = _by_points(distance[is_apart], longer[is_apart], shorter[is_apart])
    begin, end = nodes[:-1], nodes[1:]
    values[is_near] = _closed(begin[first[is_near]], end[first[is_near]], begin[second[is_near]], end[second[is_near]])
    return values


def _by_moments(distance: FloatArray, h: FloatArray, k: FloatArray) -> FloatArray:
    """Expand the logarithm about the distance of the centres; moments of odd order vanish."""
    h, k = (h / distance) ** 2, (k / distance) ** 2
    second = (h + k) / 12.0
    fourth = (h**2 + k**2) / 80.0 + h * k / 24.0
    sixth = (h**3 + k**3) / 448.0 + h * k * (h + k) / 64.0
    eighth = (h**4 + k**4) / 2304.0 + h * k * (h**2 + k**2) / 192.0 + 7.0 * (h * k) ** 2 / 640.0
    return np.asarray(np.log(distance) - second / 2.0 - fourth / 4.0 - sixth / 6.0 - eighth / 8.0)


def _by_points(distance: FloatArray, longer: FloatArray, shorter: FloatArray) -> FloatArray:
    """Integrate over the longer interval in closed form, and over the shorter one at Gauss points."""
    xi, weights = gauss_legendre(_N_POINTS)
    middle = distance[:, None] + 0.5 * shorter[:, None] * xi
    before, after = middle - 0.5 * longer[:, None], middle + 0.5 * longer[:, None]
    inner = (after * np.log(after) - before * np.log(before)) / longer[:, None] - 1.0
    return np.asarray(inner @ (0.5 * weights))


def _closed(a: FloatArray, b: FloatArray, c: FloatArray, d: FloatArray) -> FloatArray:
    """Return the mean over [a, b] and [c, d], with c >= b or equal intervals."""
    sums = _twice_integrated(d - a) - _twice_integrated(d - b) - _twice_integrated(c - a) + _twice_integrated(c - b)
    return np.asarray(sums / ((b - a) * (d - c)))


def _twice_integrated(x: FloatArray) -> FloatArray:
    """Return x^2 (log|x| - 3/2) / 2, whose second derivative is log|x|."""
    return np.asarray(0.5 * x * x * (np.log(np.where(x == 0.0, 1.0, np.abs(x))) - 1.5))
