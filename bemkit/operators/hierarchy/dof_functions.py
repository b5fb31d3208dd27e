"""The functions of the dofs of displacements and tractions, by the Legendre polynomials of the elements they cover."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from bemkit.arrays import ComplexArray, FloatArray, IntArray
from bemkit.geometry.quadrature import gauss_legendre
from bemkit.geometry.reflection import element_images
from bemkit.geometry.spaces import BoundarySpace, local_coefficients
from bemkit.operators.integrals.panels import Panels

if TYPE_CHECKING:
    from scipy.sparse import csr_array


@dataclass(frozen=True, eq=False)
class LocalFunctions:
    """The functions of some places on the elements that they cover.

    Parameters
    ----------
    elements : (n,) array
        Ascending.
    rate : (n_places, n * p) sparse array
        Coefficients of the derivatives of displacements along the boundary, and of tractions.
    value : (n_nodes, n * (p + 1)) sparse array
        Coefficients of displacements.
    """

    elements: IntArray
    rate: csr_array
    value: csr_array


@dataclass(frozen=True, eq=False)
class DofFunctions:
    """The functions of all places: nodes of the displacements and dofs of the tractions.

    Parameters
    ----------
    degree : int
        p, of the displacements.
    rates, values : tuples of (n_places, n_elements * p), (n_places, n_elements * (p + 1)) sparse arrays
        As in `LocalFunctions`: of the functions on the mesh, and of the x and y components on the whole boundary,
        images included.
    """

    degree: int
    rates: tuple[csr_array, ...]
    values: tuple[csr_array, ...]

    @classmethod
    def of(
        cls, displacements: BoundarySpace, tractions: BoundarySpace, panels: Panels, order: IntArray
    ) -> DofFunctions:
        """Return the functions of two spaces, the places in some order; nodes have the first numbers."""
        from scipy.sparse import csr_array

        u, t = local_coefficients(displacements), local_coefficients(tractions)
        slopes: FloatArray = np.asarray(np.polynomial.legendre.legder(u, axis=1), float)
        by_half, ones = 1.0 / panels.half, np.ones_like(panels.half)
        rates, values = [], []
        for component in (None, 0, 1) if displacements.mesh.symmetry is not None else (None,):
            of_slopes = _on_elements(displacements, slopes, by_half, component)
            rates.append(_stacked(of_slopes, _on_elements(tractions, t, ones, component))[order])
            of_values = _on_elements(displacements, u, ones, component)
            nothing = csr_array((tractions.n_dofs // 2, of_values.shape[1]))
            values.append(_stacked(of_values, nothing)[order])
        return cls(displacements.degree, tuple(rates), tuple(values))

    def tested(self, places: IntArray, n_nodes: int) -> LocalFunctions:
        """Return the functions of some places, the first ones of which are nodes, on the mesh."""
        return self._local(0, places, n_nodes)

    def acting(self, places: IntArray, n_nodes: int) -> tuple[LocalFunctions, LocalFunctions]:
        """Return the x and y components of the functions of some places on the whole boundary."""
        if len(self.rates) == 1:
            same = self._local(0, places, n_nodes)
            return same, same
        return self._local(1, places, n_nodes), self._local(2, places, n_nodes)

    def touching(self, places: IntArray) -> IntArray:
        """Return all places, ascending, whose functions share elements of the mesh with some places."""
        is_touched = np.zeros(self.rates[0].shape[1] // self.degree, bool)
        is_touched[self.rates[0][places].indices // self.degree] = True
        matrix = self.rates[0]
        entries = is_touched[matrix.indices // self.degree]
        return np.unique(np.repeat(np.arange(matrix.shape[0]), np.diff(matrix.indptr))[entries])

    def _local(self, number: int, places: IntArray, n_nodes: int) -> LocalFunctions:
        rate, elements = at_elements(self.rates[number][places], self.degree)
        value, _ = at_elements(self.values[number][places[:n_nodes]], self.degree + 1, elements)
        return LocalFunctions(elements, rate, value)


def at_elements(matrix: csr_array, n: int, elements: IntArray | None = None) -> tuple[csr_array, IntArray]:
    """Return a matrix with n columns for each element without the columns of other elements than some, and these.

    If they are left out, these are those with entries, ascending.
    """
    from scipy.sparse import csr_array

    element, local = np.divmod(matrix.indices, n)
    if elements is None:
        elements, number = np.unique(element, return_inverse=True)
    else:
        number = np.searchsorted(elements, element)
    shape = matrix.shape[0], elements.size * n
    return csr_array((matrix.data, n * number + local, matrix.indptr), shape=shape), elements


def at_points(spaces: Sequence[BoundarySpace], panels: Panels, n_points: int) -> csr_array:
    """Return the functions of two spaces on the mesh, (n, n_elements * n_points), at Gauss points times the weights."""
    xi, weights = gauss_legendre(n_points)
    return _stacked(*(_on_elements(space, space.basis(xi) * weights, panels.half, None) for space in spaces))


def supports(
    spaces: Sequence[BoundarySpace], panels: Panels
) -> tuple[ComplexArray, ComplexArray, FloatArray, FloatArray]:
    """Return for each dof where its function begins and ends, its shortest element, and its integral, (n,) each."""
    sizes = [space.n_dofs // 2 for space in spaces]
    start, end = np.empty((2, sum(sizes)), complex)
    shortest, integral = np.full(sum(sizes), np.inf), np.zeros(sum(sizes))
    half = panels.half[: spaces[0].mesh.n_elements]
    for space, first in zip(spaces, np.cumsum([0, *sizes]), strict=False):
        xi, weights = gauss_legendre(space.degree + 1)
        by_local = (first + space.element_dofs).T
        for dofs, of_basis in zip(by_local, space.basis(xi) @ weights, strict=True):
            np.minimum.at(shortest, dofs, 2.0 * half)
            np.add.at(integral, dofs, half * of_basis)
            start[dofs] = panels.start[: half.size]  # a shared node comes last in the element before it
        for dofs in by_local[::-1]:
            end[dofs] = panels.end[: half.size]
    return start, end, shortest, integral


def _on_elements(space: BoundarySpace, local: FloatArray, scale: FloatArray, component: int | None) -> csr_array:
    """Return (n_scalar, n_elements * n) factors of n functions on each element, from those of the local basis.

    On the elements of the mesh alone, or those of a component on the whole boundary.
    """
    from scipy.sparse import csr_array

    n, found = local.shape[1], []
    for elements, signs, dofs in element_images(space):
        if component is None and elements.start:
            continue
        sign = 1.0 if component is None else signs[component]
        values = sign * scale[elements, None, None] * local
        column = (n * np.arange(elements.start, elements.stop)[:, None, None] + np.arange(n)) + np.zeros_like(
            values, int
        )
        rows = dofs[:, :, None] + np.zeros_like(values, int)
        found.append((values.ravel(), rows.ravel(), column.ravel()))
    values, rows, columns = (np.concatenate(each) for each in zip(*found, strict=True))
    kept = values != 0.0
    shape = space.n_dofs // 2, n * scale.size
    return csr_array((values[kept], (rows[kept], columns[kept])), shape=shape)


def _stacked(one: csr_array, two: csr_array) -> csr_array:
    from scipy.sparse import vstack

    stacked: csr_array = vstack([one, two], format="csr")
    return stacked
