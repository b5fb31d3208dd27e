"""The straight elements of a mesh in complex notation, as the closed forms want them."""

from __future__ import annotations

import numpy as np

from bemkit.arrays import ComplexArray, FloatArray, IntArray
from bemkit.geometry.mesh import BoundaryMesh


class Panels:
    """Elements as arrays: end nodes, half lengths, tangents, centres (complex numbers x + i y).

    Parameters
    ----------
    mesh : BoundaryMesh
        Its coordinates should be relative to a point near the body, so that differences keep their digits.
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
        self.to_local: ComplexArray = self.tangent.conj() / self.half


def squared_distance(x: ComplexArray, y: ComplexArray) -> FloatArray:
    """Return |x - y|**2, broadcast."""
    difference = x - y
    result: FloatArray = np.square(difference.real)
    result += np.square(difference.imag)
    return result
