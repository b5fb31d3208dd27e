"""Half-planes: displacements by Flamant's solution from the tractions, and balances with loads far away.

Tractions (p, q), p into the half-plane and q along s, displace its surface at x along s and inward by

    u_s(x) = -k {int_{s<x} p ds - int_{s>x} p ds} - 2 / (pi E') int q log|x - s| ds,
    u_in(x) = -2 / (pi E') int p log|x - s| ds + k {int_{s<x} q ds - int_{s>x} q ds},

k = (1 - 2 nu) (1 + nu) / (2 E) in plane strain and (1 - nu) / (2 E) in plane stress. Under images at each period the
logarithms add up to log|2 sin(pi (x - s) / period)|, by Euler's product, and the signs to 1 - 2 (x - s) / period.

Results are means over elements. The mean over two elements is an integral over the distance of their points, each
distance counted as often as it occurs; near zero the double exponential rule finds it, else Gauss's.

References
----------
K. L. Johnson, Contact Mechanics, Cambridge University Press 1985, equations (2.24).
H. Takahasi, M. Mori, Publ. RIMS 9 (1974) 721-741, for the rule.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from bemkit.arrays import FloatArray, IntArray
from bemkit.operators.material import Plane
from bemkit.scene.plane_motion import FarField
from bemkit.testing.independent_check.bodies import MeasuredBody

_MOST_PAIRS = 250_000
"""Largest number of pairs of elements: of more than 500 elements some displacements are skipped, but no traction."""
_STEP, _REACH = 0.14, 3.1
"""Step and range of the double exponential rule: 1e-10 of a mean logarithm, for any lengths of the elements."""
_NEAR, _N_GAUSS = 3.0, 8
"""Distance, in half the sum of lengths, beyond which Gauss points suffice, and their number: 1e-12 of a mean
logarithm."""
_IN_MOTION = 1e-6
"""Share of the motion of the whole body that counts as a displacement by tractions: below that it is round-off."""


@dataclass(frozen=True, eq=False)
class Surface:
    """The fields of a half-plane on its elements, measured again.

    Parameters
    ----------
    measured : MeasuredBody
    along, inward : (2,) arrays [-]
        Directions along s and into the half-plane.
    place, lengths : (n_elements,) arrays [m]
        Of the middles of the elements along s.
    force : (n_elements, 2) array [N/m]
        Of the tractions on each element, in x and y.
    """

    measured: MeasuredBody
    along: FloatArray
    inward: FloatArray
    place: FloatArray
    lengths: FloatArray
    force: FloatArray

    @classmethod
    def of(cls, measured: MeasuredBody) -> Surface:
        """Measure the surface of a body."""
        body, boundary = measured.solved, measured.boundary
        outward = boundary.normals.mean(axis=(0, 1))
        outward /= np.hypot(*outward)
        along, lengths = np.array([outward[1], -outward[0]]), boundary.lengths
        middles = np.einsum("eqc,eq->ec", boundary.points - body.mesh.centre, boundary.shares) / lengths[:, None]
        force = body.boundary.traction * lengths[:, None]
        return cls(measured, along, -outward, middles @ along, lengths, force)

    @property
    def far(self) -> FarField:
        """Its motion far away; at rest by default."""
        return self.measured.solved.scene.far or FarField()

    @property
    def is_periodic(self) -> bool:
        """Whether the surface is periodic."""
        surface = self.measured.solved.mesh.surface
        return surface is not None and surface.is_periodic

    @cached_property
    def extent(self) -> float:
        """Length [m] of the strip, or of a period."""
        return float(self.lengths.sum())

    @cached_property
    def motions(self) -> FloatArray:
        """(n_elements, 2, 3) array: displacements by unit motions along x and y and a unit turn about the centre."""
        offset = self.measured.solved.boundary.points - np.array(self.far.centre)
        motions = np.zeros((*offset.shape, 3))
        motions[:, 0, 0] = motions[:, 1, 1] = 1.0
        motions[:, :, 2] = np.column_stack([-offset[:, 1], offset[:, 0]])
        return motions

    @cached_property
    def seen(self) -> IntArray:
        """Elements whose displacements are computed again."""
        n = self.lengths.size
        return np.unique(np.linspace(0, n - 1, min(n, max(_MOST_PAIRS // n, 2))).round().astype(np.intp))

    @cached_property
    def by_tractions(self) -> FloatArray:
        """(n_seen, 2) array [m]: mean displacements in x and y that the tractions cause."""
        material = self.measured.solved.scene.material
        e, nu = material.youngs_modulus, material.poisson_ratio
        is_strain = material.plane is Plane.STRAIN
        by_logarithm = 2.0 / np.pi * ((1.0 - nu**2) if is_strain else 1.0) / e
        by_side = ((1.0 - 2.0 * nu) * (1.0 + nu) if is_strain else 1.0 - nu) / (2.0 * e)
        p, q = self.force @ self.inward, self.force @ self.along
        result = []
        for element in self.seen.tolist():
            logarithms, sides = self._logarithms(element), self._sides(element)
            u_s = -by_side * sides @ p - by_logarithm * logarithms @ q
            u_in = -by_logarithm * logarithms @ p + by_side * sides @ q
            result.append(u_s * self.along + u_in * self.inward)
        return np.array(result)

    def _distances(self, element: int) -> FloatArray:
        """Return the distances [m] along s of one element's middle from those of all others, ahead of them if positive.

        Of elements that repeat, the nearest image counts.
        """
        ahead = self.place[element] - self.place
        return np.asarray(ahead - self.extent * np.round(ahead / self.extent) if self.is_periodic else ahead)

    def _sides(self, element: int) -> FloatArray:
        """Return the mean signs (n_elements,) of x - s, x on one element and s on all, images included."""
        ahead = self._distances(element)
        side = np.sign(ahead) - (2.0 * ahead / self.extent if self.is_periodic else 0.0)
        side[element] = 0.0
        return np.asarray(side)

    def _logarithms(self, element: int) -> FloatArray:
        """Return the mean logarithms (n_elements,) of |x - s|, x on one element and s on all, images included.

        The points at rest are those of `ElasticHalfPlane` and `PeriodicHalfPlane`.
        """
        if self.is_periodic:  # of equal elements all rows are alike
            return np.roll(self._first_logarithms, element)
        return self._integrated(element)

    @cached_property
    def _first_logarithms(self) -> FloatArray:
        return self._integrated(0) - 0.5

    def _integrated(self, element: int) -> FloatArray:
        """Return the mean logarithms (n_elements,) of the distances of points of one element from those of all."""
        own = float(self.lengths[element])
        middle, half_sum = np.abs(self._distances(element)), 0.5 * (own + self.lengths)
        half_difference, least = 0.5 * np.abs(own - self.lengths), np.minimum(own, self.lengths)
        # how often a distance occurs: rising from zero, constant, falling to zero; on the element itself falling
        knots = np.stack([middle - half_sum, middle - half_difference, middle + half_difference, middle + half_sum])
        knots[:, element] = [0.0, 0.0, 0.0, own]
        knots = np.maximum(knots, 0.0)  # neighbours, but for round-off
        heights = np.stack([0.0 * least, least, least, 0.0 * least])
        heights[:, element] = [0.0, 2.0 * own, 2.0 * own, 0.0]
        # near elements by the double exponential rule, which finds the singularity at zero, others by Gauss's
        is_near = middle < _NEAR * half_sum
        total = np.empty_like(least)
        for chosen, rule in ((is_near, _double_exponential()), (~is_near, _gauss())):
            total[chosen] = self._counted(knots[:, chosen], heights[:, chosen], rule)
        return np.asarray(total / (own * self.lengths))

    def _counted(self, knots: FloatArray, heights: FloatArray, rule: tuple[FloatArray, FloatArray]) -> FloatArray:
        """Integrate the logarithm times a function that is linear between knots (4, n), of heights (4, n) there."""
        share, weights = rule
        span = np.diff(knots, axis=0)[:, :, None]
        distance = knots[:-1, :, None] + span * share
        count = heights[:-1, :, None] + np.diff(heights, axis=0)[:, :, None] * share
        size = 2.0 * np.abs(np.sin(np.pi * distance / self.extent)) if self.is_periodic else distance / self.extent
        logarithm = np.log(size, where=size > 0.0, out=np.zeros_like(size))
        return np.asarray(np.einsum("pnq,pnq,q,pno->n", logarithm, count, weights, span))

    @property
    def by_strain(self) -> FloatArray:
        """(n_elements, 2) array [m]: displacements by the strain far away, along the surface from the centre."""
        offset = (self.measured.solved.boundary.points - np.array(self.far.centre)) @ self.along
        return np.asarray(self.far.strain * np.outer(offset, self.along))

    @cached_property
    def motion(self) -> FloatArray:
        """(3,) array: motion far away, given, or fitted to the displacements where loads drive it."""
        return self.far.motion + self._fitted[0]

    @cached_property
    def _fitted(self) -> tuple[FloatArray, FloatArray]:
        """Driven motions (3,), and displacements (n_seen, 2) [m] that neither tractions nor motions explain."""
        rows = np.flatnonzero(self.far.is_load_controlled)
        of_turn = np.array([1.0, 1.0, 1.0 / self.extent])
        motions = self.motions[self.seen]
        left = self.measured.solved.boundary.displacement[self.seen] - self.by_tractions - motions @ self.far.motion
        left -= self.by_strain[self.seen]
        matrix = (motions * of_turn)[:, :, rows].reshape(left.size, rows.size)
        amounts, result = np.linalg.lstsq(matrix, left.ravel(), rcond=None)[0], np.zeros(3)
        result[rows] = amounts * of_turn[rows]
        return result, left - (matrix @ amounts).reshape(left.shape)

    @cached_property
    def strained(self) -> FloatArray:
        """(n_elements, 2) array [m]: displacements without the motion of the whole body."""
        return np.asarray(self.measured.solved.boundary.displacement - self.motions @ self.motion - self.by_strain)

    @cached_property
    def trusted_force(self) -> float:
        """Force [N/m] of tractions that may be round-off."""
        return self.measured.scales.trusted * self.extent

    def elasticity_mismatch(self) -> float:
        """Return the difference [-] of displacements from those by tractions and the motion far away."""
        modulus = self.measured.solved.scene.material.plane_modulus
        moved = float(np.abs(self.measured.solved.boundary.displacement).max())
        by_force = max(float(np.abs(self.force).sum()), self.trusted_force) / modulus
        unit = max(by_force, _IN_MOTION * moved)
        return float(np.abs(self._fitted[1]).max()) / unit if unit > 0.0 else 0.0

    def imbalance(self) -> float:
        """Return the work of tractions and of loads far away on the motions that these drive, over that of all [-]."""
        worst = [0.0]
        for k in np.flatnonzero(self.far.is_load_controlled):
            motions, load = self.motions[:, :, k], float(self.far.load[k])
            # by all forces: along a motion that none of them drives there is only round-off
            size = float(np.hypot(*self.force.T) @ np.hypot(*motions.T)) + abs(load)
            size += self.trusted_force * float(np.abs(motions).max())
            worst.append(abs(float(np.sum(self.force * motions)) + load) / size if size > 0.0 else 0.0)
        return max(worst)

    def energy_mismatch(self) -> float:
        """Return the difference of the elastic energy from half the work of tractions without the motion far away."""
        moved = float(np.abs(self.measured.solved.boundary.displacement).max())
        size = float(np.sum(np.hypot(*self.force.T) * np.hypot(*self.strained.T)))
        size += _IN_MOTION * moved * float(np.abs(self.force).sum()) + moved * self.trusted_force
        work = 0.5 * float(np.sum(self.force * self.strained))
        return abs(self.measured.energy - work) / size if size > 0.0 else 0.0


def _gauss() -> tuple[FloatArray, FloatArray]:
    """Return places between 0 and 1 and weights of Gauss's rule."""
    xi, weights = np.polynomial.legendre.leggauss(_N_GAUSS)
    return 0.5 + 0.5 * xi, 0.5 * weights


def _double_exponential() -> tuple[FloatArray, FloatArray]:
    """Return places between 0 and 1, dense at both, and weights of the double exponential rule."""
    t = np.arange(-_REACH, _REACH + 0.5 * _STEP, _STEP)
    argument = np.pi * np.sinh(t)
    place = 1.0 / (1.0 + np.exp(-argument))
    weight = _STEP * np.pi * np.cosh(t) * place / (1.0 + np.exp(argument))
    return place, weight / weight.sum()
