"""Couplings of sides that congruent pairs share; a wall of blocks has few different ones."""

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
"""Decimals of distances, relative to the coordinates of the pair, that agree in congruent pairs."""
_DIGITS_OF_SUMS = 9
"""Decimals of sums that distinguish meshes with equal elements and different nodes."""
_FAR = 4.0
"""Largest distance, relative to the extent of a pair, that affects the coupling."""


@dataclass(frozen=True, eq=False)
class PlacedSide:
    """A contact side and the placement of its body.

    Parameters
    ----------
    side : ContactSide
        In the coordinates of the scene; copies share the array of elements.
    placement : Placement
        From the coordinates of the shape to those of the scene.
    """

    side: ContactSide
    placement: Placement


@dataclass(frozen=True)
class CongruentCouplings:
    """Couples sides, with a cache for congruent pairs."""

    _known: dict[Hashable, tuple[Placement, MortarCoupling]] = field(default_factory=dict)

    @property
    def n_coupled(self) -> int:
        """Number of couplings that were computed."""
        return len(self._known)

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
    one, two = ((placed.side.mesh, placed.placement) for placed in (non_mortar, mortar))
    sides = (non_mortar.side.elements.tobytes(), mortar.side.elements.tobytes())
    return (congruence_key(one, two, reach), sides, without.tobytes())


def congruence_key(one: tuple[BoundaryMesh, Placement], two: tuple[BoundaryMesh, Placement], reach: float) -> Hashable:
    """Return a key that is equal for pairs of meshes that differ by a rigid motion of the whole pair.

    Parameters
    ----------
    one, two : (BoundaryMesh, Placement)
        Meshes in the coordinates of the scene, and their placements.
    reach : float [m]
        A distance that is part of the key.
    """
    (mesh, place), (other, other_place) = one, two
    shift = place.turned_back(np.subtract(other_place.shift, place.shift))
    size = float(max(mesh.lengths.sum(), other.lengths.sum(), np.abs(shift).max()))
    lengths = np.round(np.append(shift, min(reach, _FAR * size)) / size, _DIGITS)
    turn = round((other_place.turn - place.turn) % 360.0, _DIGITS)
    return *_shape(*one, size), *_shape(*two, size), *lengths.tolist(), turn


def _shape(mesh: BoundaryMesh, placement: Placement, size: float) -> tuple[float, ...]:
    """Return a key that copies of a mesh share: the identity of the array of elements, and weighted sums of points."""
    points = np.concatenate([mesh.start, mesh.centres])
    weights = spread_fractions(len(points))
    sums = placement.turned_back(weights @ (points - points[0]))
    return id(mesh.elements), *np.round(sums / size, _DIGITS_OF_SUMS).tolist()


def _moved(coupling: MortarCoupling, before: Placement, now: Placement) -> MortarCoupling:
    """Return the coupling of a pair after a rigid motion of both bodies."""
    frame = now.turned(before.turned_back(coupling.frame))
    points, deepest = (now.forward(before.back(points)) for points in (coupling.points, coupling.deepest))
    return replace(coupling, points=points, deepest=deepest, frame=frame)
