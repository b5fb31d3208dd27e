"""Tables 1 and 2 of the paper beside the printed numbers: ``python docs/paper_tables.py``.

They list outer steps of Algorithm 1 for 5 x 5 pairs of rho.

rho in the tables is a number; the penalty of the method is that number times Young's modulus per unit of length. The
examples are solved as in the paper: constant elements, N / 4 of them on each side of the body, zero multipliers at
the start, and the displacements on the contact boundary compared in the largest norm.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import product
from typing import NamedTuple

import numpy as np

from bemkit.arrays import IntArray, read_only
from bemkit.contact.body import ContactState
from bemkit.contact.certificate import Scales
from bemkit.contact.problem import ContactProblem
from bemkit.errors import NoResultError
from bemkit.geometry.meshing.discretise import Algebraic
from bemkit.model.model import Model, build_model
from bemkit.model.prepared import prepare
from bemkit.scene.discretisation import ConstantCollocation, MeshOptions
from bemkit.scene.toml import load_scene
from bemkit.solvers.alm import AugmentedLagrangian
from bemkit.solvers.base import solve
from bemkit.solvers.ssn import SemismoothNewton
from bemkit.studies.engine import Task, compute
from bemkit.threads import blas_threads_for

_OPTIONS = AugmentedLagrangian()
RHO = (1e2, 1e3, 1e4, 1e5, 1e6)
"""Values of rho_1 (rows) and rho_2 (columns)."""

PRINTED: tuple[tuple[tuple[int, ...], ...], ...] = (
    ((25, 25, 25, 25, 25), *((25, 13, 13, 13, 13),) * 4),
    ((39, 38, 38, 38, 38), (29, 12, 12, 12, 12), *((29, 10, 8, 8, 8),) * 3),
)
"""Tables 1 and 2 of the paper."""

_N_ELEMENTS = 320
_PAPER_TOLERANCE = 1e-8
"""``max|u_k+1 - u_k| <= 1e-8 max|u_k+1|`` on the contact boundary stops the outer iteration."""


class PaperTableError(NoResultError):
    """A pair of rho for which Algorithm 1 did not stop by the paper's criterion."""


class PaperCell(NamedTuple):
    """One pair of rho: the table and the numbers of row and column, outer steps and linear solves."""

    key: tuple[int, int, int]
    outer_steps: int
    linear_solves: int


@dataclass(frozen=True, eq=False)
class PaperTable:
    """One of the two tables, ours beside the print.

    Parameters
    ----------
    number : int
        1 or 2, also the number of the example.
    printed : (5, 5) int array
        Outer steps in the paper; rho_1 by row, rho_2 by column.
    outer_steps : (5, 5) int array
        Outer steps here.
    linear_solves : (5, 5) int array
        All linear systems of these outer steps.
    newton_solves : int
        Linear systems of `SemismoothNewton` on the same discrete problem, from its cold start.
    """

    number: int
    printed: IntArray
    outer_steps: IntArray
    linear_solves: IntArray
    newton_solves: int

    def __post_init__(self) -> None:
        for column in self.columns:
            read_only(column)

    @property
    def columns(self) -> tuple[IntArray, IntArray, IntArray]:
        """Printed outer steps, outer steps and linear solves."""
        return self.printed, self.outer_steps, self.linear_solves


def paper_tables(
    run: Callable[[Sequence[Task[PaperCell]]], Iterable[PaperCell]] = compute,
    options: AugmentedLagrangian = _OPTIONS,
) -> tuple[PaperTable, PaperTable]:
    """Compute both tables, about a second, with their 50 cells computed by `compute` or `compute_with_progress`.

    The penalties of the options are those of the cells.

    Raises
    ------
    PaperTableError
        If a run does not stop.
    """
    # for systems this small a second thread of BLAS only gets in the way
    with blas_threads_for(_N_ELEMENTS // 2):
        models = {number: paper_model(number) for number in (1, 2)}
        tasks = [
            Task(
                (number, i, j),
                f"Table {number}, rho_1 = {RHO[i]:.0e}, rho_2 = {RHO[j]:.0e}",
                partial(_cell, number, i, j, models[number], options),
            )
            for number, i, j in product((1, 2), range(len(RHO)), range(len(RHO)))
        ]
        cells = list(run(tasks))
        return _table(1, models[1], cells), _table(2, models[2], cells)


def paper_model(number: int) -> Model:
    """Return example 1 or 2 on the paper's uniform mesh of plain constant elements, made ready to solve."""
    scene = load_scene(f"paper-{number}")
    sides = [side for loop in scene.shape.outline().loops for side in loop]
    # as many elements on each side, of any length
    density = {
        side.name: 1.0 / float(np.hypot(*np.ptp(side.curve.point(np.array([0.0, 1.0])), axis=0))) for side in sides
    }
    equal = Algebraic(1.0)  # also next to sides with shorter elements
    mesh = MeshOptions(elements=_N_ELEMENTS, grading=equal, density=density)
    scene = replace(scene, mesh=mesh, discretisation=ConstantCollocation(slopes=False))
    return build_model(prepare(scene, scene.build_mesh()))


def text_of(table: PaperTable) -> str:
    """Return ours beside the print: ``12/13 (28)`` is 12 outer steps here, 13 in the paper, 28 linear solves here."""
    heads = ("rho", *(f"{rho:.0e}" for rho in RHO))
    rows = [
        [f"{rho:.0e}", *(f"{steps}/{printed} ({solves})" for printed, steps, solves in zip(*cells, strict=True))]
        for rho, *cells in zip(RHO, *table.columns, strict=True)
    ]
    widths = [max(map(len, column)) for column in zip(heads, *rows, strict=True)]
    lines = ["   ".join(map(str.rjust, row, widths)) for row in (heads, *rows)]
    lines.insert(1, "\N{BOX DRAWINGS LIGHT HORIZONTAL}" * len(lines[0]))
    heading = f"Table {table.number}: outer steps here/print (linear solves here); rho_1 down, rho_2 across"
    newton = f"semismooth Newton on the same problem: {table.newton_solves} linear solves for every rho"
    return "\n".join([heading, *lines, newton, ""])


def _cell(number: int, i: int, j: int, model: Model, options: AugmentedLagrangian) -> PaperCell:
    # from rho * E / (1 unit of length) to units of E'/L
    unit = model.prepared.only.material.youngs_modulus / model.units.modulus * model.units.length
    driver = replace(options, rho_n=RHO[i] * unit, rho_t=RHO[j] * unit)
    try:
        return PaperCell((number, i, j), *_outer_steps(model.problem, driver))
    except PaperTableError as error:
        raise PaperTableError(f"table {number}, rho_1 = {RHO[i]:g}, rho_2 = {RHO[j]:g}: {error}") from error


def _table(number: int, model: Model, cells: Sequence[PaperCell]) -> PaperTable:
    steps, solves = np.zeros((5, 5), dtype=np.intp), np.zeros((5, 5), dtype=np.intp)
    for cell in cells:
        if cell.key[0] == number:
            steps[cell.key[1:]], solves[cell.key[1:]] = cell.outer_steps, cell.linear_solves
    newton = solve(model.problem, SemismoothNewton())
    return PaperTable(number, np.array(PRINTED[number - 1]), steps, solves, newton.linear_solves)


def _outer_steps(problem: ContactProblem, driver: AugmentedLagrangian) -> tuple[int, int]:
    """Return outer steps and linear solves until the paper's criterion is met."""
    # The start has no tractions, and all its nodes overlap a little, so that they begin in contact: otherwise the first
    # active set would be empty and the floating body of Example 1 would not be held.
    length = Scales.of(problem, problem.sticking_state).length
    overlap = np.stack([np.maximum(problem.gap, 0.0) + length, problem.slip_origin], axis=1)
    iterate = driver.init(problem, ContactState(overlap, np.zeros_like(overlap)))
    for step in range(1, driver.max_steps + 1):
        previous = iterate.state.displacement
        iterate = driver.step(problem, iterate)
        if iterate.ended is not None:
            raise PaperTableError(f"{iterate.ended.name} in outer step {step}")
        displacement = iterate.state.displacement
        change = float(np.abs(displacement - previous).max())
        if step > 1 and change <= _PAPER_TOLERANCE * float(np.abs(displacement).max()):
            return step, iterate.linear_solves
    raise PaperTableError(f"not stopped after {driver.max_steps} outer steps")


if __name__ == "__main__":
    print("\n".join(map(text_of, paper_tables())))
