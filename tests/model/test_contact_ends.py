"""Contact tractions where the contact boundary ends: at rollers, loads, other contact parts, and in corners.

The exact fields are those of an Airy function that is even in x and in y: there is no shear on both axes, and no
displacement across them, so that rollers and smooth obstacles on the axes change nothing.
"""

from __future__ import annotations

import numpy as np
import pytest

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
    "corner": (bk.Part("floor", bk.Contact(FLOOR), ("bottom",)), bk.Part("left", bk.Contact(WALL), ("left",))),
}


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
    xx, yy = (bk.Expression(STRESS[name])(table.x, table.y) for name in ("xx", "yy"))
    exact = np.where(table.rows("left"), xx, yy)
    return {part: np.abs(table.sigma_n - exact)[table.rows(part)] / PRESSURE for part in table.parts}


@pytest.mark.parametrize("case", PARTS)
@pytest.mark.parametrize("degree", [2, 3, 4, 5, 6])
@pytest.mark.parametrize("density", [1.0, 4.0])
def test_ends_are_as_good_as_their_neighbours(case: str, degree: int, density: float) -> None:
    for error in errors(PARTS[case], degree, 32, density).values():
        first, last = (max(part) for part in (error[:2], error[-2:]))
        within = error[1 : 2 * degree]
        assert max(error[0] / max(within), 0.0) < 8.0
