"""The load factor at which the equivalent stress first reaches the yield stress."""

from __future__ import annotations

import math
from dataclasses import dataclass

from bemkit.errors import InputError
from bemkit.results.solution import Solution
from bemkit.results.stress_mesh import largest_equivalent_stress
from bemkit.runs.run import run
from bemkit.scene.load_history import with_scaled_loads
from bemkit.scene.scene import Scene

_MOST_SOLVES = 20


@dataclass(frozen=True)
class FirstYield:
    """The load and the place at which a body first yields.

    Parameters
    ----------
    load_factor : float [-]
        Multiple of all loads of the scene.
    x, y : float [m]
        Where the equivalent stress of von Mises is largest.
    solution : Solution
        Under this load.
    """

    load_factor: float
    x: float
    y: float
    solution: Solution


def first_yield(scene: Scene, yield_stress: float, *, rtol: float = 1e-6) -> FirstYield:
    """Return the load factor at which von Mises' stress reaches a given stress, on the boundary or inside.

    Parameters
    ----------
    scene : Scene
        With a single load, which the factor multiplies; prescribed displacements and gaps stay as they are.
    yield_stress : float [Pa]
        Positive.
    rtol : float
        Of the stress.

    Raises
    ------
    InputError
        If the scene has several load steps, the yield stress is not positive, a body is a half-plane, or the stress
        does not follow the load.

    Notes
    -----
    Secant steps in the logarithms of load and stress: without contact two solves suffice, under Hertzian contact, where
    the stress grows like a power of the load, about four. At a singular corner the stress has no bound, and the factor
    depends on the mesh.
    """
    if not yield_stress > 0.0:
        raise InputError(f"yield_stress is {yield_stress}: give a positive stress")
    if scene.steps or scene.load_factors != (1.0,):
        raise InputError("the scene has several load steps: give first_yield a scene with a single load")
    logarithm, slope = 0.0, 1.0
    previous: tuple[float, float] | None = None
    for _ in range(_MOST_SOLVES):
        factor = math.exp(logarithm)
        solution = run(scene if factor == 1.0 else with_scaled_loads(scene, factor))
        largest = max(map(largest_equivalent_stress, solution.bodies.values()), key=lambda each: each.value)
        if largest.value <= 0.0:
            raise InputError("the scene has no stress under its load: give it a load")
        error = math.log(largest.value / yield_stress)
        if abs(error) <= rtol:
            return FirstYield(factor, largest.x, largest.y, solution)
        if previous is not None and previous[0] != logarithm:
            slope = (error - previous[1]) / (logarithm - previous[0])
        if not slope > 0.0:
            break
        previous = logarithm, error
        logarithm -= error / slope
    raise InputError(
        f"the largest stress does not follow the load: {largest.value:.6g} at the load factor {factor:.6g}; "
        "the yield stress may not be reachable under this load"
    )
