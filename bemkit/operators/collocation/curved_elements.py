"""Displacements that constant and linear densities on elements of any shape cause anywhere, by quadrature.

Far from an element a Gauss rule on its arc serves, with few points many half lengths away; near it the integrals are
those of `bemkit.operators.collocation`. With y on the arc, rho = x - y, f the density and dy = tangent ds:

    U f p = A sum f [(1/2 - kappa log|rho / r0|) p + (rho / conj(rho)) conj(p) / 2] ds,      A = 1 / (8 pi mu (1 - nu))
    T f v = B sum [(2 - 2 nu) Im - i (1 - 2 nu) Re](f dy / rho) v + B sum (rho / conj(rho)) Im(dy / rho) conj(f v),

where f is real in the first and B = 1 / (4 pi (1 - nu)); the slope s means the density s p(t), p the polynomial of
the element (`bemkit.operators.integrals.curved_panels`).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from bemkit.arrays import ComplexArray, FloatArray, IntArray
from bemkit.geometry.quadrature import gauss_legendre
from bemkit.operators.collocation.collocation_points import CURVED_DISTANCE, CURVED_POINTS, CollocationPoints
from bemkit.operators.collocation.layers import Constants
from bemkit.operators.integrals import curved_panels
from bemkit.operators.integrals.panels import Panels
from bemkit.operators.material import Material

_FAR, _FEW_POINTS = 30.0, 4
"""From so many half lengths on so few points do: their error is about (2 * 30)^-8, below 1e-14."""


class _Rule(NamedTuple):
    """Points y, steps dy and places p on all elements, (n_elements, n_points) complex arrays."""

    y: ComplexArray
    dy: ComplexArray
    p: ComplexArray


@dataclass(frozen=True, eq=False)
class CurvedElements:
    """Elements in the order of a tree.

    Parameters
    ----------
    constants : Constants
    points : CollocationPoints
        Of the mesh.
    order : (n_elements,) array
        The element of the mesh at each place.
    near, far : (n_elements,) arrays [m]
        Distances from the middle within which no Gauss rule serves, and from which on the smaller one does.
    rule, small_rule : _Rule
        By place.
    """

    constants: Constants
    points: CollocationPoints
    order: IntArray
    near: FloatArray
    far: FloatArray
    rule: _Rule
    small_rule: _Rule

    @classmethod
    def of(cls, panels: Panels, material: Material, order: IntArray, log_length: float) -> CurvedElements:
        """Return the elements of a mesh."""
        constants, points = Constants.of(material, log_length), CollocationPoints(panels, material, log_length)
        near, far = ((panels.half * panels.reach(distance))[order] for distance in (CURVED_DISTANCE, _FAR))
        rules = (_rule(panels, order, n_points) for n_points in (CURVED_POINTS, _FEW_POINTS))
        return cls(constants, points, order, near, far, *rules)

    def factors(self, is_double: bool, x: ComplexArray, places: IntArray, elements: IntArray) -> ComplexArray:
        """Return the factors (n, 2 or 4, n_points) of the densities on some elements; see `layers.straight_factors`.

        Parameters
        ----------
        is_double : bool
        x : (n_points,) complex array
        places : (n_points,) array
            The element in whose middle the point is, or another number; there T is a principal value.
        elements : (n,) array
            By place.
        """
        panels, numbers = self.points.panels, self.order[elements]
        distance = np.abs(x - panels.centre[numbers][:, None])
        is_far = distance.min(axis=1, initial=np.inf) > self.far[elements]
        result = np.empty((elements.size, 4 if is_double else 2, x.size), complex)
        for some, rule in ((np.flatnonzero(~is_far), self.rule), (np.flatnonzero(is_far), self.small_rule)):
            with np.errstate(all="ignore"):  # close pairs may overflow here; they are replaced
                arcs = _Rule(*(of[elements[some]] for of in rule))
                result[some] = _gauss_layer(self.constants, is_double, x, arcs)
        element, point = np.nonzero(distance < self.near[elements][:, None])
        if element.size:
            exact = self.points.at(x[point], numbers[element], places[point] == elements[element])
            result[element, :, point] = (exact[[2, 4, 3, 5]] if is_double else exact[:2]).T
        return result


def _rule(panels: Panels, order: IntArray, n_points: int) -> _Rule:
    """Return the Gauss rule on arcs."""
    polynomials, scale = panels.polynomials(order), (panels.half * panels.tangent)[order]
    slopes = curved_panels.derivative(polynomials)
    y, dy, p = np.empty((3, order.size, n_points), complex)
    for k, (t, weight) in enumerate(zip(*gauss_legendre(n_points), strict=True)):
        place = np.full(order.size, t + 0j)
        p[:, k] = curved_panels.evaluate(polynomials, place)
        y[:, k] = panels.centre[order] + scale * p[:, k]
        dy[:, k] = weight * scale * curved_panels.evaluate(slopes, place)
    return _Rule(y, dy, p)


def _gauss_layer(constants: Constants, is_double: bool, x: ComplexArray, rule: _Rule) -> ComplexArray:
    """Return the factors of the densities by a Gauss rule."""
    nu = constants.poisson_ratio
    result = np.zeros((len(rule.y), 4 if is_double else 2, x.size), complex)
    for y, dy, p in zip(rule.y.T[:, :, None], rule.dy.T[:, :, None], rule.p.T[:, :, None], strict=True):
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
