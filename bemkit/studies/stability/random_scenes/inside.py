"""Random forces and temperatures inside a body."""

from __future__ import annotations

import numpy as np

from bemkit.arrays import FloatArray
from bemkit.formulas import Expression
from bemkit.geometry.symmetry import Symmetry
from bemkit.scene.body_forces import BodyForce, Gravity, Heating, Rotation
from bemkit.studies.stability.random_scenes.draw import Draw


def random_body_forces(
    draw: Draw, size: float, centre: FloatArray, modulus: float, symmetry: Symmetry | None = None
) -> tuple[BodyForce, ...]:
    """Draw up to two of them, symmetric about the lines, with stresses of 1e-7 to 1e-2 of the modulus."""
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
                forces.append(Heating(strain, _temperature(draw, size, centre, symmetry), draw.chance(0.3)))
    return tuple(forces)


def _temperature(draw: Draw, size: float, centre: FloatArray, symmetry: Symmetry | None) -> float | Expression:
    if symmetry is not None or draw.chance(0.4):
        return draw.one_of((1.0, -0.3))
    x, y = (f"(({name} - {float(place)!r}) / {size!r})" for name, place in zip("xy", centre, strict=True))
    return Expression(draw.one_of((f"1 + {x}", f"{x} * {y}", f"0.5 * {y} + {x} ** 2 - {y} ** 2")))
