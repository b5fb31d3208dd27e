"""Name the rigid motion along which an unsolvable load carries the body away, in words and physical units."""

from __future__ import annotations

import numpy as np

from bemkit.arrays import FloatArray
from bemkit.contact.solvability import UnsolvableLoad
from bemkit.model.contact_model import Model

_DIRECTIONS = (
    *("to the right", "up and to the right", "upward", "up and to the left"),
    *("to the left", "down and to the left", "downward", "down and to the right"),
)
_REMEDY = ": change the load or hold the body"
_STRAIGHT = 1e-6
"""Turning by less than this, relative to the shift at the size of the body, counts as none."""


def describe_escape(model: Model, escape: UnsolvableLoad) -> str:
    """Say in one sentence how the load moves the body and that nothing holds it.

    Parameters
    ----------
    model : Model
    escape : UnsolvableLoad
        Found for the model's problem.

    Returns
    -------
    str
        With the resultant force [N/m] for a translation, or the moment [N m/m] and the fixed point for a rotation.
    """
    units = model.units
    shift, turn = _rigid_motion(model, escape)
    size = float(np.hypot(*shift))
    if abs(turn) <= _STRAIGHT * size:
        net = escape.work / size * units.stress * units.length
        if escape.is_sliding:
            return (
                f"the load slides the body {_direction(shift)} with {net:.4g} N/m more than friction can hold; "
                "change the load, raise the friction or hold the body"
            )
        return f"the load pushes the body {_direction(shift)} with {net:.4g} N/m; nothing holds it{_REMEDY}"
    pivot = units.to_physical(np.array([-shift[1], shift[0]]) / turn)
    x, y = np.where(np.abs(pivot) < 1e-9 * units.length, 0.0, pivot)
    moment = escape.work / abs(turn) * units.stress * units.length**2
    sense = "anticlockwise" if turn > 0.0 else "clockwise"
    words = f"the load turns the body {sense} about ({x:.4g}, {y:.4g}) with {moment:.4g} N m/m"
    return f"{words}; contact cannot hold it{_REMEDY}"


def _rigid_motion(model: Model, escape: UnsolvableLoad) -> tuple[FloatArray, float]:
    """Return the shift at the origin of the dimensionless points, and the turn (anticlockwise), of the escape."""
    frame, points = model.nodes.frame, model.nodes.points
    spin = frame[:, :, 1] * points[:, None, 0] - frame[:, :, 0] * points[:, None, 1]
    matrix = np.concatenate([frame, spin[:, :, None]], axis=2).reshape(-1, 3)
    moves = model.body.moves.ravel()  # where a support holds the tangent, that component says nothing
    motion = np.linalg.lstsq(matrix[moves], escape.motion.ravel()[moves], rcond=1e-9)[0]
    if escape.is_sliding:
        motion = _along_obstacle(matrix[::2][~np.isnan(escape.lift) & model.body.moves[:, 0]], motion)
    return motion[:2], float(motion[2])


def _along_obstacle(normal: FloatArray, motion: FloatArray) -> FloatArray:
    """Return the part of a motion (3,) that does not lift the nodes whose normal components are (n, 3) @ motion.

    Full friction enters a sliding escape as a lift of s |v_t|; the body itself moves along the obstacle. Where it
    cannot, as on a curved one, the motion is returned as it is.
    """
    lift = np.linalg.lstsq(normal, normal @ motion, rcond=1e-9)[0]
    along = motion - lift
    return along if np.abs(along).max() > _STRAIGHT * np.abs(motion).max() else motion


def _direction(shift: FloatArray) -> str:
    """Return the direction of a shift in words; between the eight main directions as an angle."""
    angle = float(np.degrees(np.arctan2(shift[1], shift[0]))) % 360.0
    nearest = round(angle / 45.0)
    if abs(angle - 45.0 * nearest) < 0.1:
        return _DIRECTIONS[nearest % 8]
    return f"at {angle:.4g} degrees to the x axis"
