"""How a case is solved at a resolution."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from types import MappingProxyType
from typing import Any, Literal, TypeAlias

import numpy as np

from bemkit.contact.laws import Coulomb
from bemkit.results.assembly_solution import AssemblySolution
from bemkit.results.solution import Solution
from bemkit.runs.assembly import run_assembly_history
from bemkit.runs.run import run
from bemkit.scene.assembly import Assembly
from bemkit.scene.conditions import PrescribedDisplacement
from bemkit.scene.mesh_options import MeshOptions
from bemkit.scene.scene import Scene
from bemkit.scene.toml import with_overrides

Solve: TypeAlias = Callable[[float], Solution | AssemblySolution]


def at_resolution(scene: Scene | Assembly, degree: Literal["hp"] | None = None) -> Solve:
    """Return what solves a scene with a number of elements, or to an accuracy, which is less than one."""

    def solve(resolution: float) -> Solution | AssemblySolution:
        if resolution < 1.0:
            return run(with_overrides(scene, accuracy=resolution, degree=degree))
        return run(with_overrides(scene, elements=int(resolution)))

    return solve


def _unmatched(scene: Assembly) -> Solve:
    """Divide the second body into 1.7 times as many elements as the first."""

    def solve(n: float) -> AssemblySolution:
        meshes = (MeshOptions(elements=int(n)), MeshOptions(elements=int(1.7 * n)))
        bodies = tuple(replace(body, mesh=mesh) for body, mesh in zip(scene.bodies, meshes, strict=True))
        return run(replace(scene, bodies=bodies))

    return solve


def _pressed_then_sheared(scene: Assembly) -> Solve:
    """Push the upper one of two cylinders down, then to the side, on the meshes that suit the end."""
    scene = replace(scene, law=Coulomb(0.5))

    def under(shift: float) -> Assembly:
        upper, lower = scene.bodies
        pushed = replace(upper.parts[0], condition=PrescribedDisplacement(shift, -0.0022))
        return replace(scene, bodies=(replace(upper, parts=(pushed, *upper.parts[1:])), lower))

    def solve(accuracy: float) -> AssemblySolution:
        fitted = run(with_overrides(under(0.0008), accuracy=accuracy))
        meshes = {name: body.mesh for name, body in fitted.bodies.items()}
        steps = [with_overrides(under(shift), elements=100) for shift in (0.0, 0.0008)]
        return run_assembly_history(steps, meshes=meshes)[-1]

    return solve


def _growing(scene: Scene) -> Solve:
    """Let the load grow in a number of steps, so that the half-width grows equally in each."""
    return lambda n: run(replace(scene, load_factors=tuple((np.arange(1.0, n + 1.0) / n) ** 2)))


SOLVES: Mapping[str, Callable[[Any], Solve]] = MappingProxyType(
    {"pair-patch": _unmatched, "cattaneo-mindlin": _pressed_then_sheared, "growing-cylinder": _growing}
)
"""By the names of cases, those that `at_resolution` does not solve."""
