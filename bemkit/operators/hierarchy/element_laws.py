"""From two linear conditions on each element to what its tractions and displacements follow from."""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import numpy as np

from bemkit.arrays import BoolArray, FloatArray, IntArray

_PREFERRED = 0.1
"""A condition is solved for a quantity of its own direction as long as the best choice is not ten times better."""
_KNOWN = np.array(list(itertools.combinations(range(4), 2)))
"""(6, 2): the pairs of (t_1, t_2, u_1, u_2) for which two conditions can be solved."""
_UNKNOWN = np.array([sorted(set(range(4)) - set(pair), key=lambda k: k % 2) for pair in _KNOWN.tolist()])
"""(6, 2): the others, those along the first direction before those along the second one."""


@dataclass(frozen=True, eq=False)
class ElementLaws:
    """Local conditions of each element: (t_x, t_y, u_x, u_y) = factors @ z + given.

    Parameters
    ----------
    factors : (n_elements, 4, 2) array
    given : (n_elements, 4) array
    """

    factors: FloatArray
    given: FloatArray

    def take(self, rows: IntArray) -> ElementLaws:
        """Return those of some elements."""
        return ElementLaws(self.factors[rows], self.given[rows])


def solve_for_two(
    on_traction: FloatArray, on_displacement: FloatArray, value: FloatArray, displacement_unit: float
) -> tuple[ElementLaws, BoolArray]:
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
    laws : ElementLaws
        What the conditions were solved for follows exactly, the others are z.
    is_determined : (n,) bool array
        Whether the conditions are two; the laws of other nodes are zero.
    """
    conditions = np.concatenate([on_traction, on_displacement], axis=2)
    scaled = conditions * np.array([1.0, 1.0, displacement_unit, displacement_unit])
    sizes = np.abs(scaled).max(axis=2, keepdims=True)
    scaled = scaled / np.where(sizes > 0.0, sizes, 1.0)
    determinants = np.stack(
        [np.abs(scaled[:, 0, i] * scaled[:, 1, j] - scaled[:, 0, j] * scaled[:, 1, i]) for i, j in _KNOWN], axis=1
    )
    best = determinants.max(axis=1)
    own = np.where(_KNOWN[:, 0] % 2 != _KNOWN[:, 1] % 2, determinants, 0.0)
    choice = np.where(own.max(axis=1) >= _PREFERRED * best, own.argmax(axis=1), determinants.argmax(axis=1))
    nodes = np.flatnonzero(best > 0.0)
    of_known, of_unknown = (
        np.take_along_axis(conditions[nodes], pairs[choice[nodes], None, :], axis=2) for pairs in (_KNOWN, _UNKNOWN)
    )
    inverse, rows = _inverse(of_known), nodes[:, None]
    known, unknown = _KNOWN[choice[nodes]], _UNKNOWN[choice[nodes]]
    factors, given = np.zeros((len(value), 4, 2)), np.zeros((len(value), 4))
    factors[rows, known], factors[rows, unknown, [0, 1]] = -inverse @ of_unknown, 1.0
    given[rows, known] = (inverse @ value[nodes, :, None])[:, :, 0]
    return ElementLaws(factors, given), best > 0.0


def _inverse(matrices: FloatArray) -> FloatArray:
    """Return the inverses of (n, 2, 2) matrices, exact where they are diagonal."""
    (a, b), (c, d) = matrices.transpose(1, 2, 0)
    determinant = a * d - b * c
    adjoint: FloatArray = np.stack([np.stack([d, -b], axis=-1), np.stack([-c, a], axis=-1)], axis=-2)
    return np.asarray(adjoint / determinant[:, None, None])
