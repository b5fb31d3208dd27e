"""Stresses inside a block, from series of clusters of elements beside all pairs of points and elements.

    python benchmarks/interior.py [--points M] [N ...]

For each number of linear elements N (default 1000 10000 100000) it prints processor seconds: to find which of M points
(default 100 000), all over the block, are inside; to make the series; for the stresses there; for those of M
points a third of an element length from a side; and for those of all pairs, measured on some of the points and
scaled to all. Stresses of both ways are apart by the last column, relative to the largest one.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable

import numpy as np
from rich.console import Console
from rich.table import Table

import bemkit as bk
from bemkit.arrays import FloatArray
from bemkit.geometry import Rectangle, discretise
from bemkit.geometry.spaces import ConstantSpace, LinearSpace, dof_points
from bemkit.operators.somigliana import fields as inner_fields
from bemkit.operators.somigliana.fields import InteriorFields

PAIRS = 10_000_000
"""Pairs of a point and an element that are integrated to measure the time of all."""


def seconds(work: Callable[[], FloatArray]) -> tuple[FloatArray, float]:
    """Return what a function returns, and its processor seconds."""
    begin = time.process_time()
    result = work()
    return result, time.process_time() - begin


def row(n_elements: int, n_points: int) -> list[str]:
    """Measure one number of elements."""
    mesh = discretise(Rectangle(2.0, 1.0).outline(), n_elements=n_elements)
    space, tractions = LinearSpace(mesh), ConstantSpace(mesh)
    x, y = dof_points(space), dof_points(tractions)
    displacement = np.column_stack([np.sin(x[:, 0] + 2.0 * x[:, 1]), np.cos(1.0 - 2.0 * x[:, 0] * x[:, 1])])
    traction = np.column_stack([np.sin(3.0 * y[:, 0]), y[:, 1]])
    fields = InteriorFields(mesh, bk.Material(2.0, 0.3), space, displacement, tractions, traction)
    rng = np.random.default_rng(0)
    points = rng.uniform(0.0, 1.0, (n_points, 2)) * [2.0, 1.0]
    beside = np.column_stack([rng.uniform(0.1, 1.9, n_points), np.full(n_points, 2.0 / n_elements)])
    is_inside, locating = seconds(lambda: fields.is_inside(points))
    points = points[is_inside.astype(bool)]
    few = points[: 2 * inner_fields.FEW_POINTS]
    _, series = seconds(lambda: fields.stress(few))
    stress, spread = seconds(lambda: fields.stress(points))
    _, near = seconds(lambda: fields.stress(beside))
    n_some = max(10, PAIRS // n_elements)
    inner_fields.MOST_ELEMENTS, limit = n_elements, inner_fields.MOST_ELEMENTS
    exact, dense = seconds(lambda: fields.stress(points[:n_some]))
    inner_fields.MOST_ELEMENTS = limit
    apart = np.abs(exact - stress[:n_some]).max() / np.abs(exact).max()
    times = (locating, series, spread, near, dense * n_points / n_some)
    return [str(n_elements), *(f"{each:.3g}" for each in times), f"{apart:.0e}"]


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser()
    parser.add_argument("n", nargs="*", type=int, default=[1000, 10_000, 100_000])
    parser.add_argument("--points", type=int, default=100_000)
    options = parser.parse_args()
    table = Table("elements", "inside", "series", "stresses", "beside the boundary", "all pairs", "apart")
    for n in options.n:
        table.add_row(*row(n, options.points))
    Console().print(table)


if __name__ == "__main__":
    main()
