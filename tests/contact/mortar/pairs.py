"""Pairs of elastic bodies for the tests of their coupling: meshes, dense condensed bodies, one dense body of both."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.sparse import csr_matrix

from bemkit.arrays import FloatArray, IntArray
from bemkit.contact.dense_body import DenseBody
from bemkit.contact.mortar.coupling import MortarCoupling, couple
from bemkit.contact.mortar.sides import ContactSide
from bemkit.geometry.curves import Arc, Curve, Segment
from bemkit.geometry.mesh import BoundaryMesh
from bemkit.geometry.spaces import BoundarySpace, ConstantSpace, LagrangeSpace, dof_points
from bemkit.operators.linear_solvers import DenseCholesky
from bemkit.operators.material import Material
from bemkit.operators.rigid_modes import rigid_motions
from bemkit.operators.steklov_poincare import CondensedMap
from bemkit.operators.steklov_poincare.nodal_conditions import Support, integrate_traction, supported
from bemkit.scene.discretisation import Galerkin

Field = Callable[[FloatArray], FloatArray]
Load = Callable[[FloatArray, FloatArray], FloatArray]


def space_of(mesh: BoundaryMesh, degree: int) -> BoundarySpace:
    """Return the continuous functions of a degree, or the constants for 0."""
    return LagrangeSpace(mesh, degree=degree) if degree else ConstantSpace(mesh)


def chain(*pieces: tuple[str, Curve, FloatArray]) -> BoundaryMesh:
    """Return the mesh of pieces (name, curve, ascending parameters from 0 to 1) in order along the boundary."""
    points, spans, owners, parts, first = [], [], [], {}, 0
    for number, (name, curve, s) in enumerate(pieces):
        n = len(s) - 1
        points.append(curve.point(s[:-1]))
        spans.append(np.column_stack([s[:-1], s[1:]]))
        owners.append(np.full(n, -1 if curve.is_straight else number))
        parts[name] = first + np.arange(n)
        first += n
    elements, owner = np.column_stack([np.arange(first), (np.arange(first) + 1) % first]), np.concatenate(owners)
    if (owner < 0).all():
        return BoundaryMesh(np.concatenate(points), elements, parts)
    span = np.where(owner[:, None] < 0, 0.0, np.concatenate(spans))
    return BoundaryMesh(np.concatenate(points), elements, parts, tuple(curve for _, curve, _ in pieces), owner, span)


def quadrangle(corners: FloatArray, divisions: Sequence[FloatArray]) -> BoundaryMesh:
    """Return the mesh of a quadrangle with the parts bottom, right, top and left, each cut at parameters in [0, 1]."""
    names = ("bottom", "right", "top", "left")
    sides = zip(names, corners, np.roll(corners, -1, axis=0), divisions, strict=True)
    return chain(*((name, Segment(tuple(a), tuple(b)), s) for name, a, b, s in sides))


def block(
    low: tuple[float, float], high: tuple[float, float], n_along: int, n_beside: int, *, turn: FloatArray | None = None
) -> BoundaryMesh:
    """Return the mesh of a rectangle with equal elements on each side, its coordinates multiplied by `turn` (2, 2)."""
    corners = np.array([low, (high[0], low[1]), high, (low[0], high[1])])
    divisions = [np.linspace(0.0, 1.0, n + 1) for n in (n_along, n_beside, n_along, n_beside)]
    return quadrangle(corners if turn is None else corners @ turn.T, divisions)


def half_disc(*, is_below: bool, far: FloatArray, near: FloatArray) -> BoundaryMesh:
    """Return the mesh of a half disc of radius 1 that touches the origin with its part "contact", and has a "flat" one.

    near, far: parameters of the half circle, ascending; those of `far` from the end of `near` to 1.
    """
    y, start = (-1.0, 0.0) if is_below else (1.0, np.pi)
    arc, flat = Arc((0.0, y), 1.0, start, start + np.pi), Segment((y, y), (-y, y))
    return chain(
        ("a", arc, 1.0 - far[::-1]), ("contact", arc, near), ("b", arc, far), ("flat", flat, np.linspace(0, 1, 13))
    )


@dataclass
class ElasticSide:
    """An elastic body condensed onto both directions, in x and y, of the free nodes of its contact side."""

    side: ContactSide
    nodes: IntArray
    held: IntArray
    given: FloatArray
    condensed: CondensedMap
    motions: FloatArray
    force: FloatArray


def elastic_side(
    mesh: BoundaryMesh,
    material: Material,
    degree: int,
    contact: str,
    holds: Sequence[tuple[str, Field | None]] = (),
    loads: Sequence[tuple[str, Load]] = (),
    more_force: FloatArray | None = None,
) -> ElasticSide:
    """Condense a body; parts named in `holds` are clamped, with displacements given by a function of the points."""
    elastic = Galerkin(degree).elastic_map(mesh, material, DenseCholesky())
    space = elastic.displacement_space
    supports = [Support(n, mesh.part(n), np.broadcast_to(np.eye(2), (mesh.part(n).size, 2, 2)), u) for n, u in holds]
    conditions = supported(space, supports)
    side = ContactSide(space, mesh.part(contact))
    nodes, is_held = np.unique(side.dofs), conditions.is_fixed.any(axis=1)
    held, nodes = nodes[is_held[nodes]], nodes[~is_held[nodes]]
    conditions.is_retained[nodes] = True
    force = sum((integrate_traction(space, mesh.part(n), load) for n, load in loads), np.zeros((space.n_dofs // 2, 2)))
    if more_force is not None:
        force = force + more_force
    points = dof_points(space)
    motions = rigid_motions(points[nodes], np.zeros(2), 1.0).transpose(2, 0, 1)[: 0 if holds else 3]
    condensed = elastic.condense(conditions, force)
    return ElasticSide(side, nodes, held, conditions.displacement[held], condensed, motions, force)


@dataclass
class Pair:
    """Two bodies as one dense body of the relative displacements of multiplier nodes, and how to come back."""

    body: DenseBody
    coupling: MortarCoupling
    recover: Callable[[FloatArray], tuple[FloatArray, FloatArray]]


def in_frames(matrix: csr_matrix, columns: IntArray, frame: FloatArray) -> FloatArray:
    """Return (2 n, 2 k): x and y components of the displacements of some columns (k,) to the frames (n, 2, 2)."""
    dense = matrix.toarray()[:, columns]
    return np.einsum("ij,iac->iajc", dense, frame).reshape(2 * len(frame), 2 * columns.size)


def join(one: ElasticSide, two: ElasticSide, **options: object) -> Pair:
    """Couple two bodies, the first one non-mortar."""
    coupling = couple(one.side, two.side, without=one.held, **options)
    n = coupling.nodes.size

    on_one, on_two = coupling.on_non_mortar, coupling.on_mortar
    b1, b2 = in_frames(on_one, one.nodes, coupling.frame), in_frames(on_two, two.nodes, coupling.frame)
    shift = in_frames(on_one, one.held, coupling.frame) @ one.given.ravel()
    shift = shift - in_frames(on_two, two.held, coupling.frame) @ two.given.ravel()
    # find the traction forces p with w = C p + w0, then invert
    stiffness1, stiffness2 = one.condensed.stiffness, two.condensed.stiffness
    matrix = np.block(
        [
            [stiffness1, np.zeros((stiffness1.shape[0], stiffness2.shape[1])), -b1.T],
            [np.zeros((stiffness2.shape[0], stiffness1.shape[1])), stiffness2, b2.T],
            [b1, -b2, np.zeros((2 * n, 2 * n))],
        ]
    )
    m = stiffness1.shape[0] + stiffness2.shape[0]
    right = np.zeros((len(matrix), 2 * n + 1))
    right[m:, :-1] = np.eye(2 * n)
    right[:m, -1] = np.concatenate([one.condensed.load, two.condensed.load])
    right[m:, -1] = -shift
    solved = np.linalg.solve(matrix, right)
    stiffness, load = solved[m:, :-1], -solved[m:, -1]
    motions = [b1 @ motion.ravel() for motion in one.motions] + [-b2 @ motion.ravel() for motion in two.motions]
    body = DenseBody(
        0.5 * (stiffness + stiffness.T), load, coupling.weights, np.reshape(motions, (-1, n, 2)), modulus=1.0
    )

    def recover(displacement: FloatArray) -> tuple[FloatArray, FloatArray]:
        unknowns = solved[:m] @ np.append(displacement.ravel(), 1.0)
        return np.split(unknowns, [stiffness1.shape[0]])

    return Pair(body, coupling, recover)
