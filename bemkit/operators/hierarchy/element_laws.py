"""From two linear conditions on each element to what its tractions and displacements follow from."""

from __future__ import annotations

import itertools

import numpy as np

from bemkit.arrays import BoolArray, FloatArray

_PREFERRED = 0.1
"""A condition is solved for a quantity of its own direction as long as the best choice is not ten times better."""


def solve_conditions(
    on_traction: FloatArray, on_displacement: FloatArray, value: FloatArray, displacement_unit: float
) -> tuple[FloatArray, FloatArray, BoolArray]:
    """Solve two conditions a node for two of its four quantities; the other two remain unknown.

    Parameters
    ----------
    on_traction, on_displacement : (n, 2, 2) arrays
        Axes node, condition, component.
    value : (n, 2) array
    displacement_unit : float [m/Pa]
        Typical displacement per traction, by which the choice compares the two.

    Returns
    -------
    factors : (n, 4, 2) array
    given : (n, 4) array
        (t_1, t_2, u_1, u_2) = factors @ z + given. What is solved for follows exactly; the others are the unknowns z.
    is_determined : (n,) bool array
        Whether the conditions are two.
    """
    conditions = np.concatenate([on_traction, on_displacement], axis=2)
    scaled = conditions * np.array([1.0, 1.0, displacement_unit, displacement_unit])
    sizes = np.abs(scaled).max(axis=2, keepdims=True)
    scaled = scaled / np.where(sizes > 0.0, sizes, 1.0)
    pairs = list(itertools.combinations(range(4), 2))
    determinants = np.stack(
        [np.abs(scaled[:, 0, i] * scaled[:, 1, j] - scaled[:, 0, j] * scaled[:, 1, i]) for i, j in pairs], axis=1
    )
    is_own = np.array([i % 2 != j % 2 for i, j in pairs])
    best = determinants.max(axis=1)
    own = np.where(is_own, determinants, 0.0)
    choice = np.where(own.max(axis=1) >= _PREFERRED * best, own.argmax(axis=1), determinants.argmax(axis=1))
    n = len(value)
    factors, given = np.zeros((n, 4, 2)), np.zeros((n, 4))
    for number, pair in enumerate(pairs):
        nodes = np.flatnonzero((choice == number) & (best > 0.0))
        others = [k for k in range(4) if k not in pair]
        inverse = _inverse(conditions[nodes][:, :, pair])
        factors[nodes[:, None], pair] = -inverse @ conditions[nodes][:, :, others]
        factors[nodes[:, None], others, [0, 1]] = 1.0
        given[nodes[:, None], pair] = (inverse @ value[nodes, :, None])[:, :, 0]
    return factors, given, best > 0.0


def _inverse(matrices: FloatArray) -> FloatArray:
    """Return the inverses of (n, 2, 2) matrices, exact where they are diagonal."""
    (a, b), (c, d) = matrices.transpose(1, 2, 0)
    determinant = a * d - b * c
    adjoint: FloatArray = np.stack([np.stack([d, -b], axis=-1), np.stack([-c, a], axis=-1)], axis=-2)
    return np.asarray(adjoint / determinant[:, None, None])
