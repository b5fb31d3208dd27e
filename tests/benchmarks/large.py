"""Example 1 on compressed equations of collocation, from a thousand elements on, beside dense ones where these fit.

    python tests/benchmarks/large.py [--dense N] [--without-numba] [N ...]

For each number of elements N (default 1000 2000 5000 10000 20000) it prints the processor seconds of compressing the
equations, of the first factorisation, of a later contact step and of its certificate; the memory of all arrays that
stay; the largest rank; and the certificate and transitions of the solution, found from coarser meshes as `bk.run` finds
it. Growth exponents follow, from the smallest to the largest N and between the last two. Dense equations are solved
beside up to `--dense` elements (default 2000). Processor seconds of all threads depend less on what else the computer
does than wall-clock seconds.
"""

from __future__ import annotations

import argparse
import math
import time
from dataclasses import dataclass, replace

import numpy as np
from rich.console import Console
from rich.table import Table

import bemkit as bk
from bemkit.contact.condensation.hierarchical_body import HierarchicalBody
from bemkit.contact.conditions import LinearConditions, separated, stick
from bemkit.model.contact_model import Model, build_model
from bemkit.model.prepared import prepare
from bemkit.operators.hierarchy import compiled
from bemkit.operators.linear.threads import blas_threads_for
from bemkit.runs.history import run_on_mesh

REFERENCE = (0.2575701, 0.4676382)
"""Where separation and slip end, from the source paper's example on other codes."""


@dataclass(frozen=True)
class Row:
    """What one number of elements takes: seconds of processors, bytes, and what is found."""

    n_elements: int
    build: float
    factor: float
    step: float
    certificate: float
    n_bytes: int
    rank: int
    whole: float
    n_steps: int
    worst: float
    miss: float
    dense: float = math.nan
    apart: float = math.nan


def scene_of(n_elements: int, linear_solver: object) -> bk.Scene:
    """Return Example 1."""
    scene = bk.load_scene("paper-1")
    return replace(scene, mesh=replace(scene.mesh, elements=n_elements), linear_solver=linear_solver)


def row_of(n_elements: int, *, with_dense: bool) -> Row:
    """Measure one number of elements."""
    scene = scene_of(n_elements, bk.Hierarchical())
    prepared = prepare(scene, scene.build_mesh())
    with blas_threads_for(1):
        clock = time.process_time()
        model = build_model(prepared)
        build = time.process_time() - clock
        body, problem = model.body, model.problem
        assert isinstance(body, HierarchicalBody)
        clock = time.process_time()
        state = problem.sticking_state
        factor = time.process_time() - clock
        step = _later_step(model)
        body.respond(_held(model))
        clock = time.process_time()
        body.imbalance(state)
        certificate = time.process_time() - clock
        system = body.loaded.system
        n_bytes, rank = system.compression.n_bytes + system.factor.n_bytes, system.compression.largest_rank
    del model, body, problem, system, state
    clock = time.process_time()
    solution = bk.run(scene)
    whole = time.process_time() - clock
    places = [each.x for each in solution.transitions]
    miss = max(abs(place - known) for place, known in zip(places, REFERENCE, strict=True))
    row = Row(
        n_elements, build, factor, step, certificate, n_bytes, rank, whole,
        solution.outer_steps, solution.certificate.worst, miss,
    )  # fmt: skip
    if not with_dense:
        return row
    clock = time.process_time()
    dense = run_on_mesh(scene_of(n_elements, bk.DenseCholesky()))
    seconds = time.process_time() - clock
    assert np.array_equal(dense.contact.status, solution.contact.status), "the statuses differ"
    apart = np.abs(dense.contact.sigma_n - solution.contact.sigma_n).max() / np.abs(dense.contact.sigma_n).max()
    return replace(row, dense=seconds, apart=float(apart))


def _held(model: Model) -> LinearConditions:
    return stick(model.problem.gap, model.problem.slip_origin)


def _later_step(model: Model) -> float:
    """Return the seconds of a response when a node at each of two places has changed, as at two transitions."""
    problem = model.problem
    held, changed = _held(model), np.zeros((problem.n_contact, 2), bool)
    changed[[problem.n_contact // 4, problem.n_contact // 2]] = True
    problem.body.respond(held)
    clock = time.process_time()
    problem.body.respond(held.replaced(changed, separated(problem.n_contact)))
    return time.process_time() - clock


def table_of(rows: list[Row]) -> Table:
    """Return what was measured."""
    table = Table(title=f"Example 1, kernels in {'numpy' if compiled.functions() is None else 'numba'}; CPU seconds")
    for column in (
        *("N", "build", "factor", "step", "certificate of it", "GB", "rank", "run", "steps", "worst", "transitions"),
        *("dense run", "tractions apart"),
    ):
        table.add_column(column, justify="right")
    for row in rows:
        table.add_row(
            str(row.n_elements),
            *(f"{value:.2f}" for value in (row.build, row.factor, row.step, row.certificate)),
            f"{row.n_bytes / 1e9:.3f}",
            str(row.rank),
            f"{row.whole:.1f}",
            str(row.n_steps),
            *(f"{value:.0e}" for value in (row.worst, row.miss)),
            *("" if math.isnan(row.dense) else text for text in (f"{row.dense:.1f}", f"{row.apart:.0e}")),
        )
    return table


def exponent(one: Row, two: Row, name: str) -> float:
    """Return how fast a quantity grows with the number of elements."""
    return math.log(getattr(two, name) / getattr(one, name)) / math.log(two.n_elements / one.n_elements)


def main() -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("numbers", nargs="*", type=int, default=[1000, 2000, 5000, 10000, 20000])
    parser.add_argument("--dense", type=int, default=2000)
    parser.add_argument("--without-numba", action="store_true")
    options = parser.parse_args()
    if options.without_numba:
        compiled.functions = lambda: None  # type: ignore[assignment]
    compiled.functions()  # compiles now, not within a measurement
    console, rows = Console(width=160), []
    for number in options.numbers:
        rows.append(row_of(number, with_dense=number <= options.dense))
        console.print(table_of(rows[-1:]))
    console.print(table_of(rows))
    growth = Table(title="growth exponents")
    for column in ("from", "to", "build", "factor", "step", "memory"):
        growth.add_column(column, justify="right")
    for one, two in [(rows[0], rows[-1]), *zip(rows[-2:-1], rows[-1:], strict=True)] if len(rows) > 1 else []:
        values = (exponent(one, two, name) for name in ("build", "factor", "step", "n_bytes"))
        growth.add_row(str(one.n_elements), str(two.n_elements), *(f"{value:.2f}" for value in values))
    console.print(growth)


if __name__ == "__main__":
    main()
