"""Scenes of many blocks in mutual contact: elastic shapes condensed once, and pairs of coincident nodes.

After the measured prototype: weight by a particular stress, running bond whose head joints have no contact node where
they meet a bed joint (the two bed contacts there imply it).
"""

from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise

import numpy as np
from scipy import sparse

from bemkit.contact.joined.joined_bodies import JoinedBodies
from bemkit.contact.joined.member import Member
from bemkit.geometry import Polygon, discretise
from bemkit.geometry.spaces import dof_points
from bemkit.operators.boundary import SteklovPoincareOperator
from bemkit.operators.material import Material
from bemkit.operators.rigid_modes import rigid_motions
from bemkit.operators.steklov_poincare.galerkin import GalerkinElasticity
from bemkit.operators.steklov_poincare.nodal_conditions import integrate_traction


@dataclass(frozen=True, eq=False)
class Block:
    """A polygon, all of whose boundary displacements are retained."""

    vertices: tuple
    n_elements: int
    poisson_ratio: float = 0.2
    youngs_modulus: float = 1.0

    @cached_property
    def elastic(self):
        mesh = discretise(Polygon(self.vertices).outline(), n_elements=self.n_elements)
        return GalerkinElasticity(mesh, Material(self.youngs_modulus, self.poisson_ratio))

    @cached_property
    def points(self):
        return dof_points(self.elastic.displacement_space)

    @cached_property
    def stiffness(self):
        return np.array(SteklovPoincareOperator(self.elastic).matrix())

    @cached_property
    def motions(self):
        return np.ascontiguousarray(rigid_motions(self.points, self.points.mean(axis=0), 1.0).reshape(-1, 3).T)

    @cached_property
    def weights(self):
        """(2, 2 n): loads of a unit body force along x, along y; the stress sigma_kk = -x_k is a particular one."""
        modulus = self.youngs_modulus / (1.0 - self.poisson_ratio**2)
        ratio = self.poisson_ratio / (1.0 - self.poisson_ratio)
        loads = []
        for k in (0, 1):
            along, across = self.points[:, k], self.points[:, 1 - k]
            particular = np.zeros_like(self.points)
            particular[:, k] = -(along**2 + ratio * across**2) / (2 * modulus)
            particular[:, 1 - k] = ratio * along * across / modulus
            everywhere = np.arange(self.elastic.displacement_space.mesh.n_elements)
            forces = integrate_traction(
                self.elastic.displacement_space,
                everywhere,
                lambda p, m, k=k: np.where(np.arange(2) == k, -p[..., [k]] * m[..., [k]], 0.0),
            )
            loads.append(self.stiffness @ particular.ravel() - forces.ravel())
        return np.array(loads)

    @property
    def modulus(self):
        return self.youngs_modulus / (1.0 - self.poisson_ratio**2)

    def member(self, gravity=(0.0, 0.0), *, angle=0.0, name="", load=None, held=()):
        """One copy, turned by an angle [rad]; held: displacement components that are zero."""
        c, s = np.cos(angle), np.sin(angle)
        in_own_axes = np.array([c * gravity[0] + s * gravity[1], -s * gravity[0] + c * gravity[1]])
        total = in_own_axes @ self.weights + (0.0 if load is None else load)
        return Member(self.stiffness, total, self.motions, self.modulus, name)

    @cached_property
    def _nodes(self):
        return {tuple(np.rint(1e6 * point).astype(int).tolist()): k for k, point in enumerate(self.points)}

    def node(self, x, y):
        return self._nodes[round(1e6 * x), round(1e6 * y)]


def rectangle(width, height, per_unit, **material):
    corners = ((0.0, 0.0), (width, 0.0), (width, height), (0.0, height))
    return Block(corners, round(2 * per_unit * (width + height)), **material)


def joined(members, angles, pairs, *, offset=None, **options):
    """Join members by pairs of nodes: rows (a, node, b, node, n_x, n_y, weight), b = -1 for a rigid foundation."""
    pairs = np.asarray(pairs, float)
    a, i, b, j = pairs[:, :4].astype(int).T
    first = np.cumsum([0, *(member.n_components for member in members)])
    frame = np.stack([pairs[:, 4:6], np.stack([-pairs[:, 5], pairs[:, 4]], axis=1)], axis=1)
    rows, columns, values = [], [], []
    for sign, body, node in ((1.0, a, i), (-1.0, b, j)):
        there = np.flatnonzero(body >= 0)
        c, s = np.cos(angles)[body[there]], np.sin(angles)[body[there]]
        turn = np.stack([np.stack([c, -s], axis=1), np.stack([s, c], axis=1)], axis=1)  # own axes to x, y
        values.append(sign * frame[there] @ turn)
        rows.append(np.broadcast_to(2 * there[:, None, None] + np.array([[0], [1]]), (there.size, 2, 2)))
        at = (first[body[there]] + 2 * node[there])[:, None, None] + np.array([[0, 1]])
        columns.append(np.broadcast_to(at, (there.size, 2, 2)))
    entries = [np.concatenate([part.ravel() for part in parts]) for parts in (values, rows, columns)]
    relative = sparse.csr_array((entries[0], (entries[1], entries[2])), (2 * len(pairs), first[-1]))
    relative.eliminate_zeros()
    return JoinedBodies(
        tuple(members),
        relative,
        np.zeros(2 * len(pairs)) if offset is None else offset,
        pairs[:, 6],
        **options,
    )


def row_of_blocks(moduli=(1.0, 1.0), *, m=4, width=1.0, press=0.3, lift=0.05, **options):
    """Blocks side by side between rigid walls, pressed together: each carries a load of its own; x grows to the right.

    The first stands against a rigid wall on its left, the last against one on its right.
    """
    blocks = [rectangle(width, 1.0, m, youngs_modulus=modulus) for modulus in moduli]
    members = []
    for k, block in enumerate(blocks):
        mesh = block.elastic.displacement_space.mesh
        tops = np.flatnonzero(mesh.points(np.arange(mesh.n_elements), np.zeros(1))[:, 0, 1] > 1.0 - 1e-9)
        load = integrate_traction(
            block.elastic.displacement_space,
            tops,
            lambda x, _, k=k: np.stack([press * (x[..., 0] - 0.3 * k), -lift * (1.0 + x[..., 0])], axis=-1),
        )
        members.append(block.member(load=load.ravel(), name=f"block {k + 1}"))
    pairs = []
    for r in range(m + 1):
        y, weight = r / m, (0.5 if r in (0, m) else 1.0) / m
        pairs.append((0, blocks[0].node(0.0, y), -1, -1, -1, 0, weight))
        for k in range(1, len(blocks)):
            pairs.append((k, blocks[k].node(0.0, y), k - 1, blocks[k - 1].node(width, y), -1, 0, weight))
        pairs.append((len(blocks) - 1, blocks[-1].node(width, y), -1, -1, 1, 0, weight))
    return joined(members, np.zeros(len(blocks)), pairs, **options)


def wall(courses, per_course, m=8, *, gravity=(0.0, -1.0), push=0.0, **options):
    """Running bond of 2 x 1 blocks on a rigid foundation, halves at the ends of odd courses; body force per volume.

    `push` [Pa] acts to the right on the left side of the uppermost course.
    """
    whole, half = rectangle(2.0, 1.0, m), rectangle(1.0, 1.0, m)
    placed, courses_of = [], []  # (block, left end); the numbers of the blocks of each course
    for k in range(courses):
        ends = np.arange(0, 2 * per_course + 1, 2)
        if k % 2:
            ends = np.r_[0, np.arange(1, 2 * per_course, 2), 2 * per_course]
        courses_of.append(range(len(placed), len(placed) + len(ends) - 1))
        placed += [(whole if right - left == 2 else half, left, right) for left, right in pairwise(ends.tolist())]

    def node(number, x, y):
        block, left, _ = placed[number]
        return block.node(x - left, y)

    weights = {block: np.asarray(gravity) @ block.weights for block in (whole, half)}
    members = [
        Member(b.stiffness, weights[b], b.motions, b.modulus, f"block {i}") for i, (b, _, _) in enumerate(placed)
    ]
    if push:
        first = courses_of[-1][0]
        mesh = placed[first][0].elastic.displacement_space.mesh
        left = np.flatnonzero(mesh.points(np.arange(mesh.n_elements), np.zeros(1))[:, 0, 0] < 1e-9)
        force = integrate_traction(
            placed[first][0].elastic.displacement_space, left, lambda x, _: np.broadcast_to([push, 0.0], x.shape)
        )
        members[first] = replace(members[first], load=members[first].load + force.ravel())
    pairs = []
    for k, course in enumerate(courses_of):
        for number in course:
            _, left, right = placed[number]
            below = [(-1, left, right)] if k == 0 else [(n, *placed[n][1:]) for n in courses_of[k - 1]]
            for other, other_left, other_right in below:
                low, high = max(left, other_left), min(right, other_right)
                for r in range(low * m, high * m + 1) if high > low else ():
                    weight = (0.5 if r in (low * m, high * m) else 1.0) / m
                    partner = -1 if other < 0 else node(other, r / m, 1.0)
                    pairs.append((number, node(number, r / m, 0.0), other, partner, 0, -1, weight))
            if number > course[0]:  # head joint, without the corners that bed joints tie already
                for r in range(1, m + 1 if k == courses - 1 else m):
                    weight = (0.5 if r == m else 1.0) / m
                    at = (number, node(number, left, r / m), number - 1, node(number - 1, left, r / m))
                    pairs.append((*at, -1, 0, weight))
    return joined(members, np.zeros(len(members)), pairs, **options)


def arch(n, thickness, m=8, **options):
    """Semicircle of n wedges of mean radius 1 on a rigid foundation under its own weight; joints of m elements."""
    h = np.pi / n / 2
    low, high = 1.0 - thickness / 2, 1.0 + thickness / 2
    vertices = tuple((r * np.sin(x), r * np.cos(x)) for r, x in ((high, h), (high, -h), (low, -h), (low, h)))
    along = [max(1, round(2 * r * np.sin(h) / thickness * m)) for r in (high, low)]
    block = Block(vertices, 2 * m + sum(along))
    polar, radius = np.arctan2(*block.points.T), np.hypot(*block.points.T)
    right, left = (np.flatnonzero(np.abs(polar - side * h) < 1e-9) for side in (1, -1))
    right, left = right[np.argsort(radius[right])], left[np.argsort(radius[left])]
    assert len(right) == len(left)
    angles = -(np.pi / 2 - h) + 2 * h * np.arange(n)
    members = [block.member((0.0, -1.0), angle=angle, name=f"voussoir {k}") for k, angle in enumerate(angles)]
    pairs = []
    for k in range(n + 1):
        x = 2 * h * k
        for q, (a, b) in enumerate(zip(right, left, strict=True)):
            weight = thickness / (len(right) - 1) * (0.5 if q in (0, len(right) - 1) else 1.0)
            if k < n:
                pairs.append((k, a, k - 1, b if k else -1, np.sin(x), -np.cos(x), weight))
            else:
                pairs.append((n - 1, b, -1, -1, -np.sin(x), np.cos(x), weight))
    return joined(members, angles, pairs, **options)
