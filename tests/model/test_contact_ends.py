"""Contact tractions where the contact boundary ends: at rollers, loads, other contact parts, and in corners.

The exact fields are those of an Airy function that is even in x and in y: there is no shear on both axes, and no
displacement across them, so that rollers and smooth obstacles on the axes change nothing.
"""

from __future__ import annotations

import numpy as np

import bemkit as bk
from bemkit.arrays import FloatArray

WAVE, AMPLITUDE, PRESSURE = 2.3, 0.004, 1.0
STRESS = {
    "xx": f"{AMPLITUDE * WAVE**2} * cos({WAVE} * x) * (2 * cosh({WAVE} * y) + {WAVE / 2} * y * sinh({WAVE} * y)) - 1",
    "yy": f"-{AMPLITUDE * WAVE**2} * cos({WAVE} * x) * (cosh({WAVE} * y) + {WAVE / 2} * y * sinh({WAVE} * y)) - 1",
    "xy": f"{AMPLITUDE * WAVE**2} * sin({WAVE} * x) * (1.5 * sinh({WAVE} * y) + {WAVE / 2} * y * cosh({WAVE} * y))",
}
FLOOR, WALL = bk.HalfPlane(), bk.HalfPlane((0.0, 0.0), (1.0, 0.0))
TURNED = bk.Traction(bk.Expression(f"-({STRESS['xy']})"), bk.Expression(f"-({STRESS['yy']})"))
PARTS = {
    "roller": (bk.Part("floor", bk.Contact(FLOOR), ("bottom",)), bk.Part("left", bk.Roller(), ("left",))),
    "load": (
        bk.Part("floor", bk.Contact(FLOOR), ("bottom",), bk.Expression("x < 0.5")),
        bk.Part("load", TURNED, ("bottom",), bk.Expression("x > 0.5")),
        bk.Part("left", bk.Roller(), ("left",)),
    ),
    "one line": (
        bk.Part("floor", bk.Contact(FLOOR), ("bottom",), bk.Expression("x < 0.5")),
        bk.Part("right floor", bk.Contact(FLOOR), ("bottom",), bk.Expression("x > 0.5")),
        bk.Part("left", bk.Roller(), ("left",)),
    ),
}


def stress(component: str, x: FloatArray, y: FloatArray) -> FloatArray:
    return np.asarray(bk.Expression(STRESS[component])(np.stack([x, y], axis=1)))


def errors(parts: tuple[bk.Part, ...], degree: int, elements: int, density: float) -> dict[str, FloatArray]:
    """Return the errors of sigma_n at the nodes of each contact part, in order, relative to the pressure."""
    loads = (
        bk.Part("right", bk.Traction(bk.Expression(STRESS["xx"]), bk.Expression(STRESS["xy"])), ("right",)),
        bk.Part("top", bk.Traction(bk.Expression(STRESS["xy"]), bk.Expression(STRESS["yy"])), ("top",)),
    )
    mesh = bk.MeshOptions(elements=elements, density={"bottom": density})
    scene = bk.Scene(
        title="Airy function",
        shape=bk.Rectangle(1.0, 1.0),
        material=bk.Material(1.0, 0.3),
        parts=(*parts, *loads),
        discretisation=bk.Galerkin(degree),
        mesh=mesh,
    )
    table = bk.run(scene).contact
    exact = stress("yy", table.x, table.y)
    exact[table.rows("left")] = stress("xx", table.x, table.y)[table.rows("left")]
    return {part: np.abs(table.sigma_n - exact)[table.rows(part)] / PRESSURE for part in table.parts}
