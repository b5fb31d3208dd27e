"""The unknowns of the contact system, and the tangential displacements that follow them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bemkit.arrays import BoolArray, FloatArray, IntArray
from bemkit.contact.condensation.dense_body import FreeTangents
from bemkit.contact.condensation.nodes import ContactNodes
from bemkit.operators.steklov_poincare import CondensedMap
from bemkit.operators.steklov_poincare.nodal_conditions import NodalConditions


@dataclass(frozen=True, eq=False)
class Unknowns:
    """The displacements of the contact nodes that the contact system solves for.

    Parameters
    ----------
    numbers : (n_unknowns,) array
        ``2 node + component`` of each.
    to_open, offset : (n_open, n_unknowns) array [-], (n_open,) array [m]
        Displacements of the open directions from the unknowns.
    """

    numbers: IntArray
    to_open: FloatArray
    offset: FloatArray

    def opened(self, unknowns: FloatArray) -> FloatArray:
        """Return the displacements of the open directions."""
        return self.to_open @ unknowns + self.offset

    def load(self, condensed: CondensedMap) -> FloatArray:
        """Return the load of a condensed map on the unknowns."""
        return self.to_open.T @ (condensed.load - condensed.stiffness @ self.offset)


def find_unknowns(conditions: NodalConditions, contact: ContactNodes, tangent_is_free: BoolArray) -> Unknowns:
    """Return the unknowns, and how the open directions follow from them.

    Parameters
    ----------
    conditions : NodalConditions
        The contact nodes open.
    contact : ContactNodes
    tangent_is_free : (n_contact,) bool array
        Nodes whose tangential displacement is no unknown.

    Returns
    -------
    Unknowns
    """
    open_directions = np.flatnonzero(conditions.is_open)
    number = np.full(conditions.is_open.size, -1)
    number[open_directions] = np.arange(open_directions.size)
    number = number.reshape(-1, 2)[contact.nodes]
    is_supported = conditions.is_fixed[contact.nodes].any(axis=1)
    matrix, offset = np.zeros((open_directions.size, 2 * contact.nodes.size)), np.zeros(open_directions.size)
    for component in range(2):
        own = np.flatnonzero(~is_supported & (number[:, component] >= 0))
        matrix[number[own, component], 2 * own + component] = 1.0
    for k in np.flatnonzero(is_supported):  # a handful: nodes where a support meets the contact boundary
        node = contact.nodes[k]
        free = int(np.argmax(number[k]))
        along = conditions.frame[node] @ contact.directions[k]
        matrix[number[k, free], 2 * k] = 1.0 / along[free]
        offset[number[k, free]] = -along[1 - free] * conditions.displacement[node, 1 - free] / along[free]
    is_unknown = np.ones((contact.nodes.size, 2), bool)
    is_unknown[tangent_is_free, 1] = False
    numbers = np.flatnonzero(is_unknown)
    return Unknowns(numbers, matrix[:, numbers], offset)


def find_free_tangents(
    conditions: NodalConditions,
    contact: ContactNodes,
    tangent_is_free: BoolArray,
    unknowns: Unknowns,
    condensed: CondensedMap,
) -> FreeTangents | None:
    """Return how the tangential displacements that are no unknowns follow them, None if there are none."""
    chosen = np.flatnonzero(tangent_is_free)
    if not chosen.size:
        return None
    nodes = contact.nodes[chosen]
    is_eliminated = conditions.is_free[nodes, 1]
    response, at_rest = np.zeros((chosen.size, unknowns.numbers.size)), np.zeros(chosen.size)
    followed, rest = condensed.follow(2 * nodes[is_eliminated] + 1)
    response[is_eliminated] = followed @ unknowns.to_open
    at_rest[is_eliminated] = rest + followed @ unknowns.offset
    # where a support holds the node, the frame of the support leads from one component to the other
    for k in np.flatnonzero(~is_eliminated):
        along = conditions.frame[nodes[k]] @ contact.frame[chosen[k]].T
        free = int(np.argmax(conditions.is_open[nodes[k]]))
        column = int(np.searchsorted(unknowns.numbers, 2 * chosen[k]))
        given = conditions.displacement[nodes[k], 1 - free]
        response[k, column] = along[free, 1] / along[free, 0]
        at_rest[k] = (along[1 - free, 1] - along[free, 1] * along[1 - free, 0] / along[free, 0]) * given
    return FreeTangents(chosen, response, at_rest)


def find_tangents(conditions: NodalConditions, contact: ContactNodes) -> BoolArray:
    """Return (n_contact,) bool: where the tangential displacement follows the unknowns.

    That is at nodes without friction, but for the few that are kept open, and wherever a support holds the node: what
    acts there along the tangent cannot be told from the reaction of the support.
    """
    return np.asarray(~np.all(conditions.is_open[contact.nodes], axis=1))
