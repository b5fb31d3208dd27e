"""Rigid bodies as members without stiffness, whose unknowns are the motions that loads drive."""

from __future__ import annotations

import numpy as np
from scipy import sparse

from bemkit.arrays import FloatArray
from bemkit.contact.joined.member import Member
from bemkit.model.prepared import Prepared
from bemkit.model.units import Units, motion_units
from bemkit.scene.plane_motion import RigidBody


def rigid_motions(body: RigidBody, units: Units) -> tuple[sparse.csr_array, FloatArray]:
    """Return how the unknown motions (n_driven,) move a rigid body.

    Returns
    -------
    sparse (3, n_driven) array, (3,) array
        Dimensionless motions x, y, turn are the product, and the array what is given.
    """
    chosen = sparse.csr_array(np.eye(3)[:, body.is_load_controlled])
    return chosen, body.motion * motion_units(units) / units.displacement


def rigid_members(prepared: Prepared) -> tuple[Member, ...]:
    """Return a member for each rigid body that loads drive.

    A rigid body takes the largest modulus of all bodies, so that its partners decide.
    """
    units = prepared.units
    modulus = max(body.material.plane_modulus for body in prepared.bodies) / units.modulus
    members = []
    for body in prepared.scene.rigid:
        is_load_controlled = body.is_load_controlled
        n_driven = int(np.count_nonzero(is_load_controlled))
        if n_driven:
            load = (prepared.scene.load_on(body) / motion_units(units) / prepared.force_unit)[is_load_controlled]
            members.append(Member(np.zeros((n_driven, n_driven)), load, np.eye(n_driven), modulus, body.name))
    return tuple(members)
