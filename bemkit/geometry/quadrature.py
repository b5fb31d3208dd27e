"""Quadrature rules on the reference interval."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from bemkit.arrays import FloatArray, read_only


@lru_cache(maxsize=64)
def gauss_legendre(n_points: int) -> tuple[FloatArray, FloatArray]:
    """Return the Gauss-Legendre points and weights on [-1, 1].

    Parameters
    ----------
    n_points : int
        At least 1; the rule is exact for polynomials up to degree 2 n_points - 1.

    Returns
    -------
    points, weights : (n_points,) arrays
        Read-only.
    """
    points, weights = np.polynomial.legendre.leggauss(n_points)
    return read_only(points), read_only(weights)


@lru_cache(maxsize=16)
def gauss_lobatto(degree: int) -> FloatArray:
    """Return the Gauss-Lobatto points on [-1, 1], the best nodes of polynomials whose ends are nodes.

    Parameters
    ----------
    degree : int
        At least 1.

    Returns
    -------
    (degree + 1,) array
        The ends and the places where P_degree has no slope; symmetric to the last bit, and read-only.
    """
    inside = np.polynomial.legendre.legroots(np.polynomial.legendre.legder(np.eye(degree + 1)[degree]))
    points = np.concatenate([[-1.0], np.sort(inside.real), [1.0]])
    return read_only(0.5 * (points - points[::-1]))


@lru_cache(maxsize=64)
def gauss_graded(n_points: int) -> tuple[FloatArray, FloatArray]:
    """Return a rule on [0, 1] for functions like log(u), singular at 0.

    Parameters
    ----------
    n_points : int
        Number of points: those of Gauss, mapped by u = v**6, which makes u**a log(u) as smooth as v**(6 a + 5) log(v).

    Returns
    -------
    points, weights : (n_points,) arrays
        Read-only.
    """
    reference, reference_weights = gauss_legendre(n_points)
    v = 0.5 * (reference + 1.0)
    points = v**6
    weights = 3.0 * reference_weights * v**5
    return read_only(points), read_only(weights)
