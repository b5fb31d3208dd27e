"""Conformance of discretisations."""

from __future__ import annotations

from copy import copy
from dataclasses import is_dataclass, replace

import numpy as np

from bemkit.contact.laws import Coulomb, Frictionless
from bemkit.contact.obstacle import RigidHalfPlane
from bemkit.geometry.mesh import BoundaryMesh
from bemkit.geometry.shapes import PlateWithHole, Rectangle
from bemkit.geometry.spaces import dof_points
from bemkit.operators.linear_solvers import DenseCholesky, Tag
from bemkit.operators.material import Material
from bemkit.operators.steklov_poincare.nodal_conditions import NodalConditions
from bemkit.results.solution import Solution
from bemkit.results.solved_scene import interior_fields
from bemkit.runs.run import run
from bemkit.scene.conditions import Clamped, Contact, Part, Roller, Traction
from bemkit.scene.discretisation import Discretisation, MeshOptions
from bemkit.scene.scene import Scene
from bemkit.testing.failure import class_name, demand
from bemkit.testing.spaces import check_space

_MATERIAL = Material(2.0, 0.3)
_ROUND_OFF = 1e-9
"""Round-off of an operator of a hundred unknowns, relative to its largest entry."""
_COARSE = 0.05
"""Error of displacements and stresses of a body under uniform tension on 48 elements that no method exceeds."""


def check_discretisation(discretisation: Discretisation) -> None:
    """Check everything that `Discretisation` promises, by running small scenes; call it on your own discretisation.

    Raises
    ------
    CheckFailed
        Naming the discretisation, the promise broken, and by how much.
    """
    name = class_name(discretisation)
    demand(is_dataclass(discretisation), f"{name} is not a dataclass: scenes compare and write it by its fields")
    demand(copy(discretisation) == discretisation, f"{name} does not equal its copy")
    demand(bool(discretisation.method), f"{name}.method is empty: messages name it")
    answer = discretisation.estimates_error
    demand(isinstance(answer, bool), f"{name}.estimates_error is {answer!r}, not a bool")
    for scene in (_tension(discretisation), replace(_tension(discretisation), shape=PlateWithHole(2.0, 1.0, 0.3))):
        _check_spaces(discretisation, name, scene.build_mesh())
    _check_map(discretisation, name)
    _check_tension(discretisation, name)
    _check_contact(discretisation, name)


def _check_spaces(discretisation: Discretisation, name: str, mesh: BoundaryMesh) -> None:
    displacements, tractions = discretisation.displacement_space(mesh), discretisation.traction_space(mesh)
    elastic = discretisation.elastic_map(mesh, _MATERIAL, DenseCholesky())
    for space, of_map, what in (
        (displacements, elastic.displacement_space, "displacement_space"),
        (tractions, elastic.traction_space, "traction_space"),
    ):
        check_space(space)
        is_same = type(of_map) is type(space) and np.array_equal(of_map.element_dofs, space.element_dofs)
        demand(is_same, f"{name}.{what} is not the {what} of its map")
    degrees = (displacements.degree, tractions.degree)
    demand(
        not discretisation.estimates_error or (displacements.is_continuous and degrees[0] == degrees[1] + 1),
        f"{name}.estimates_error is True with displacements and tractions of the degrees {degrees}: the estimate is "
        "for continuous displacements and tractions of a degree less",
    )


def _check_map(discretisation: Discretisation, name: str) -> None:
    """Check the matrix of the map: rigid motions cause no forces, and its tags are true."""
    mesh = _tension(discretisation).build_mesh()
    elastic = discretisation.elastic_map(mesh, _MATERIAL, DenseCholesky())
    n_nodes = elastic.displacement_space.n_dofs // 2
    frame, nothing = np.broadcast_to(np.eye(2), (n_nodes, 2, 2)), np.zeros((n_nodes, 2))
    retained = NodalConditions(frame, nothing > 0.0, nothing, nothing == 0.0)
    matrix = elastic.condense(retained, nothing).stiffness
    size = float(np.abs(matrix).max())
    translations = np.tile(np.eye(2), (len(matrix) // 2, 1))
    for product, what in ((matrix @ translations, "a translation causes forces"), (translations.T @ matrix, "forces")):
        miss = float(np.abs(product).max()) / size
        demand(miss <= _ROUND_OFF, f"{name}.elastic_map: {what} out of equilibrium, by {miss:.1e} of the stiffness")
    if Tag.SYMMETRIC in elastic.tags:
        miss = float(np.abs(matrix - matrix.T).max()) / size
        demand(
            miss <= _ROUND_OFF, f"{name}.elastic_map says it is symmetric: it differs from its transpose by {miss:.1e}"
        )
    if Tag.KILLS_RIGID_MOTIONS in elastic.tags:
        turn = (dof_points(elastic.displacement_space) - mesh.centre) @ np.array([[0.0, 1.0], [-1.0, 0.0]])
        miss = float(np.abs(matrix @ turn.ravel()).max()) / size
        demand(miss <= _ROUND_OFF, f"{name}.elastic_map says it is zero on rigid motions: a turn causes {miss:.1e}")


def _check_tension(discretisation: Discretisation, name: str) -> None:
    """Check a body under uniform tension against its exact displacements and stresses."""
    solution = _solved(_tension(discretisation), name)
    x, y = solution.boundary.points.T
    nu = _MATERIAL.effective_poisson_ratio
    exact = np.stack([x, -nu / (1.0 - nu) * y], axis=1) / _MATERIAL.plane_modulus
    miss = float(np.abs(solution.boundary.displacement - exact).max() / np.abs(exact).max())
    demand(miss <= _COARSE, f"{name}: displacements under uniform tension are wrong by {miss:.1e}")
    stress = interior_fields(solution).stress(np.array([[0.7, 0.4], [1.2, 0.6]]))
    miss = float(np.abs(stress - np.diag([1.0, 0.0])).max())
    demand(miss <= _COARSE, f"{name}: stresses inside under uniform tension are wrong by {miss:.1e}")


def _check_contact(discretisation: Discretisation, name: str) -> None:
    """Check the forces on a block that is pressed down and to the side on a floor with friction."""
    parts = (
        Part("floor", Contact(RigidHalfPlane()), ("bottom",)),
        Part("load", Traction(x=0.1, y=-1.0), ("top",)),
        Part("wall", Roller(), ("right",)),
    )
    solution = _solved(replace(_tension(discretisation), parts=parts, law=Coulomb(0.3)), name)
    miss = abs(solution.force_normal - 2.0) / 2.0
    demand(miss <= _ROUND_OFF, f"{name}: the floor carries a pressing force that is wrong by {miss:.1e}")
    held = (Part("floor", Clamped(), ("bottom",)), parts[1])
    _solved(replace(_tension(discretisation), parts=held, law=Frictionless()), name)


def _solved(scene: Scene, name: str) -> Solution:
    solution: Solution = run(scene)
    demand(
        solution.is_converged, f"{name}: a block of {scene.mesh.elements} elements is not solved: {solution.message}"
    )
    demand(
        solution.work == solution.plan.work,
        f"{name}.elastic_map: its counts are {solution.plan.work.as_dict()}, "
        f"but the run counts {solution.work.as_dict()}",
    )
    return solution


def _tension(discretisation: Discretisation) -> Scene:
    """Return a block under a uniform tension of 1 along x, in plane strain."""
    parts = (
        Part("wall", Roller(), ("left",)),
        Part("floor", Roller(), ("bottom",)),
        Part("load", Traction(x=1.0), ("right",)),
    )
    return Scene(
        title="block",
        shape=Rectangle(2.0, 1.0),
        material=_MATERIAL,
        parts=parts,
        discretisation=discretisation,
        mesh=MeshOptions(elements=48),
    )
