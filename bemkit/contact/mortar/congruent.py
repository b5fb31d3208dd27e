"""Couplings of pairs of sides that stand to each other as other pairs do: courses of a wall repeat few of them."""

from __future__ import annotations

from collections.abc import Hashable
from dataclasses import dataclass, field, replace

import numpy as np

from bemkit.arrays import IntArray, spread_fractions
from bemkit.contact.mortar.coupling import MortarCoupling, couple
from bemkit.contact.mortar.sides import ContactSide
from bemkit.geometry.mesh import BoundaryMesh
from bemkit.geometry.placement import Placement

_DIGITS = 12
"""Decimals of distances, relative to the coordinates of the pair, to which congruent pairs agree."""
_DIGITS_OF_SUMS = 9
"""The same of sums that tell meshes apart that somebody has made of one array of elements."""
_FAR = 4.0
"""Sizes of a pair within which both bodies are."""


@dataclass(frozen=True, eq=False)
class PlacedSide:
    """A side of a body, and where that stands.

    Parameters
    ----------
    side : ContactSide
        In its place; copies have the array of elements in common.
    placement : Placement
        Where its mesh was brought from where it was drawn.
    """

    side: ContactSide
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
    one, two = ((each.side.mesh, each.placement) for each in (non_mortar, mortar))
    sides = (non_mortar.side.elements.tobytes(), mortar.side.elements.tobytes())
    return (stand_alike(one, two, reach), sides, without.tobytes())


def stand_alike(one: tuple[BoundaryMesh, Placement], two: tuple[BoundaryMesh, Placement], reach: float) -> Hashable:
    """Return a key that pairs of meshes have in common that are copies of each other, moved as a whole.

    Parameters
    ----------
    one, two : (BoundaryMesh, Placement)
        In their places, and where they were brought from where they were drawn.
    reach : float [m]
        A distance that has to be the same as well.
    """
    (mesh, place), (other, other_place) = one, two
    shift = place.turned_back(np.subtract(other_place.shift, place.shift))
    size = float(max(mesh.lengths.sum(), other.lengths.sum(), np.abs(shift).max()))
    lengths = np.round(np.append(shift, min(reach, _FAR * size)) / size, _DIGITS)
    turn = round((other_place.turn - place.turn) % 360.0, _DIGITS)
    return *_shape(*one, size), *_shape(*two, size), *lengths.tolist(), turn


def _shape(mesh: BoundaryMesh, placement: Placement, size: float) -> tuple[float, ...]:
    """Return what copies of a mesh share: the array of elements, and weighted sums of places in their own axes."""
    points = np.concatenate([mesh.start, mesh.centres])
    weights = spread_fractions(len(points))
    sums = placement.turned_back(weights @ (points - points[0]))
    return id(mesh.elements), *np.round(sums / size, _DIGITS_OF_SUMS).tolist()


def _moved(coupling: MortarCoupling, before: Placement, now: Placement) -> MortarCoupling:
    """Return a coupling whose bodies have moved together."""
    frame = now.turned(before.turned_back(coupling.frame))
    points, deepest = (now.forward(before.back(points)) for points in (coupling.points, coupling.deepest))
    return replace(coupling, points=points, deepest=deepest, frame=frame)
