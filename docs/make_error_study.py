"""Fill the tables and figures of ``docs/error-against-run-time.md``: ``python docs/make_error_study.py``.

It takes some minutes. Run it on a machine that does nothing else: the figures show run times.
"""

from __future__ import annotations

import csv
import io
import math
import sys
from collections.abc import Sequence
from pathlib import Path

from markers import between
from matplotlib.figure import Figure
from PIL import Image

import bemkit as bk
from bemkit.reference import MEASURES, Reference, find_reference, over_resolved
from bemkit.studies.accuracy.figures import draw_errors
from bemkit.studies.accuracy.records import ErrorRecord, by_series, fitted_rate, pareto_front
from bemkit.studies.accuracy.runs import adaptive, all_runs, error_tasks, graded, uniform
from bemkit.studies.engine import compute

PAGE = Path(__file__).parent / "error-against-run-time.md"
IMAGES = Path(__file__).parent / "images"
TABLES = Path(__file__).parent / "tables"
SCENES = ("paper-1", "paper-2", "wavy-obstacle", "disc-between-plates", "clamped-angle")
ELEMENTS = (40, 80, 160, 320, 640)
ACCURACIES = (1e-2, 1e-3, 1e-4)
RISING = (*ACCURACIES, 1e-5, 1e-6)
FINEST = 1400
REPEAT = 3
DOTS_PER_INCH = 90
N_COLOURS = 48
PANELS = ("energy", "sigma_n", "displacement", "transitions")
TARGETS = (1e-1, 1e-2, 1e-3, 1e-4, 1e-5, 1e-6)


def main() -> None:
    """Run the studies of the scenes named on the command line, of all if there are none, and write what they show."""
    IMAGES.mkdir(exist_ok=True)
    for name in sys.argv[1:] or SCENES:
        scene = bk.load_scene(name)
        reference = find_reference(scene) or over_resolved(scene, FINEST)
        rows = study(scene, reference)
        figure = draw_errors(rows, PANELS, title=scene.title)
        save_small(figure, IMAGES / f"error-study-{name}.png")
        text = PAGE.read_text("utf-8")
        write_orders(rows, TABLES / f"orders-{name}.csv")
        text = between(text, f"{name}-choice", choice_table(rows))
        text = between(text, f"{name}-reference", reference_sentence(reference))
        PAGE.write_text(text, "utf-8")


def save_small(figure: Figure, path: Path) -> None:
    """Write a picture of few colours, which takes a third of the room."""
    drawn = io.BytesIO()
    figure.savefig(drawn, dpi=DOTS_PER_INCH, metadata={"Software": None})
    Image.open(drawn).convert("RGB").quantize(N_COLOURS, dither=Image.Dither.NONE).save(path, optimize=True)


def study(scene: bk.Scene, reference: Reference) -> list[ErrorRecord]:
    """Return the rows: all elements and meshes by Newton, and the smaller ones by the augmented Lagrangian too."""
    elements = (bk.ConstantCollocation(), bk.Galerkin(1), bk.Galerkin(2))
    meshes = (uniform(ELEMENTS), graded(ELEMENTS), adaptive(ACCURACIES))
    newton = all_runs(scene, elements, meshes, [bk.SemismoothNewton()])
    newton += all_runs(scene, ["hp"], [adaptive(RISING, FINEST)], [bk.SemismoothNewton()])
    few = (uniform(ELEMENTS[:-1]), adaptive(ACCURACIES[:2]))
    augmented = all_runs(scene, elements, few, [bk.AugmentedLagrangian()])
    # the finest meshes are for constant elements, which are fast and need them
    runs = [run for run in (*newton, *augmented) if run.discretisation == "constant" or run.size != ELEMENTS[-1]]
    return list(compute(error_tasks(runs, reference, REPEAT)))


def reference_sentence(reference: Reference) -> str:
    """Say what errors are measured against."""
    own = [
        f"{MEASURES[name]} {value:.0e}"
        for name, value in reference.own_errors.items()
        if math.isfinite(value) and name != "force_normal"
    ]
    return f"Reference: {reference.source}." + (f" Its own errors are at most: {', '.join(own)}." if own else "")


def write_orders(rows: Sequence[ErrorRecord], path: Path) -> None:
    """Write the observed rates in the number of unknowns, Newton only: other solvers reach the same state."""
    with path.open("w", newline="") as stream:
        table = csv.writer(stream, lineterminator="\n")
        table.writerow(["elements", "meshes", *(MEASURES[name] for name in PANELS)])
        for series in by_series(rows):
            if series[0].solver == "semismooth-newton":
                rates = [str(fitted_rate(series, name)) for name in PANELS]
                table.writerow([series[0].discretisation, series[0].meshes, *rates])


def choice_table(rows: Sequence[ErrorRecord]) -> str:
    """Return the fastest run that reaches each error of the normal traction, and of the energy."""
    lines = ["| target error | in the normal traction | in the energy |", "|---|---|---|"]
    for target in TARGETS:
        cells = [fastest(rows, measure, target) for measure in ("sigma_n", "energy")]
        lines.append(f"| {target:.0e} | {' | '.join(cells)} |")
    return "\n".join(lines)


def fastest(rows: Sequence[ErrorRecord], measure: str, target: float) -> str:
    """Describe the fastest run whose error is at most the target."""
    good = [row for row in pareto_front(rows, measure) if getattr(row, measure) <= target]
    if not good:
        return "not reached"
    row = good[0]
    driver = "" if row.solver == "semismooth-newton" else f", {row.solver}"
    return f"{row.discretisation}, {row.meshes}, {row.elements} elements{driver}: {1e3 * row.seconds:.0f} ms"


if __name__ == "__main__":
    main()
