"""Scenes that share their elastic bodies, each solved from rest: the bodies are assembled and factored once."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from threading import Lock
from typing import Any

from bemkit.errors import BemkitError
from bemkit.model.model import build_model
from bemkit.model.placed import find_units, with_found_contacts
from bemkit.runs.run import run
from bemkit.runs.steps import History, RunOptions, joined, planned, solve_steps
from bemkit.runs.warm_start import state_on
from bemkit.scene.load_history import load_steps
from bemkit.scene.scene import Scene
from bemkit.stopwatch import Stage, StageClock
from bemkit.threads import blas_threads_for


class SharedBody:
    """Solves scenes that differ only in loads, obstacles and laws; slip counts from rest in each of them.

    The body is made when the first scene is solved, out of the scene with most friction, so that results do not depend
    on which scenes were solved before.

    Parameters
    ----------
    scenes : sequence of Scene
        All of the same bodies, meshes, discretisation and kinds of conditions, without an accuracy.
    starts_cold : bool
        Whether each solve begins with every node sticking, as `bemkit.run` does. By default it begins at the solution
        before, as a guess; where a scene has several solutions the guess chooses among them.
    """

    def __init__(self, scenes: Sequence[Scene], *, starts_cold: bool = False) -> None:
        self._base = max(scenes, key=_n_with_friction)  # friction that is new would take another condensation
        self._starts_cold = starts_cold
        self._bodies: _Bodies | None = None
        self._is_refused = False
        self._lock = Lock()

    def __reduce__(self) -> tuple[object, ...]:
        """Pickle without matrices."""
        return partial(SharedBody, starts_cold=self._starts_cold), ([self._base],)

    def run(self, scene: Scene) -> Any:
        """Solve one of the scenes.

        Raises
        ------
        BemkitError
            As `bemkit.run` does.
        """
        with self._lock:
            if self._bodies is None and not self._is_refused:
                self._make()
            if self._bodies is None:
                return run(scene)  # each scene says itself what is wrong
            if not self._starts_cold and self._bodies.last is not None:
                solution = self._bodies.run(scene, is_cold=False)
                if solution.is_converged:
                    return solution
            return self._bodies.run(scene, is_cold=True)

    def release(self) -> None:
        """Free all matrices; another scene would assemble them again."""
        with self._lock:
            self._bodies = None

    def _make(self) -> None:
        try:
            self._bodies = _Bodies(self._base)
        except BemkitError:
            self._is_refused = True


def _n_with_friction(scene: Scene) -> int:
    laws = [scene.law] if scene.bodies else scene.only.laws.values()
    return sum(not law.is_frictionless for law in laws)


class _Bodies:
    """The bodies of a scene under several loads, obstacles, gaps and laws."""

    def __init__(self, base: Scene) -> None:
        steps, self._plan, _ = planned(load_steps(base))
        self._found = tuple(pair for pair in steps[0].scene.contacts if pair not in base.contacts)
        self.last: Any = None
        with blas_threads_for(steps[0].largest_matrix):
            self._model = build_model(steps[0])

    def run(self, scene: Scene, *, is_cold: bool) -> Any:
        """Solve a scene, from rest or from the solution of the last."""
        clock, base = StageClock.start(), self._model.prepared
        scenes = [with_found_contacts(step, self._found) for step in load_steps(scene)]
        with blas_threads_for(base.largest_matrix):
            units = find_units(scenes, base.bodies)  # those of the scene itself
            is_alike = (units.modulus, units.stress) == (base.units.modulus, base.units.stress)
            steps = tuple(base.under(step, None if is_alike else units) for step in scenes)
            model = self._model.under(steps[0])
            clock = clock.closed(Stage.CONDENSE)
            guess = None if is_cold or self.last is None else partial(state_on, solution=self.last)
            history = History.of(scene, scenes, RunOptions(guess))
            solution = joined(history, solve_steps(model, steps, self._plan, history, clock))
        if solution.is_converged and len(steps) == 1 and solution.contact.n_contact:
            self.last = solution
        return solution
