"""One body between obstacles: relative displacements of its contact nodes determine its retained displacements.

See `bemkit.contact.joined` for bodies that touch each other.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from bemkit.arrays import FloatArray
from bemkit.contact.body import ContactState
from bemkit.contact.condensation.dense_body import DenseBody
from bemkit.contact.condensation.node_coupling import NodeCoupling
from bemkit.contact.condensation.nodes import ContactNodes
from bemkit.contact.condensation.whole_body import WholeBody
from bemkit.contact.equilibrium import Imbalance
from bemkit.operators.counts import OperationCounts
from bemkit.operators.steklov_poincare import CondensedMap
from bemkit.operators.steklov_poincare.forces_inside import ForcesInside
from bemkit.operators.steklov_poincare.nodal_conditions import NodalConditions


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
    def of(cls, whole: WholeBody, nodes: ContactNodes, modulus: float) -> DirectBody:
        """Return a body whose contact nodes are retained."""
        coupling = NodeCoupling.of(whole.conditions, nodes)
        motions = coupling.moved(whole.motions)
        stiffness = coupling.stiffness(whole.stiffness, motions)
        offset = _prescribed(whole.conditions, nodes)
        return cls(
            stiffness=stiffness,
            load=coupling.load(whole.load, stiffness, offset),
            weights=nodes.weights,
            motions=motions,
            following_tangents=coupling.following(offset),
            modulus=modulus,
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

    def under(self, displacement: FloatArray, force: FloatArray, inside: ForcesInside | None = None) -> DirectBody:
        """Return the same body under another load, without another factorisation; see `WholeBody.under`."""
        whole = self.whole.under(displacement, force, inside)
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
        return self.coupling.retained((state.displacement.ravel() - self.offset)[self.unknown_dofs])

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
