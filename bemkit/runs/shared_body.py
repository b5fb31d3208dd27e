"""Scenes that share their elastic bodies, each solved from rest: the bodies are assembled and factored once."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from threading import Lock
from typing import Protocol

import numpy as np

from bemkit.contact.body import ContactState
from bemkit.errors import BemkitError
from bemkit.model.assembled.model import build_assembled_model
from bemkit.model.assembled.prepared import PreparedAssembly
from bemkit.model.contact_model import Model, build_model
from bemkit.model.prepared import Prepared
from bemkit.model.units import find_units
from bemkit.operators.linear.threads import blas_threads_for
from bemkit.results.assembly_solution import AssemblySolution
from bemkit.results.solution import Solution
from bemkit.runs.assembly import SEVERAL_BODIES, assembly_solution
from bemkit.runs.history import ONE_BODY
from bemkit.runs.run import run
from bemkit.runs.steps import History, joined, solve_steps, solved_once
from bemkit.runs.warm_start import state_on
from bemkit.scene.assembly import Assembly
from bemkit.scene.load_history import load_steps
from bemkit.scene.scene import Scene
from bemkit.stopwatch import Stage, StageClock

AnyScene = Scene | Assembly
AnySolution = Solution | AssemblySolution


class SharedBody:
    """Solves scenes that differ only in loads, obstacles and laws; slip counts from rest in each of them.

    The body is made when the first scene is solved, out of the scene with most friction, so that results do not depend
    on which scenes were solved before.

    Parameters
    ----------
    scenes : sequence of Scene or Assembly
        All of the same bodies, meshes, discretisation and kinds of conditions, without an accuracy.
    has_one_load : bool
        Whether they differ only in their laws and solvers.
    starts_cold : bool
        Whether each solve begins with every node sticking, as `bemkit.run` does. By default it begins at the solution
        before, as a guess; where a scene has several solutions the guess chooses among them.
    """

    def __init__(self, scenes: Sequence[AnyScene], *, has_one_load: bool = False, starts_cold: bool = False) -> None:
        self._base = max(scenes, key=_n_with_friction)  # friction that is new would take another condensation
        self._has_one_load = has_one_load
        self._starts_cold = starts_cold
        self._solver: _Solver | None = None
        self._lock = Lock()

    def __reduce__(self) -> tuple[object, ...]:
        """Travel to another process without matrices."""
        return _shared_body, (self._base, self._has_one_load, self._starts_cold)

    def run(self, scene: AnyScene) -> AnySolution:
        """Solve one of the scenes.

        Raises
        ------
        BemkitError
            As `bemkit.run` does.
        """
        with self._lock:
            if self._solver is None:
                self._solver = self._made()
            if not self._starts_cold and self._solver.has_start:
                solution = self._solver.run(scene, is_cold=False)
                if solution.is_converged:
                    return solution
            return self._solver.run(scene, is_cold=True)

    def release(self) -> None:
        """Let go of all matrices; they would be made again for another scene."""
        with self._lock:
            self._solver = None

    def _made(self) -> _Solver:
        try:
            if isinstance(self._base, Assembly):
                return _SeveralBodies(self._base)
            return _OneBody(self._base, has_one_load=self._has_one_load)
        except BemkitError:
            return _Anew()  # each scene says itself what is wrong


def _shared_body(base: AnyScene, has_one_load: bool, starts_cold: bool) -> SharedBody:
    return SharedBody([base], has_one_load=has_one_load, starts_cold=starts_cold)


def _n_with_friction(scene: AnyScene) -> int:
    laws = [scene.law] if isinstance(scene, Assembly) else list(scene.laws.values())
    return sum(not law.is_frictionless for law in laws)


class _Solver(Protocol):
    @property
    def has_start(self) -> bool:
        """Whether a scene has been solved from which others can start."""

    def run(self, scene: AnyScene, *, is_cold: bool) -> AnySolution:
        """Solve a scene."""


class _Anew:
    """Assembles the body of every scene anew."""

    has_start = False

    def run(self, scene: AnyScene, *, is_cold: bool) -> AnySolution:
        return run(scene)


class _OneBody:
    """One elastic body under several scenes."""

    def __init__(self, base: Scene, *, has_one_load: bool) -> None:
        steps, self._plan, _ = ONE_BODY.planned(load_steps(base), None)
        self._has_one_load = has_one_load and len(steps) == 1
        self._last: Solution | None = None
        with blas_threads_for(steps[0].largest_matrix):
            self._model = build_model(steps[0])

    @property
    def has_start(self) -> bool:
        return self._last is not None

    def run(self, scene: AnyScene, *, is_cold: bool) -> AnySolution:
        if not isinstance(scene, Scene):
            return run(scene)
        clock, start = StageClock.start(), None if is_cold else self._last
        with blas_threads_for(self._model.prepared.largest_matrix):
            model, steps = self._under(scene)
            clock = clock.closed(Stage.CONDENSE)
            history: History[Solution] = History.of(scene, [step.scene for step in steps])
            guess = None if start is None else state_on(model, start)
            solution = joined(
                history, solve_steps(ONE_BODY, model, steps, self._plan, history, clock=clock, guess=guess)
            )
        if solution.is_converged and len(steps) == 1 and scene.contact_parts:
            self._last = solution
        return solution

    def _under(self, scene: Scene) -> tuple[Model, tuple[Prepared, ...]]:
        """Return the model of the first load step, and all steps, in the units of the scene itself."""
        steps, base = load_steps(scene), self._model.scene
        if self._has_one_load and _frictionless_parts(scene) == _frictionless_parts(base):
            model = self._model.with_law(steps[0])
            return model, (model.prepared,)
        prepared = self._model.prepared
        units = max((find_units(step, prepared.mesh) for step in steps), key=lambda units: units.stress)
        prepared = replace(prepared, units=units)
        under = tuple(prepared.under(step) for step in steps)
        return self._model.under(under[0]), under


def _frictionless_parts(scene: Scene) -> set[str]:
    return {name for name, law in scene.laws.items() if law.is_frictionless}


class _SeveralBodies:
    """The bodies of an assembly under several loads, gaps and laws."""

    def __init__(self, base: Assembly) -> None:
        (prepared,), self._plan, _ = SEVERAL_BODIES.planned(load_steps(base)[:1], None)
        self._last: ContactState | None = None
        with blas_threads_for(prepared.largest_matrix):
            self._model = build_assembled_model(prepared)

    @property
    def has_start(self) -> bool:
        return self._last is not None

    def run(self, scene: AnyScene, *, is_cold: bool) -> AnySolution:
        if not isinstance(scene, Assembly):
            return run(scene)
        clock, base = StageClock.start(), self._model.prepared
        if scene.load_factors != (1.0,) or scene.steps:  # a history of its own
            return run(scene)
        prepared = base.under(scene.with_contacts(base.assembly.contacts) if scene.touching else scene)
        if not _has_same_rows(prepared, base):  # an obstacle that has turned, say
            return run(scene)
        with blas_threads_for(base.largest_matrix):
            model = self._model.under(prepared)
            clock, start = clock.closed(Stage.CONDENSE), None if is_cold else self._last
            reached = solved_once(SEVERAL_BODIES, model, start)
            solution = assembly_solution(model, reached, self._plan, clock.closed(Stage.SOLVE))
        if solution.is_converged:
            self._last = reached.state
        return solution


def _has_same_rows(prepared: PreparedAssembly, other: PreparedAssembly) -> bool:
    """Whether the same nodes touch the same sides in the same directions."""
    pairs = list(zip(prepared.conditions, other.conditions, strict=True))
    return (
        prepared.names == other.names
        and all(np.array_equal(one.nodes, two.nodes) for one, two in zip(prepared.rows, other.rows, strict=True))
        and np.allclose(prepared.frame, other.frame, rtol=0.0, atol=1e-12)
        and all(np.array_equal(one.is_retained, two.is_retained) for one, two in pairs)
    )
