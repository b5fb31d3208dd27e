"""Straight elements and the densities on them, of which nothing is stored that follows from the mesh."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from bemkit.arrays import BoolArray, ComplexArray, FloatArray, IntArray
from bemkit.geometry.mesh import BoundaryMesh
from bemkit.geometry.neighbours import corner_nodes
from bemkit.operators.collocation.gradient_reconstruction import CORNER_ANGLE, GradientReconstruction
from bemkit.operators.collocation.layers import Constants
from bemkit.operators.material import Material

_CHUNK = 2048
"""Elements that are processed at a time, which bounds the memory."""


@dataclass(frozen=True, eq=False)
class StraightElements:
    """All elements of a mesh in complex notation.

    Parameters
    ----------
    mesh : BoundaryMesh
        Of straight elements, without symmetry.
    constants : Constants
    is_corner : (n_nodes,) bool array or None
        Nodes across which no slopes are taken; None if displacements have no slopes.
    """

    mesh: BoundaryMesh
    constants: Constants
    is_corner: BoolArray | None

    @classmethod
    def of(cls, mesh: BoundaryMesh, material: Material, *, takes_slopes: bool) -> StraightElements:
        """Return the elements of a mesh, whose diameter is the unit of length of the logarithm."""
        is_corner = corner_nodes(mesh, CORNER_ANGLE) if takes_slopes else None
        return cls(mesh, Constants.of(material, mesh.diameter), is_corner)

    @property
    def takes_slopes(self) -> bool:
        """Whether displacements have slopes."""
        return self.is_corner is not None

    @cached_property
    def nodes(self) -> ComplexArray:
        """(n_nodes,) complex array [m]: those of the mesh."""
        return np.ascontiguousarray(self.mesh.nodes).view(complex)[:, 0]

    def ends(self, elements: IntArray) -> tuple[ComplexArray, ComplexArray]:
        """Return where elements start and end."""
        first, second = self.mesh.elements[elements].T
        return self.nodes[first], self.nodes[second]

    def centres(self, elements: IntArray) -> ComplexArray:
        """Return the middles of elements; one index for each."""
        start, end = self.ends(elements)
        return np.asarray(start + 0.5 * (end - start))

    def chunks(self) -> Iterator[IntArray]:
        """Return all elements, some at a time."""
        n = self.mesh.n_elements
        return (np.arange(i, min(i + _CHUNK, n)) for i in range(0, n, _CHUNK))

    def reconstructed(self, displacement: ComplexArray) -> tuple[ComplexArray, ComplexArray]:
        """Return constant parts and slopes (n_elements,) of displacements (n_elements,)."""
        if self.is_corner is None:
            return displacement.copy(), np.zeros_like(displacement)
        mean, slope = displacement.copy(), np.empty_like(displacement)
        for some in self.chunks():
            ends = self.mesh.elements[some].T
            neighbours = np.stack([self.mesh.node_elements[ends[0], 0], some, self.mesh.node_elements[ends[1], 1]])
            centres = self.centres(neighbours.ravel()).reshape(neighbours.shape)
            half = 0.5 * (self.nodes[ends[1]] - self.nodes[ends[0]])
            of = GradientReconstruction.between(neighbours, centres, half, self.is_corner[ends])
            values = displacement[neighbours]
            mean[some] += np.sum(of.means * values, axis=0)
            slope[some] = np.sum(of.slopes * values, axis=0)
        return mean, slope


def pairs(vectors: ComplexArray) -> FloatArray:
    """Return complex numbers (n,) as vectors (n, 2)."""
    return vectors.view(float).reshape(-1, 2)
