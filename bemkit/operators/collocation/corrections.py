"""Corrections of constant elements: slopes of displacements, and reciprocities that determine uniform pressures.

Slopes give the double layer second order. In complex notation the displacement on element j is u_j + g_j (y - x_j),
with a slope g_j from the midpoint values of the element and its neighbours. In the local coordinate t this is
u_j + s_j p(t) with s_j = g_j l tau, and p(t) = t on straight elements. Each element still has one unknown displacement.
Rotations have the slope i on all elements, so they are represented exactly.

The mean of the parabola through the three midpoint values differs from u_j by b_j (l tau)^2 / 3, with its leading
coefficient b_j. This difference is added to the constant part. Without it the displacement of a bent body would be off
by h^2 / 24 times its curvature except at the midpoint, which makes results of thin bodies wrong.

The displacement equation hardly determines a uniform pressure on a closed curve, which displaces the boundary only by
its compressibility: an error of the equation along the normals causes an error of the pressure 1 / (1 - 2 nu) times
larger, and at nu = 1/2 the pressure in a hole does not appear in the equation. Betti's theorem [Betti1872] for a field
w that transports volume through the curve determines the pressure at every Poisson's ratio. With the tractions t(w) of
w on the boundary,

    around a hole     w = a / conj(z - c),        t(w) ds = 2 mu i dw,     c in the hole, a its distance from the curve
    the outer curve   w = (1 - 2 nu) (z - c),     t(w) ds = -2 mu i dz

The first field is a source of volume, the second a uniform dilatation; both are elastic for every nu up to 1/2.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bemkit.arrays import BoolArray, ComplexArray, FloatArray, IntArray
from bemkit.geometry.mesh import BoundaryMesh
from bemkit.geometry.neighbours import corner_nodes
from bemkit.geometry.quadrature import gauss_legendre
from bemkit.operators.element_geometry import ElementGeometry
from bemkit.operators.material import Material

CORNER_ANGLE = 0.3
"""Smallest angle [rad] of a corner, across which no slope is taken; polygons of smooth curves have smaller angles."""
_POINTS = 16
"""Gauss points of an element; exact to round-off if the element is not longer than the width of the hole."""
_POINTS_OF_LINES = 2
"""Gauss points for a dilatation on straight elements, for which two are exact."""
_CANDIDATES = 64
"""Elements of a hole from which its largest circle is sought."""


class GradientReconstruction:
    """The linear displacements on elements that the midpoint value of each element causes, by least squares.

    Parameters
    ----------
    mesh : BoundaryMesh
        Closed.
    geometry : ElementGeometry

    Attributes
    ----------
    acted_on : (n_elements, 3) array
        Elements on which the value acts: the preceding one, the element itself, and the next one along the boundary.
    weights : (n_elements, 3, 2) complex array
        Constant part and slope of a unit value on these. On every element the constant parts add up to one, the slopes
        to zero.

    Notes
    -----
    Let x_k be the midpoints of an element and its neighbours and m their mean. The slope is sum c_k u_k with
    c_k = conj(x_k - m) / sum |x_j - m|^2: the derivative of the complex-linear least-squares fit, or of the regression
    line along a straight side. Neighbours across a corner are excluded, unless the element has corners at both ends.
    Elements at corners have no correction of the mean.
    """

    def __init__(self, mesh: BoundaryMesh, geometry: ElementGeometry) -> None:
        neighbours = np.empty((3, mesh.n_elements), dtype=np.intp)
        for loop in mesh.loops:
            neighbours[:, loop] = np.roll(loop, 1), loop, np.roll(loop, -1)
        is_corner = corner_nodes(mesh, CORNER_ANGLE)[mesh.elements].T
        centre, half = geometry.centre[neighbours], geometry.half * geometry.tangent
        is_used = np.ones(neighbours.shape, bool)
        is_used[0], is_used[2] = ~is_corner
        is_smooth = is_used.all(axis=0) & (neighbours[0] != neighbours[2])
        is_used[:, is_used.sum(axis=0) == 1] = True
        arm = np.where(is_used, centre - np.mean(centre, axis=0, where=is_used), 0.0)
        weights = arm.conj() / np.sum(np.square(arm.real) + np.square(arm.imag), axis=0)
        # of an element and its neighbours: their weights in its constant part and slope
        of_values = np.stack([_means(centre, half, is_smooth), weights * half], axis=2)
        of_values[1, :, 0] += 1.0
        # an element is neighbour 2 of the preceding one, 1 of itself and 0 of the next one
        self.acted_on = neighbours.T
        self.weights: ComplexArray = of_values[np.array([2, 1, 0]), self.acted_on]

    def gathered(self, on_constant: ComplexArray, on_slope: ComplexArray) -> ComplexArray:
        """Return the coefficients (..., n_elements) of values from those of constant parts and slopes."""
        of_values = np.stack([on_constant[..., self.acted_on], on_slope[..., self.acted_on]], axis=-1)
        return np.asarray((of_values * self.weights).sum(axis=(-2, -1)))


def _means(centre: ComplexArray, half: ComplexArray, is_smooth: BoolArray) -> ComplexArray:
    """Return the weights (3, n_elements) of the mean of b (y - x)^2, with the second divided difference b."""
    before, middle, after = centre
    back, ahead = np.where(is_smooth, before - middle, -1.0), np.where(is_smooth, after - middle, 1.0)
    of_mean = np.where(is_smooth, half**2 / 3.0, 0.0) / (ahead - back)
    return np.array([-of_mean / back, of_mean / back - of_mean / ahead, of_mean / ahead])


class Reciprocity:
    """Equations ``on_traction @ traction == on_displacement @ displacement``, indices 2 * element + component.

    Parameters
    ----------
    mesh : BoundaryMesh
        Loops that are images of each other share one equation.
    material : Material
    takes_slopes : bool
        Whether displacements have slopes; see `GradientReconstruction`.

    Attributes
    ----------
    on_traction : (n_loops, 2 n_elements) array [m/Pa]
    on_displacement : (n_loops, 2 n_elements) array [-]
    fields : (2 n_elements, n_loops) array [-]
        The fields at the midpoints: errors of the displacement equations that belong to these equations. They are
        smooth, so that they cause no jumps between short elements at corners.
    """

    def __init__(self, mesh: BoundaryMesh, material: Material, *, takes_slopes: bool) -> None:
        whole = mesh.whole
        geometry, centres = ElementGeometry(whole), _plane(whole.centres)
        reconstruction = GradientReconstruction(whole, geometry) if takes_slopes else None
        on_tractions, on_displacements, fields = [], [], []
        for loop, area in zip(mesh.loops, mesh.loop_areas, strict=True):
            images = _reciprocal_fields(mesh, loop, area)
            arcs = Arcs(whole, _POINTS_OF_LINES if area > 0.0 and whole.is_straight.all() else _POINTS)
            works = zip(*(field.work(arcs, material) for field in images), strict=True)
            on_traction, on_displacement, on_gradient = (np.sum(work, axis=0) for work in works)
            if reconstruction is not None:
                on_slope = on_gradient / (geometry.half * geometry.tangent)
                on_displacement = reconstruction.gathered(on_displacement, on_slope)
            on_tractions.append(_folded(mesh, on_traction))
            on_displacements.append(_folded(mesh, on_displacement))
            value = np.sum([field.value(centres) for field in images], axis=0)
            fields.append(np.stack([value.real, value.imag], axis=1)[: mesh.n_elements].ravel())
        shape = -1, 2 * mesh.n_elements
        self.on_traction, self.on_displacement, values = (
            np.reshape(rows, shape) for rows in (on_tractions, on_displacements, fields)
        )
        self.fields: FloatArray = values.T


@dataclass(frozen=True, eq=False)
class ReciprocalField:
    """The field w = a / conj(z - c) of a source in a hole, or (1 - 2 nu) (z - c) / a, a dilatation.

    Parameters
    ----------
    centre : complex [m]
        c.
    size : float [m]
        a: the distance of a source from the boundary, or the diameter of the body.
    is_source : bool
    """

    centre: complex
    size: float
    is_source: bool

    def value(self, z: ComplexArray) -> ComplexArray:
        """Return the field at points, that of a dilatation without the factor 1 - 2 nu."""
        arm = z - self.centre
        return np.asarray(self.size / arm.conj() if self.is_source else arm / self.size)

    def work(self, arcs: Arcs, material: Material) -> tuple[ComplexArray, ComplexArray, ComplexArray]:
        """Return the factors of tractions t, displacements u and gradients g in the work, (n_elements,) each.

        The real part of the sum over elements is the work of t on w, and of u + g (y - x) on t(w) / (2 mu), with the
        midpoint x of an element.
        """
        start, end, arm = arcs.start - self.centre, arcs.end - self.centre, arcs.z - self.centre
        if self.is_source:
            factor, change, steps = 1.0, self.size * (end - start) / (start * end), self.size * arcs.dz / arm**2
        else:
            factor = 1.0 - 2.0 * material.effective_poisson_ratio
            change, steps = (end - start).conj() / self.size, arcs.dz.conj() / self.size
        on_traction = np.sum(self.value(arcs.z).conj() * np.abs(arcs.dz), axis=1)
        on_traction *= factor / (2.0 * material.shear_modulus)
        return on_traction, 1j * change, 1j * np.sum(arcs.arm * steps, axis=1)


def _reciprocal_fields(mesh: BoundaryMesh, loop: IntArray, area: float) -> list[ReciprocalField]:
    """Return the fields of a closed curve: a dilatation, or sources in a hole and its images.

    A source lies in the centre of the largest circle within the hole.
    """
    if area > 0.0:
        return [ReciprocalField(complex(*mesh.centre), mesh.diameter, is_source=False)]
    centre, radius = _largest_circle(mesh, loop)
    symmetry = mesh.symmetry
    images = [centre] if symmetry is None else [symmetry.reflected(centre, signs) for signs in symmetry.images]
    return [ReciprocalField(complex(*image), radius, is_source=True) for image in images]


def _largest_circle(mesh: BoundaryMesh, loop: IntArray) -> tuple[FloatArray, float]:
    """Return centre and radius of the largest circle in a hole that touches the midpoint of one of its elements.

    A circle that touches x with the inward normal n and passes through y has the radius |y - x|^2 / (2 n (y - x)).
    """
    whole = mesh.whole
    around = next(other for other in whole.loops if loop[0] in other)
    x, y = whole.centres[around].T
    around = np.roll(around, -int(np.lexsort((y, x))[0]))  # independent of the numbers of elements
    touching = around[:: 1 + around.size // _CANDIDATES]
    points = np.concatenate([whole.centres[around], whole.start[around]])
    arms = points - whole.centres[touching, None]
    ahead = np.einsum("tpc,tc->tp", arms, whole.normals[touching])
    is_ahead = ahead > 0.0
    radii = np.divide(np.sum(arms**2, axis=2), 2.0 * ahead, out=np.full(ahead.shape, np.inf), where=is_ahead).min(
        axis=1
    )
    largest = int(np.argmax(np.where(np.isfinite(radii), radii, 0.0)))
    radius = float(radii[largest])
    return whole.centres[touching[largest]] + radius * whole.normals[touching[largest]], radius


class Arcs:
    """Gauss points on all elements of a mesh without symmetry.

    Attributes
    ----------
    start, end : (n_elements,) complex arrays [m]
    z, arm, dz : (n_elements, n_points) complex arrays [m]
        Points, their distances from the midpoint of the element, and weighted steps.
    """

    def __init__(self, mesh: BoundaryMesh, n_points: int) -> None:
        elements = np.arange(mesh.n_elements)
        xi, weights = gauss_legendre(n_points)
        self.start, self.end = _plane(mesh.start), _plane(mesh.end)
        self.z, self.dz = _plane(mesh.points(elements, xi)), _plane(mesh.derivatives(elements, xi)) * weights
        self.arm = self.z - _plane(mesh.centres)[:, None]


def _plane(vectors: FloatArray) -> ComplexArray:
    result: ComplexArray = vectors @ np.array([1.0, 1j])
    return result


def _folded(mesh: BoundaryMesh, on: ComplexArray) -> FloatArray:
    """Return the row (2 n_elements,) of Re sum (on v) for symmetric densities v on the whole body."""
    images = np.ones((1, 2)) if mesh.symmetry is None else mesh.symmetry.images
    rows = np.stack([on.real, -on.imag], axis=1).reshape(len(images), mesh.n_elements, 2)
    folded: FloatArray = np.einsum("gnc,gc->nc", rows, images).ravel()
    return folded
