"""Error against run time on the paper's examples, for the targets of the project.

    python tests/benchmarks/accuracy.py [REPETITIONS]

Each line is one run from the scene to the solution in a warm process: mesh, assembly, all levels, recovery. Times are
the least and the median of the repetitions, the least also as a multiple of one LAPACK LU of order 640 measured
between them. Errors are relative and taken against the independent reference; they are a precondition of the timing.
"""

from __future__ import annotations

import dataclasses
import statistics
import sys
import time
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console
from rich.table import Table
from scipy.linalg.lapack import dgetrf
from threadpoolctl import threadpool_limits

import bemkit as bk

sys.path.insert(0, str(Path(__file__).parents[2]))
from tests.scenes import contact_values, paper, reference_values, table_error


@dataclasses.dataclass(frozen=True)
class Target:
    """Errors to reach, by name, within some seconds, and the mesh that does it."""

    errors: dict[str, float]
    seconds: float
    mesh: bk.MeshOptions
    discretisation: bk.LinearGalerkin | bk.QuadraticGalerkin = dataclasses.field(default_factory=bk.QuadraticGalerkin)

    def is_met_by(self, errors: Mapping[str, float]) -> bool:
        """Tell whether no error is larger than wanted."""
        return all(errors[name] <= wanted for name, wanted in self.errors.items())

    @property
    def words(self) -> str:
        """The wanted errors in words."""
        return ", ".join(f"{name} {wanted:.0e}" for name, wanted in self.errors.items())


TARGETS = (
    Target({"sigma_n": 1e-2}, 0.02, bk.MeshOptions(elements=36, density={"bottom": 6.0}, grading=bk.Algebraic(1.2))),
    Target({"sigma_n": 1e-3, "sigma_t": 4e-3}, 0.15, bk.MeshOptions(accuracy=4e-3), bk.LinearGalerkin()),
    Target({"sigma_n": 1e-3, "sigma_t": 4e-3}, 0.15, bk.MeshOptions(accuracy=4e-3)),
    Target({"force": 1e-5, "energy": 1e-5}, 0.3, bk.MeshOptions(accuracy=1e-3)),
    Target({"sigma_n": 3e-5, "u": 1e-5}, 0.6, bk.MeshOptions(accuracy=6e-5)),
    Target({"transitions": 1e-5}, 1.0, bk.MeshOptions(accuracy=1e-3)),
)


FIELDS = ("u_n", "u_t", "sigma_n", "sigma_t")


def errors_of(
    example: int, fields: Mapping[str, Any], force: float, energy: float, transitions: Sequence[float]
) -> dict[str, float]:
    """Return all errors that a target may name, of `FIELDS` at the points of the reference and of scalars."""
    values, places = reference_values(example)
    is_complete = len(transitions) == len(places)
    return {
        "sigma_n": table_error(example, {"sigma_n": fields["sigma_n"]}),
        "sigma_t": table_error(example, {"sigma_t": fields["sigma_t"]}),
        "u": table_error(example, {name: fields[name] for name in ("u_n", "u_t")}),
        "force": abs(force / values["Ft"] - 1.0),
        "energy": abs(energy / values["energy"] - 1.0),
        "transitions": float(np.abs(np.subtract(transitions, places)).max()) if is_complete else float("inf"),
    }


def measured_errors(solution: bk.Solution, example: int) -> dict[str, float]:
    """Return all errors of a solution by bemkit."""
    fields = {name: contact_values(solution, example, name) for name in FIELDS}
    places = [transition.x for transition in solution.transitions]
    return errors_of(example, fields, solution.force_tangential, solution.energy, places)


def time_once(work: Callable[[], object]) -> float:
    """Wall time [s] of one call."""
    begin = time.perf_counter()
    work()
    return time.perf_counter() - begin


def main() -> None:
    """Measure and print."""
    repetitions = int(sys.argv[1]) if len(sys.argv) > 1 else 7
    matrix = np.asfortranarray(np.random.default_rng(1).standard_normal((640, 640)))
    table = Table(title="Error against run time")
    for column in (
        "example",
        "wanted",
        "reached",
        "degree",
        "elements",
        "allowed [ms]",
        "least [ms]",
        "median [ms]",
        "LUs",
        "",
    ):
        table.add_column(column, justify="right")
    for example in (1, 2):
        for target in TARGETS:
            scene = paper(example, target.discretisation, target.mesh)
            solution = bk.run(scene)
            errors = measured_errors(solution, example)
            times, lu = [], []
            for _ in range(repetitions):
                times.append(time_once(lambda s=scene: bk.run(s)))
                with threadpool_limits(limits=1, user_api="blas"):
                    lu.append(time_once(lambda: dgetrf(matrix)))
            is_met = min(times) <= target.seconds and target.is_met_by(errors)
            table.add_row(
                f"paper-{example}",
                target.words,
                ", ".join(f"{errors[name]:.1e}" for name in target.errors),
                str(target.discretisation.displacement_space(solution.mesh).degree),
                str(solution.mesh.n_elements),
                f"{1e3 * target.seconds:.0f}",
                f"{1e3 * min(times):.0f}",
                f"{1e3 * statistics.median(times):.0f}",
                f"{min(times) / min(lu):.1f}",
                "met" if is_met else "MISSED",
            )
    Console(width=140).print(table)


if __name__ == "__main__":
    main()
