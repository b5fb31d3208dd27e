"""Threads of assembly: as many as the work is worth, and none of them changes a number."""

from __future__ import annotations

import numpy as np
import pytest

import bemkit as bk
from bemkit import threads
from bemkit.geometry.spaces import LagrangeSpace
from bemkit.operators.boundary import hypersingular


@pytest.fixture
def three_processors(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(threads.os, "sched_getaffinity", lambda _: {0, 1, 2}, raising=False)


@pytest.mark.usefixtures("three_processors")
def test_large_work_takes_all_processors() -> None:
    assert threads.n_threads(threads.MANY_INTEGRALS - 1) == 1
    assert threads.n_threads(threads.MANY_INTEGRALS) == 3


@pytest.mark.usefixtures("three_processors")
def test_matrices_do_not_depend_on_the_number_of_threads(monkeypatch: pytest.MonkeyPatch) -> None:
    # two chunks share the rows of one node, whose two contributions add up to the same in either order
    mesh = bk.discretise(bk.Rectangle(1.0, 1.0).outline(), n_elements=40)
    space = LagrangeSpace(mesh, degree=6)
    matrices = []
    for many in (10**9, 0):
        monkeypatch.setattr(threads, "MANY_INTEGRALS", many)
        matrices.append(hypersingular(space, space, bk.Material(1.0, 0.3)).matrix())
    assert np.array_equal(*matrices)
