"""Load histories: one scene after the other, with slip counted from the end of the step before.

The static law judges slip by the total displacement, as if the whole load came at once. Real loads grow, and friction
remembers: under the incremental law a point that stuck under the first tenth of the load keeps that place as its new
origin. For a cylinder pressed into a block the two laws differ by a factor of two in the size of the stick zone.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any, TypeVar

from bemkit.arrays import FloatArray
from bemkit.formulas import Expression, ScalarField
from bemkit.scene.assembly import Assembly
from bemkit.scene.body import Body
from bemkit.scene.body_forces import scaled_body_force
from bemkit.scene.conditions import with_fields
from bemkit.scene.scene import Scene

AnyScene = TypeVar("AnyScene", Scene, Assembly)


def load_steps(scene: AnyScene) -> tuple[AnyScene, ...]:
    """Return the steps of a load history, each a scene or an assembly of its own with a single load.

    Returns
    -------
    tuple of Scene or of Assembly
        As many as there are load factors.
    """
    if scene.load_factors == (1.0,):
        return (scene,)
    return tuple(with_scaled_loads(scene, factor) for factor in scene.load_factors)


def with_scaled_loads(scene: AnyScene, factor: float) -> AnyScene:
    """Return a scene whose loads, prescribed displacements and body forces are multiplied by a number.

    Returns
    -------
    Scene or Assembly
        With the load factor 1; obstacles, gaps, laws, and body forces that are constant are unchanged.
    """
    if isinstance(scene, Assembly):
        known: dict[int, Any] = {}
        bodies = tuple(replace(body, **_scaled(body, factor, known)) for body in scene.bodies)
        rigid = tuple(body.scaled(factor) for body in scene.rigid)
        return replace(scene, bodies=bodies, rigid=rigid, load_factors=(1.0,))
    return replace(scene, **_scaled(scene, factor, {}), load_factors=(1.0,))


def _scaled(loaded: Scene | Body, factor: float, known: dict[int, Any]) -> dict[str, Any]:
    """Return parts and body forces under scaled loads; those without loads are the same objects.

    What several bodies share they share afterwards: `known` holds, by the identity of an object, what became of it.
    """

    def scaled(field: ScalarField) -> ScalarField:
        return _times(factor, field)

    for part in loaded.parts:
        if id(part) not in known:
            condition = with_fields(part.condition, scaled, scaled)
            known[id(part)] = part if condition is part.condition else replace(part, condition=condition)
    for force in loaded.body_forces:
        if id(force) not in known:
            known[id(force)] = force if force.is_constant else scaled_body_force(force, factor)
    return {
        "parts": tuple(known[id(part)] for part in loaded.parts),
        "body_forces": tuple(known[id(force)] for force in loaded.body_forces),
    }


@dataclass(frozen=True)
class _ScaledFunction:
    """A function of the coordinates times a number."""

    function: Callable[[FloatArray, FloatArray], FloatArray]
    factor: float

    def __call__(self, x: FloatArray, y: FloatArray) -> FloatArray:
        return self.factor * self.function(x, y)


def _times(factor: float, value: ScalarField) -> ScalarField:
    if factor == 1.0:
        return value
    if isinstance(value, Expression):
        return Expression(f"{factor!r} * ({value.text})")
    if callable(value):
        return _ScaledFunction(value, factor)
    return factor * value
