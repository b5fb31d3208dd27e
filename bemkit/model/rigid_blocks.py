"""The bodies of a scene as rigid blocks: their motions, loads, and the forces that their joints transmit."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy import sparse

from bemkit.arrays import FloatArray, IntArray
from bemkit.contact.laws import FrictionLaw
from bemkit.contact.mortar.coupling import facing_segments
from bemkit.contact.mortar.segments import facing_points
from bemkit.contact.mortar.sides import ContactSide
from bemkit.contact.obstacle import Obstacle, measure_contact
from bemkit.contact.solvability import envelopes_of
from bemkit.geometry.spaces import dof_points
from bemkit.geometry.vectors import norms, turned_left
from bemkit.model.body_contacts import reach_of, touching_pairs
from bemkit.model.contacts import check_overlap
from bemkit.model.given import held_nodes, nodal_forces
from bemkit.model.particular import particular_solution
from bemkit.model.placed import PlacedBody, with_found_contacts
from bemkit.operators.rigid_modes import rigid_motions
from bemkit.operators.steklov_poincare.forces_inside import ForcesInside
from bemkit.operators.steklov_poincare.nodal_conditions import free_modes
from bemkit.scene.conditions import name_at_obstacle
from bemkit.scene.contacts import ContactPair
from bemkit.scene.scene import Scene

_ENDS = np.array([-1.0, 1.0])
_SAMPLES = np.linspace(-1.0, 1.0, 9)
"""Local points of an element at which the obstacle is tested."""
_N_HALVINGS = 50
"""To the end of a joint between two samples."""
_NO_FORCE = 1e-9
"""Share of the largest force below which it is round-off."""


@dataclass(frozen=True, eq=False)
class Joint:
    """Pieces of a contact, and their ends, where forces are transmitted.

    A pressure between the ends of a straight piece has the resultant of two forces at the ends, so that a straight
    joint is exact on any mesh.

    Parameters
    ----------
    name : str
        Of the contact in results.
    body, other : int
        The blocks on both sides: rigid bodies count on after the elastic ones, and a fixed obstacle is -1.
    points, touched : (n, 2) arrays [m]
        The ends on the body, and the points of the partner that they touch.
    directions : (n, 2) array [-]
        Unit vectors of contact, out of the body.
    lengths : (n,) array [m]
        Half of the piece.
    law : FrictionLaw
        At these points.
    """

    name: str
    body: int
    other: int
    points: FloatArray
    touched: FloatArray
    directions: FloatArray
    lengths: FloatArray
    law: FrictionLaw


@dataclass(frozen=True, eq=False)
class Block:
    """One rigid block.

    Parameters
    ----------
    centre : (2,) array [m]
    length : float [m]
        Motions are velocities at the centre, and the rate of rotation times this length.
    motions : (3, k) array
        Those that no support resists, as columns.
    load : (k,) array [N/m]
        The work of the load on them.
    """

    centre: FloatArray
    length: float
    motions: FloatArray
    load: FloatArray

    def at(self, points: FloatArray) -> FloatArray:
        """Return the velocities (n, 2, k) of points (n, 2) [m]."""
        return np.asarray(rigid_motions(points, self.centre, self.length) @ self.motions)


@dataclass(frozen=True, eq=False)
class JointForces:
    """Forces between rigid blocks, in balance with their loads.

    Parameters
    ----------
    value : float [N/m]
        The component of the force on a contact that is smallest or largest.
    points, forces : (n, 2) arrays [m], [N/m]
        Where forces act on bodies, and these forces, in the coordinates of the scene.
    pressing : (n,) array [N/m]
        Their components normal to the joints, not negative.
    joints : (n,) array
        The joint of each point, by its position in `names`.
    names : tuple of str
        The contacts.
    blocks : (n_joints, 2) array
        The bodies on both sides, by their position in `bodies`; -1 is a fixed obstacle.
    bodies : tuple of str
    settlement : mapping of str to (float, float, float)
        Motion of each body that moves when the support of the contact yields by a unit length [m]: displacements of its
        middle, and rotation [1/m].
    """

    value: float
    points: FloatArray
    forces: FloatArray
    pressing: FloatArray
    joints: IntArray
    names: tuple[str, ...]
    blocks: IntArray
    bodies: tuple[str, ...]
    settlement: Mapping[str, tuple[float, float, float]]

    def resultant(self, joint: int) -> tuple[FloatArray, FloatArray] | None:
        """Return the centre of pressure (2,) [m] of a joint and its force (2,) [N/m]; None if nothing presses it."""
        chosen = self.joints == joint
        pressing = self.pressing[chosen]
        if pressing.sum() <= _NO_FORCE * self.pressing.max(initial=0.0):
            return None
        return pressing @ self.points[chosen] / pressing.sum(), self.forces[chosen].sum(axis=0)


def rigid_blocks(scene: Scene, bodies: Sequence[PlacedBody]) -> tuple[Block, ...]:
    """Return the blocks of a scene with a single load: those of placed bodies, then those of rigid bodies."""
    blocks = [_elastic_block(body) for body in bodies]
    for body in scene.rigid:
        chosen = np.eye(3)[:, body.is_load_controlled]
        blocks.append(Block(np.array(body.centre), 1.0, chosen, scene.load_on(body) @ chosen))
    return tuple(blocks)


def loads_of(blocks: Sequence[Block]) -> FloatArray:
    """Return (n_motions,) [N/m] the work of the load on the motions of all blocks."""
    return np.concatenate([block.load for block in blocks])


def relative_motions(blocks: Sequence[Block], joints: Sequence[Joint]) -> sparse.csr_array:
    """Return sparse (n_motions, 2 n_points): relative velocities, normal and tangential, at the points of joints."""
    first = np.cumsum([0, *(block.load.size for block in blocks)])
    data, rows, columns, begin = [np.zeros(0)], [np.zeros(0, np.intp)], [np.zeros(0, np.intp)], 0
    for joint in joints:
        frame = np.stack([joint.directions, turned_left(joint.directions)], axis=1)
        for sign, number, points in ((1.0, joint.body, joint.points), (-1.0, joint.other, joint.touched)):
            if number >= 0:
                velocities = sign * np.einsum("nkc,ncm->mnk", frame, blocks[number].at(points))
                motion, component = np.indices((len(velocities), 2 * len(frame))).reshape(2, -1)
                data.append(velocities.ravel())
                rows.append(first[number] + motion)
                columns.append(begin + component)
        begin += 2 * len(frame)
    entries = np.concatenate(data), (np.concatenate(rows), np.concatenate(columns))
    return sparse.csr_array(entries, shape=(int(first[-1]), begin))


def friction_of(joints: Sequence[Joint], force: float) -> list[tuple[FloatArray, FloatArray]]:
    """Return pairs of friction without pressure (n_points,) [N/m] and its growth with pressure (n_points,) [-].

    One pair, or a second one of caps, for forces of a typical size [N/m]; see `bemkit.contact.limit_load`.
    """
    pairs: list[list[tuple[FloatArray, FloatArray]]] = []
    for joint in joints:
        slope = -joint.law.bound_derivative(np.zeros(joint.lengths.size))
        found = envelopes_of(joint.law.bound, slope, force / float(joint.lengths.sum()))
        pairs.append([(joint.lengths * cohesion, steepest) for cohesion, steepest in found])
    choices = (0, -1) if any(len(pair) > 1 for pair in pairs) else (0,)
    return [
        (np.concatenate([pair[k][0] for pair in pairs]), np.concatenate([pair[k][1] for pair in pairs]))
        for k in choices
    ]


def _elastic_block(body: PlacedBody) -> Block:
    """Return a body as a block, in its place."""
    mesh, space = body.mesh, body.space_in_place
    units = body.units(body.material.plane_modulus, 1.0, mesh)
    force = nodal_forces(body.scene, mesh, space, units)
    if body.scene.body_forces:
        solution = particular_solution(body.scene, mesh, units.modulus, units.stress)
        force = force - ForcesInside.of(solution, space).force
    modes = free_modes(space, held_nodes(body.scene, mesh, units, space))
    basis = rigid_motions(dof_points(space), np.zeros(2), 1.0).reshape(-1, 3)
    motions: FloatArray = np.linalg.pinv(basis) @ modes.reshape(len(modes), len(basis)).T
    return Block(mesh.centre, mesh.diameter, motions, np.asarray(np.einsum("mnc,nc->m", modes, force)))


def joints_of(scene: Scene, bodies: Sequence[PlacedBody]) -> Iterator[Joint]:
    """Yield the joints between elastic bodies, then those with rigid bodies and with fixed obstacles."""
    names = [*(body.name for body in bodies), *(body.name for body in scene.rigid)]
    listed = with_found_contacts(scene, [pair for pair, _ in touching_pairs(scene, bodies)])
    for pair in listed.contacts:
        parts = [(names.index(body), part) for body, part in pair.elastic_parts]
        if pair.rigid_body is None:
            yield _joint_of_sides(scene, pair, bodies, parts)
        else:
            obstacle, partner = scene.rigid_body_of(pair).obstacle, names.index(pair.rigid_body)
            yield from _on_obstacle(pair.name, bodies[parts[0][0]], parts[0], partner, obstacle, scene.law_of(pair))
    for number, body in enumerate(bodies):
        for part, obstacle in body.scene.obstacles.items():
            name, law = name_at_obstacle(body.name, part), body.scene.laws[part]
            yield from _on_obstacle(name, body, (number, part), -1, obstacle, law)


def _joint_of_sides(
    scene: Scene, pair: ContactPair, bodies: Sequence[PlacedBody], parts: Sequence[tuple[int, str]]
) -> Joint:
    """Return the joint between two sides, each given by the number of its body and its name."""
    side, other = (ContactSide(bodies[number].space, bodies[number].mesh.part(part)) for number, part in parts)
    directions, segments = facing_segments(side, other, reach_of(pair, side.mesh, other.mesh))
    ends = facing_points(segments, side, other, directions, _ENDS, np.ones(2))
    normals = side.mesh.normals_at(side.elements[ends.row], ends.xi)
    normals = normals - other.mesh.normals_at(other.elements[ends.partner], ends.eta)
    normals = (normals / norms(normals)[..., None]).reshape(-1, 2)
    points, gap = side.points(ends.row, ends.xi).reshape(-1, 2), ends.gap.reshape(-1, 2)
    depth = -np.sum(gap * normals, axis=1)
    deepest = int(np.argmax(depth))
    check_overlap(pair, float(depth[deepest]), points[deepest], min(side.mesh.diameter, other.mesh.diameter))
    law = scene.law_of(pair).at(points)
    (body, _), (partner, _) = parts
    return Joint(pair.name, body, partner, points, points + gap, normals, ends.weights.ravel(), law)


def _on_obstacle(
    name: str, body: PlacedBody, part: tuple[int, str], other: int, obstacle: Obstacle, law: FrictionLaw
) -> Iterator[Joint]:
    """Yield the joint of a part, given by the number of its body and its name, and an obstacle; none if they miss."""
    mesh, elements = body.mesh, body.mesh.part(part[1])

    def measured(rows: IntArray, xi: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return points, gaps and directions at xi (r, q) of elements at the positions `rows` (r,)."""
        points, normals = mesh.points(elements[rows], xi), mesh.normals_at(elements[rows], xi)
        gap, direction = measure_contact(obstacle, points.reshape(-1, 2), normals.reshape(-1, 2))
        return points, gap.reshape(xi.shape), direction.reshape(points.shape)

    rows = np.arange(elements.size)
    xi = np.broadcast_to(_SAMPLES, (rows.size, _SAMPLES.size))
    is_met = np.isfinite(measured(rows, xi)[1])
    row, k = np.nonzero(is_met[:, 1:] | is_met[:, :-1])
    ends, are_met = (
        np.stack([_SAMPLES[k], _SAMPLES[k + 1]], axis=1),
        np.stack([is_met[row, k], is_met[row, k + 1]], axis=1),
    )
    # the end of the joint lies between a sample that meets the obstacle and one that does not
    cut = np.flatnonzero(~are_met.all(axis=1))
    inside, outside = ends[cut][are_met[cut]], ends[cut][~are_met[cut]]
    for _ in range(_N_HALVINGS):
        middle = 0.5 * (inside + outside)
        is_inside = np.isfinite(measured(row[cut], middle[:, None])[1][:, 0])
        inside, outside = np.where(is_inside, middle, inside), np.where(is_inside, outside, middle)
    ends[cut] = np.where(are_met[cut], ends[cut], inside[:, None])
    points, gap, directions = (values.reshape(-1, *values.shape[2:]) for values in measured(row, ends))
    lengths = 0.5 * (ends[:, 1:] - ends[:, :1]) * mesh.jacobian(elements[row], ends)
    if row.size:
        touched = points + gap[:, None] * directions
        yield Joint(name, part[0], other, points, touched, directions, lengths.ravel(), law.at(points))
