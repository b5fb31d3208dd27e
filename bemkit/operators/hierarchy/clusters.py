"""Discs around the clusters of elements of a tree, and which of them are far from points."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from bemkit.arrays import BoolArray, ComplexArray, FloatArray, IntArray
from bemkit.operators.hierarchy.tree import ClusterTree

Pairs: TypeAlias = tuple[IntArray, IntArray]
"""Two arrays (n_pairs,): points, and the clusters or elements that each of them is paired with."""


@dataclass(frozen=True, eq=False)
class Discs:
    """Discs around the clusters of a level.

    Parameters
    ----------
    centre : (n_clusters,) complex array [m]
    radius : (n_clusters,) array [m]
    """

    centre: ComplexArray
    radius: FloatArray

    @classmethod
    def around(cls, tree: ClusterTree, level: int, points: ComplexArray) -> Discs:
        """Return discs about the middles of the boxes around points (k, n) of the nodes of each cluster."""
        begins = tree.bounds[: -1 : 2**level]
        counts = np.diff(np.append(begins, points.shape[1]))
        low, high = (
            of.reduceat(of.reduce(points.real), begins) + 1j * of.reduceat(of.reduce(points.imag), begins)
            for of in (np.minimum, np.maximum)
        )
        centre = 0.5 * (low + high)
        farthest = np.abs(points - np.repeat(centre, counts)).max(axis=0)
        return cls(centre, np.maximum.reduceat(farthest, begins))


@dataclass(frozen=True, eq=False)
class Clusters:
    """Clusters of elements and discs around them.

    Parameters
    ----------
    tree : ClusterTree
    levels : tuple of Discs
        From the leaves up to the root.
    """

    tree: ClusterTree
    levels: tuple[Discs, ...]

    @classmethod
    def around(cls, tree: ClusterTree, points: ComplexArray) -> Clusters:
        """Return clusters whose discs hold some points (k, n) of the element at each place."""
        return cls(tree, tuple(Discs.around(tree, level, points) for level in range(tree.n_levels + 1)))

    def divided(
        self, n_points: int, is_far: Callable[[int, IntArray, IntArray], BoolArray]
    ) -> tuple[list[Pairs], Pairs]:
        """Divide the elements into clusters far from points and elements near them, each element in one of the two.

        Parameters
        ----------
        n_points : int
        is_far : callable (level, points, clusters) -> (n_pairs,) mask
            Of a level and arrays (n_pairs,) of points and clusters.

        Returns
        -------
        far : list of pairs of points and clusters
            For each level, from the leaves on.
        near : pair of arrays
            Points, ascending, and numbers of elements.
        """
        point, cluster = np.arange(n_points), np.zeros(n_points, np.intp)
        far: list[Pairs] = []
        for level in range(self.tree.n_levels, -1, -1):
            if far:
                point, cluster = np.repeat(point, 2), (2 * cluster[:, None] + np.array([0, 1])).ravel()
            away = is_far(level, point, cluster)
            far.append((point[away], cluster[away]))
            point, cluster = point[~away], cluster[~away]
        begins, counts = self.tree.bounds[cluster], np.diff(self.tree.bounds)[cluster]
        return far[::-1], (np.repeat(point, counts), self.tree.order[consecutive(begins, counts)])


def consecutive(begins: IntArray, counts: IntArray) -> IntArray:
    """Return begins[0], begins[0] + 1, ... (counts[0] numbers), begins[1], ..."""
    ends = np.cumsum(counts)
    numbers: IntArray = np.arange(counts.sum()) + np.repeat(begins - (ends - counts), counts)
    return numbers
