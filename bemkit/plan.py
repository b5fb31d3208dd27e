"""What a scene needs to be solved and what can be left out, with the reasons.

The plan is made from the scene and its mesh alone, before anything expensive happens.
"""

from __future__ import annotations

import os
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from bemkit.arrays import FloatArray
from bemkit.geometry.mesh import BoundaryMesh
from bemkit.geometry.space import break_nodes
from bemkit.scene import (
    Clamped,
    ConstantCollocation,
    Contact,
    LinearGalerkin,
    PrescribedDisplacement,
    QuadraticGalerkin,
    Roller,
    Scene,
)

_BYTES_PER_NUMBER = 8
# a direction counts as held when it moves the held nodes by more than round-off of the node positions
_RANK_TOLERANCE = 1e-9

# square matrices of all displacements and tractions that are alive at the same time
_N_MATRICES = 7


class TooLargeError(ValueError):
    """A scene that does not fit into memory."""


@dataclass(frozen=True)
class PlanItem:
    """One thing that is needed or left out.

    Parameters
    ----------
    name : str
    is_needed : bool
    reason : str
    size : int [bytes]
        Memory it takes; zero when that is nothing worth mentioning.
    """

    name: str
    is_needed: bool
    reason: str
    size: int = 0


@dataclass(frozen=True)
class Plan:
    """The items in the order in which they are used.

    Parameters
    ----------
    items : tuple of PlanItem
    """

    items: tuple[PlanItem, ...]

    @property
    def memory(self) -> int:
        """Estimated memory of everything that is needed [bytes]."""
        return sum(item.size for item in self.items if item.is_needed)

    def as_dict(self) -> dict[str, Any]:
        """Return the plan as JSON can hold it."""
        return {
            "memory": self.memory,
            "items": [
                {"name": item.name, "needed": item.is_needed, "reason": item.reason, "size": item.size}
                for item in self.items
            ],
        }


def make_plan(scene: Scene, mesh: BoundaryMesh) -> Plan:
    """Say what the scene needs on this mesh and what it leaves out.

    Parameters
    ----------
    scene : Scene
    mesh : BoundaryMesh
        As made by `Scene.build_mesh`.

    Returns
    -------
    Plan
    """
    return Plan((*_discretisation_items(scene, mesh), *_contact_items(scene, mesh), *_output_items()))


def check_memory(scene: Scene) -> None:
    """Refuse a scene whose matrices cannot fit into this computer, before its mesh is built.

    Parameters
    ----------
    scene : Scene

    Raises
    ------
    TooLargeError
        Naming the memory needed, the memory there is, and the number of elements that fits.
    """
    available = _physical_memory()
    per_element = 4 if isinstance(scene.discretisation, QuadraticGalerkin) else 2
    needed = _N_MATRICES * _BYTES_PER_NUMBER * (per_element * scene.mesh.n_elements) ** 2
    if needed > available:
        n_fitting = int((available / (_N_MATRICES * _BYTES_PER_NUMBER)) ** 0.5 / per_element)
        raise TooLargeError(
            f"mesh.elements is {scene.mesh.n_elements}: needs about {needed / 1e9:.3g} GB, this computer has "
            f"{available / 1e9:.3g} GB: use at most {n_fitting} elements"
        )


def _physical_memory() -> float:
    try:
        return float(os.sysconf("SC_PAGE_SIZE")) * os.sysconf("SC_PHYS_PAGES")
    except (AttributeError, ValueError, OSError):  # systems that do not tell
        return float("inf")


def free_rigid_motions(scene: Scene, mesh: BoundaryMesh) -> int:
    """Count the rigid motions that no fixed part holds, so that only contact can.

    Parameters
    ----------
    scene : Scene
    mesh : BoundaryMesh

    Returns
    -------
    int
        0 to 3.
    """
    rows = [np.zeros((1, 3))]
    for part in scene.parts:
        elements = mesh.part(part.name)
        places = np.array([-0.5, 0.5])  # two on each element: a single straight element already resists turning
        points = mesh.points(elements, places).reshape(-1, 2)
        normals = mesh.normals_at(elements, places).reshape(-1, 2)
        for direction in _held_directions(part.condition, normals):
            rows.append(_moved(mesh, points, direction))
    return 3 - int(np.linalg.matrix_rank(np.concatenate(rows), tol=_RANK_TOLERANCE))


def _held_directions(condition: object, normals: FloatArray) -> list[FloatArray]:
    along_x, along_y = np.broadcast_to([1.0, 0.0], normals.shape), np.broadcast_to([0.0, 1.0], normals.shape)
    match condition:
        case Clamped():
            return [along_x, along_y]
        case Roller():
            return [normals]
        case PrescribedDisplacement(is_prescribed=(holds_x, holds_y)):
            return [*[along_x] * holds_x, *[along_y] * holds_y]
    return []


def _moved(mesh: BoundaryMesh, points: FloatArray, directions: FloatArray) -> FloatArray:
    """Return what the two translations and the rotation do along the directions, (n, 3), lengths by the diameter."""
    x, y = ((points - mesh.centre) / mesh.diameter).T
    rotation = directions[:, 1] * x - directions[:, 0] * y
    return np.column_stack([directions, rotation])


def _matrix(name: str, reason: str, n_rows: int, n_columns: int, copies: int = 1) -> PlanItem:
    size = copies * n_rows * n_columns * _BYTES_PER_NUMBER
    return PlanItem(name, True, f"{reason}; {n_rows} x {n_columns}", size)


def _discretisation_items(scene: Scene, mesh: BoundaryMesh) -> Iterator[PlanItem]:
    n_tractions, n_nodal = 2 * mesh.n_elements, 2 * mesh.n_nodes
    match scene.discretisation:
        case LinearGalerkin() | QuadraticGalerkin():
            degrees, word = "linear displacements, constant tractions", "linear"
            if isinstance(scene.discretisation, QuadraticGalerkin):
                degrees, word = "quadratic displacements, linear tractions", "quadratic"
                n_tractions = 2 * (mesh.n_nodes + int(break_nodes(mesh).sum()))
                n_nodal = 2 * (mesh.n_nodes + mesh.n_elements)
            yield PlanItem(
                degrees, True, f"discretisation '{word}': {n_nodal} displacements at nodes, {n_tractions} tractions"
            )
            yield _matrix("single layer", "maps tractions to displacements", n_tractions, n_tractions)
            yield _matrix("double layer", "maps displacements to displacements", n_tractions, n_nodal)
            yield PlanItem("adjoint double layer", False, "it is the transpose of the double layer")
            yield _matrix("hypersingular operator", "makes the Steklov-Poincare map symmetric", n_nodal, n_nodal)
            reason = "displacements to nodal forces, with its factors"
            yield _matrix("Steklov-Poincare map", reason, n_nodal, n_nodal, copies=4)
        case ConstantCollocation():
            yield PlanItem(
                "constant displacements and tractions",
                True,
                f"discretisation 'constant': {n_tractions} of each at element centres",
            )
            yield _matrix("single layer", "maps tractions to displacements", n_tractions, n_tractions)
            yield _matrix("double layer", "maps displacements to displacements", n_tractions, n_tractions)
            yield PlanItem("adjoint double layer", False, "collocation takes the displacement equation alone")
            yield PlanItem("hypersingular operator", False, "collocation takes the displacement equation alone")
            reason = "(1/2 I + K) u = V t in the unknowns of this scene, factored once"
            yield _matrix("boundary equations", reason, n_tractions, n_tractions, copies=4)
    accuracy = scene.mesh.accuracy
    yield PlanItem(
        "further meshes",
        accuracy is not None,
        "the number of elements is given"
        if accuracy is None
        else f"until the estimated error is below {accuracy:g}; this plan is for the first mesh",
    )
    n_curved = int(np.count_nonzero(~mesh.is_straight))
    yield PlanItem(
        "quadrature on curved elements",
        n_curved > 0,
        f"{n_curved} of {mesh.n_elements} elements are curved" if n_curved else "all elements are straight",
    )
    if mesh.is_exterior:
        yield PlanItem("exterior domain", True, "the body fills the outside of the boundary")


def _contact_items(scene: Scene, mesh: BoundaryMesh) -> Iterator[PlanItem]:
    n_contact = sum(len(mesh.part(part.name)) for part in scene.contact_parts)
    reason = f"{n_contact} of {mesh.n_elements} elements may touch; every later step is small"
    yield _matrix("condensation to the contact boundary", reason, 2 * n_contact, 2 * n_contact, copies=2)
    n_free = free_rigid_motions(scene, mesh)
    yield PlanItem(
        "rigid motions as unknowns",
        n_free > 0,
        f"{n_free} of 3 rigid motions are held by contact alone"
        if n_free
        else "the fixed parts hold all three rigid motions",
    )
    own = [part.condition.law for part in scene.contact_parts if isinstance(part.condition, Contact)]
    laws = [scene.law if law is None else law for law in own]
    names = ", ".join(dict.fromkeys(type(law).__name__ for law in laws if not law.is_frictionless))
    n_steps = len(scene.load_factors)
    kind = "static" if n_steps == 1 else "incremental"
    reason = f"law {names}, {kind}" if names else "the law allows no tangential traction"
    yield PlanItem("friction", bool(names), reason)
    yield PlanItem(
        "load history",
        n_steps > 1,
        f"{n_steps} load steps; slip counts from the end of the step before"
        if n_steps > 1
        else "the static law takes the whole load in one step",
    )


def _output_items() -> Iterator[PlanItem]:
    yield PlanItem("fields inside the body", False, "the results are forces, energy and boundary values")
