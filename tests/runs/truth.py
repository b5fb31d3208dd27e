"""The true error of displacements and tractions together, against a much finer solution."""

from __future__ import annotations

import dataclasses

import numpy as np

import bemkit as bk
from bemkit.arrays import FloatArray
from bemkit.geometry.neighbours import break_nodes
from bemkit.geometry.spaces import BoundarySpace, LinearSpace, QuadraticSpace
from bemkit.operators.boundary import hypersingular, single_layer


def cauchy_error(solution: bk.Solution, n_graded: int = 5) -> float:
    """Return sqrt((<W e_u, e_u> + <V e_t, e_t>) / a(u, u)), the relative error in the norm of the Galerkin method.

    With e_t = S e_u that is a(e_u, e_u), as W = S - S V S. Where displacements are given e_u vanishes; what remains is
    <V e_t, e_t>, by which twice the energy is wrong there. The reference has quadratic elements on the same mesh, all
    of them bisected, those at corners and ends of parts `n_graded` times more.
    """
    scene, mesh = solution.scene, solution.mesh
    everywhere = np.arange(mesh.n_elements)
    parent, span = everywhere, np.tile([-1.0, 1.0], (mesh.n_elements, 1))
    fine_mesh = mesh
    for step in range(1 + n_graded):
        at_corner = break_nodes(fine_mesh)[fine_mesh.elements].any(axis=1)
        marked = np.flatnonzero(at_corner) if step else np.arange(fine_mesh.n_elements)
        fine_mesh, parent, span = bisected(fine_mesh, parent, span, marked)
    fine = bk.run(dataclasses.replace(scene, discretisation=bk.Galerkin(2)), mesh=fine_mesh)
    u_space, u, t_space, t = fields(solution)
    _, fine_u, fine_t_space, fine_t = fields(fine)
    displacements = QuadraticSpace(fine_mesh)
    tractions = LinearSpace(fine_mesh, np.ones(fine_mesh.n_nodes, bool))  # holds what either solution may jump by
    own, whole = np.arange(fine_mesh.n_elements), np.tile([-1.0, 1.0], (fine_mesh.n_elements, 1))
    e_u = (fine_u - inherited(u_space, u, displacements, parent, span)).ravel()
    e_t = inherited(fine_t_space, fine_t, tractions, own, whole) - inherited(t_space, t, tractions, parent, span)
    strained = e_u @ hypersingular(displacements, displacements, scene.material).matrix() @ e_u
    loaded = e_t.ravel() @ single_layer(tractions, tractions, scene.material).matrix() @ e_t.ravel()
    return float(np.sqrt((strained + loaded) / (2.0 * fine.energy)))


def fields(solution: bk.Solution) -> tuple[BoundarySpace, FloatArray, BoundarySpace, FloatArray]:
    """Return displacements and tractions with their spaces."""
    discretisation, mesh, modulus = solution.scene.discretisation, solution.mesh, solution.scene.material.plane_modulus
    material = solution.scene.material.scaled(modulus)
    elastic = discretisation.elastic_map(mesh.unit, material, solution.plan.linear_solver)
    u = solution.boundary.displacement
    tractions = elastic.tractions(u / mesh.diameter) * modulus  # type: ignore[attr-defined]  # of a Galerkin map
    return discretisation.displacement_space(mesh), u, discretisation.traction_space(mesh), tractions


def bisected(
    mesh: bk.BoundaryMesh, parent: np.ndarray, span: FloatArray, marked: np.ndarray
) -> tuple[bk.BoundaryMesh, np.ndarray, FloatArray]:
    """Bisect elements, and keep of which coarse element, and from where to where on it, each one is a piece."""
    is_halved = np.zeros(mesh.n_elements, bool)
    is_halved[marked] = True
    source = np.repeat(np.arange(mesh.n_elements), 1 + is_halved)
    first = (np.arange(mesh.n_elements) + np.cumsum(is_halved) - is_halved)[is_halved]
    pieces = span[source]
    pieces[first, 1] = pieces[first + 1, 0] = span[is_halved].mean(axis=1)
    return mesh.refined(marked), parent[source], pieces


def inherited(
    space: BoundarySpace, values: FloatArray, fine: BoundarySpace, parent: np.ndarray, span: FloatArray
) -> FloatArray:
    """Return the dofs on a finer space of a function on a coarse one."""
    result = np.empty((fine.n_dofs // 2, 2))
    for local, dofs in enumerate(fine.element_dofs.T):
        xi = span[:, 0] + 0.5 * (fine.local_nodes[local] + 1.0) * (span[:, 1] - span[:, 0])
        result[dofs] = np.einsum("pe,epc->ec", space.basis(xi), values[space.element_dofs[parent]])
    return result
