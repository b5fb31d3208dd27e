"""Refuses what does not fit into the computer, by the memory that the plan shows."""

from __future__ import annotations

from dataclasses import replace

from bemkit.errors import InputError
from bemkit.operators.linear.memory import physical_memory
from bemkit.plan.plan import Plan, make_plan
from bemkit.scene.scene import Scene

_MANY = 10_000
"""Elements that are divided and planned in a moment, whether they fit or not."""
_FEW = 2_000
"""Elements of the mesh from whose plan larger ones are told."""


class TooLargeError(InputError):
    """A scene that does not fit into memory."""


def check_memory(plan: Plan) -> None:
    """Refuse a plan whose matrices cannot fit into this computer.

    Parameters
    ----------
    plan : Plan

    Raises
    ------
    TooLargeError
        Naming the memory needed, the memory there is, and the number of elements that fits.
    """
    _check(plan.sizes.n_elements, plan.memory)


def check_elements(scene: Scene) -> None:
    """Refuse a number of elements whose matrices cannot fit into this computer, before the mesh is made.

    Parameters
    ----------
    scene : Scene
        Memory grows with the square of the number of elements: the plan for a small mesh tells what a large one takes.

    Raises
    ------
    TooLargeError
        As `check_memory`.
    """
    wished = scene.mesh.elements
    if wished is None or wished <= _MANY:
        return
    small = replace(scene, mesh=replace(scene.mesh, elements=_FEW))
    plan = make_plan(small, small.build_mesh())
    growth = wished / _FEW
    _check(int(growth * plan.sizes.n_elements), int(growth**2 * plan.memory))


def _check(n_elements: int, memory: int) -> None:
    available = physical_memory()
    if memory > available:
        n_fitting = int((available / memory) ** 0.5 * n_elements)
        raise TooLargeError(
            f"{n_elements} elements need about {memory / 1e9:.3g} GB, this computer has {available / 1e9:.3g} GB: "
            f"use at most {n_fitting} elements"
        )
