"""The iterative linear solver against the direct one: steps, time and memory, side by side in one run.

    python tests/benchmarks/krylov.py [N ...]

The body is an L with `n_retained` directions retained for contact in the middle of its lower side. For each number of
elements N (default 500 1000 2000) and some n_retained it prints the medians of three runs of everything after assembly,
as ratios to the direct solver, and the peaks of all arrays as ratios. Before that, steps to rtol 1e-9 over N and
shapes.
"""

from __future__ import annotations

import statistics
import sys
import time
import tracemalloc

import numpy as np
from rich.console import Console
from rich.table import Table

import bemkit as bk
from bemkit.operators.linear.choice import direct_cost, krylov_cost
from bemkit.operators.linear.solvers import LinearSolver
from bemkit.operators.linear.threads import blas_threads_for
from bemkit.operators.steklov_poincare import CondensedMap
from bemkit.operators.stopwatch import assembly_time
from tests.handmade import condense, contact_along_normals

L_SHAPE = bk.Polygon(((0.0, 0.0), (2.0, 0.0), (2.0, 1.0), (1.0, 1.0), (1.0, 2.0), (0.0, 2.0)))
BODIES = {
    "circle": (bk.Disk(1.0), 1.0),
    "square": (bk.Rectangle(1.0, 1.0), 1.0),
    "L": (L_SHAPE, 1.0),
    "strip 10:1": (bk.Rectangle(10.0, 1.0), 1.0),
    "strip 100:1": (bk.Rectangle(100.0, 1.0), 1.0),
    "square, graded t^2": (bk.Rectangle(1.0, 1.0), 2.0),
    "L, graded t^4": (L_SHAPE, 4.0),
}
FACTORED = bk.Krylov(coarsest=10**9)
MULTIGRID = bk.Krylov(coarsest=40)
SIZES = (100, 200, 400, 800)


def mesh_of(name: str, n_elements: int) -> bk.BoundaryMesh:
    """Divide one of the bodies."""
    shape, exponent = BODIES[name]
    grading = bk.Algebraic(exponent) if exponent > 1.0 else bk.Uniform()
    return bk.discretise(shape.outline(), n_elements=n_elements, grading=grading)


def condensed(mesh: bk.BoundaryMesh, solver: LinearSolver, n_retained: int) -> tuple[CondensedMap, float]:
    """Condense a body onto n_retained / 2 nodes; return what is left and the time after assembly [s]."""
    elastic = bk.GalerkinMap(mesh, bk.Material(1.0, 0.3), linear_solver=solver)
    lowest = np.array([mesh.nodes[:, 0].mean(), mesh.nodes[:, 1].min()])
    contact = np.sort(np.argsort(np.abs(mesh.centres - lowest).sum(axis=1))[: n_retained // 2 - 1])
    force = np.zeros((mesh.n_nodes, 2))
    force[mesh.n_nodes // 2] = (0.3, -1.0)
    begin = time.perf_counter()
    with blas_threads_for(2 * mesh.n_nodes), assembly_time() as assembly:
        body = condense(elastic, [], contact_along_normals(elastic.displacement_space, contact), force)
    return body.condensed, time.perf_counter() - begin - assembly.seconds


def peak_of(mesh: bk.BoundaryMesh, solver: LinearSolver, n_retained: int) -> int:
    """Largest memory of all arrays during assembly and condensation [bytes]."""
    tracemalloc.start()
    condensed(mesh, solver, n_retained)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    return peak


def steps_table() -> Table:
    """Steps with ten retained directions."""
    table = Table(title="steps to 1e-9: preconditioner factored / multigrid")
    for column in ("body", *(f"N = {n}" for n in SIZES)):
        table.add_column(column, justify="right")
    for name in BODIES:
        cells = []
        for n in SIZES:
            mesh = mesh_of(name, n)
            cells.append(
                " / ".join(str(condensed(mesh, one, 10)[0].iterations[0].n_steps) for one in (FACTORED, MULTIGRID))
            )
        table.add_row(name, *cells)
    return table


def times_row(n_elements: int, n_retained: int, repetitions: int = 3) -> list[str]:
    """Ratios of time and memory to the direct solver."""
    mesh = mesh_of("L", n_elements)
    solvers = (bk.DenseCholesky(), FACTORED, MULTIGRID)
    times: list[list[float]] = [[] for _ in solvers]
    for _ in range(repetitions):  # in turn, so that all see the same state of the computer
        for solver, taken in zip(solvers, times, strict=True):
            taken.append(condensed(mesh, solver, n_retained)[1])
    direct, factored, multigrid = (statistics.median(taken) for taken in times)
    peaks = [peak_of(mesh, solver, n_retained) for solver in solvers]
    order = 2 * mesh.n_nodes
    predicted = krylov_cost(order, n_retained).flops / direct_cost(order, n_retained).flops
    return [
        *(str(n_elements), str(n_retained), f"{direct:.2f}"),
        *(f"{value:.2f}" for value in (factored / direct, predicted, multigrid / direct)),
        *(f"{peak / peaks[0]:.2f}" for peak in peaks[1:]),
        f"{peaks[0] / (8 * order**2):.1f}",
    ]


def main() -> None:
    """Measure and print."""
    console = Console(width=140)
    console.print(steps_table())
    table = Table(title="L: time after assembly and memory, as ratios to the direct solver")
    columns = ("N", "n_retained", "direct [s]", "factored", "predicted", "multigrid", "memory", "with multigrid")
    for column in (*columns, "direct [n^2 numbers]"):
        table.add_column(column, justify="right")
    for n_elements in [int(word) for word in sys.argv[1:]] or [500, 1000, 2000]:
        for n_retained in (6, 10, 20, 40, 80):
            table.add_row(*times_row(n_elements, n_retained))
        console.print(f"N = {n_elements} done", style="dim")
    console.print(table)


if __name__ == "__main__":
    main()
