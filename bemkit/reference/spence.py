"""The stick zone below a rigid indenter on a half-plane with Coulomb friction: Spence's problem.

The zone -a < x < a sticks within -c < x < c and slips outside of it. Under a load that only grows, slip counted from
increment to increment, c / a is the same for flat, parabolic and all indenters of a power of x ([Spence1975]): after
every increment the change of the tractions is that of a flat punch. Where one step judges friction by the whole
displacement, a flat punch sticks in the same zone, because its displacements keep their shape as the load grows, and
a parabola in a much smaller one.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np

from bemkit.arrays import FloatArray
from bemkit.errors import InputError
from bemkit.geometry.quadrature import gauss_legendre
from bemkit.operators.material import Material
from bemkit.reference.hertz import check_positive
from bemkit.reference.punches import coupling

_N_LEVELS, _N_POINTS = 26, 7
"""Number of intervals, each half as long as the one before, towards the ends of zones, and Gauss points on each."""


def spence_stick_ratio(friction: float, material: Material) -> float:
    """Return the share c / a that sticks under an indenter of a power of x, a flat face included, and a growing load.

    Parameters
    ----------
    friction : float [-]
        Positive. Sticking comes close to the edges exponentially as it grows.
    material : Material
        Of the half-plane; not incompressible, where nothing slips.

    Returns
    -------
    float
        Of a flat face also under the static law.

    Raises
    ------
    InputError
        If the friction is not positive, or if less than 0.001 of the zone sticks, or more than 0.9999.

    References
    ----------
    [Spence1973], [Spence1975].
    """
    return _ratio(friction, material, is_parabola=False)


def static_cylinder_stick_ratio(friction: float, material: Material) -> float:
    """Return the share c / a that sticks under a rigid cylinder, pressed in one step by the static law.

    That law judges friction by the whole displacement. See `spence_stick_ratio` for the parameters and errors.
    """
    return _ratio(friction, material, is_parabola=True)


@cache
def _ratio(friction: float, material: Material, *, is_parabola: bool) -> float:
    from scipy.optimize import brentq

    check_positive(friction=friction)
    low, high = 1e-3, 1.0 - 1e-4

    def singularity(ratio: float) -> float:
        return _Zones(ratio, friction, coupling(material)).singularity(is_parabola=is_parabola)

    if singularity(low) * singularity(high) > 0.0:
        raise InputError(
            f"friction is {friction} and Poisson's ratio {material.poisson_ratio}: less than {low:g} of the zone "
            f"sticks, or more than {high:g}: give values between"
        )
    return float(brentq(singularity, low, high, xtol=1e-10))


@dataclass(frozen=True)
class _Zones:
    """The equations of a zone a = 1 that sticks within `ratio`, for p and q outwards, times E' / 2.

    With x = sin(t), P = p cos(t) and Q = q cos(t), of which P is even and Q odd in x:
    ``-1/pi int log|x^2 - s^2| P - beta int_t^(pi/2) Q`` is the depth of the face, on the whole zone, and
    ``-1/pi int log|(x - s) / (x + s)| Q - beta int_0^t P = 0`` where it sticks ([Johnson1985] equations (2.25)).
    Where it slips Q = s P.
    """

    ratio: float
    friction: float
    coupling: float

    def singularity(self, *, is_parabola: bool) -> float:
        """Return the factor of 1 / sqrt(distance) in q - s p where sticking ends; it vanishes at the right ratio."""
        end = float(np.arcsin(self.ratio))
        rise, slip = _graded(_N_LEVELS), 0.5 * (0.5 * np.pi - end)
        # at the edge P is only mildly singular
        edge = _graded(_N_LEVELS // 2)
        cuts = np.concatenate([end * (1.0 - rise[::-1]), end + slip * rise[1:], 0.5 * np.pi - slip * edge[-2::-1]])
        t, system, last_stick = self._system(cuts)
        depth = np.zeros((len(system), 2))
        depth[: t.size, 0], depth[: t.size, 1] = 1.0, np.sin(t) ** 2
        found = np.linalg.solve(system, depth)
        state = found[:, 0]
        if is_parabola:  # the depth falls with x^2 so that the pressure vanishes at the edge
            state = found[:, 0] - found[:, 1] * found[t.size - 1, 0] / found[t.size - 1, 1]
        excess = state[t.size + last_stick] - self.friction * state[last_stick]
        return float(excess * np.sqrt(end - t[last_stick]) / state[0])

    def _system(self, cuts: FloatArray) -> tuple[FloatArray, FloatArray, int]:
        """Return the points t, the equations for P at all and Q at sticking points, and the index of the last of these.

        P and Q are the normal and the tangential traction in the variable t of the contact, as in the docstring of the
        class; Q = s P where the surface slips, so that only sticking points have an unknown Q.
        """
        xi, weights = gauss_legendre(_N_POINTS)
        half = 0.5 * np.diff(cuts)[:, None]
        t, weight = (cuts[:-1, None] + half * (1.0 + xi)).ravel(), (half * weights).ravel()
        n, n_stick = t.size, _N_LEVELS * _N_POINTS
        # log|t - t'|, log|pi - t - t'| and log|t + t'| exactly, with constant densities on each panel
        direct, edge, middle = (_log_integrals(cuts, places) for places in (t, np.pi - t, -t))
        apart, total = t[:, None] - t, t[:, None] + t
        # the remaining smooth factors of the kernels of P and of Q by the Gauss rule
        ratio = np.sinc(apart / np.pi)
        smooth = np.log(ratio * np.sin(total) / (total * (np.pi - total)))
        of_p = -(direct + edge + middle + smooth * weight) / np.pi
        smooth = np.log(np.sinc(0.5 * apart / np.pi) / np.cos(0.5 * apart) * total / np.tan(0.5 * total))
        smooth += -np.log(2.0 * (np.pi - total))
        of_q = -(direct + edge - middle + smooth * weight) / np.pi
        # integrals of the density from the start to each point, and from there to the end
        before = _running_integrals(half.ravel())
        after = weight - before
        stick = np.arange(n) < n_stick
        # first rows: normal displacement at all points; last rows: tangential displacement at sticking ones
        upper = of_p - self.coupling * self.friction * np.where(stick, 0.0, after)
        lower = np.where(stick, 0.0, self.friction * of_q) - self.coupling * before
        rows = [
            np.hstack([upper, -self.coupling * after[:, stick]]),
            np.hstack([lower[stick], of_q[stick][:, stick]]),
        ]
        return t, np.vstack(rows), n_stick - 1


def _graded(n_levels: int) -> FloatArray:
    """Return the ends of intervals on (0, 1) that are each half as long as the next one."""
    return np.concatenate([[0.0], 0.5 ** np.arange(n_levels - 1, -1, -1.0)])


def _running_integrals(half_lengths: FloatArray) -> FloatArray:
    """Return the matrix from values at Gauss points to integrals from the start to each of these points."""
    xi, weights = gauss_legendre(_N_POINTS)
    n_panels = half_lengths.size
    powers = np.vander(xi, increasing=True)
    order = np.arange(1.0, _N_POINTS + 1.0)
    integrals = (xi[:, None] ** order - (-1.0) ** order) / order @ np.linalg.inv(powers)
    whole = np.tril(np.ones((n_panels, n_panels)), -1)
    of_panels = np.kron(whole * half_lengths, np.tile(weights, (_N_POINTS, 1)))
    return np.asarray(of_panels + np.kron(np.diag(half_lengths), integrals))


def _log_integrals(cuts: FloatArray, places: FloatArray) -> FloatArray:
    """Return the matrix from values at Gauss points of intervals to their integrals with log|place - t|.

    Notes
    -----
    int log|z - t| P_k(t) dt = 2 (Q_(k+1)(z) - Q_(k-1)(z)) / (2 k + 1) beside an interval, Gauss points away from it.
    """
    legendre = np.polynomial.legendre
    xi, weights = gauss_legendre(_N_POINTS)
    fine, fine_weights = gauss_legendre(40)
    order = np.arange(_N_POINTS)
    to_modes = (legendre.legvander(xi, _N_POINTS - 1) * weights[:, None] * (order + 0.5)).T
    half, middle = 0.5 * np.diff(cuts), 0.5 * (cuts[:-1] + cuts[1:])
    z = (places[:, None] - middle) / half
    modes = np.log(np.abs(z[..., None] - fine)) @ (fine_weights[:, None] * legendre.legvander(fine, _N_POINTS - 1))
    near = np.abs(z) < 1.15
    modes[near] = _near_modes(z[near])
    modes[..., 0] += 2.0 * np.log(half)
    return np.asarray((half[:, None] * (modes @ to_modes)).reshape(places.size, -1))


def _near_modes(z: FloatArray) -> FloatArray:
    """Return int log|z - t| P_k(t) dt over (-1, 1) for all k, by Legendre functions of the second kind."""
    q = [0.5 * np.log(np.abs((1.0 + z) / (1.0 - z)))]
    q.append(z * q[0] - 1.0)
    for k in range(1, _N_POINTS):
        q.append(((2 * k + 1) * z * q[k] - k * q[k - 1]) / (k + 1))
    constant = (1.0 + z) * np.log(np.abs(1.0 + z)) + (1.0 - z) * np.log(np.abs(1.0 - z)) - 2.0
    others = [2.0 * (q[k + 1] - q[k - 1]) / (2 * k + 1) for k in range(1, _N_POINTS)]
    return np.stack([constant, *others], axis=-1)
