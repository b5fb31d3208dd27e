"""Dimensionless data of a body: supports, loads, motion far away."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from itertools import zip_longest
from typing import TYPE_CHECKING

import numpy as np

from bemkit.arrays import FloatArray, IntArray
from bemkit.errors import InputError
from bemkit.geometry.mesh import BoundaryMesh
from bemkit.geometry.spaces import BoundarySpace, element_nodes
from bemkit.model.units import Units
from bemkit.operators.steklov_poincare import SteklovPoincare
from bemkit.operators.steklov_poincare.nodal_conditions import (
    ConflictingSupportsError,
    GivenData,
    NodalConditions,
    Support,
    TractionField,
    integrate_traction,
    supported,
)
from bemkit.scene.body_scene import BodyScene
from bemkit.scene.conditions import (
    Clamped,
    DistributedLoad,
    Force,
    Load,
    Part,
    PrescribedDisplacement,
    RigidConnection,
    Roller,
)

if TYPE_CHECKING:
    from bemkit.operators.half_plane.far_motion import FarMotion
    from bemkit.operators.steklov_poincare.forces_inside import ForcesInside


def held_nodes(scene: BodyScene, mesh: BoundaryMesh, units: Units, space: BoundarySpace) -> NodalConditions:
    """Return the nodal conditions of the parts that hold the body, their displacements in the units given.

    Raises
    ------
    ConflictingSupportsError
        If parts contradict each other at a node; the message names its point in metres.
    """
    try:
        held = supported(space, _supports_on(scene, mesh, units, space))
        return replace(held, connected=_connected(scene, mesh, space))
    except ConflictingSupportsError as error:
        x, y = units.to_physical(np.array(error.point)).tolist()
        raise ConflictingSupportsError(error.part, (x, y)) from None


def _connected(scene: BodyScene, mesh: BoundaryMesh, space: BoundarySpace) -> tuple[IntArray, ...]:
    """Return the nodes of each rigid connection.

    Raises
    ------
    InputError
        If one shares a node with a part that has another condition than a load.
    """
    parts = [(part, np.unique(space.element_dofs[elements])) for part, elements in scene.parts_on(mesh)]
    connected = [(part.name, nodes) for part, nodes in parts if isinstance(part.condition, RigidConnection)]
    for name, nodes in connected:
        for part, others in parts:
            may_share = isinstance(part.condition, DistributedLoad)
            if part.name != name and not may_share and np.intersect1d(nodes, others).size:
                raise InputError(
                    f"part {name!r} is rigid and meets part {part.name!r}: leave a piece of the boundary between them "
                    "that is free or loaded"
                )
    return tuple(nodes for _, nodes in connected)


def _supports_on(scene: BodyScene, mesh: BoundaryMesh, units: Units, space: BoundarySpace) -> list[Support]:
    """Return the supports of the parts that hold the body, their displacements in the units given."""
    result = []
    for part, elements in scene.parts_on(mesh):
        condition = part.condition
        axes = np.broadcast_to(np.eye(2), (elements.size, 2, 2))
        if isinstance(condition, Roller):
            normals = mesh.normals_at(elements, element_nodes(space)[elements])
            result.append(Support(part.name, elements, normals[:, :, None, :]))
        elif isinstance(condition, Clamped | RigidConnection):
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


def nodal_forces(scene: BodyScene, mesh: BoundaryMesh, space: BoundarySpace, units: Units) -> FloatArray:
    """Return the (n_nodes, 2) dimensionless forces of all loads on the nodes of a space on the unit mesh."""
    force = np.zeros((space.n_dofs // 2, 2))
    for part, elements in scene.parts_on(mesh):
        if isinstance(part.condition, Load):
            force += integrate_traction(space, elements, dimensionless_load(part.condition, units))
    return force


def dimensionless_load(load: Load, units: Units) -> TractionField:
    """Return a load as a function of dimensionless points."""

    def field(points: FloatArray, normals: FloatArray) -> FloatArray:
        return load.at(units.to_physical(points), normals) / units.stress

    return field


def far_motion_of(scene: BodyScene, units: Units) -> FarMotion | None:
    """Return the motion of a half-plane far away, in the units given; None at rest, and for other bodies."""
    far = scene.far
    if far is None:
        return None
    from bemkit.operators.half_plane.far_motion import FarMotion

    motion = far.motion / (units.displacement, units.displacement, units.displacement / units.length)
    load = far.load / (units.stress * units.length * np.array([1.0, 1.0, units.length]))
    centre = ((np.array(far.centre) - units.centre) / units.length).tolist()
    load_controlled = tuple(np.flatnonzero(far.is_load_controlled).tolist())
    strain = far.strain * units.length / units.displacement
    (x, y, turn), (force_x, force_y, moment) = motion.tolist(), load.tolist()
    return FarMotion(load_controlled, (x, y, turn), (force_x, force_y, moment), (centre[0], centre[1]), strain)


def with_far_motion(elastic: SteklovPoincare, far_motion: FarMotion | None) -> SteklovPoincare:
    """Return a half-plane with another motion far away, None for rest; any other body unchanged."""
    if elastic.traction_space.mesh.surface is None:
        return elastic
    from bemkit.operators.half_plane.far_motion import FarMotion
    from bemkit.operators.half_plane.surface import SurfaceElasticity

    return elastic.with_far_motion(far_motion or FarMotion()) if isinstance(elastic, SurfaceElasticity) else elastic


def loaded_map(elastic: SteklovPoincare, inside: ForcesInside | None) -> SteklovPoincare:
    """Return a map under forces inside the body, the map itself if there are none."""
    if inside is None:
        return elastic
    from bemkit.operators.steklov_poincare.forces_inside import ElasticityWithBodyForces

    return ElasticityWithBodyForces(elastic, inside)


def without_body_forces(elastic: SteklovPoincare, inside: ForcesInside | None) -> SteklovPoincare:
    """Return a map of `loaded_map` without the forces inside the body."""
    if inside is None:
        return elastic
    from bemkit.operators.steklov_poincare.forces_inside import ElasticityWithBodyForces

    assert isinstance(elastic, ElasticityWithBodyForces)
    return elastic.elastic


def given_data(conditions: NodalConditions, force: FloatArray, inside: ForcesInside | None) -> GivenData:
    """Return the forces and displacements under which an elastic map is solved, without body forces."""
    if inside is not None:
        conditions, force = inside.left_of(conditions, force)
    return GivenData.of(conditions, force, conditions.displacement)


def check_same_body(
    scene: BodyScene, other: BodyScene, parts: Sequence[Part], changed_parts: Sequence[Part], name: str
) -> None:
    """Check that a body has the same matrices on the same mesh in another scene; `name` is that of the body.

    Its stated parts are compared: the scenes also have those that touch other bodies.

    Raises
    ------
    InputError
        Naming the first difference.
    """
    of_body = f"body {name!r}: " if name else ""
    for key in ("shape", "material", "symmetry", "discretisation"):
        if getattr(scene, key) is not getattr(other, key) and getattr(scene, key) != getattr(other, key):
            value = getattr(other, key)
            raise InputError(f"{of_body}{key} is {value}: keep {getattr(scene, key)}, or build a new model")
    if _driven(scene) != _driven(other):
        raise InputError(f"{of_body}far drives other motions: change numbers only, or build a new model")
    if [type(force) for force in scene.body_forces] != [type(force) for force in other.body_forces]:
        raise InputError(f"{of_body}body_forces change their kinds or order: change numbers only, or build a new model")
    for part, changed in zip_longest(parts, changed_parts):
        if part is changed:
            continue
        if part is None or changed is None or _layout(part) != _layout(changed):
            part_name = (part or changed).name
            raise InputError(
                f"{of_body}part {part_name!r} changes its place or its kind: change numbers only, or build a new model"
            )


def _driven(scene: BodyScene) -> list[bool]:
    return [] if scene.far is None else scene.far.is_load_controlled.tolist()


def _layout(part: Part) -> tuple[object, ...]:
    condition = part.condition
    components: tuple[bool, ...] = ()
    if isinstance(condition, PrescribedDisplacement):
        components = condition.is_prescribed
    elif isinstance(condition, Force):
        components = (condition.is_rigid,)
    return part.name, part.sides, part.where, type(condition), components
