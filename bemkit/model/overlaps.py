"""Bodies that overlap before anything is solved."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from bemkit.arrays import FloatArray
from bemkit.contact.obstacle import Obstacle, RigidCircle
from bemkit.contact.polygon import RigidPolygon
from bemkit.geometry.proximity.overlap import ROUND_OFF, Polyline, deepest_overlap, near_pairs
from bemkit.model.contacts import OverlapError
from bemkit.model.placed import PlacedBody
from bemkit.scene.body_scene import BodyScene
from bemkit.scene.scene import Scene


def check_apart(scene: Scene, bodies: Sequence[PlacedBody]) -> None:
    """Check that no two bodies overlap by more than the interference of the contacts between them.

    Elastic bodies but for half-planes are compared with each other, with rigid bodies and, beside the parts that touch
    them, with fixed obstacles, both of finite size.

    Raises
    ------
    OverlapError
        With the names of both, the depth and the place.
    """
    finite = [body for body in bodies if body.mesh.surface is None]
    outlines = [Polyline.of(body.mesh) for body in finite]
    for k, m in near_pairs(outlines):
        names = finite[k].name, finite[m].name
        size = min(finite[k].mesh.diameter, finite[m].mesh.diameter)
        least = outlines[k].tolerance + outlines[m].tolerance + ROUND_OFF * size
        depth, place = deepest_overlap(outlines[k], outlines[m], least + _interference(scene, names))
        if depth > 0.0:
            raise _overlap(names, depth, place)
    for rigid in scene.rigid:
        if is_finite(rigid.obstacle):
            for body, outline in zip(finite, outlines, strict=True):
                points = outline.points.reshape(-1, 2)
                gap = rigid.obstacle.gap(points, points)
                k, names = int(gap.argmin()), (body.name, rigid.name)
                if -gap[k] > ROUND_OFF * body.mesh.diameter + _interference(scene, names):
                    raise _overlap(names, -float(gap[k]), points[k])
    for body, outline in zip(finite, outlines, strict=True):
        _check_obstacles(body, outline)


def _check_obstacles(body: PlacedBody, outline: Polyline) -> None:
    """Check that fixed obstacles of finite size overlap a body nowhere deeper than on the parts that touch them."""
    points = outline.points.reshape(-1, 2)
    for obstacle, parts in finite_obstacles(body.scene):
        gap = obstacle.gap(points, points)
        touches = np.isin(outline.elements, np.concatenate([body.mesh.part(part) for part in parts]))
        touches = np.repeat(touches, outline.points.shape[1])
        beside = np.where(touches, np.inf, gap)
        depth, stated = -float(beside.min()), -float(gap[touches].min(initial=0.0))
        if depth > stated + ROUND_OFF * body.mesh.diameter:
            x, y = points[int(beside.argmin())]
            raise OverlapError(
                f"the obstacle of part {parts[0]!r} overlaps the body by {depth:.4g} beside this part, at ({x:.6g}, "
                f"{y:.6g}): move it away, or let the part include all that may touch it"
            )


def is_finite(obstacle: Obstacle) -> bool:
    """Whether an obstacle is of finite size, and its distance is known on all sides of it."""
    return isinstance(obstacle, RigidCircle | RigidPolygon)


def finite_obstacles(scene: BodyScene) -> list[tuple[Obstacle, list[str]]]:
    """Return the different fixed obstacles of finite size of a body, each with the parts that may touch it."""
    found: list[tuple[Obstacle, list[str]]] = []
    for part, obstacle in scene.obstacles.items():
        if is_finite(obstacle):
            parts = next((known for other, known in found if other == obstacle), None)
            if parts is None:
                found.append((obstacle, [part]))
            else:
                parts.append(part)
    return found


def _interference(scene: Scene, names: tuple[str, str]) -> float:
    """Return the largest interference of the contacts between two bodies."""
    bodies = {pair.name: {side.partition(".")[0] for side in pair.sides} for pair in scene.contacts}
    return max((pair.interference for pair in scene.contacts if bodies[pair.name] == set(names)), default=0.0)


def _overlap(names: tuple[str, str], depth: float, place: FloatArray) -> OverlapError:
    one, two = names
    return OverlapError(
        f"bodies {one!r} and {two!r} overlap by {depth:.4g} at ({place[0]:.6g}, {place[1]:.6g}): move them apart, or "
        "state a contact with an interference between them"
    )
