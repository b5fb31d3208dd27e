"""Ctrl-C ends a run even where Python drops the exception."""

from __future__ import annotations

import signal
import weakref
from collections.abc import Iterator

import pytest

import bemkit as bk
from bemkit.interrupts import interruptible, uninterrupted
from tests.scenes import paper

SWALLOWED = pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")


@pytest.fixture(autouse=True)
def heeded() -> Iterator[None]:
    """A background job does not heed Ctrl-C."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


class Body:
    """Anything that a weak reference can hold."""


def swallow() -> None:
    """Press Ctrl-C in the callback of a weak reference."""
    body = Body()
    reference = weakref.ref(body, lambda _: signal.raise_signal(signal.SIGINT))
    del body
    assert reference() is None


@SWALLOWED
def test_a_swallowed_interrupt_ends_the_run_at_the_next_step() -> None:
    steps: list[int] = []

    def callback(record: bk.StepRecord) -> None:
        steps.append(record.step)
        if record.step == 1:
            swallow()

    with pytest.raises(KeyboardInterrupt):
        bk.run(paper(1, bk.Galerkin(1)), callback=callback)
    assert steps == [0, 1]
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler


@SWALLOWED
def test_one_that_is_swallowed_after_the_last_step_ends_it_too() -> None:
    with pytest.raises(KeyboardInterrupt), interruptible():
        swallow()


@SWALLOWED
def test_inside_another_statement_it_ends_the_inner_one() -> None:
    went_on: list[bool] = []

    def outer() -> None:
        with interruptible():
            swallow()
        went_on.append(True)

    with pytest.raises(KeyboardInterrupt), interruptible():
        outer()
    assert not went_on


def test_others_raise_at_once() -> None:
    with interruptible():
        with pytest.raises(KeyboardInterrupt):
            signal.raise_signal(signal.SIGINT)
        with pytest.raises(KeyboardInterrupt):
            signal.raise_signal(signal.SIGINT)
        signal.signal(signal.SIGINT, signal.default_int_handler)  # nothing is remembered


def test_handlers_of_the_program_around_stay() -> None:
    came: list[int] = []
    signal.signal(signal.SIGINT, lambda number, _: came.append(number))
    with interruptible():
        signal.raise_signal(signal.SIGINT)
    assert came == [signal.SIGINT]


def test_interrupts_wait_for_the_end_of_a_short_statement() -> None:
    went_on: list[bool] = []

    def interrupted() -> None:
        with uninterrupted():
            signal.raise_signal(signal.SIGINT)
            went_on.append(True)

    with pytest.raises(KeyboardInterrupt):
        interrupted()
    assert went_on
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler
