"""Conditions at the displacement nodes of a body: fixed, free and retained directions, forces and displacements."""

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
"""Two directions of one support that differ by less than 30 degrees count as one: the eigenvalues of the sum of their
projectors then have a ratio below tan(15 deg)^2."""
CONFLICT_TOLERANCE = 1e-9
"""Largest relative difference of two prescribed displacements at one node; round-off causes no larger one."""
FREE_MOTION_TOLERANCE = 1e-6
"""A rigid motion is free if its relative displacements at the supports are below this. At 1e7 diameters from the origin
the normals of a straight side have round-off of 1e-7. A support whose reaction is a million times the load holds
nothing."""
_LEAST_TURN = 1e-9
"""Smallest relative variation of a rigid motion that is a rotation; less is round-off."""
_FACTOR_TOLERANCE = 4.0 * np.finfo(float).eps
"""Round-off of the product of a load and a load factor."""

TractionField = Callable[[FloatArray, FloatArray], FloatArray]
"""Tractions on the boundary: (n, 2) points [m] and (n, 2) outward unit normals -> (n, 2) values [Pa]."""

SLIDES = 0.02
"""Angle between a displacement and the boundary up to which a body only slides along the boundary: errors of normals
are smaller."""


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
            f"({x:.6g}, {y:.6g}): give the same displacement there, or leave a free element between the parts"
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
        Indices of elements.
    directions : (m, k, 2) or (m, n_local, k, 2) array
        k = 1 or 2 unit directions on each element (both axes of a clamp), or at each node of each element (the normal
        of a roller, which varies along curved elements).
    displacement : callable, optional
        (n, 2) points [m] -> (n, 2) displacement [m], zero by default. Its components along the directions are
        prescribed.
    """

    name: str
    elements: IntArray
    directions: FloatArray
    displacement: Callable[[FloatArray], FloatArray] | None = None


@dataclass(frozen=True, eq=False)
class NodalConditions:
    """The conditions at all displacement nodes, in local frames.

    Parameters
    ----------
    frame : (n_nodes, 2, 2) array
        Rows are the two orthonormal directions of the node.
    is_fixed : (n_nodes, 2) bool array
        Directions whose displacement is prescribed.
    displacement : (n_nodes, 2) array [m]
        The prescribed values, zero elsewhere.
    is_retained : (n_nodes, 2) bool array
        Directions that are kept as unknowns (contact). All other directions are free: their force is given.
    load_controlled : tuple of int
        Load-controlled far motions of a half-plane: 0 along x, 1 along y, 2 the rotation.
    later : tuple of GivenData
        Data of later load steps.
    connected : tuple of int arrays
        Nodes of each rigid connection. They are fixed to a rigid body with three unknown motions, on which the given
        forces at these nodes act; see `RigidlyConnected`.
    """

    frame: FloatArray
    is_fixed: BoolArray
    displacement: FloatArray
    is_retained: BoolArray
    load_controlled: tuple[int, ...] = ()
    later: tuple[GivenData, ...] = ()
    connected: tuple[IntArray, ...] = ()

    @property
    def is_supported(self) -> BoolArray:
        """Directions that supports hold, (n_nodes, 2): fixed directions without those of rigid connections."""
        is_supported = self.is_fixed.copy()
        for nodes in self.connected:
            is_supported[nodes] = False
        return is_supported

    @property
    def is_free(self) -> BoolArray:
        """Directions with a given force, (n_nodes, 2)."""
        is_free: BoolArray = ~(self.is_fixed | self.is_retained)
        return is_free

    @property
    def n_fixed(self) -> int:
        """Number of fixed directions."""
        return int(np.count_nonzero(self.is_fixed))

    @property
    def n_free(self) -> int:
        """Number of free directions."""
        return int(np.count_nonzero(self.is_free))

    @property
    def n_retained(self) -> int:
        """Number of retained directions."""
        return int(np.count_nonzero(self.is_retained))

    def in_frames(self, vectors: FloatArray) -> FloatArray:
        """Return the components of vectors (n_nodes, 2) along the directions of the nodes."""
        return np.asarray(np.einsum("nkc,nc->nk", self.frame, vectors))

    def in_plane(self, components: FloatArray) -> FloatArray:
        """Return vectors (n_nodes, 2) in x and y from components along the directions of the nodes, flat or not."""
        return np.asarray(np.einsum("nkc,nk->nc", self.frame, components.reshape(-1, 2)))


@dataclass(frozen=True, eq=False)
class GivenData:
    """Forces on free directions and displacements of fixed directions, in the frames of the nodes.

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
        """Return the factor if these data are a multiple of others, else None."""
        values, others = (np.concatenate([data.force.ravel(), data.displacement.ravel()]) for data in (self, base))
        if not values.any():
            return 0.0
        k = int(np.argmax(np.abs(others)))
        factor = float(values[k] / others[k]) if others[k] else 0.0
        return factor if np.all(np.abs(values - factor * others) <= _FACTOR_TOLERANCE * np.abs(values)) else None


def supporting_forces(conditions: NodalConditions, given: FloatArray, total: FloatArray) -> FloatArray:
    """Return the forces (2 n_nodes,) [N/m] of loads and supports, in x and y.

    Parameters
    ----------
    conditions : NodalConditions
    given, total : (n_nodes, 2) arrays [N/m]
        The given forces, and all forces on the boundary except those of contact: a support may hold a node in a
        direction oblique to the obstacle.
    """
    acting = np.where(conditions.is_fixed, conditions.in_frames(total), conditions.in_frames(given))
    return conditions.in_plane(acting).ravel()


def integrate_traction(space: BoundarySpace, elements: IntArray, field: TractionField) -> FloatArray:
    """Return the consistent nodal forces (n_nodes, 2) [N/m] of tractions on some elements.

    Parameters
    ----------
    space : BoundarySpace
        Space of the test functions.
    elements : (m,) int array
    field : callable
        See `TractionField`.
    """
    xi, weights = gauss_legendre(space.degree + 5)  # exact for tractions of degree nine in the coordinates
    points = space.mesh.points(elements, xi)
    outward = turned_right(space.mesh.derivatives(elements, xi))
    jacobian = norms(outward)
    normals = outward / jacobian[..., None]
    values = field(points.reshape(-1, 2), normals.reshape(-1, 2)).reshape(points.shape)
    measure = jacobian * weights
    local = np.einsum("eq,pq,eqc->epc", measure, space.basis(xi), values)
    return summed_at_dofs(space, local, elements)


def turn_columns(matrix: FloatArray, frame: FloatArray) -> None:
    """Express the columns 2 * node + component of a matrix in the frames (n_nodes, 2, 2) of the nodes, in place."""
    columns = matrix.reshape(len(matrix), len(frame), 2)  # a view in any memory order
    for _, nodes in consecutive_runs(np.flatnonzero(np.any(frame != np.eye(2), axis=(1, 2)))):
        axes, x, y = frame[nodes], columns[:, nodes, 0], columns[:, nodes, 1]
        columns[:, nodes, 0], columns[:, nodes, 1] = [axes[:, k, 0] * x + axes[:, k, 1] * y for k in (0, 1)]


def rotated(matrix: FloatArray, frame: FloatArray) -> FloatArray:
    """Express both the rows and the columns of a matrix in the frames (n_nodes, 2, 2) of the nodes."""
    if np.array_equal(frame, np.broadcast_to(np.eye(2), frame.shape)):
        return matrix
    result = matrix.copy()
    turn_columns(result, frame)
    turn_columns(result.T, frame)
    return result


def supported(space: BoundarySpace, supports: Sequence[Support]) -> NodalConditions:
    """Return the conditions of supports at the nodes of a space; all other directions are free.

    Parameters
    ----------
    space : BoundarySpace
        The displacement space.
    supports : sequence of Support

    Returns
    -------
    NodalConditions
        Frames are the coordinate axes except at nodes held in one oblique direction.

    Raises
    ------
    ConflictingSupportsError
        If parts prescribe different displacements at a common node.
    """
    n_nodes = space.n_dofs // 2
    points = dof_points(space)
    supports = [*supports, *_mirrors(space)]
    projectors = [_projector_of(space, support) for support in supports]
    prescribed = [_prescribed_at(points, each, projector) for each, projector in zip(supports, projectors, strict=True)]
    # least squares for the displacement of each node: sum of P u = sum of P u_prescribed
    matrix, right = np.zeros((n_nodes, 2, 2)), np.zeros((n_nodes, 2))
    for projector, values in zip(projectors, prescribed, strict=True):
        matrix += projector
        right += np.einsum("nij,nj->ni", projector, values)
    eigenvalues, vectors = np.linalg.eigh(matrix)
    rank = (eigenvalues > 1e-9).sum(axis=1)
    inverse = np.where(eigenvalues > 1e-9, 1.0 / np.where(eigenvalues > 1e-9, eigenvalues, 1.0), 0.0)
    displacement = np.einsum("nij,nj,nkj,nk->ni", vectors, inverse, vectors, right)
    for support, projector, values in zip(supports, projectors, prescribed, strict=True):
        _check_agreement(support, projector, values, points, displacement)

    # frames: the axis nearer to the one held direction becomes that direction
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
    """Return the supports of symmetry lines, which exclude displacements across them."""
    if space.mesh.symmetry is None:
        return []
    from bemkit.geometry.symmetry.images import antisymmetric_dofs

    is_held = antisymmetric_dofs(space).reshape(-1, 2)[space.element_dofs]
    elements = np.flatnonzero(is_held.any(axis=(1, 2)))
    if not elements.size:
        return []
    return [Support("symmetry line", elements, np.where(is_held[elements], 1.0, 0.0)[..., None] * np.eye(2))]


def _prescribed_at(points: FloatArray, support: Support, projector: FloatArray) -> FloatArray:
    """Return the displacement (n_nodes, 2) of one support, zero at nodes that it does not fix."""
    values, is_fixed = np.zeros_like(points), projector.any(axis=(1, 2))
    if support.displacement is not None and is_fixed.any():
        values[is_fixed] = support.displacement(points[is_fixed])
    return values


def _projector_of(space: BoundarySpace, support: Support) -> FloatArray:
    """Return the projectors (n_nodes, 2, 2) on the directions that one support fixes at each node."""
    outer = np.einsum("...ki,...kj->...ij", support.directions, support.directions)
    matrix = np.zeros((space.n_dofs // 2, 2, 2))
    np.add.at(matrix, space.element_dofs[support.elements], outer if outer.ndim == 4 else outer[:, None])
    eigenvalues, vectors = np.linalg.eigh(matrix)
    is_fixed = np.where(eigenvalues > SMOOTH_SIDE_RATIO * eigenvalues[:, 1:], 1.0, 0.0)
    projector: FloatArray = np.einsum("nij,nj,nkj->nik", vectors, is_fixed, vectors)
    return projector


def _check_agreement(
    support: Support, projector: FloatArray, values: FloatArray, points: FloatArray, displacement: FloatArray
) -> None:
    """Refuse displacements (n_nodes, 2) that differ from those of a support along its directions."""
    difference = np.abs(np.einsum("nij,nj->ni", projector, values - displacement)).max(axis=1)
    worst = int(np.argmax(difference))
    if difference[worst] > CONFLICT_TOLERANCE * max(float(np.abs(values).max()), float(np.abs(displacement).max())):
        x, y = points[worst].tolist()
        raise ConflictingSupportsError(support.name, (x, y))


def free_modes(space: BoundarySpace, conditions: NodalConditions) -> FloatArray:
    """Return the rigid motions (n_motions, n_nodes, 2) of the nodes of a space that no support resists.

    Returns
    -------
    (n_motions, n_nodes, 2) array
        Linearly independent, of sizes about one; combinations of the `admissible_modes` and load-controlled motions.
    """
    points = dof_points(space)
    centre = 0.5 * (points.min(axis=0) + points.max(axis=0))
    motions = rigid_motions(points, centre, float(np.ptp(points, axis=0).max()))
    motions = motions[:, :, [*admissible_modes(space.mesh), *conditions.load_controlled]]
    fixed = np.einsum("nkc,ncm->nkm", conditions.frame, motions)[conditions.is_supported]
    if fixed.size:
        _, singular_values, directions = np.linalg.svd(np.linalg.qr(fixed, mode="r"), full_matrices=True)
        n_held = int(np.count_nonzero(singular_values >= FREE_MOTION_TOLERANCE * np.sqrt(len(fixed))))
        motions = motions @ directions[n_held:].T
    return motions.transpose(2, 0, 1)


def turning(motions: FloatArray) -> BoolArray:
    """Return which rigid motions (n_motions, n_nodes, 2) of unit size rotate the body."""
    return np.asarray(np.ptp(motions, axis=1).max(axis=1, initial=0.0) > _LEAST_TURN)
