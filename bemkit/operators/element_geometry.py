"""The elements of a mesh in complex notation."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from bemkit.arrays import BoolArray, ComplexArray, FloatArray, IntArray
from bemkit.geometry.mesh import BoundaryMesh

if TYPE_CHECKING:
    from bemkit.operators.integrals.curved_geometry import CurvedGeometry


class ElementGeometry:
    """Arrays of end nodes, half lengths, tangents and centres of elements, as complex numbers x + i y.

    Parameters
    ----------
    mesh : BoundaryMesh
        Coordinates should be relative to a point near the body, so that differences keep their digits.

    Raises
    ------
    GeometryError
        If a curved element bends too much to be a polynomial of its arc length.

    Notes
    -----
    In the local coordinate (x - centre) / (half tangent) a straight element is the interval [-1, 1]. A curved element
    is the image of that interval under a polynomial p of low degree with |p'| = 1, see `curved_geometry`; `half` is
    half the arc length, `tangent` the direction of the chord and `centre` the midpoint of the arc.
    """

    def __init__(self, mesh: BoundaryMesh) -> None:
        self.start_node: IntArray = mesh.elements[:, 0]
        self.end_node: IntArray = mesh.elements[:, 1]
        nodes: ComplexArray = mesh.nodes[:, 0] + 1j * mesh.nodes[:, 1]
        self.start: ComplexArray = nodes[self.start_node]
        self.end: ComplexArray = nodes[self.end_node]
        span = self.end - self.start
        self.half: FloatArray = 0.5 * np.abs(span)
        self.tangent: ComplexArray = span / (2.0 * self.half)
        self.centre: ComplexArray = self.start + 0.5 * span
        self.is_straight = mesh.is_straight
        self.curved: CurvedGeometry | None = None
        if not self.is_straight.all():
            from bemkit.operators.integrals.curved_geometry import fit

            curved = np.flatnonzero(~self.is_straight)
            self.half[curved] = 0.5 * mesh.lengths[curved]
            self.centre[curved] = mesh.centres[curved] @ np.array([1.0, 1j])
            self.curved = fit(mesh, self.tangent, self.half, self.centre)
        self.to_local: ComplexArray = self.tangent.conj() / self.half

    def polynomials(self, elements: IntArray) -> ComplexArray:
        """Return the coefficients (n_powers, n) of p for some elements."""
        if self.curved is None:
            return np.repeat(np.array([[0.0], [1.0 + 0j]]), elements.size, axis=1)
        return self.curved.about_centre[:, elements]

    def point(self, elements: IntArray, xi: float) -> ComplexArray:
        """Return the points (n,) of some elements at one local coordinate in [-1, 1]."""
        return np.asarray(self.centre[elements] + self.from_centre(elements, xi))

    def from_centre(self, elements: IntArray, xi: FloatArray | float) -> ComplexArray:
        """Return points (n,) of elements (n,) relative to their centres, at one local coordinate or one for each."""
        along = xi if self.curved is None else self.curved.at(elements, xi)
        return np.asarray((self.half * self.tangent)[elements] * along)

    def offset(self, elements: IntArray, fraction: FloatArray, at_start: BoolArray) -> ComplexArray:
        """Return points relative to one end node, with full relative accuracy at any distance from it.

        Parameters
        ----------
        elements : (n,) int array
        fraction : (n,) array
            Distances along the elements from that end node, in lengths of the element.
        at_start : (n,) bool array
            Whether distances are measured from the start node.
        """
        shift = np.where(at_start, 2.0, -2.0) * fraction
        offset = self.tangent[elements] * (self.half[elements] * shift)
        if self.curved is None:
            return offset
        return offset * self.curved.slopes_from_end(elements, shift, at_start)

    def distance_at(self, distance: float) -> FloatArray:
        """Return the distance from the centre, in half lengths, at which the parameter of each element is `distance`.

        On straight elements both are equal; outside of a circular element the parameter grows like the logarithm of
        the distance.
        """
        if self.curved is None:
            return np.full(self.half.size, distance)
        return self.curved.stretched(distance)


def squared_distance(x: ComplexArray, y: ComplexArray) -> FloatArray:
    """Return |x - y|**2 of arrays that broadcast."""
    difference = x - y
    result: FloatArray = np.square(difference.real)
    result += np.square(difference.imag)
    return result
