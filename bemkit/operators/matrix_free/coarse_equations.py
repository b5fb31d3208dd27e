"""Groups of elements for the coarse equations of the preconditioner.

Groups end at corners and where conditions change, and their length grows in proportion to the distance from there. So
the number of groups hardly depends on the number of elements. The coarse equations resolve the singularities of the
solution at these points, which smoothing on one scale misses.
"""

from __future__ import annotations

import itertools

import numpy as np

from bemkit.arrays import FloatArray, IntArray
from bemkit.geometry.mesh import BoundaryMesh

_MOST = 1200
"""Largest number of groups; with more, the next growth is tried."""
_WIDEST = 128
"""Smallest number of groups of a closed curve."""
_GROWTHS = (0.35, 1.0, 4.0)
"""Length of a group relative to its distance from the nearest change of conditions, the best first."""
_CORNER, _TURN = 0.3, 0.2
"""Angle [rad] between neighbours at which groups end and are short, and largest rotation within one group."""


class ElementGroups:
    """Groups of consecutive elements of a boundary.

    Parameters
    ----------
    mesh : BoundaryMesh
        Straight elements without symmetry.
    kind : (n_elements,) array
        A group contains elements of one kind, unless there would be too many groups.

    Attributes
    ----------
    mesh : BoundaryMesh
        One straight element for each group.
    group : (n_elements,) array
        The group of each element.
    middle : (n_groups,) array
        The element in the middle of each group.
    """

    def __init__(self, mesh: BoundaryMesh, kind: IntArray) -> None:
        for growth, kinds in (*((growth, kind) for growth in _GROWTHS), (_GROWTHS[-1], np.zeros_like(kind))):
            firsts = [_firsts(mesh, loop, kinds[loop], growth) for loop in mesh.loops]
            if sum(first.size for first in firsts) <= _MOST:
                break
        self.group, middle, nodes, elements, count = np.empty(mesh.n_elements, np.intp), [], [], [], 0
        for loop, first in zip(mesh.loops, firsts, strict=True):
            sizes = np.diff(np.append(first, loop.size + first[0]))
            from_first = np.roll(loop, -first[0])
            self.group[from_first] = count + np.repeat(np.arange(first.size), sizes)
            middle.append(from_first[first - first[0] + sizes // 2])
            nodes.append(mesh.start[loop[first]])
            loop_groups = count + np.arange(first.size)
            elements.append(np.stack([loop_groups, np.roll(loop_groups, -1)], axis=1))
            count += first.size
        self.mesh = BoundaryMesh(np.concatenate(nodes), np.concatenate(elements), is_exterior=mesh.is_exterior)
        self.middle = np.concatenate(middle)

    def mean(self, values: FloatArray) -> FloatArray:
        """Return the means (n_groups, k) of values (n_elements, k)."""
        counts = np.bincount(self.group)
        return np.stack([np.bincount(self.group, column) / counts for column in values.T], axis=1)


def _firsts(mesh: BoundaryMesh, loop: IntArray, kind: IntArray, growth: float) -> IntArray:
    """Return the positions in a loop, ascending, of the first element of each group."""
    # stretches end at corners and where the kind changes
    chord = (mesh.end[loop] - mesh.start[loop]) @ np.array([1.0, 1j])
    turn = np.angle(chord / np.roll(chord, 1))
    sharp = np.flatnonzero((kind != np.roll(kind, 1)) | (np.abs(turn) > _CORNER))
    begin = int(sharp[0]) if sharp.size else 0
    ends = np.concatenate([[0.0], np.cumsum(np.roll(mesh.lengths[loop], -begin))])
    stops = np.append(sharp - begin, loop.size) if sharp.size else np.array([0, loop.size])
    # groups on curved parts end after a fixed rotation
    n_rotations = np.floor(np.cumsum(np.roll(turn, -begin)) / _TURN)
    cuts = [np.zeros(1, np.intp), np.flatnonzero(np.diff(n_rotations)) + 1]
    # groups grow from both ends of each stretch
    for first, last in itertools.pairwise(stops):
        nodes = ends[first : last + 1]
        steps = _steps(nodes[1] - nodes[0], 0.5 * (nodes[-1] - nodes[0]), growth, ends[-1] / _WIDEST)
        after = np.searchsorted(nodes, nodes[0] + steps)
        steps = _steps(nodes[-1] - nodes[-2], 0.5 * (nodes[-1] - nodes[0]), growth, ends[-1] / _WIDEST)
        before = np.searchsorted(nodes, nodes[-1] - steps)
        cuts.append(first + np.concatenate([[0], after, before]))
    positions = np.unique(np.concatenate(cuts))
    return np.sort((positions[positions < loop.size] + begin) % loop.size)


def _steps(shortest: float, half: float, growth: float, widest: float) -> FloatArray:
    """Return distances from an end up to the middle: a geometric sequence, then steps of the largest length."""
    last_geometric = min(half, max(shortest, widest / growth))
    n_growths = max(0.0, np.log(last_geometric / shortest)) / np.log1p(growth)
    geometric = shortest * (1.0 + growth) ** np.arange(n_growths + 1.0)
    distances = np.concatenate([geometric, np.arange(geometric[-1] + widest, half, widest)])
    return distances[distances <= half]
