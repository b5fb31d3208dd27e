"""Choice between the layers in numpy and their compiled version, which the extra ``fast`` provides.

The module `compiled_layer` imports numba, which takes about a second; so it is imported only for many elements. The
first run compiles it in some seconds, and numba keeps the result on disk.
"""

from __future__ import annotations

import importlib.util
from collections.abc import Callable
from functools import cache

import numpy as np

from bemkit.operators.collocation.layers import Constants, Layer, Unknowns, straight_layer
from bemkit.stopwatch import announce

MANY_ELEMENTS = 1000
"""Number of elements from which on the compiled layer saves more time than loading it takes."""
_MISSING = "not installed: the kernels run in numpy; pip install 'bemkit[fast]' compiles them"


def is_installed() -> bool:
    """Whether numba is installed; `layer_for` finds out whether it works."""
    return importlib.util.find_spec("numba") is not None


def expected(n_elements: int) -> tuple[bool, str]:
    """Return whether a run will use the compiled layer, and why; numba is not loaded."""
    if n_elements < MANY_ELEMENTS:
        return False, "loading numba takes longer than these elements in numpy"
    return (True, "numba is installed") if is_installed() else (False, _MISSING)


def layer_for(n_elements: int) -> Layer:
    """Return the faster layer for a number of elements."""
    return loaded() if n_elements >= MANY_ELEMENTS else straight_layer


@cache
def loaded() -> Layer:
    """Return the compiled layer if it works, otherwise that of numpy."""
    return checked(_compiled_layer) if is_installed() else straight_layer


def _compiled_layer() -> Layer:
    from bemkit.operators.collocation.compiled_layer import compiled_layer

    announce("load compiled kernels")
    layer: Layer = compiled_layer
    return layer


def checked(load: Callable[[], Layer]) -> Layer:
    """Return the layer that a function loads if it works, otherwise that of numpy."""
    try:
        layer = load()
        x, ends = np.array([0.5 + 1.0j]), (np.array([0.0j]), np.array([1.0 + 0.0j]))
        constants, zero = Constants(1.0, 1.0, 0.3, 1.0), np.zeros(1, np.intp)
        for is_double in (False, True):
            unknown = Unknowns(zero[None], np.ones((1, 1, 1 + is_double), complex), zero)
            if not np.isfinite(layer(constants, is_double, x, np.array([-1]), ends, unknown)).all():
                return straight_layer
    except Exception:  # a broken installation may raise any exception
        return straight_layer
    return layer
