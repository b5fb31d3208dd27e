"""One scene of the calibration: solved finely once, and with elements of every degree."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from functools import partial
from types import MappingProxyType

import numpy as np

from bemkit.errors import BemkitError
from bemkit.geometry.meshing.discretise import Algebraic, Grading, Uniform
from bemkit.results.solution import Solution
from bemkit.runs.mesh_sequence import with_sides_of
from bemkit.runs.run import run
from bemkit.scene.discretisation import Galerkin, MeshOptions
from bemkit.scene.scene import Scene
from bemkit.studies.engine import Task
from checks.calibration.draw import one_body, two_bodies
from checks.calibration.true_errors import true_errors
from checks.random_scenes.draw import Draw

DEGREES: Mapping[str, tuple[int, int] | None] = MappingProxyType(
    {"1": (24, 64), "2": (24, 64), "3": (12, 40), "6": (12, 24), "hp": None}
)
"""Degrees of elements with the fewest and the most elements of a body; of hp the accuracy is drawn."""
FINEST = 1e-4
"""Accuracy of the fine solution."""
COARSEST_HP, FINEST_HP = -1.3, -2.6
"""Decades of the accuracies of hp."""
MOST_ELEMENTS = 500
"""Elements of a fine solution, counted as quadratic ones with as many nodes."""
FEWEST = 5
"""Contact nodes that carry pressure, from which a mesh counts as fine enough, unless bemkit warns that curves turn too
much on an element for any estimate."""
ROUND_OFF = 1e-10
"""Relative error of tractions that a polynomial represents exactly."""
SHARPER = 5.0
"""Factor by which the fine solution must be more accurate than the error that it measures."""


@dataclass(frozen=True)
class Row:
    """Estimate over true error of a scene at one degree, or why it does not count.

    Parameters
    ----------
    index : int
    degree : str
    energy, tractions : float
        nan if the row does not count.
    reason : str
        Empty if it counts.
    """

    index: int
    degree: str
    energy: float = np.nan
    tractions: float = np.nan
    reason: str = ""


@dataclass(frozen=True)
class Trial:
    """The rows of a scene, which the number of bodies, a seed and an index determine."""

    key: tuple[int, int, int]
    rows: tuple[Row, ...]


def drawn_scene(n_bodies: int, seed: int, index: int) -> tuple[Scene, Draw]:
    """Draw a scene without discretisation, and what draws its meshes."""
    draw = Draw(np.random.PCG64([seed, index, n_bodies]))
    return (one_body if n_bodies == 1 else two_bodies)(draw), draw


def try_scene(n_bodies: int, seed: int, index: int) -> Trial:
    """Solve a scene and compare estimates with errors.

    A row counts if both solutions are certified, the contact is resolved, and the fine solution is accurate enough.
    """
    scene, draw = drawn_scene(n_bodies, seed, index)
    discretisations = {degree: _discretised(scene, draw, degree) for degree in DEGREES}
    fine = _solved(_with_accuracy(scene, FINEST))
    rows = tuple(_row(index, degree, coarse, fine) for degree, coarse in discretisations.items())
    return Trial((n_bodies, seed, index), rows)


def trial_tasks(n_bodies: int, seed: int, count: int) -> Iterator[Task[Trial]]:
    """Yield the tasks of scenes, for `bemkit.studies.engine.compute`."""
    for index in range(count):
        yield Task((n_bodies, seed, index), f"scene {index}", partial(try_scene, n_bodies, seed, index))


def _discretised(scene: Scene, draw: Draw, degree: str) -> Scene:
    """Draw the mesh of a degree."""
    counts = DEGREES[degree]
    if counts is None:
        return _with_accuracy(scene, draw.decades(FINEST_HP, COARSEST_HP))
    elements = int(draw.integers(counts[0], counts[1] + 1))
    grading: Grading = Uniform() if draw.chance(0.6) else Algebraic(draw.between(1.2, 2.5))

    def divided(mesh: MeshOptions | None) -> MeshOptions:
        return replace(mesh or MeshOptions(), elements=elements, grading=grading)

    bodies = tuple(replace(body, mesh=divided(body.mesh)) for body in scene.bodies)
    return replace(scene, discretisation=Galerkin(int(degree)), mesh=divided(scene.mesh), bodies=bodies)


def _with_accuracy(scene: Scene, accuracy: float) -> Scene:
    mesh = MeshOptions(accuracy=accuracy, rising_degrees=True, most_elements=MOST_ELEMENTS)
    bodies = tuple(replace(body, mesh=None) for body in scene.bodies)
    return replace(scene, discretisation=Galerkin(2), mesh=mesh, bodies=bodies)


def _solved(scene: Scene) -> Solution | str:
    """Return a certified solution, or the status or the error."""
    try:
        solution: Solution = run(scene)
    except BemkitError as error:
        return type(error).__name__
    return solution if solution.is_converged else solution.status.name.lower()


def _row(index: int, degree: str, scene: Scene, fine: Solution | str) -> Row:
    if isinstance(fine, str):
        return Row(index, degree, reason=f"fine solution {fine}")
    coarse = _solved(scene)
    if isinstance(coarse, str):
        return Row(index, degree, reason=coarse)
    is_coarse = any(warning.kind == "coarse curve" for warning in coarse.warnings)
    if is_coarse or int(np.count_nonzero(coarse.contact.sigma_n < 0.0)) < FEWEST:
        return Row(index, degree, reason="unresolved")
    if coarse.contact_sides != fine.contact_sides:  # tractions of one side would be compared to those of the other
        fine = _solved(_with_accuracy(with_sides_of(scene, coarse), FINEST))
        if isinstance(fine, str):
            return Row(index, degree, reason=f"fine solution {fine}")
    energy, tractions = true_errors(coarse, fine)
    estimates = coarse.estimated_error, coarse.estimated_traction_error
    limits = fine.estimated_error, fine.estimated_traction_error
    if any(value is None for value in (*estimates, *limits)):
        return Row(index, degree, reason="no estimate")
    if tractions < ROUND_OFF:
        return Row(index, degree, reason="exact")
    if energy < SHARPER * limits[0] or tractions < SHARPER * limits[1]:
        return Row(index, degree, reason="fine solution too coarse")
    return Row(index, degree, estimates[0] / energy, estimates[1] / tractions)
