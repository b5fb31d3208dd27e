"""Numbers of a state of stress: von Mises, components, principal stresses, the largest shear."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np

from bemkit.arrays import FloatArray
from bemkit.errors import InputError
from bemkit.operators.material import Material
from bemkit.operators.somigliana.stress import principal_stresses, von_mises


@dataclass(frozen=True)
class StressMeasure:
    """A number of each stress: its symbol, whether it is never negative, and how it is computed."""

    symbol: str
    is_positive: bool
    of: Callable[[FloatArray, Material], FloatArray]


def _von_mises(stress: FloatArray, material: Material) -> FloatArray:
    return von_mises(stress, material.poisson_ratio, material.plane)


def _shear(stress: FloatArray, material: Material) -> FloatArray:
    principal = principal_stresses(stress)
    return np.asarray(0.5 * (principal[..., 0] - principal[..., 1]))


STRESSES: Mapping[str, StressMeasure] = MappingProxyType(
    {
        "von-mises": StressMeasure("von Mises stress", True, _von_mises),
        "stress-xx": StressMeasure(r"stress $\sigma_{xx}$", False, lambda stress, material: stress[..., 0, 0]),
        "stress-yy": StressMeasure(r"stress $\sigma_{yy}$", False, lambda stress, material: stress[..., 1, 1]),
        "stress-xy": StressMeasure(r"stress $\sigma_{xy}$", False, lambda stress, material: stress[..., 0, 1]),
        "principal-stress": StressMeasure(
            "larger principal stress", False, lambda stress, material: principal_stresses(stress)[..., 0]
        ),
        "shear-stress": StressMeasure("largest shear stress in the plane", True, _shear),
    }
)
"""By the names of their pictures."""


def find_measure(name: str) -> StressMeasure:
    """Return a measure by its name; InputError if it is unknown."""
    if name not in STRESSES:
        raise InputError(f"measure is {name!r}: give one of {', '.join(STRESSES)}")
    return STRESSES[name]
