"""Speed of assembly and solve as ratios against LAPACK, measured side by side in one run.

    python -m benchmarks.speed [N ...]

For each number of elements N (default 320 1000 2000) it prints medians of

* collocation: both matrices together, against one LU factorisation of one of them;
* Galerkin: V, K and W together, against the same LU;
* run: assembly + condensation + Newton of `paper-1` against the LAPACK factorisations of the same matrices.
"""

from __future__ import annotations

import ctypes
import dataclasses
import statistics
import subprocess
import sys
import time
from collections.abc import Callable

import numpy as np
from rich.console import Console
from rich.table import Table
from scipy.linalg.lapack import dgetrf, dpotrf

import bemkit as bk
from bemkit.geometry.spaces import ConstantSpace, LinearSpace
from bemkit.operators.boundary import assemble, double_layer, hypersingular, single_layer
from tests.operators.collocation_matrices import collocation_matrices


def keep_memory() -> None:
    """Let this process keep the memory that it frees, where the C library allows it.

    On virtual machines the first touch of fresh memory has been seen to cost ten times as much as filling it, and more
    than all arithmetic; it says nothing about either side of a ratio.
    """
    mallopt = getattr(ctypes.CDLL(None), "mallopt", None)
    if mallopt is not None:
        m_trim_threshold, m_mmap_max = -1, -4
        mallopt(m_trim_threshold, 2**31 - 1)
        mallopt(m_mmap_max, 0)


def median_time(work: Callable[[], object], repetitions: int) -> float:
    """Median wall time [s] after one run to warm up."""
    work()
    times = []
    for _ in range(repetitions):
        begin = time.perf_counter()
        work()
        times.append(time.perf_counter() - begin)
    return statistics.median(times)


def operators(n_elements: int, repetitions: int) -> tuple[float, float, float, float]:
    """Times of LU, Cholesky, the collocation matrices, and V, K, W of a square."""
    mesh = bk.discretise(bk.Rectangle(1.0, 1.0).outline(), n_elements=n_elements)
    material = bk.Material(1.0, 0.3)
    tractions, displacements = ConstantSpace(mesh), LinearSpace(mesh)

    def galerkin() -> np.ndarray:  # type: ignore[type-arg]
        v = single_layer(tractions, tractions, material)
        k = double_layer(displacements, tractions, material)
        w = hypersingular(displacements, displacements, material)
        assemble(v, k, w)
        return v.matrix()

    matrix = np.asfortranarray(galerkin())
    return (
        median_time(lambda: dgetrf(matrix), repetitions),
        median_time(lambda: dpotrf(matrix), repetitions),
        median_time(lambda: collocation_matrices(mesh, material), repetitions),
        median_time(galerkin, repetitions),
    )


def solve_time(n_elements: int, discretisation: object, repetitions: int) -> tuple[float, int]:
    """Time of assembly, condensation and Newton of paper-1, and its linear solves."""
    scene = bk.load_scene("paper-1")
    mesh_options = dataclasses.replace(scene.mesh, elements=n_elements)
    scene = dataclasses.replace(scene, discretisation=discretisation, mesh=mesh_options)
    solutions = [bk.run(scene) for _ in range(repetitions + 1)][1:]
    if not all(solution.is_converged for solution in solutions):
        raise SystemExit(f"paper-1 did not converge at N = {n_elements}")  # accuracy comes before every timing
    times = [sum(solution.timings[stage] for stage in ("assemble", "condense", "solve")) for solution in solutions]
    return statistics.median(times), solutions[0].linear_solves


def start_up() -> list[tuple[str, float]]:
    """Times of fresh interpreters."""
    commands = {
        "import numpy": [sys.executable, "-c", "import numpy"],
        "import bemkit": [sys.executable, "-c", "import bemkit"],
        "bemkit run paper-1": [sys.executable, "-m", "bemkit", "run", "paper-1", "--json", "-"],
    }
    return [
        (name, median_time(lambda c=command: subprocess.run(c, check=True, capture_output=True), 5))  # type: ignore[misc]
        for name, command in commands.items()
    ]


def main() -> None:
    """Measure and print."""
    keep_memory()
    sizes = [int(word) for word in sys.argv[1:]] or [320, 1000, 2000]
    console = Console()
    table = Table(title="Scene and solve against LAPACK (medians)")
    columns = ("N", "LU [ms]", "Chol. [ms]", "colloc. / LU", "Galerkin / LU", "colloc. run [ms]", "Galerkin run [ms]")
    for column in (*columns, "Galerkin run / (10 Chol. + 50 ms)"):
        table.add_column(column, justify="right")
    for n_elements in sizes:
        repetitions = 9 if n_elements <= 500 else 3
        lu, cholesky, collocation, galerkin = operators(n_elements, repetitions)
        constant, _ = solve_time(n_elements, bk.ConstantCollocation(), repetitions)
        linear, _ = solve_time(n_elements, bk.Galerkin(1), repetitions)
        table.add_row(
            str(n_elements),
            *(f"{1e3 * value:.1f}" for value in (lu, cholesky)),
            *(f"{value / lu:.2f}" for value in (collocation, galerkin)),
            *(f"{1e3 * value:.0f}" for value in (constant, linear)),
            f"{linear / (10.0 * cholesky + 0.05):.2f}",
        )
        console.print(f"N = {n_elements} done", style="dim")
    console.print(table)
    for name, seconds in start_up():
        console.print(f"{name}: {seconds:.2f} s")


if __name__ == "__main__":
    main()
