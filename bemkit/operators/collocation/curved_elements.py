"""Displacements of constant and linear densities on elements of any shape.

Straight elements have closed forms (`layers`); curved elements take Gauss rules on their arcs, with fewer points at a
large distance, and on pieces near a point. With y on the arc, rho = x - y, the density f and dy = tangent ds:

    U f p = A sum f [(1/2 - kappa log|rho / r0|) p + (rho / conj(rho)) conj(p) / 2] ds,      A = 1 / (8 pi mu (1 - nu))
    T f v = B sum [(2 - 2 nu) Im - i (1 - 2 nu) Re](f dy / rho) v + B sum (rho / conj(rho)) Im(dy / rho) conj(f v),

where B = 1 / (4 pi (1 - nu)), and f is real in the first equation. A slope s is the density s p(t) with the polynomial
p of the element (`bemkit.operators.integrals.curved_geometry`).

At the midpoint of an element, t = 0, a rule with an even number of points gives the principal value of 1 / t, and
log|rho| is the smooth log|rho / t| plus log|t|, whose integral is -2.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from bemkit.arrays import BoolArray, ComplexArray, FloatArray, IntArray
from bemkit.geometry.quadrature import gauss_legendre
from bemkit.operators.collocation.layers import Constants, straight_factors
from bemkit.operators.element_geometry import ElementGeometry
from bemkit.operators.integrals import curved_geometry
from bemkit.operators.integrals.splitting import SEPARATION, split_until
from bemkit.operators.material import Material

_NEAR, _NEAR_POINTS = 4.5, 16
"""Distance in the parameter (`ElementGeometry.distance_at`) below which elements are divided into pieces, and the
points of each piece, which must be even."""
_POINTS = 8
"""Points beyond that distance, with an error of about (4.5 + sqrt(4.5^2 - 1))^-16, below 1e-15."""
_FAR, _FEW_POINTS = 30.0, 4
"""Distance from which on a smaller rule is used, with an error of about (2 * 30)^-8, below 1e-14."""


class _Rule(NamedTuple):
    """Points y, steps dy and values of p on elements, (n_points, n_elements) complex arrays."""

    y: ComplexArray
    dy: ComplexArray
    p: ComplexArray


class CurvedElements:
    """Straight and curved elements in the order of a tree.

    Parameters
    ----------
    geometry : ElementGeometry
    material : Material
    order : (n_elements,) array
        The element of the mesh at each position.
    log_length : float [m]
        Unit of length in the logarithm.
    """

    def __init__(self, geometry: ElementGeometry, material: Material, order: IntArray, log_length: float) -> None:
        self.constants, self.order, self.geometry = Constants.of(material, log_length), order, geometry
        self.near, self.far = ((geometry.half * geometry.distance_at(distance))[order] for distance in (_NEAR, _FAR))
        rules = (_rule(geometry, order, n_points) for n_points in (_POINTS, _FEW_POINTS))
        self.rule, self.small_rule = (rule._replace(y=rule.y + geometry.centre[order]) for rule in rules)

    def factors(self, is_double: bool, x: ComplexArray, centred_on: IntArray, elements: IntArray) -> ComplexArray:
        """Return the factors (n, 2 or 4, n_points) of densities on some elements; see `layers.straight_factors`.

        Parameters
        ----------
        is_double : bool
        x : (n_points,) complex array
        centred_on : (n_points,) array
            Index among `elements` of the one whose midpoint is x, where T is a principal value; otherwise -1.
        elements : (n,) array
        """
        geometry, mesh_elements = self.geometry, self.order[elements]
        result = np.empty((elements.size, 4 if is_double else 2, x.size), complex)
        is_straight, index = geometry.is_straight[mesh_elements], np.full(elements.size + 1, -1)
        straight, curved = np.flatnonzero(is_straight), np.flatnonzero(~is_straight)
        if straight.size:
            index[straight] = np.arange(straight.size)
            ends = geometry.start[mesh_elements[straight]], geometry.end[mesh_elements[straight]]
            result[straight] = straight_factors(self.constants, is_double, x, index[centred_on], *ends)
        distance = np.abs(x - geometry.centre[mesh_elements[curved]][:, None])
        is_far = distance.min(axis=1, initial=np.inf) > self.far[elements[curved]]
        for chosen, rule in ((curved[~is_far], self.rule), (curved[is_far], self.small_rule)):
            with np.errstate(all="ignore"):  # near pairs may overflow here; they are replaced
                arcs = _Rule(*(values[:, elements[chosen]] for values in rule))
                result[chosen] = _gauss_layer(self.constants, is_double, x, arcs)
        row, point = np.nonzero(distance < self.near[elements[curved]][:, None])
        if row.size:
            element = curved[row]
            is_midpoint = centred_on[point] == element
            result[element, :, point] = self._near(is_double, x[point], mesh_elements[element], is_midpoint)
        return result

    def _near(self, is_double: bool, x: ComplexArray, elements: IntArray, is_midpoint: BoolArray) -> ComplexArray:
        """Return the factors (n, 2 or 4) of curved elements (n,) of the mesh, each at one near point.

        The double layer has round-off of eps l / d at the distance d from an element of half length l.
        """
        geometry, constants = self.geometry, self.constants
        least_distance = (geometry.half * geometry.distance_at(SEPARATION))[elements]
        # relative to the centre, where the midpoint of a polynomial has no round-off
        x = np.where(is_midpoint, geometry.from_centre(elements, 0.0), x - geometry.centre[elements])

        def is_away(pair: IntArray, low: FloatArray, high: FloatArray) -> BoolArray:
            middle = geometry.from_centre(elements[pair], 0.5 * (low + high))
            away: BoolArray = np.abs(x[pair] - middle) >= 0.5 * (high - low) * least_distance[pair]
            return away | is_midpoint[pair]

        pair, low, high = split_until(is_away, x.size, -1.0, 1.0)
        order = np.argsort(pair, kind="stable")
        pair, low, high = pair[order], low[order], high[order]
        rule = _rule(geometry, elements[pair], _NEAR_POINTS, low, high)
        on_pieces = _gauss_layer(constants, is_double, x[pair, None], rule)[:, :, 0]
        result = np.add.reduceat(on_pieces, np.searchsorted(pair, np.arange(x.size)))
        if not is_double:
            t, weights = gauss_legendre(_NEAR_POINTS)
            kappa, missing = 3.0 - 4.0 * constants.poisson_ratio, -2.0 - weights @ np.log(np.abs(t))
            result[is_midpoint, 0] -= (constants.single * kappa * missing) * geometry.half[elements[is_midpoint]]
        return result


def _rule(
    geometry: ElementGeometry,
    elements: IntArray,
    n_points: int,
    low: FloatArray | float = -1.0,
    high: FloatArray | float = 1.0,
) -> _Rule:
    """Return the Gauss rule on elements, or on pieces between two local coordinates; y is relative to the centre."""
    polynomials, scale = geometry.polynomials(elements), (geometry.half * geometry.tangent)[elements]
    xi, weights = gauss_legendre(n_points)
    half = np.broadcast_to(0.5 * (np.asarray(high) - low), elements.shape)
    t = (0.5 * (np.asarray(high) + low) + half * xi[:, None]).astype(complex)
    p = curved_geometry.evaluate(polynomials, t)
    slope = curved_geometry.evaluate(curved_geometry.derivative(polynomials), t)
    return _Rule(scale * p, weights[:, None] * half * scale * slope, p)


def _gauss_layer(constants: Constants, is_double: bool, x: ComplexArray, rule: _Rule) -> ComplexArray:
    """Return the factors of densities at points (n_points,) or (n_elements, n_points) from a Gauss rule."""
    nu = constants.poisson_ratio
    result = np.zeros((rule.y.shape[1], 4 if is_double else 2, x.shape[-1]), complex)
    for y, dy, p in zip(*(values[:, :, None] for values in rule), strict=True):
        rho = x - y
        squared = np.square(rho.real) + np.square(rho.imag)
        turn = rho * rho / squared
        if not is_double:
            ds = constants.single * np.abs(dy)
            result[:, 0] += ds * (0.5 - (1.5 - 2.0 * nu) * np.log(squared / constants.log_length**2))
            result[:, 1] += (0.5 * ds) * turn
            continue
        rate = dy * rho.conj() / squared
        of_density = constants.double * ((2.0 - 2.0 * nu) * rate.imag - 1j * (1.0 - 2.0 * nu) * rate.real)
        of_conjugate = constants.double * turn * rate.imag
        result[:, 0] += of_density
        result[:, 1] += p * of_density
        result[:, 2] += of_conjugate
        result[:, 3] += p.conj() * of_conjugate
    return result
