"""Names for the array types that every signature uses."""

from typing import TypeAlias

import numpy as np
import numpy.typing as npt

FloatArray: TypeAlias = npt.NDArray[np.float64]
ComplexArray: TypeAlias = npt.NDArray[np.complex128]
IntArray: TypeAlias = npt.NDArray[np.intp]
BoolArray: TypeAlias = npt.NDArray[np.bool_]


def read_only(array: npt.NDArray[np.generic]) -> None:
    """Forbid writing to an array that a frozen value holds."""
    array.setflags(write=False)
