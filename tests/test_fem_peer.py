"""The finite element peer solves the paper's examples, whichever library factors its matrix."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import sparse

from benchmarks import fem
from tests.scenes import paper, reference_values
from tests.slow import slow_except


@pytest.fixture(params=["PARDISO", "SuperLU"])
def library(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> str:
    if request.param == "PARDISO" and not fem.HAS_PARDISO:
        pytest.skip("pypardiso is not installed")
    monkeypatch.setattr(fem, "HAS_PARDISO", request.param == "PARDISO")
    return str(request.param)


def test_the_schur_complement_is_that_of_dense_matrices(library: str) -> None:
    random = np.random.default_rng(3)
    matrix = random.standard_normal((30, 30)) * (random.random((30, 30)) < 0.3)
    matrix = matrix + matrix.T + 20.0 * np.eye(30)
    kept, rest = np.array([4, 11, 29]), np.setdiff1d(np.arange(30), [4, 11, 29])
    expected = matrix[np.ix_(kept, kept)] - matrix[np.ix_(kept, rest)] @ np.linalg.solve(
        matrix[np.ix_(rest, rest)], matrix[np.ix_(rest, kept)]
    )
    found = fem._schur(sparse.csr_matrix(np.triu(matrix)), kept)
    np.testing.assert_allclose(found, expected, rtol=0.0, atol=1e-12)  # entries about 20


@pytest.mark.parametrize("example", [1, 2])
def test_graded_elements_reach_the_reference(example: int, library: str) -> None:
    values, places = reference_values(example)
    jumps, width = ([0.5], 1.0) if example == 1 else ([], 0.5)
    x = fem.graded_line(sorted({0.0, *places, *jumps, width}), 16, 3, 2.5)
    y = fem.graded_line([0.0, *jumps, 1.0], 12, 3, 2.5)
    solution = fem.solve_scene(paper(example), x, y)
    # twice what this mesh was seen to leave
    assert solution.force_tangential == pytest.approx(values["Ft"], rel=8e-5)
    assert solution.energy == pytest.approx(values["energy"], rel=2e-5)
    assert [transition.x for transition in solution.transitions] == pytest.approx(places, abs=1e-3)


def test_layers_shrink_towards_breaks_and_short_pieces_spare_some() -> None:
    line = fem.layered_line([0.0, 1.0, 1.1], [2, 2, 0], degree=3, factor=0.2)
    np.testing.assert_allclose(line.ends, [0.0, 0.02, 0.1, 0.5, 0.9, 0.98, 1.0, 1.01, 1.05, 1.1])


@pytest.mark.parametrize("example", slow_except([1, 2], 2))
def test_layered_elements_reach_the_reference(example: int, library: str) -> None:
    values, places = reference_values(example)
    breaks = sorted({0.0, *places, *([0.5, 1.0] if example == 1 else [0.5])})
    x = fem.layered_line(breaks, [1, 3, 3, *([1] if example == 1 else []), 0], 5, 0.25)
    y = fem.layered_line([0.0, 0.5, 1.0], [3, 1, 1], 5, 0.25)
    solution = fem.solve_scene(paper(example), x, y)
    # twice what this mesh was seen to leave
    assert solution.force_tangential == pytest.approx(values["Ft"], rel=2e-6)
    assert solution.energy == pytest.approx(values["energy"], rel=1e-5)
    assert [transition.x for transition in solution.transitions] == pytest.approx(places, abs=2e-5)
