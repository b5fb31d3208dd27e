"""Rigid body modes in words and physical units: those that nothing holds, and the mechanism of a load."""

from __future__ import annotations

import numpy as np

from bemkit.arrays import FloatArray
from bemkit.contact.polygon import RigidPolygon
from bemkit.contact.solvability import UnsolvableLoad
from bemkit.errors import InputError, format_point
from bemkit.geometry.spaces import dof_points
from bemkit.geometry.vectors import norms
from bemkit.model.prepared import Prepared
from bemkit.model.units import Units
from bemkit.operators.rigid_modes import rigid_motions
from bemkit.scene.unit_names import amount

_DIRECTIONS = (
    *("to the right", "up and to the right", "upward", "up and to the left"),
    *("to the left", "down and to the left", "downward", "down and to the right"),
)
_REMEDY = ": change the load or hold the body"
_REMEDY_AWAY = (
    ": all contacts face away from their obstacles; choose sides that face them, or turn the direction of the obstacle "
    "round"
)
_STRAIGHT = 1e-6
"""Largest rotation that counts as none, relative to the translation over the size of the body."""
_MET = 1e-3
"""Distance of a node from a corner that meets it, relative to the largest distance of nodes."""
_ROUND_OFF = 1e-9
"""Round-off of a mode."""


class FreeBodyError(InputError):
    """Supports that leave the body free to move, where no contact could hold it."""


def check_held(prepared: Prepared) -> None:
    """Refuse supports that leave a rigid body mode free.

    Parameters
    ----------
    prepared : Prepared
        Of a scene without contact.

    Raises
    ------
    FreeBodyError
        Naming the modes.
    """
    modes = prepared.only.free_modes
    if not len(modes):
        return
    points = dof_points(prepared.only.own_space)
    basis = rigid_motions(points, np.zeros(2), 1.0).reshape(-1, 3)
    # (n_modes, 3): shift of the centre, and turn
    free = np.asarray(np.linalg.lstsq(basis, modes.reshape(len(modes), -1).T, rcond=None)[0].T, float)
    raise FreeBodyError(
        f"nothing holds the body: it may {_modes_in_words(free, prepared.units)}; give it a part that is clamped, a "
        "roller, in contact or of given displacement, or a symmetry"
    )


def _modes_in_words(modes: FloatArray, units: Units) -> str:
    """Describe how a body may move, from a basis of its motions: shifts of its centre and turns (n_modes, 3)."""
    size = float(np.linalg.norm(modes[:, 2]))
    turns = size > _ROUND_OFF
    if turns:  # a basis in which only the first mode turns
        modes = np.asarray(np.linalg.svd(modes[None, :, 2] / size)[2] @ modes)
    shifts = modes[int(turns) :, :2]
    words = []
    if len(shifts) == 2:
        words.append("move in any direction")
    elif len(shifts):
        x, y = (shifts[0] / np.linalg.norm(shifts[0])).tolist()
        is_axis = min(abs(x), abs(y)) < _ROUND_OFF
        words.append(f"move along {'xy'[abs(y) > abs(x)] if is_axis else f'({x:.3g}, {y:.3g})'}")
    if turns and len(shifts):
        words.append("turn")
    elif turns:
        words.append(f"turn {_pivot(modes[0], units)}")
    return " and ".join(words)


def _pivot(mode: FloatArray, units: Units) -> str:
    """Name the point about which a mode (shift along x, along y, turn) turns the body."""
    pivot = units.to_physical(np.array([-mode[1], mode[0]]) / mode[2])
    return f"about {format_point(pivot, units.length, digits=4)}"


def describe(prepared: Prepared, load: UnsolvableLoad) -> str:
    """Describe in one sentence how a load moves a body that nothing holds.

    Parameters
    ----------
    prepared : Prepared
    load : UnsolvableLoad
        Found for its problem.

    Returns
    -------
    str
        With the resultant force for a translation, or the moment and the fixed point for a rotation.
    """
    if not prepared.scene.has_obstacles_only:
        from bemkit.model.turning import turned_by_load

        words = f"{load.description}: hold what moves by a support, raise the friction, or change the loads"
        return turned_by_load(prepared) or words + ("" if load.is_sliding else _corner_between_nodes(prepared))
    units, scene = prepared.units, prepared.scene
    force = prepared.force_unit * scene.depth
    mode = _rigid_mode(prepared, load)
    size, turn = float(np.hypot(*mode[:2])), float(mode[2])
    if abs(turn) <= _STRAIGHT * size:
        net = amount(load.work / size * force, "force", scene.result_units)
        if load.is_sliding:
            return (
                f"the load slides the body {_direction(mode[:2])} with {net} more than friction can hold; "
                "change the load, raise the friction or hold the body"
            )
        remedy = _REMEDY_AWAY if np.isnan(load.lift).all() else _REMEDY
        return f"the load pushes the body {_direction(mode[:2])} with {net}; nothing holds it{remedy}"
    moment = amount(load.work / abs(turn) * force * units.length, "energy", scene.result_units)
    sense = "anticlockwise" if turn > 0.0 else "clockwise"
    words = f"the load turns the body {sense} {_pivot(mode, units)} with {moment}"
    return f"{words}; contact cannot hold it{_REMEDY}{_corner_between_nodes(prepared)}"


def _corner_between_nodes(prepared: Prepared) -> str:
    """Name a corner of a polygon beside its side that no node meets, so that contact ends before it; else empty."""
    n_bodies = len(prepared.bodies)
    for rows in prepared.rows:
        if rows.couplings is not None or rows.n_contact < 2:
            continue
        is_fixed = rows.other < 0
        scene = prepared.bodies[rows.body].scene
        obstacle = scene.obstacles[rows.part] if is_fixed else prepared.scene.rigid[rows.other - n_bodies].obstacle
        if not isinstance(obstacle, RigidPolygon):
            continue
        corners = np.array(obstacle.vertices)
        distances = norms(corners[:, None] - rows.points).min(axis=1)
        spacing = float(np.diff(np.sort(rows.arc_length)).max())
        beside = np.flatnonzero((distances > _MET * spacing) & (distances < spacing))
        if beside.size:
            return (
                f". The corner {format_point(corners[beside[0]], digits=6)} of the polygon lies between nodes, where "
                "contact does not act: let a part end there, or use more elements"
            )
    return ""


def _rigid_mode(prepared: Prepared, load: UnsolvableLoad) -> FloatArray:
    """Return the shift at the origin of the dimensionless points and the turn (anticlockwise), (3,)."""
    nodes = prepared.contact_nodes
    modes = rigid_motions(nodes.points, np.zeros(2), 1.0)
    matrix = np.einsum("nkc,ncm->nkm", nodes.frame, modes)
    mode: FloatArray = np.linalg.lstsq(matrix.reshape(-1, 3), load.motion.ravel(), rcond=_ROUND_OFF)[0]
    return _along_obstacle(matrix[~np.isnan(load.lift), 0], mode) if load.is_sliding else mode


def _along_obstacle(normal: FloatArray, mode: FloatArray) -> FloatArray:
    """Return the part of a mode (3,) that does not lift the nodes whose normal components are (n, 3) @ mode.

    Full friction enters a sliding load as a lift of s |v_t|; the body itself moves along the obstacle. Where it
    cannot, as on a curved one, the mode is returned as it is.
    """
    lift = np.linalg.lstsq(normal, normal @ mode, rcond=_ROUND_OFF)[0]
    along = mode - lift
    return along if np.abs(along).max() > _STRAIGHT * np.abs(mode).max() else mode


def _direction(shift: FloatArray) -> str:
    """Return the direction of a shift in words; between the eight main directions as an angle."""
    angle = float(np.degrees(np.arctan2(shift[1], shift[0]))) % 360.0
    nearest = round(angle / 45.0)
    if abs(angle - 45.0 * nearest) < 0.1:
        return _DIRECTIONS[nearest % 8]
    return f"at {angle:.4g} degrees to the x axis"
