"""Pictures of load histories show the numbers of the history."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import bemkit as bk
from bemkit.results.load_history import LoadHistory

pytest.importorskip("matplotlib")

from bemkit.results.history_figures import draw_friction_loop, draw_status_over_time, draw_work, history_figures
from matplotlib.figure import Figure

LOOP = replace(bk.load_scene("friction-loop"), mesh=bk.MeshOptions(elements=24))
UNITS = bk.UnitNames(length="mm", stress="MPa")


@pytest.fixture(scope="module")
def solution() -> bk.Solution:
    return bk.run(replace(LOOP, steps=(LOOP.steps[0], replace(LOOP.steps[1], increments=6))))


@pytest.fixture
def loading(solution: bk.Solution) -> LoadHistory:
    assert solution.loading is not None
    return solution.loading


def test_the_loop_begins_at_rest_and_passes_through_all_steps(loading: LoadHistory) -> None:
    axes = Figure().add_subplot()
    assert draw_friction_loop(axes, loading, units=UNITS) is axes
    line = axes.lines[0]
    expected = [0.0, *(step.force_tangential for step in loading.steps)]
    np.testing.assert_array_equal(line.get_ydata(), expected)
    assert axes.get_xlabel() == "mean tangential displacement [mm]"
    assert axes.get_ylabel().startswith("friction force on the body [")


def test_work_is_drawn_as_it_adds_up(loading: LoadHistory) -> None:
    axes = draw_work(Figure().add_subplot(), loading)
    external, taken, energy = (np.asarray(line.get_ydata()) for line in axes.lines)
    total = loading.total()
    assert external[-1] == pytest.approx(total.external_work, rel=1e-14)
    assert taken[-1] == pytest.approx(total.dissipation, rel=1e-14)
    assert energy[-1] == loading.steps[-1].elastic_energy
    assert np.all(np.diff(taken) >= 0.0)


def test_status_is_drawn_for_every_node_and_step(loading: LoadHistory) -> None:
    axes = draw_status_over_time(Figure().add_subplot(), loading, "floor")
    (cells,) = axes.collections
    numbers = np.asarray(cells.get_array()).reshape(loading.steps[0].contact.n_contact, -1)
    words = ["separated", "slip", "stick"]
    for k, step in enumerate(loading.steps):
        assert [words[int(value)] for value in numbers[:, k]] == step.contact.status_words()


def test_all_pictures_have_names(solution: bk.Solution) -> None:
    assert list(history_figures(solution)) == ["friction-loop", "work", "status-over-time"]
    assert history_figures(bk.run(replace(LOOP, steps=()))) == {}
