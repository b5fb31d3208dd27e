"""Contact tractions on the elements of both sides, from those at the nodes with multipliers."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy import sparse

from bemkit.arrays import FloatArray, IntArray
from bemkit.geometry.local_values import projector
from bemkit.geometry.quadrature import gauss_legendre
from bemkit.geometry.spaces import BoundarySpace
from bemkit.model.assembled.contacts import ContactRows
from bemkit.model.assembled.placed import PlacedBody

_REACHED = 1e-12
"""Share of the largest coupling from which on a node takes part; less is round-off of places where meshes meet."""

_Entries = tuple[FloatArray, IntArray, IntArray]


@dataclass(frozen=True, eq=False)
class ContactSpread:
    """How the forces of contact nodes are spread over the elements of all contact sides.

    Parameters
    ----------
    by_force : sparse (n, n_contact) array [1/m]
        To tractions at the local nodes of the traction spaces, element by element, one side after the other.
    sides : tuple of (int, (m,) array, int)
        The sides: number of the body, elements, and values of each of them.

    Notes
    -----
    The nodal forces of a side over the integrals of its basis functions: with Gauss-Lobatto nodes that is exact for
    tractions of a degree less than the displacements, for any meshes. The integrals are those over all elements
    that the partner covers at least in part: an element where a partner ends carries its whole force, spread over its
    length. Forces of all contacts of a side are added up first.
    """

    by_force: sparse.csr_array
    sides: tuple[tuple[int, IntArray, int], ...]

    @classmethod
    def of(cls, bodies: Sequence[PlacedBody], contacts: Sequence[ContactRows]) -> ContactSpread:
        """Work out what the couplings of contacts say."""
        sides: dict[tuple[int, bytes], _Side] = {}
        n_contact = 0
        for rows in contacts:
            for number, coupling, elements, sign in _sides(rows):
                key = number, elements.tobytes()
                if key not in sides:
                    sides[key] = _Side(number, elements, bodies[number])
                sides[key].add(coupling, rows, n_contact, sign)
            n_contact += rows.n_contact
        collected = _stacked([(side.collected(), side.n_nodes, 0) for side in sides.values()], n_contact)
        spread = _stacked([(side.spread(), side.n_values, side.n_nodes) for side in sides.values()], collected.shape[0])
        layout = tuple((side.body, side.elements, len(side.projection)) for side in sides.values())
        return cls(sparse.csr_array(spread @ collected), layout)

    def tractions(self, forces: FloatArray) -> list[tuple[int, IntArray, FloatArray]]:
        """Return body, elements (m,) and tractions (m, n_local, 2) [Pa] in x and y of each side.

        Parameters
        ----------
        forces : (n_contact, 2) array [N/m]
            On the bodies with the contact nodes, in x and y.
        """
        ends = np.cumsum([elements.size * n_values for _, elements, n_values in self.sides])[:-1]
        return [
            (body, elements, own.reshape(elements.size, n_values, 2))
            for (body, elements, n_values), own in zip(self.sides, np.split(self.by_force @ forces, ends), strict=True)
        ]


class _Side:
    """Elements (m,) of a body in contact, and what their nodes take of the forces of contact nodes."""

    def __init__(self, body: int, elements: IntArray, placed: PlacedBody) -> None:
        self.body, self.elements, self.space = body, elements, placed.space
        self.projection = _projection(placed.space, placed.scene.discretisation.traction_space(placed.mesh))
        nodes, local = np.unique(placed.space.element_dofs[elements], return_inverse=True)
        self.local, self.reached = local.reshape(elements.size, -1), np.zeros(nodes.size)
        self.position = np.zeros(placed.space.n_dofs // 2, np.intp)
        self.position[nodes] = np.arange(nodes.size)
        self.entries: list[_Entries] = []

    def add(self, coupling: sparse.csr_array, rows: ContactRows, first: int, sign: float) -> None:
        """Take the coupling (n, n_nodes) of a contact whose nodes count on from the given one."""
        node, own = self.position[coupling.indices], np.repeat(np.arange(rows.n_contact), np.diff(coupling.indptr))
        self.entries.append((sign * coupling.data, node, first + own))
        np.add.at(self.reached, node, np.abs(coupling.data) * rows.weights[own])
        if not isinstance(rows.on_other, sparse.csr_array):  # an obstacle ends nowhere
            self.reached[:] = 1.0 + self.reached.max()

    @property
    def n_nodes(self) -> int:
        """Number of nodes."""
        return self.reached.size

    @property
    def n_values(self) -> int:
        """Number of tractions."""
        return self.elements.size * len(self.projection)

    def collected(self) -> _Entries:
        """Return how the nodes (n_nodes, n_contact) collect forces."""
        values, nodes, contact_nodes = (np.concatenate(each) for each in zip(*self.entries, strict=True))
        return values, nodes, contact_nodes

    def spread(self) -> _Entries:
        """Return the tractions (n_values, n_nodes) at the local nodes of elements, equivalent to nodal forces."""
        is_reached = self.reached > _REACHED * self.reached.max(initial=0.0)
        is_covered = is_reached[self.local].all(axis=1)
        # isolated nodes: on a sliver, or beside nodes that a support holds
        is_alone = is_reached.copy()
        is_alone[self.local[is_covered]] = False
        is_covered |= is_alone[self.local].any(axis=1)
        xi, weights = gauss_legendre(self.space.degree + 1)
        integrals = 0.5 * self.space.mesh.lengths[self.elements][:, None] * (self.space.basis(xi) @ weights)
        totals = np.bincount(self.local[is_covered].ravel(), integrals[is_covered].ravel(), self.reached.size)
        shares = is_covered[:, None] / np.where(totals > 0.0, totals, np.inf)[self.local]
        values = self.projection * shares[:, None]  # (m, n_values, n_local)
        rows = np.arange(self.n_values).reshape(values.shape[:2])
        row, column = np.broadcast_arrays(rows[..., None], self.local[:, None])
        return values.ravel(), row.ravel(), column.ravel()


def _stacked(blocks: Sequence[tuple[_Entries, int, int]], n_columns: int) -> sparse.csr_array:
    """Return the sparse array of blocks (values, rows, columns), so many rows and columns after each other."""
    first = np.cumsum([(0, 0), *((n_rows, n_beside) for _, n_rows, n_beside in blocks)], axis=0)
    values, rows, columns = (
        np.concatenate([np.zeros(0, kind), *parts])
        for kind, parts in (
            (float, [entries[0] for entries, _, _ in blocks]),
            (int, [entries[1] + begin for (entries, _, _), begin in zip(blocks, first[:, 0], strict=False)]),
            (int, [entries[2] + begin for (entries, _, _), begin in zip(blocks, first[:, 1], strict=False)]),
        )
    )
    return sparse.csr_array((values, (rows, columns)), (int(first[-1, 0]), n_columns))


def _sides(rows: ContactRows) -> list[tuple[int, sparse.csr_array, IntArray, float]]:
    """Return body, coupling (n, n_nodes), elements and sign of each side that a contact has."""
    sides = [(rows.body, rows.on_body, rows.elements, 1.0)]
    if isinstance(rows.on_other, sparse.csr_array):
        sides.append((rows.other, rows.on_other, rows.other_elements, -1.0))
    return sides


def _projection(space: BoundarySpace, of_tractions: BoundarySpace) -> FloatArray:
    """Return the projection (n_values, n_local) of fields at the nodes of displacements onto tractions of elements."""
    xi, weights = gauss_legendre(space.degree + 1)
    return projector(of_tractions, xi, weights) @ space.basis(xi).T
