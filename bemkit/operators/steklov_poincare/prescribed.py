"""Given loads and displacements of a body, as far as they are not zero."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bemkit.arrays import ComplexArray, FloatArray
from bemkit.operators.steklov_poincare.nodal_conditions import NodalConditions

_SAME = 4.0 * np.finfo(float).eps
"""Relative difference of two loads that the product with a load factor may leave."""


@dataclass(frozen=True, eq=False)
class GivenData:
    """Forces on free directions and displacements of fixed ones, in the frames of the nodes.

    Parameters
    ----------
    force : (n_nodes, 2) array [N/m]
        Zero on directions that are not free.
    displacement : (n_nodes, 2) array [m]
        Zero on directions that are not fixed.
    """

    force: FloatArray
    displacement: FloatArray

    @classmethod
    def of(cls, conditions: NodalConditions, force: FloatArray, displacement: FloatArray) -> GivenData:
        """Return the data of nodal forces in x and y, and of displacements in the frames."""
        local = np.einsum("nkc,nc->nk", conditions.frame, force)
        return cls(np.where(conditions.is_free, local, 0.0), np.where(conditions.is_fixed, displacement, 0.0))

    @property
    def n_loaded(self) -> int:
        """Number of directions with a force."""
        return int(np.count_nonzero(self.force))

    @property
    def n_moved(self) -> int:
        """Number of directions with a displacement."""
        return int(np.count_nonzero(self.displacement))

    def factor_of(self, base: GivenData) -> float | None:
        """Return the factor by which these data are a multiple of others, None if they are none."""
        own, other = (np.concatenate([data.force.ravel(), data.displacement.ravel()]) for data in (self, base))
        if not own.any():
            return 0.0
        k = int(np.argmax(np.abs(other)))
        factor = float(own[k] / other[k]) if other[k] else 0.0
        return factor if np.all(np.abs(own - factor * other) <= _SAME * np.abs(own)) else None


def in_plane(frame: FloatArray, components: FloatArray) -> ComplexArray:
    """Return vectors (n, 2) in frames (n, 2, 2) as complex numbers x + i y."""
    result: ComplexArray = np.einsum("nkc,nk->nc", frame, components) @ np.array([1.0, 1j])
    return result
