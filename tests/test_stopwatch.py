"""The stopwatch of assembly: nested pieces count once, and only while somebody measures."""

from __future__ import annotations

import time

import pytest

from bemkit.stopwatch import assembling, assembly_time

PAUSE = 0.02


@assembling()
def inner() -> None:
    time.sleep(PAUSE)


@assembling()
def outer() -> None:
    inner()
    inner()


def test_nested_assembly_counts_once() -> None:
    with assembly_time() as spent:
        begin = time.perf_counter()
        outer()
        elapsed = time.perf_counter() - begin
        time.sleep(PAUSE)
    assert 2 * PAUSE <= spent.seconds <= elapsed


@assembling()
def failing() -> None:
    time.sleep(PAUSE)
    raise ZeroDivisionError


def test_assembly_that_fails_counts_too() -> None:
    with assembly_time() as spent:
        with pytest.raises(ZeroDivisionError):
            failing()
    assert spent.seconds >= PAUSE
    measured = spent.seconds
    inner()
    assert spent.seconds == measured
