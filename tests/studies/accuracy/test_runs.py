"""Rows of a study: what is measured, what is shown when there is nothing to measure, and the orders of the elements."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable
from concurrent.futures import Executor, Future, ProcessPoolExecutor, ThreadPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from functools import lru_cache
from multiprocessing import get_context
from typing import Any

import pytest

import bemkit as bk
from bemkit.reference import MEASURES, Reference, find_reference, over_resolved
from bemkit.studies.accuracy.records import STAGES, ErrorRecord, by_series, fitted_order
from bemkit.studies.accuracy.runs import Run, adaptive, all_runs, error_tasks, graded, uniform
from bemkit.studies.engine import StudyError, compute

LINEAR, QUADRATIC, CONSTANT = bk.Galerkin(1), bk.Galerkin(2), bk.ConstantCollocation()
NEWTON, AUGMENTED = bk.SemismoothNewton(), bk.AugmentedLagrangian()


@lru_cache
def reference() -> Reference:
    found = find_reference(bk.load_scene("paper-1"))
    assert found is not None
    return found


def paper_runs(*meshes: Any, elements: tuple[Any, ...] = (LINEAR,), **changes: Any) -> tuple[Run, ...]:
    scene = dataclasses.replace(bk.load_scene("paper-1"), **changes)
    return all_runs(scene, elements, meshes, [NEWTON])


def test_runs_are_all_combinations_but_adaptive_constant_elements() -> None:
    scene = bk.load_scene("paper-1")
    meshes = (uniform((20, 40)), graded((20,)), adaptive((1e-2,)))
    runs = all_runs(scene, [CONSTANT, LINEAR], meshes, [NEWTON, AUGMENTED])
    assert len({run.key for run in runs}) == len(runs) == 2 * (2 + 1) + 2 * (2 + 1 + 1)
    assert {(run.discretisation, run.map) for run in runs} == {("constant", "collocation"), ("linear", "Galerkin")}
    assert {run.solver for run in runs} == {"semismooth-newton", "augmented-lagrangian"}
    followed = next(run.scene.mesh for run in runs if run.meshes == "adaptive")
    assert (followed.accuracy, followed.most_elements) == (1e-2, 500)
    densities = [run.scene.mesh.density for run in all_runs(bk.load_scene("paper-2"), [LINEAR], meshes[:2], [NEWTON])]
    assert densities == [{"bottom": 2.0}] * 3


def test_nothing_to_run_and_runs_that_are_the_same() -> None:
    scene = bk.load_scene("paper-1")
    with pytest.raises(StudyError, match="no run is possible: give at least one element type"):
        all_runs(scene, [CONSTANT], [adaptive((1e-2,))], [NEWTON])
    with pytest.raises(StudyError, match="no part of the scene is in contact: errors are measured"):
        all_runs(bk.load_scene("bending"), [LINEAR], [uniform((20,))], [NEWTON])
    with pytest.raises(StudyError, match="linear, uniform, semismooth-newton of size 20 is given twice: remove one"):
        all_runs(scene, [LINEAR], [uniform((20, 20))], [NEWTON])


def test_a_row_measures_times_memory_and_errors() -> None:
    (row,) = compute(error_tasks(paper_runs(uniform((40,))), reference(), 2))
    stages = [getattr(row, f"seconds_{stage}") for stage in STAGES]
    assert all(seconds > 0.0 for seconds in stages)
    # medians of two repetitions: sums and totals agree
    assert sum(stages) == pytest.approx(row.seconds, rel=1e-6)
    matrix = 8 * (2 * 40) ** 2
    assert 4 * matrix < row.peak_memory < 100 * matrix
    assert (row.status, row.elements, row.map, row.message) == ("converged", 40, "Galerkin", "")
    assert all(math.isfinite(getattr(row, measure)) for measure in MEASURES)
    assert 0.0 < row.energy < 1e-2
    assert 0.0 < row.estimated_error < 1.0


def test_rows_without_a_solution_say_why_and_claim_nothing() -> None:
    loads = tuple(part for part in bk.load_scene("paper-1").parts if part.name != "wall")
    few = bk.SemismoothNewton(max_steps=1)
    floating = paper_runs(uniform((20,)), parts=loads, law=bk.Frictionless())
    hasty = all_runs(bk.load_scene("paper-1"), [LINEAR], [uniform((40,))], [few])
    refused, stopped = compute(error_tasks([*floating, *hasty], reference(), 3))
    assert refused.status == "refused"
    assert refused.message
    assert stopped.status == "max_steps"
    for row in (refused, stopped):
        assert all(math.isnan(getattr(row, name)) for name in ("seconds", "peak_memory", *MEASURES))


def test_a_scene_that_does_not_allow_an_element_type_is_a_row_among_others() -> None:
    free = dataclasses.replace(bk.load_scene("paper-1"), discretisation=LINEAR, linear_solver=bk.MatrixFree(1e-10, 1))
    runs = all_runs(free, [CONSTANT], [uniform((240,))], [NEWTON])
    runs = (*runs, *all_runs(free, [LINEAR], [uniform((20,))], [NEWTON]))
    rows = list(compute(error_tasks(runs, reference(), 1)))
    assert [row.status for row in rows] == ["refused", "converged"]
    assert "after 1 step of GMRES" in rows[0].message


@pytest.mark.slow
def test_an_accuracy_out_of_reach_shows_what_was_reached() -> None:
    meshes = adaptive((1e-2, 1e-6), most_elements=100)
    near, far = compute(error_tasks(paper_runs(meshes, elements=(QUADRATIC,)), reference(), 1))
    assert near.message == ""
    assert near.estimated_error <= 1e-2
    assert "The accuracy 1e-06 was not reached: more than 100 elements would be needed" in far.message
    assert far.status == "accuracy_not_reached"
    assert far.is_certified
    assert far.elements <= 100
    assert far.energy < 1e-4


def test_tasks_have_labels_and_repetitions() -> None:
    runs = paper_runs(uniform((20, 40)))
    assert [task.label for task in error_tasks(runs, reference(), 1)][1] == "linear, uniform 40, semismooth-newton"
    with pytest.raises(StudyError, match="repeat is 0: give at least one"):
        error_tasks(runs, reference(), 0)


@pytest.mark.slow
def test_an_executor_finds_the_same_errors_without_times() -> None:
    runs = paper_runs(uniform((20, 40)), elements=(CONSTANT, LINEAR))
    timed = {row.key: row for row in compute(error_tasks(runs, reference(), 1))}
    with ThreadPoolExecutor(2) as executor:
        rows = list(compute(error_tasks(runs, reference()), executor))
    assert {row.key for row in rows} == set(timed)
    for row in rows:
        assert math.isnan(row.seconds)
        assert math.isnan(row.peak_memory)
        assert [getattr(row, name) for name in MEASURES] == [getattr(timed[row.key], name) for name in MEASURES]


class Doomed(Executor):
    """Fails like a pool whose process was killed."""

    def submit(self, fn: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Future[Any]:
        future: Future[Any] = Future()
        future.set_exception(BrokenProcessPool("a process was terminated abruptly"))
        return future


class Picky(Executor):
    """Fails with an error of its own."""

    def submit(self, fn: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Future[Any]:
        future: Future[Any] = Future()
        future.set_exception(TypeError("wrong operand"))
        return future


def test_an_executor_that_fails_is_named() -> None:
    runs = paper_runs(uniform((20,)))
    with pytest.raises(StudyError, match=r"the executor failed .a process was terminated abruptly.: finished rows"):
        list(compute(error_tasks(runs, reference()), Doomed()))
    with pytest.raises(TypeError, match="wrong operand"):
        list(compute(error_tasks(runs, reference()), Picky()))


def test_a_scene_with_functions_cannot_be_sent() -> None:
    parts = (*bk.load_scene("paper-1").parts[:3], bk.Part("load", bk.Traction(x=lambda x, y: y), sides=("left",)))
    runs = paper_runs(uniform((20,)), parts=parts)
    with ProcessPoolExecutor(1, mp_context=get_context("spawn")) as executor:
        with pytest.raises(StudyError, match=r"cannot be sent to another process .*: write its functions as formulas"):
            list(compute(error_tasks(runs, reference()), executor))


@lru_cache
def rows_of_the_angle(most: int) -> tuple[ErrorRecord, ...]:
    scene = bk.load_scene("clamped-angle")
    sizes = tuple(n for n in (20, 40, 80, 160, 320) if n <= most)
    runs = all_runs(scene, [LINEAR, QUADRATIC], [uniform(sizes), graded(sizes)], [NEWTON])
    with ThreadPoolExecutor(1) as executor:
        rows = {row.key: row for row in compute(error_tasks(runs, over_resolved(scene, 400)), executor)}
    return tuple(rows[run.key] for run in runs)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("element", "meshes", "low", "high"),
    [
        ("linear", "uniform", 1.4, 2.2),  # limited by the inner corner: 1.1 in the end, not yet reached
        ("linear", "graded", 2.7, 3.5),  # that of smooth solutions: 3
        ("quadratic", "uniform", 1.0, 1.8),  # limited by the inner corner
        ("quadratic", "graded", 2.7, 6.0),  # better than linear ones until the end of contact limits it
    ],
)
def test_the_table_shows_the_orders_of_elements_and_corners(element: str, meshes: str, low: float, high: float) -> None:
    (series,) = (s for s in by_series(rows_of_the_angle(160)) if s[0].series[:2] == (element, meshes))
    assert low <= fitted_order(series, "energy") <= high


@pytest.mark.slow
def test_the_order_of_graded_meshes_holds_on_finer_ones() -> None:
    series = {s[0].series[:2]: s for s in by_series(rows_of_the_angle(320))}
    assert 2.7 <= fitted_order(series["linear", "graded"], "energy") <= 3.5
    assert fitted_order(series["linear", "uniform"], "energy") <= 2.2
