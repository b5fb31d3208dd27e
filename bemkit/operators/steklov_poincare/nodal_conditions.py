"""Conditions at the displacement nodes of a body: fixed, free or retained directions, forces and displacements."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from bemkit.arrays import BoolArray, FloatArray, IntArray, consecutive_runs
from bemkit.errors import InputError
from bemkit.geometry.local_values import summed_at_dofs
from bemkit.geometry.quadrature import gauss_legendre
from bemkit.geometry.spaces import BoundarySpace, dof_points
from bemkit.geometry.vectors import norms, turned_right
from bemkit.operators.rigid_modes import admissible_modes, rigid_motions

SMOOTH_SIDE_RATIO = 0.07
"""Two directions of one support that differ by less than 30 degrees are one smooth side: the eigenvalues of
their sum then differ by the factor tan(15 deg)^2."""
CONFLICT_TOLERANCE = 1e-9
"""Relative difference of two prescribed displacements at one node that round-off may explain."""
FREE_MOTION_TOLERANCE = 1e-6
"""A rigid motion that moves the supports by less than this, relative to its size, is free of them. At 1e7 diameters
from the origin numbers hold the normals along a straight side to about 1e-7; and a support that resists a motion only
with a million times the load holds nothing."""
_LEAST_TURN = 1e-9
"""Difference of a rigid motion between nodes, by its size, that is not round-off."""
_FACTOR_TOLERANCE = 4.0 * np.finfo(float).eps
"""Relative difference of two loads that the product with a load factor may leave."""

TractionField = Callable[[FloatArray, FloatArray], FloatArray]
"""Tractions on the boundary: (n, 2) points [m] and (n, 2) outward unit normals there -> (n, 2) values [Pa]."""


class ConflictingSupportsError(InputError):
    """Two boundary parts prescribe different displacements at their common node.

    Parameters
    ----------
    part : str
        One of the parts.
    point : (float, float) [m]
    """

    def __init__(self, part: str, point: tuple[float, float]) -> None:
        self.part, self.point = part, point
        x, y = point
        super().__init__(
            f"part {part!r} and a neighbour prescribe different displacements at their common point "
            f"({x:.6g}, {y:.6g}): make them agree there, or leave a free element between them"
        )

    def __reduce__(self) -> tuple[type[ConflictingSupportsError], tuple[str, tuple[float, float]]]:
        return ConflictingSupportsError, (self.part, self.point)


@dataclass(frozen=True, eq=False)
class Support:
    """Prescribed displacement components on some elements.

    Parameters
    ----------
    name : str
        The boundary part, for messages.
    elements : (m,) array
        Element numbers.
    directions : (m, k, 2) or (m, n_local, k, 2) array
        k = 1 or 2 unit directions on each element (both axes of a clamp), or at each node of each element (the normal
        of a roller, which turns along curved elements).
    displacement : callable, optional
        (n, 2) points [m] -> (n, 2) displacement [m]; its components along the directions are prescribed. By default
        zero.
    """

    name: str
    elements: IntArray
    directions: FloatArray
    displacement: Callable[[FloatArray], FloatArray] | None = None


@dataclass(frozen=True, eq=False)
class NodalConditions:
    """The conditions at every displacement node, in a local frame.

    Parameters
    ----------
    frame : (n_nodes, 2, 2) array
        Rows are the two orthonormal directions of the node.
    is_fixed : (n_nodes, 2) bool array
        Directions whose displacement is prescribed.
    displacement : (n_nodes, 2) array [m]
        The prescribed values, zero elsewhere.
    is_retained : (n_nodes, 2) bool array
        Directions that are kept as unknowns (contact); everything else is free: its force is known.
    driven : tuple of int
        Rigid motions (0 along x, 1 along y, 2 the turn) that a body at rest far away makes nevertheless, because forces
        drive it there; none unless it is a half-plane.
    later : tuple of GivenData
        What load steps after this one give.
    connected : tuple of int arrays
        Nodes of each rigid connection: all fixed, but to a rigid body whose three motions are unknown, and on which the
        given forces at these nodes act; see `RigidlyConnected`.
    """

    frame: FloatArray
    is_fixed: BoolArray
    displacement: FloatArray
    is_retained: BoolArray
    driven: tuple[int, ...] = ()
    later: tuple[GivenData, ...] = ()
    connected: tuple[IntArray, ...] = ()

    @property
    def is_supported(self) -> BoolArray:
        """Directions that supports hold, (n_nodes, 2): those that are fixed but for connections."""
        supported = self.is_fixed.copy()
        for nodes in self.connected:
            supported[nodes] = False
        return supported

    @property
    def is_free(self) -> BoolArray:
        """Directions whose force is known, (n_nodes, 2)."""
        free: BoolArray = ~(self.is_fixed | self.is_retained)
        return free

    def in_frames(self, vectors: FloatArray) -> FloatArray:
        """Return vectors (n_nodes, 2) in x and y by their components along the directions of the nodes."""
        return np.asarray(np.einsum("nkc,nc->nk", self.frame, vectors))

    def in_plane(self, components: FloatArray) -> FloatArray:
        """Return vectors in x and y, (n_nodes, 2) or flat, from their components along the directions of the nodes."""
        return np.asarray(np.einsum("nkc,nk->nc", self.frame, components.reshape(-1, 2)))


@dataclass(frozen=True, eq=False)
class GivenData:
    """Forces on free directions and displacements of fixed ones, in the frames of the nodes.

    Parameters
    ----------
    force : (n_nodes, 2) array [N/m]
        Zero on directions that are not free.
    displacement : (n_nodes, 2) array [m]
        Zero on directions that are not fixed.
    """

    force: FloatArray
    displacement: FloatArray

    @classmethod
    def of(cls, conditions: NodalConditions, force: FloatArray, displacement: FloatArray) -> GivenData:
        """Return the data of nodal forces in x and y, and of displacements in the frames."""
        local = conditions.in_frames(force)
        return cls(np.where(conditions.is_free, local, 0.0), np.where(conditions.is_fixed, displacement, 0.0))

    @property
    def n_loaded(self) -> int:
        """Number of directions with a force."""
        return int(np.count_nonzero(self.force))

    @property
    def n_moved(self) -> int:
        """Number of directions with a displacement."""
        return int(np.count_nonzero(self.displacement))

    def factor_of(self, base: GivenData) -> float | None:
        """Return the factor by which these data are a multiple of others, None if they are none."""
        own, other = (np.concatenate([data.force.ravel(), data.displacement.ravel()]) for data in (self, base))
        if not own.any():
            return 0.0
        k = int(np.argmax(np.abs(other)))
        factor = float(own[k] / other[k]) if other[k] else 0.0
        return factor if np.all(np.abs(own - factor * other) <= _FACTOR_TOLERANCE * np.abs(own)) else None


def supporting_forces(conditions: NodalConditions, given: FloatArray, total: FloatArray) -> FloatArray:
    """Return the forces (2 n_nodes,) [N/m] of loads and supports, in x and y.

    Parameters
    ----------
    conditions : NodalConditions
    given, total : (n_nodes, 2) arrays [N/m]
        The given forces, and all that act on the boundary of the body but those of contact: a support may hold a node
        obliquely to what it touches.
    """
    acting = np.where(conditions.is_fixed, conditions.in_frames(total), conditions.in_frames(given))
    return conditions.in_plane(acting).ravel()


def integrate_traction(space: BoundarySpace, elements: IntArray, field: TractionField) -> FloatArray:
    """Return the consistent nodal forces (n_nodes, 2) [N/m] of tractions on some elements.

    Parameters
    ----------
    space : BoundarySpace
        Its scalar basis functions are what the tractions are integrated against.
    elements : (m,) int array
    field : callable
        See `TractionField`.
    """
    points, weights = gauss_legendre(space.degree + 5)  # exact for tractions up to the ninth power of the coordinates
    places = space.mesh.points(elements, points)
    outward = turned_right(space.mesh.derivatives(elements, points))
    sizes = norms(outward)
    normals = outward / sizes[..., None]
    values = field(places.reshape(-1, 2), normals.reshape(-1, 2)).reshape(places.shape)
    measure = sizes * weights
    local = np.einsum("eq,pq,eqc->epc", measure, space.basis(points), values)
    return summed_at_dofs(space, local, elements)


def turn_columns(matrix: FloatArray, frame: FloatArray) -> None:
    """Overwrite the columns (2 * node + component) of a matrix by those in the frames (n_nodes, 2, 2) of the nodes."""
    columns = matrix.reshape(len(matrix), len(frame), 2)  # a view in any memory order
    for _, nodes in consecutive_runs(np.flatnonzero(np.any(frame != np.eye(2), axis=(1, 2)))):
        own, x, y = frame[nodes], columns[:, nodes, 0], columns[:, nodes, 1]
        columns[:, nodes, 0], columns[:, nodes, 1] = [own[:, k, 0] * x + own[:, k, 1] * y for k in (0, 1)]


def rotated(matrix: FloatArray, frame: FloatArray) -> FloatArray:
    """Express both the rows and the columns of a matrix in the frames (n_nodes, 2, 2) of the nodes."""
    if np.array_equal(frame, np.broadcast_to(np.eye(2), frame.shape)):
        return matrix
    result = matrix.copy()
    turn_columns(result, frame)
    turn_columns(result.T, frame)
    return result


def supported(space: BoundarySpace, supports: Sequence[Support]) -> NodalConditions:
    """Collect the supports at the nodes of a space; every other direction is free.

    Parameters
    ----------
    space : BoundarySpace
        The displacement space.
    supports : sequence of Support

    Returns
    -------
    NodalConditions
        Frames are the coordinate axes wherever the supports allow it.

    Raises
    ------
    ConflictingSupportsError
        If parts prescribe different displacements at a node they share.
    """
    n_nodes = space.n_dofs // 2
    points = dof_points(space)
    supports = [*supports, *_mirrors(space)]
    directions = [_directions_of(space, support) for support in supports]
    given = [_given_at(points, support, own) for support, own in zip(supports, directions, strict=True)]
    matrix, right = np.zeros((n_nodes, 2, 2)), np.zeros((n_nodes, 2))
    for own, values in zip(directions, given, strict=True):
        matrix += own
        right += np.einsum("nij,nj->ni", own, values)
    size, vectors = np.linalg.eigh(matrix)
    rank = (size > 1e-9).sum(axis=1)
    inverse = np.where(size > 1e-9, 1.0 / np.where(size > 1e-9, size, 1.0), 0.0)
    displacement = np.einsum("nij,nj,nkj,nk->ni", vectors, inverse, vectors, right)
    for support, own, values in zip(supports, directions, given, strict=True):
        _check_agreement(support, own, values, points, displacement)

    direction = vectors[:, :, 1]
    is_x = np.abs(direction[:, 0]) >= np.abs(direction[:, 1])
    direction = direction * np.sign(np.where(is_x, direction[:, 0], direction[:, 1]))[:, None]
    x_axis = np.where(is_x[:, None], direction, np.stack([direction[:, 1], -direction[:, 0]], axis=1))
    x_axis[rank != 1] = (1.0, 0.0)
    frame = np.stack([x_axis, np.stack([-x_axis[:, 1], x_axis[:, 0]], axis=1)], axis=1)
    is_fixed = np.stack([(rank == 2) | ((rank == 1) & is_x), (rank == 2) | ((rank == 1) & ~is_x)], axis=1)
    local = np.where(is_fixed, np.einsum("nkc,nc->nk", frame, displacement), 0.0)
    return NodalConditions(frame, is_fixed, local, np.zeros((n_nodes, 2), bool))


def _mirrors(space: BoundarySpace) -> list[Support]:
    """Return the supports of symmetry lines: no displacement across them."""
    if space.mesh.symmetry is None:
        return []
    from bemkit.geometry.reflection import antisymmetric_dofs

    held = antisymmetric_dofs(space).reshape(-1, 2)[space.element_dofs]
    elements = np.flatnonzero(held.any(axis=(1, 2)))
    if not elements.size:
        return []
    return [Support("symmetry line", elements, np.where(held[elements], 1.0, 0.0)[..., None] * np.eye(2))]


def _given_at(points: FloatArray, support: Support, directions: FloatArray) -> FloatArray:
    """Return the displacement (n_nodes, 2) of one support, zero at nodes that it does not fix."""
    values, is_fixed = np.zeros_like(points), directions.any(axis=(1, 2))
    if support.displacement is not None and is_fixed.any():
        values[is_fixed] = support.displacement(points[is_fixed])
    return values


def _directions_of(space: BoundarySpace, support: Support) -> FloatArray:
    """Return the projector (n_nodes, 2, 2) on the directions that one support fixes at each node."""
    outer = np.einsum("...ki,...kj->...ij", support.directions, support.directions)
    matrix = np.zeros((space.n_dofs // 2, 2, 2))
    np.add.at(matrix, space.element_dofs[support.elements], outer if outer.ndim == 4 else outer[:, None])
    size, vectors = np.linalg.eigh(matrix)
    keep = np.where(size > SMOOTH_SIDE_RATIO * size[:, 1:], 1.0, 0.0)
    projector: FloatArray = np.einsum("nij,nj,nkj->nik", vectors, keep, vectors)
    return projector


def _check_agreement(
    support: Support, directions: FloatArray, values: FloatArray, points: FloatArray, displacement: FloatArray
) -> None:
    """Refuse displacements (n_nodes, 2) that are not the values of a support along its directions."""
    miss = np.abs(np.einsum("nij,nj->ni", directions, values - displacement)).max(axis=1)
    worst = int(np.argmax(miss))
    if miss[worst] > CONFLICT_TOLERANCE * max(float(np.abs(values).max()), float(np.abs(displacement).max())):
        x, y = points[worst].tolist()
        raise ConflictingSupportsError(support.name, (x, y))


def free_modes(space: BoundarySpace, conditions: NodalConditions) -> FloatArray:
    """Return the rigid motions (n_motions, n_nodes, 2) of the nodes of a space that no support resists.

    Parameters
    ----------
    space : BoundarySpace
    conditions : NodalConditions

    Returns
    -------
    (n_motions, n_nodes, 2) array
        Linearly independent, of sizes about one; combinations of the `admissible_modes` and of those driven.
    """
    points = dof_points(space)
    centre = 0.5 * (points.min(axis=0) + points.max(axis=0))
    motions = rigid_motions(points, centre, float(np.ptp(points, axis=0).max()))
    motions = motions[:, :, [*admissible_modes(space.mesh), *conditions.driven]]
    fixed = np.einsum("nkc,ncm->nkm", conditions.frame, motions)[conditions.is_supported]
    if fixed.size:
        _, sizes, directions = np.linalg.svd(np.linalg.qr(fixed, mode="r"), full_matrices=True)
        n_held = int(np.count_nonzero(sizes >= FREE_MOTION_TOLERANCE * np.sqrt(len(fixed))))
        motions = motions @ directions[n_held:].T
    return motions.transpose(2, 0, 1)


def turning(motions: FloatArray) -> BoolArray:
    """Return which rigid motions (n_motions, n_nodes, 2) of unit size turn the body."""
    return np.asarray(np.ptp(motions, axis=1).max(axis=1, initial=0.0) > _LEAST_TURN)
