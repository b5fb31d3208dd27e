"""All linear solvers conform, and broken ones are caught."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest

from bemkit.arrays import FloatArray
from bemkit.operators.counts import Factorisation
from bemkit.operators.linear_solvers import (
    Automatic,
    DenseCholesky,
    Hierarchical,
    MatrixFree,
)
from bemkit.scene.registry import LINEAR_SOLVERS
from bemkit.testing import CheckFailed, check_linear_solver

SOLVERS = [DenseCholesky()]


@pytest.mark.parametrize("solver", SOLVERS, ids=str)
def test_linear_solvers_conform(solver: DenseCholesky) -> None:
    check_linear_solver(solver)


def test_every_linear_solver_of_scene_files_is_checked() -> None:
    named = {LINEAR_SOLVERS.find(word) for word in LINEAR_SOLVERS.built_in}
    assert named == {type(solver) for solver in SOLVERS} | {
        Automatic,
        Hierarchical,
        MatrixFree,
    }  # which collocation takes: see tests/contact


@dataclass(frozen=True)
class _Twisted:
    """A Cholesky solver whose solutions are changed."""

    kind: str

    def factor(self, matrix: FloatArray, name: str) -> Any:
        if self.kind == "blind":
            matrix = matrix - 2.0 * np.diag(np.minimum(np.diag(matrix), 0.0))
        if self.kind == "nameless":
            name = "something"
        if self.kind == "spoils matrix":
            matrix[0, 1] *= 0.5
        return _TwistedFactor(self.kind, DenseCholesky().factor(matrix, name))


@dataclass(frozen=True)
class _TwistedFactor:
    kind: str
    exact: Any
    factorisations: tuple[Factorisation, ...] = ()

    def solve(self, right: FloatArray) -> FloatArray:
        solution: FloatArray = self.exact.solve(right)
        match self.kind:
            case "wrong":
                return solution * (1.0 + 1e-5)
            case "wrong alone":
                return solution * (1.0 + 1e-5) if right.ndim == 1 else solution
            case "noisy":
                return solution + 1e-300
            case "flat":
                return solution.ravel() if right.shape[1:] == (3,) else solution
            case "tall":
                return solution.reshape(len(right), -1)
            case "empty":
                return solution if right.size else np.zeros(0)
            case "spoils forces":
                right[...] = 0.0
        return solution


@pytest.mark.parametrize(
    ("kind", "complaint"),
    [
        ("wrong", r"the solution errs by 1e-05 in the energy norm"),
        ("wrong alone", "the solution of one right-hand side errs by"),
        ("noisy", "zero forces cause displacements of 1e-300"),
        ("flat", r"the solution has the shape \(120,\), not \(40, 3\)"),
        ("tall", r"one right-hand side gives a solution of the shape \(40, 1\)"),
        ("empty", r"no right-hand side gives a solution of the shape \(0,\)"),
        ("spoils forces", "changes the right-hand sides"),
        ("spoils matrix", "changes the matrix"),
        ("blind", "solves with an indefinite matrix without a word"),
        ("nameless", "does not name the matrix"),
    ],
)
def test_broken_linear_solvers_are_caught(kind: str, complaint: str) -> None:
    check_linear_solver(_Twisted("right"))
    with pytest.raises(CheckFailed, match=complaint):
        check_linear_solver(_Twisted(kind))
