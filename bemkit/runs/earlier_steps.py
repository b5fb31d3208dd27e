"""Steps of a load history with an accuracy that an earlier run has solved on one of its meshes."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from bemkit.geometry.mesh import BoundaryMesh
from bemkit.results.solution import Solution
from bemkit.runs.mesh_sequence import Level

_SAME = 1e-9
"""Relative difference of the lengths of equal elements, in the coordinates of the shape and in those of its place."""


@dataclass(frozen=True)
class EarlierSteps:
    """Solutions of earlier steps, and the callback for new ones.

    Parameters
    ----------
    done : Solution, optional
        Some steps on one of the meshes; meshes before that one are solved again, unheard.
    finished : callable, optional
        Receives the solution of each step on a mesh but the last; see `bemkit.runs.steps.History`.
    """

    done: Solution | None = None
    finished: Callable[[Solution], None] | None = None

    def on(self, level: Level) -> tuple[Solution | None, Callable[[Solution], None] | None]:
        """Return the finished steps on the meshes of a level, and the callback for further ones."""
        if self.done is None:
            return None, self.finished
        if _has_meshes(self.done, level.meshes):
            return self.done, self.finished
        return None, None if level.n_elements < self.done.n_elements else self.finished


def _has_meshes(solution: Solution, meshes: Mapping[str, BoundaryMesh]) -> bool:
    """Return whether a solution is one on these meshes, wherever its bodies lie."""
    pairs = [(solution.bodies[name].mesh.lengths, mesh.lengths) for name, mesh in meshes.items()]
    return all(one.shape == two.shape and np.allclose(one, two, rtol=_SAME, atol=0.0) for one, two in pairs)
