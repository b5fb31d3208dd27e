"""The paper's examples by finite elements and by bemkit: run times at equal errors, measured in turn in one run.

    python benchmarks/peers.py [--slow] [--without-getfem] [--repetitions N] [--example N] [--code C] [...]

Every code climbs a ladder of meshes, and for each target of `accuracy.py` the cheapest mesh that meets it is timed
again, in turn with bemkit's own run for that target. Ratios are to the median of that run. All errors are those of
`bemkit.reference.errors_of`, at places that are dense where the contact status changes. On a busy machine take
`--processor-time` and one core (`taskset -c 0`): wall times then say more about the neighbours.

* uniform: square cells with quadratic elements (`fem.py`, PARDISO if `pypardiso` is installed).
* graded, told: any degree, graded towards corners, jumps of the load and the transition points of the reference, by
  powers of the distance or in geometric layers.
* graded, finding: the same, but the transition points are found on two to four coarser meshes first.
* GetFEM uniform and told: see `getfem_peer.py`; `--slow` adds its meshes of 160 and 320 cells, some five minutes.
* bemkit: adaptive from scratch, by an accuracy; degrees and numbers of elements are its own.
* bemkit, told: one mesh of a given degree, in layers towards the transition points of the reference.

The ladders, and the accuracies that bemkit is asked for, are chosen with the reference at hand: only bemkit's own run
estimates its error.
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
from bemkit.geometry.meshing.division import divide
from bemkit.geometry.meshing.layers import FACTOR, refined_partition
from bemkit.geometry.meshing.partition import Partition
from bemkit.reference import SampledFields, ZoneEnd, errors_of

sys.path.insert(0, str(Path(__file__).parents[2]))
from benchmarks.accuracy import TARGETS, Choice, Clock, Target, degree_of, measured_errors, reference_of
from benchmarks.fem import FiniteElementSolution, Line, graded_line, layered_line, solve_scene, uniform_line
from tests.scenes import paper

GETFEM_PYTHON = "/usr/bin/python3"
"""Debian's `python3-getfem` is for Debian's interpreter."""
SECONDS = 2.0
"""Time that the repetitions of one setting may take; the first two runs aside."""


@dataclass(frozen=True)
class Outcome:
    """One run: its errors by name, and its seconds."""

    errors: dict[str, float]
    seconds: float


@dataclass(frozen=True)
class Setting:
    """A peer's mesh, in words, and what solves on it."""

    words: str
    solve: Callable[[], Outcome]


FIELDS = ("u_n", "u_t", "sigma_n", "sigma_t")
NOT_FOUND = {"transitions": float("inf")}
"""The error of transition points that were told."""


def places_of(example: int) -> list[float]:
    """Return the transition points of the reference [m]."""
    return [zone.s for zone in reference_of(example).answer.zones]


def bemkit(example: int, scene: bk.Scene, clock: Clock) -> Outcome:
    """Run bemkit from scratch."""
    begin = clock()
    solution = bk.run(scene)
    seconds = clock() - begin
    return Outcome(measured_errors(solution, example), seconds)


def bemkit_told(example: int, degree: int, n_even: int, n_others: int, n_layers: int, clock: Clock) -> Outcome:
    """Run bemkit on one mesh in layers towards the places of the reference."""
    scene, places = paper(example, bk.Galerkin(degree=degree)), [x / WIDTH[example] for x in places_of(example)]
    mesh = told_mesh(scene, places, n_even, n_others, n_layers)  # the lines of its peers are given, too
    begin = clock()
    solution = bk.run(scene, mesh=mesh)
    seconds = clock() - begin
    return Outcome(measured_errors(solution, example) | NOT_FOUND, seconds)


def told_mesh(scene: bk.Scene, places: Sequence[float], n_even: int, n_others: int, n_layers: int) -> bk.BoundaryMesh:
    """Return equal elements on each piece, the first and the last of them cut into layers.

    Pieces end at corners, at ends of parts and at places along the bottom, these towards `n_layers` layers, else
    towards `n_others`, and more where a long element would meet a short one.
    """
    outline = scene.shape.outline()
    bottom, base = outline.side_names.index("bottom"), divide(outline, scene.only.selections)
    division, parameters = base.cut({bottom: places}), []
    for piece in division.pieces:
        is_told = [piece.side == bottom and bool(np.isclose(places, end, atol=0.0).any()) for end in piece.span]
        left, right = (FACTOR ** np.arange(n_layers if told else n_others, 0, -1.0) / n_even for told in is_told)
        inner = np.arange(1.0, n_even) / n_even
        parameters.append(piece.at(np.concatenate([[0.0], left, inner, 1.0 - right[::-1], [1.0]])))
    partition = Partition(base, division, tuple(parameters))
    return refined_partition(partition, np.zeros(len(partition.sides)), partition, 1.0).mesh


def finite_elements(
    example: int, solve: Callable[[bk.Scene], FiniteElementSolution], clock: Clock, is_told: bool = False
) -> Outcome:
    """Run our own finite elements; transitions that were told do not count as found."""
    scene, reference = paper(example), reference_of(example)
    begin = clock()
    solution = solve(scene)
    seconds = clock() - begin
    table, x = solution.contact, reference.places[0].s
    fields = {name: solution.line.evaluated(getattr(table, name), x) for name in FIELDS}
    answer = SampledFields(
        **fields,
        energy=solution.energy,
        force_normal=float(table.weight @ table.sigma_n),
        force_tangential=solution.force_tangential,
        zones=tuple(ZoneEnd(t.part, t.s, t.from_status, t.to_status) for t in solution.transitions),
    )
    return Outcome(errors_of(answer, reference) | (NOT_FOUND if is_told else {}), seconds)


def getfem(example: int, x: Line, y: Line, clock: Clock) -> Outcome:
    """Run GetFEM in a process of its own; its first run is as fast as any other."""
    reference = reference_of(example)
    request = {
        "example": example,
        "degree": x.degree,
        "x": x.ends.tolist(),
        "y": y.ends.tolist(),
        "points": reference.places[0].s.tolist(),
        "clock": clock.__name__,
    }
    command = [GETFEM_PYTHON, str(Path(__file__).with_name("getfem_peer.py"))]
    answered = subprocess.run(command, input=json.dumps(request), capture_output=True, text=True, check=True)
    found = json.loads(answered.stdout.splitlines()[-1])
    fields = {name: np.array(found[name]) for name in FIELDS}
    answer = SampledFields(
        **fields, energy=found["energy"], force_normal=np.nan, force_tangential=found["force"], zones=()
    )
    return Outcome(errors_of(answer, reference), found["seconds"])


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
)
# degree, layers at transitions, layers at corners and jumps, factor from layer to layer
LAYERED = (
    (3, 2, 1, 0.17),
    (3, 3, 1, 0.3),
    (4, 3, 1, 0.17),
    (4, 4, 2, 0.3),
    (5, 3, 2, 0.17),
    (5, 4, 2, 0.17),
    (5, 5, 2, 0.25),
    (6, 4, 2, 0.25),
    (6, 5, 2, 0.17),
    (7, 5, 2, 0.25),
    (7, 6, 2, 0.25),
    (8, 6, 2, 0.25),
    (9, 6, 2, 0.25),
    (10, 6, 2, 0.25),
)
# degree and layers of the meshes that find the transitions; those of a lower degree than the last mesh are used
LOOKS = ((3, 2, 1, 0.17), (5, 4, 1, 0.17), (7, 5, 1, 0.25))
FIRST_LOOK = (3, 12, 8, 2.5)
# degree, equal elements on each piece, layers at corners and jumps, layers at transitions
TOLD = (
    (2, 2, 0, 1),
    (3, 1, 0, 1),
    (3, 2, 0, 1),
    (4, 1, 0, 1),
    (4, 2, 0, 2),
    (5, 2, 0, 1),
    (5, 1, 1, 1),
    (2, 2, 1, 2),
    (3, 2, 1, 2),
    (4, 2, 1, 2),
    (4, 2, 1, 3),
    (5, 2, 1, 3),
    (6, 2, 1, 3),
    (6, 2, 1, 4),
    (7, 2, 1, 4),
    (8, 2, 1, 4),
    (8, 2, 1, 5),
    (9, 2, 1, 5),
    (10, 2, 1, 5),
)
GETFEM_UNIFORM = (20, 40, 80)
GETFEM_SLOW = (160, 320)
GETFEM_GRADED = ((16, 10), (24, 14), (32, 20), (40, 26), (48, 32), (64, 32))
GETFEM_LAYERED = ((3, 3, 1, 0.3), (3, 4, 2, 0.3), (4, 4, 2, 0.3))  # steeper layers do worse


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


def layered_lines(
    example: int, transitions: Sequence[float], degree: int, n_layers: int, n_others: int, factor: float
) -> tuple[Line, Line]:
    """Return lines in layers towards transitions (`n_layers`), and towards corners and jumps (`n_others`)."""
    jumps_x, jumps_y = JUMPS[example]
    layers_x = dict.fromkeys((0.0, *jumps_x), n_others) | dict.fromkeys(transitions, n_layers) | {WIDTH[example]: 0}
    layers_y = {0.0: n_layers, 0.5: n_others if jumps_y else 0, 1.0: n_others}
    x, y = (dict(sorted(layers.items())) for layers in (layers_x, layers_y))
    return (
        layered_line(list(x), list(x.values()), degree, factor),
        layered_line(list(y), list(y.values()), degree, factor),
    )


def follow_graded(
    scene: bk.Scene, example: int, degree: int, n_x: int, n_y: int, exponent: float
) -> FiniteElementSolution:
    """Find the transitions on two coarser meshes before the last one is graded towards them."""
    places: list[float] = []
    for share in (0.4, 0.6, 1.0):
        lines = graded_lines(example, places, degree, round(share * n_x), round(share * n_y), exponent)
        solution = solve_scene(scene, *lines)
        places = [transition.x for transition in solution.transitions]
    return solution


def follow_layered(scene: bk.Scene, example: int, *last: float) -> FiniteElementSolution:
    """Find the transitions on coarser meshes of lower degrees before the last one has layers towards them."""
    solution = solve_scene(scene, *graded_lines(example, (), *FIRST_LOOK))
    for look in (*(look for look in LOOKS if look[0] < last[0]), last):
        places = [transition.x for transition in solution.transitions]
        solution = solve_scene(scene, *layered_lines(example, places, *look))
    return solution


def ladders(example: int, with_getfem: bool, with_slow: bool, clock: Clock) -> dict[str, list[Setting]]:
    """Return the settings of all peers by name."""
    places = places_of(example)
    result: dict[str, list[Setting]] = {"uniform": [], "graded, told": [], "graded, finding": []}

    def add(name: str, words: str, solve: Callable[[bk.Scene], FiniteElementSolution], is_told: bool = False) -> None:
        result[name].append(Setting(words, partial(finite_elements, example, solve, clock, is_told)))

    for n_cells in UNIFORM + (UNIFORM_SLOW if with_slow else ()):
        x, y = uniform_lines(example, n_cells)
        add("uniform", f"Q2, {n_cells} cells", partial(solve_scene, x=x, y=y))
    for grades, lines_of, follow in ((GRADED, graded_lines, follow_graded), (LAYERED, layered_lines, follow_layered)):
        for grade in grades:
            x, y = lines_of(example, places, *grade)
            words = f"Q{x.degree}, {x.half.size} x {y.half.size}, {grade[-1]}"
            add("graded, told", words, partial(solve_scene, x=x, y=y), is_told=True)
            add("graded, finding", words, lambda scene, follow=follow, grade=grade: follow(scene, example, *grade))
    result["bemkit, told"] = [
        Setting(
            f"degree {degree}, {n_even} equal, {n_others} and {n_layers} layers",
            partial(bemkit_told, example, degree, n_even, n_others, n_layers, clock),
        )
        for degree, n_even, n_others, n_layers in TOLD
    ]
    if with_getfem:
        uniform = [uniform_lines(example, n) for n in GETFEM_UNIFORM + (GETFEM_SLOW if with_slow else ())]
        told = [graded_lines(example, places, 2, n_x, n_y, 2.5) for n_x, n_y in GETFEM_GRADED]
        told += [layered_lines(example, places, *grade) for grade in GETFEM_LAYERED]
        for name, meshes in (("GetFEM uniform", uniform), ("GetFEM told", told)):
            result[name] = [
                Setting(f"Q{x.degree}, {x.half.size} x {y.half.size}", partial(getfem, example, x, y, clock))
                for x, y in meshes
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


def compare(
    example: int,
    target: Target,
    climbed: dict[str, list[tuple[Setting, Outcome]]],
    repetitions: int,
    clock: Clock,
) -> Table:
    """Return a table with a row for every peer."""
    columns = ("code", "mesh", "reached", "median [ms]", "ratio")
    table = Table(title=f"paper-{example}: {target.words}", title_justify="left")
    for column in columns:
        table.add_column(column, justify="left" if column in ("code", "mesh") else "right")
    runs = {**climbed, "bemkit": climb([_from_scratch(example, choice, clock) for choice in target.choices])}
    met = {
        name: next(((setting, got) for setting, got in outcomes if target.is_met_by(got.errors)), None)
        for name, outcomes in runs.items()
    }
    medians = in_turn({name: pair for name, pair in met.items() if pair is not None}, repetitions)
    for name, pair in met.items():
        if pair is None:
            table.add_row(name, "none of its meshes", "", "", "")
            continue
        setting, outcome = pair
        reached = ", ".join(f"{outcome.errors[key]:.1e}" for key in target.errors)
        ratio = f"{medians[name] / medians['bemkit']:.2g}" if "bemkit" in medians else ""
        table.add_row(name, setting.words, reached, f"{1e3 * medians[name]:.0f}", ratio)
    return table


def _from_scratch(example: int, choice: Choice, clock: Clock) -> Setting:
    scene = choice.scene(example)
    solution = bk.run(scene)
    words = f"degree {degree_of(solution)}, {solution.mesh.n_elements}"
    return Setting(words, partial(bemkit, example, scene, clock))


@click.command()
@click.option("--slow", is_flag=True, help="Add the largest uniform meshes.")
@click.option("--without-getfem", is_flag=True, help="Leave GetFEM out even if it is installed.")
@click.option("--repetitions", default=7, show_default=True, help="Runs of each setting beyond the first.")
@click.option("--example", type=click.IntRange(1, 2), multiple=True, default=(1, 2), show_default=True)
@click.option("--code", multiple=True, help="Compare bemkit with this code alone, such as 'bemkit, told'; repeatable.")
@click.option("--processor-time", is_flag=True, help="Measure processor time, not wall time.")
def main(
    slow: bool,
    without_getfem: bool,
    repetitions: int,
    example: tuple[int, ...],
    code: tuple[str, ...],
    processor_time: bool,
) -> None:
    """Compare finite elements with bemkit at equal errors."""
    clock = time.process_time if processor_time else time.perf_counter
    console = Console(width=140)
    with_getfem = not without_getfem and has_getfem()
    for number in example:
        settings_by_name = ladders(number, with_getfem, slow, clock)
        climbed = {name: climb(settings_by_name[name]) for name in code or settings_by_name}
        for name, outcomes in climbed.items():
            for setting, got in outcomes:
                errors = "  ".join(f"{key} {value:.1e}" for key, value in got.errors.items())
                console.print(
                    f"paper-{number}  {name}  {setting.words}  {1e3 * got.seconds:.0f} ms  {errors}", style="dim"
                )
        for target in TARGETS:
            console.print(compare(number, target, climbed, repetitions, clock))
    if not with_getfem and not without_getfem:
        console.print(f"GetFEM was left out: {GETFEM_PYTHON} cannot import it (Debian: python3-getfem).")


if __name__ == "__main__":
    main()
