"""Stresses of a body at many points: on its boundary from the boundary data, inside from its interior fields.

Close to the boundary the fields inside have peaks at the ends of elements, where boundary data kink. Points are
therefore chosen opposite the middle of elements, and stresses on the boundary itself follow from tractions and from
the strain along it by Hooke's law.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial import KDTree

from bemkit.arrays import FloatArray, IntArray
from bemkit.geometry.local_values import values_on_elements
from bemkit.geometry.mesh import BoundaryMesh
from bemkit.geometry.spaces import BoundarySpace
from bemkit.geometry.vectors import turned_right
from bemkit.operators.material import Material
from bemkit.pictures.crowds import seen_apart
from bemkit.results.interior import interior_fields, whole_boundary
from bemkit.results.solved_body import SolvedBody

_STEP = 1.4
"""Distance of the first points inside from the boundary, in lengths of their elements: half as far from constant
elements stresses are wrong by a thirtieth, there by two hundredths of that."""
_NEAREST = 0.7
"""Distance of points of a layer from all elements, by that from their own, below which others are closer."""
_SMALLEST = 1.0 / 8.0
"""Distance from the boundary, by the spacing far from it, below which points are not seen apart."""
_CROWDED = 0.25
"""Distance of points of a layer, by that from the boundary, below which one of them represents all."""
_GROWTH = 2.0
"""Ratio of the distances of successive layers of points from the boundary."""
_PER_ELEMENT = 2
"""Points of an element whose fields vary along it."""
_DIFFERENCE = 1e-4
"""Half step of differences in the local coordinate: their error is its square."""


@dataclass(frozen=True, eq=False)
class StressPoints:
    """Stresses (n, 2, 2) [Pa] at points (n, 2) [m] on the boundary and inside of it, which may have moved."""

    points: FloatArray
    stresses: FloatArray


def stress_points(body: SolvedBody, spacing: float, frame: FloatArray, *, moved: bool = False) -> StressPoints:
    """Evaluate the stress of a body.

    Parameters
    ----------
    body : Solution or BodyResult
    spacing : float [m]
        Of points far from the boundary; closer to it they are as dense as its elements.
    frame : (2, 2) array [m]
        Where points are wanted, of bodies without an end.
    moved : bool
        Whether the points are where the displacement has carried them.
    """
    mesh = body.mesh.whole
    space, displacement, tractions, traction = whole_boundary(body)
    n = 1 if space.degree <= 1 else _PER_ELEMENT
    xi = (2.0 * np.arange(n) + 1.0) / n - 1.0
    elements = np.arange(mesh.n_elements)
    on_elements = _on_boundary(mesh, body.scene.material, xi, space, displacement, tractions, traction)
    on_boundary = mesh.points(elements, xi).reshape(-1, 2)
    stresses = on_elements.reshape(-1, 2, 2)
    if body.particular is not None:
        stresses = stresses + body.particular.stress(on_boundary)
    normals = mesh.normals_at(elements, xi).reshape(-1, 2)
    lengths = np.repeat(mesh.lengths / n, n)
    fields = interior_fields(body)
    inner = _inner_points(on_boundary, normals, lengths, spacing, frame, mesh.is_exterior)
    inner = inner[fields.is_inside(inner)]
    corners, at_corners = _at_nodes(mesh, stresses.reshape(mesh.n_elements, n, 2, 2))
    points, at_points = np.concatenate([on_boundary, corners]), np.concatenate([stresses, at_corners])
    seen = seen_apart(points, np.abs(at_points).max(axis=(1, 2)), _SMALLEST * spacing)
    if moved:
        own = values_on_elements(space, displacement)
        inside, at_ends = (
            np.einsum("pq,epc->eqc", space.basis(at), own).reshape(-1, 2) for at in (xi, np.array([-1.0]))
        )
        known = np.concatenate([inside, at_ends[np.maximum(mesh.node_elements[:, 1], 0)]])
        if body.particular is not None:
            known = known + body.particular.displacement(points)
        points, at_inner = points + known, inner + fields.displacement(inner)
    else:
        at_inner = inner
    return StressPoints(
        np.concatenate([points[seen], at_inner]), np.concatenate([at_points[seen], fields.stress(inner)])
    )


def _on_boundary(
    mesh: BoundaryMesh,
    material: Material,
    xi: FloatArray,
    space: BoundarySpace,
    displacement: FloatArray,
    tractions: BoundarySpace,
    traction: FloatArray,
) -> FloatArray:
    """Return stresses (n_elements, q, 2, 2) from tractions and the strain along the boundary."""
    elements = np.arange(mesh.n_elements)
    normals = mesh.normals_at(elements, xi)
    tangents = -turned_right(normals)
    if space.is_continuous:
        ahead, behind = (space.basis(np.clip(xi + step, -1.0, 1.0)) for step in (_DIFFERENCE, -_DIFFERENCE))
        slopes = np.einsum(
            "pq,epc->eqc", (ahead - behind) / (2.0 * _DIFFERENCE), values_on_elements(space, displacement)
        )
        derivative = slopes / mesh.jacobian(elements, xi)[..., None]
    else:
        derivative = np.repeat(_slopes(mesh, space, displacement)[:, None], xi.size, axis=1)
    strain = np.sum(derivative * tangents, axis=2)
    t = np.einsum("lq,elc->eqc", tractions.basis(xi), traction[tractions.element_dofs])
    normal, shear = np.sum(t * normals, axis=2), np.sum(t * tangents, axis=2)
    ratio = material.effective_poisson_ratio
    along = material.plane_modulus * strain + ratio / (1.0 - ratio) * normal
    frame = np.stack([normals, tangents], axis=2)
    local = np.stack([np.stack([normal, shear], axis=2), np.stack([shear, along], axis=2)], axis=3)
    return np.asarray(np.einsum("eqki,eqkl,eqlj->eqij", frame, local, frame))


def _slopes(mesh: BoundaryMesh, space: BoundarySpace, displacement: FloatArray) -> FloatArray:
    """Return derivatives (n_elements, 2) along the boundary of what is constant on each element.

    At corners, where differences of neighbours mean nothing, only from the other neighbour.
    """
    values = displacement[space.element_dofs[:, 0]]
    before, after = mesh.node_elements[mesh.elements[:, 0], 0], mesh.node_elements[mesh.elements[:, 1], 1]
    slopes, weights = np.zeros_like(values), np.zeros(len(values))
    for other, sign in ((before, -1.0), (after, 1.0)):
        distance = 0.5 * (mesh.lengths + mesh.lengths[other])
        is_smooth = np.sum(mesh.normals * mesh.normals[other], axis=1) > 0.5
        slopes += np.where(is_smooth, sign / distance, 0.0)[:, None] * (values[other] - values)
        weights += is_smooth
    return np.asarray(slopes / np.maximum(weights, 1.0)[:, None])


def _at_nodes(mesh: BoundaryMesh, stresses: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the nodes and the means of the stresses beside them, so that pictures reach into corners."""
    before, after = mesh.node_elements.T
    return mesh.nodes, 0.5 * (stresses[before, -1] + stresses[after, 0])


def _inner_points(
    on_boundary: FloatArray,
    normals: FloatArray,
    lengths: FloatArray,
    spacing: float,
    frame: FloatArray,
    is_exterior: bool,
) -> FloatArray:
    """Return layers of points along the inner normals, the denser the shorter the elements, and a grid between them."""
    tree = KDTree(on_boundary)
    layers = []
    depth = np.maximum(_STEP * lengths, _SMALLEST * spacing)
    while (going := depth < 1.5 * spacing).any():
        points, inward = on_boundary[going] - depth[going, None] * normals[going], depth[going]
        few = _apart(points, _CROWDED * inward)  # each distance to the boundary takes long
        points, inward = points[few], inward[few]
        is_kept = tree.query(points)[0] > _NEAREST * inward
        points, inward = points[is_kept], inward[is_kept]
        layers.append(points[_apart(points, inward)])
        depth = np.where(going, _GROWTH * depth, np.inf)
    inner = np.concatenate([np.zeros((0, 2)), *layers])
    low, high = (frame[:, 0], frame[:, 1]) if is_exterior else (on_boundary.min(axis=0), on_boundary.max(axis=0))
    x, y = (np.arange(a, b + spacing, spacing) for a, b in zip(low, high, strict=True))
    grid = np.stack(np.meshgrid(x, y), axis=2).reshape(-1, 2)
    distance, nearest = tree.query(grid)
    grid = grid[distance > np.maximum(0.7 * spacing, lengths[nearest])]
    if len(inner) and len(grid):
        grid = grid[KDTree(inner).query(grid)[0] > 0.5 * spacing]
    return np.concatenate([inner, grid])


def _apart(points: FloatArray, distance: FloatArray) -> IntArray:
    """Return which of points (n, 2) that are closer to each other than distances (n,), about, represent all of them."""
    cell = 2.0 ** np.floor(np.log2(distance))
    keys = np.column_stack([np.round(points / cell[:, None]), cell])
    _, first = np.unique(keys, axis=0, return_index=True)
    return np.sort(first)
