"""Symmetric scenes that describe whole bodies, and the whole mesh that a halved one stands for."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

import bemkit as bk
from bemkit.geometry.outline import Outline

DISCRETISATIONS = (bk.LinearGalerkin(), bk.QuadraticGalerkin(), bk.ConstantCollocation())


def square(**changes: object) -> bk.Scene:
    """Return the whole body of the paper's Example 2."""
    parts = (
        bk.Part("foundation", bk.Contact(bk.HalfPlane()), sides=("bottom",)),
        bk.Part("top load", bk.Traction(y=bk.Expression("-x**2 * (1 - x)**2")), sides=("top",)),
        bk.Part("left load", bk.Traction(x=bk.Expression("2 * y**2 * (1 - y)**2")), sides=("left",)),
        bk.Part("right load", bk.Traction(x=bk.Expression("-2 * y**2 * (1 - y)**2")), sides=("right",)),
    )
    defaults = {
        "title": "Whole square",
        "shape": bk.Rectangle(1.0, 1.0),
        "material": bk.Material(1e4, 0.3),
        "law": bk.Coulomb(0.1),
        "mesh": bk.MeshOptions(elements=40),
    }
    return bk.Scene(parts=parts, **(defaults | changes))  # type: ignore[arg-type]


def squeezed(shape: bk.Disk | bk.Ring | bk.PlateWithHole | bk.Rectangle, **changes: object) -> bk.Scene:
    """Return a body of height 2 about the origin, squeezed between two frictional plates."""
    outside = tuple(side.name for side in shape.outline().loops[0])
    defaults = {"title": "Squeezed", "material": bk.Material(1.0, 0.3), "law": bk.Coulomb(0.2)}
    parts = tuple(
        bk.Part(
            name,
            bk.Contact(bk.HalfPlane((0.0, sign * 0.97), (0.0, -sign))),
            sides=outside,
            where=bk.Expression(f"{sign} * y > 0.5 and abs(x) < 0.8"),
        )
        for name, sign in (("below", -1.0), ("above", 1.0))
    )
    return bk.Scene(shape=shape, parts=parts, **(defaults | {"mesh": bk.MeshOptions(elements=40)} | changes))  # type: ignore[arg-type]


def whole_mesh(scene: bk.Scene, half: bk.BoundaryMesh) -> bk.BoundaryMesh:
    """Return the mesh of the whole body that a halved one stands for, with the parts of the scene."""
    whole, centres = half.whole, half.whole.centres
    names = np.full(whole.n_elements, "", dtype=object)
    for part in scene.parts:
        owner = whole if part.name in whole.parts else None
        members = np.arange(whole.n_elements) if owner is None else whole.part(part.name)
        keeps = part.where(*centres[members].T) if part.where is not None else _on_sides(part.sides, centres[members])
        names[members[np.broadcast_to(keeps, members.shape)]] = part.name
    parts = {part.name: np.flatnonzero(names == part.name) for part in scene.parts}
    return bk.BoundaryMesh(whole.nodes, whole.elements, parts, whole.curves, whole.element_curve, whole.element_span)


def _on_sides(sides: tuple[str, ...], centres: np.ndarray) -> np.ndarray:
    """Tell which points lie on the named sides of the unit square."""
    x, y = centres.T
    places = {"left": x == 0.0, "right": x == 1.0, "bottom": y == 0.0, "top": y == 1.0}
    return np.any([places[side] for side in sides], axis=0)


@dataclass(frozen=True)
class EccentricRing:
    """A disk with a round hole away from its middle."""

    centre: tuple[float, float]

    def outline(self) -> Outline:
        """Return the outer circle and the hole."""
        hole = bk.Ring(0.1, 0.2, self.centre).outline().loops[1]
        return Outline((bk.Disk(1.0).outline().loops[0], hole))
