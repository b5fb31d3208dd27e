"""Rigid connections: boundary parts that move as rigid bodies under given resultants."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from bemkit.arrays import FloatArray, IntArray
from bemkit.errors import InputError
from bemkit.geometry.spaces import dof_points
from bemkit.operators.counts import OperationCounts
from bemkit.operators.linear_solvers import Tag
from bemkit.operators.rigid_modes import rigid_motions
from bemkit.operators.steklov_poincare import CondensedMap, SteklovPoincare, WrappedMap
from bemkit.operators.steklov_poincare.nodal_conditions import GivenData, NodalConditions


@dataclass(frozen=True, eq=False)
class RigidlyConnected(WrappedMap):
    """An elastic map with rigid connections; fulfils `SteklovPoincare`.

    The wrapped map takes the nodes of each connection as fixed. The three rigid motions q of a connection are unknown.
    The forces of the connection have the resultants of the given nodal forces, however these are distributed.

    Parameters
    ----------
    elastic : SteklovPoincare
        The wrapped map; symmetric.
    """

    @classmethod
    def of(cls, elastic: SteklovPoincare, method: str) -> RigidlyConnected:
        """Return a map with rigid connections; `method` names its discretisation in messages.

        Raises
        ------
        InputError
            If the map is not symmetric.
        """
        if Tag.SYMMETRIC not in elastic.tags:
            raise InputError(
                f"a part is a rigid connection, but the map of discretisation {method} is not symmetric: choose "
                "'linear', 'quadratic' or a degree"
            )
        return cls(elastic)

    def counts(self, conditions: NodalConditions, loads: Sequence[GivenData]) -> OperationCounts:
        """Return the counts of the wrapped map and of the responses to motions of connections."""
        responses = OperationCounts(right_hand_sides=3 * len(conditions.connected))
        return super().counts(conditions, loads) + responses

    def condense(self, conditions: NodalConditions, force: FloatArray) -> CondensedMap:
        """Condense the map and eliminate the motions of its connections; see `SteklovPoincare.condense`."""
        fixed = self.elastic.condense(conditions, force)
        connections = _Connections(fixed, conditions, dof_points(self.displacement_space))
        return connections.under(fixed, force, fixed.work + connections.work)

    def element_tractions(self, displacement: FloatArray, force: FloatArray) -> FloatArray:
        """Return the tractions (n_elements, n_local, 2) [Pa]; see `SteklovPoincare.element_tractions`."""
        return self.elastic.element_tractions(displacement, force)


class _Connections:
    """Responses of a body whose connected nodes are fixed to the k rigid motions of its connections.

    Attributes
    ----------
    displacement, force : (n_nodes, 2, k) arrays
        Fields of all nodes under unit motions, with retained directions at rest.
    coupling : (n_retained, k) array
        L: forces of unit motions on the retained directions.
    influence : (k, k) array
        A: resultants of the connections under unit motions.
    stiffness : (n_retained, n_retained) array
        K - L A^-1 L^T, the stiffness with the motions eliminated.
    """

    def __init__(self, fixed: CondensedMap, conditions: NodalConditions, points: FloatArray) -> None:
        self.motions = np.concatenate([_motions(nodes, points) for nodes in conditions.connected], axis=2)
        no_force, at_rest = np.zeros_like(points), np.zeros(len(fixed.load))
        in_frames = [conditions.in_frames(motion) for motion in np.moveaxis(self.motions, 2, 0)]
        self.unit_maps = tuple(fixed.under(no_force, motion) for motion in in_frames)
        fields = [unit_map.recover(at_rest) for unit_map in self.unit_maps]
        self.displacement, self.force = (np.stack([pair[k] for pair in fields], axis=2) for k in (0, 1))
        self.coupling = np.stack([unit_map.load for unit_map in self.unit_maps], axis=1)
        influence = np.einsum("ncj,nck->jk", self.motions, self.force)
        self.influence = 0.5 * (influence + influence.T)
        stiffness = fixed.stiffness - self.coupling @ np.linalg.solve(self.influence, self.coupling.T)
        self.stiffness = 0.5 * (stiffness + stiffness.T)

    @property
    def work(self) -> OperationCounts:
        """Return the operation counts of the responses."""
        return sum((unit_map.work for unit_map in self.unit_maps), OperationCounts())

    def under(self, fixed: CondensedMap, force: FloatArray, work: OperationCounts) -> CondensedMap:
        """Return the body under given nodal forces (n_nodes, 2), from the same body with fixed connections."""
        _, reaction = fixed.recover(np.zeros(len(fixed.load)))
        at_rest = np.linalg.solve(self.influence, np.einsum("nck,nc->k", self.motions, force - reaction))
        return _ConnectedMap(
            stiffness=self.stiffness,
            load=fixed.load + self.coupling @ at_rest,
            n_pressures=fixed.n_pressures,
            sensitivity=fixed.sensitivity,
            work=work,
            volume_force=fixed.volume_force,
            inner_force=fixed.inner_force,
            fixed=fixed,
            connections=self,
            at_rest=at_rest,
        )


@dataclass(frozen=True, eq=False, kw_only=True)
class _ConnectedMap(CondensedMap):
    """A body with rigid connections under one load."""

    fixed: CondensedMap  # the body with fixed connections
    connections: _Connections
    at_rest: FloatArray  # (k,): motions of the connections while the retained directions are at rest

    def recover(self, retained_displacement: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return displacement and force of all nodes."""
        connections = self.connections
        motion = self.at_rest + np.linalg.solve(connections.influence, connections.coupling.T @ retained_displacement)
        displacement, force = self.fixed.recover(retained_displacement)
        return displacement + connections.displacement @ motion, force + connections.force @ motion

    def under(self, force: FloatArray, displacement: FloatArray) -> CondensedMap:
        """Return the map under other loads."""
        fixed = self.fixed.under(force, displacement)
        return self.connections.under(fixed, force, fixed.work)

    def follow(self, directions: IntArray) -> tuple[FloatArray, FloatArray]:
        """Return response and displacement at rest of free directions."""
        connections, (response, at_rest) = self.connections, self.fixed.follow(directions)
        by_motions = np.stack([unit_map.follow(directions)[1] for unit_map in connections.unit_maps], axis=1)
        by_retained = np.linalg.solve(connections.influence, connections.coupling.T)
        return response + by_motions @ by_retained, at_rest + by_motions @ self.at_rest


def _motions(nodes: IntArray, points: FloatArray) -> FloatArray:
    """Return the displacements (n_nodes, 2, 3) of some nodes under three rigid motions; zero elsewhere."""
    connected, motions = points[nodes], np.zeros((*points.shape, 3))
    motions[nodes] = rigid_motions(connected, connected.mean(axis=0), float(np.ptp(connected, axis=0).max()))
    return motions
