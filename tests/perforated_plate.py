"""Kirsch's plate with a hole, cut to a ring under the tractions of his solution [Kirsch1898]: plane stress."""

from __future__ import annotations

import numpy as np

import bemkit as bk
from bemkit.arrays import FloatArray

NOMINAL = 2.0
"""Tension far away [Pa], along x or along both."""
RIM = 3.0


def plate(*, is_biaxial: bool, mesh: bk.MeshOptions, discretisation: bk.Galerkin) -> bk.Scene:
    """Return a quarter of the plate, whose hole has radius one."""

    def tractions(x: FloatArray, y: FloatArray) -> FloatArray:
        angle, r = np.arctan2(y, x), np.hypot(x, y)
        if is_biaxial:
            radial, shear = NOMINAL * (1.0 - 1.0 / r**2), 0.0 * r
        else:
            radial = 1.0 - 1.0 / r**2 + (1.0 - 4.0 / r**2 + 3.0 / r**4) * np.cos(2.0 * angle)
            shear = -(1.0 + 2.0 / r**2 - 3.0 / r**4) * np.sin(2.0 * angle)
            radial, shear = 0.5 * NOMINAL * radial, 0.5 * NOMINAL * shear
        cosine, sine = np.cos(angle), np.sin(angle)
        return np.stack([radial * cosine - shear * sine, radial * sine + shear * cosine])

    load = bk.Traction(lambda x, y: tractions(x, y)[0], lambda x, y: tractions(x, y)[1])
    parts = (
        bk.Part("rim", load, ("outer-1", "outer-2", "outer-3", "outer-4")),
        bk.Part("hole", bk.Free(), ("inner-1", "inner-2", "inner-3", "inner-4")),
    )
    return bk.Scene(
        title="Plate with a hole",
        shape=bk.Ring(1.0, RIM),
        material=bk.Material(100.0, 0.3, bk.Plane.STRESS),
        parts=parts,
        symmetry=bk.Symmetry(x=0.0, y=0.0),
        mesh=mesh,
        discretisation=discretisation,
    )
