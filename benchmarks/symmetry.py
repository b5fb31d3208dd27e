"""What symmetry lines save: the same body whole, halved and quartered, measured side by side.

    python -m benchmarks.symmetry [ELEMENTS ...]

prints medians of the times of assembly (with condensation) and of everything, and their ratios to the whole body.
"""

from __future__ import annotations

import sys
from dataclasses import replace
from statistics import median

import bemkit as bk
from tests.scenes import DISCRETISATIONS, squeezed

LINES = {
    "whole": None,
    "half": bk.Symmetry(x=0.0),
    "quarter": bk.Symmetry(x=0.0, y=0.0),
}
ROUNDS = 5


def measure(scene: bk.Scene) -> dict[str, dict[str, float]]:
    """Return the median seconds of each variant by stage."""
    times: dict[str, list[bk.Solution]] = {name: [] for name in LINES}
    for _ in range(ROUNDS):
        for name, symmetry in LINES.items():
            times[name].append(bk.run(replace(scene, symmetry=symmetry)))
    return {
        name: {
            "assembly": median(run.timings["assemble"] + run.timings.get("condense", 0.0) for run in runs),
            "total": median(run.timings["total"] for run in runs),
        }
        for name, runs in times.items()
    }


def main() -> None:
    """Print one line for each discretisation, size and variant."""
    print(f"{'elements':>8} {'discretisation':20} {'variant':8} {'assembly':>9} {'ratio':>6} {'total':>9} {'ratio':>6}")
    for n_elements in [int(argument) for argument in sys.argv[1:]] or [320, 960]:
        for discretisation in DISCRETISATIONS:
            shape = bk.Rectangle(3.0, 2.0, (-1.5, -1.0))
            scene = squeezed(shape, discretisation=discretisation, mesh=bk.MeshOptions(elements=n_elements))
            found = measure(scene)
            for name, values in found.items():
                columns = [f"{values[stage]:8.3f}s {values[stage] / found['whole'][stage]:6.2f}" for stage in values]
                print(f"{n_elements:8} {type(discretisation).__name__:20} {name:8} {' '.join(columns)}")


if __name__ == "__main__":
    main()
