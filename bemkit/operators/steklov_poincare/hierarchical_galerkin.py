"""The symmetric Galerkin map whose equations are compressed over a tree instead of stored."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from bemkit.arrays import BoolArray, FloatArray
from bemkit.geometry.mesh import BoundaryMesh
from bemkit.geometry.spaces import BoundarySpace, dof_points
from bemkit.operators.forms import mass_product
from bemkit.operators.hierarchy.compression import Compression
from bemkit.operators.hierarchy.factor import Border
from bemkit.operators.hierarchy.galerkin_columns import GalerkinColumns
from bemkit.operators.hierarchy.system import HierarchicalSystem, NodeConditions
from bemkit.operators.hierarchy.tree import ClusterTree
from bemkit.operators.linear.solvers import Hierarchical
from bemkit.operators.material import Material
from bemkit.operators.rigid_modes import traction_free_modes
from bemkit.operators.steklov_poincare.galerkin import GalerkinElasticity
from bemkit.operators.steklov_poincare.hierarchical import HierarchicalMap
from bemkit.operators.steklov_poincare.layer_operators import dilatation_of
from bemkit.operators.steklov_poincare.nodal_conditions import NodalConditions

LEAF_SIZE = 110
"""Nodes and tractions of a leaf."""
_SAME = 1e-13
"""What two displacements differ by round-off, by the largest."""


@dataclass(frozen=True, eq=False)
class _Known:
    """Boundary operators of some displacements.

    Parameters
    ----------
    at_rest : (n_dofs, n_motions) array
        Rigid motions, orthonormal.
    trace, hyper : (n_traction_dofs, n_motions), (n_dofs, n_motions) arrays
        B and W of them: what the tolerance and curved elements leave of nothing.
    dilatation : tuple of (n_traction_dofs, 1) and (n_dofs, 1) arrays
        B and W of the dilatation, both made to vanish on rigid motions.
    """

    at_rest: FloatArray
    trace: FloatArray
    hyper: FloatArray
    dilatation: tuple[FloatArray, FloatArray]


class HierarchicalGalerkin(HierarchicalMap, GalerkinElasticity):
    """The map of `GalerkinElasticity` that solves over a tree.

    Parameters
    ----------
    mesh : BoundaryMesh
    material : Material
    options : Hierarchical
    displacement_space, traction_space : BoundarySpace
        As of `GalerkinElasticity`.

    Notes
    -----
    Instead of S = W + B^T V^-1 B the equations -V t + B u + R c = 0 and B^T t + W u + n p = f are solved, R holding
    resultants and n the change of volume: the answers are those of S.
    """

    keeps_rotations = True

    def __init__(
        self,
        mesh: BoundaryMesh,
        material: Material,
        options: Hierarchical,
        displacement_space: BoundarySpace | None = None,
        traction_space: BoundarySpace | None = None,
    ) -> None:
        super().__init__(mesh, material, displacement_space, traction_space)
        self.options = options
        self._asked: HierarchicalSystem | None = None

    @cached_property
    def columns(self) -> GalerkinColumns:
        """The dofs in the order of a tree."""
        return GalerkinColumns.of(self.displacement_space, self.traction_space, self.material, self._tree.order)

    @cached_property
    def compression(self) -> Compression:
        """The equations, compressed on first use, whatever the conditions are."""
        is_node = self.columns.is_node
        may_differ = np.repeat(np.stack([np.ones_like(is_node), is_node], axis=1), 2, axis=1)
        return Compression.of(self.columns, self._tree, may_differ, self.options.tolerance)

    @cached_property
    def _tree(self) -> ClusterTree:
        points = [dof_points(space) for space in (self.displacement_space, self.traction_space)]
        return ClusterTree.of(np.concatenate(points), LEAF_SIZE)

    @cached_property
    def _units(self) -> FloatArray:
        """(n_places,) units of the tractions by number, those of nodes first."""
        return self._by_number(self.columns.units)

    @cached_property
    def weights(self) -> FloatArray:
        """(n_nodes,) array [m]: integrals of the functions of the nodes."""
        return self._by_number(self.columns.weights)[: self.displacement_space.n_dofs // 2]

    def _by_number(self, values: FloatArray) -> FloatArray:
        """Return values (n_places,) of places by number, those of nodes first."""
        result = np.empty_like(values)
        result[self.columns.order] = values
        return result

    def system(self, conditions: NodalConditions, may_be_loaded: BoolArray, may_move: BoolArray) -> HierarchicalSystem:
        """Return the compressed equations of nodes and tractions."""
        volume, may_change = self._volume, np.any(conditions.is_retained, axis=1)
        self._asked = self._system(conditions.frame, volume.change, volume.yields, may_change)
        return self._asked

    def _system(
        self, frame: FloatArray, change: FloatArray, yields: float, may_change: BoolArray
    ) -> HierarchicalSystem:
        unit = self.mesh.diameter / self.mesh.n_elements / self.material.plane_modulus
        return HierarchicalSystem(self.compression, self._border(change, yields), frame, unit, may_change)

    def _without_pressure(self, displacement: FloatArray) -> FloatArray:
        """Return S u of the dilatation, whose tractions are the uniform pressure alone, without that pressure."""
        return self._known.dilatation[1]

    def _tractions_without_pressures(self, displacement: FloatArray) -> FloatArray:
        n, moved = self.displacement_space.n_dofs // 2, displacement.reshape(-1, 2)
        if self._asked is not None and self._asked.factor.is_current:  # what it was last solved for has both
            apart = np.abs(self._asked.everywhere()[1] - moved).max()
            if apart <= _SAME * np.abs(moved).max():
                return (self._asked.beyond() * self._units[n:, None]).ravel()
        system = self._system(np.tile(np.eye(2), (n, 1, 1)), np.zeros((2 * n, 0)), 0.0, np.zeros(n, bool))
        held = NodeConditions.given(np.ones((n, 2), bool), np.zeros((n, 2)), moved)
        none = np.zeros(0, np.intp)
        system.state(
            system.laws(held), none, NodeConditions(np.zeros((0, 2, 2)), np.zeros((0, 2, 2)), np.zeros((0, 2)))
        )
        return (system.beyond() * self._units[n:, None]).ravel()

    @cached_property
    def _known(self) -> _Known:
        u, n = self.displacement_space, self.displacement_space.n_dofs // 2
        at_rest, _ = np.linalg.qr(traction_free_modes(self.mesh, dof_points(u)))
        displacement = np.column_stack([at_rest, dilatation_of(u)])
        compression, k = self.compression, displacement.shape[1]
        n_places, order = self.columns.n_elements, self.columns.order
        values, equations = np.zeros((n_places, 2, 2, k)), np.empty((n_places, 2, k))
        values[:n, 1] = displacement.reshape(n, 2, k)
        equations[order] = compression.product(values[order].reshape(4 * n_places, k)).reshape(n_places, 2, k)
        equations /= self._units[:, None, None]
        trace, hyper = equations[n:].reshape(2 * (n_places - n), k), equations[:n].reshape(2 * n, k)
        along = at_rest.T @ displacement[:, -1:]
        of_hyper = hyper[:, -1:] - hyper[:, :-1] @ along
        dilatation = trace[:, -1:] - trace[:, :-1] @ along, of_hyper - at_rest @ (at_rest.T @ of_hyper)
        return _Known(at_rest, trace[:, :-1], hyper[:, :-1], dilatation)

    def _border(self, change: FloatArray, yields: float) -> Border:
        """Return what the boundary has as a whole.

        Unknowns and equations, one for one: the tractions exert no resultant, and take no part in the pressure; the
        pressure follows from the change of volume; rigid motions take no forces, and all forces are in equilibrium.
        """
        u, t = self.displacement_space, self.traction_space
        known = self._known
        at_rest, trace, hyper = known.at_rest, known.trace, known.hyper
        resultants = mass_product(u, t, traction_free_modes(self.mesh, dof_points(u)))
        if self.material.is_incompressible or self.mesh.is_exterior:
            pressed = mass_product(t, t, self._pressures)
        else:
            pressed = known.dilatation[0]
        n_idle, n_change, n_rest = resultants.shape[1] + pressed.shape[1], change.shape[1], at_rest.shape[1]
        n_u, n_t = u.n_dofs, t.n_dofs
        nothing = np.zeros((n_t, n_change)), np.zeros((n_u, n_idle))
        on_tractions = np.concatenate([resultants, pressed, nothing[0], -trace, np.zeros((n_t, n_rest))], axis=1)
        on_nodes = np.concatenate([nothing[1], change, -hyper, -at_rest], axis=1)
        of_tractions = np.concatenate([resultants, pressed, nothing[0], np.zeros((n_t, 2 * n_rest))], axis=1)
        of_nodes = np.concatenate([nothing[1], change, at_rest, np.zeros((n_u, n_rest))], axis=1)
        n_border = on_nodes.shape[1]
        own = np.zeros((n_border, n_border))
        own[n_idle : n_idle + n_change, n_idle : n_idle + n_change] = -yields
        own[n_border - 2 * n_rest : n_border - n_rest, n_border - 2 * n_rest : n_border - n_rest] = -np.eye(n_rest)
        order, n_places = self.columns.order, (n_u + n_t) // 2
        units = self._units[:, None, None]
        errors = (np.concatenate([on_nodes, on_tractions]).reshape(n_places, 2, n_border) * units)[order]
        balances = np.zeros((n_places, 2, 2, n_border))
        balances[: n_u // 2, 1] = of_nodes.reshape(n_u // 2, 2, n_border)
        balances[: n_u // 2, 0, :, n_border - n_rest :] = self.weights[:, None, None] * at_rest.reshape(
            n_u // 2, 2, n_rest
        )
        balances[n_u // 2 :, 0] = of_tractions.reshape(n_t // 2, 2, n_border) * units[n_u // 2 :]
        return Border(
            errors.reshape(2 * n_places, n_border),
            np.ascontiguousarray(balances[order].reshape(4 * n_places, n_border).T),
            own,
        )
