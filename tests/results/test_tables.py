"""Results as text."""

from __future__ import annotations

import csv
import io
import json
import math
from dataclasses import replace

import numpy as np
import pytest

from bemkit.results.solution import Solution
from bemkit.results.tables import TABLES, element_displacement, to_csv, to_json
from bemkit.runs.run import run
from bemkit.scene.toml import load_scene, with_overrides
from tests.solutions import changed as changed_solution


@pytest.fixture(scope="module", params=["linear", "constant"])
def solution(request: pytest.FixtureRequest) -> Solution:
    return run(with_overrides(load_scene("paper-1"), elements=40, discretisation=request.param))


def rows(solution: Solution, table: str) -> list[dict[str, str]]:
    text = to_csv(solution, table)
    return list(csv.DictReader(io.StringIO(text)))


def test_the_contact_table_holds_every_digit(solution: Solution) -> None:
    table = rows(solution, "contact")
    assert len(table) == solution.contact.n_contact
    for name in ("x", "y", "s", "u_n", "u_t", "sigma_n", "sigma_t", "gap", "clearance"):
        assert [float(row[name]) for row in table] == getattr(solution.contact, name).tolist()
    assert [row["status"] for row in table] == solution.contact.status_words()


def test_the_boundary_table_has_a_row_per_element(solution: Solution) -> None:
    table = rows(solution, "boundary")
    assert [row["part"] for row in table].count("foundation") == len(solution.mesh.part("foundation"))
    assert [float(row["t_y"]) for row in table] == solution.boundary.traction[:, 1].tolist()
    assert float(table[0]["x"]) == solution.boundary.centres[0, 0]


def test_displacements_of_elements_are_those_of_a_linear_field(solution: Solution) -> None:
    points, centres = solution.boundary.points, solution.boundary.centres
    gradient = np.array([[0.5, -2.0], [3.0, 0.25]])
    linear = replace(solution.boundary, displacement=points @ gradient)
    changed = changed_solution(solution, boundary=linear)
    np.testing.assert_allclose(element_displacement(changed), centres @ gradient, atol=1e-14)


def test_the_history_ends_with_the_certificate(solution: Solution) -> None:
    table = rows(solution, "history")
    assert len(table) == len(solution.history)
    assert float(table[-1]["worst"]) == solution.certificate.worst
    assert int(table[-1]["linear_solves"]) == solution.linear_solves


def test_unknown_tables_are_refused(solution: Solution) -> None:
    with pytest.raises(ValueError, match="table is 'inside': give one of contact, boundary, history"):
        to_csv(solution, "inside")
    assert TABLES == ("contact", "boundary", "history", "steps", "forces", "pressures")


def test_json_has_null_for_what_is_not_finite(solution: Solution) -> None:
    endless = replace(solution.contacts[0], force_normal=math.inf)
    changed = changed_solution(solution, energy=math.nan, contacts=(endless,))
    result = json.loads(to_json(changed))
    assert result["energy"] is None
    assert result["force_normal"] is None
    assert result["force_tangential"] == solution.force_tangential
