"""Integrals over pairs of elements for any two sets of elements: near pairs from a table, all others by Gauss rules.

The scalar integrals of `bemkit.operators.integrals.sweep`, for displacements of degree p and tractions of degree p - 1,
stand in one array by pairs, in the order of `by_kind`: of log|x - y|, of the real and of the imaginary part of
(x - y) / conj(x - y), of the double layer with the normal of the second element, and of that with the normal of the
first one. Near pairs, which touch or are a few lengths apart, are integrated once, by
`bemkit.operators.integrals.near`, and kept.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bemkit.arrays import ComplexArray, FloatArray, IntArray
from bemkit.geometry.mesh import BoundaryMesh
from bemkit.geometry.quadrature import gauss_legendre
from bemkit.operators import kernels
from bemkit.operators.hierarchy import compiled
from bemkit.operators.integrals.near import integrate_listed
from bemkit.operators.integrals.outer_rules import GAUSS_LEVELS
from bemkit.operators.integrals.pairs import Degrees
from bemkit.operators.integrals.panels import Panels
from bemkit.operators.linear.threads import for_each_chunk

RULES = tuple(GAUSS_LEVELS[:4])
"""Numbers of points on both elements, and the distance [half lengths of either] from which each is enough."""
_PAIRS = 8192
"""Pairs that are evaluated at a time, so that they stay in the cache."""
_ROWS_OF_TABLE = 1024
"""Elements whose near pairs are integrated at a time."""


def by_kind(integrals: FloatArray, degree: int) -> list[FloatArray]:
    """Return matrices, a row for each polynomial on each first element: log, real, imaginary, double to and fro.

    Parameters
    ----------
    integrals : (n_channels, n_rows, n_columns) array
    degree : int
        p, of the displacements.
    """
    p, begin, found = degree, 0, []
    for one, two in ((p, p), (p, p), (p, p), (p, p + 1), (p + 1, p)):
        own = integrals[begin : begin + one * two].reshape(one, two, *integrals.shape[1:])
        found.append(own.transpose(2, 0, 3, 1).reshape(one * own.shape[2], two * own.shape[3]))
        begin += one * two
    return found


@dataclass(frozen=True, eq=False)
class Rule:
    """Gauss rules on all elements, one behind the other.

    Parameters
    ----------
    point, tangent : (n_points, n_elements) complex arrays [m], [-]
    polynomials : (degree + 1, n_points) array
        Legendre polynomials times weights.
    begins : (n_rules + 1,) array
        Where each rule begins among the points.
    """

    point: ComplexArray
    tangent: ComplexArray
    polynomials: FloatArray
    begins: IntArray

    @classmethod
    def of(cls, panels: Panels, counts: tuple[int, ...], degree: int) -> Rule:
        """Return rules with some numbers of points."""
        everywhere, found, tangents, polynomials = np.arange(panels.half.size), [], [], []
        for n in counts:
            polynomials.append(kernels.legendre_weights(degree + 1, n))
            for xi in gauss_legendre(n)[0].tolist():
                found.append(panels.point(everywhere, xi))
                tangents.append(_direction(panels, xi))
        begins = np.cumsum([0, *counts])
        return cls(np.array(found), np.array(tangents), np.concatenate(polynomials, axis=1), begins)


@dataclass(frozen=True, eq=False)
class ElementPairs:
    """Elements of a mesh against those of the whole boundary, images included.

    Parameters
    ----------
    degree : int
        p, of the displacements.
    centre, half : (n_elements,) arrays
        Of the whole boundary.
    reach : (n_rules, n_elements) array [m]
        Distance from which each rule is enough.
    rule : Rule
    begins : (n_rows + 1,) array
        Where the near pairs of each element of the mesh begin.
    columns : (n_near,) array
        The other elements of the pairs, ascending for each.
    near : (n_near, n_channels) array
        Their integrals.
    """

    degree: int
    centre: ComplexArray
    half: FloatArray
    reach: FloatArray
    rule: Rule
    begins: IntArray
    columns: IntArray
    near: FloatArray

    @classmethod
    def of(cls, mesh: BoundaryMesh, degree: int) -> ElementPairs:
        """Integrate the near pairs of a mesh."""
        panels, n_rows = Panels(mesh.whole), mesh.n_elements
        reach = np.stack([panels.half * panels.reach(distance) for _, distance in RULES])
        rows, columns = _near_pairs(panels.centre, panels.half, reach[-1], n_rows)
        begins = np.searchsorted(rows, np.arange(n_rows + 1))

        def integrate(first: int) -> FloatArray:
            own = slice(begins[first], begins[min(first + _ROWS_OF_TABLE, n_rows)])
            return _integrated(panels, degree, rows[own], columns[own])

        parts = for_each_chunk(integrate, range(0, n_rows, _ROWS_OF_TABLE), n_integrals=100 * rows.size)
        rule = Rule.of(panels, tuple(n for n, _ in RULES), degree)
        return cls(degree, panels.centre, panels.half, reach, rule, begins, columns, np.concatenate(parts))

    def integrals(self, rows: IntArray, columns: IntArray) -> FloatArray:
        """Return the integrals (n_channels, n_rows, n_columns) of some elements, ascending, in any two sets."""
        rule = self.rule
        if compiled.functions() is not None:
            from bemkit.operators.hierarchy import compiled_pairs

            values: FloatArray = compiled_pairs.integrals(
                rows, columns, self.centre, self.half, self.reach, rule.point, rule.tangent, rule.polynomials,
                rule.begins, self.begins, self.columns, self.near,
            )  # fmt: skip
            return values
        result = np.empty((self.near.shape[1], rows.size, columns.size))
        distance = np.abs(self.centre[rows, None] - self.centre[columns])
        level = np.zeros(distance.shape, int)
        for reach in self.reach[:-1]:
            level += distance < np.maximum(
                reach[rows, None] + self.half[columns], self.half[rows, None] + reach[columns]
            )
        for number, row in enumerate(rows.tolist()):
            own = slice(self.begins[row], self.begins[row + 1])
            _, at, of = np.intersect1d(self.columns[own], columns, assume_unique=True, return_indices=True)
            level[number, of] = len(RULES)
            result[:, number, of] = self.near[own][at].T
        for number in range(len(RULES)):
            i, j = np.nonzero(level == number)
            for some in (slice(k, k + _PAIRS) for k in range(0, i.size, _PAIRS)):
                result[:, i[some], j[some]] = self._far(number, rows[i[some]], columns[j[some]])
        return result

    def _far(self, number: int, rows: IntArray, columns: IntArray) -> FloatArray:
        """Return the integrals (n_channels, n) of listed pairs by one of the rules."""
        own = slice(self.rule.begins[number], self.rule.begins[number + 1])
        x, y = self.rule.point[own][:, None, rows], self.rule.point[own][None, :, columns]
        polynomials, p = self.rule.polynomials[:, own], self.degree
        rho = x - y
        squared = np.square(rho.real) + np.square(rho.imag)
        log, turn = 0.5 * np.log(squared), rho * rho / squared
        tangents = self.rule.tangent[own][None, :, columns], -self.rule.tangent[own][:, None, rows]
        to, fro = ((each * rho.conj()).imag / squared for each in tangents)
        measure = self.half[rows] * self.half[columns]

        def total(values: FloatArray, n_one: int, n_two: int) -> FloatArray:
            sums = np.einsum("ag,bk,gkm->abm", polynomials[:n_one], polynomials[:n_two], values, optimize=True)
            return np.asarray(measure * sums.reshape(n_one * n_two, -1))

        logs = (total(each, p, p) for each in (log, turn.real, turn.imag))
        doubles = (total(each / (2.0 * np.pi), *sizes) for each, sizes in ((to, (p, p + 1)), (fro, (p + 1, p))))
        return np.concatenate([*logs, *doubles])


def _direction(panels: Panels, xi: float) -> ComplexArray:
    """Return the unit tangents of all elements at one local coordinate."""
    if panels.curved is None:
        return panels.tangent
    from bemkit.operators.integrals import curved_panels

    slopes = curved_panels.derivative(panels.curved.about_centre)
    place = np.full(panels.half.size, xi + 0j)
    return np.asarray(panels.tangent * curved_panels.evaluate(slopes, place))


def _near_pairs(centre: ComplexArray, half: FloatArray, reach: FloatArray, n_rows: int) -> tuple[IntArray, IntArray]:
    """Return the pairs of elements for which no rule is enough, by rows, those of a mesh, and by columns ascending."""
    from scipy.spatial import cKDTree

    points = np.stack([centre.real, centre.imag], axis=1)
    lists = cKDTree(points).query_ball_point(points, reach + half)
    one = np.repeat(np.arange(half.size), [len(each) for each in lists])
    two = np.concatenate([np.asarray(each, np.intp) for each in lists])
    # the larger element of a pair has found the other one
    keys = np.unique(np.concatenate([one * half.size + two, two * half.size + one]))
    rows, columns = np.divmod(keys, half.size)
    distance = np.abs(centre[rows] - centre[columns])
    is_near = distance < np.maximum(reach[rows] + half[columns], half[rows] + reach[columns])
    is_near &= rows < n_rows
    return rows[is_near], columns[is_near]


def _integrated(panels: Panels, degree: int, rows: IntArray, columns: IntArray) -> FloatArray:
    """Return the integrals (n, n_channels) of listed pairs at any distance."""
    degrees = Degrees(log=(degree - 1, degree - 1), double=(degree - 1, degree))
    listed, places = integrate_listed(panels, degrees, np.concatenate([rows, columns]), np.concatenate([columns, rows]))
    to, fro = (listed.take(each) for each in np.split(places, 2))
    kinds = (to.log, to.quotient.real, to.quotient.imag, to.double, fro.double.swapaxes(0, 1))
    return np.ascontiguousarray(np.concatenate([each.reshape(-1, rows.size) for each in kinds]).T)
