"""Search for facing sides of many bodies, and choice of the non-mortar side."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from bemkit.arrays import FloatArray, IntArray
from bemkit.contact.mortar.sides import ContactSide, faces_away
from bemkit.geometry.neighbours import common_centre
from bemkit.geometry.vectors import cross, norms, turned_right

_LEAST_OPPOSITION = 0.5
"""Smallest cosine of the angle (60 degrees) between one normal and the reversed other normal of facing elements."""
_LEAST_COVER = 1e-6
"""Common length, relative to the shorter side, up to which sides only touch at a corner: digits of drawn positions."""
_LEAST_RESOLVED = 0.01
"""Common length, relative to the mean element of the finer side, that a node of the mesh can represent."""
_STEPPED = 1.1
"""Ratio of the distances of nodes above which the steps of constant elements press shorter elements."""
_FEWEST = 3
"""Number of longer constant elements on the common length that carry multipliers: they resist rotation, too."""
_WHOLE = 1.0 - 1e-6
"""Covered share of a completely covered side, with round-off."""
_WHOLE_CURVED = 0.98
"""Covered share of a completely covered curved side. Chords and an interference change lengths by less on any mesh, so
that all meshes of a scene have the same non-mortar side."""


class FacingSides(NamedTuple):
    """Two sides that face each other, by their positions.

    Parameters
    ----------
    non_mortar, mortar : int
        See `is_non_mortar`.
    is_resolved : bool
        Whether their common length is at least a hundredth of the mean element of the finer side.
    """

    non_mortar: int
    mortar: int
    is_resolved: bool


@dataclass(frozen=True, eq=False)
class _Elements:
    """Elements of all sides, as chords."""

    sides: Sequence[ContactSide]
    owner: IntArray
    side: IntArray
    start: FloatArray
    end: FloatArray
    sagitta: FloatArray

    @classmethod
    def of(cls, sides: Sequence[ContactSide], owners: Sequence[int]) -> _Elements:
        sizes = [side.elements.size for side in sides]
        return cls(
            sides,
            np.repeat(np.asarray(owners), sizes),
            np.repeat(np.arange(len(sides)), sizes),
            np.concatenate([side.start for side in sides]),
            np.concatenate([side.end for side in sides]),
            np.concatenate([side.sagittas for side in sides]),
        )

    @cached_property
    def lengths(self) -> FloatArray:
        """(n_elements,) array [m]: lengths of the chords."""
        return norms(self.end - self.start)


def find_facing(
    sides: Sequence[ContactSide], distance: float, owners: Sequence[int] | None = None, *, has_friction: bool = False
) -> list[FacingSides]:
    """Find the pairs of sides that face each other.

    Parameters
    ----------
    sides : sequence of ContactSide
        Sides of placed bodies.
    distance : float [m]
        Largest distance or overlap of facing sides.
    owners : sequence of int, optional
        The body of each side; sides of one body are no pair. By default all sides belong to different bodies.
    has_friction : bool
        Whether friction acts between them.

    Returns
    -------
    list of FacingSides
        Sorted by the smaller, then the larger index.

    Notes
    -----
    Elements face each other if their normals are opposite up to 60 degrees, and if their chords overlap in projection
    along the mean of both normals. Sides that only touch at a corner have a common length of at most a millionth of the
    shorter one, or what the projection of chords adds where curved sides are a distance apart.
    """
    if not sides:
        return []
    elements = _Elements.of(sides, range(len(sides)) if owners is None else owners)
    first, second, cover, added = _facing_elements(elements, distance)
    pairs, number = np.unique(
        np.stack([elements.side[first], elements.side[second]], axis=1), axis=0, return_inverse=True
    )
    shared, *moments = (
        np.bincount(number.ravel(), weights, minlength=len(pairs))
        for weights in (cover, cover * elements.lengths[first], cover * elements.lengths[second])
    )
    least = np.full(len(pairs), np.inf)
    np.minimum.at(least, number.ravel(), added)
    found = []
    for (one, two), length, moment, corner in zip(
        pairs.tolist(), shared.tolist(), np.stack(moments, axis=1).tolist(), least.tolist(), strict=True
    ):
        pair = sides[one], sides[two]
        if length > corner + _LEAST_COVER * min(float(side.lengths.sum()) for side in pair):
            is_first = _is_first_non_mortar(*pair, length, moment, has_friction=has_friction)
            is_resolved = length >= _LEAST_RESOLVED * min(map(_mean_length, pair))
            found.append(FacingSides(*((one, two) if is_first else (two, one)), is_resolved))
    return found


def is_non_mortar(one: ContactSide, two: ContactSide, *, has_friction: bool = False) -> bool:
    """Decide whether the first of two sides carries the multipliers.

    Parameters
    ----------
    one, two : ContactSide
    has_friction : bool
        Whether friction acts between them.

    Returns
    -------
    bool
        Where the nodes of constant elements are farther from each other on the common length than those of the other
        side, and at least three of these elements face it, true if the first side has them. Else true if only the first
        side is completely covered. If both or none are, true if the mean distance of nodes on the first side is not
        larger than on the second one. Of curved constant or linear sides that cover each other and have friction or are
        arcs about one point, the coarser side carries the multipliers.

    Notes
    -----
    A completely covered side has multipliers of full weight at all nodes, and fine multipliers resolve both sides
    [Wohlmuth2000]. The choice ignores the stiffness of the bodies: if a stiff body with the finer mesh presses a soft
    body, the side of the soft body would be better.

    Constant elements have steps between them. Under shorter elements with multipliers the pressure of two blocks is
    wrong by 30 % at twice the length, and by 135 % for a hundredfold modulus; under longer ones by 4 % at most.
    Linear elements on conforming curved sides move too far inwards between their nodes, and constant elements have
    steps there. Multipliers of the finer side resolve that error, those of the coarser side average over it: the
    pressure of a disc in a ring with three times longer linear elements is uniform to 1e-5 instead of 2e-2, that of a
    stiff disc in a soft ring with four times longer constant elements to 1e-5 instead of 1. Without friction a disc
    with a clearance would rotate nearly freely.
    """
    elements = _Elements.of([one, two], [0, 1])
    first, second, cover, _ = _facing_elements(elements, np.inf)
    moments = [float(cover @ elements.lengths[which]) for which in (first, second)]
    return _is_first_non_mortar(one, two, float(cover.sum()), moments, has_friction=has_friction)


def _is_first_non_mortar(
    one: ContactSide, two: ContactSide, cover: float, moments: Sequence[float], *, has_friction: bool
) -> bool:
    """Apply the rule of `is_non_mortar`.

    Parameters
    ----------
    one, two : ContactSide
    cover : float [m]
        Their common length.
    moments : (float, float) [m^2]
        Integrals over it of the lengths of the elements of each side, which may be graded elsewhere.
    has_friction : bool
    """
    fits = not any(side.is_straight or side.space.degree > 1 for side in (one, two)) and (
        has_friction or common_centre([(side.mesh, side.elements) for side in (one, two)]) is not None
    )
    parts = [max(side.space.degree, 1) for side in (one, two)]  # of an element between nodes
    first, second = (moment / n for moment, n in zip(moments, parts, strict=True))
    longer, shorter = max(first, second), min(first, second)
    has_steps = (one if first > second else two).space.degree == 0
    if has_steps and longer > _STEPPED * shorter and cover**2 >= _FEWEST * longer:
        return first > second
    first, second = (_mean_length(side) / n for side, n in zip((one, two), parts, strict=True))
    share = _WHOLE_CURVED if fits else _WHOLE
    is_whole = [cover >= share * float(side.lengths.sum()) for side in (one, two)]
    if is_whole[0] != is_whole[1]:
        return is_whole[0]
    return first >= second * (1.0 - 1e-9) if fits and is_whole[0] else first <= second * (1.0 + 1e-9)


def _mean_length(side: ContactSide) -> float:
    return float(side.lengths.mean())


def _facing_elements(elements: _Elements, distance: float) -> tuple[IntArray, IntArray, FloatArray, FloatArray]:
    """Return pairs of elements, first that of the lower side, their common length and the projection's part of it [m].

    A chord is at an angle of four times its sagitta to the end of its arc. Where chords are a distance apart, their
    mean direction is off by half of both angles, and the projection adds at most the distance times that.
    """
    first, second = _near_elements(elements, distance)
    is_pair = elements.owner[first] != elements.owner[second]
    swap = elements.side[first] > elements.side[second]
    first, second = np.where(swap, second, first)[is_pair], np.where(swap, first, second)[is_pair]
    start, end = elements.start, elements.end
    tangents = (end - start) / elements.lengths[:, None]
    opposes = np.einsum("ec,ec->e", tangents[first], tangents[second]) <= -_LEAST_OPPOSITION
    first, second = first[opposes], second[opposes]

    tangent = tangents[first] - tangents[second]
    tangent /= norms(tangent)[:, None]
    origin = start[first]
    (a1, b1), (b2, a2) = (
        [np.einsum("ec,ec->e", tangent, points - origin) for points in (start[which], end[which])]
        for which in (first, second)
    )
    low, high = np.maximum(a1, a2), np.minimum(b1, b2)
    # outward normal (t_y, -t_x) of the first body, and positions of both chords along it at the ends of the overlap
    at = np.stack([low, high])
    ahead1 = (at - a1) / (b1 - a1) * -cross(tangent, end[first] - origin)
    ahead2 = (at - a2) / (b2 - a2) * cross(tangent, end[second] - start[second]) - cross(tangent, end[second] - origin)
    gaps = ahead2 - ahead1
    off_arc = 2.0 * elements.sagitta / elements.lengths
    added = np.abs(gaps).max(axis=0) * (off_arc[first] + off_arc[second])
    nearest = np.where(gaps[0] * gaps[1] <= 0.0, 0.0, np.abs(gaps).min(axis=0))
    slack = elements.sagitta[first] + elements.sagitta[second]
    is_near = (high > low) & (nearest <= distance + slack)
    middle = origin + at.mean(axis=0)[:, None] * tangent
    middle += 0.5 * (ahead1 + ahead2).mean(axis=0)[:, None] * turned_right(tangent)
    # sides that seem to overlap may face away from each other; they are few and are checked separately
    depth, sides = gaps.mean(axis=0), np.stack([elements.side[first], elements.side[second]], axis=1)
    behind = np.flatnonzero(is_near & (depth < -2.0 * slack))
    for one, two in np.unique(sides[behind], axis=0):
        rows = behind[(sides[behind] == (one, two)).all(axis=1)]
        resolution = max(elements.sides[one].resolution, elements.sides[two].resolution)
        meshes = elements.sides[one].mesh, elements.sides[two].mesh
        is_near[rows] &= ~faces_away(*meshes, middle[rows], depth[rows], np.maximum(resolution, 2.0 * slack[rows]))
    return first[is_near], second[is_near], (high - low)[is_near], added[is_near]


def _near_elements(elements: _Elements, distance: float) -> tuple[IntArray, IntArray]:
    """Return all pairs of elements whose circumscribed circles are closer than a distance.

    Notes
    -----
    Each class of element lengths, with ratio two, has its own tree, so that neither a long element nor many tiny ones
    slow down the search.
    """
    from scipy.spatial import cKDTree

    centre = 0.5 * (elements.start + elements.end)
    radius = 0.5 * elements.lengths + elements.sagitta
    distance = min(distance, float(norms(np.ptp(centre, axis=0))))  # no two elements are farther apart
    octave = np.frexp(radius)[1]
    members = [np.flatnonzero(octave == size) for size in np.unique(octave)]
    trees = [cKDTree(centre[member]) for member in members]
    blocks = [np.zeros((0, 2), np.intp)]
    for large, (member, tree) in enumerate(zip(members, trees, strict=True)):
        largest = radius[member].max() + distance
        inside = tree.query_pairs(2.0 * largest - distance, output_type="ndarray")
        blocks.append(member[inside])
        for other, smaller in zip(members[:large], trees[:large], strict=True):
            near = tree.sparse_distance_matrix(smaller, largest + radius[other].max(), output_type="ndarray")
            blocks.append(np.stack([member[near["i"]], other[near["j"]]], axis=1))
    pairs = np.concatenate(blocks)
    separation = norms(centre[pairs[:, 0]] - centre[pairs[:, 1]])
    pairs = pairs[separation <= radius[pairs].sum(axis=1) + distance]
    return pairs[:, 0], pairs[:, 1]
