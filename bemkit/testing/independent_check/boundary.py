"""The boundary of a body, rebuilt from points on its elements, with loads, reactions and supports."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from bemkit.arrays import BoolArray, FloatArray, IntArray
from bemkit.geometry.spaces import element_nodes
from bemkit.operators.rigid_modes import rigid_motions
from bemkit.results.solved_body import SolvedBody
from bemkit.scene.conditions import Clamped, DistributedLoad, PrescribedDisplacement, RigidConnection, Roller

_N_POINTS = 8
"""Gauss points of an element: exact for products of loads and displacements of degree 15."""
_HOLDING = (Clamped, PrescribedDisplacement, RigidConnection, Roller)
_N_FITTED = 14
"""Points whose polynomial is differentiated: on an arc of 90 degrees 8 of them leave 1e-6, 14 of them round-off."""


class Support(NamedTuple):
    """A direction in which a support holds the nodes of its elements.

    Parameters
    ----------
    elements : (m,) int array
    directions : (m, n_local, 2) array [-]
    values : (m, n_local) array [m]
        Prescribed components of the displacement along the directions.
    """

    elements: IntArray
    directions: FloatArray
    values: FloatArray


@dataclass(frozen=True, eq=False)
class Boundary:
    """Points on each element, the given data there, and the interpolation of nodal values.

    Parameters
    ----------
    points, normals : (n_elements, n_places, 2) arrays [m], [-]
        At the quadrature points; the normals point out of the body.
    shares : (n_elements, n_places) array [m]
        Quadrature weights: the length of boundary of each point.
    nodes : (n_elements, n_local) int array
        Rows of ``SolvedBody.boundary.displacement`` that each element interpolates.
    node_points, node_normals : (n_elements, n_local, 2) arrays [m], [-]
        At the nodes of each element; normals are one-sided at corners.
    basis : (n_elements, n_local, n_places) array
        Lagrange polynomials at the quadrature points; zero for rows that an element of a lower degree repeats.
    traction : (n_elements, n_places, 2) array [Pa]
        Loads as they are given, none on free elements; reactions and tractions of contact as the solution says.
    is_touched : (n_elements,) bool array
        Elements that belong to contacts.
    held : tuple of Support
    """

    points: FloatArray
    normals: FloatArray
    shares: FloatArray
    nodes: IntArray
    node_points: FloatArray
    node_normals: FloatArray
    basis: FloatArray
    traction: FloatArray
    is_touched: BoolArray
    held: tuple[Support, ...]

    @property
    def lengths(self) -> FloatArray:
        """(n_elements,) array [m]."""
        return np.asarray(self.shares.sum(axis=1))

    @property
    def forces(self) -> FloatArray:
        """(n_elements, n_places, 2) array [N/m]: of the tractions at each quadrature point."""
        return self.traction * self.shares[..., None]

    @property
    def loads(self) -> FloatArray:
        """(n_elements, n_places, 2) array [N/m]: the forces of given loads."""
        is_load = ~self.is_touched
        for elements, _, _ in self.held:
            is_load[elements] = False
        return np.where(is_load[:, None, None], self.forces, 0.0)

    def interpolated(self, nodal: FloatArray) -> FloatArray:
        """Return (n_elements, n_places, 2) values of nodal vectors (n_nodes, 2)."""
        return np.asarray(np.einsum("enc,enq->eqc", nodal[self.nodes], self.basis))


def boundary_of(body: SolvedBody, touched: Collection[str]) -> Boundary:
    """Return the elements of a body with quadrature points, normals, loads, supports and interpolation.

    Parameters
    ----------
    body : SolvedBody
    touched : collection of str
        Names of its parts in contacts.
    """
    mesh, is_touched = body.mesh, np.zeros(body.mesh.n_elements, bool)
    for part in touched:
        is_touched[mesh.part(part)] = True
    places, weights = np.polynomial.legendre.leggauss(_N_POINTS)
    space = body.scene.discretisation.displacement_space(mesh)  # only to distinguish the rows of a result
    elements = np.arange(mesh.n_elements)
    fitted = np.polynomial.legendre.leggauss(_N_FITTED)[0]
    curve = mesh.points(elements, fitted) - mesh.centre
    slopes, node_places = _slopes(curve, fitted, places), element_nodes(space)
    node_slopes, basis = np.empty((*node_places.shape, 2)), np.zeros((*node_places.shape, places.size))
    kinds, kind = np.unique(node_places, axis=0, return_inverse=True)
    for number, nodes in enumerate(kinds):
        own, different = np.flatnonzero(kind.ravel() == number), np.unique(nodes, return_index=True)[1]
        node_slopes[own] = _slopes(curve[own], fitted, nodes)
        powers = (np.vander(where, different.size).T for where in (nodes[different], places))
        basis[np.ix_(own, different)] = np.linalg.solve(*powers)
    # on straight elements half the chord is exact, where differences of points lose digits
    half_chord = 0.5 * (mesh.end - mesh.start)[mesh.is_straight][:, None]
    slopes[mesh.is_straight] = node_slopes[mesh.is_straight] = half_chord
    points, normals = mesh.points(elements, places), _turned_right(slopes)
    node_points, node_normals = mesh.points(elements, node_places), _turned_right(node_slopes)
    return Boundary(
        points=points,
        normals=normals,
        shares=np.hypot(slopes[..., 0], slopes[..., 1]) * weights,
        nodes=space.element_dofs,
        node_points=node_points,
        node_normals=node_normals,
        basis=basis,
        traction=_tractions(body, points, normals, is_touched),
        is_touched=is_touched,
        held=tuple(_held(body, node_points, node_normals)),
    )


def _turned_right(vectors: FloatArray) -> FloatArray:
    """Return unit vectors (..., 2) at a right angle to the right: outward normals of anticlockwise tangents."""
    size = np.hypot(vectors[..., 0], vectors[..., 1])
    return np.stack([vectors[..., 1] / size, -vectors[..., 0] / size], axis=-1)


def _slopes(values: FloatArray, places: FloatArray, targets: FloatArray) -> FloatArray:
    """Differentiate values (n, n_places, 2) at some places by their interpolating polynomial, at other places."""
    legendre = np.polynomial.legendre
    degree = places.size - 1
    coefficients = np.linalg.solve(legendre.legvander(places, degree), values.swapaxes(0, 1).reshape(places.size, -1))
    slopes = legendre.legvander(targets, degree - 1) @ legendre.legder(coefficients)
    return np.asarray(slopes.reshape(targets.size, len(values), 2).swapaxes(0, 1))


def _tractions(body: SolvedBody, points: FloatArray, normals: FloatArray, is_touched: BoolArray) -> FloatArray:
    """Return `Boundary.traction`."""
    traction, is_known = np.zeros_like(points), is_touched.copy()
    for part in body.scene.parts:
        elements = body.mesh.part(part.name)
        if isinstance(part.condition, DistributedLoad):
            load = part.condition.at(points[elements].reshape(-1, 2), normals[elements].reshape(-1, 2))
            traction[elements] = load.reshape(traction[elements].shape)
        elif isinstance(part.condition, _HOLDING):
            is_known[elements] = True
    space = body.scene.discretisation.traction_space(body.mesh)
    values = body.boundary.traction_dofs.reshape(body.mesh.n_elements, -1, 2)
    basis = space.basis(np.polynomial.legendre.leggauss(_N_POINTS)[0])
    traction[is_known] = np.einsum("lq,elc->eqc", basis, values[is_known])
    return traction


def _held(body: SolvedBody, node_points: FloatArray, node_normals: FloatArray) -> Iterator[Support]:
    """Yield the directions in which the supports hold the body."""
    for part in body.scene.parts:
        elements = body.mesh.part(part.name)
        points = node_points[elements]
        match part.condition:
            case Clamped():
                given, components = np.zeros_like(points), [0, 1]
            case PrescribedDisplacement(is_prescribed=is_prescribed) as condition:
                given = condition.at(points.reshape(-1, 2)).reshape(points.shape)
                components = np.flatnonzero(is_prescribed).tolist()
            case RigidConnection():
                given, components = _rigidly_moved(body, elements, points), [0, 1]
            case Roller():
                yield Support(elements, node_normals[elements], np.zeros(points.shape[:2]))
                continue
            case _:
                continue
        for component in components:
            yield Support(elements, np.broadcast_to(np.eye(2)[component], points.shape), given[:, :, component])


def _rigidly_moved(body: SolvedBody, elements: IntArray, points: FloatArray) -> FloatArray:
    """Return the rigid motion (n_elements, n_local, 2) nearest to the displacements of some elements."""
    space = body.scene.discretisation.displacement_space(body.mesh)
    displacement = body.boundary.displacement[space.element_dofs[elements]]
    motions = rigid_motions(points.reshape(-1, 2), points.mean(axis=(0, 1)), body.mesh.diameter).reshape(-1, 3)
    amounts = np.linalg.lstsq(motions, displacement.ravel(), rcond=None)[0]
    return np.asarray((motions @ amounts).reshape(points.shape))


def mean_normals(body: SolvedBody, boundary: Boundary, part: str) -> FloatArray:
    """Return (n_nodes, 2) normals: mean by length of a part's elements that meet at a node, zero elsewhere."""
    elements = body.mesh.part(part)
    total = np.zeros_like(body.boundary.points)
    weighted = boundary.node_normals[elements] * boundary.lengths[elements][:, None, None]
    np.add.at(total, boundary.nodes[elements], weighted)
    size = np.hypot(total[:, 0], total[:, 1])
    return np.asarray(total / np.where(size > 0.0, size, 1.0)[:, None])


def supported_nodes(body: SolvedBody, boundary: Boundary) -> IntArray:
    """Return the nodes on supports and on symmetry lines, which hold a body like rollers."""
    mesh = body.mesh
    found = [np.zeros(0, np.intp)]
    for part in body.scene.parts:
        if isinstance(part.condition, Clamped | Roller | PrescribedDisplacement):
            found.append(boundary.nodes[mesh.part(part.name)].ravel())
    if mesh.symmetry is not None and boundary.nodes.shape[1] > 1:  # midpoints of elements lie on no line
        found.append(np.flatnonzero(mesh.on_symmetry_lines.any(axis=1)))
    return np.unique(np.concatenate(found))
