"""Placements of bodies: a rotation about the origin of the shape's coordinates, then a shift."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from bemkit.arrays import FloatArray
from bemkit.errors import InputError
from bemkit.geometry.curves import TransformedCurve, as_point
from bemkit.geometry.mesh import BoundaryMesh


@dataclass(frozen=True)
class Placement:
    """The motion x -> R x + shift from the coordinates of a shape to those of a scene.

    Parameters
    ----------
    shift : (float, float) [m]
    turn : float [degree]
        Anticlockwise, about the origin of the shape's coordinates.

    Raises
    ------
    InputError
        If a number is not finite.
    """

    shift: tuple[float, float] = (0.0, 0.0)
    turn: float = 0.0

    def __post_init__(self) -> None:
        object.__setattr__(self, "shift", as_point(self.shift, "Placement: shift"))
        if not math.isfinite(self.turn):
            raise InputError(f"Placement: turn is {self.turn}: give a finite angle in degrees")

    @property
    def rotation(self) -> FloatArray:
        """(2, 2) array: R, exact for multiples of 90 degrees."""
        quarters, remainder = divmod(self.turn, 90.0)
        angle = math.radians(remainder)
        cosine, sine = math.cos(angle), math.sin(angle)
        for _ in range(int(quarters) % 4):
            cosine, sine = -sine, cosine
        return np.array([[cosine, -sine], [sine, cosine]]) + 0.0  # no negative zeros

    @property
    def is_shift(self) -> bool:
        """Whether the rotation is zero."""
        return self.turn % 360.0 == 0.0

    def forward(self, points: FloatArray) -> FloatArray:
        """Return points (..., 2) [m] of the shape in the coordinates of the scene."""
        return np.asarray(self.turned(points) + np.array(self.shift))

    def back(self, points: FloatArray) -> FloatArray:
        """Return points (..., 2) [m] of the scene in the coordinates of the shape."""
        return self.turned_back(np.asarray(points - np.array(self.shift)))

    def turned(self, vectors: FloatArray) -> FloatArray:
        """Return vectors (..., 2) of the shape in the axes of the scene."""
        return vectors if self.is_shift else np.asarray(vectors @ self.rotation.T)

    def turned_back(self, vectors: FloatArray) -> FloatArray:
        """Return vectors (..., 2) of the scene in the axes of the shape."""
        return vectors if self.is_shift else np.asarray(vectors @ self.rotation)

    def after(self, first: Placement) -> Placement:
        """Return the motion `first`, followed by this one."""
        x, y = self.forward(np.array(first.shift)).tolist()
        return Placement((x, y), self.turn + first.turn)

    @property
    def inverse(self) -> Placement:
        """The motion back to the coordinates of the shape."""
        x, y = self.turned_back(-np.array(self.shift)).tolist()
        return Placement((x, y), -self.turn)

    def mesh(self, mesh: BoundaryMesh) -> BoundaryMesh:
        """Return the mesh of the placed body, without checking it again.

        Parameters
        ----------
        mesh : BoundaryMesh
            Without symmetry.
        """
        if self == Placement():
            return mesh
        (a, b), (c, d) = self.rotation.tolist()
        curves = tuple(TransformedCurve(curve, matrix=((a, b), (c, d)), shift=self.shift) for curve in mesh.curves)
        return mesh.unchecked_copy(self.forward(mesh.nodes), curves)
