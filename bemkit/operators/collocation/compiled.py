"""The choice between the layers in numpy and their compiled version, if the extra ``fast`` is installed and works.

The module `compiled_layer`, which imports numba, is imported only where it is worth that: compiling takes some seconds,
once for an installation, because numba keeps the result on disk; loading it takes about a second.
"""

from __future__ import annotations

import importlib.util
from collections.abc import Callable
from functools import cache

import numpy as np

from bemkit.errors import printable
from bemkit.operators.collocation.layers import Constants, Layer, Unknowns, straight_layer
from bemkit.stopwatch import announce

MANY_ELEMENTS = 1000
"""Elements of a body from which on the compiled layer saves more than loading it costs."""
_MISSING = "not installed: the kernels run in numpy; pip install 'bemkit[fast]' compiles them"


def is_installed() -> bool:
    """Whether numba is installed; that it works shows when `layer_for` loads it."""
    return importlib.util.find_spec("numba") is not None


def expected(n_elements: int) -> tuple[bool, str]:
    """Say, without loading numba or compiling anything, whether a run will use the compiled layer, and why."""
    if n_elements < MANY_ELEMENTS:
        return False, "loading numba takes longer than these elements in numpy"
    return (True, "numba is installed") if is_installed() else (False, _MISSING)


def layer_for(n_elements: int) -> Layer:
    """Return the faster of the two for a body of some elements."""
    return loaded()[0] if n_elements >= MANY_ELEMENTS else straight_layer


@cache
def loaded() -> tuple[Layer, str]:
    """Return the compiled layer or, if there is none, that of numpy, and say in one line why."""
    return checked(_compiled_layer) if is_installed() else (straight_layer, _MISSING)


def _compiled_layer() -> Layer:
    from bemkit.operators.collocation.compiled_layer import compiled_layer

    announce("load compiled kernels")
    layer: Layer = compiled_layer
    return layer


def checked(load: Callable[[], Layer]) -> tuple[Layer, str]:
    """Return the layer that a function loads, or that of numpy if it does not work, and say in one line why."""
    try:
        layer = load()
        x, start, end = np.array([0.5 + 1.0j]), np.array([0.0j]), np.array([1.0 + 0.0j])
        constants, one = Constants(1.0, 1.0, 0.3, 1.0), np.zeros(1, np.intp)
        for is_double in (False, True):
            unknown = Unknowns(one[None], np.ones((1, 1, 1 + is_double), complex), one)
            values = layer(constants, is_double, x, np.array([-1]), (start, end), unknown)
            if not np.isfinite(values).all():
                return straight_layer, "numba computes wrong numbers here: the kernels run in numpy"
    except Exception as error:  # a broken installation raises anything
        short = printable(f"{type(error).__name__}: {error}")[:120]
        return straight_layer, f"numba does not work here ({short}): the kernels run in numpy"
    return layer, "numba is installed"
