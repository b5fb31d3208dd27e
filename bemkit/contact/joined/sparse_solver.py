"""Factors of a sparse matrix: by PARDISO if the extra ``pardiso`` is installed and works, else by SuperLU."""

from __future__ import annotations

import importlib.util
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from copy import copy
from functools import cache
from typing import Any

import numpy as np
from scipy import sparse
from scipy.sparse.linalg import splu

from bemkit.arrays import FloatArray
from bemkit.errors import printable
from bemkit.operators.linear.dense import SingularMatrixError

_MISSING = "SuperLU (pip install 'bemkit[pardiso]' brings PARDISO, which is faster)"
_OPTIONS = {1: 1, 2: 2, 8: 0, 10: 13, 11: 0, 13: 0}
"""Nested dissection, tiny pivots enlarged by 1e-13, neither scaling nor matching: these would spoil the order, and the
rows are scaled before. Refinement is left to the caller, who knows the matrix without its penalty."""

Solve = Callable[[FloatArray], FloatArray]


def sparse_solver_name() -> str:
    """Say in a few words which solver factors sparse contact systems, and what would be faster."""
    return _pardiso()


def uses_pardiso() -> bool:
    """Whether PARDISO is installed and works."""
    return _pardiso() == "PARDISO"


@contextmanager
def factored(matrix: sparse.csr_array) -> Iterator[Solve]:
    """Factor a matrix along its diagonal, and lend the function that solves with it.

    Parameters
    ----------
    matrix : (n, n) sparse array
        With a diagonal that may serve as pivots, and rows of size about one.

    Raises
    ------
    SingularMatrixError
        If a pivot vanishes.
    """
    if uses_pardiso():
        with _factored_by_pardiso(matrix) as solve:
            yield solve
        return
    try:
        factors = splu(
            sparse.csc_array(matrix),
            permc_spec="MMD_AT_PLUS_A",
            diag_pivot_thresh=0.0,
            options={"SymmetricMode": True},
        )
    except RuntimeError as error:
        raise SingularMatrixError(str(error)) from error
    yield factors.solve


@contextmanager
def _factored_by_pardiso(matrix: sparse.csr_array) -> Iterator[Solve]:
    import pypardiso

    solver, plain = copy(_solver_without_matrix()), sparse.csr_matrix(matrix)
    solver.pt, solver.iparm = np.zeros_like(solver.pt), np.zeros_like(solver.iparm)
    for number, value in _OPTIONS.items():
        solver.set_iparm(number, value)
    try:
        solver.factorize(plain)
        yield lambda right_side: np.asarray(solver.solve(plain, right_side))
    except pypardiso.pardiso_wrapper.PyPardisoError as error:
        raise SingularMatrixError(str(error)) from error
    finally:
        solver.free_memory(everything=True)


@cache
def _solver_without_matrix() -> Any:
    """Return a solver that has searched the installation for the library, which takes as long as a factorisation."""
    import pypardiso

    return pypardiso.PyPardisoSolver()


@cache
def _pardiso() -> str:
    if importlib.util.find_spec("pypardiso") is None:
        return _MISSING
    try:
        with _factored_by_pardiso(sparse.csr_array(np.array([[2.0, 1.0], [0.0, 4.0]]))) as solve:
            if not np.allclose(solve(np.array([4.0, 8.0])), [1.0, 2.0]):
                return "SuperLU (PARDISO computes wrong numbers here)"
    except Exception as error:  # whatever a broken installation raises
        return f"SuperLU (PARDISO does not work here: {printable(f'{type(error).__name__}: {error}')[:120]})"
    return "PARDISO"
