"""What a sweep is made of: cases, the similarity that leads each back to the baseline, and axes that make them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from bemkit.errors import InputError
from bemkit.geometry.mesh import BoundaryMesh
from bemkit.geometry.spaces import break_nodes
from bemkit.results.solution import Solution
from bemkit.scene.scene import Scene
from bemkit.scene.transform import AffineMap, transformed_scene

PRECISION = 1e-9
"""Agreement, relative to the largest entry, that similar problems owe each other after scaling."""


@dataclass(frozen=True)
class Similarity:
    """The same problem in other units and elsewhere: every result follows from that of the original.

    Parameters
    ----------
    length, modulus, stress : float
        Factors of all lengths of the body, of Young's modulus, and of all loads.
    shift : (float, float) [m]
        Where the origin goes.
    """

    length: float = 1.0
    modulus: float = 1.0
    stress: float = 1.0
    shift: tuple[float, float] = (0.0, 0.0)

    @property
    def displacement(self) -> float:
        """Factor of displacements, and so of gaps and prescribed displacements."""
        return self.stress / self.modulus * self.length

    def apply(self, scene: Scene) -> Scene:
        """Return the similar scene."""
        affine = AffineMap((self.length, self.length), self.shift)
        return transformed_scene(
            scene, affine, stress=self.stress, displacement=self.displacement, modulus=self.modulus
        )


@dataclass(frozen=True)
class Case:
    """One row to compute.

    Parameters
    ----------
    value : float
        Place on the axis.
    scene : Scene
    similarity : Similarity
        Factors that lead from the reference of the axis to this scene, by which results are scaled back.
    levels : int
        How often the elements at corners and ends of parts are halved, after the scene's own mesh is made.
    precision : float
        Agreement owed by the similar twin of this case.
    drift_limit : float
        Agreement owed to the reference; infinite if the answer may change along the axis.
    keeps_steps : bool
        Whether active sets and the number of linear solves must be those of the reference as well.
    is_solvable : bool or None
        Whether a solution exists, where that is known beforehand.
    """

    value: float
    scene: Scene
    similarity: Similarity = Similarity()
    levels: int = 0
    precision: float = PRECISION
    drift_limit: float = float("inf")
    keeps_steps: bool = False
    is_solvable: bool | None = None

    def mesh(self, scene: Scene) -> BoundaryMesh:
        """Divide the boundary of `scene`, which is this case's or similar to it."""
        mesh = scene.build_mesh()
        for _ in range(self.levels):
            mesh = mesh.refined(np.unique(mesh.node_elements[break_nodes(mesh)]))
        return mesh


@dataclass(frozen=True)
class Axis:
    """A direction in which a scene is driven to its extremes.

    Parameters
    ----------
    name : str
    label : str
        Of the values, for tables and plots.
    promise : str
        One sentence on what must hold along the axis.
    values : tuple of float
    make : callable (baseline solution, value) -> Case
    reference : float, optional
        Value whose row the others are compared with; the given scene if left out.
    """

    name: str
    label: str
    promise: str
    values: tuple[float, ...]
    make: Callable[[Solution, float], Case]
    reference: float | None = None

    @property
    def is_logarithmic(self) -> bool:
        """Whether the values span decades."""
        size = [abs(value) for value in self.values if value]
        return min(self.values) >= 0.0 and max(size) / min(size) > 100.0


def find_axes(axes: Sequence[Axis], names: Sequence[str]) -> tuple[Axis, ...]:
    """Return the axes of the given names, all of them if there are none.

    Raises
    ------
    UnknownAxisError
        The message lists the names.
    """
    known = {axis.name: axis for axis in axes}
    for name in names:
        if name not in known:
            raise UnknownAxisError(f"axis is {name!r}: the axes are {', '.join(known)}")
    return tuple(known[name] for name in names) if names else tuple(axes)


class UnknownAxisError(InputError):
    """An axis of a name that does not exist; the message lists the names."""
