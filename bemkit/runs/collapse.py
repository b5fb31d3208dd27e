"""The load under which a scene of bodies collapses, and the thrust between them before."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.sparse import csr_array

from bemkit.arrays import FloatArray
from bemkit.contact.coulomb_limit import MOST_PROGRAMMES, CoulombLimit, coulomb_limit
from bemkit.contact.limit_load import largest_factor, least_force
from bemkit.errors import InputError
from bemkit.formulas import choices
from bemkit.geometry.vectors import turned_left
from bemkit.model.placed import place
from bemkit.model.rigid_blocks import (
    Block,
    Joint,
    JointForces,
    friction_of,
    joints_of,
    loads_of,
    relative_motions,
    rigid_blocks,
)
from bemkit.runs.steps import UnsolvableSceneError
from bemkit.scene.load_history import load_steps, with_scaled_loads
from bemkit.scene.scene import Scene

_UNSOLVABLE = "no contact tractions can balance the constant load, at any load factor"
_MOVES = 1e-9
"""Motion that is round-off, relative to the largest."""


def largest_load_factor(scene: Scene) -> float:
    """Return the largest load factor under which contact tractions can balance the loads of a scene.

    Parameters
    ----------
    scene : Scene
        Its loads and body forces are those of the factor one; body forces that are constant have none. Its own load
        factors play no part.

    Returns
    -------
    float
        Infinite if supports and contacts hold any multiple.

    Raises
    ------
    UnsolvableSceneError
        If no factor at all leaves a load that can be balanced.

    Notes
    -----
    The static theorem of limit analysis for rigid blocks, by one linear programme: stresses inside the bodies play no
    part. Forces act at the geometric ends of straight joints, so that the factor does not depend on the mesh; curved
    joints have forces at the ends of elements. Of Coulomb friction this is a bound from above, see
    `bemkit.contact.limit_load.largest_factor`; a mesh holds less by the share of a joint that its last nodes take.
    """
    case = _limit_analysis(scene)
    factor = largest_factor(case.motions, case.constant, case.growing, case.friction)
    if factor is None:
        raise UnsolvableSceneError(_UNSOLVABLE)
    return factor


def coulomb_load_factor(scene: Scene, *, most_programmes: int = MOST_PROGRAMMES) -> CoulombLimit:
    """Return load factors at which a scene with Coulomb friction, which does not dilate, collapses.

    Parameters
    ----------
    scene : Scene
        As for `largest_load_factor`.
    most_programmes : int
        Linear programmes after which the search for a state of collapse ends.

    Returns
    -------
    CoulombLimit
        All infinite if supports hold any multiple, or if no load is constant and contacts hold any multiple.

    Raises
    ------
    UnsolvableSceneError
        If no factor at all leaves a load that can be balanced.
    InputError
        If friction has a cap, or no state of collapse was found.
    """
    case = _limit_analysis(scene)
    found = coulomb_limit(
        case.motions, case.constant, case.growing, *case.only_friction, most_programmes=most_programmes
    )
    if found is None:
        raise UnsolvableSceneError(_UNSOLVABLE)
    return found


def thrust(scene: Scene, contact: str, direction: tuple[float, float] = (1.0, 0.0)) -> tuple[JointForces, JointForces]:
    """Return the smallest and the largest thrust at a contact, of all forces that balance the loads of a scene.

    If the support of the contact yields against the direction, the thrust along it falls to the smallest; if it yields
    along it, the thrust rises to the largest. Each state has the motion of the blocks that follow.

    Parameters
    ----------
    scene : Scene
        With its loads at the load factor one.
    contact : str
        Its name in results, such as ``"first.springing"`` or ``"left.top / right.bottom"``.
    direction : (float, float)
        Of the force on the first body of the name; of any length.

    Raises
    ------
    InputError
        If there is no contact of that name, a friction law has a cap, or the thrust has no bound.
    UnsolvableSceneError
        If no contact tractions balance the loads.
    """
    case = _limit_analysis(scene)
    names = tuple(dict.fromkeys(joint.name for joint in case.joints))
    if contact not in names:
        raise InputError(f"no contact {contact!r}: the contacts are {choices(contact, names)}")
    size = float(np.hypot(*direction))
    if not (np.isfinite(size) and size > 0.0):
        raise InputError(f"direction is {direction}: give two numbers that are not both zero")
    load = case.constant + case.growing
    axis = np.array(direction) / size
    objective = np.concatenate(
        [
            (joint.name == contact) * np.stack([joint.directions @ axis, turned_left(joint.directions) @ axis], axis=1)
            for joint in case.joints
        ]
    ).ravel()
    found = []
    for sign in (1.0, -1.0):
        state = least_force(case.motions, load, sign * objective, *case.only_friction)
        if state is None:
            raise UnsolvableSceneError("no contact tractions can balance the loads")
        forces, velocities = scene.depth * state[0], state[1]
        found.append(case.joint_forces(float(objective @ forces.ravel()), names, forces, velocities))
    return found[0], found[1]


@dataclass(frozen=True, eq=False)
class _LimitCase:
    """Blocks, joints, the work of the constant and of the growing load on the motions of blocks, and friction."""

    bodies: tuple[str, ...]
    blocks: tuple[Block, ...]
    joints: tuple[Joint, ...]
    motions: csr_array
    constant: FloatArray
    growing: FloatArray
    friction: list[tuple[FloatArray, FloatArray]]

    @property
    def only_friction(self) -> tuple[FloatArray, FloatArray]:
        """Friction without pressure and its growth with pressure, of laws without a cap."""
        if len(self.friction) > 1:
            raise InputError("a friction law has a cap: collapse without dilation and thrust need laws without one")
        return self.friction[0]

    def joint_forces(
        self, value: float, names: tuple[str, ...], forces: FloatArray, velocities: FloatArray
    ) -> JointForces:
        """Return forces (n, 2), normal and tangential, and velocities in the coordinates of the scene."""
        normals = np.concatenate([joint.directions for joint in self.joints])
        first = np.cumsum([0, *(block.load.size for block in self.blocks)])
        motions = {
            name: block.motions @ velocities[begin:end] / (1.0, 1.0, block.length)
            for name, block, begin, end in zip(self.bodies, self.blocks, first[:-1], first[1:], strict=True)
        }
        largest = max((float(np.abs(motion).max()) for motion in motions.values()), default=0.0)
        moving = {
            name: (float(motion[0]), float(motion[1]), float(motion[2]))
            for name, motion in motions.items()
            if np.abs(motion).max() > _MOVES * largest
        }
        return JointForces(
            value,
            np.concatenate([joint.points for joint in self.joints]),
            forces[:, :1] * normals + forces[:, 1:] * turned_left(normals),
            -forces[:, 0],
            np.concatenate([np.full(joint.lengths.size, names.index(joint.name)) for joint in self.joints]),
            names,
            np.array([next((j.body, j.other) for j in self.joints if j.name == name) for name in names]),
            self.bodies,
            moving,
        )


def _limit_analysis(scene: Scene) -> _LimitCase:
    """Return the limit analysis of a scene, whose load factors play no part."""
    scene = load_steps(replace(scene, load_factors=(1.0,)))[-1]
    bodies, unloaded = place(scene), with_scaled_loads(scene, 0.0)
    joints = tuple(joints_of(scene, bodies))
    if not joints:
        raise InputError("no two bodies are in contact: list contacts")
    at_rest = rigid_blocks(
        unloaded,
        [
            replace(body, body=stated, scene=unloaded.scene_of(stated))
            for body, stated in zip(bodies, unloaded.placed_bodies, strict=True)
        ],
    )
    constant = loads_of(at_rest)
    growing = loads_of(rigid_blocks(scene, bodies)) - constant
    typical = float(np.abs(constant).sum()) or float(np.abs(growing).sum()) or 1.0
    names = (*(body.name for body in bodies), *(body.name for body in scene.rigid))
    motions, friction = relative_motions(at_rest, joints), friction_of(joints, typical)
    return _LimitCase(names, at_rest, joints, motions, constant, growing, friction)
