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
from bemkit.table import markdown_table

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
        write_fastest(rows, TABLES / f"fastest-{name}.csv")
        text = between(text, f"{name}-reference", reference_sentence(reference))
        PAGE.write_text(text, "utf-8")
    write_summary()


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


def write_fastest(rows: Sequence[ErrorRecord], path: Path) -> None:
    """Write the fastest run that reaches each error of the normal traction, and of the energy."""
    with path.open("w", newline="") as stream:
        table = csv.writer(stream, lineterminator="\n")
        table.writerow(["target", "in", "discretisation", "meshes", "elements", "solver", "milliseconds"])
        for measure in ("sigma_n", "energy"):
            for target in TARGETS:
                table.writerow([f"{target:.0e}", MEASURES[measure], *fastest(rows, measure, target)])


def fastest(rows: Sequence[ErrorRecord], measure: str, target: float) -> list[str]:
    """Describe the fastest run whose error is at most the target."""
    for row in pareto_front(rows, measure):
        if getattr(row, measure) <= target:
            return [row.discretisation, row.meshes, str(row.elements), row.solver, f"{1e3 * row.seconds:.0f}"]
    return ["not reached", "", "", "", ""]


def write_summary() -> None:
    """Write the table of the page from the files of all scenes: elements and milliseconds for the normal traction."""
    cells = {}
    for name in SCENES:
        with (TABLES / f"fastest-{name}.csv").open(newline="") as stream:
            for row in csv.DictReader(stream):
                if row["in"] == MEASURES["sigma_n"]:
                    cells[name, row["target"]] = f"{row['discretisation']} {row['milliseconds']}"
    lines = [[f"{target:.0e}", *(cells[name, f"{target:.0e}"] for name in SCENES)] for target in TARGETS]
    heads = ["error", *(f"`{name}`" for name in SCENES)]
    table = markdown_table(heads, lines, [False] * len(heads)).rstrip()
    PAGE.write_text(between(PAGE.read_text("utf-8"), "fastest", table), "utf-8")


if __name__ == "__main__":
    main()
