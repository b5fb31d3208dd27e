"""Pictures of load histories show the numbers of the history."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import bemkit as bk
from bemkit.results.load_history import LoadHistory

pytest.importorskip("matplotlib")

from matplotlib.figure import Figure

from bemkit.pictures import draw_friction_loop, draw_status_over_time, draw_work, figures
from bemkit.pictures.catalogue import default_pictures

LOOP = replace(bk.load_scene("friction-loop"), mesh=bk.MeshOptions(elements=24))
UNITS = bk.UnitNames(length="mm", stress="MPa")


@pytest.fixture(scope="module")
def solution() -> bk.Solution:
    return bk.run(replace(LOOP, steps=(LOOP.steps[0], replace(LOOP.steps[1], increments=6))))


@pytest.fixture
def loading(solution: bk.Solution) -> LoadHistory:
    assert solution.loading is not None
    return solution.loading


def test_the_loop_begins_at_rest_and_passes_through_all_steps(solution: bk.Solution, loading: LoadHistory) -> None:
    axes = Figure().add_subplot()
    assert draw_friction_loop(replace(solution, scene=replace(solution.scene, units=UNITS)), axes) is axes
    line = axes.lines[0]
    expected = [0.0, *(step.force_tangential for step in loading.steps)]
    np.testing.assert_array_equal(line.get_ydata(), expected)
    assert axes.get_xlabel() == "mean tangential displacement along $x$ [mm]"
    assert axes.get_ylabel().startswith("friction force on the body [")


def test_a_history_without_friction_has_no_loop_unless_it_is_asked_for_and_no_round_off_in_it() -> None:
    law = bk.Frictionless()
    still = replace(LOOP, law=law, steps=(LOOP.steps[0],))
    result = bk.run(still)
    assert result.loading is not None
    names = [picture.name for picture in default_pictures(result)]
    assert "friction-loop" not in names
    assert "work" in names
    once = bk.run(replace(LOOP, steps=(replace(LOOP.steps[0], increments=1),)))
    assert not {"friction-loop", "work", "status-over-time"} & {each.name for each in default_pictures(once)}
    axes = draw_friction_loop(result, Figure().add_subplot())
    assert np.ptp(axes.get_xlim()) > 1e-3 * np.abs(result.contact.u_t).max()
    assert np.ptp(axes.get_ylim()) > 1e-3 * result.force_normal


def test_work_is_drawn_as_it_adds_up(solution: bk.Solution, loading: LoadHistory) -> None:
    axes = draw_work(solution, Figure().add_subplot())
    external, taken, energy = (np.asarray(line.get_ydata()) for line in axes.lines)
    total = loading.total()
    assert external[-1] == pytest.approx(total.external_work, rel=1e-14)
    assert taken[-1] == pytest.approx(total.dissipation, rel=1e-14)
    assert energy[-1] == loading.steps[-1].elastic_energy
    assert np.all(np.diff(taken) >= 0.0)


def test_what_coarse_increments_leave_is_drawn_so_that_the_curves_add_up() -> None:
    half_plane = bk.load_scene("cylinder-on-half-plane")  # whose gaps close within its only increment
    axes = draw_work(bk.run(replace(half_plane, mesh=bk.MeshOptions(elements=60), steps=(bk.Step(1.0),))))
    ends = {line.get_label(): line.get_ydata()[-1] for line in axes.lines}
    assert ends["increment error"] > 0.02 * ends["external work"]
    others = sum(value for name, value in ends.items() if name != "external work")
    assert others == pytest.approx(ends["external work"], rel=1e-9)


def test_status_is_drawn_for_every_node_and_step(solution: bk.Solution, loading: LoadHistory) -> None:
    axes = draw_status_over_time(solution, "floor", Figure().add_subplot())
    (cells,) = axes.collections
    numbers = np.asarray(cells.get_array()).reshape(len(loading.steps), -1)
    words = ["separated", "slip", "stick"]
    for k, step in enumerate(loading.steps):
        assert [words[int(value)] for value in numbers[k]] == step.contact.status_words()


def test_dollar_signs_in_the_name_of_a_part_begin_no_formula() -> None:
    name = "floor of $\\foo$"
    parts = tuple(replace(part, name=name) if part.name == "floor" else part for part in LOOP.parts)
    figure = Figure()
    draw_status_over_time(bk.run(replace(LOOP, parts=parts)), name, figure.add_subplot())
    figure.draw_without_rendering()


def test_all_pictures_have_names(solution: bk.Solution) -> None:
    assert list(figures(solution))[-3:] == ["friction-loop", "work", "status-over-time"]


def test_results_without_a_history_have_no_pictures_of_it() -> None:
    still = bk.run(replace(LOOP, steps=()))
    for draw in (draw_friction_loop, draw_work, lambda each: draw_status_over_time(each, "floor")):
        with pytest.raises(bk.InputError, match="has no load history: give load factors or steps to the scene"):
            draw(still)
