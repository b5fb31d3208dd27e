"""The load under which an assembly of bodies collapses."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.sparse import csr_array

from bemkit.arrays import FloatArray
from bemkit.contact.coulomb_limit import CoulombLimit, coulomb_limit
from bemkit.contact.limit_load import largest_factor
from bemkit.errors import InputError
from bemkit.model.placed import Meshes, place
from bemkit.model.rigid_blocks import friction_of, joints_of, loads_of, relative_motions, rigid_blocks
from bemkit.runs.steps import UnsolvableSceneError
from bemkit.scene.assembly import Assembly
from bemkit.scene.load_history import load_steps, with_scaled_loads

_UNSOLVABLE = "no contact tractions can balance the constant load, at any load factor"


def largest_load_factor(assembly: Assembly, *, meshes: Meshes = None) -> float:
    """Return the largest load factor under which contact tractions can balance the loads of an assembly.

    Parameters
    ----------
    assembly : Assembly
        Its loads and body forces are those of the factor one; body forces that are constant have none. Its own load
        factors play no part.
    meshes : mapping of str to BoundaryMesh, optional
        As for `bemkit.run`.

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
    motions, constant, growing, friction = _limit_analysis(assembly, meshes)
    factor = largest_factor(motions, constant, growing, friction)
    if factor is None:
        raise UnsolvableSceneError(_UNSOLVABLE)
    return factor


def coulomb_load_factor(assembly: Assembly, *, meshes: Meshes = None) -> CoulombLimit:
    """Return load factors at which an assembly with Coulomb friction, which does not dilate, collapses.

    Parameters
    ----------
    assembly : Assembly
    meshes : mapping of str to BoundaryMesh, optional
        Both as for `largest_load_factor`.

    Returns
    -------
    CoulombLimit
        All infinite if supports and contacts hold any multiple.

    Raises
    ------
    UnsolvableSceneError
        If no factor at all leaves a load that can be balanced.
    InputError
        If friction has a cap, or no state of collapse was found.
    """
    motions, constant, growing, friction = _limit_analysis(assembly, meshes)
    if len(friction) > 1:
        raise InputError("a friction law has a cap: the collapse with Coulomb friction needs laws without one")
    found = coulomb_limit(motions, constant, growing, *friction[0])
    if found is None:
        raise UnsolvableSceneError(_UNSOLVABLE)
    return found


def _limit_analysis(
    assembly: Assembly, meshes: Meshes
) -> tuple[csr_array, FloatArray, FloatArray, list[tuple[FloatArray, FloatArray]]]:
    """Return relative motions, the work of the constant and of the growing load on them, and friction."""
    assembly = load_steps(replace(assembly, load_factors=(1.0,)))[-1]
    bodies, unloaded = place(assembly, meshes), with_scaled_loads(assembly, 0.0)
    joints = tuple(joints_of(assembly, bodies))
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
    growing = loads_of(rigid_blocks(assembly, bodies)) - constant
    typical = float(np.abs(constant).sum()) or float(np.abs(growing).sum()) or 1.0
    return relative_motions(at_rest, joints), constant, growing, friction_of(joints, typical)
