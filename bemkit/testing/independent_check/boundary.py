"""The boundary of a solution, rebuilt from points on its elements, and the scales of its fields."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from bemkit.arrays import FloatArray, IntArray
from bemkit.geometry.spaces import element_nodes
from bemkit.operators.rigid_modes import rigid_motions
from bemkit.scene.conditions import Clamped, Contact, DistributedLoad, PrescribedDisplacement, RigidConnection, Roller
from bemkit.testing.independent_check.views import BodyView

CONTACT_LIMIT = 1e-6
"""Largest violation of contact, friction, supports and equilibrium in a right answer. Solvers stop at 1e-9 of a
traction that may be hundreds of times that of the answer (that of the body held everywhere)."""
EPSILON = float(np.finfo(float).eps)
_N_POINTS = 8
"""Gauss points of an element: exact for products of loads and displacements of degree 15."""
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
        Rows of ``solution.boundary.displacement`` that each element interpolates.
    node_points, node_normals : (n_elements, n_local, 2) arrays [m], [-]
        At the nodes of each element; normals are one-sided at corners.
    basis : (n_elements, n_local, n_places) array
        Lagrange polynomials at the quadrature points; zero for rows that an element of a lower degree repeats.
    traction : (n_elements, n_places, 2) array [Pa]
        Loads as they are given, reactions of supports as means of elements; none of contact, which is known at nodes.
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
    held: tuple[Support, ...]

    @property
    def lengths(self) -> FloatArray:
        """(n_elements,) array [m]."""
        return np.asarray(self.shares.sum(axis=1))

    def interpolated(self, nodal: FloatArray) -> FloatArray:
        """Return (n_elements, n_places, 2) values of nodal vectors (n_nodes, 2)."""
        return np.asarray(np.einsum("enc,enq->eqc", nodal[self.nodes], self.basis))


def boundary_of(solution: BodyView) -> Boundary:
    """Return the elements of a solution with quadrature points, normals, loads, supports and interpolation."""
    mesh = solution.mesh
    places, weights = np.polynomial.legendre.leggauss(_N_POINTS)
    space = solution.scene.discretisation.displacement_space(mesh)  # only to distinguish the rows of a result
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
        traction=_tractions(solution, points, normals),
        held=tuple(_held(solution, node_points, node_normals)),
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


def _tractions(solution: BodyView, points: FloatArray, normals: FloatArray) -> FloatArray:
    """Return `Boundary.traction`."""
    traction = np.zeros_like(points)
    for part in solution.scene.parts:
        elements = solution.mesh.part(part.name)
        if isinstance(part.condition, DistributedLoad):
            load = part.condition.at(points[elements].reshape(-1, 2), normals[elements].reshape(-1, 2))
            traction[elements] = load.reshape(traction[elements].shape)
        elif not isinstance(part.condition, Contact):
            traction[elements] = solution.boundary.traction[elements][:, None]
    return traction


def _held(solution: BodyView, node_points: FloatArray, node_normals: FloatArray) -> Iterator[Support]:
    """Yield the directions in which the supports hold the body."""
    for part in solution.scene.parts:
        elements = solution.mesh.part(part.name)
        points = node_points[elements]
        match part.condition:
            case Clamped():
                given, components = np.zeros_like(points), [0, 1]
            case PrescribedDisplacement(is_prescribed=is_prescribed) as condition:
                given = condition.at(points.reshape(-1, 2)).reshape(points.shape)
                components = np.flatnonzero(is_prescribed).tolist()
            case RigidConnection():
                given, components = _rigidly_moved(solution, elements, points), [0, 1]
            case Roller():
                yield Support(elements, node_normals[elements], np.zeros(points.shape[:2]))
                continue
            case _:
                continue
        for component in components:
            yield Support(elements, np.broadcast_to(np.eye(2)[component], points.shape), given[:, :, component])


def _rigidly_moved(solution: BodyView, elements: IntArray, points: FloatArray) -> FloatArray:
    """Return the rigid motion (n_elements, n_local, 2) nearest to the displacements of some elements."""
    space = solution.scene.discretisation.displacement_space(solution.mesh)
    displacement = solution.boundary.displacement[space.element_dofs[elements]]
    motions = rigid_motions(points.reshape(-1, 2), points.mean(axis=(0, 1)), solution.mesh.diameter).reshape(-1, 3)
    amounts = np.linalg.lstsq(motions, displacement.ravel(), rcond=None)[0]
    return np.asarray((motions @ amounts).reshape(points.shape))


class Scales(NamedTuple):
    """Sizes that violations are divided by.

    Parameters
    ----------
    stress : float [Pa]
        Largest traction on the boundary, but no less than `trusted_stress`.
    length : float [m]
        Displacement that this traction causes across the body, ``stress * diameter / E'``. Smaller remainders of rigid
        motions that are a million times longer are
        round-off. If there are no tractions at all, as in a body that has given way
        to an overlap, its displacement is the only length there is.
    coordinates : float [m]
        Round-off of lengths that are differences of coordinates.
    turned : float [m]
        Round-off of displacement components: the largest displacement times the error of normals of curved elements,
        which are differentiated from coordinates.
    """

    stress: float
    length: float
    coordinates: float
    turned: float


def scales_of(solution: BodyView, before: BodyView | None = None) -> Scales:
    """Return the scales of the violations in a solution.

    What is left of the load step `before` is known no better than its own tractions were.
    """
    # round-off of coordinates and gaps
    modulus, diameter = solution.scene.material.plane_modulus, solution.mesh.diameter
    displacement = float(np.abs(solution.boundary.displacement).max())
    table = solution.contact
    gaps = np.abs(table.gap[np.isfinite(table.gap)]).max(initial=0.0)
    coordinates = 64.0 * EPSILON * (float(np.abs(solution.mesh.nodes).max()) + float(gaps))
    # the largest traction, if it is more than round-off, and the displacement that it causes
    fields = (solution.boundary.traction, table.sigma_n, table.sigma_t)
    largest_traction = max(float(np.abs(each).max(initial=0.0)) for each in fields)
    trusted = trusted_stress(solution, before)
    stress = max(largest_traction, trusted)
    length = max(stress / modulus * diameter, 1e-6 * displacement)
    # forces inside strain a body, too, that an overlap has pushed aside and that touches nothing any more
    deciding = fields[1:] if solution.scene.body_forces and table.n_contact else fields
    if max(float(np.abs(each).max(initial=0.0)) for each in deciding) <= CONTACT_LIMIT * trusted:
        # the body has only moved: a hundredth of that, to be strict; back at rest, round-off of gaps is all there is
        length = max(length, 1e-2 * displacement, coordinates / CONTACT_LIMIT)
    curved = solution.mesh.lengths[~solution.mesh.is_straight]
    # derivatives of 14 points amplify their errors by up to 14^2 at the ends of an element
    error = 200.0 * EPSILON * float(np.abs(solution.mesh.nodes).max()) / float(curved.min()) if curved.size else 0.0
    return Scales(stress or 1.0, length or 1.0, coordinates, (error + 1e-12) * displacement)


def trusted_stress(solution: BodyView, before: BodyView | None = None) -> float:
    """Return the least scale of stresses [Pa]: its `CONTACT_LIMIT`-th part is the round-off of tractions.

    What is left of the load step `before` is known no better than its tractions were.

    A displacement has a round-off of some eps of its size: across a node of length h the strain ``eps |u| / h``, times
    E' a stress, which a bulk modulus beyond E' magnifies. A body in rigid motion, such as one pushed aside by an
    overlap, has no other tractions. The allowance ends at 1e-10 of the tractions by which the displacement would strain
    the whole body, also for tiny elements and nearly incompressible bodies.
    """
    material, diameter = solution.scene.material, solution.mesh.diameter
    freedom = 1.0 if material.is_incompressible else min(1.0, 1.0 - 2.0 * material.effective_poisson_ratio)
    lengths = solution.contact.weight if solution.contact.n_contact else solution.mesh.lengths
    digits = 64.0 * EPSILON * diameter / (float(lengths.min()) * freedom)
    strain = float(np.abs(solution.boundary.displacement).max()) / diameter
    trusted = min(digits / CONTACT_LIMIT, 1e-4) * strain * material.plane_modulus
    return trusted if before is None else max(trusted, trusted_stress(before))


def largest(values: FloatArray) -> float:
    """Return the largest value, at least zero; nan if there is one."""
    return float(np.max(np.maximum(values, 0.0), initial=0.0))


def beyond(differences: FloatArray, allowed: float, unit: float) -> float:
    """Return the largest difference beyond what is allowed, in units; nan if there is one."""
    return max(largest(differences) - allowed, 0.0) / unit if not np.isnan(differences).any() else float("nan")
