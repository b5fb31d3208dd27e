"""Solve a scene: the way from what the user states to a certified result."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable
from concurrent.futures import Executor

import numpy as np

from bemkit.arrays import FloatArray
from bemkit.contact.body import ContactState
from bemkit.geometry.mesh import BoundaryMesh
from bemkit.geometry.order import along_boundary
from bemkit.geometry.space import dof_points
from bemkit.model import Model, build_model
from bemkit.operators.threads import blas_threads_for
from bemkit.plan import make_plan
from bemkit.scene import Scene
from bemkit.solution import BoundaryFields, ContactTable, Solution, find_transitions
from bemkit.solvers.base import ContactSolution, StepRecord, solve


class UnsolvableSceneError(ValueError):
    """The scene has no solution; the message says why."""


def run(
    scene: Scene, *, mesh: BoundaryMesh | None = None, callback: Callable[[StepRecord], None] | None = None
) -> Solution:
    """Solve a scene.

    Parameters
    ----------
    scene : Scene
    mesh : BoundaryMesh, optional
        A mesh of one's own with the parts of the scene; by default the one the scene describes.
    callback : callable, optional
        Receives a record of every step as soon as it exists.

    Returns
    -------
    Solution
        Look at `Solution.status` before you use it: a run that did not converge returns what it reached.

    Raises
    ------
    UnsolvableSceneError
        If no contact tractions can balance the load, or the body can move freely.
    ValueError
        If the scene is not well posed; the message names the part and the remedy.
    """
    clock = [time.perf_counter()]
    mesh = scene.build_mesh() if mesh is None else mesh
    plan = make_plan(scene, mesh)
    clock.append(time.perf_counter())
    with blas_threads_for(2 * mesh.n_elements):
        model = build_model(scene, mesh)
        clock.append(time.perf_counter())
        result = solve(model.problem, scene.solver, throw=False, callback=callback)
    if not result.history:
        raise UnsolvableSceneError(result.message)
    clock.append(time.perf_counter())
    fields, energy = _fields(model, result.state)
    table = _contact_table(model, result)
    clock.append(time.perf_counter())
    timings = dict(zip(("mesh", "assemble", "solve", "recover"), np.diff(clock).tolist(), strict=True))
    timings["total"] = clock[-1] - clock[0]
    return Solution(
        scene=scene,
        mesh=mesh,
        status=result.status,
        certificate=result.certificate,
        contact=table,
        boundary=fields,
        history=result.history,
        linear_solves=result.linear_solves,
        outer_steps=result.steps,
        force_normal=-float(np.sum(table.weight * table.sigma_n)),
        force_tangential=float(np.sum(table.weight * table.sigma_t)),
        energy=energy,
        transitions=find_transitions(table),
        timings=timings,
        plan=plan,
        message=result.message,
    )


def run_all(scenes: Iterable[Scene], executor: Executor | None = None) -> list[Solution]:
    """Solve several scenes, on any `concurrent.futures.Executor` if one is given.

    Parameters
    ----------
    scenes : iterable of Scene
    executor : Executor, optional
        For example a `ProcessPoolExecutor`, or the executor of a `distributed` client. Without one the scenes are
        solved in turn.

    Returns
    -------
    list of Solution
        In the order of the scenes.
    """
    return list(map(run, scenes)) if executor is None else list(executor.map(run, scenes))


def _fields(model: Model, state: ContactState) -> tuple[BoundaryFields, float]:
    displacement, traction, energy = model.boundary_fields(state)
    points = model.units.to_physical(dof_points(model.elastic.displacement_space))
    return BoundaryFields(points, displacement, model.mesh.centres.copy(), traction), energy


def _contact_table(model: Model, result: ContactSolution) -> ContactTable:
    units, state = model.units, result.state
    points = units.to_physical(model.nodes.points)
    parts, lengths = _places(model)
    gap = model.problem.gap * units.displacement
    displacement = state.displacement * units.displacement
    return ContactTable(
        part=parts,
        x=points[:, 0].copy(),
        y=points[:, 1].copy(),
        s=lengths,
        u_n=displacement[:, 0].copy(),
        u_t=displacement[:, 1].copy(),
        sigma_n=state.sigma_n * units.stress,
        sigma_t=state.sigma_t * units.stress,
        gap=gap,
        clearance=gap - displacement[:, 0],
        status=np.asarray(result.node_status).copy(),
        weight=model.nodes.weights * units.length,
    )


def _places(model: Model) -> tuple[tuple[str, ...], FloatArray]:
    """Return the part of each contact node and its arc length along it; a node of two parts belongs to the first."""
    space = model.elastic.displacement_space
    n_scalar = space.n_dofs // 2
    names: list[str] = [""] * n_scalar
    arc_length = np.full(n_scalar, np.nan)
    for part in model.scene.contact_parts:
        elements = along_boundary(model.mesh, model.mesh.part(part.name))
        lengths = model.mesh.lengths[elements]
        begin = np.concatenate([[0.0], np.cumsum(lengths)[:-1]])
        dofs = space.element_dofs[elements]
        s = begin[:, None] + 0.5 * lengths[:, None] * (space.local_nodes + 1.0)
        for dof, place in zip(dofs.ravel().tolist(), s.ravel().tolist(), strict=True):
            if not names[dof]:
                names[dof], arc_length[dof] = part.name, place
    return tuple(names[dof] for dof in model.nodes.nodes.tolist()), arc_length[model.nodes.nodes]
