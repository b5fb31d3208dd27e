"""Conformance of shapes."""

from __future__ import annotations

import numpy as np

from bemkit.errors import BemkitError
from bemkit.geometry.meshing.discretise import discretise
from bemkit.geometry.outline import Outline
from bemkit.geometry.shapes import Shape
from bemkit.scene.objects import outline_of
from bemkit.testing.failure import CheckFailed, class_name, demand
from bemkit.testing.spaces import check_curve

_SEEN = np.linspace(0.0, 1.0, 9)
_ELEMENTS = 16
"""Number of elements on each side in the check of the sense of the boundary."""


def check_shape(shape: Shape) -> None:
    """Check everything that `Shape` promises; call it on your own shape.

    The outline is closed, has the body on its left, and is the same at every call; its curves pass `check_curve`, and
    their parameter is proportional to the arc length.

    Raises
    ------
    CheckFailed
        Naming the shape, the promise broken, where, and by how much.
    """
    name = class_name(shape)
    outline = _outline(shape, name)
    again = _outline(shape, name)
    demand(again.side_names == outline.side_names, f"{name}.outline has other sides the next time: {again.side_names}")
    for side, other in zip(outline.sides, again.sides, strict=True):
        moved = float(np.abs(side.curve.point(_SEEN) - other.curve.point(_SEEN)).max())
        demand(moved == 0.0, f"{name}.outline has side {side.name!r} {moved:.3g} away the next time")
    for side in outline.sides:
        try:
            check_curve(side.curve)
        except CheckFailed as failure:
            raise CheckFailed(f"{name}, side {side.name!r}: {failure}") from failure
        speed = np.hypot(*side.curve.derivative(_SEEN).T)
        unevenness = float(np.ptp(speed) / speed.max())
        demand(
            unevenness <= 1e-6,  # tables of arc length are that exact
            f"{name}, side {side.name!r}: the speed varies by {unevenness:.3g}, so that the parameter is not "
            "proportional to the arc length: use ParametricCurve(curve.point, curve.derivative)",
        )
    if outline.surface is None:
        _check_sense(outline, name)


def _outline(shape: Shape, name: str) -> Outline:
    try:
        return outline_of(shape)
    except BemkitError as error:
        raise CheckFailed(f"{name}.outline fails: {error}") from error


def _check_sense(outline: Outline, name: str) -> None:
    """Check by the divergence theorem that the boundary is closed and that its normals point out of the body."""
    mesh = discretise(outline, n_elements=_ELEMENTS * len(outline.sides))
    xi, weights = np.polynomial.legendre.leggauss(8)
    elements = np.arange(mesh.n_elements)
    points, normals = mesh.points(elements, xi), mesh.normals_at(elements, xi)
    measure = 0.5 * mesh.lengths[:, None] * weights
    total = np.einsum("eq,eqc->c", measure, normals)
    open_by = float(np.hypot(*total)) / float(mesh.lengths.sum())
    demand(open_by <= 1e-6, f"{name}.outline is open: its normals add up to {open_by:.3g} of its length")
    area = 0.5 * float(np.einsum("eq,eqc,eqc->", measure, points - points.mean(axis=(0, 1)), normals))
    demand(
        (area < 0.0) == outline.is_exterior,
        f"{name}.outline encloses the area {area:.3g}: have the body on the left of every side",
    )
