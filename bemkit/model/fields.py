"""From nodal displacements and forces of bodies to energies and tractions, those in contact and those given."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from bemkit.arrays import FloatArray, IntArray
from bemkit.geometry.local_values import continued_to_ends, from_own_nodes, projector
from bemkit.geometry.mesh import BoundaryMesh
from bemkit.geometry.quadrature import gauss_legendre
from bemkit.geometry.spaces import BoundarySpace, dof_points
from bemkit.model.contacts import ContactInterface
from bemkit.model.placed import PlacedBody
from bemkit.operators.rigid_modes import without_motion
from bemkit.operators.steklov_poincare import SteklovPoincare
from bemkit.scene.body_scene import BodyScene
from bemkit.scene.conditions import DistributedLoad, Free

_MORE_POINTS = 4
"""Gauss points of an element at which given loads are evaluated, beyond the degree of the tractions."""
_REACHED = 1e-12
"""Least coupling of a node that takes part, relative to the largest; less is round-off at the ends of elements."""

_Entries = tuple[FloatArray, IntArray, IntArray]


def elastic_energy(
    elastic: SteklovPoincare, space: BoundarySpace, displacement: FloatArray, force: FloatArray
) -> float:
    """Return the elastic energy of the stresses in the plane, dimensionless, from nodal fields (n_nodes, 2)."""
    of_map, map_force = elastic.own_fields(displacement, force)
    # the forces are in equilibrium: on a rigid motion, which may be huge, they would only do the work of round-off
    strained = without_motion(space.mesh, dof_points(space), of_map)
    return 0.5 * float(np.sum(strained * map_force)) + float(elastic.further_energy(of_map, map_force).sum())


def insert_loads(
    traction: FloatArray, scene: BodyScene, mesh: BoundaryMesh, space: BoundarySpace, touching: Collection[str] = ()
) -> None:
    """Replace the tractions of loaded elements by the projection of the loads, of free elements by zero.

    Parameters
    ----------
    traction : (n_elements, n_local, 2) array [Pa]
        At the local nodes of their space; changed in place, but for elements in contact and those that supports hold.
    scene : BodyScene
    mesh : BoundaryMesh
        In physical units.
    space : BoundarySpace
        Of the tractions.
    touching : collection of str
        Free parts that other bodies touch: they are left as they are.
    """
    xi, weights = gauss_legendre(space.degree + 1 + _MORE_POINTS)
    projection = projector(space, xi, weights)
    is_free = np.ones(mesh.n_elements, bool)
    for part, elements in scene.parts_on(mesh):
        is_free[elements] = isinstance(part.condition, Free) and part.name not in touching
        if isinstance(part.condition, DistributedLoad):
            points, normals = mesh.points(elements, xi), mesh.normals_at(elements, xi)
            values = part.condition.at(points.reshape(-1, 2), normals.reshape(-1, 2)).reshape(points.shape)
            traction[elements] = np.einsum("lq,eqc->elc", projection, values)
    traction[is_free] = 0.0


class HeldForces(NamedTuple):
    """Forces of contact at nodes that supports hold, where contact has no node: of the tractions beside them.

    Parameters
    ----------
    bodies, nodes : (n,) int arrays
    neighbours : (n,) int array
        The contact node beside each.
    forces : (n, 2) array [N/m]
        On the body, in x and y.
    lengths : (n,) array [m]
        Of boundary on which they act.
    """

    bodies: IntArray
    nodes: IntArray
    neighbours: IntArray
    forces: FloatArray
    lengths: FloatArray


@dataclass(frozen=True, eq=False)
class TractionRecovery:
    """How the forces of contact nodes are spread over the elements of all contact sides.

    Notes
    -----
    The nodal forces of a side over the integrals of its basis functions: with Gauss-Lobatto nodes that is exact for
    tractions of a degree less than the displacements, for any meshes. The integrals are those over all elements
    that the partner covers at least in part: an element where a partner ends carries its whole force, spread over its
    length. Forces of all contacts of a side are added up first. A node at an obstacle that a support holds has no
    contact force: tractions beside it are continued to it.
    """

    sides: tuple[RecoveredSide, ...]

    @classmethod
    def of(cls, bodies: Sequence[PlacedBody], contacts: Sequence[ContactInterface]) -> TractionRecovery:
        """Compute the recovery from the couplings of contacts."""
        sides: dict[tuple[int, bytes], _Side] = {}
        first = 0
        for rows in contacts:
            for number, elements, side_of_rows in _sides(rows, first):
                key = number, elements.tobytes()
                if key not in sides:
                    sides[key] = _Side(number, elements, bodies[number])
                sides[key].add(rows, first, *side_of_rows)
            first += rows.n_contact
        return cls(tuple(side.recovered() for side in sides.values()))

    def tractions(self, forces: FloatArray) -> list[tuple[int, IntArray, FloatArray]]:
        """Return body, elements (m,) and tractions (m, n_local, 2) [Pa] in x and y of each side.

        Parameters
        ----------
        forces : (n_contact, 2) array [N/m]
            On the bodies with the contact nodes, in x and y.
        """
        return [(side.body, side.elements, side.tractions(forces)) for side in self.sides]

    def held_forces(self, forces: FloatArray) -> HeldForces:
        """Return the forces at held nodes, from those of contact nodes as for `tractions`."""
        none = np.zeros(0, np.intp)
        return HeldForces(
            np.concatenate([none, *(np.full(side.held.nodes.size, side.body) for side in self.sides)]),
            np.concatenate([none, *(side.held.nodes for side in self.sides)]),
            np.concatenate([none, *(side.held.neighbours for side in self.sides)]),
            np.concatenate([np.zeros((0, 2)), *(side.held_forces(forces) for side in self.sides)]),
            np.concatenate([np.zeros(0), *(side.held.lengths for side in self.sides)]),
        )


class _HeldNodes(NamedTuple):
    """Nodes at an obstacle that supports hold, to which the tractions of their elements go on.

    Parameters
    ----------
    nodes, neighbours, elements : (h,) int arrays
        Dofs, the contact node beside each, and positions of the elements.
    by_force : (h, n_local) array [1/m]
        Traction at the node by forces on the nodes of the element.
    shapes : (h, n_values) array [-]
        Tractions of the element by that at the node.
    lengths : (h,) array [m]
        Force by that traction; zero at rigid bodies, which are in equilibrium with the forces of contact nodes.
    """

    nodes: IntArray
    neighbours: IntArray
    elements: IntArray
    by_force: FloatArray
    shapes: FloatArray
    lengths: FloatArray


@dataclass(frozen=True, eq=False)
class RecoveredSide:
    """Elements (m,) of a body in contact, and their tractions under the forces of contact nodes.

    Parameters
    ----------
    body : int
    elements : (m,) array
    shares : (n,) array [-]
    contact_nodes, nodes : (n,) arrays
        The force of a contact node times a share acts on a node of the side.
    by_force : (m, n_values, n_local) array [1/m]
        Tractions at the local nodes of the traction space by forces on the nodes of an element.
    local : (m, n_local) array
        The nodes of each element.
    held : _HeldNodes
    """

    body: int
    elements: IntArray
    shares: FloatArray
    contact_nodes: IntArray
    nodes: IntArray
    by_force: FloatArray
    local: IntArray
    held: _HeldNodes

    def tractions(self, forces: FloatArray) -> FloatArray:
        """Return the tractions (m, n_values, 2) [Pa] under forces (n_contact, 2) [N/m] of contact nodes."""
        tractions = np.asarray(self.by_force @ self._on_side(forces)[self.local])
        if self.held.nodes.size:
            np.add.at(tractions, self.held.elements, self.held.shapes[:, :, None] * self._at_held(forces)[:, None])
        return tractions

    def held_forces(self, forces: FloatArray) -> FloatArray:
        """Return the forces (h, 2) [N/m] at held nodes under those of contact nodes."""
        if not self.held.nodes.size:
            return np.zeros((0, 2))
        return np.asarray(self.held.lengths[:, None] * self._at_held(forces))

    def _at_held(self, forces: FloatArray) -> FloatArray:
        """Return the tractions (h, 2) [Pa] at held nodes: none against that of the contact node beside it."""
        at_nodes = self._on_side(forces)[self.local[self.held.elements]]
        tractions = np.einsum("hl,hlc->hc", self.held.by_force, at_nodes)
        is_along = np.sum(tractions * forces[self.held.neighbours], axis=1) > 0.0
        return np.where(is_along[:, None], tractions, 0.0)

    def _on_side(self, forces: FloatArray) -> FloatArray:
        """Return the forces on the nodes of the side."""
        on_side = np.zeros((int(self.local.max()) + 1, 2))
        np.add.at(on_side, self.nodes, self.shares[:, None] * forces[self.contact_nodes])
        return on_side


class _Side:
    """Collects which contact nodes act on the nodes of elements (m,) of a body."""

    def __init__(self, body: int, elements: IntArray, placed: PlacedBody) -> None:
        self.body, self.elements, self.space = body, elements, placed.space
        self.projection = _projection(placed.space, placed.traction_space)
        nodes, local = np.unique(placed.space.element_dofs[elements], return_inverse=True)
        self.local, self.reached = local.reshape(elements.size, -1), np.zeros(nodes.size)
        self.dofs, self.has_force = nodes, np.zeros(nodes.size, bool)
        self.is_at_obstacle = self.is_fixed = False
        self.position = np.zeros(placed.space.n_dofs // 2, np.intp)
        self.position[nodes] = np.arange(nodes.size)
        self.entries: list[_Entries] = []

    def add(
        self, rows: ContactInterface, first: int, shares: FloatArray, contact_nodes: IntArray, nodes: IntArray
    ) -> None:
        """Take a contact whose nodes count on from the given one."""
        nodes = self.position[nodes]
        self.has_force[nodes] = True
        self.entries.append((shares, contact_nodes, nodes))
        np.add.at(self.reached, nodes, np.abs(shares) * rows.weights[contact_nodes - first])
        if rows.couplings is None:  # an obstacle ends nowhere
            self.is_at_obstacle, self.is_fixed = True, rows.other < 0
            self.reached[:] = 1.0 + self.reached.max()

    def recovered(self) -> RecoveredSide:
        """Return the tractions of the elements equivalent to the forces of nodes."""
        is_reached = self.reached > _REACHED * self.reached.max(initial=0.0)
        is_covered = is_reached[self.local].all(axis=1)
        # isolated nodes: on a sliver, or beside nodes that a support holds
        is_alone = is_reached.copy()
        is_alone[self.local[is_covered]] = False
        is_covered |= is_alone[self.local].any(axis=1)
        xi, weights = gauss_legendre(self.space.degree + 1)
        # from values at the dofs of elements, of which those of lower degree have fewer, to the local nodes
        n_local = self.local.shape[1]
        unit = np.broadcast_to(np.eye(n_local), (self.elements.size, n_local, n_local))
        lifting = from_own_nodes(self.space, unit, self.elements)
        half_lengths = 0.5 * self.space.mesh.lengths[self.elements][:, None]
        integrals = half_lengths * np.einsum("l,elk->ek", self.space.basis(xi) @ weights, lifting)
        totals = np.bincount(self.local[is_covered].ravel(), integrals[is_covered].ravel(), self.reached.size)
        shares = is_covered[:, None] / np.where(totals > 0.0, totals, np.inf)[self.local]
        shapes = self.projection @ lifting  # (m, n_values, n_local)
        held = self._held(shapes, integrals, shares)
        values = shapes * shares[:, None]
        shares, contact_nodes, nodes = (np.concatenate(each) for each in zip(*self.entries, strict=True))
        return RecoveredSide(self.body, self.elements, shares, contact_nodes, nodes, values, self.local, held)

    def _held(self, shapes: FloatArray, integrals: FloatArray, shares: FloatArray) -> _HeldNodes:
        has_force = self.has_force[self.local] | (not self.is_at_obstacle)
        element, k, factors = continued_to_ends(self.space, self.elements, has_force)
        contact_node = np.zeros(self.has_force.size, np.intp)
        for _, contact_nodes, nodes in self.entries:
            contact_node[nodes] = contact_nodes
        local, each = self.local[element], np.arange(k.size)
        distances = np.where(has_force[element], np.abs(np.arange(local.shape[1]) - k[:, None]), np.inf)
        return _HeldNodes(
            nodes=self.dofs[local[each, k]],
            neighbours=contact_node[local[each, distances.argmin(axis=1)]],
            elements=element,
            by_force=factors * shares[element],
            shapes=shapes[element, :, k],
            lengths=integrals[element, k] * self.is_fixed,
        )


def _sides(rows: ContactInterface, first: int) -> list[tuple[int, IntArray, _Entries]]:
    """Return body, elements, and signed shares, contact nodes and nodes of each side that a contact has."""
    numbers = first + np.arange(rows.n_contact)
    if rows.couplings is None:
        return [(rows.body, rows.elements, (np.ones(rows.n_contact), numbers, rows.nodes))]
    sides: list[tuple[int, IntArray, _Entries]] = []
    pairs = zip(rows.sides, (rows.elements, rows.other_elements), rows.couplings, (1.0, -1.0), strict=True)
    for body, elements, on_nodes, sign in pairs:
        owners = np.repeat(numbers, np.diff(on_nodes.indptr))
        sides.append((body, elements, (np.asarray(sign * on_nodes.data), owners, np.asarray(on_nodes.indices))))
    return sides


def _projection(space: BoundarySpace, of_tractions: BoundarySpace) -> FloatArray:
    """Return the projection (n_values, n_local) of fields at the nodes of displacements onto tractions of elements."""
    xi, weights = gauss_legendre(space.degree + 1)
    return projector(of_tractions, xi, weights) @ space.basis(xi).T
