"""The paper's examples by finite elements and by bemkit: run times at equal errors, measured in turn in one run.

    python tests/benchmarks/peers.py [--slow] [--without-getfem] [--repetitions N] [--example N]

Every code climbs a ladder of meshes, and for each target of `accuracy.py` the cheapest mesh that meets it is timed
again, in turn with bemkit's own run for that target. Ratios are to the median of that run.

* uniform: square cells with quadratic elements (`fem.py`, PARDISO if `pypardiso` is installed).
* graded, told: any degree, graded towards corners, jumps of the load and the transition points of the reference.
* graded, finding: the same, but the transition points are found on two coarser meshes first.
* GetFEM uniform and told: see `getfem_peer.py`; `--slow` adds its meshes of 160 and 320 cells, some five minutes.
* bemkit: adaptive from scratch, with the accuracy as its only input; degree and number of elements are its own.
* bemkit, told: one mesh of a given size, graded towards the transition points of the reference.

The ladders are chosen with the reference at hand: only bemkit's own run estimates its error.
"""

from __future__ import annotations

import json
import statistics
import subprocess
import sys
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import click
import numpy as np
from rich.console import Console
from rich.table import Table

import bemkit as bk
from bemkit.geometry.meshing.partition import better_partition

sys.path.insert(0, str(Path(__file__).parents[2]))
from tests.benchmarks.accuracy import FIELDS, TARGETS, Target, errors_of, measured_errors
from tests.benchmarks.fem import FiniteElementSolution, Line, graded_line, solve_scene, uniform_line
from tests.scenes import paper, reference_table, reference_values

GETFEM_PYTHON = "/usr/bin/python3"
"""Debian's `python3-getfem` is for Debian's interpreter."""
SECONDS = 4.0
"""Time that the repetitions of one setting may take; the first two runs aside."""


@dataclass(frozen=True)
class Outcome:
    """One run: its errors by name, and its wall time [s]."""

    errors: dict[str, float]
    seconds: float


@dataclass(frozen=True)
class Setting:
    """A peer's mesh, in words, and what solves on it."""

    words: str
    solve: Callable[[], Outcome]


def bemkit(example: int, scene: bk.Scene, mesh: bk.BoundaryMesh | None = None) -> Outcome:
    """Run bemkit, on the given mesh or from scratch."""
    begin = time.perf_counter()
    solution = bk.run(scene, mesh=mesh)
    seconds = time.perf_counter() - begin
    return Outcome(measured_errors(solution, example), seconds)


def bemkit_told(example: int, n_elements: int) -> Outcome:
    """Run bemkit on one mesh that is graded towards the transition points of the reference."""
    scene = paper(example, mesh=bk.MeshOptions(accuracy=0.5))  # the accuracy only says what kind of mesh is made first
    begin = time.perf_counter()
    outline, contact = scene.shape.outline(), [part.name for part in scene.contact_parts]
    first = scene.mesh.first_partition(outline, scene.selections, contact)
    places = [x / WIDTH[example] for x in reference_values(example)[1]]
    cuts = {outline.side_names.index("bottom"): places}
    density = np.ones(len(first.sides))
    mesh = better_partition(first, density, n_elements, cuts=cuts, spread_over=contact).mesh
    solution = bk.run(scene, mesh=mesh)
    seconds = time.perf_counter() - begin
    return Outcome(measured_errors(solution, example) | {"transitions": float("inf")}, seconds)


def finite_elements(example: int, solve: Callable[[bk.Scene], FiniteElementSolution], is_told: bool = False) -> Outcome:
    """Run our own finite elements; transitions that were told do not count as found."""
    scene = paper(example)
    begin = time.perf_counter()
    solution = solve(scene)
    seconds = time.perf_counter() - begin
    x = reference_table(example)["x"]
    fields = {name: solution.line.evaluated(getattr(solution.contact, name), x) for name in FIELDS}
    places = [] if is_told else [transition.x for transition in solution.transitions]
    return Outcome(errors_of(example, fields, solution.force_tangential, solution.energy, places), seconds)


def getfem(example: int, x: Line, y: Line) -> Outcome:
    """Run GetFEM in a process of its own; its first run is as fast as any other."""
    points = reference_table(example)["x"].tolist()
    request = {"example": example, "x": x.ends.tolist(), "y": y.ends.tolist(), "points": points, "repetitions": 1}
    command = [GETFEM_PYTHON, str(Path(__file__).with_name("getfem_peer.py"))]
    answered = subprocess.run(command, input=json.dumps(request), capture_output=True, text=True, check=True)
    answer = json.loads(answered.stdout.splitlines()[-1])
    fields = {name: np.array(answer[name]) for name in FIELDS}
    return Outcome(errors_of(example, fields, answer["force"], answer["energy"], []), answer["times"][-1])


def has_getfem() -> bool:
    """Whether Debian's interpreter has GetFEM."""
    try:
        return subprocess.run([GETFEM_PYTHON, "-c", "import getfem"], capture_output=True, check=False).returncode == 0
    except OSError:
        return False


# by example: width of the rectangle, and where the loads jump on the bottom's and on the left side's coordinate
WIDTH = {1: 1.0, 2: 0.5}
JUMPS = {1: ((0.5,), (0.5,)), 2: ((), ())}
UNIFORM = (20, 40, 80, 160)
UNIFORM_SLOW = (320,)
# degree, elements along x and y, exponent of the grading
GRADED = (
    (2, 16, 10, 2.5),
    (2, 24, 14, 2.5),
    (2, 32, 20, 2.5),
    (2, 48, 32, 2.5),
    (3, 12, 8, 2.5),
    (3, 16, 12, 2.5),
    (3, 24, 16, 2.5),
    (3, 48, 32, 2.5),
    (4, 16, 12, 2.5),
    (4, 16, 12, 3.5),
    (4, 24, 16, 3.5),
    (4, 32, 20, 3.5),
    (5, 24, 16, 3.5),
    (6, 24, 16, 4.0),
)
GETFEM_UNIFORM = (20, 40, 80)
GETFEM_SLOW = (160, 320)
TOLD = (40, 48, 56, 64, 80, 100, 130, 180, 260, 360)
GETFEM_GRADED = ((16, 10), (24, 14), (32, 20), (40, 26), (48, 32), (64, 32))


def uniform_lines(example: int, n_cells: int) -> tuple[Line, Line]:
    """Return the lines of square cells, `n_cells` to a unit of length."""
    return uniform_line(WIDTH[example], round(n_cells * WIDTH[example]), 2), uniform_line(1.0, n_cells, 2)


def graded_lines(
    example: int, transitions: Sequence[float], degree: int, n_x: int, n_y: int, exponent: float
) -> tuple[Line, Line]:
    """Return lines graded towards corners, jumps and transitions."""
    jumps_x, jumps_y = JUMPS[example]
    breaks = sorted({0.0, *jumps_x, *transitions, WIDTH[example]})
    return graded_line(breaks, n_x, degree, exponent), graded_line([0.0, *jumps_y, 1.0], n_y, degree, exponent)


def follow(scene: bk.Scene, example: int, degree: int, n_x: int, n_y: int, exponent: float) -> FiniteElementSolution:
    """Find the transitions on two coarser meshes before the last one is graded towards them."""
    places: list[float] = []
    for share in (0.4, 0.6, 1.0):
        lines = graded_lines(example, places, degree, round(share * n_x), round(share * n_y), exponent)
        solution = solve_scene(scene, *lines)
        places = [transition.x for transition in solution.transitions]
    return solution


def ladders(example: int, with_getfem: bool, with_slow: bool) -> dict[str, list[Setting]]:
    """Return the settings of all peers by name."""
    places = reference_values(example)[1]
    result: dict[str, list[Setting]] = {"uniform": [], "graded, told": [], "graded, finding": []}
    for n_cells in UNIFORM + (UNIFORM_SLOW if with_slow else ()):
        x, y = uniform_lines(example, n_cells)
        solve = partial(solve_scene, x=x, y=y)
        result["uniform"].append(Setting(f"Q2, {n_cells} cells", partial(finite_elements, example, solve)))
    for degree, n_x, n_y, exponent in GRADED:
        words = f"Q{degree}, {n_x} x {n_y}"
        x, y = graded_lines(example, places, degree, n_x, n_y, exponent)
        solve = partial(solve_scene, x=x, y=y)
        result["graded, told"].append(Setting(words, partial(finite_elements, example, solve, is_told=True)))
        search = partial(follow, example=example, degree=degree, n_x=n_x, n_y=n_y, exponent=exponent)
        result["graded, finding"].append(Setting(words, partial(finite_elements, example, search)))
    result["bemkit, told"] = [Setting(f"degree 2, {n}", partial(bemkit_told, example, n)) for n in TOLD]
    if with_getfem:
        result["GetFEM uniform"] = [
            Setting(f"Q2, {n} cells", partial(getfem, example, *uniform_lines(example, n)))
            for n in GETFEM_UNIFORM + (GETFEM_SLOW if with_slow else ())
        ]
        result["GetFEM told"] = [
            Setting(f"Q2, {n_x} x {n_y}", partial(getfem, example, *graded_lines(example, places, 2, n_x, n_y, 2.5)))
            for n_x, n_y in GETFEM_GRADED
        ]
    return result


def climb(settings: Sequence[Setting]) -> list[tuple[Setting, Outcome]]:
    """Run every setting, cheap ones twice because the first run warms up, the cheapest first."""
    found = []
    for setting in settings:
        outcome = setting.solve()
        found.append((setting, outcome if outcome.seconds > 1.0 else setting.solve()))
    return sorted(found, key=lambda pair: pair[1].seconds)


def in_turn(chosen: dict[str, tuple[Setting, Outcome]], repetitions: int) -> dict[str, float]:
    """Return the median times [s] of several settings, measured in turn."""
    times = {name: [outcome.seconds] for name, (_, outcome) in chosen.items()}
    for _ in range(repetitions):
        for name, (setting, _) in chosen.items():
            if sum(times[name]) < SECONDS:
                times[name].append(setting.solve().seconds)
    return {name: statistics.median(values) for name, values in times.items()}


def compare(example: int, climbed: dict[str, list[tuple[Setting, Outcome]]], repetitions: int, table: Table) -> None:
    """Add a row for every target and every peer."""
    for errors in {tuple(target.errors.items()): None for target in TARGETS}:
        own = [target for target in TARGETS if tuple(target.errors.items()) == errors]
        runs = {**climbed, "bemkit": climb([_from_scratch(example, target) for target in own])}
        met = {
            name: next(((setting, got) for setting, got in outcomes if own[0].is_met_by(got.errors)), None)
            for name, outcomes in runs.items()
        }
        medians = in_turn({name: pair for name, pair in met.items() if pair is not None}, repetitions)
        for name, pair in met.items():
            if pair is None:
                table.add_row(f"paper-{example}", own[0].words, name, "none of its meshes", "", "", "")
                continue
            setting, outcome = pair
            reached = ", ".join(f"{outcome.errors[key]:.1e}" for key in own[0].errors)
            ratio = f"{medians[name] / medians['bemkit']:.2g}" if "bemkit" in medians else ""
            milliseconds = f"{1e3 * medians[name]:.0f}"
            table.add_row(f"paper-{example}", own[0].words, name, setting.words, reached, milliseconds, ratio)
        table.add_section()


def _from_scratch(example: int, target: Target) -> Setting:
    scene = paper(example, target.discretisation, target.mesh)
    mesh = bk.run(scene).mesh
    words = f"degree {target.discretisation.displacement_space(mesh).degree}, {mesh.n_elements}"
    return Setting(words, partial(bemkit, example, scene))


@click.command()
@click.option("--slow", is_flag=True, help="Add the largest uniform meshes.")
@click.option("--without-getfem", is_flag=True, help="Leave GetFEM out even if it is installed.")
@click.option("--repetitions", default=7, show_default=True, help="Runs of each setting beyond the first.")
@click.option("--example", type=click.IntRange(1, 2), multiple=True, default=(1, 2), show_default=True)
def main(slow: bool, without_getfem: bool, repetitions: int, example: tuple[int, ...]) -> None:
    """Compare finite elements with bemkit at equal errors."""
    console = Console(width=140)
    table = Table(title="Finite elements against bemkit: medians, and ratios to bemkit's run from scratch")
    for column in ("example", "wanted", "code", "mesh", "reached", "median [ms]", "ratio"):
        table.add_column(column, justify="right" if column in ("reached", "median [ms]", "ratio") else "left")
    with_getfem = not without_getfem and has_getfem()
    for number in example:
        climbed = {name: climb(settings) for name, settings in ladders(number, with_getfem, slow).items()}
        for name, outcomes in climbed.items():
            for setting, got in outcomes:
                errors = "  ".join(f"{key} {value:.1e}" for key, value in got.errors.items())
                console.print(
                    f"paper-{number}  {name}  {setting.words}  {1e3 * got.seconds:.0f} ms  {errors}", style="dim"
                )
        compare(number, climbed, repetitions, table)
    console.print(table)
    if not with_getfem and not without_getfem:
        console.print(f"GetFEM was left out: {GETFEM_PYTHON} cannot import it (Debian: python3-getfem).")


if __name__ == "__main__":
    main()
