"""Slip, energy lost in load cycles, and limits of friction, in closed form."""

from __future__ import annotations

import numpy as np
from scipy.optimize import brentq

from bemkit.errors import InputError
from bemkit.reference.hertz import check_positive
from bemkit.reference.partial_slip import PartialSlip


def closed_cracks_slip(length_share: float) -> float:
    """Return the mean slip of both faces of a row of closed cracks under shear, over ``tau W / E'`` [-].

    Parameters
    ----------
    length_share : float [-]
        Half-length a of the cracks over the period W, less than 1/2.

    Notes
    -----
    The cracks lie in one line of an infinite body. tau is the shear stress far away less what friction bears on the
    faces. The slip is (4 tau / (pi E')) W arccosh(cos(pi x / W) / cos(pi a / W)), its mean over the period
    (4 / pi) ln sec(pi a / W).

    References
    ----------
    [Westergaard1939]
    """
    if not 0.0 < length_share < 0.5:
        raise InputError(f"length_share is {length_share}: give a number between 0 and 0.5")
    return -4.0 / np.pi * float(np.log(np.cos(np.pi * length_share)))


def mindlin_loss(sheared: PartialSlip, modulus: float) -> float:
    """Return the energy [J/m] that a cylinder under constant pressing force loses in a cycle of shear.

    Parameters
    ----------
    sheared : PartialSlip
        Of a cylinder, at the largest shear force of the cycle.
    modulus : float [Pa]
        E*; see `pair_modulus`.

    Notes
    -----
    A cylinder approaches by C P - P ln(P) / (pi E*), so that under growing shear it moves by s times the difference of
    the approaches at P and at P - Q / s. On each way back all forces and displacements are doubled, and C drops out.

    References
    ----------
    [Mindlin1949]; [Jaeger1998] for the difference of approaches.
    """
    check_positive(modulus=modulus)
    s, shear = sheared.friction, sheared.tangential_load
    loads = np.array([sheared.contact.load, sheared.sticking.load])
    whole, stuck = loads * np.log(loads)
    integrals = loads**2 * (0.5 * np.log(loads) - 0.25)
    return s / (np.pi * modulus) * float(4.0 * shear * (whole + stuck) - 8.0 * s * (integrals[0] - integrals[1]))


def cantilevers_loss(friction: float, pressure: float, load: float, slenderness: float, modulus: float) -> float:
    """Return the energy [J/m] that two beams, pressed together and bent to and fro at the tip, lose in a cycle.

    Parameters
    ----------
    friction : float [-]
    pressure : float [Pa]
        By which the beams are pressed together, uniform.
    load : float [N/m]
        Largest force at the tips of both beams, F0.
    slenderness : float [-]
        Length over height of one beam, L / h.
    modulus : float [Pa]
        Young's modulus.

    Notes
    -----
    8 s p L^3 (F0 - F_s) / (E h^2) with h = 1. The beams slip where 3 F / (4 h) exceeds s p, everywhere at once, at
    F_s = 4 s p h / 3, and then bend separately. [SpringfieldJoshi1989] treat beams on supports.
    """
    least = 4.0 * friction * pressure / 3.0
    if load <= least:
        raise InputError(f"load is {load}: the beams slip from {least:g} on: give more")
    return 8.0 * friction * pressure * slenderness**3 * (load - least) / modulus


def arch_friction_limit(n_blocks: int) -> float:
    """Return the friction coefficient below which a thick semicircular arch slides apart under its own weight.

    Parameters
    ----------
    n_blocks : int
        Equal blocks, an odd number.

    Notes
    -----
    The least thrust that the joints above the springings need is as large as the springings can bear, s pi / 2 for a
    weight of 1 per radian; the resultant at the angle t from the crown is (s pi / 2, t).
    """
    if n_blocks < 3 or n_blocks % 2 == 0:
        raise InputError(f"n_blocks is {n_blocks}: give an odd number from 3 on")
    angles = (np.arange((n_blocks + 1) // 2) + 0.5) * np.pi / n_blocks

    def excess(friction: float) -> float:
        """Return by how much the steepest resultant leaves the friction cone [rad]."""
        inclination = np.arctan2(angles, 0.5 * np.pi * friction) - angles
        return float(inclination.max() - np.arctan(friction))

    return float(brentq(excess, 1e-3, 1.0, xtol=1e-14))
