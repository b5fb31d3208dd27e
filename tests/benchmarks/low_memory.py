"""Example 1 with products by the fast multipole method beside the direct solver: steps, memory and time.

    python tests/benchmarks/low_memory.py [N ...]

For each number of elements N (default 1000 10000) it runs `bk.run` with each of the two linear solvers in a process of
its own, and prints the most and the median number of steps of a response on the finest mesh, the memory of the process
beyond that of the one that has done nothing yet (largest at any time), processor seconds, the certificate, and whether
statuses are those of the direct solver.
"""

from __future__ import annotations

import json
import resource
import subprocess
import sys
import time
from dataclasses import replace
from typing import Any

import numpy as np
from rich.console import Console
from rich.table import Table

import bemkit as bk
from bemkit.operators.hierarchy import compiled

SOLVERS = {"direct": bk.Hierarchical(), "matrix-free": bk.MatrixFree()}


def peak() -> int:
    """Largest memory of this process so far [bytes]."""
    return 1024 * resource.getrusage(resource.RUSAGE_SELF).ru_maxrss


def measured(n_elements: int, name: str) -> dict[str, Any]:
    """Run Example 1 and return what it took."""
    from bemkit.operators.hierarchy.matrix_free import MatrixFreeSystem

    systems: list[MatrixFreeSystem] = []
    begin = MatrixFreeSystem.__init__

    def listening(self: MatrixFreeSystem, *arguments: Any, **options: Any) -> None:
        begin(self, *arguments, **options)
        systems.append(self)

    MatrixFreeSystem.__init__ = listening  # type: ignore[method-assign]
    compiled.functions()
    scene = bk.load_scene("paper-1")
    small = replace(scene, mesh=replace(scene.mesh, elements=400), linear_solver=SOLVERS[name])
    bk.run(small)  # whatever is loaded and compiled on first use
    before, clock = peak(), time.process_time()
    solution = bk.run(replace(small, mesh=replace(scene.mesh, elements=n_elements)))
    return {
        "seconds": time.process_time() - clock,
        "bytes": peak() - before,
        "worst": solution.certificate.worst,
        "is_converged": solution.is_converged,
        "steps": systems[-1].steps if systems else [],
        "statuses": solution.contact.status.tolist(),
    }


def main() -> None:
    """Print the table."""
    if len(sys.argv) == 3 and sys.argv[2] in SOLVERS:
        print(json.dumps(measured(int(sys.argv[1]), sys.argv[2])))
        return
    console, table = Console(width=150), Table(title="Example 1: matrix-free beside direct")
    for column in ("N", "responses", "most steps", "median", "MB", "direct MB", "s", "direct s", "certificate", "same"):
        table.add_column(column, justify="right")
    for number in sys.argv[1:] or ["1000", "10000"]:
        found = []
        for name in ("matrix-free", "direct"):
            command = [sys.executable, "-W", "ignore", __file__, number, name]
            found.append(json.loads(subprocess.run(command, check=True, capture_output=True, text=True).stdout))
        own, direct = found
        table.add_row(
            number, str(len(own["steps"])), str(max(own["steps"])), f"{np.median(own['steps']):.0f}",
            f"{own['bytes'] / 1e6:.1f}", f"{direct['bytes'] / 1e6:.1f}", f"{own['seconds']:.1f}",
            f"{direct['seconds']:.1f}", f"{own['worst']:.0e}", str(own["statuses"] == direct["statuses"]),
        )  # fmt: skip
        console.print(table)


if __name__ == "__main__":
    main()
