"""How fast this computer is: three numbers, measured in a few milliseconds when a prediction is asked for."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache

import numpy as np

from bemkit.operators import kernels
from bemkit.operators.linear.threads import blas_threads_for

_ORDER = 320
_EVALUATIONS = 4096
_CALLS = 200
_REPETITIONS = 3


@dataclass(frozen=True)
class Machine:
    """What the basic steps of a run cost on a computer.

    Parameters
    ----------
    seconds_per_evaluation : float [s]
        Of the closed forms at one point for one element.
    seconds_per_flop : float [s]
        Of one multiplication or addition within a LAPACK factorisation.
    seconds_per_call : float [s]
        Of one operation on a small array.
    """

    seconds_per_evaluation: float
    seconds_per_flop: float
    seconds_per_call: float


@cache
def this_machine() -> Machine:
    """Measure this computer, once for each process; takes about 20 ms.

    Returns
    -------
    Machine
        From the best of three repetitions each: what disturbs a measurement only makes it slower.
    """
    from scipy.linalg.lapack import dgetrf

    matrix = np.asfortranarray(np.vander(np.linspace(0.1, 1.0, _ORDER), _ORDER) + np.eye(_ORDER))
    points = np.linspace(20.0 + 0j, 25.0 + 5j, _EVALUATIONS).astype(np.complex128)
    small = np.linspace(0.0, 1.0, 50)

    def evaluate() -> None:
        kernels.far_integrals(points, 1, kernels.terms_needed(16.0))
        kernels.far_log_product(points)

    def call() -> None:
        for _ in range(_CALLS):
            small + small

    with blas_threads_for(_ORDER):
        factor_time = _best(lambda: dgetrf(matrix))
    return Machine(_best(evaluate) / _EVALUATIONS, factor_time / (2.0 / 3.0 * _ORDER**3), _best(call) / _CALLS)


def _best(work: Callable[[], object]) -> float:
    times = []
    for _ in range(_REPETITIONS):
        begin = time.perf_counter()
        work()
        times.append(time.perf_counter() - begin)
    return min(times)
