"""Small scenes for the tests of extreme cases."""

from __future__ import annotations

import dataclasses

import bemkit as bk

LINEAR, CONSTANT = bk.LinearGalerkin(), bk.ConstantCollocation()
FLOOR = bk.Part("floor", bk.Contact(bk.HalfPlane()), sides=("bottom",))


def block(*parts: bk.Part, **options: object) -> bk.Scene:
    """Unit square, E = 1 and nu = 0.3 unless said otherwise, contact with the given parts."""
    defaults: dict[str, object] = {
        "title": "block",
        "shape": bk.Rectangle(1.0, 1.0),
        "material": bk.Material(1.0, 0.3),
        "law": bk.Coulomb(0.3),
        "mesh": bk.MeshOptions(48),
    }
    return bk.Scene(parts=parts, **(defaults | options))  # type: ignore[arg-type]


def small_paper_scene(number: int, elements: int = 64, **changes: object) -> bk.Scene:
    """Return example 1 or 2 of the paper on a coarse mesh."""
    scene = bk.load_scene(f"paper-{number}")
    return dataclasses.replace(scene, mesh=dataclasses.replace(scene.mesh, elements=elements), **changes)  # type: ignore[arg-type]
