"""The nodes on the contact parts of a scene: the obstacle of each, its gap and the direction of contact."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from bemkit.arrays import BoolArray, FloatArray, IntArray
from bemkit.contact.contact_nodes import ContactNodes, contact_frame, nodes_on
from bemkit.contact.obstacle import Obstacle, measure_contact
from bemkit.geometry.local_values import dof_weights
from bemkit.geometry.mesh import BoundaryMesh
from bemkit.geometry.neighbours import along_boundary, arc_lengths
from bemkit.geometry.spaces import BoundarySpace, dof_points, element_nodes
from bemkit.scene.body_scene import BodyScene

SMOOTH_SIDE_COSINE = 0.866
"""Cosine of 30 degrees. Directions of contact at one node that differ by less belong to one smooth side."""
GAP_TOLERANCE = 1e-9
"""Difference of the gaps of two obstacles that are equally near a node, relative to the diameter of the body."""


@dataclass(frozen=True, eq=False)
class ContactData:
    """The contact nodes of a scene with their parts, gaps and places, in order along each contact part.

    Parameters
    ----------
    nodes : ContactNodes
        Dimensionless.
    parts : tuple of n_contact str
        The contact part that each node belongs to.
    arc_length : (n_contact,) array [m]
        From the start of that part.
    gap : (n_contact,) array [m]
        Distance to the obstacle along the direction of contact.
    facing : (n_contact,) array [-]
        Cosine of the angle between the direction of contact and the body's normal; of the nearer side at a corner.
    points : (n_contact, 2) array [m]
        Coordinates of the mesh: far from the origin, conversion from dimensionless points would move a node off its
        obstacle.
    """

    nodes: ContactNodes
    parts: tuple[str, ...]
    arc_length: FloatArray
    gap: FloatArray
    facing: FloatArray
    points: FloatArray


@dataclass(frozen=True)
class FacingPart:
    """A part of the boundary and an obstacle that it may touch. A part with several obstacles is listed with each.

    Parameters
    ----------
    name : str
        Of the contact.
    part : str
    obstacle : Obstacle
    is_frictionless : bool
    """

    name: str
    part: str
    obstacle: Obstacle
    is_frictionless: bool


def find_contact(
    scene: BodyScene, mesh: BoundaryMesh, space: BoundarySpace, further: Sequence[FacingPart] = ()
) -> ContactData:
    """Find the nodes that may touch an obstacle, held by supports or not.

    Parameters
    ----------
    scene : BodyScene
    mesh : BoundaryMesh
        In physical units.
    space : BoundarySpace
        The displacement space, on the dimensionless mesh.
    further : sequence of FacingPart, optional
        Obstacles that are not in the scene, such as other bodies.

    Notes
    -----
    A node that may touch several obstacles, of one part or of several, belongs to the nearest, and to the first of
    those that are equally near. Where the directions of several parts are alike, it represents its share of all of
    them. In a corner between two obstacles without friction it touches both, and has two rows. With friction two
    displacements do not fix four tractions: the share of the other obstacle goes to its next node, as at crosspoints
    of mortar methods [Wohlmuth2000].
    """
    parts = [
        FacingPart(part, part, obstacle, scene.laws[part].is_frictionless)
        for part, obstacle in scene.obstacles.items()
        if mesh.part(part).size  # none beyond a symmetry line
    ]
    parts += further
    if not parts:
        none, nowhere = np.zeros(0), np.zeros((0, 2))
        nodes = ContactNodes(none.astype(np.intp), nowhere, contact_frame(nowhere), none)
        return ContactData(nodes, (), none, none, none, nowhere)
    parts, sides = _nearest_of_each_part(
        parts, [_Side.of(one.obstacle, mesh.part(one.part), mesh, space) for one in parts]
    )
    # each node belongs to the nearest obstacle, in whose direction it touches
    owner = _owners(sides, space.n_dofs // 2, GAP_TOLERANCE * mesh.diameter)
    directions = _directions_of_owners(sides, owner)
    # a node in a corner without friction touches the other obstacle, too: a second row
    is_second = _second_rows(parts, sides, owner, directions)
    # second rows keep the length of their part; all other length goes to the owner's row of a node
    weights = np.zeros(owner.size)
    for side, second in zip(sides, is_second, strict=True):
        np.add.at(weights, side.receivers(directions)[~second], side.weights[~second])
    kept = [
        replace(side, weights=np.where(second, side.weights, weights[side.nodes])).take(
            second | (owner[side.nodes] == index)
        )
        for index, (side, second) in enumerate(zip(sides, is_second, strict=True))
    ]
    return _joined(parts, kept, space)


def _directions_of_owners(sides: Sequence[_Side], owner: IntArray) -> FloatArray:
    """Return the direction of contact (n_nodes, 2) of each node on the side that owns it; zero without an owner."""
    directions = np.zeros((owner.size, 2))
    for index, side in enumerate(sides):
        is_owned = owner[side.nodes] == index
        directions[side.nodes[is_owned]] = side.directions[is_owned]
    return directions


def _second_rows(
    parts: Sequence[FacingPart], sides: Sequence[_Side], owner: IntArray, directions: FloatArray
) -> list[BoolArray]:
    """Return for each side which of its nodes have a second row there: both parts frictionless, directions apart."""
    is_frictionless = np.array([part.is_frictionless for part in parts])
    return [
        is_frictionless[index]
        & is_frictionless[owner[side.nodes]]
        & side.crosses(directions)
        & (owner[side.nodes] != index)
        for index, side in enumerate(sides)
    ]


@dataclass(frozen=True, eq=False)
class _Side:
    """The nodes of one contact part, as in `ContactData`; weights are the part's own, runs its connected pieces."""

    nodes: IntArray
    runs: IntArray
    directions: FloatArray
    weights: FloatArray
    arc_length: FloatArray
    gap: FloatArray
    facing: FloatArray
    points: FloatArray

    @classmethod
    def of(cls, obstacle: Obstacle, elements: IntArray, mesh: BoundaryMesh, space: BoundarySpace) -> _Side:
        elements = along_boundary(mesh, elements)
        nodes, normals = nodes_on(space, elements)
        points = dof_points(space, mesh)[nodes]
        gap, directions = measure_contact(obstacle, points, normals)
        ends = mesh.elements[elements]
        element_runs = np.cumsum(ends[:, 0] != np.roll(ends[:, 1], 1))
        dofs = space.element_dofs[elements]
        places = element_nodes(space)[elements]
        arc_length, facing = np.full(space.n_dofs // 2, np.inf), np.full(space.n_dofs // 2, -1.0)
        runs = np.zeros(space.n_dofs // 2, np.intp)
        runs[dofs] = element_runs[:, None]
        np.minimum.at(arc_length, dofs, arc_lengths(mesh, elements, places))
        towards = np.zeros((space.n_dofs // 2, 2))
        towards[nodes] = directions
        np.maximum.at(facing, dofs, np.sum(mesh.normals_at(elements, places) * towards[dofs], axis=2))
        weights = dof_weights(space, elements)[nodes]
        return cls(nodes, runs[nodes], directions, weights, arc_length[nodes], gap, facing[nodes], points)

    def take(self, rows: BoolArray) -> _Side:
        return _Side(*(column[rows] for column in vars(self).values()))

    def crosses(self, directions: FloatArray) -> BoolArray:
        """Return (n,) bool: nodes that this side touches at 30 to 150 degrees to the directions (n_nodes, 2) given."""
        cosine = np.sum(directions[self.nodes] * self.directions, axis=1)
        return np.asarray((np.abs(cosine) <= SMOOTH_SIDE_COSINE) & np.isfinite(self.gap))

    def receivers(self, directions: FloatArray) -> IntArray:
        """Return the node (n,) to which the weight of each node goes: itself, or its neighbour on this side."""
        is_own = np.sum(directions[self.nodes] * self.directions, axis=1) > SMOOTH_SIDE_COSINE
        position = np.arange(self.nodes.size)
        following, before = np.minimum(position + 1, position[-1]), np.maximum(position - 1, 0)
        # the node listed next may lie on another piece of the boundary
        goes_on = (following > position) & (self.runs[following] == self.runs)
        goes_back = (before < position) & (self.runs[before] == self.runs)
        chosen = np.where(goes_on & (is_own[following] | ~goes_back), following, np.where(goes_back, before, position))
        return self.nodes[np.where(is_own, position, chosen)]


def _nearest_of_each_part(parts: Sequence[FacingPart], sides: Sequence[_Side]) -> tuple[list[FacingPart], list[_Side]]:
    """For each node of a part with several obstacles, keep only the row of the nearest."""
    kept = []
    for one, side in zip(parts, sides, strict=True):
        rivals = [number for number, other in enumerate(parts) if other.part == one.part]
        nearest = np.argmin([sides[number].gap for number in rivals], axis=0)
        owned = side.take(np.array([parts[rivals[k]] is one for k in nearest.tolist()]))
        if owned.nodes.size:
            kept.append((one, owned))
    return [one for one, _ in kept], [side for _, side in kept]


def _owners(sides: Sequence[_Side], n_nodes: int, same: float) -> IntArray:
    """Return (n_nodes,): the side of each node whose obstacle is nearest, -1 for nodes of none."""
    owner, nearest = np.full(n_nodes, -1), np.full(n_nodes, np.inf)
    for number, side in enumerate(sides):
        is_nearer = (owner[side.nodes] < 0) | (side.gap < nearest[side.nodes] - same)
        owner[side.nodes[is_nearer]] = number
        nearest[side.nodes[is_nearer]] = side.gap[is_nearer]
    return owner


def _joined(parts: Sequence[FacingPart], sides: Sequence[_Side], space: BoundarySpace) -> ContactData:
    columns = (np.concatenate(column) for column in zip(*(vars(side).values() for side in sides), strict=True))
    nodes, _, directions, weights, arc_length, gap, facing, points = columns
    of_node = [part for part, side in zip(parts, sides, strict=True) for _ in range(side.nodes.size)]
    contact_nodes = ContactNodes(nodes, dof_points(space)[nodes], contact_frame(directions), weights)
    return ContactData(contact_nodes, tuple(part.name for part in of_node), arc_length, gap, facing, points)
