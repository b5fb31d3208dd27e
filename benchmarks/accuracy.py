"""Error against run time on the paper's examples, for the targets of the project.

    python benchmarks/accuracy.py [--repetitions N] [--ratios] [--processor-time]

Each line is the fastest of some runs that reach a target, from the scene to the solution in a warm process: mesh,
assembly, all levels, recovery. Times are the least and the median of the repetitions, the least also as a multiple of
one LAPACK LU of order 640 measured between them. Errors are those of `bemkit.reference.errors_of`; they are a
precondition of the timing. With `--ratios`: rising degrees on Example 1, as ratios to adaptive quadratic elements that
reach 1e-4. With `--processor-time` on a busy machine, best on one core (`taskset -c 0`).
"""

from __future__ import annotations

import statistics
import sys
import time
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import click
import numpy as np
from rich.console import Console
from rich.table import Table
from scipy.linalg.lapack import dgetrf
from threadpoolctl import threadpool_limits

import bemkit as bk
from bemkit.reference import Reference, errors_of, find_reference, sampled_fields

sys.path.insert(0, str(Path(__file__).parents[2]))
from tests.scenes import paper

Clock = Callable[[], float]


@dataclass(frozen=True)
class Choice:
    """A discretisation and its mesh; an accuracy, or a grading that knows nothing of the solution."""

    mesh: bk.MeshOptions
    discretisation: bk.Galerkin

    def scene(self, example: int) -> bk.Scene:
        """Return one of the paper's examples."""
        return paper(example, self.discretisation, self.mesh)


@dataclass(frozen=True)
class Target:
    """Errors to reach, by the names of `bemkit.reference.MEASURES`, within some seconds, and the runs that may."""

    errors: dict[str, float]
    seconds: float
    choices: tuple[Choice, ...]

    def is_met_by(self, errors: Mapping[str, float]) -> bool:
        """Tell whether no error is larger than wanted."""
        return all(errors[name] <= wanted for name, wanted in self.errors.items())

    @property
    def words(self) -> str:
        """The wanted errors in words."""
        return ", ".join(f"{name} {wanted:.0e}" for name, wanted in self.errors.items())


def by_accuracy(discretisation: bk.Galerkin | None, *accuracies: float) -> tuple[Choice, ...]:
    """Return runs that follow accuracies, with degrees that rise if none is given."""
    rises = discretisation is None
    options = (bk.MeshOptions(accuracy=accuracy, rising_degrees=rises) for accuracy in accuracies)
    return tuple(Choice(mesh, discretisation or bk.Galerkin(2)) for mesh in options)


LINEAR, QUADRATIC, HP = bk.Galerkin(1), bk.Galerkin(2), None
FIRST_LOOK = Choice(bk.MeshOptions(elements=36, density={"bottom": 6.0}, grading=bk.Algebraic(1.2)), QUADRATIC)
TARGETS = (
    Target({"sigma_n": 1e-2}, 0.02, (FIRST_LOOK, *by_accuracy(HP, 3e-2))),
    Target(
        {"sigma_n": 1e-3, "sigma_t": 4e-3},
        0.15,
        by_accuracy(LINEAR, 4e-3) + by_accuracy(QUADRATIC, 4e-3) + by_accuracy(HP, 3e-2, 2e-3, 1e-3),
    ),
    Target(
        {"force_tangential": 1e-5, "energy": 1e-5},
        0.3,
        by_accuracy(QUADRATIC, 3e-3, 1e-3) + by_accuracy(HP, 3e-2, 2e-3),
    ),
    Target(
        {"sigma_n": 3e-5, "displacement": 1e-5}, 0.6, by_accuracy(QUADRATIC, 6e-5) + by_accuracy(HP, 1e-4, 6e-5, 3e-5)
    ),
    Target({"transitions": 1e-5}, 1.0, by_accuracy(QUADRATIC, 1e-3, 3e-4) + by_accuracy(HP, 1e-4, 6e-5, 3e-5)),
    Target({"sigma_n": 1e-5, "sigma_t": 4e-5}, 0.12, by_accuracy(HP, 3e-5, 2e-5, 1e-5, 7e-6, 5e-6)),
    Target({"sigma_n": 1e-6, "sigma_t": 4e-6}, 0.35, by_accuracy(HP, 5e-6, 3e-6, 2e-6, 1e-6)),
)
RATIOS = {1e-3: 1.0 / 7.0, 1e-5: 1.0 / 3.0, 1e-6: 1.0, 1e-7: 3.0}
"""Times allowed to rising degrees on Example 1 for errors of sigma_n, in times of quadratic elements for `STANDARD`."""
STANDARD = 1e-4


@lru_cache
def reference_of(example: int) -> Reference:
    """Return what an example is measured against: rising degrees on meshes in layers, by bemkit itself."""
    reference = find_reference(paper(example))
    assert reference is not None
    return reference


def measured_errors(solution: bk.Solution, example: int) -> dict[str, float]:
    """Return all errors of a solution by bemkit that a target may name."""
    reference = reference_of(example)
    return errors_of(sampled_fields(solution, reference.places), reference)


def time_once(work: Callable[[], object], clock: Clock = time.perf_counter) -> float:
    """Seconds of one call."""
    begin = clock()
    work()
    return clock() - begin


def fastest(example: int, choices: Iterable[Choice], target: Target, clock: Clock) -> tuple[Choice, bk.Solution] | None:
    """Return the fastest choice that meets a target, and its solution."""
    found = []
    for choice in choices:
        scene = choice.scene(example)
        solution = bk.run(scene)  # warms up
        if target.is_met_by(measured_errors(solution, example)):
            found.append((min(time_once(lambda s=scene: bk.run(s), clock) for _ in range(2)), choice, solution))
    return min(found, key=lambda item: item[0])[1:] if found else None


def print_targets(console: Console, repetitions: int, clock: Clock) -> None:
    """Print a line for each example and target."""
    matrix = np.asfortranarray(np.random.default_rng(1).standard_normal((640, 640)))
    table = Table(title="Error against run time")
    columns = ("example", "wanted", "reached", "degree", "elements", "allowed [ms]", "least [ms]", "median [ms]", "LUs")
    for column in (*columns, ""):
        table.add_column(column, justify="right")
    for example in (1, 2):
        for target in TARGETS:
            found = fastest(example, target.choices, target, clock)
            if found is None:
                table.add_row(f"paper-{example}", target.words, *[""] * 7, "MISSED")
                continue
            choice, solution = found
            errors, scene = measured_errors(solution, example), choice.scene(example)
            times, lu = [], []
            for _ in range(repetitions):
                times.append(time_once(lambda s=scene: bk.run(s), clock))
                with threadpool_limits(limits=1, user_api="blas"):
                    lu.append(time_once(lambda: dgetrf(matrix), clock))
            table.add_row(
                f"paper-{example}",
                target.words,
                ", ".join(f"{errors[name]:.1e}" for name in target.errors),
                degree_of(solution),
                str(solution.mesh.n_elements),
                f"{1e3 * target.seconds:.0f}",
                f"{1e3 * min(times):.0f}",
                f"{1e3 * statistics.median(times):.0f}",
                f"{min(times) / min(lu):.1f}",
                "met" if min(times) <= target.seconds else "MISSED",
            )
    console.print(table)


def degree_of(solution: bk.Solution) -> str:
    """Return the degree of the elements of a solution."""
    return str(solution.scene.discretisation.displacement_space(solution.mesh).degree)


def print_ratios(console: Console, repetitions: int, clock: Clock) -> None:
    """Print the times of rising degrees on Example 1 over that of quadratic elements, measured in turn."""
    standard = Target({"sigma_n": STANDARD}, 0.0, by_accuracy(QUADRATIC, 1e-3, 7e-4, 5e-4, 3e-4, 1e-4))
    wanted = [standard]
    for error in RATIOS:
        wanted.append(Target({"sigma_n": error}, 0.0, by_accuracy(HP, 10 * error, 5 * error, 2 * error, error)))
    found = [fastest(1, target.choices, target, clock) for target in wanted]
    times: list[list[float]] = [[] for _ in wanted]
    for _ in range(repetitions):
        for pair, own in zip(found, times, strict=True):
            if pair is not None:
                own.append(time_once(lambda p=pair: bk.run(p[0].scene(1)), clock))
    table = Table(title="Example 1 from scratch: rising degrees over adaptive quadratic elements")
    for column in (
        "wanted",
        "accuracy",
        "reached",
        "transitions",
        "degree",
        "elements",
        "median [ms]",
        "ratio",
        "allowed",
    ):
        table.add_column(column, justify="right")
    for target, pair, own, allowed in zip(wanted, found, times, (None, *RATIOS.values()), strict=True):
        if pair is None or not times[0]:
            table.add_row(target.words, *[""] * 6, "MISSED")
            continue
        choice, solution = pair
        errors = measured_errors(solution, 1)
        table.add_row(
            target.words,
            f"{choice.mesh.accuracy:.0e}",
            f"{errors['sigma_n']:.1e}",
            f"{errors['transitions']:.1e}",
            degree_of(solution),
            str(solution.mesh.n_elements),
            f"{1e3 * statistics.median(own):.0f}",
            f"{statistics.median(own) / statistics.median(times[0]):.2f}",
            "" if allowed is None else f"{allowed:.2f}",
        )
    console.print(table)


@click.command()
@click.option("--repetitions", default=7, show_default=True, help="Timed runs of each line.")
@click.option(
    "--ratios", is_flag=True, help="Rising degrees over quadratic elements on Example 1 instead of the targets."
)
@click.option("--processor-time", is_flag=True, help="Measure processor time, not wall time.")
def main(repetitions: int, ratios: bool, processor_time: bool) -> None:
    """Measure and print."""
    clock = time.process_time if processor_time else time.perf_counter
    (print_ratios if ratios else print_targets)(Console(width=140), repetitions, clock)


if __name__ == "__main__":
    main()
