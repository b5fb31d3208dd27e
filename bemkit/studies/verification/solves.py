"""How a case is solved at a resolution."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from types import MappingProxyType
from typing import Any, Literal, TypeAlias

import numpy as np

from bemkit.contact.laws import Coulomb
from bemkit.results.solution import Solution
from bemkit.runs.run import run
from bemkit.runs.steps import UnsolvableSceneError
from bemkit.scene.conditions import PrescribedDisplacement
from bemkit.scene.mesh_options import MeshOptions
from bemkit.scene.scene import Scene
from bemkit.scene.steps import Step
from bemkit.scene.toml import with_overrides

Solve: TypeAlias = Callable[[float], Solution]


def at_resolution(scene: Scene, degree: Literal["hp"] | None = None) -> Solve:
    """Return what solves a scene with a number of elements, or to an accuracy, which is less than one."""

    def solve(resolution: float) -> Any:
        if resolution < 1.0:
            return run(with_overrides(scene, accuracy=resolution, degree=degree))
        return run(with_overrides(scene, elements=int(resolution)))

    return solve


def _unmatched(scene: Scene) -> Solve:
    """Divide the second body into 1.7 times as many elements as the first."""

    def solve(n: float) -> Any:
        meshes = (MeshOptions(elements=int(n)), MeshOptions(elements=int(1.7 * n)))
        bodies = tuple(replace(body, mesh=mesh) for body, mesh in zip(scene.bodies, meshes, strict=True))
        return run(replace(scene, bodies=bodies))

    return solve


def _pressed_then_sheared(scene: Scene) -> Solve:
    """Push the upper one of two cylinders down, then to the side, on the meshes that suit the end."""
    scene = replace(scene, law=Coulomb(0.5))

    def under(shift: float) -> Scene:
        upper, lower = scene.bodies
        pushed = replace(upper.parts[0], condition=PrescribedDisplacement(shift, -0.0022))
        return replace(scene, bodies=(replace(upper, parts=(pushed, *upper.parts[1:])), lower))

    def solve(accuracy: float) -> Any:
        fitted = run(with_overrides(under(0.0008), accuracy=accuracy))
        meshes = {name: body.mesh for name, body in fitted.bodies.items()}
        steps = [with_overrides(under(shift), elements=100) for shift in (0.0, 0.0008)]
        return run(steps, mesh=meshes)[-1]

    return solve


def _growing(scene: Scene) -> Solve:
    """Let the load grow in a number of steps, so that the half-width grows equally in each."""
    return lambda n: run(replace(scene, load_factors=tuple((np.arange(1.0, n + 1.0) / n) ** 2)))


def _to_and_fro(scene: Scene, loads: Mapping[str, float], n_quarter: int) -> Scene:
    """Return a scene whose loads, at their keys, grow and go to and fro once after a first step without them."""

    def changes(shape: str) -> dict[str, str]:
        return {key: f"{largest!r} * ({shape})" for key, largest in loads.items()}

    times = ((2.0, "t - 1", n_quarter), (4.0, "3 - t", 2 * n_quarter), (6.0, "t - 5", 2 * n_quarter))
    steps = (Step(time, changes(shape), increments=n) for time, shape, n in times)
    return replace(scene, steps=(Step(1.0), *steps))


def _sheared_to_and_fro(scene: Scene) -> Solve:
    """Take a number of increments for a quarter of a cycle."""
    return lambda n: run(_to_and_fro(scene, {"far.force_x": 0.2}, int(n)))


def _bent_to_and_fro(scene: Scene) -> Solve:
    loads = {f"bodies.{name}.parts.tip.condition.y": 4e-5 for name in ("lower", "upper")}
    return at_resolution(_to_and_fro(scene, loads, 2))


def _least_friction(scene: Scene) -> Solve:
    """Halve a range of the friction coefficient until the arch is known to fall just below the one that is returned."""

    def solve(n: float) -> Solution:
        known: Solution | None = None
        least, most = 0.3, 0.33
        while most - least > 3e-5 or known is None:
            friction = 0.5 * (least + most)
            try:
                known = run(replace(with_overrides(scene, elements=int(n)), law=Coulomb(friction)))
                most = friction
            except UnsolvableSceneError:
                least = friction
        return known

    return solve


SOLVES: Mapping[str, Callable[[Any], Solve]] = MappingProxyType(
    {
        "pair-patch": _unmatched,
        "cattaneo-mindlin": _pressed_then_sheared,
        "growing-cylinder": _growing,
        "mindlin-cycle": _sheared_to_and_fro,
        "stacked-cantilevers": _bent_to_and_fro,
        "friction-limit-of-an-arch": _least_friction,
    }
)
"""By the names of cases, those that `at_resolution` does not solve."""
