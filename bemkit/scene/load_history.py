"""Load histories: one scene after the other, with slip counted from the end of the step before.

The static law judges slip by the total displacement, as if the whole load came at once. Real loads grow, and friction
remembers: under the incremental law a point that stuck under the first tenth of the load keeps that place as its new
origin. For a cylinder pressed into a block the two laws differ by a factor of two in the size of the stick zone.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

from bemkit.arrays import FloatArray
from bemkit.formulas import Expression, ScalarField
from bemkit.scene.body_forces import scaled_body_force
from bemkit.scene.conditions import with_fields
from bemkit.scene.scene import Scene


def load_steps(scene: Scene) -> tuple[Scene, ...]:
    """Return the steps of a scene's load history, each a scene of its own with a single load.

    Returns
    -------
    tuple of Scene
        As many as there are load factors.
    """
    if scene.load_factors == (1.0,):
        return (scene,)
    return tuple(with_scaled_loads(scene, factor) for factor in scene.load_factors)


def with_scaled_loads(scene: Scene, factor: float) -> Scene:
    """Return a scene whose loads, prescribed displacements and body forces are multiplied by a number.

    Returns
    -------
    Scene
        With the load factor 1; obstacles, the law, and body forces that are constant are unchanged.
    """

    def scaled(field: ScalarField) -> ScalarField:
        return _times(factor, field)

    parts = tuple(replace(part, condition=with_fields(part.condition, scaled, scaled)) for part in scene.parts)
    forces = tuple(force if force.is_constant else scaled_body_force(force, factor) for force in scene.body_forces)
    return replace(scene, parts=parts, body_forces=forces, load_factors=(1.0,))


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
