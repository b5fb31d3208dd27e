"""Sample points of a contact between its nodes, closer together where the clearance is least."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import NamedTuple, TypeAlias

import numpy as np

from bemkit.arrays import BoolArray, FloatArray, IntArray
from bemkit.contact.contact_nodes import contact_frame
from bemkit.contact.laws import FrictionLaw
from bemkit.contact.obstacle import Obstacle, measure_contact
from bemkit.geometry.local_values import from_own_nodes
from bemkit.geometry.neighbours import along_boundary
from bemkit.geometry.spaces import BoundarySpace
from bemkit.geometry.vectors import norms
from bemkit.results.solved_body import SolvedBody

AddedGap: TypeAlias = Callable[[FloatArray], FloatArray]
"""Points (n, 2) [m] -> what is added to the distance there (n,) [m]."""
_POINTS_PER_NODE = 4
"""Sample points for each node of an element. Between them a polynomial exceeds its largest sample by a few per cent at
most."""
_SHORTEST = 4.0**-14
"""Length of the last interval about a least clearance, relative to its element: sharp corners of an obstacle overlap on
as short a piece as they are deep."""
_SAME = 1e-13
"""Distance along a side, relative to its length, up to which two points of an element are the same."""
_SAME_POINT = 1e-9
"""Distance of neighbouring points, relative to the next one, below which they are one point: the end of an element."""
FREE = 1e-6
"""Largest traction that counts as none, relative to the largest of all."""


class PointsBetween(NamedTuple):
    """Clearance and tractions at points of a contact, in (n, t) components.

    Parameters
    ----------
    points : (n, 2) array [m]
    s : (n,) array [m]
        Arc length from the start of the side.
    directions : (n, 2) array
        Of contact, out of the body.
    clearance : (n,) array [m]
    sigma_n, sigma_t : (n,) arrays [Pa]
    step : (n,) array [m]
        Half of the jump of displacements to the next element: the uncertainty of the clearance of constant elements.
    """

    points: FloatArray
    s: FloatArray
    directions: FloatArray
    clearance: FloatArray
    sigma_n: FloatArray
    sigma_t: FloatArray
    step: FloatArray

    def take(self, rows: BoolArray | IntArray) -> PointsBetween:
        """Return some of the points."""
        return PointsBetween(*(column[rows] for column in self))

    @property
    def is_free(self) -> BoolArray:
        """(n,) bool array: whether a point carries no traction."""
        size = np.hypot(self.sigma_n, self.sigma_t)
        return np.asarray(size <= FREE * size.max(initial=0.0))

    def beyond_zones(self) -> PointsBetween:
        """Return the points, with infinite clearance at those that no open point separates from a traction.

        The clearance of constant elements is the largest that their step allows. An overlap beside a contact zone
        belongs to the end of that zone.
        """
        free, clearance = self.is_free, self.clearance + self.step
        is_end = (free & (clearance >= 0.0)) | (np.diff(self.s, prepend=-np.inf) < -_SAME * self.s.max(initial=0.0))
        run = np.cumsum(is_end | np.append(False, (free & (clearance >= 0.0))[:-1]))
        is_attached = np.bincount(run, weights=~free)[run] > 0.0 if run.size else free
        return self._replace(clearance=np.where(free & ~is_attached, clearance, np.inf))


Sample: TypeAlias = Callable[[IntArray, FloatArray, FloatArray], PointsBetween]
"""Pieces (m,) of a side and an interval of each, from low (m,) to high (m,) within [-1, 1] -> points of each interval,
piece by piece."""


class MeasuredContact(NamedTuple):
    """A contact, the elastic bodies that it joins, its law, and what measures points of it."""

    name: str
    bodies: tuple[str, ...]
    law: FrictionLaw
    measure: Callable[[], PointsBetween]


def sample_at_obstacle(
    body: SolvedBody,
    obstacle: Obstacle,
    elements: IntArray,
    gap: AddedGap | None = None,
    shift: Callable[[FloatArray], FloatArray] | None = None,
) -> Sample:
    """Return the function that measures clearance and tractions on elements (m,) that face a rigid obstacle.

    Parameters
    ----------
    body : SolvedBody
    obstacle : Obstacle
    elements : (m,) int array
    gap : callable, optional
        Points (n, 2) -> what is added to the distance (n,) [m]; nothing by default.
    shift : callable, optional
        Points (n, 2) -> displacements (n, 2) [m] of the obstacle there; none by default.
    """
    mesh = body.mesh
    elements = along_boundary(mesh, elements)
    xi, lengths = points_between(_degree(body)), mesh.lengths[elements]
    starts = np.cumsum(lengths) - lengths

    def sample(pieces: IntArray, low: FloatArray, high: FloatArray) -> PointsBetween:
        chosen, at = elements[pieces], 0.5 * (low + high)[:, None] + 0.5 * (high - low)[:, None] * xi
        points = mesh.points(chosen, at).reshape(-1, 2)
        distance, directions = measure_contact(obstacle, points, mesh.normals_at(chosen, at).reshape(-1, 2))
        fields, frame = Interpolation.at(body, chosen, at), contact_frame(directions)
        moved = fields.displacement(body).reshape(-1, 2) - (0.0 if shift is None else shift(points))
        u_n, _ = np.einsum("nkc,nc->kn", frame, moved)
        sigma_n, sigma_t = np.einsum("nkc,nc->kn", frame, fields.traction(body).reshape(-1, 2))
        s = starts[pieces, None] + 0.5 * lengths[pieces, None] * (at + 1.0)
        added = 0.0 if gap is None else gap(points)
        clearance, step = added + distance - u_n, fields.step(body).ravel()
        return PointsBetween(points, s.ravel(), directions, clearance, sigma_n, sigma_t, step)

    return sample


def _degree(body: SolvedBody) -> int:
    return body.scene.discretisation.displacement_space(body.mesh).degree


@dataclass(frozen=True, eq=False)
class Interpolation:
    """Interpolation of the fields of a body, and of its copies, at points (m, q) of elements (m,).

    Parameters
    ----------
    elements : (m,) int array
    dofs : (m, n_local) int array
        Of the displacements.
    of_displacement, of_traction : (m, q, n_local) arrays
    """

    elements: IntArray
    dofs: IntArray
    of_displacement: FloatArray
    of_traction: FloatArray

    @classmethod
    def at(cls, body: SolvedBody, elements: IntArray, xi: FloatArray) -> Interpolation:
        """Return the interpolation at local coordinates xi (m, q) of elements (m,) of a body."""
        discretisation, mesh = body.scene.discretisation, body.mesh
        displacements, tractions = discretisation.displacement_space(mesh), discretisation.traction_space(mesh)
        dofs = displacements.element_dofs[elements]
        unit = np.broadcast_to(np.eye(dofs.shape[1]), (*dofs.shape, dofs.shape[1]))
        of_displacement = _basis(displacements, xi) @ from_own_nodes(displacements, unit, elements)
        return cls(elements, dofs, of_displacement, _basis(tractions, xi))

    def displacement(self, body: SolvedBody) -> FloatArray:
        """Return displacements (m, q, 2) [m]."""
        return np.asarray(self.of_displacement @ body.boundary.displacement[self.dofs])

    def step(self, body: SolvedBody) -> FloatArray:
        """Return half of the largest jump (m, q) [m] of constant elements to a neighbour; zero of other elements."""
        mesh, steps = body.mesh, np.zeros(body.mesh.n_elements)
        if self.dofs.shape[1] == 1:
            before, after = mesh.node_elements[(mesh.node_elements >= 0).all(axis=1)].T
            jumps = 0.5 * norms(body.boundary.displacement[after] - body.boundary.displacement[before])
            for elements in (before, after):
                np.maximum.at(steps, elements, jumps)
        return np.broadcast_to(steps[self.elements, None], self.of_traction.shape[:2])

    def traction(self, body: SolvedBody) -> FloatArray:
        """Return tractions (m, q, 2) [Pa]."""
        at_nodes = body.boundary.traction_dofs.reshape(body.mesh.n_elements, -1, 2)
        return np.asarray(self.of_traction @ at_nodes[self.elements])


def _basis(space: BoundarySpace, xi: FloatArray) -> FloatArray:
    """Return the local basis (m, q, n_local) at xi (m, q)."""
    return space.basis(xi.ravel()).reshape(-1, *xi.shape).transpose(1, 2, 0)


def points_between(degree: int) -> FloatArray:
    """Return Chebyshev points of [-1, 1], dense at the ends like the nodes; ends and middle are among them."""
    n = _POINTS_PER_NODE * (degree + 1) + 1
    return -np.cos(np.pi * np.arange(n) / (n - 1))


def nearest_only(samples: Sequence[Sample], index: int) -> Sample:
    """Return one of several functions of the same pieces, with infinite clearance where another one is nearer."""

    def sample(pieces: IntArray, low: FloatArray, high: FloatArray) -> PointsBetween:
        rivals = [each(pieces, low, high) for each in samples]
        nearest = np.argmin([rival.clearance for rival in rivals], axis=0)
        own = rivals[index]
        return own._replace(clearance=np.where(nearest == index, own.clearance, np.inf))

    return samples[index] if len(samples) == 1 else sample


def with_least_clearances(sample: Sample, n_pieces: int, xi: FloatArray) -> PointsBetween:
    """Return points of all pieces, and more points where a penetration may lie between them.

    Parameters
    ----------
    sample : Sample
        Of the points at `xi` of each interval.
    n_pieces : int
    xi : (q,) array
        Ascending, from -1 to 1, at least four.

    Returns
    -------
    PointsBetween
        In the order of the arc length, without those that face nothing (their clearance is infinite).

    Notes
    -----
    A parabola falls below the least of three equidistant points by at most a quarter of the difference between them,
    and the distance from a sharp corner between two points by at most what it rises beyond them. An interval about the
    least of the points is searched where the difference of the points beside it leads below zero: about each minimum of
    a piece that is free of traction or apart at all points, because its contact may be missed, on the deepest of the
    others, and wherever points beside them face nothing.
    """
    pieces, low, high = np.arange(n_pieces), np.full(n_pieces, -1.0), np.ones(n_pieces)
    values = sample(pieces, low, high)
    found, owners = [values], [np.repeat(pieces, xi.size)]
    # friction that acts across a gap has a normal component where the direction of contact turns
    is_free = np.all((values.is_free | (values.clearance > 0.0)).reshape(n_pieces, xi.size), axis=1)
    least_overlap = _SAME * float(values.s.max(initial=0.0))
    while pieces.size:
        clearance, size = values.clearance.reshape(pieces.size, xi.size), high - low
        places = _least(clearance) | _beside_nothing(clearance)
        row, nearest = np.nonzero(places | ((is_free & (size == 2.0))[:, None] & _minima(clearance)))
        least = clearance[row, nearest]
        first = np.minimum(np.maximum(nearest - 1, 0), xi.size - 3)
        beside = np.minimum(np.maximum(nearest[:, None] + np.arange(-2, 3), 0), xi.size - 1)
        bound = 2.0 * least - clearance[row[:, None], beside].max(axis=1)
        goal = np.where(is_free[row], 0.0, least.min(initial=0.0))
        chosen = (bound < np.minimum(-least_overlap, goal)) & (size[row] > 2.0 * _SHORTEST)
        row, first = row[chosen], first[chosen]
        middle, pieces, is_free = 0.5 * (high + low)[row], pieces[row], is_free[row]
        low, high = (middle + 0.5 * size[row] * xi[end] for end in (first, first + 2))
        if pieces.size:
            values = sample(pieces, low, high)
            found.append(values)
            owners.append(np.repeat(pieces, xi.size))
    joined = PointsBetween(*(np.concatenate(columns) for columns in zip(*found, strict=True)))
    owner = np.concatenate(owners)
    order = np.lexsort((joined.s, owner))
    # intervals begin and end at points that are known already
    is_new = np.diff(joined.s[order], prepend=-np.inf) > _SAME * joined.s.max(initial=0.0)
    is_new |= np.diff(owner[order], prepend=-1) > 0
    return joined.take(order[is_new & (joined.clearance[order] != np.inf)])


def _least(clearance: FloatArray) -> BoolArray:
    """Mark the least of each row (m, q) of clearances that are not all infinite."""
    places = np.arange(clearance.shape[1]) == np.argmin(clearance, axis=1)[:, None]
    return np.asarray(places & np.isfinite(clearance))


def _beside_nothing(clearance: FloatArray) -> BoolArray:
    """Mark the points (m, q) beside those that face nothing: an obstacle ends between them."""
    known = np.isfinite(clearance)
    is_beside = np.zeros_like(known)
    is_beside[:, 1:] |= ~known[:, :-1]
    is_beside[:, :-1] |= ~known[:, 1:]
    return known & is_beside


def _minima(clearance: FloatArray) -> BoolArray:
    """Mark the minima (m, q) of each row of clearances, those at the ends included."""
    is_minimum = np.concatenate([clearance[:, :1] < np.inf, clearance[:, 1:] < clearance[:, :-1]], axis=1)
    is_minimum[:, :-1] &= clearance[:, :-1] <= clearance[:, 1:]
    return is_minimum


def deepest(values: PointsBetween) -> tuple[float, FloatArray]:
    """Return the largest penetration [m], and the point (2,) that is nearest to it.

    It lies at the end of the parabola through the deepest point and those beside it, if that end lies between them: the
    points know a polynomial to some per cent of its range on an element, which may be all of a penetration.
    """
    if not values.clearance.size:
        return 0.0, np.full(2, np.nan)
    k, clearance = int(np.argmin(values.clearance)), values.clearance
    least = float(clearance[k])
    has_both = 0 < k < clearance.size - 1 and bool(np.isfinite(clearance[k - 1 : k + 2]).all())
    before, after = np.diff(values.s[k - 1 : k + 2]) if has_both else (0.0, 0.0)
    apart = max(_SAME_POINT * max(before, after), _SAME * float(values.s.max()))
    if min(before, after) > apart:  # within an element
        fall, rise = -np.diff(clearance[k - 1 : k + 2]) / (before, after)
        curvature, slope = (rise - fall) / (before + after), (fall * after + rise * before) / (before + after)
        if curvature < 0.0 and -before <= -0.5 * slope / curvature <= after:
            least += float(0.25 * slope**2 / curvature)
    return float(np.maximum(-least, 0.0)), values.points[k]
