"""Example 1 on compressed equations, from a thousand elements on, beside dense ones where these fit.

    python benchmarks/large.py [--dense N] [--without-numba] [N ...]

Elements are those of constant collocation. For each number of elements N
(default 1000 2000 5000 10000 20000) it runs `bk.run`, which begins on coarser meshes, and
prints what the finest mesh takes of it in processor seconds: compressing the equations, the first factorisation, the
median of later contact steps that change at most `FEW` leaves, and the median of certificates; the memory of all arrays
that stay; the largest memory of the process; the largest rank; and the certificate and transitions of the solution.
Growth exponents follow, from the smallest to the largest N and between the last two. Dense equations are solved beside
up to `--dense` elements (default 2000). Processor seconds of all threads depend less on what else the computer does
than those of the wall clock, which are printed for the whole run.
"""

from __future__ import annotations

import argparse
import math
import resource
import time
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from rich.console import Console
from rich.table import Table

import bemkit as bk
from bemkit.contact.hierarchical_body import HierarchicalBody
from bemkit.operators.collocation import compiled
from bemkit.operators.hierarchy.factor import Factor
from bemkit.operators.hierarchy.skeletons import Compression
from bemkit.runs.steps import run_on_mesh

REFERENCE = (0.2575701, 0.4676382)
"""Where separation and slip end, from the source paper's example on other codes."""


FEW = 8
"""Leaves that a later contact step changes."""


@dataclass(frozen=True)
class Row:
    """What one number of elements takes: seconds of processors, bytes, and what is found."""

    n_elements: int
    build: float
    factor: float
    step: float
    certificate: float
    n_bytes: int
    peak: int
    rank: int
    whole: float
    wall: float
    n_steps: int
    worst: float
    miss: float
    dense: float = math.nan
    apart: float = math.nan


def n_bytes(value: object) -> int:
    """Return the memory of all arrays in nested tuples, lists and objects."""
    if isinstance(value, np.ndarray):
        return value.nbytes
    parts = value if isinstance(value, tuple | list) else getattr(value, "__dict__", {}).values()
    return sum(map(n_bytes, parts))


def largest_rank(compression: Compression) -> int:
    """Return the largest number of rows or columns of a skeleton."""
    skeletons = (skeleton for level in compression.skeletons for skeleton in level)
    return max(max(skeleton.rows.size, skeleton.columns.size) for skeleton in skeletons)


@dataclass
class Parts:
    """Processor seconds of the parts of a run on the mesh that was compressed last."""

    build: float = 0.0
    n_bytes: int = 0
    rank: int = 0
    updates: list[tuple[int, float]] = field(default_factory=list)
    certificates: list[float] = field(default_factory=list)

    def listen(self) -> None:
        """Measure whatever is compressed, factored and certified from now on."""
        compress, update, certify = Compression.of.__func__, Factor.update, HierarchicalBody.imbalance  # type: ignore[attr-defined]

        def timed(work: Callable[..., Any], *arguments: Any) -> tuple[Any, float]:
            begin = time.process_time()
            return work(*arguments), time.process_time() - begin

        def compressed(cls: type, *arguments: Any) -> Compression:
            result: Compression
            result, self.build = timed(compress, cls, *arguments)
            self.rank, self.updates, self.certificates = largest_rank(result), [], []
            return result

        def updated(factor: Factor, *arguments: Any) -> None:
            _, seconds = timed(update, factor, *arguments)
            self.updates.append((factor.n_factored, seconds))
            self.n_bytes = n_bytes((factor._levels, factor.compression.skeletons))

        def certified(body: HierarchicalBody, *arguments: Any) -> Any:
            result, seconds = timed(certify, body, *arguments)
            self.certificates.append(seconds)
            return result

        Compression.of = classmethod(compressed)  # type: ignore[assignment,method-assign]
        Factor.update = updated  # type: ignore[method-assign]
        HierarchicalBody.imbalance = certified  # type: ignore[method-assign]


def scene_of(n_elements: int, linear_solver: object) -> bk.Scene:
    """Return Example 1."""
    scene = bk.load_scene("paper-1")
    mesh = replace(scene.mesh, elements=n_elements)
    return replace(scene, mesh=mesh, linear_solver=linear_solver, discretisation=bk.ConstantCollocation())


def row_of(n_elements: int, parts: Parts) -> tuple[Row, bk.Solution]:
    """Measure one number of elements."""
    clock, begin = time.process_time(), time.perf_counter()
    solution = bk.run(scene_of(n_elements, bk.Hierarchical()))
    whole, wall = time.process_time() - clock, time.perf_counter() - begin
    places = [each.x for each in solution.transitions]
    miss = max(abs(place - known) for place, known in zip(places, REFERENCE, strict=True))
    steps = [seconds for leaves, seconds in parts.updates if 0 < leaves <= FEW]
    return Row(
        n_elements, parts.build, parts.updates[0][1], float(np.median(steps or [math.nan])),
        float(np.median(parts.certificates)), parts.n_bytes, 1024 * resource.getrusage(resource.RUSAGE_SELF).ru_maxrss,
        parts.rank, whole, wall, solution.outer_steps, solution.certificate.worst, miss,
    ), solution  # fmt: skip


def beside_dense(row: Row, solution: bk.Solution) -> Row:
    """Solve the same on dense equations."""
    clock = time.process_time()
    dense = run_on_mesh(scene_of(row.n_elements, bk.DenseCholesky()))
    seconds = time.process_time() - clock
    assert np.array_equal(dense.contact.status, solution.contact.status), "the statuses differ"
    apart = np.abs(dense.contact.sigma_n - solution.contact.sigma_n).max() / np.abs(dense.contact.sigma_n).max()
    return replace(row, dense=seconds, apart=float(apart))


def table_of(rows: list[Row]) -> Table:
    """Return what was measured."""
    table = Table(title=f"Example 1, kernels in {'numba' if compiled.is_installed() else 'numpy'}; CPU seconds")
    for column in (
        *(
            "N",
            "build",
            "factor",
            "step",
            "certificate",
            "GB",
            "peak GB",
            "rank",
            "run",
            "wall",
            "steps",
            "worst",
            "transitions",
        ),
        *("dense run", "tractions apart"),
    ):
        table.add_column(column, justify="right")
    for row in rows:
        table.add_row(
            str(row.n_elements),
            *(f"{value:.2f}" for value in (row.build, row.factor, row.step, row.certificate)),
            f"{row.n_bytes / 1e9:.3f}",
            f"{row.peak / 1e9:.2f}",
            str(row.rank),
            f"{row.whole:.1f}",
            f"{row.wall:.1f}",
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
        compiled.is_installed = lambda: False
    compiled.loaded()  # compiles now, not within a measurement
    console, rows, parts = Console(width=160), [], Parts()
    parts.listen()
    solutions = []
    for number in options.numbers:
        row, solution = row_of(number, parts)
        rows.append(row)
        solutions.append(solution if number <= options.dense else None)
        console.print(table_of(rows[-1:]))
    # dense runs come last: their memory would be the largest of the process ever since
    rows = [
        row if solution is None else beside_dense(row, solution) for row, solution in zip(rows, solutions, strict=True)
    ]
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
