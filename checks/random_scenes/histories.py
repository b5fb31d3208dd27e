"""Random load histories: press, shear, reverse, unload."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from bemkit.scene.conditions import Part, PrescribedDisplacement, Pressure, Traction
from bemkit.scene.scene import Scene
from bemkit.scene.steps import Step
from checks.random_scenes.draw import Draw


def pressed_and_sheared(seed: int, index: int, scene: Scene) -> tuple[Scene, ...]:
    """Return a scene now and then with a load history, drawn by numbers of its own; nothing of all others.

    The load comes, a part is sheared to one side and to the other, and the load goes, for a part or as a whole.
    """
    draw = Draw(np.random.PCG64([seed, index, 2]))
    place_and_size = next((found for part in scene.parts if (found := shear_of(part))), None)
    is_taken = scene.mesh.accuracy is not None or scene.symmetry is not None or scene.load_factors != (1.0,)
    if is_taken or place_and_size is None or not scene.contact_parts or not draw.chance(0.12):
        return ()
    return (replace(scene, steps=sheared_steps(draw, *place_and_size)),)


def sheared_steps(draw: Draw, place: str, size: float) -> tuple[Step, ...]:
    """Return steps that press, shear one way and the other, and let go, by the place that shears and its size."""
    shear = size * draw.decades(-1.5, 0.3)
    increments = int(draw.integers(1, 5))
    left = draw.one_of((0.0, 0.3, 0.7))
    return (
        Step(1.0, load_factor="t", increments=int(draw.integers(1, 4))),
        Step(2.0, {place: f"{shear!r} * (t - 1)"}, load_factor=1.0, increments=increments),
        Step(4.0, {place: f"{shear!r} * (3 - t)"}, increments=2 * increments),
        Step(5.0, {place: -shear}, load_factor=f"1 + (t - 4) * ({left!r} - 1)", increments=increments),
    )


def shear_of(part: Part) -> tuple[str, float] | None:
    """Return the place of a component that shears a part which is loaded by a number, and the size of its load."""
    match part.condition:
        case Traction(x, float(y)) if isinstance(x, float) and y:
            return f'parts."{part.name}".condition.x', abs(y)
        case Pressure(float(pressure), _) if pressure:
            return f'parts."{part.name}".condition.shear', abs(pressure)
        case PrescribedDisplacement(float(), float(y)) if y:
            return f'parts."{part.name}".condition.x', abs(y)
    return None
