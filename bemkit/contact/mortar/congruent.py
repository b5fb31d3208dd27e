"""Couplings of pairs of sides that stand to each other as other pairs do: courses of a wall repeat few of them."""

from __future__ import annotations

from collections.abc import Hashable
from dataclasses import dataclass, field, replace

import numpy as np

from bemkit.arrays import IntArray
from bemkit.contact.mortar.coupling import MortarCoupling, couple
from bemkit.contact.mortar.sides import ContactSide
from bemkit.geometry.mesh import BoundaryMesh
from bemkit.geometry.placement import Placement

_DIGITS = 12
"""Decimals of distances, relative to the coordinates of the pair, to which congruent pairs agree."""


@dataclass(frozen=True, eq=False)
class PlacedSide:
    """A side of a body, and where that stands.

    Parameters
    ----------
    side : ContactSide
        In its place.
    mesh : BoundaryMesh
        The mesh that was placed; copies have one in common.
    placement : Placement
        Of this mesh.
    """

    side: ContactSide
    mesh: BoundaryMesh
    placement: Placement


@dataclass(frozen=True)
class CongruentCouplings:
    """Couples sides, and remembers couplings for pairs of the same meshes that stand to each other alike."""

    _known: dict[Hashable, tuple[Placement, MortarCoupling]] = field(default_factory=dict)

    def couple(self, non_mortar: PlacedSide, mortar: PlacedSide, without: IntArray, reach: float) -> MortarCoupling:
        """Return the coupling of two sides; see `bemkit.contact.mortar.coupling.couple`."""
        key = _key(non_mortar, mortar, without, reach)
        if key not in self._known:
            coupling = couple(non_mortar.side, mortar.side, without=without, reach=reach)
            self._known[key] = non_mortar.placement, coupling
            return coupling
        before, coupling = self._known[key]
        return _moved(coupling, before, non_mortar.placement)


def _key(non_mortar: PlacedSide, mortar: PlacedSide, without: IntArray, reach: float) -> Hashable:
    one, two = non_mortar.placement, mortar.placement
    shift = one.turned_back(np.subtract(two.shift, one.shift))
    size = max(non_mortar.mesh.diameter, mortar.mesh.diameter, float(np.abs(shift).max()))
    meshes = (id(non_mortar.mesh), non_mortar.side.elements.tobytes(), id(mortar.mesh), mortar.side.elements.tobytes())
    relative = (*np.round(shift / size, _DIGITS).tolist(), round((two.turn - one.turn) % 360.0, _DIGITS))
    return (*meshes, *relative, without.tobytes(), reach)


def _moved(coupling: MortarCoupling, before: Placement, now: Placement) -> MortarCoupling:
    """Return a coupling whose bodies have moved together."""
    frame = now.turned(before.turned_back(coupling.frame))
    points, deepest = (now.forward(before.back(points)) for points in (coupling.points, coupling.deepest))
    return replace(coupling, points=points, deepest=deepest, frame=frame)
