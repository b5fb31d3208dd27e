"""Planned against measured time and memory of six scenes, side by side in one run.

    python benchmarks/plan.py [--repetitions N]

For each scene it prints the planned and the measured time of a run (median, after one run to warm up), the planned and
the measured peak of memory (`tracemalloc`, in a run of its own because tracing costs time), and the ratios
planned / measured. It exits with 1 if a time is wrong by more than the factor 3 or a memory by more than a fifth.
"""

from __future__ import annotations

import argparse
import statistics
import tracemalloc

from rich.console import Console
from rich.table import Table

import bemkit as bk
from bemkit.cli.console import format_seconds, format_size
from bemkit.scene.toml import load_scene, with_overrides

SCENES = [
    ("paper-1", "constant", 320),
    ("paper-1", "linear", 320),
    ("paper-2", "quadratic", 160),
    ("wavy-obstacle", "linear", 400),
    ("receding-layer", "constant", 600),
    ("disc-between-plates", "quadratic", 200),
]
TIME_FACTOR, MEMORY_TOLERANCE = 3.0, 0.2


def timed(scene: bk.Scene, repetitions: int) -> dict[str, float]:
    """Median seconds of each stage and of all, after one run to warm up."""
    runs = [bk.run(scene) for _ in range(repetitions + 1)][1:]
    if not all(solution.is_converged for solution in runs):
        raise SystemExit(f"{scene.title} did not converge")  # accuracy comes before every timing
    return {name: statistics.median(run.timings[name] for run in runs) for name in runs[0].timings}


def traced(scene: bk.Scene) -> bk.Solution:
    """Return a solution with its memory."""
    tracemalloc.start()
    try:
        return bk.run(scene)
    finally:
        tracemalloc.stop()


def main() -> int:
    """Print the table and return the exit code."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--repetitions", type=int, default=5)
    arguments = parser.parse_args()
    console = Console(highlight=False, width=140)
    table = Table(title="planned against measured")
    for column in ("scene", "planned", "time", "ratio", "planned", "memory", "ratio", "counts"):
        table.add_column(column, justify="right" if column != "scene" else "left", no_wrap=True)
    is_good = True
    for name, word, n_elements in SCENES:
        scene = with_overrides(load_scene(name), elements=n_elements, discretisation=word)
        measured, solution = timed(scene, arguments.repetitions), traced(scene)
        seconds, memory = solution.plan.seconds, max(solution.memory.values())
        ratio, share = seconds / measured["total"], solution.plan.memory / memory
        counts = "equal" if solution.work == solution.plan.work else "differ"
        sizes = (format_size(solution.plan.memory), format_size(memory), f"{share:.2f}")
        times = (format_seconds(seconds), format_seconds(measured["total"]), f"{ratio:.2f}")
        table.add_row(f"{name} {word} {n_elements}", *times, *sizes, counts)
        is_good &= 1 / TIME_FACTOR < ratio < TIME_FACTOR and abs(share - 1.0) < MEMORY_TOLERANCE and counts == "equal"
    console.print(table)
    return 0 if is_good else 1


if __name__ == "__main__":
    raise SystemExit(main())
