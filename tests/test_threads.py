"""The threads of BLAS: right for any number of runs at the same time, and as they were afterwards."""

from __future__ import annotations

import dataclasses
import threading
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
from threadpoolctl import threadpool_info, threadpool_limits

import bemkit as bk
from bemkit import threads
from bemkit.threads import blas_threads_for

SMALL, HUGE = 10, threads.LARGE + 1


def n_blas_threads() -> set[int]:
    return {library["num_threads"] for library in threadpool_info() if library["user_api"] == "blas"}


ALL = n_blas_threads()
pytestmark = pytest.mark.skipif(ALL == {1}, reason="with one thread of BLAS nothing here could fail")


def test_small_work_has_one_thread_and_large_work_all() -> None:
    with blas_threads_for(SMALL):
        assert n_blas_threads() == {1}
        with blas_threads_for(HUGE):  # inside, the outer choice stays
            assert n_blas_threads() == {1}
    with blas_threads_for(HUGE):
        assert n_blas_threads() == ALL
    assert n_blas_threads() == ALL


def test_where_there_is_one_thread_anyhow_no_other_one_holds_it() -> None:
    before = threading.active_count()
    with threadpool_limits(limits=1, user_api="blas"):
        with blas_threads_for(SMALL):
            assert threading.active_count() == before
    with blas_threads_for(SMALL):
        assert threading.active_count() == before + 1
    assert n_blas_threads() == ALL


def test_overlapping_small_work_restores_what_was_before() -> None:
    """The first comes first and leaves first: a limit that each restores for itself would stay at one for ever."""
    first_is_in, second_is_in, first_is_out = (threading.Event() for _ in range(3))

    def first() -> None:
        with blas_threads_for(SMALL):
            first_is_in.set()
            assert second_is_in.wait(10.0)
        first_is_out.set()

    def second() -> None:
        assert first_is_in.wait(10.0)
        with blas_threads_for(SMALL):
            second_is_in.set()
            assert first_is_out.wait(10.0)
            assert n_blas_threads() == {1}

    with ThreadPoolExecutor(2) as pool:
        for future in [pool.submit(first), pool.submit(second)]:
            future.result()
    assert n_blas_threads() == ALL


def test_large_and_small_work_take_turns() -> None:
    def work(order: int) -> set[int]:
        with blas_threads_for(order):
            before = n_blas_threads()
            threading.Event().wait(0.002)
            return before | n_blas_threads()

    orders = [SMALL, HUGE, SMALL, SMALL, HUGE, HUGE] * 10
    with ThreadPoolExecutor(6) as pool:
        counts = list(pool.map(work, orders))
    assert counts == [{1} if order == SMALL else ALL for order in orders]
    assert n_blas_threads() == ALL


def test_an_interrupt_while_waiting_leaves_the_queue() -> None:
    turns = threads._Turns()

    def interrupted(*arguments: object) -> None:
        raise KeyboardInterrupt

    turns._change.wait_for = interrupted  # type: ignore[method-assign, assignment]
    with pytest.raises(KeyboardInterrupt), turns.shared(False, lambda: threadpool_limits(1)):
        pass
    del turns._change.wait_for
    with turns.shared(True, lambda: threadpool_limits(1, "blas")):
        assert n_blas_threads() == {1}


def test_runs_in_threads_give_the_bits_of_runs_in_turn(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(threads, "LARGE", 200)  # half of the scenes count as large: they use both threads
    block = bk.load_scene("paper-1")
    scenes = [
        dataclasses.replace(block, law=bk.Coulomb(0.1 + 0.1 * k), mesh=bk.MeshOptions(elements=(80, 120)[k % 2]))
        for k in range(8)
    ]
    in_turn = [bk.run(scene) for scene in scenes]
    before = threadpool_info()
    with ThreadPoolExecutor(4) as pool:
        at_once = list(pool.map(bk.run, scenes))
    assert threadpool_info() == before
    for one, other in zip(in_turn, at_once, strict=True):
        assert np.array_equal(one.boundary.displacement, other.boundary.displacement)
        assert np.array_equal(one.boundary.traction, other.boundary.traction)
        assert np.array_equal(one.contact.sigma_t, other.contact.sigma_t)
        assert (one.energy, one.linear_solves) == (other.energy, other.linear_solves)
