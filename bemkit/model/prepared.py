"""A scene on a mesh, made ready to plan and to solve: units, conditions at nodes, contact nodes and forces, once."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import zip_longest

import numpy as np

from bemkit.arrays import FloatArray
from bemkit.contact.condensation.nodes import contact_conditions, free_motions
from bemkit.errors import InputError
from bemkit.geometry.mesh import BoundaryMesh
from bemkit.geometry.spaces import BoundarySpace
from bemkit.model.boundary_data import Units, find_units, nodal_forces, supports_on
from bemkit.model.contact_data import ContactData, find_contact
from bemkit.operators.linear.choice import choose_linear_solver
from bemkit.operators.linear.memory import physical_memory
from bemkit.operators.linear.solvers import Automatic, Choice, DenseCholesky, Krylov
from bemkit.operators.material import Material
from bemkit.operators.steklov_poincare.nodal_conditions import NodalConditions
from bemkit.scene.conditions import Part, PrescribedDisplacement
from bemkit.scene.scene import LARGEST_KRYLOV_ERROR, Scene
from bemkit.scene.symmetry import check_symmetry

_FARTHEST = 1e7
"""Distance from the origin in diameters up to which coordinates hold nine digits of the shape."""


class TooFarError(InputError):
    """A body whose coordinates are so large that they no longer hold its shape."""


@dataclass(frozen=True, eq=False)
class Prepared:
    """What a scene says on a mesh, dimensionless but for the mesh and the columns of the contact data.

    Parameters
    ----------
    scene : Scene
        With a single load.
    mesh : BoundaryMesh
        In physical units.
    units : Units
    space : BoundarySpace
        Of the displacements, on the unit mesh.
    conditions : NodalConditions
        Supports, and the directions that are open to contact.
    candidates : ContactData
        The nodes on contact parts, whatever supports hold them.
    contact : ContactData
        Those of them that can touch their obstacle.
    force : (n_nodes, 2) array [-]
        Given nodal forces.
    """

    scene: Scene
    mesh: BoundaryMesh
    units: Units
    space: BoundarySpace
    conditions: NodalConditions
    candidates: ContactData
    contact: ContactData
    force: FloatArray

    @property
    def material(self) -> Material:
        """The material, its modulus in dimensionless units."""
        return self.scene.material.scaled(self.units.modulus)

    @cached_property
    def free_motions(self) -> FloatArray:
        """(n_motions, n_contact, 2) array: rigid body modes that no support resists, in (n, t) components."""
        return free_motions(self.conditions, self.contact.nodes, self.space)

    @cached_property
    def linear_solver(self) -> Choice:
        """The linear solver that a symmetric map follows, and why it is taken."""
        scene, requested = self.scene, self.scene.linear_solver
        if not scene.discretisation.is_symmetric:
            direct = DenseCholesky() if isinstance(requested, Automatic) else requested
            return Choice(direct, "the map has a linear solver of its own")
        if isinstance(requested, Automatic) and Krylov().error_at(scene.material) > LARGEST_KRYLOV_ERROR:
            requested = DenseCholesky()  # iteration would be too inexact
        n_open = int(np.count_nonzero(self.conditions.is_open))
        return choose_linear_solver(requested, self.space.n_dofs, n_open, physical_memory())

    def under(self, scene: Scene) -> Prepared:
        """Return the same body under the loads, obstacles and law of another scene, in the same units.

        Parameters
        ----------
        scene : Scene
            Differs from this one in numbers of its conditions, its law and its solver alone.

        Raises
        ------
        ValueError
            If the scene has another body, other parts, or other kinds of conditions.
        """
        _check_same_body(self.scene, scene)
        check_symmetry(scene, self.mesh)
        return _prepared(scene, self.mesh, self.units, self.space)


def prepare(scene: Scene, mesh: BoundaryMesh, units: Units | None = None) -> Prepared:
    """Work out what a scene says on a mesh.

    Parameters
    ----------
    scene : Scene
        With a single load; see `bemkit.scene.load_history.load_steps`.
    mesh : BoundaryMesh
        As made by `Scene.build_mesh`, or a refinement of it.
    units : Units, optional
        By default `find_units` of the scene.

    Returns
    -------
    Prepared

    Raises
    ------
    TooFarError
        If the body lies so far from the origin that its coordinates no longer hold its shape.
    ConflictingSupportsError
        If supports contradict each other at a node.
    ValueError
        If the scene lacks its symmetry, or an expression is not finite somewhere.
    """
    _check_position(mesh)
    check_symmetry(scene, mesh)
    units = find_units(scene, mesh) if units is None else units
    space = scene.discretisation.displacement_space(mesh.unit)
    return _prepared(scene, mesh, units, space)


def prepare_steps(steps: Sequence[Scene], mesh: BoundaryMesh) -> tuple[Prepared, ...]:
    """Work out what scenes that follow each other in time say on a mesh, in the units of the largest load."""
    units = max((find_units(step, mesh) for step in steps), key=lambda units: units.stress)
    first = prepare(steps[0], mesh, units)
    return (first, *(first.under(step) for step in steps[1:]))


def _prepared(scene: Scene, mesh: BoundaryMesh, units: Units, space: BoundarySpace) -> Prepared:
    candidates = find_contact(scene, mesh, space)
    conditions, nodes = contact_conditions(space, supports_on(scene, mesh, units, space), candidates.nodes)
    force = nodal_forces(scene, mesh, space, units)
    return Prepared(scene, mesh, units, space, conditions, candidates, candidates.of(nodes), force)


def _check_position(mesh: BoundaryMesh) -> None:
    """Refuse a body so far from the origin that its coordinates hold too few digits of its shape."""
    distance = float(np.abs(mesh.nodes).max()) / mesh.diameter
    if distance > _FARTHEST:
        x, y = mesh.centre.tolist()
        raise TooFarError(
            f"the body lies {distance:.1e} times its size from the origin, where numbers hold fewer than nine digits "
            f"of its shape: subtract about ({x:.6g}, {y:.6g}) from all coordinates of body and obstacles"
        )


def _check_same_body(scene: Scene, other: Scene) -> None:
    """Refuse another scene whose matrices would be others."""
    for name in ("shape", "material", "symmetry", "discretisation"):
        if getattr(scene, name) != getattr(other, name):
            raise InputError(f"{name} is {getattr(other, name)}: keep {getattr(scene, name)}, or build a new model")
    for part, changed in zip_longest(scene.parts, other.parts):
        if part is None or changed is None or _layout(part) != _layout(changed):
            name = (part or changed).name
            raise InputError(f"part {name!r} changes its place or its kind: change numbers only, or build a new model")


def _layout(part: Part) -> tuple[object, ...]:
    condition = part.condition
    components = condition.is_prescribed if isinstance(condition, PrescribedDisplacement) else ()
    return part.name, part.sides, part.where, type(condition), components
