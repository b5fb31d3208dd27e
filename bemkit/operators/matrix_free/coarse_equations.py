"""Boundary equations on few elements, which are joined from those of a mesh: what an iteration leaves to be solved.

Elements are joined where nothing happens: groups end at corners and where conditions change, and become longer in
proportion to their distance from there. So the number of groups hardly depends on the number of elements, and the
singularities of the solution at these places, which no smoothing on one scale catches, are among what is solved.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import numpy as np

from bemkit.arrays import FloatArray, IntArray
from bemkit.geometry.mesh import BoundaryMesh

_MOST = 1200
"""Groups beyond which fewer are tried."""
_WIDEST = 128
"""A group is at most so long by the length of its closed curve."""
_GROWTHS = (0.35, 1.0, 4.0)
"""Length of a group by its distance from the nearest place where conditions change, the best first."""
_CORNER, _TURN = 0.3, 0.2
"""Angles [rad] between neighbours at which groups end and become short; and within one group."""


@dataclass(frozen=True, eq=False)
class ElementGroups:
    """Groups of elements that follow each other along the boundary.

    Parameters
    ----------
    mesh : BoundaryMesh
        Of the groups, as straight elements.
    group : (n_elements,) array
        The group of each element.
    middle : (n_groups,) array
        The element in the middle of each group.
    """

    mesh: BoundaryMesh
    group: IntArray
    middle: IntArray

    @classmethod
    def of(cls, mesh: BoundaryMesh, kind: IntArray) -> ElementGroups:
        """Join elements.

        Parameters
        ----------
        mesh : BoundaryMesh
            Of straight elements, without symmetry.
        kind : (n_elements,) array
            Elements of different kinds are not joined, unless there would be too many groups.
        """
        for growth, kinds in (*((each, kind) for each in _GROWTHS), (_GROWTHS[-1], np.zeros_like(kind))):
            firsts = [_firsts(mesh, loop, kinds[loop], growth) for loop in mesh.loops]
            if sum(each.size for each in firsts) <= _MOST:
                break
        group, middle, nodes, elements, count = np.empty(mesh.n_elements, np.intp), [], [], [], 0
        for loop, first in zip(mesh.loops, firsts, strict=True):
            sizes = np.diff(np.append(first, loop.size + first[0]))
            turned = np.roll(loop, -first[0])
            group[turned] = count + np.repeat(np.arange(first.size), sizes)
            middle.append(turned[first - first[0] + sizes // 2])
            nodes.append(mesh.start[loop[first]])
            own = count + np.arange(first.size)
            elements.append(np.stack([own, np.roll(own, -1)], axis=1))
            count += first.size
        coarse = BoundaryMesh(np.concatenate(nodes), np.concatenate(elements), is_exterior=mesh.is_exterior)
        return cls(coarse, group, np.concatenate(middle))

    def mean(self, values: FloatArray) -> FloatArray:
        """Return the means (n_groups, k) of values (n_elements, k)."""
        counts = np.bincount(self.group)
        return np.stack([np.bincount(self.group, each) / counts for each in values.T], axis=1)


def _firsts(mesh: BoundaryMesh, loop: IntArray, kind: IntArray, growth: float) -> IntArray:
    """Return where groups begin in a loop, ascending."""
    chord = (mesh.end[loop] - mesh.start[loop]) @ np.array([1.0, 1j])
    turn = np.angle(chord / np.roll(chord, 1))
    sharp = np.flatnonzero((kind != np.roll(kind, 1)) | (np.abs(turn) > _CORNER))
    begin = int(sharp[0]) if sharp.size else 0
    ends = np.concatenate([[0.0], np.cumsum(np.roll(mesh.lengths[loop], -begin))])
    turned = np.floor(np.cumsum(np.roll(turn, -begin)) / _TURN)
    cuts = [np.zeros(1, np.intp), np.flatnonzero(np.diff(turned)) + 1]
    stops = np.append(sharp - begin, loop.size) if sharp.size else np.array([0, loop.size])
    for first, last in itertools.pairwise(stops):
        nodes = ends[first : last + 1]
        steps = _steps(nodes[1] - nodes[0], 0.5 * (nodes[-1] - nodes[0]), growth, ends[-1] / _WIDEST)
        after = np.searchsorted(nodes, nodes[0] + steps)
        steps = _steps(nodes[-1] - nodes[-2], 0.5 * (nodes[-1] - nodes[0]), growth, ends[-1] / _WIDEST)
        before = np.searchsorted(nodes, nodes[-1] - steps)
        cuts.append(first + np.concatenate([[0], after, before]))
    places = np.unique(np.concatenate(cuts))
    return np.sort((places[places < loop.size] + begin) % loop.size)


def _steps(shortest: float, half: float, growth: float, widest: float) -> FloatArray:
    """Return distances from an end that grow in proportion, and from some place on by equal steps, up to the middle."""
    turning = min(half, max(shortest, widest / growth))
    geometric = shortest * (1.0 + growth) ** np.arange(max(0.0, np.log(turning / shortest)) / np.log1p(growth) + 1.0)
    distances = np.concatenate([geometric, np.arange(geometric[-1] + widest, half, widest)])
    return distances[distances <= half]
