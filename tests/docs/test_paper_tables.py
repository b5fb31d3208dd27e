"""The paper's Tables 1 and 2 and the script that prints them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pytest

from bemkit.cli.progress import compute_with_progress
from bemkit.solvers.alm import AugmentedLagrangian, InnerNewton
from bemkit.studies.engine import Task
from docs.paper_tables import (
    PRINTED,
    PaperCell,
    PaperTable,
    PaperTableError,
    paper_model,
    paper_tables,
    text_of,
)


@pytest.fixture(scope="module")
def tables() -> tuple[PaperTable, PaperTable]:
    return paper_tables()


def test_the_mesh_is_the_papers() -> None:
    for number in (1, 2):
        model = paper_model(number)
        assert model.prepared.n_contact == 80
        mesh = model.prepared.bodies[0].mesh
        lengths = mesh.lengths[mesh.part("foundation")]
        np.testing.assert_allclose(lengths, lengths[0], rtol=1e-12)
        assert mesh.n_elements == 320


@pytest.mark.slow
def test_example_1_is_constant_where_the_print_is(tables: tuple[PaperTable, PaperTable]) -> None:
    table = tables[0]
    assert np.all(np.abs(table.outer_steps[1:, 1:] - 13) <= 3)
    assert np.ptp(table.outer_steps[1:, 1:]) == 0
    assert np.all(np.abs(table.outer_steps[0] - 25) <= 5)
    assert np.all(np.abs(table.outer_steps[:, 0] - 25) <= 5)
    assert np.ptp(table.outer_steps[0]) == 0
    assert np.ptp(table.outer_steps[1:, 0]) == 0


@pytest.mark.slow
def test_example_2_has_the_pattern_of_the_print(tables: tuple[PaperTable, PaperTable]) -> None:
    steps = tables[1].outer_steps
    # in the print 39, 38, 38 ...; then 29, 12, 12 ...; then 29, 10, 8 ... three times
    assert np.ptp(steps[0]) <= 1
    assert np.all(steps[2:] == steps[2])
    assert np.ptp(steps[1, 2:]) == np.ptp(steps[2, 2:]) == 0
    assert np.all(np.abs(steps[0] - 31) <= 3)
    assert np.all(np.abs(steps[1:, 0] - 29) <= 3)
    assert steps[2, 0] > steps[2, 1] > steps[2, 2]
    assert abs(steps[2, 1] - 10) <= 1
    assert abs(steps[2, 2] - 8) <= 1
    assert steps[1, 2] > steps[2, 2]  # rho_1 = 1e3 is not yet large


@pytest.mark.slow
def test_newton_beats_every_cell(tables: tuple[PaperTable, PaperTable]) -> None:
    for table in tables:
        assert table.newton_solves <= 10
        assert np.all(table.newton_solves < table.linear_solves)


def test_the_printed_numbers_are_those_of_the_paper() -> None:
    assert np.sum(PRINTED[0]) == 9 * 25 + 16 * 13
    assert np.sum(PRINTED[1]) == 39 + 4 * 38 + 4 * 29 + 4 * 12 + 3 * (10 + 3 * 8)


@pytest.mark.slow
def test_the_text_shows_each_cell(tables: tuple[PaperTable, PaperTable]) -> None:
    for table in tables:
        text = text_of(table)
        assert f"{table.outer_steps[1, 1]}/{table.printed[1, 1]} ({table.linear_solves[1, 1]})" in text
        assert max(map(len, text.splitlines())) <= 80


def test_a_run_that_does_not_stop_is_an_error() -> None:
    impatient = AugmentedLagrangian(inner=InnerNewton(max_steps=1))
    with pytest.raises(PaperTableError, match=r"table 1, rho_1 = 100, rho_2 = 100: INNER_FAILED in outer step 1"):
        paper_tables(options=impatient)
    with pytest.raises(PaperTableError, match="not stopped after 3 outer steps"):
        paper_tables(options=AugmentedLagrangian(max_steps=3))


@pytest.mark.slow
def test_every_pair_is_a_task_and_finds_its_place(tables: tuple[PaperTable, PaperTable]) -> None:
    seen: list[Task[PaperCell]] = []

    def run(tasks: Sequence[Task[PaperCell]]) -> list[PaperCell]:
        seen.extend(tasks)
        return [PaperCell((number, i, j), 100 * number + 10 * i + j, 7) for number, i, j in (t.key for t in tasks)]

    first, second = paper_tables(run)
    assert len({task.label for task in seen}) == len(seen) == 50
    assert (first.outer_steps[1, 3], second.outer_steps[4, 0], second.linear_solves[0, 0]) == (113, 240, 7)
    assert seen[9].label == "Table 1, rho_1 = 1e+03, rho_2 = 1e+06"
    (cell,) = compute_with_progress(seen[9:10], "paper tables", is_live=False)
    assert (cell.key, cell.outer_steps) == ((1, 1, 4), tables[0].outer_steps[1, 4])
