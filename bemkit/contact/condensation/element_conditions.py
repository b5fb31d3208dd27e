"""What contact sees of elements, and its conditions in their frames, supports that hold contact nodes included."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bemkit.arrays import BoolArray, FloatArray
from bemkit.contact.body import ContactState
from bemkit.contact.condensation.nodes import ContactNodes, held_nodes
from bemkit.contact.conditions import LinearConditions
from bemkit.operators.hierarchy.system import NodeConditions
from bemkit.operators.steklov_poincare.nodal_conditions import NodalConditions


@dataclass(frozen=True, eq=False)
class ElementConditions:
    """Contact components from tractions and displacements in the frames of elements, and conditions the other way.

    Parameters
    ----------
    of_traction, of_displacement : (n_contact, 2, 2) arrays
        ``sigma = of_traction @ t``, where t is the force of an element or node by its weight, and
        ``u = of_displacement @ u_local``. Where a support holds a node in one direction, what acts there is its
        reaction: the pressure is what the other one tells, and there is no friction.
    is_held : (n_contact,) bool array
        These nodes.
    support : (n_contact, 2) array
        The direction that the support holds in the frame of the element, zero elsewhere.
    given : (n_contact,) array [m]
        The displacement that it prescribes.
    """

    of_traction: FloatArray
    of_displacement: FloatArray
    is_held: BoolArray
    support: FloatArray
    given: FloatArray

    @classmethod
    def of(cls, conditions: NodalConditions, contact: ContactNodes, weights: FloatArray) -> ElementConditions:
        """Return what conditions and weights of all elements (n_elements,) and the frames of contact make of it."""
        nodes, is_held = contact.nodes, held_nodes(conditions, contact)
        turn = np.einsum("nkc,njc->nkj", contact.frame, conditions.frame[nodes])
        unit = np.broadcast_to(np.eye(2), turn.shape)
        moving = np.where(conditions.is_fixed[nodes], 0.0, 1.0)
        pressure = np.zeros_like(turn)
        pressure[:, 0] = moving / np.where(is_held, np.sum(moving * turn[:, 0], axis=1), 1.0)[:, None]
        support = np.where(is_held[:, None], 1.0 - moving, 0.0)
        return cls(
            of_traction=(weights[nodes] / contact.weights)[:, None, None]
            * np.where(is_held[:, None, None], pressure, unit),
            of_displacement=np.where(is_held[:, None, None], turn, unit),
            is_held=is_held,
            support=support,
            given=np.sum(support * conditions.displacement[nodes], axis=1),
        )

    def at_elements(self, conditions: LinearConditions) -> NodeConditions:
        """Return conditions of contact in the frames of the elements; held tangents follow their support."""
        on_traction = conditions.on_traction @ self.of_traction
        on_displacement = conditions.on_displacement @ self.of_displacement
        value = conditions.value.copy()
        held = self.is_held
        on_traction[held, 1], on_displacement[held, 1], value[held, 1] = 0.0, self.support[held], self.given[held]
        return NodeConditions(on_traction, on_displacement, value)

    def of_contact(self, traction: FloatArray, displacement: FloatArray) -> ContactState:
        """Return what contact sees of tractions and displacements (n_contact, 2) in the frames of the elements."""
        return ContactState(_times(self.of_displacement, displacement), _times(self.of_traction, traction))


def _times(matrices: FloatArray, vectors: FloatArray) -> FloatArray:
    product: FloatArray = np.einsum("nij,nj->ni", matrices, vectors)
    return product
