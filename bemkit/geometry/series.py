"""The functions of a boundary space by Legendre polynomials on the elements: one sparse matrix.

On element e a function of a space is the sum of c[e, k] P_k(xi), xi in [-1, 1] the local coordinate. Its coefficients
are ``series(space).T @ dofs``. Degrees that differ from element to element, jumps, shared nodes and images at lines of
symmetry are all in that matrix.
"""

from __future__ import annotations

from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np

from bemkit.arrays import FloatArray, IntArray, read_only
from bemkit.geometry.spaces import BoundarySpace, element_coefficients
from bemkit.geometry.symmetry.images import element_images

if TYPE_CHECKING:
    from scipy.sparse import csc_array


def series(space: BoundarySpace, *, derivative: bool = False, component: int | None = None) -> csc_array:
    """Return the Legendre coefficients of the functions of all scalar dofs.

    Parameters
    ----------
    space : BoundarySpace
    derivative : bool
        Whether those of the derivatives by the arc length [1/m] are wanted.
    component : int, optional
        0 or 1: the coefficients of this component on the whole boundary, all images of the elements included. By
        default on the elements of the mesh.

    Returns
    -------
    (n_scalar, n_elements * n_polynomials) sparse array
        Column ``e * n_polynomials + k`` holds the coefficients of P_k on element e; there is one polynomial at least.
    """
    from scipy.sparse import csc_array

    coefficients = element_coefficients(space)
    if derivative:
        slopes = coefficients @ _derivatives(coefficients.shape[2])
        coefficients = slopes / (0.5 * space.mesh.lengths[:, None, None])
    dofs = space.element_dofs
    if component is not None:
        # an image takes the values of its element; where it runs the other way, so do the dofs
        signs, dofs_of_images = zip(*((signs[component], own) for _, signs, own in element_images(space)), strict=True)
        coefficients = np.concatenate([sign * coefficients for sign in signs])
        dofs = np.concatenate(dofs_of_images)
    by_column = coefficients.transpose(0, 2, 1)
    is_kept = by_column != 0.0
    ends = np.append(0, np.cumsum(is_kept.sum(axis=2)))
    rows = np.broadcast_to(dofs[:, None, :], by_column.shape)[is_kept]
    return csc_array((by_column[is_kept], rows, ends), shape=(space.n_dofs // 2, ends.size - 1))


def columns_of(whole: csc_array, n_elements: int, elements: IntArray, n_polynomials: int) -> csc_array:
    """Return the columns of some elements and of their first polynomials from a series on `n_elements` elements."""
    n_each = whole.shape[1] // n_elements
    if elements.size == n_elements and n_polynomials == n_each:
        return whole
    return whole[:, (elements[:, None] * n_each + np.arange(n_polynomials)).ravel()]


@lru_cache(maxsize=16)
def _derivatives(n: int) -> FloatArray:
    """Return the Legendre coefficients, read-only, of dP_k/dxi in row k < n; one column at least."""
    return read_only(np.asarray(np.polynomial.legendre.legder(np.eye(n), axis=1), np.float64))
