"""Random forces and temperatures inside a body."""

from __future__ import annotations

import numpy as np

from bemkit.arrays import FloatArray
from bemkit.formulas import Expression
from bemkit.geometry.shapes import Ring, Shape
from bemkit.geometry.symmetry.lines import Symmetry
from bemkit.scene.body_forces import BodyForce, Gravity, Heating, Rotation
from checks.random_scenes.draw import Draw

_PLACES = np.linspace(0.0, 1.0, 9)


def random_body_forces(
    draw: Draw, shape: Shape, modulus: float, symmetry: Symmetry | None = None
) -> tuple[BodyForce, ...]:
    """Draw up to two of them, symmetric about the lines, with stresses of 1e-7 to 1e-2 of the modulus."""
    points = np.concatenate([side.curve.point(_PLACES) for loop in shape.outline().loops for side in loop])
    low, high = points.min(axis=0), points.max(axis=0)
    size, centre = float(np.hypot(*(high - low))), 0.5 * (low + high)
    forces: list[BodyForce] = []
    for _ in range(draw.one_of((1, 1, 2))):
        strain = draw.decades(-7.0, -2.0)
        density = draw.decades(-3.0, 4.0)
        match draw.one_of(("gravity", "rotation", "heating")):
            case "gravity":
                x, y = (draw.direction() * strain * modulus / size / density).tolist()
                if symmetry is not None:
                    x, y = (0.0 if line is not None else each for line, each in ((symmetry.x, x), (symmetry.y, y)))
                forces.append(Gravity(density, (x, y), draw.chance(0.3)))
            case "rotation":
                beside = draw.between(-1.0, 1.0) * size if symmetry is None and draw.chance(0.5) else 0.0
                place = (float(centre[0]) + beside, float(centre[1]))
                forces.append(Rotation(density, float(np.sqrt(strain * modulus / density)) / size, place, True))
            case _:
                temperature = _temperature(draw, size, centre, symmetry, is_ring=isinstance(shape, Ring))
                forces.append(Heating(strain, temperature, draw.chance(0.3)))
    return tuple(forces)


def _temperature(
    draw: Draw, size: float, centre: FloatArray, symmetry: Symmetry | None, *, is_ring: bool
) -> float | Expression:
    x, y = (f"(({name} - {float(place)!r}) / {size!r})" for name, place in zip("xy", centre, strict=True))
    if is_ring and draw.chance(0.5):
        return Expression(f"1 + 0.7 * log(hypot({x}, {y}))")
    if symmetry is not None or draw.chance(0.4):
        return draw.one_of((1.0, -0.3))
    return Expression(draw.one_of((f"1 + {x}", f"{x} * {y}", f"0.5 * {y} + {x} ** 2 - {y} ** 2")))
