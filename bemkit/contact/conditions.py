"""Linear conditions of contact nodes in each status.

Components are (n, t): index 0 along the outward normal, index 1 along the tangent. The first condition of a node is the
normal one, the second the tangential one.
"""

from __future__ import annotations

import numpy as np

from bemkit.arrays import BoolArray, FloatArray
from bemkit.operators.boundary_equations import LinearConditions


def separated(n_contact: int) -> LinearConditions:
    """Return the conditions of open nodes: ``t = 0``."""
    return LinearConditions(np.zeros((n_contact, 2, 2)), _unit_blocks(n_contact), np.zeros((n_contact, 2)))


def stick(gap: FloatArray, reference_slip: FloatArray) -> LinearConditions:
    """Return the conditions of sticking nodes: ``u_n = g``, ``u_t = reference_slip``.

    Parameters
    ----------
    gap : (n_contact,) array [m]
    reference_slip : (n_contact,) array [m]
        Tangential displacement without slip (zero for the static law).
    """
    n_contact = len(gap)
    value = np.stack([gap, reference_slip], axis=1)
    return LinearConditions(_unit_blocks(n_contact), np.zeros((n_contact, 2, 2)), value)


def slip(
    gap: FloatArray, direction: FloatArray, bound_slope: FloatArray, bound_intercept: FloatArray
) -> LinearConditions:
    """Return the conditions of slipping nodes: ``u_n = g``, ``t_t = -direction * bound(t_n)``.

    Parameters
    ----------
    gap : (n_contact,) array [m]
    direction : (n_contact,) array
        +1 for slip along the tangent (``u_t > 0``), -1 against it.
    bound_slope : (n_contact,) array [-]
        Derivative of the friction bound, ``-s`` for Coulomb's law.
    bound_intercept : (n_contact,) array [Pa]
        The linearised bound is ``bound_slope * t_n + bound_intercept``.

    Notes
    -----
    Algorithm 2 of the paper prints the slip traction with the opposite sign; the sign here follows from equation (16).
    """
    n_contact = len(gap)
    on_displacement = np.zeros((n_contact, 2, 2))
    on_displacement[:, 0, 0] = 1.0
    on_traction = np.zeros((n_contact, 2, 2))
    on_traction[:, 1, 0] = direction * bound_slope
    on_traction[:, 1, 1] = 1.0
    return LinearConditions(on_displacement, on_traction, np.stack([gap, -direction * bound_intercept], axis=1))


def of_statuses(
    is_closed: BoolArray, slips: BoolArray, sticking: LinearConditions, sliding: LinearConditions
) -> LinearConditions:
    """Return the conditions of nodes in different statuses.

    Parameters
    ----------
    is_closed, slips : (n_contact,) bool arrays
        Closed nodes have the normal condition of `sticking`, open nodes ``t_n = 0``. Slipping nodes have the tangential
        condition of `sliding`, the others that of `sticking`.
    sticking, sliding : LinearConditions
    """
    conditions = separated(len(is_closed)).replaced(np.stack([is_closed, ~slips], axis=1), sticking)
    return conditions.replaced(np.stack([np.zeros_like(slips), slips], axis=1), sliding)


def augmented(
    gap: FloatArray, reference_slip: FloatArray, multiplier: FloatArray, rho_n: float, rho_t: float
) -> LinearConditions:
    """Return the augmented conditions of closed, sticking nodes: ``t + rho (u - u_0) = multiplier``.

    Parameters
    ----------
    gap : (n_contact,) array [m]
        Normal part of u_0.
    reference_slip : (n_contact,) array [m]
        Tangential part of u_0.
    multiplier : (n_contact, 2) array [Pa]
        sigma^(k) of Algorithm 1, constant in an inner loop.
    rho_n, rho_t : float [Pa/m]
    """
    n_contact = len(gap)
    rho = np.array([rho_n, rho_t])
    on_displacement = np.zeros((n_contact, 2, 2))
    on_displacement[:, [0, 1], [0, 1]] = rho
    value = multiplier + rho * np.stack([gap, reference_slip], axis=1)
    return LinearConditions(on_displacement, _unit_blocks(n_contact), value)


def _unit_blocks(n_contact: int) -> FloatArray:
    return np.full((n_contact, 2, 2), np.eye(2))
