"""A scene on a mesh, made ready to plan and to solve: units, conditions at nodes, contact nodes and forces, once.

Inside, lengths are measured by the diameter of the body, stresses of the material by E', loads by their largest value
p and displacements by p L / E'.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import zip_longest

import numpy as np

from bemkit.arrays import FloatArray
from bemkit.contact.condensation.nodes import contact_conditions
from bemkit.errors import InputError
from bemkit.geometry.mesh import BoundaryMesh
from bemkit.geometry.spaces import BoundarySpace, element_nodes
from bemkit.model.contact_data import ContactData, find_contact
from bemkit.model.units import Units, check_position, find_units
from bemkit.operators.half_plane.far_drive import FarDrive
from bemkit.operators.linear.solvers import (
    ChosenLinearSolver,
    Hierarchical,
    LinearSolverChoice,
    choose_linear_solver,
)
from bemkit.operators.material import Material
from bemkit.operators.steklov_poincare import TractionField
from bemkit.operators.steklov_poincare.forces_inside import ForcesInside
from bemkit.operators.steklov_poincare.hierarchical_needs import (
    LARGEST_BLOCK,
    choose_collocation_solver,
)
from bemkit.operators.steklov_poincare.needs import BodyCase, physical_memory
from bemkit.operators.steklov_poincare.nodal_conditions import (
    GivenData,
    NodalConditions,
    Support,
    free_modes,
    integrate_traction,
    turning,
)
from bemkit.scene.conditions import Clamped, Part, PrescribedDisplacement, Pressure, Roller, Traction
from bemkit.scene.discretisation import Discretisation
from bemkit.scene.scene import Scene


def supports_on(scene: Scene, mesh: BoundaryMesh, units: Units, space: BoundarySpace) -> list[Support]:
    """Return the supports of the parts that hold the body, their displacements in the units given."""
    result = []
    for part, elements in scene.parts_on(mesh):
        condition = part.condition
        axes = np.broadcast_to(np.eye(2), (elements.size, 2, 2))
        if isinstance(condition, Roller):
            normals = mesh.normals_at(elements, element_nodes(space)[elements])
            result.append(Support(part.name, elements, normals[:, :, None, :]))
        elif isinstance(condition, Clamped):
            result.append(Support(part.name, elements, axes))
        elif isinstance(condition, PrescribedDisplacement):
            result.append(
                Support(
                    part.name, elements, axes[:, list(condition.is_prescribed)], _dimensionless_motion(condition, units)
                )
            )
    return result


def _dimensionless_motion(condition: PrescribedDisplacement, units: Units) -> Callable[[FloatArray], FloatArray]:
    def field(points: FloatArray) -> FloatArray:
        return condition.at(units.to_physical(points)) / units.displacement

    return field


def nodal_forces(scene: Scene, mesh: BoundaryMesh, space: BoundarySpace, units: Units) -> FloatArray:
    """Return the (n_nodes, 2) dimensionless forces of all loads on the nodes of a space on the unit mesh."""
    force = np.zeros((space.n_dofs // 2, 2))
    for part, elements in scene.parts_on(mesh):
        if isinstance(part.condition, Traction | Pressure):
            force += integrate_traction(space, elements, dimensionless_load(part.condition, units))
    return force


def dimensionless_load(load: Traction | Pressure, units: Units) -> TractionField:
    """Return a load as a function of dimensionless points."""

    def field(points: FloatArray, normals: FloatArray) -> FloatArray:
        return load.at(units.to_physical(points), normals) / units.stress

    return field


def far_drive(scene: Scene, units: Units) -> FarDrive:
    """Return how a half-plane moves far away, in the units given; at rest by default."""
    far = scene.far
    if far is None:
        return FarDrive()
    motion = far.motion / (units.displacement, units.displacement, units.displacement / units.length)
    load = far.load / (units.stress * units.length * np.array([1.0, 1.0, units.length]))
    centre = (np.array(far.centre) - units.centre) / units.length
    driven = tuple(np.flatnonzero(far.is_driven).tolist())
    return FarDrive(driven, *(tuple(array.tolist()) for array in (motion, load, centre)))


@dataclass(frozen=True, eq=False)
class Prepared:
    """A scene on a mesh, dimensionless except for the mesh and the columns of the contact data.

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
        Supports, and the directions that are retained for contact.
    candidates : ContactData
        The nodes on contact parts, held by supports or not.
    contact : ContactData
        Those of them that can touch their obstacle.
    force : (n_nodes, 2) array [-]
        Given nodal forces.
    inside : ForcesInside or None
        Body forces; None without any.
    drive : FarDrive
        How a half-plane moves far away.
    """

    scene: Scene
    mesh: BoundaryMesh
    units: Units
    space: BoundarySpace
    conditions: NodalConditions
    candidates: ContactData
    contact: ContactData
    force: FloatArray
    inside: ForcesInside | None = None
    drive: FarDrive = field(default_factory=FarDrive)

    @property
    def material(self) -> Material:
        """The material, its modulus in dimensionless units."""
        return self.scene.material.scaled(self.units.modulus)

    @property
    def map_data(self) -> GivenData:
        """The forces and displacements under which the elastic map is solved; see `given_data`."""
        return given_data(self.conditions, self.force, self.inside)

    @cached_property
    def free_modes(self) -> FloatArray:
        """(n_motions, n_nodes, 2) array: rigid body modes that no support resists."""
        return free_modes(self.space, self.conditions)

    @cached_property
    def linear_solver(self) -> ChosenLinearSolver:
        """The linear solver of the map, and why it was chosen."""
        case = BodyCase(
            self.space.mesh, self.material, self.conditions, (self.map_data,), is_condensed=self.is_condensed
        )
        requested, discretisation = self.scene.linear_solver, self.scene.discretisation
        return linear_solver_of(requested, discretisation, case)

    @property
    def largest_matrix(self) -> int:
        """Order of the largest matrix that is factored, roughly."""
        n_dofs = self.space.n_dofs
        return n_dofs if self.linear_solver.hierarchical is None else min(LARGEST_BLOCK, n_dofs)

    @cached_property
    def is_condensed(self) -> bool:
        """Whether contact sees the stiffness of the body even if its equations are compressed over a tree.

        The stiffness is needed to see whether the energy of elements that are too long can be negative, for rotations
        that no support holds and displacements do not contain, and for nodes between two obstacles (two rows each).
        """
        if self.contact.nodes.is_shared.any():
            return True
        discretisation = self.scene.discretisation
        if discretisation.is_symmetric:
            return False
        if not discretisation.keeps_rotations and turning(self.free_modes).any():
            return True
        return discretisation.may_be_negative(self.space.mesh)

    def under(self, scene: Scene) -> Prepared:
        """Return the same body under the loads, obstacles and law of another scene, in the same units.

        Parameters
        ----------
        scene : Scene
            Differs from this one only in numbers of its conditions, its law and its solver.

        Raises
        ------
        ValueError
            If the scene has another body, other parts, or other kinds of conditions.
        """
        check_same_body(self.scene, scene)
        _check_symmetry(scene, self.mesh)
        return _prepared(scene, self.mesh, self.units, self.space)


def given_data(conditions: NodalConditions, force: FloatArray, inside: ForcesInside | None) -> GivenData:
    """Return the forces and displacements under which an elastic map is solved, without what acts inside the body."""
    if inside is not None:
        conditions, force = inside.left_of(conditions, force)
    return GivenData.of(conditions, force, conditions.displacement)


def prepare(scene: Scene, mesh: BoundaryMesh, units: Units | None = None) -> Prepared:
    """Prepare a scene on a mesh: conditions at nodes, contact nodes and forces.

    Parameters
    ----------
    scene : Scene
        With a single load; see `bemkit.scene.load_history.load_steps`.
    mesh : BoundaryMesh
        As made by `Scene.build_mesh`, or a refinement of it.
    units : Units, optional
        By default `find_units` of the scene.

    Raises
    ------
    TooFarError
        If the body lies so far from the origin that its coordinates no longer hold its shape.
    ConflictingSupportsError
        If supports contradict each other at a node.
    ValueError
        If the scene lacks its symmetry, or an expression is not finite somewhere.
    """
    check_position(mesh)
    _check_symmetry(scene, mesh)
    units = find_units(scene, mesh) if units is None else units
    space = scene.discretisation.displacement_space(mesh.unit)
    return _prepared(scene, mesh, units, space)


def prepare_steps(steps: Sequence[Scene], mesh: BoundaryMesh) -> tuple[Prepared, ...]:
    """Prepare scenes that follow each other in time, on one mesh and in the units of the largest load."""
    units = max((find_units(step, mesh) for step in steps), key=lambda units: units.stress)
    first = prepare(steps[0], mesh, units)
    later = tuple(first.under(step) for step in steps[1:])
    if later:
        first = replace(first, conditions=replace(first.conditions, later=tuple(step.map_data for step in later)))
    return (first, *later)


def _check_symmetry(scene: Scene, mesh: BoundaryMesh) -> None:
    if scene.symmetry is not None or mesh.symmetry is not None:
        from bemkit.scene.symmetry import check_symmetry

        check_symmetry(scene, mesh)


def _prepared(scene: Scene, mesh: BoundaryMesh, units: Units, space: BoundarySpace) -> Prepared:
    candidates = find_contact(scene, mesh, space)
    drive = far_drive(scene, units)
    supports = supports_on(scene, mesh, units, space)
    conditions, nodes = contact_conditions(space, supports, candidates.nodes, drive.driven)
    force = nodal_forces(scene, mesh, space, units)
    inside = None
    if scene.body_forces:
        from bemkit.model.particular import particular_solution

        inside = ForcesInside.of(particular_solution(scene, mesh, units.modulus, units.stress), space)
    return Prepared(scene, mesh, units, space, conditions, candidates, candidates.of(nodes), force, inside, drive)


def check_same_body(scene: Scene, other: Scene) -> None:
    """Check that another scene has the same matrices on the same mesh.

    Raises
    ------
    InputError
        Naming the first difference.
    """
    for name in ("shape", "material", "symmetry", "discretisation"):
        if getattr(scene, name) != getattr(other, name):
            raise InputError(f"{name} is {getattr(other, name)}: keep {getattr(scene, name)}, or build a new model")
    if _driven(scene) != _driven(other):
        raise InputError("far drives other motions: change numbers only, or build a new model")
    if [type(force) for force in scene.body_forces] != [type(force) for force in other.body_forces]:
        raise InputError("body_forces change their kinds or order: change numbers only, or build a new model")
    for part, changed in zip_longest(scene.parts, other.parts):
        if part is None or changed is None or _layout(part) != _layout(changed):
            name = (part or changed).name
            raise InputError(f"part {name!r} changes its place or its kind: change numbers only, or build a new model")


def _driven(scene: Scene) -> list[bool]:
    return [] if scene.far is None else scene.far.is_driven.tolist()


def _layout(part: Part) -> tuple[object, ...]:
    condition = part.condition
    components = condition.is_prescribed if isinstance(condition, PrescribedDisplacement) else ()
    return part.name, part.sides, part.where, type(condition), components


def linear_solver_of(
    requested: LinearSolverChoice, discretisation: Discretisation, case: BodyCase
) -> ChosenLinearSolver:
    """Choose the linear solver of a map.

    Parameters
    ----------
    requested : LinearSolver, Hierarchical or Automatic
    discretisation : Discretisation
    case : BodyCase
        Its linear solver counts for nothing.

    Raises
    ------
    InputError
        If compressed equations of Galerkin's method are requested: there are none.
    """
    if not discretisation.is_symmetric:
        return choose_collocation_solver(requested, case, physical_memory(), discretisation.why_dense(case.mesh))
    if isinstance(requested, Hierarchical) and case.mesh.surface is None:
        raise InputError(
            f"linear_solver is 'hierarchical', but discretisation {discretisation.method} has dense equations only: "
            'take discretisation = "constant", whose equations are compressed, or hp with an accuracy and '
            'linear_solver = "automatic"'
        )
    return choose_linear_solver(requested)
