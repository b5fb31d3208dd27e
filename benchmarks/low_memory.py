"""Example 1 with products by the fast multipole method beside the direct solver: steps, memory and time.

    python benchmarks/low_memory.py [--alone | --product] [N ...]

For each number of elements N (default 1000 10000) it runs `bk.run` with each of the two linear solvers in a process of
its own (`--alone`: without the direct one), and prints the most and the median number of steps of a response on the
finest mesh, the largest memory of all arrays since its equations were begun, processor seconds, the certificate, how
the run ended, and whether statuses are those of the direct solver. `--product` prints the processor seconds of one
product of the operator instead.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import time
import tracemalloc
from dataclasses import replace
from typing import Any

import numpy as np
from rich.console import Console
from rich.table import Table

import bemkit as bk
from bemkit.geometry.proximity.cluster_tree import ClusterTree
from bemkit.operators.collocation import compiled
from bemkit.operators.collocation.equations import CollocationEquations, collocation_equations
from bemkit.operators.matrix_free.fast_multipole import LEAF_SIZE, FastMultipole
from bemkit.operators.steklov_poincare.hierarchical import HierarchicalCollocation

SOLVERS = {"direct": bk.Hierarchical(), "matrix-free": bk.MatrixFree()}


def measured(n_elements: int, name: str) -> dict[str, Any]:
    """Run Example 1 and return what it took."""
    systems: list[Any] = []
    make = HierarchicalCollocation.system

    def listening(self: HierarchicalCollocation, *arguments: Any) -> Any:
        tracemalloc.stop()
        tracemalloc.start()
        systems[:] = [make(self, *arguments)]
        return systems[0]

    compiled.loaded()
    scene = bk.load_scene("paper-1")
    small = replace(scene, mesh=replace(scene.mesh, elements=400), linear_solver=SOLVERS[name])
    bk.run(small)  # whatever is loaded and compiled on first use
    HierarchicalCollocation.system = listening  # type: ignore[method-assign]
    clock = time.process_time()
    solution = bk.run(replace(small, mesh=replace(scene.mesh, elements=n_elements)))
    return {
        "seconds": time.process_time() - clock,
        "bytes": tracemalloc.get_traced_memory()[1],
        "worst": solution.certificate.worst,
        "status": solution.status.name.lower(),
        "steps": getattr(systems[-1].factor, "steps", []),
        "statuses": solution.contact.status.tolist(),
    }


def product_seconds(n_elements: int) -> float:
    """Return the processor seconds of a product, of five the median."""
    scene = bk.load_scene("paper-1")
    mesh = replace(scene, mesh=replace(scene.mesh, elements=n_elements)).build_mesh()
    tree = ClusterTree.of(mesh.centres, LEAF_SIZE)
    equations = collocation_equations(mesh, scene.material, tree.order, takes_slopes=bk.ConstantCollocation().slopes)
    assert isinstance(equations, CollocationEquations)
    layers = FastMultipole(equations, scene.material, tree, 1e-13)  # what a tolerance of 1e-10 of the iteration takes
    state, seconds = np.random.default_rng(0).standard_normal((2, n_elements, 2)), []
    for _ in range(6):
        clock = time.process_time()
        layers.product(*state)
        seconds.append(time.process_time() - clock)
    return float(np.median(seconds[1:]))  # the first loads what is compiled


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser()
    parser.add_argument("n_elements", nargs="*", type=int, default=[1000, 10_000])
    parser.add_argument("--alone", action="store_true")
    parser.add_argument("--product", action="store_true")
    parser.add_argument("--child", choices=SOLVERS)
    arguments = parser.parse_args()
    if arguments.child:
        print(json.dumps(measured(arguments.n_elements[0], arguments.child)))
        return
    if arguments.product:
        for n_elements in arguments.n_elements:
            print(f"{n_elements} elements: {product_seconds(n_elements):.2f} s")
        return
    console, table = Console(width=150), Table(title="Example 1: matrix-free beside direct")
    for column in (
        "N",
        "responses",
        "most steps",
        "median",
        "MB",
        "direct MB",
        "s",
        "direct s",
        "certificate",
        "status",
        "same",
    ):
        table.add_column(column, justify="right")
    for n_elements in arguments.n_elements:
        found = []
        for name in ("matrix-free",) if arguments.alone else ("matrix-free", "direct"):
            command = [sys.executable, "-W", "ignore", __file__, str(n_elements), "--child", name]
            found.append(json.loads(subprocess.run(command, check=True, capture_output=True, text=True).stdout))
        own, direct = found[0], found[-1]
        table.add_row(
            str(n_elements), str(len(own["steps"])), str(max(own["steps"])), f"{np.median(own['steps']):.0f}",
            f"{own['bytes'] / 1e6:.1f}", f"{direct['bytes'] / 1e6:.1f}" if direct is not own else "",
            f"{own['seconds']:.1f}", f"{direct['seconds']:.1f}" if direct is not own else "",
            f"{own['worst']:.0e}", own["status"],
            str(own["statuses"] == direct["statuses"]) if direct is not own else "",
        )  # fmt: skip
        console.print(table)


if __name__ == "__main__":
    main()
