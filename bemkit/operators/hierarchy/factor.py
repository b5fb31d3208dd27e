"""A direct solver for compressed boundary equations whose conditions change in a few leaves at a time.

On every element tractions and displacements, four numbers, follow linearly from two unknowns z: (t, u) = P z + q. This
local condition states a support, a load or any linear law of contact. A leaf solves the equations
D z = -F q - (incoming displacements) with D = F P. Its scattering matrix maps the incoming displacements at its row
skeleton to the outgoing unknowns of its column skeleton [MartinssonRokhlin2005]. The matrices of siblings are merged up
to the root, so that a change of conditions in one leaf changes only that leaf and the clusters above it.

A few unknowns and equations, the border, belong to the boundary as a whole (rigid errors of the equations, resultants
of the tractions). They are passed through all clusters together with the skeletons and solved for at the root.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import replace
from functools import partial

import numpy as np

from bemkit.arrays import BoolArray, FloatArray, IntArray
from bemkit.geometry.proximity.cluster_tree import ClusterTree
from bemkit.operators.boundary_equations import BoundaryEquations
from bemkit.operators.hierarchy.known_loads import KnownLoads
from bemkit.operators.hierarchy.merge import ClusterResponse, merge_siblings
from bemkit.operators.hierarchy.skeletons import Compression, LevelView, Skeleton
from bemkit.operators.hierarchy.system import LocalConditions
from bemkit.operators.linear_solvers import SingularMatrixError, SmallLU
from bemkit.threads import for_each_chunk


class SingularClusterError(SingularMatrixError):
    """The equations of a cluster do not determine its unknowns, for any state of the rest of the body."""

    def __init__(self, n_elements: int) -> None:
        super().__init__(
            f"a cluster of {n_elements} elements is singular: check that supports and contacts hold the body; if they "
            "do, take the linear solver 'direct'"
        )


class Factor:
    """Boundary equations over a tree, factored under conditions that may change.

    Parameters
    ----------
    equations : BoundaryEquations
        Numbered in the order of the tree.
    tree : ClusterTree
    tolerance : float
        Relative tolerance of the compression between clusters.
    may_differ : (n_nodes, 4) bool array, optional
        Which tractions and displacements may ever differ from zero; by default all.
    may_change : (n_nodes,) bool array, optional
        Nodes whose conditions change independently, by default all. A cluster without such nodes is merged once and
        keeps no scattering matrices. A change in it factors the whole cluster again, unless only its loads change and
        the new ones are sums of loads that were announced by `prepare`.
    level_view : type of LevelView, optional
        Chooses the skeletons of a level.

    Attributes
    ----------
    border_load : (n_border,) array
        Right-hand sides of the border equations, zero unless set.

    Notes
    -----
    This is the one mutable object of the solver: it keeps the factors of the latest conditions.
    """

    def __init__(
        self,
        equations: BoundaryEquations,
        tree: ClusterTree,
        tolerance: float,
        *,
        may_differ: BoolArray | None = None,
        may_change: BoolArray | None = None,
        level_view: type[LevelView] = LevelView,
    ) -> None:
        n = equations.points.size
        may_differ = np.ones((n, 4), bool) if may_differ is None else may_differ
        self.equations, self.tree = equations, tree
        self.compression = Compression.of(equations, tree, may_differ, tolerance, level_view)
        self.border_load = np.zeros(len(equations.border.balances))
        self.conditions: LocalConditions | None = None
        self.n_updates = self.n_factored = 0
        changing = tree.leaves_of(np.arange(n) if may_change is None else np.flatnonzero(may_change))
        self.may_change = frozenset(changing.tolist())
        self._levels: list[list[ClusterResponse | None]]
        self._levels = [[None] * 2 ** (tree.n_levels - level) for level in range(tree.n_levels + 1)]
        self._stale = set(range(tree.n_leaves))
        self._changing = [{leaf >> level for leaf in self.may_change} for level in range(tree.n_levels + 1)]
        self._is_fixed = np.ones(n, bool)
        for leaf in self.may_change:
            self._is_fixed[tree.positions(0, leaf)] = False
        self._loads, self._is_reloaded = KnownLoads(self._is_fixed), False

    def prepare(self, loads: Iterable[FloatArray]) -> None:
        """Announce, before the first `update`, the given parts of later conditions; see `KnownLoads`."""
        self._loads = KnownLoads(self._is_fixed, loads)

    def update(self, conditions: LocalConditions) -> None:
        """Set the conditions on all elements; factor the leaves where they have changed and the clusters above.

        Leaves where only announced loads have changed are not factored again; the clusters above them are.

        Raises
        ------
        SingularMatrixError
            If the conditions do not determine the unknowns.
        """
        tree = self.tree
        self._mark_stale(conditions)
        changed = sorted(self._leaves_to_factor(self._stale))
        self.n_factored = len(changed)
        for level, factored in enumerate(self._levels):  # free the memory for the new factors
            for cluster in {leaf >> level for leaf in changed}:
                factored[cluster] = None
        n_integrals = len(changed) * tree.bounds[1] ** 2

        def factor_leaf(leaf: int) -> ClusterResponse:
            positions = tree.positions(0, leaf)
            loads = conditions.given[:, :, None] if leaf in self.may_change else self._loads.each
            n_quantities = 4 * (positions.stop - positions.start)
            return self._leaf(leaf, conditions.factors[positions], loads[positions].reshape(n_quantities, -1))

        for leaf, factors in zip(changed, for_each_chunk(factor_leaf, changed, n_integrals=n_integrals), strict=True):
            self._levels[0][leaf] = factors
        for level in range(1, tree.n_levels + 1):
            changed = sorted({cluster // 2 for cluster in changed} | self._above_loads(level))
            merge = partial(self._parent, level)
            for cluster, merged in zip(changed, for_each_chunk(merge, changed, n_integrals=n_integrals), strict=True):
                self._levels[level][cluster] = merged
        self._stale, self._is_reloaded = set(), False

    def _mark_stale(self, conditions: LocalConditions) -> None:
        """Replace the conditions; mark the leaves whose factors or loads no longer hold."""
        nothing = LocalConditions(np.full((1, 4, 2), np.nan), np.zeros((1, 4)))
        before = nothing if self.conditions is None else self.conditions
        is_other_load = np.any(conditions.given != before.given, axis=1)
        differs = np.any(conditions.factors != before.factors, axis=(1, 2)) | (is_other_load & ~self._is_fixed)
        if np.any(is_other_load & self._is_fixed):
            differs |= self._loads.take(conditions.given, before.given)
            self._is_reloaded = True
        self._stale |= set(self.tree.leaves_of(np.flatnonzero(differs)).tolist())
        self.conditions, self.n_updates = conditions, self.n_updates + 1

    def _above_loads(self, level: int) -> set[int]:
        """Return the changing clusters of a level directly above clusters of fixed conditions with new loads."""
        if not self._is_reloaded:
            return set()
        return {
            cluster for cluster in self._changing[level] if {2 * cluster, 2 * cluster + 1} - self._changing[level - 1]
        }

    def _leaves_to_factor(self, stale: set[int]) -> set[int]:
        """Return stale leaves, and all leaves of the largest cluster of fixed conditions around each of them."""
        leaves: set[int] = set()
        for leaf in stale:
            if leaf in leaves:
                continue
            level = 0
            while level < self.tree.n_levels and leaf >> (level + 1) not in self._changing[level + 1]:
                level += 1
            begin = leaf >> level << level
            leaves.update(range(begin, begin + 2**level))
        return leaves

    def unknowns(self, leaves: IntArray) -> FloatArray:
        """Return the unknowns z of the elements of some leaves, in the order of the leaves.

        Parameters
        ----------
        leaves : (n_leaves,) array
            Ascending.

        Returns
        -------
        (n_elements_of_leaves, 2) array
        """
        parts = self._descend(self.errors()[:, None], leaves, self._loaded)
        return np.concatenate([np.zeros((0, 1)), *parts])[:, 0].reshape(-1, 2)

    def responses(self, leaf: int, given: FloatArray, leaves: IntArray) -> FloatArray:
        """Return the unknowns z of the elements of some leaves under k loads that act on one leaf only.

        Parameters
        ----------
        leaf : int
        given : (n_of_leaf, 4, k) array
            Replaces the given part of the local conditions of that leaf.
        leaves : (n_leaves,) array
            Ascending.

        Returns
        -------
        (n_elements_of_leaves, 2, k) array
        """
        assert self.conditions is not None  # `update` comes first
        k, n_levels = given.shape[2], self.tree.n_levels
        positions = self.tree.positions(0, leaf)
        path = [self._leaf(leaf, self.conditions.factors[positions], given.reshape(-1, k))]
        for level in range(1, n_levels + 1):
            below = leaf >> (level - 1)
            pair = path[-1], self._cluster(level - 1, below ^ 1).unloaded(k)
            path.append(self._merged(level, leaf >> level, *(pair if below % 2 == 0 else pair[::-1])))

        def cluster_at(level: int, cluster: int) -> ClusterResponse:
            return path[level] if cluster == leaf >> level else self._cluster(level, cluster).unloaded(k)

        parts = self._descend(self._of_border(path[-1]), leaves, cluster_at)
        return np.concatenate([np.zeros((0, k)), *parts]).reshape(-1, 2, k)

    def _descend(
        self, errors: FloatArray, leaves: IntArray, cluster_at: Callable[[int, int], ClusterResponse]
    ) -> list[FloatArray]:
        """Return the unknowns (2 n_elements, k) of some leaves from those of the border (n_border, k)."""
        incoming = {0: errors}
        for level in range(self.tree.n_levels, 0, -1):
            clusters_below, below = set((leaves >> (level - 1)).tolist()), {}
            for parent, of_parent in incoming.items():
                cluster = cluster_at(level, parent)
                of_children = cluster.at_rest - cluster.response @ of_parent
                n_first = self.compression.skeletons[level - 1][2 * parent].rows.size
                for child, part in ((2 * parent, of_children[:n_first]), (2 * parent + 1, of_children[n_first:])):
                    if child in clusters_below:
                        below[child] = np.concatenate([part, errors])
            incoming = below
        of_leaves = ((cluster_at(0, leaf), incoming[leaf]) for leaf in leaves.tolist())
        return [leaf.at_rest - leaf.response @ of_leaf for leaf, of_leaf in of_leaves]

    def errors(self) -> FloatArray:
        """Return the border unknowns (n_border,)."""
        root = self._loaded(-1, 0)
        return self._of_border(replace(root, of_loads=root.of_loads - self.border_load[:, None]))[:, 0]

    def _leaf(self, number: int, factors: FloatArray, given: FloatArray) -> ClusterResponse:
        """Return the response of a leaf under factors (n, 4, 2) and k given parts (4 n, k) of local conditions."""
        positions, columns = self.tree.positions(0, number), self.compression.unknowns[number]
        rows, border = np.arange(2 * positions.start, 2 * positions.stop), self.equations.border
        n, skeleton, incoming = len(factors), self._skeleton(0, number), border.errors[rows]
        n_outgoing = 0 if skeleton is None else skeleton.columns.size
        # effect of tractions and displacements on the equations, the outgoing unknowns and the balances
        of_quantities = np.zeros((4 * n, rows.size + n_outgoing + border.errors.shape[1]))
        of_quantities[columns - 4 * positions.start, : rows.size] = self.equations.block(rows, columns).T
        if skeleton is not None:
            outgoing = slice(rows.size, rows.size + n_outgoing)
            of_quantities[columns - 4 * positions.start, outgoing] = skeleton.column_map.matrix()
            incoming = np.concatenate([skeleton.row_map.matrix(), incoming], axis=1)
        balances = border.balances[:, 4 * positions.start : 4 * positions.stop]
        of_quantities[:, rows.size + n_outgoing :] = balances.T
        # effect of the unknowns on the same
        of_unknowns = (factors.transpose(0, 2, 1) @ of_quantities.reshape(n, 4, -1)).reshape(2 * n, -1)
        inverse = SmallLU(of_unknowns[:, : rows.size].T, SingularClusterError(n))
        response, at_rest = inverse.solve(incoming), np.zeros((rows.size, given.shape[1]))
        if given.any():
            at_rest = -inverse.solve(of_quantities[:, : rows.size].T @ given)
        emitted = of_unknowns[:, rows.size :].T
        of_loads = emitted @ at_rest + of_quantities[:, rows.size :].T @ given
        return ClusterResponse(emitted @ response, of_loads, response, at_rest)

    def _parent(self, level: int, cluster: int) -> ClusterResponse:
        """Merge the children of a cluster; children of fixed conditions then drop their scattering matrices."""
        changes = cluster in self._changing[level]
        child = partial(self._loaded if changes else self._cluster, level - 1)
        first, second = child(2 * cluster), child(2 * cluster + 1)
        merged = self._merged(level, cluster, first, second)
        if not changes:
            first.scattering = second.scattering = np.zeros((0, 0))
        return merged

    def _merged(self, level: int, cluster: int, first: ClusterResponse, second: ClusterResponse) -> ClusterResponse:
        """Merge two siblings under the same loads into their parent."""
        positions = self.tree.positions(level, cluster)
        singular = SingularClusterError(positions.stop - positions.start)
        couplings = self.compression.couplings(level - 1, cluster)
        n_border = self.equations.border.errors.shape[1]
        return merge_siblings(first, second, couplings, self._skeleton(level, cluster), n_border, singular)

    def _cluster(self, level: int, cluster: int) -> ClusterResponse:
        factored = self._levels[level][cluster]
        assert factored is not None  # `update` comes first, and children before their parents
        return factored

    def _loaded(self, level: int, cluster: int) -> ClusterResponse:
        """Return a cluster under the present load: one of fixed conditions sums its responses to known loads."""
        factored = self._cluster(level, cluster)
        if cluster in self._changing[level]:
            return factored
        shares = self._loads.shares[:, None]
        return replace(factored, of_loads=factored.of_loads @ shares, at_rest=factored.at_rest @ shares)

    def _skeleton(self, level: int, cluster: int) -> Skeleton | None:
        """Return the skeleton of a cluster; None for the root."""
        return None if level == self.tree.n_levels else self.compression.skeletons[level][cluster]

    def _of_border(self, root: ClusterResponse) -> FloatArray:
        """Return the border unknowns (n_border, k)."""
        error = SingularMatrixError("the balance of forces is singular: check that supports and contacts hold the body")
        return SmallLU(root.scattering, error).solve(root.of_loads)
