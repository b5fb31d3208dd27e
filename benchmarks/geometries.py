"""Compressed equations of bodies of many shapes: ranks, times, memory and residuals.

    python benchmarks/geometries.py [--elements N] [NAME ...]

For each body (default: all, with about 4000 elements) it prints the processor seconds of compressing and of the first
factorisation, memory, the largest rank, and the residual of the boundary equations, all integrals in closed form and
none compressed, by the largest displacement; then status, contact steps and the largest violation of the whole run.
"""

from __future__ import annotations

import argparse
import math
import time
from dataclasses import dataclass, replace

import numpy as np
from rich.console import Console
from rich.table import Table

import bemkit as bk
from bemkit.contact.body import stick
from bemkit.contact.contact_nodes import opened
from bemkit.contact.hierarchical_body import hierarchical_body
from bemkit.geometry.outline import Outline
from bemkit.model.prepared import prepare
from bemkit.operators.collocation import compiled
from bemkit.operators.hierarchy.factor import Factor
from bemkit.operators.steklov_poincare.hierarchical import HierarchicalCollocation
from bemkit.threads import blas_threads_for
from benchmarks.large import largest_rank, n_bytes
from tests.scenes import Perforated

FLOOR = bk.RigidHalfPlane((0.0, 0.0), (0.0, 1.0))


def pressed(title: str, shape: object, **changes: object) -> bk.Scene:
    """Return a body that is pressed on a floor with friction by a load on its upper side."""
    parts = (
        bk.Part("floor", bk.Contact(FLOOR), sides=("bottom",)),
        bk.Part("press", bk.Traction(x=0.02, y=-0.1), sides=("top",)),
    )
    given = {"parts": parts, "discretisation": bk.ConstantCollocation(), "linear_solver": bk.Hierarchical()} | changes
    return bk.Scene(title=title, shape=shape, material=bk.Material(100.0, 0.3), law=bk.Coulomb(0.4), **given)  # type: ignore[arg-type]


@dataclass(frozen=True)
class Gear:
    """A wheel with straight-sided teeth around a shaft, which stands on the tips of two of them."""

    n_teeth: int = 40
    root: float = 0.9

    def outline(self) -> Outline:
        """Return four sides for each tooth, and the bore."""
        step = 2.0 * math.pi / self.n_teeth
        angles, radii = np.array([-0.3, -0.15, 0.15, 0.3]) * step, [self.root, 1.0, 1.0, self.root]
        corners = [
            (radius * math.sin(k * step + angle), -radius * math.cos(k * step + angle))
            for k in range(self.n_teeth)
            for angle, radius in zip(angles, radii, strict=True)
        ]
        outer = bk.Polygon(tuple(corners)).outline().loops
        return Outline((*outer, *bk.Ring(0.3, 0.95).outline().loops[1:]))


def gear() -> bk.Scene:
    """The gear pressed by its shaft on a floor under its lowest tooth."""
    wheel = Gear()
    shaft = tuple(side.name for side in wheel.outline().loops[1])
    below = -math.cos(0.15 * 2.0 * math.pi / wheel.n_teeth)
    parts = (
        bk.Part("tooth", bk.Contact(bk.RigidHalfPlane((0.0, below), (0.0, 1.0))), sides=("side-2",)),
        bk.Part("shaft", bk.PrescribedDisplacement(x=2e-4, y=-1e-3), sides=shaft),
    )
    return pressed("gear with 40 teeth", wheel, parts=parts)


def perforated(n_x: int, n_y: int) -> bk.Scene:
    """A plate with rows of holes."""
    scene = pressed(f"plate with {n_x * n_y} holes", Perforated(n_x, n_y))
    floor = bk.Contact(bk.RigidHalfPlane((0.0, -1.0), (0.0, 1.0)))
    return replace(scene, parts=(replace(scene.parts[0], condition=floor), scene.parts[1]))


def graded() -> bk.Scene:
    """A square with elements that shrink towards its corners by a factor of 1e8."""
    scene = pressed("square, elements 1 : 1e8", bk.Rectangle(1.0, 1.0))
    return replace(scene, mesh=bk.MeshOptions(grading=bk.Geometric(0.5, 27)))


SCENES = {
    "strip-10": pressed("strip 10 : 1", bk.Rectangle(10.0, 1.0)),
    "strip-100": pressed("strip 100 : 1", bk.Rectangle(100.0, 1.0)),
    "strip-1000": pressed("strip 1000 : 1", bk.Rectangle(1000.0, 1.0)),
    "graded": graded(),
    "gear": gear(),
    "holes-40": perforated(8, 5),
}


@dataclass(frozen=True)
class Row:
    """What a body takes: seconds of processors and bytes; its rank, residual and result."""

    title: str
    n_elements: int
    build: float
    factor: float
    n_bytes: int
    rank: int
    residual: float
    result: str
    n_steps: int
    worst: float


def row_of(scene: bk.Scene, n_elements: int) -> Row:
    """Measure one body."""
    scene = replace(scene, mesh=replace(scene.mesh, elements=n_elements))
    given = prepare(scene, scene.build_mesh())
    nodes, gap = given.contact_nodes, given.column("gap")
    conditions = opened(given.only.conditions, nodes)
    with blas_threads_for(1):
        clock = time.process_time()
        elastic = HierarchicalCollocation(given.only.own_space.mesh, given.material_of(given.only), bk.Hierarchical())
        body = hierarchical_body(elastic, conditions, nodes, given.only.force)
        build = time.process_time() - clock
        clock = time.process_time()
        state = body.respond(stick(gap / given.units.displacement, np.zeros(body.n_contact)))
        response = time.process_time() - clock
        residual = body.imbalance(state).worst
    factor = body.loaded.system.factor
    assert isinstance(factor, Factor)
    skeletons = factor.compression.skeletons
    memory, rank = n_bytes((factor._levels, skeletons)), largest_rank(factor.compression)
    del body, factor
    solution = bk.run(replace(scene, linear_solver=bk.Hierarchical()))
    return Row(
        scene.title, given.only.own_space.mesh.n_elements, build, response, memory, rank, residual,
        solution.status.name, solution.outer_steps, solution.certificate.worst,
    )  # fmt: skip


def table_of(rows: list[Row]) -> Table:
    """Return what was measured."""
    table = Table(title=f"kernels in {'numba' if compiled.is_installed() else 'numpy'}; CPU seconds")
    for column in ("body", "N", "build", "factor", "GB", "rank", "residual", "result", "steps", "worst"):
        table.add_column(column, justify="left" if column in ("body", "result") else "right")
    for row in rows:
        table.add_row(
            row.title, str(row.n_elements), f"{row.build:.1f}", f"{row.factor:.2f}", f"{row.n_bytes / 1e9:.3f}",
            str(row.rank), f"{row.residual:.0e}", row.result, str(row.n_steps), f"{row.worst:.0e}",
        )  # fmt: skip
    return table


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("names", nargs="*", metavar="NAME", help=", ".join(SCENES))
    parser.add_argument("--elements", type=int, default=4000)
    options = parser.parse_args()
    compiled.loaded()  # compiles now, not within a measurement
    console, rows = Console(width=140), []
    for name in options.names or SCENES:
        rows.append(row_of(SCENES[name], options.elements))
        console.print(table_of(rows[-1:]))
    console.print(table_of(rows))


if __name__ == "__main__":
    main()
