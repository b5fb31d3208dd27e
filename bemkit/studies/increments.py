"""Errors of the increments of a load history: one step against two halves."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from bemkit.errors import InputError, NoResultError
from bemkit.runs.run import run
from bemkit.scene.scene import Scene


@dataclass(frozen=True)
class IncrementErrors:
    """Changes of results when every increment is halved, about half the errors of a method of first order.

    Parameters
    ----------
    n_increments : int
        Of the history as stated.
    external_work : float or None [-]
        Relative change of the work of the loads.
    dissipation : float or None [-]
        Relative change of the dissipation by friction. None without dissipation.
    tractions : float or None [-]
        Largest change of contact tractions in L2 at the end of an original increment, relative to the largest tractions
        at the end of any increment.
    """

    n_increments: int
    external_work: float | None
    dissipation: float | None
    tractions: float | None


def increment_errors(scene: Scene) -> IncrementErrors:
    """Solve a load history as stated and with every increment halved, and compare.

    Parameters
    ----------
    scene : Scene
        With steps or load factors, on one mesh.

    Raises
    ------
    InputError
        If the scene has a single load or an accuracy, whose meshes would differ.
    NoResultError
        If one of the runs does not converge.
    ValueError
        As for `bemkit.run`.
    """
    if scene.n_steps == 1:
        raise InputError("the scene has a single load: increments need [[steps]] or load_factors")
    if scene.mesh.accuracy is not None:
        raise InputError(
            "the scene has an accuracy, and the meshes of both runs would differ: give a number of elements"
        )
    coarse, fine = (run([each]) for each in (scene, with_halved_increments(scene)))
    for steps, words in ((coarse, "as stated"), (fine, "with halved increments")):
        if not steps[-1].is_converged:
            raise NoResultError(f"the history {words} is not solved: {steps[-1].message}")
    whole, halves = (loading.total() for steps in (coarse, fine) if (loading := steps[-1].loading) is not None)
    return IncrementErrors(
        len(coarse),
        _change(whole.external_work, halves.external_work),
        _change(whole.dissipation, halves.dissipation),
        _change_of_tractions(coarse, fine[1::2]),
    )


def with_halved_increments(scene: Scene) -> Any:
    """Return a load history with every increment divided into two."""
    given: Any = scene
    if given.steps:
        return replace(given, steps=tuple(replace(step, increments=2 * step.increments) for step in given.steps))
    factors = np.array(given.load_factors)
    before = np.append(0.0, factors[:-1])
    return replace(given, load_factors=tuple(np.stack([0.5 * (before + factors), factors], axis=1).ravel().tolist()))


def _change(coarse: float, fine: float) -> float | None:
    """Return the change of a number relative to the finer one; None if both vanish."""
    size = max(abs(coarse), abs(fine))
    return abs(coarse - fine) / size if size > 0.0 else None


def _change_of_tractions(coarse: Any, fine: Any) -> float | None:
    """Return the largest change of the tractions at the ends of the same increments, relative to the largest ones."""
    tables = [(one.contact, two.contact) for one, two in zip(coarse, fine, strict=True)]

    def norm(weight: Any, *tractions: Any) -> float:
        return float(np.sqrt(sum(weight @ np.square(traction) for traction in tractions)))

    size = max(norm(two.weight, two.sigma_n, two.sigma_t) for _, two in tables)
    changes = (norm(two.weight, one.sigma_n - two.sigma_n, one.sigma_t - two.sigma_t) for one, two in tables)
    return max(changes) / size if size > 0.0 else None
