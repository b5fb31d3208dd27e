"""A direct solver for compressed boundary equations whose conditions change a few leaves at a time.

On every element tractions and displacements, four numbers, follow linearly from two unknowns z: (t, u) = P z + q, which
states a support, a load, or any linear law of contact. In a leaf the equations D z = -F q - (what comes from outside)
are solved at once, D = F P; seen from outside it is a scattering matrix, from what its row skeleton feels to what its
column skeleton causes [MartinssonRokhlin2005]. The matrices of siblings are merged up to the root, so that a change of
conditions in one leaf touches that leaf and those above it.

A few unknowns and equations belong to the boundary as a whole (rigid errors of the equations, resultants of the
tractions). They are passed through all clusters beside the skeletons and solved for at the root.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from bemkit.arrays import BoolArray, FloatArray, IntArray
from bemkit.operators.hierarchy.equations import BoundaryEquations
from bemkit.operators.hierarchy.known_loads import KnownLoads
from bemkit.operators.hierarchy.skeletons import Compression, LevelView, Skeleton
from bemkit.operators.hierarchy.system import ElementLaws
from bemkit.operators.hierarchy.tree import ClusterTree
from bemkit.operators.linear.dense import SingularMatrixError, SmallLU
from bemkit.operators.linear.threads import for_each_chunk


class SingularClusterError(SingularMatrixError):
    """A cluster of the tree whose own equations do not determine its unknowns, for any rest of the body."""

    def __init__(self, n_elements: int) -> None:
        super().__init__(
            f"a cluster of {n_elements} elements is singular: check that supports and contacts hold the body; if they "
            "do, take the linear solver 'direct'"
        )


@dataclass(eq=False)
class _Cluster:
    """A cluster under the present conditions, by what its rows feel and by the unknowns of the border, f.

    Parameters
    ----------
    scattering, of_loads : (n_caused, n_felt), (n_caused, k) arrays
        Its columns cause, and to the balances it adds, ``of_loads - scattering @ f``, for k different loads.
    response, at_rest : arrays
        The unknowns of a leaf, and what the rows of both children of another cluster feel, are
        ``at_rest - response @ f``.
    """

    scattering: FloatArray
    of_loads: FloatArray
    response: FloatArray
    at_rest: FloatArray

    def unloaded(self, k: int) -> _Cluster:
        """Return the same under k times no load."""
        return replace(self, of_loads=np.zeros((len(self.of_loads), k)), at_rest=np.zeros((len(self.at_rest), k)))

    @property
    def n_bytes(self) -> int:
        return self.scattering.nbytes + self.of_loads.nbytes + self.response.nbytes + self.at_rest.nbytes


@dataclass(frozen=True, eq=False)
class _Leaf:
    """The equations of a leaf under laws, factored.

    Parameters
    ----------
    factors : (n, 4, 2) array
        Those of the laws.
    of_quantities : (4 n, n_rows + n_caused + n_border) array
        What tractions and displacements do to the equations, cause outside and add to the balances.
    of_unknowns : (2 n, n_rows + n_caused + n_border) array
        The same of the unknowns z.
    inverse : SmallLU
    """

    factors: FloatArray
    of_quantities: FloatArray
    of_unknowns: FloatArray
    inverse: SmallLU


class Factor:
    """Boundary equations over a tree, factored under conditions that may change.

    Parameters
    ----------
    equations : BoundaryEquations
        Numbered in the order of the tree.
    tree : ClusterTree
        With a single leaf the equations are dense, and the LU factors of that leaf are kept.
    tolerance : float
        Of the compression between clusters.
    may_differ : (n_nodes, 4) bool array, optional
        Which tractions and displacements may ever differ from zero; by default all.
    may_change : (n_nodes,) bool array, optional
        Nodes whose conditions change by themselves, by default all. Clusters without any are merged once, and keep no
        scattering matrices: if something changes there all the same, the whole cluster is factored again, but for loads
        that were expected, and sums of them.
    level_view : type of LevelView, optional
        How skeletons are chosen.

    Attributes
    ----------
    border_load : (n_border,) array
        Right-hand sides of the equations of the boundary as a whole, zero unless set.

    Notes
    -----
    The one mutable object of the solver: it keeps the factors of the conditions it has met last.
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
        self.border_load = np.zeros(equations.border.own.shape[0])
        self.laws: ElementLaws | None = None
        self.n_updates = self.n_factored = 0
        changing = tree.leaves_of(np.arange(n) if may_change is None else np.flatnonzero(may_change))
        self.may_change = frozenset(changing.tolist())
        self._levels: list[list[_Cluster | None]]
        self._levels = [[None] * 2 ** (tree.n_levels - level) for level in range(tree.n_levels + 1)]
        self._stale = set(range(tree.n_leaves))
        self._changing = [{leaf >> level for leaf in self.may_change} for level in range(tree.n_levels + 1)]
        self._stays = np.ones(n, bool)
        for leaf in self.may_change:
            self._stays[tree.places(0, leaf)] = False
        self._loads, self._is_reloaded = KnownLoads(self._stays), False
        self._only_leaf: _Leaf | None = None

    def expect(self, given: Iterable[FloatArray]) -> None:
        """Announce, before the first `update`, the loads of the laws; see `KnownLoads`."""
        self._loads = KnownLoads(self._stays, given)

    def update(self, laws: ElementLaws) -> None:
        """Take over the conditions on all elements, and factor every leaf where they have changed, and what is above.

        Where only loads have changed that were expected, their leaves are not factored, but what changes above them.

        Raises
        ------
        SingularMatrixError
            If the conditions do not determine the unknowns.
        """
        tree = self.tree
        before = ElementLaws(np.full((1, 4, 2), np.nan), np.zeros((1, 4))) if self.laws is None else self.laws
        is_other_load = np.any(laws.given != before.given, axis=1)
        differs = np.any(laws.factors != before.factors, axis=(1, 2)) | (is_other_load & ~self._stays)
        if np.any(is_other_load & self._stays):
            differs |= self._loads.take(laws.given, before.given)
            self._is_reloaded = True
        self._stale |= set(tree.leaves_of(np.flatnonzero(differs)).tolist())
        self.laws, self.n_updates = laws, self.n_updates + 1
        changed = sorted(self._merged_with(self._stale))
        self.n_factored = len(changed)
        for level, factored in enumerate(self._levels):  # their memory is for the new ones
            for cluster in {leaf >> level for leaf in changed}:
                factored[cluster] = None
        n_integrals = len(changed) * tree.bounds[1] ** 2

        def factor_leaf(leaf: int) -> _Cluster:
            places = tree.places(0, leaf)
            given = laws.given[:, :, None] if leaf in self.may_change else self._loads.each
            return self._leaf(leaf, laws.factors[places], given[places].reshape(4 * (places.stop - places.start), -1))

        for leaf, factors in zip(changed, for_each_chunk(factor_leaf, changed, n_integrals=n_integrals), strict=True):
            self._levels[0][leaf] = factors
        for level in range(1, tree.n_levels + 1):
            changed = sorted({cluster // 2 for cluster in changed} | self._above_loads(level))
            merge = partial(self._parent, level)
            for cluster, merged in zip(changed, for_each_chunk(merge, changed, n_integrals=n_integrals), strict=True):
                self._levels[level][cluster] = merged
        self._stale, self._is_reloaded = set(), False

    def _above_loads(self, level: int) -> set[int]:
        """Return the clusters of a level above loads which have changed, and change by themselves."""
        if not self._is_reloaded:
            return set()
        return {
            cluster for cluster in self._changing[level] if {2 * cluster, 2 * cluster + 1} - self._changing[level - 1]
        }

    def _merged_with(self, leaves: set[int]) -> set[int]:
        """Return some leaves, and those in one cluster with them that has been merged for good."""
        found: set[int] = set()
        for leaf in leaves:
            if leaf in found:
                continue
            level = 0
            while level < self.tree.n_levels and leaf >> (level + 1) not in self._changing[level + 1]:
                level += 1
            begin = leaf >> level << level
            found.update(range(begin, begin + 2**level))
        return found

    def unknowns(self, leaves: IntArray) -> FloatArray:
        """Return the unknowns z (n, 2) of the elements of some leaves, in their order.

        Parameters
        ----------
        leaves : (n_leaves,) array
            Ascending.
        """
        parts = self._descend(self.errors()[:, None], leaves, self._loaded)
        return np.concatenate([np.zeros((0, 1)), *parts])[:, 0].reshape(-1, 2)

    def responses(self, leaf: int, given: FloatArray, leaves: IntArray) -> FloatArray:
        """Return the unknowns z (n, 2, k) of the elements of some leaves if nothing is given but in one leaf.

        Parameters
        ----------
        leaf : int
        given : (n_of_leaf, 4, k) array
            Replaces the given part of the laws there.
        leaves : (n_leaves,) array
            Ascending.
        """
        assert self.laws is not None  # `update` comes first
        k, n_levels = given.shape[2], self.tree.n_levels
        places = self.tree.places(0, leaf)
        path = [self._leaf(leaf, self.laws.factors[places], given.reshape(-1, k))]
        for level in range(1, n_levels + 1):
            below = leaf >> (level - 1)
            pair = path[-1], self._cluster(level - 1, below ^ 1).unloaded(k)
            path.append(self._merged(level, leaf >> level, *(pair if below % 2 == 0 else pair[::-1])))

        def cluster_at(level: int, cluster: int) -> _Cluster:
            return path[level] if cluster == leaf >> level else self._cluster(level, cluster).unloaded(k)

        parts = self._descend(self._of_border(path[-1]), leaves, cluster_at)
        return np.concatenate([np.zeros((0, k)), *parts]).reshape(-1, 2, k)

    def _descend(
        self, errors: FloatArray, leaves: IntArray, cluster_at: Callable[[int, int], _Cluster]
    ) -> list[FloatArray]:
        """Return the unknowns (2 n_elements, k) of some leaves from those of the border (n_border, k)."""
        felt = {0: errors}
        for level in range(self.tree.n_levels, 0, -1):
            wanted, below = set((leaves >> (level - 1)).tolist()), {}
            for number, of_cluster in felt.items():
                cluster = cluster_at(level, number)
                of_children = cluster.at_rest - cluster.response @ of_cluster
                n_one = self.compression.skeletons[level - 1][2 * number].rows.size
                for child, half in ((2 * number, of_children[:n_one]), (2 * number + 1, of_children[n_one:])):
                    if child in wanted:
                        below[child] = np.concatenate([half, errors])
            felt = below
        of_leaves = ((cluster_at(0, number), felt[number]) for number in leaves.tolist())
        return [leaf.at_rest - leaf.response @ of_leaf for leaf, of_leaf in of_leaves]

    def errors(self) -> FloatArray:
        """Return the unknowns (n_border,) of the boundary as a whole."""
        root = self._loaded(-1, 0)
        return self._of_border(replace(root, of_loads=root.of_loads - self.border_load[:, None]))[:, 0]

    @property
    def n_bytes(self) -> int:
        """Memory of all factors [bytes]."""
        return sum(each.n_bytes for level in self._levels for each in level if each is not None)

    def _leaf(self, number: int, factors: FloatArray, given: FloatArray) -> _Cluster:
        """Return a leaf under laws (n, 4, 2) and k loads (4 n, k)."""
        leaf, border = self._factored_leaf(number, factors), self.equations.border
        places, skeleton, n_rows = self.tree.places(0, number), self._skeleton(0, number), 2 * len(factors)
        felt = border.errors[2 * places.start : 2 * places.stop]
        if skeleton is not None:
            felt = np.concatenate([skeleton.row_map.matrix(), felt], axis=1)
        response = leaf.inverse.solve(felt)
        outgoing, at_rest = leaf.of_unknowns[:, n_rows:].T, np.zeros((n_rows, given.shape[1]))
        if given.any():
            at_rest = -leaf.inverse.solve(leaf.of_quantities[:, :n_rows].T @ given)
        alone = outgoing @ at_rest + leaf.of_quantities[:, n_rows:].T @ given
        return _Cluster(outgoing @ response, alone, response, at_rest)

    def _factored_leaf(self, number: int, factors: FloatArray) -> _Leaf:
        """Factor the equations of a leaf under laws (n, 4, 2); those of the only one are kept."""
        if self._only_leaf is not None and np.array_equal(self._only_leaf.factors, factors):
            return self._only_leaf
        self._only_leaf = None  # its memory is for the new one
        places, columns = self.tree.places(0, number), self.compression.unknowns[number]
        rows = np.arange(2 * places.start, 2 * places.stop)
        n, n_border, skeleton = len(factors), self.equations.border.errors.shape[1], self._skeleton(0, number)
        n_caused = 0 if skeleton is None else skeleton.columns.size
        # columns: the equations, then what is caused and added to the balances
        both = np.zeros((4 * n, rows.size + n_caused + n_border))
        both[columns - 4 * places.start, : rows.size] = self.equations.block(rows, columns).T
        if skeleton is not None:
            both[columns - 4 * places.start, rows.size : rows.size + n_caused] = skeleton.column_map.matrix()
        both[:, rows.size + n_caused :] = self.equations.border.balances[:, 4 * places.start : 4 * places.stop].T
        of_unknowns = (factors.transpose(0, 2, 1) @ both.reshape(n, 4, -1)).reshape(2 * n, -1)
        leaf = _Leaf(factors, both, of_unknowns, SmallLU(of_unknowns[:, : rows.size].T, SingularClusterError(n)))
        if self.tree.n_leaves == 1:
            self._only_leaf = leaf
        return leaf

    def _parent(self, level: int, cluster: int) -> _Cluster:
        changes = cluster in self._changing[level]
        one, two = map(partial(self._loaded if changes else self._cluster, level - 1), (2 * cluster, 2 * cluster + 1))
        merged = self._merged(level, cluster, one, two)
        if not changes:
            one.scattering = two.scattering = np.zeros((0, 0))
        return merged

    def _merged(self, level: int, cluster: int, one: _Cluster, two: _Cluster) -> _Cluster:
        """Merge two clusters under the same loads.

        What the rows of both feel is, with f what those of the parent feel and e the unknowns of the border,
        f1 + S12 W2 (f2, e) = R1 f + S12 a2 and the same with 1 and 2 exchanged. The second is put into the first.
        """
        on_one, on_two = self.compression.couplings(level - 1, cluster)
        n_border, n_one, n_two = self.equations.border.errors.shape[1], len(on_one), len(on_two)
        parent = self._skeleton(level, cluster)
        n_rows = 0 if parent is None else parent.rows.size
        n_felt, n_loads = n_rows + n_border, one.of_loads.shape[1]
        from_two, from_one = on_one @ two.scattering[: on_one.shape[1]], on_two @ one.scattering[: on_two.shape[1]]
        # columns: what the rows of the parent feel, the border, and the loads
        felt_one, felt_two = (np.zeros((n, n_felt + n_loads), order="F") for n in (n_one, n_two))
        if parent is not None:
            passed = parent.row_map.matrix()
            felt_one[:, :n_rows], felt_two[:, :n_rows] = passed[:n_one], passed[n_one:]
        felt_one[:, n_rows:n_felt], felt_two[:, n_rows:n_felt] = -from_two[:, n_two:], -from_one[:, n_one:]
        felt_one[:, n_felt:] = on_one @ two.of_loads[: on_one.shape[1]]
        felt_two[:, n_felt:] = on_two @ one.of_loads[: on_two.shape[1]]
        felt_one -= from_two[:, :n_two] @ felt_two
        left = np.eye(n_one) - from_two[:, :n_two] @ from_one[:, :n_one]
        felt_one = SmallLU(left, self._singular(level, cluster), 1.0).solve(felt_one)
        felt_two -= from_one[:, :n_one] @ felt_one
        caused = []
        for each, of_rows in ((one, felt_one), (two, felt_two)):
            causes = each.scattering[:, : len(of_rows)] @ of_rows
            causes[:, n_rows:n_felt] += each.scattering[:, len(of_rows) :]
            causes[:, n_felt:] -= each.of_loads
            caused.append(causes)
        skeletons = np.concatenate([causes[: len(causes) - n_border] for causes in caused])
        balances = sum(causes[len(causes) - n_border :] for causes in caused)
        of_parent = np.zeros((0, n_felt + n_loads)) if parent is None else parent.column_map.gather(skeletons)
        scattering, felt = np.concatenate([of_parent, balances]), np.concatenate([felt_one, felt_two])
        return _Cluster(
            np.ascontiguousarray(scattering[:, :n_felt]),
            -scattering[:, n_felt:],
            -felt[:, :n_felt],
            felt[:, n_felt:].copy(),
        )

    def _singular(self, level: int, cluster: int) -> SingularClusterError:
        places = self.tree.places(level, cluster)
        return SingularClusterError(places.stop - places.start)

    def _cluster(self, level: int, cluster: int) -> _Cluster:
        factored = self._levels[level][cluster]
        assert factored is not None  # `update` comes first, and children before their parents
        return factored

    def _loaded(self, level: int, cluster: int) -> _Cluster:
        """Return a cluster under the loads at hand: one that is merged for good knows those expected one by one."""
        factored = self._cluster(level, cluster)
        if cluster in self._changing[level]:
            return factored
        shares = self._loads.shares[:, None]
        return replace(factored, of_loads=factored.of_loads @ shares, at_rest=factored.at_rest @ shares)

    def _skeleton(self, level: int, cluster: int) -> Skeleton | None:
        """Return the skeleton of a cluster, none of the root."""
        return None if level == self.tree.n_levels else self.compression.skeletons[level][cluster]

    def _of_border(self, root: _Cluster) -> FloatArray:
        """Return the unknowns (n_border, k) of the boundary as a whole."""
        error = SingularMatrixError("the balance of forces is singular: check that supports and contacts hold the body")
        return SmallLU(root.scattering - self.equations.border.own, error).solve(root.of_loads)
