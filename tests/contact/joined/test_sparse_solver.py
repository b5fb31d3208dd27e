import sys
from types import SimpleNamespace

import numpy as np
import pytest
from scipy import sparse

from bemkit.contact.joined import sparse_form
from bemkit.contact.joined.sparse_form import factored, sparse_solver_name
from bemkit.operators.linear_solvers import SingularMatrixError

MATRIX = sparse.csr_array(np.array([[2.0, 1.0, 0.0], [0.0, 4.0, -1.0], [1.0, 0.0, -1e-8]]))
"""With a diagonal as small as the penalty of motions."""


@pytest.fixture
def asked_anew():
    """Let the search for PARDISO begin anew, and forget what a test has made it find."""
    for found in (sparse_form.sparse_solver_name, sparse_form._solver_without_matrix):
        found.cache_clear()
    yield
    for found in (sparse_form.sparse_solver_name, sparse_form._solver_without_matrix):
        found.cache_clear()


def test_factors_solve_for_several_right_sides():
    right_sides = np.array([[1.0, 0.0], [2.0, -3.0], [0.5, 4.0]])
    with factored(MATRIX) as solve:
        found = solve(right_sides)
    np.testing.assert_allclose(MATRIX @ found, right_sides, atol=1e-6)  # the small pivot may cost eight digits


def test_a_singular_matrix_is_refused(asked_anew, without):
    without("pypardiso")
    with pytest.raises(SingularMatrixError, match="singular"), factored(sparse.csr_array(np.ones((2, 2)))):
        pass


def test_without_pardiso_the_name_says_what_to_install(asked_anew, without):
    without("pypardiso")
    assert "SuperLU (pip install 'bemkit[pardiso]'" in sparse_solver_name()


def test_a_pardiso_that_does_not_work_is_left_alone(asked_anew, monkeypatch):
    class Broken:
        def __init__(self):
            raise ImportError("Shared library mkl_rt not found")

    fake = SimpleNamespace(PyPardisoSolver=Broken, __spec__="found")
    monkeypatch.setitem(sys.modules, "pypardiso", fake)
    assert "PARDISO does not work here: ImportError: Shared library mkl_rt not found" in sparse_solver_name()
    test_factors_solve_for_several_right_sides()


def test_pardiso_gives_what_superlu_gives(asked_anew, without):
    pytest.importorskip("pypardiso")
    random = np.random.default_rng(0)
    matrix = sparse.csr_array(sparse.random_array((300, 300), density=0.02, rng=random) + 2.0 * sparse.eye_array(300))
    right_sides = random.normal(size=(300, 2))
    assert sparse_solver_name() == "PARDISO"
    with factored(matrix) as solve:
        by_pardiso = solve(right_sides)
    sparse_form.sparse_solver_name.cache_clear()
    without("pypardiso")
    with factored(matrix) as solve:
        by_superlu = solve(right_sides)
    np.testing.assert_allclose(by_pardiso, by_superlu, rtol=1e-11)  # condition about 1e2
