"""One body between obstacles: relative displacements of its contact nodes determine its retained displacements.

See `bemkit.contact.joined` for bodies that touch each other.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from bemkit.arrays import FloatArray
from bemkit.contact.body import ContactState
from bemkit.contact.contact_nodes import ContactNodes, NodeCoupling, resisting_none, with_work
from bemkit.contact.dense_body import DenseBody
from bemkit.contact.equilibrium import NOISE_FACTOR, Imbalance, Unbalanced, resultant_imbalance, round_off_of
from bemkit.geometry.spaces import BoundarySpace, dof_points
from bemkit.operators.counts import OperationCounts
from bemkit.operators.rigid_modes import admissible_modes, rigid_motions
from bemkit.operators.steklov_poincare import CondensedMap
from bemkit.operators.steklov_poincare.nodal_conditions import NodalConditions, free_modes

if TYPE_CHECKING:
    from bemkit.operators.material import Material
    from bemkit.operators.steklov_poincare.forces_inside import ForcesInside


_RIGID = 1e-6
"""Share of the displacement up to which a body counts as moved rigidly: nearly incompressible bodies recover a rigid
motion to 1e-8."""


@dataclass(frozen=True, eq=False)
class WholeBody:
    """A body under its loads and supports, condensed to its retained directions.

    Parameters
    ----------
    condensed : CondensedMap
    conditions : NodalConditions
        Of the displacement nodes.
    force : (n_nodes, 2) array [N/m]
        Given nodal forces, in x and y.
    points : (n_nodes, 2) array [m]
        Where the nodal forces act.
    modes : (n_motions, n_nodes, 2) array
        The rigid motions that no support resists, in x and y.
    balanced : tuple of int
        Which of the resultants along x and y and the moment (0, 1, 2) vanish: not those of an exterior, which is at
        rest far away, nor those that the images of a symmetric body balance.
    """

    condensed: CondensedMap
    conditions: NodalConditions
    force: FloatArray
    points: FloatArray
    modes: FloatArray
    balanced: tuple[int, ...] = (0, 1, 2)

    @classmethod
    def of(
        cls,
        space: BoundarySpace,
        condensed: CondensedMap,
        conditions: NodalConditions,
        force: FloatArray,
        modes: FloatArray | None = None,
    ) -> WholeBody:
        """Return the body of a map condensed under these conditions and forces; `modes` are found if not given."""
        modes = free_modes(space, conditions) if modes is None else modes
        return cls(condensed, conditions, force, dof_points(space), modes, admissible_modes(space.mesh))

    @cached_property
    def motions(self) -> FloatArray:
        """(n_motions, n_retained) array: the rigid motions along the retained directions."""
        along = np.einsum("nkc,mnc->mnk", self.conditions.frame, self.modes)
        return np.pad(along[:, self.conditions.is_retained], ((0, 0), (0, self.condensed.n_pressures)))

    @cached_property
    def stiffness(self) -> FloatArray:
        """(n_retained, n_retained) array: the condensed stiffness, which resists no rigid motion."""
        return resisting_none(self.condensed.stiffness, self.motions)

    @cached_property
    def load(self) -> FloatArray:
        """(n_retained,) array: the condensed load, which does on rigid motions the work of all given forces."""
        condensed = self.condensed
        work, size = np.einsum("mnc,nc->m", self.modes, self.force), float(np.abs(self.force).sum())
        if condensed.volume_force is not None:
            unit = rigid_motions(self.points, np.zeros(2), 1.0).reshape(-1, 3)
            amounts = np.linalg.lstsq(unit, self.modes.reshape(len(self.modes), unit.shape[0]).T, rcond=None)[0]
            work += condensed.volume_force @ amounts
            size += float(np.abs(condensed.volume_force[:2]).sum()) + condensed.inner_force
        return with_work(condensed.load, self.motions, work, size)

    def under(self, force: FloatArray, displacement: FloatArray, inside: ForcesInside | None = None) -> WholeBody:
        """Return the same body under another load, without another factorisation.

        Parameters
        ----------
        force : (n_nodes, 2) array [N/m]
            Given nodal forces.
        displacement : (n_nodes, 2) array [m]
            Prescribed displacements in the frames of the nodes, as in `NodalConditions`.
        inside : ForcesInside, optional
            Body forces, if they change.
        """
        from bemkit.operators.steklov_poincare.forces_inside import condensed_under

        conditions = replace(self.conditions, displacement=displacement)
        condensed = condensed_under(self.condensed, conditions, force, inside)
        other = replace(
            self,
            condensed=replace(condensed, work=self.condensed.work + condensed.work),
            force=force,
            conditions=conditions,
        )
        return other

    def fields(self, retained: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return displacement and total force (n_nodes, 2) of all nodes, in x and y, from retained displacements."""
        return self.condensed.recover(retained)

    def imbalance(self, of_contact: Unbalanced, retained: FloatArray, column_sums: FloatArray) -> Imbalance:
        """Return how far all forces on the body (loads, contact, reactions) are from equilibrium.

        Parameters
        ----------
        of_contact : Unbalanced
            Imbalance of the contact nodes.
        retained : (n_retained,) array [m]
        column_sums : (n,) array [Pa]
            Sums of the sizes of the columns of the stiffness at the contact nodes.

        Notes
        -----
        Prescribed displacements would cause any forces on a clamped body, so the condensed load is too large a measure;
        the forces at hand are the measure. Their round-off is that of the terms whose differences they are: the forces
        are small differences in thin bodies and in those that move far.
        """
        displacement, force = self.fields(retained)
        largest = float(np.abs(displacement).max())
        of_forces = round_off_of(displacement, self.condensed.sensitivity)
        round_off = max(of_forces, float(np.finfo(float).eps * largest * column_sums.sum()))
        noise = NOISE_FACTOR * round_off
        reaction = float(np.abs(self.conditions.in_frames(force)[self.conditions.is_fixed]).max(initial=0.0))
        result = of_contact.relative_to(self._given_forces, reaction if reaction > noise else 0.0, round_off)
        if not self.balanced or (np.abs(force).sum() <= noise and self._only_moves(displacement)):
            return result
        resultant, inner = self.condensed.volume_force, self.condensed.inner_force
        return result.joined(resultant_imbalance(self.points, force, self.balanced, of_forces, resultant, inner))

    @cached_property
    def _given_forces(self) -> FloatArray:
        """Forces besides contact, in directions that no support holds, and body forces [N/m]."""
        given, resultant = self.conditions.in_frames(self.force)[~self.conditions.is_fixed], self.condensed.volume_force
        return given if resultant is None else np.append(given, [*resultant[:2], self.condensed.inner_force])

    def _only_moves(self, displacement: FloatArray) -> bool:
        """Whether the body has moved rigidly."""
        motions = rigid_motions(self.points, self.points.mean(axis=0), float(np.ptp(self.points, axis=0).max()))
        motions = motions.reshape(-1, 3)
        rigid = motions @ np.linalg.lstsq(motions, displacement.ravel(), rcond=None)[0]
        return bool(np.abs(displacement.ravel() - rigid).max() <= _RIGID * np.abs(displacement).max())


@dataclass(frozen=True, eq=False, kw_only=True)
class DirectBody(DenseBody):
    """An elastic body seen from its contact nodes, and the way back to its whole boundary.

    Parameters
    ----------
    whole : WholeBody
    coupling : NodeCoupling
    nodes : ContactNodes
    offset : (2 n_contact,) array [m]
        Relative displacements that supports prescribe.
    """

    whole: WholeBody
    coupling: NodeCoupling
    nodes: ContactNodes
    offset: FloatArray

    @classmethod
    def of(cls, whole: WholeBody, nodes: ContactNodes, material: Material) -> DirectBody:
        """Return a body whose contact nodes are retained."""
        coupling = NodeCoupling.of(whole.conditions, nodes, whole.condensed.n_pressures)
        motions = coupling.moved(whole.motions)
        stiffness = coupling.stiffness(whole.stiffness, motions)
        offset = _prescribed(whole.conditions, nodes)
        return cls(
            stiffness=stiffness,
            load=coupling.load(whole.load, stiffness, offset),
            weights=nodes.weights,
            motions=motions,
            following_tangents=coupling.following(offset),
            modulus=material.plane_modulus,
            n_pressures=whole.condensed.n_pressures,
            largest_modulus=max(material.plane_modulus, material.bulk_modulus),
            whole=whole,
            coupling=coupling,
            nodes=nodes,
            offset=offset,
        )

    @property
    def condensed(self) -> CondensedMap:
        """The condensed map of the body."""
        return self.whole.condensed

    @property
    def conditions(self) -> NodalConditions:
        """Conditions of the displacement nodes."""
        return self.whole.conditions

    @property
    def work(self) -> OperationCounts:
        """Operation counts from the operators on."""
        return self.whole.condensed.work + OperationCounts(contact_unknowns=self.n_unknowns)

    def under(self, force: FloatArray, displacement: FloatArray, inside: ForcesInside | None = None) -> DirectBody:
        """Return the same body under another load, without another factorisation; see `WholeBody.under`."""
        whole = self.whole.under(force, displacement, inside)
        offset = _prescribed(whole.conditions, self.nodes)
        return replace(
            self,
            whole=whole,
            offset=offset,
            load=self.coupling.load(whole.load, self.stiffness, offset),
            following_tangents=self.coupling.following(offset),
        )

    def retained(self, state: ContactState) -> FloatArray:
        """Return the retained displacements (n_retained,) [m] of a state."""
        unknowns = self.unknowns_of(state)
        unknowns[: self.n_unknowns] -= self.offset[self.unknown_dofs]
        return self.coupling.retained(unknowns)

    def recover(self, state: ContactState) -> tuple[FloatArray, FloatArray]:
        """Return displacement (n_nodes, 2) and total force (n_nodes, 2) of all boundary nodes, in x and y."""
        return self.whole.fields(self.retained(state))

    def imbalance(self, state: ContactState) -> Imbalance:
        """Return how far all forces on the body (loads, contact, reactions) are from equilibrium.

        The numbers also cover the contact nodes themselves; see `DenseBody.unbalanced`, `WholeBody.imbalance`.
        """
        return self.whole.imbalance(self.unbalanced(state), self.retained(state), self._column_sizes[1])


def _prescribed(conditions: NodalConditions, nodes: ContactNodes) -> FloatArray:
    """Return the relative displacements (2 n_contact,) that supports prescribe."""
    fixed = np.where(conditions.is_fixed, conditions.displacement, 0.0)[nodes.nodes]
    given = np.einsum("nkc,nk->nc", conditions.frame[nodes.nodes], fixed)
    return np.asarray(np.einsum("nkc,nc->nk", nodes.frame, given)).ravel()
